#include "design/design_motions.h"

#include <algorithm>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/footsteps.h"
#include "bielle/motion/serial_model.h"
#include "bielle/results/result.h"
#include "math/upright.h"
#include "model/number_text.h"

namespace bielle {

std::string describeMotion(const DesignMotion& motion) {
  std::string text = motion.name;
  if (motion.payload.mass > 0) text += " with " + formatNumber(motion.payload.mass, "%.4g") + " kg";
  if (motion.weight != 1) text += ", weight " + formatNumber(motion.weight, "%.4g");
  return text;
}

std::vector<size_t> groupByPayload(const std::vector<DesignMotion>& motions) {
  std::vector<size_t> groups;
  for (const DesignMotion& motion : motions) {
    const auto has_same = [&](const DesignMotion& other) { return other.payload == motion.payload; };
    groups.push_back(static_cast<size_t>(std::find_if(motions.begin(), motions.end(), has_same) - motions.begin()));
  }
  return groups;
}

Motion makeDesignMotion(const Model& model, const DesignMotion& motion, const StandingRobot& standing) {
  Motion made = makeMotion(model, motion.plan(model, standing), {Formulation::Reduced, StepRule::Euler});
  requireOption(!made.cycle, motion.name + ".periodic", "slopes of costs are those of motions whose start is given",
                "leave it out");
  return made;
}

namespace {

std::vector<double> listSteps(const RobotProblem& problem) {
  std::vector<double> dt;
  for (int k = 0; k < problem.numStages(); ++k) dt.push_back(problem.spec(k).dt);
  return dt;
}

}  // namespace

std::vector<GoalOutcome> measureGoals(const Model& model, const std::vector<Goal>& goals,
                                      const ContactSchedule& schedule, const std::vector<double>& dt,
                                      const std::vector<VectorXd>& xs) {
  MotionTrack track;
  for (const ContactFrame& contact : model.contacts()) track.contacts.push_back(contact.name);
  Workspace ws(model);
  SE3 upright;
  double time = 0;
  for (size_t k = 0; k < xs.size() && !goals.empty(); ++k) {
    updatePlacements(model, ws, xs[k].head(model.nq()));
    track.time.push_back(time);
    track.com.push_back(calcCom(model, ws));
    const SE3& base = ws.X_WB[static_cast<size_t>(std::min(1, model.numBodies() - 1))];
    if (k == 0) upright.R = findUprightAxes(base.R.row(2));
    track.heading.push_back(calcHeading(base * upright));
    track.feet.emplace_back();
    for (const ContactFrame& contact : model.contacts())
      track.feet.back().push_back(getPlacement(ws, contact.body, contact.X_BF));
    if (k == dt.size()) break;
    time += dt[k];
    track.load.push_back(static_cast<double>(schedule.getPhase(static_cast<int>(k)).contacts.size()));
  }
  std::vector<GoalOutcome> out;
  for (const Goal& goal : goals) out.push_back({goal, measureGoal(goal, track)});
  return out;
}

std::vector<GoalOutcome> measureGoals(const Motion& motion, const ShootingTrajectory& trajectory) {
  return measureGoals(motion.problem->model(), motion.goals, motion.schedule, listSteps(*motion.problem),
                      trajectory.xs);
}

namespace {

// The message of a motion that was not solved.
std::string describeFailure(const std::string& motion, const FddpSummary& summary) {
  return motion + ": " + getName(summary.termination) + (summary.message.empty() ? "" : ": " + summary.message);
}

// \param start  or null   \param out  with the loaded robot, that of the motion
void solve(const Motion& motion, const ShootingTrajectory* start, const FddpOptions& solver,
           const std::vector<MotorConversion>& drives, MotionOutcome& out) {
  SolveOptions options;
  options.solver = solver;
  options.keep_apart = false;
  if (start) options.start = StartingPoint{*start};
  Solution solution = bielle::solve(motion, options);
  out.message = describeFailure(motion.name, solution.summary);
  if (!solution.converged()) return;
  out.measures = calcMotionMeasures(motion.problem->model(), listSteps(*motion.problem), solution.trajectory, drives);
  out.measures.cost = solution.summary.cost;
  out.goals = measureGoals(motion, solution.trajectory);
  out.missing = 0;
  out.solution = std::move(solution);
}

MotionOutcome load(const Model& model, const DesignMotion& motion) {
  MotionOutcome out;
  out.loaded = std::make_unique<Model>(addPayload(model, motion.payload));
  return out;
}

// Starts from the solution of the start design: its postures with the loops closed again, its torques.
ShootingTrajectory makeClosedStart(const MotionRecord& record, const Motion& motion) {
  ShootingTrajectory trajectory = makeStart(record, motion).trajectory;
  const Model& model = motion.problem->model();
  for (VectorXd& x : trajectory.xs) {
    const AssemblyResult closed = closeConfiguration(model, x.head(model.nq()));
    if (closed.status == NumericalStatus::Ok) x.head(model.nq()) = closed.q;
  }
  return trajectory;
}

// Extracts the coordinates of the serial model from a motion of the closed one.
MotionRecord restrictRecord(const Model& closed, const Model& serial, const Motion& motion, MotionRecord record) {
  const MotionRecord names = makeRecord(motion, motion.guess);
  RowMatrixXd q(record.q.rows(), serial.nq()), v(record.v.rows(), serial.nv()), a(record.a.rows(), serial.nv());
  for (Eigen::Index k = 0; k < q.rows(); ++k) {
    q.row(k) = restrictConfiguration(closed, serial, record.q.row(k));
    v.row(k) = restrictVelocity(closed, serial, record.v.row(k));
    if (k < a.rows()) a.row(k) = restrictVelocity(closed, serial, record.a.row(k));
  }
  record.q = q, record.v = v, record.a = a;
  record.q_names = names.q_names, record.v_names = names.v_names;
  return record;
}

// \param q0  standing posture, here and below
void addKeptMotion(const Model& closed, const VectorXd& q0, const DesignMotion& motion, SolvedMotion& solved) {
  const SerialModel serial = makeSerialModel(closed, q0);
  const Motion serial_motion = makeDesignMotion(serial.model, motion, makeStandingRobot(serial.model));
  solved.serial =
      makeSerialTrajectory(serial_motion, restrictRecord(closed, serial.model, serial_motion, solved.record));
}

}  // namespace

LiftResult liftMotion(const Model& model, const VectorXd& q0, const SerialTrajectory& kept) {
  return lift(model, makeSerialModel(model, q0), kept);
}

namespace {

// Starts from the motion of the start design with the motors recomputed, which is nearly a motion of this design.
// If that fails, starts from its postures and torques.
ShootingTrajectory chooseStart(const Model& model, const SolvedMotion& solved, const Motion& motion) {
  if (solved.serial) {
    LiftResult lifted = liftMotion(model, motion.problem->initialState().head(model.nq()), *solved.serial);
    ShootingTrajectory& trajectory = lifted.trajectory;
    if (lifted.lifted() && trajectory.us.size() == motion.guess.us.size() &&
        trajectory.xs.size() == motion.guess.xs.size())
      return std::move(trajectory);
  }
  return makeClosedStart(solved.record, motion);
}

}  // namespace

SolvedMotion solveStartMotion(const Model& model, const DesignMotion& motion, const FddpOptions& options, int postures,
                              bool must_keep) {
  MotionOutcome outcome = load(model, motion);
  const StandingRobot standing = makeStandingRobot(*outcome.loaded);
  solve(makeDesignMotion(*outcome.loaded, motion, standing), nullptr, options, {}, outcome);
  if (outcome.missing > 0)
    throw InputError(model.name(), "start design", outcome.message, "request a motion that the robot can make");
  const ShootingTrajectory& solution = outcome.solution->trajectory;
  const Motion& solved = outcome.solution->motion;
  SolvedMotion out{makeRecord(solved, solution), solved.goals, solved.schedule, {}, {}};
  const int last = static_cast<int>(solution.us.size());
  for (int p = 0; p < postures; ++p)
    out.postures.push_back(solution.xs[p * last / std::max(1, postures - 1)].head(model.nq()));
  try {
    addKeptMotion(*outcome.loaded, standing.q, motion, out);
  } catch (const InputError&) {  // no serial chain, or impacts: motions can be solved but not kept
    if (must_keep) throw;
  }
  return out;
}

MotionOutcome remakeMotion(const Model& model, const DesignMotion& motion, const SolvedMotion* start,
                           const FddpOptions& options, const std::vector<MotorConversion>& drives) {
  MotionOutcome out = load(model, motion);
  const Motion made = makeDesignMotion(*out.loaded, motion, makeStandingRobot(*out.loaded));
  std::optional<ShootingTrajectory> from;
  if (start) from = chooseStart(*out.loaded, *start, made);
  solve(made, from ? &*from : nullptr, options, drives, out);
  return out;
}

MotionOutcome solveUsually(const Model& model, const DesignMotion& motion, const std::vector<MotorConversion>& drives,
                           ShootingTrajectory& trajectory) {
  MotionOutcome out = load(model, motion);
  MotionRequest request;
  request.planner = [plan = motion.plan](const Model& robot, const StandingRobot& standing, const OptionSet&) {
    return plan(robot, standing);
  };
  if (motion.request) request = *motion.request;
  const MotionResult result = makeResult({model.name(), "", {}}, bielle::solve(makeMotion(*out.loaded, request)));
  out.message = describeFailure(motion.name, result.solver);
  if (!result.converged()) return out;
  out.missing = 0;
  out.goals = result.goals;
  const MotionRecord& record = result.record;
  std::vector<double> dt;
  for (Eigen::Index k = 0; k < record.time.size(); ++k) {
    const bool is_stage = k < record.u.rows(), has_middle = is_stage && record.has_midpoints;
    VectorXd x(model.nq() + model.nv());
    x << record.q.row(k).transpose(), (has_middle ? record.v_mid : record.v).row(k).transpose();
    trajectory.xs.push_back(x);
    if (!is_stage) continue;
    trajectory.us.emplace_back(record.u.row(k));
    dt.push_back(record.time[k + 1] - record.time[k]);
  }
  out.measures = calcMotionMeasures(*out.loaded, dt, trajectory, drives);
  out.measures.cost = result.solver.cost;
  return out;
}

MotionOutcome keepMotion(const Model& model, const DesignMotion& motion, const SolvedMotion& start,
                         const std::vector<MotorConversion>& drives, double margin) {
  MotionOutcome out = load(model, motion);
  const SerialTrajectory& kept = *start.serial;
  out.lifted = liftMotion(*out.loaded, makeStandingPosture(*out.loaded), kept);
  const LiftResult& lifted = out.lifted;
  out.missing = 1 - static_cast<double>(lifted.dt.size()) / static_cast<double>(kept.dt.size() + 1);
  if (!lifted.lifted()) {
    out.message = lifted.nodes.empty() ? "nothing could be lifted" : lifted.nodes.back().message;
    return out;
  }
  out.measures = calcMotionMeasures(*out.loaded, lifted.dt, lifted.trajectory, drives);
  out.goals = measureGoals(*out.loaded, start.goals, start.schedule, lifted.dt, lifted.trajectory.xs);
  out.missing = 0;
  const auto near = std::find_if(lifted.nodes.begin(), lifted.nodes.end(),
                                 [margin](const LiftNode& node) { return node.margin < margin; });
  if (near == lifted.nodes.end()) return out;
  out.missing = static_cast<double>(lifted.nodes.end() - near) / static_cast<double>(lifted.nodes.size());
  out.message = "a linkage is closer to a dead point than the margin allows: " + std::to_string(near->margin) + " < " +
                std::to_string(margin);
  return out;
}

}  // namespace bielle
