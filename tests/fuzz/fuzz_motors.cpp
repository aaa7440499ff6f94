// A catalogue of motors, of which a robot takes the one named m: a model, or one clear error.
#include "robot_directory.h"
#include "robot_trial.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  static const std::string urdf = scratch.write("robot.urdf", testing::kToyUrdf),
                           yaml = scratch.write("robot.yaml",
                                                "motor_catalogue: catalogue.yaml\n"
                                                "motors: {shoulder: {type: m}, rod_joint: {type: m, ratio: 50}}\n");
  scratch.write("catalogue.yaml", fuzz::toText(data, size));
  const testing::TrialResult result = testing::tryRobot(scratch.path());
  if (result.trial == testing::Trial::Wrong) fuzz::fail(result.message);
  return 0;
}
