#include <algorithm>
#include <filesystem>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "formats/aside_file.h"
#include "results/json_text.h"

namespace bielle {

SerialTrajectory makeSerialTrajectory(const Motion& motion, const MotionRecord& record) {
  const RobotProblem& problem = *motion.problem;
  const Model& model = problem.model();
  const int stages = problem.numStages();
  if (record.a.rows() != stages || record.q_names != makePositionNames(model) ||
      record.v_names != makeVelocityNames(model) || record.contact_names != getNames(model.contacts()))
    throw InputError(model.name(), "trajectory", "its stages, joints or contacts differ from those of this motion",
                     "recreate it with `bielle solve --model serial`");
  SerialTrajectory out;
  for (int k = 0; k <= stages; ++k) {
    out.q.push_back(record.q.row(k));
    out.v.push_back(record.v.row(k));
    if (k == stages) break;
    if (problem.spec(k).kind == StageKind::Impact)
      throw InputError(model.name(), "stage " + std::to_string(k), "it is a rigid impact, which cannot be lifted",
                       "solve the serial motion with `--set rigid_landing=false`");
    out.a.push_back(record.a.row(k));
    out.dt.push_back(problem.spec(k).dt);
    const ConstraintSet& set = problem.spec(k).constraints;
    out.constraints.push_back(set);
    VectorXd forces(set.rows);
    for (size_t c = 0; c < set.closures.size(); ++c) {
      const Closure& contact = set.closures[c];
      const Vector6d wrench = record.contact_wrenches.block<1, 6>(k, 6 * set.contacts[c]);
      forces.segment(set.offsets[c], getRows(contact.kind)) = selectRows(contact, wrench);
    }
    out.forces.push_back(forces);
  }
  return out;
}

MotionResult makeLiftedResult(const RunInfo& run, const Model& closed, const Motion& serial, const LiftResult& lifted,
                              double seconds) {
  Motion motion;
  motion.name = serial.name;
  motion.ground = serial.ground;
  motion.options = serial.options;
  for (const Goal& goal : serial.goals)  // if a lift stops early, those that it reached
    if (goal.last <= static_cast<int>(lifted.trajectory.us.size())) motion.goals.push_back(goal);
  int left = static_cast<int>(lifted.trajectory.us.size());
  for (ContactPhase phase : serial.schedule.phases) {
    phase.nodes = std::min(phase.nodes, left);
    left -= phase.nodes;
    for (ContactTarget& target : phase.contacts)
      target.contact = closed.findContact(serial.problem->model().contacts()[target.contact].name);
    if (phase.nodes > 0) motion.schedule.phases.push_back(phase);
  }
  const VectorXd& x0 = lifted.trajectory.xs.front();
  motion.problem = std::make_unique<RobotProblem>(closed, x0.head(closed.nq()), x0.tail(closed.nv()),
                                                  makeStages(lifted.dt, lifted.constraints), Formulation::Reduced);
  FddpSummary summary;
  summary.termination = lifted.lifted() ? FddpTermination::Converged : FddpTermination::Failed;
  summary.message = lifted.nodes.back().message;
  summary.seconds = seconds;
  for (const LiftNode& node : lifted.nodes) {
    summary.cost += (node.position_error * node.position_error + node.velocity_error * node.velocity_error) /
                    (2.0 * lifted.nodes.size());
    summary.iterations += node.evaluations;
  }
  return makeResult(run, {motion, lifted.trajectory, summary});
}

std::vector<std::string> writeLift(const std::string& directory, LiftMethod method, const LiftResult& lifted,
                                   const MotionResult* result) {
  makeOutputDirectory(directory);
  const std::string path = (std::filesystem::path(directory) / "lift.json").string();
  Json nodes = Json::array();
  for (const LiftNode& node : lifted.nodes)
    nodes.push_back({{"status", getName(node.status)},
                     {"position_error", node.position_error},
                     {"velocity_error", node.velocity_error},
                     {"acceleration_error", node.acceleration_error},
                     {"margin", node.margin},
                     {"evaluations", node.evaluations}});
  const LiftNode& last = lifted.nodes.back();
  Json json = {{"lifted", lifted.lifted()},
               {"method", getName(method)},
               {"failed_node", lifted.lifted() ? Json(nullptr) : Json(lifted.nodes.size() - 1)},
               {"status", getName(last.status)},
               {"message", last.message},
               {"joint", last.joint},
               {"nodes", nodes}};
  AsideFile file(path);
  file.write(formatJson(json) + "\n");
  std::vector<std::string> paths;
  if (result) paths = writeResult(directory, *result);
  file.commit();
  paths.push_back(path);
  return paths;
}

}  // namespace bielle
