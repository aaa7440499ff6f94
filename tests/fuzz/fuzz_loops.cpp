// The file loop_closures.yaml beside the URDF of a small robot (tests/robot_directory.cpp): a model, or one clear error.
#include "robot_directory.h"
#include "robot_trial.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  static const std::string urdf = scratch.write("robot.urdf", testing::kToyUrdf);
  scratch.write("loop_closures.yaml", fuzz::toText(data, size));
  const testing::TrialResult result = testing::tryRobot(scratch.path());
  if (result.trial == testing::Trial::Wrong) fuzz::fail(result.message);
  return 0;
}
