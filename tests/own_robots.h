#pragma once
// The robots of this project, whatever $BIELLE_ROBOTS names.
#include <string>

#include "bielle/robots/robot_loader.h"

namespace bielle::testing {

inline LoadedRobot loadOwn(const std::string& name) { return loadRobot(BIELLE_SOURCE_DIR "/robots/" + name); }

/// Bipetto, read once.
inline const Model& getBipetto() {
  static const LoadedRobot robot = loadOwn("bipetto");
  return robot.model;
}

}  // namespace bielle::testing
