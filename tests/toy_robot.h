#pragma once
// The toy of robot_directory.h as a model.
#include <catch2/catch.hpp>
#include <string>

#include "bielle/robots/robot_loader.h"
#include "robot_directory.h"

namespace bielle::testing {

inline const Joint& getJoint(const Model& model, const std::string& name) {
  REQUIRE(model.findJoint(name) >= 0);
  return model.joints()[model.findJoint(name)];
}

inline Model load(const std::string& urdf, const std::string& yaml, const LoadOptions& options = {}) {
  const RobotDirectory directory;
  return loadRobot(directory.writeRobot(urdf, yaml), options).model;
}

// The toy with two more lines of YAML.
inline Model loadWith(const std::string& yaml) { return load(kToyUrdf, std::string(kToyYaml) + yaml); }

}  // namespace bielle::testing
