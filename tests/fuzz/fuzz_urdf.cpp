// A URDF without a YAML file: a model, or one clear error.
#include "robot_trial.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  scratch.write("robot.urdf", fuzz::toText(data, size));
  const testing::TrialResult result = testing::tryRobot(scratch.path());
  if (result.trial == testing::Trial::Wrong) fuzz::fail(result.message);
  return 0;
}
