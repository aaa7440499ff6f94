#pragma once
// Models of MuJoCo from files, independent of ours.
#include <catch2/catch.hpp>
#include <memory>
#include <string>

#include "robot_directory.h"
#include "worlds/mujoco_model.h"

namespace bielle::testing {

using MjModel = std::unique_ptr<mjModel, void (*)(mjModel*)>;
using MjData = std::unique_ptr<mjData, void (*)(mjData*)>;

inline MjModel loadMujoco(const std::string& path) {
  char error[500] = "";
  MjModel model(mj_loadXML(path.c_str(), nullptr, error, sizeof error), mj_deleteModel);
  CAPTURE(std::string(error));
  REQUIRE(model);
  return model;
}

// Balls and universal joints as hinges one after the other.
inline MjModel loadHinges(const Model& model, ConstVectorRef q_ref) {
  MjcfOptions options;
  options.rotations = MjcfRotations::Hinges;
  const RobotDirectory directory;
  return loadMujoco(directory.write("robot.xml", formatMjcf(model, q_ref, options).xml));
}

}  // namespace bielle::testing
