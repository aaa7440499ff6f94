#pragma once
// The worlds in which problems are carried out, each by one number that makes it finer.
#include <memory>
#include <string>
#include <vector>

#include "bielle/worlds/world.h"

namespace bielle::loops {

struct Engine {
  const char* name;
  const char* title;
  const char* setting;           // what the number is
  std::vector<double> settings;  // from coarse to fine; steps are those of a problem of pace 1
  bool has_steps = false;        // the number is a time step
  std::unique_ptr<worlds::World> (*make)(const Model& model, double setting);
};

// Those that were built.
const std::vector<Engine>& getEngines();
// \throws InputError when there is none of this name
const Engine& getEngine(const std::string& name);

}  // namespace bielle::loops
