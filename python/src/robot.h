#pragma once
/// \file A robot as Python holds it: a model, and where it came from.
#include <memory>

#include "bielle/formats/reader.h"
#include "model_access.h"

namespace bielle::python {

using NamedSizes = std::vector<std::pair<std::string, double>>;

struct Robot {
  std::string name;              // as requested
  std::shared_ptr<Model> model;  // shared with all that is made of it
  std::string file, directory;   // empty: not from files
  std::vector<std::string> warnings;
  std::vector<LockedLoops> locked = {};
  std::vector<RodFriction> rod_frictions = {};
  NamedSizes play = {};  // by what has it, rad or m

  /// \throws ValueError when it was made without one
  const Model& get() const {
    if (!model) throw py::value_error("robot: it has no model; load_robot and generate_robot make robots");
    return *model;
  }
};

inline Wear makeWear(const NamedSizes& play, const std::vector<RodFriction>& frictions) {
  Wear wear{{}, frictions};
  for (const auto& [name, size] : play) wear.plays.push_back({name, size});
  return wear;
}

inline LoadedRobot toLoaded(const Robot& robot) {
  return {robot.get(), robot.warnings, robot.directory,
          robot.file,  robot.locked,   makeWear(robot.play, robot.rod_frictions)};
}

}  // namespace bielle::python
