#pragma once
// Worlds of engines in programs of their own (outside_engine.h): mechanisms of hinges, slides and universal joints, closed by
// balls and hinges, with springs between points; no contact, no stops, no push. Steps are fixed.
#include <memory>
#include <string>

#include "bielle/worlds/world.h"

namespace bielle::loops {

class ProcessWorld : public worlds::World {
 public:
  // Of its steps since the start, s.
  virtual double cpu() const = 0;

 protected:
  using World::World;
};

// \throws InputError when the mechanism has other parts, or the program refuses it
std::unique_ptr<ProcessWorld> makeDartWorld(const Model& model, double time_step);
std::unique_ptr<ProcessWorld> makeOdeWorld(const Model& model, double time_step);

// Today's MuJoCo: npm's @mujoco/mujoco, WebAssembly in node, from the directory $BIELLE_NODE_MODULES.
bool hasMujoco3();
enum class Mujoco3Integrator { RungeKutta = 1, Discrete = 4 };
// Closures are as stiff as the steps allow.
std::unique_ptr<ProcessWorld> makeMujoco3World(const Model& model, double time_step, Mujoco3Integrator integrator);

}  // namespace bielle::loops
