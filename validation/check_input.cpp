#include "check_input.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/formats/reader.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/serial_model.h"
#include "results/happened_summary.h"

namespace bielle::validation {
namespace {

const char* const kRemedy = "recreate it with `bielle solve`";

void require(bool ok, const CheckedMotion& motion, const std::string& element, const std::string& problem) {
  if (!ok) throw InputError(motion.summary.file, element, problem, kRemedy);
}

bool isFinite(const Ground& ground) {
  bool finite = std::isfinite(ground.height) && std::isfinite(ground.friction);
  for (const GroundStep& step : ground.steps)
    finite =
        finite && step.top.allFinite() && std::isfinite(step.length + step.width + step.yaw + step.pitch + step.roll);
  return finite;
}

void checkNames(const CheckedMotion& motion) {
  const Model& model = motion.model;
  const MotionRecord& record = motion.record;
  const auto compare = [&](const char* what, const std::vector<std::string>& names,
                           const std::vector<std::string>& expected) {
    if (names == expected) return;
    throw InputError(motion.summary.file, std::string("trajectory of '") + model.name() + "'",
                     std::string("its ") + what + " are not those of the robot",
                     "check it with the robot it was made for, or recreate it");
  };
  compare("positions", record.q_names, makePositionNames(model));
  compare("velocities", record.v_names, makeVelocityNames(model));
  compare("motors", record.u_names, getNames(model.motors()));
  compare("closures", record.closure_names, getNames(model.closures()));
  compare("contacts", record.contact_names, getNames(model.contacts()));
}

void checkPhases(const CheckedMotion& motion) {
  int node = 0;
  for (const MotionSummary::Phase& phase : motion.summary.phases) {
    const std::string element = "phase '" + phase.name + "'";
    require(phase.start_node == node, motion, element, "it does not start where the previous phase ends");
    require(phase.nodes >= 0 && phase.nodes <= motion.numStages() - node, motion, element,
            "its nodes do not fit into the trajectory");
    node += phase.nodes;
    require(phase.time_step >= 0 && std::isfinite(phase.time_step), motion, element + ", entry 'time_step_s'",
            "it is negative, or not finite");
    std::set<std::string> names;
    for (const MotionSummary::Stance& stance : phase.stances) {
      require(motion.model.findContact(stance.contact) >= 0, motion, element,
              "the robot has no contact '" + stance.contact + "'");
      require(names.insert(stance.contact).second, motion, element, "'" + stance.contact + "' stands twice");
      require(stance.X_WT.R.allFinite() && stance.X_WT.p.allFinite(), motion, element, "a place is not finite");
    }
  }
  require(node == motion.numStages(), motion, "phases", "they are not as long as the trajectory");
}

}  // namespace

int CheckedMotion::findPhase(int node) const {
  const std::vector<MotionSummary::Phase>& phases = summary.phases;
  for (size_t i = 0; i < phases.size(); ++i)
    if (node < phases[i].start_node + phases[i].nodes) return static_cast<int>(i);
  return static_cast<int>(phases.size()) - 1;
}

std::vector<ContactTarget> CheckedMotion::getContacts(int phase) const {
  std::vector<ContactTarget> contacts;
  for (const MotionSummary::Stance& stance : summary.phases[phase].stances)
    contacts.push_back({model.findContact(stance.contact), stance.X_WT, 0, 0});
  return contacts;
}

bool CheckedMotion::stands(int contact, int node) const {
  if (has_happened)
    return record.contact_wrenches.block<1, 6>(std::min(node, numStages() - 1), 6 * contact).squaredNorm() > 0;
  for (const MotionSummary::Stance& stance : summary.phases[findPhase(node)].stances)
    if (stance.contact == model.contacts()[contact].name) return true;
  return false;
}

void checkConsistency(const CheckedMotion& motion) {
  require(motion.record.has_midpoints == (motion.summary.step == StepRule::Midpoint), motion, "entry 'step'",
          "the trajectory has midpoints but the summary names Euler steps, or the reverse");
  checkNames(motion);
  require(motion.numStages() >= 1, motion, "trajectory", "it has no stages");
  require(isFinite(motion.summary.ground) && motion.summary.ground.friction >= 0, motion, "entry 'ground'",
          "a number is not finite, or the friction is negative");
  checkPhases(motion);
}

CheckedMotion readMotion(const std::string& directory) {
  CheckedMotion motion;
  const AnySummary summary = readAnySummary(directory);
  motion.summary = summary.facts;
  motion.has_happened = summary.has_happened;
  motion.record = readResultRecord(directory);
  const LoadedRobot robot = loadRobotOf(directory);
  motion.warnings = robot.warnings;
  motion.model = robot.model;
  if (motion.summary.run.model == Belief::Serial)
    motion.model = makeSerialModel(motion.model, makeStandingPosture(motion.model),
                                   parseSerialArmature(motion.summary.run.serial_armature))
                       .model;
  checkConsistency(motion);
  return motion;
}

}  // namespace bielle::validation
