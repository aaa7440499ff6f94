// A URDF for Drake: a model that is one again after it is written for Drake, or one clear error.
#include "bielle/robots/robot_loader.h"
#include "formats/drake.h"
#include "robot_trial.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  scratch.write("robot.urdf", fuzz::toText(data, size));
  const testing::TrialResult result = testing::tryRobot(scratch.path());
  if (result.trial == testing::Trial::Wrong) fuzz::fail(result.message);
  if (result.trial != testing::Trial::Valid) return 0;
  const Model model = loadRobot(scratch.path()).model;
  if (model.nv() > 300) return 0;
  scratch.write("robot.urdf", formatDrake(model).urdf);
  const Model back = loadRobot(scratch.path()).model;
  if (back.nq() != model.nq() || back.nv() != model.nv() || back.nu() != model.nu()) fuzz::fail("not the same joints");
  return 0;
}
