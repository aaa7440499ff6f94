// A file of USD in text form: a model, or one clear error.
#include "robot_trial.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  const testing::TrialResult result = testing::tryRobot(scratch.write("robot.usda", fuzz::toText(data, size)));
  if (result.trial == testing::Trial::Wrong) fuzz::fail(result.message);
  return 0;
}
