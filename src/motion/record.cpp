#include "bielle/motion/record.h"

#include <limits>
#include <optional>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/footsteps.h"
#include "dynamics/largest_gaps.h"
#include "math/largest.h"
#include "math/so3.h"
#include "math/upright.h"
#include "motion/record_tables.h"

namespace bielle {
namespace {

void recordNode(const Model& model, Workspace& ws, const VectorXd& x, int k, MotionRecord& record) {
  record.q.row(k) = x.head(model.nq());
  record.v.row(k) = x.segment(model.nq(), model.nv());
  updatePositions(model, ws, x.head(model.nq()));
  record.com.row(k) = calcCom(model, ws);
  const ClosureGap gap = calcLargestGaps(model, ws);
  record.gap.row(k) << gap.position, gap.angle;
}

void recordStage(const RobotProblem& problem, RobotEvaluator& evaluator, const VectorXd& x, const VectorXd& u, int k,
                 MotionRecord& record) {
  record.u.row(k) = u.head(record.u.cols());
  record.closure_wrenches.row(k).setZero();
  record.contact_wrenches.row(k).setZero();
  if (problem.spec(k).kind == StageKind::Impact) {  // no time, so no forces
    record.a.row(k).setZero();
    if (record.has_midpoints) {
      record.q_mid.row(k) = record.q.row(k);
      record.v_mid.row(k) = record.v.row(k);
    }
    return;
  }
  const RobotEvaluation& at = evaluator.evaluate(k, x, u);
  if (at.status != NumericalStatus::Ok) {
    for (RowMatrixXd* table :
         {&record.a, &record.closure_wrenches, &record.contact_wrenches, &record.q_mid, &record.v_mid})
      if (table->cols() > 0) table->row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  record.a.row(k) = at.a;
  if (record.has_midpoints) {
    record.q_mid.row(k) = at.q_mid;
    record.v_mid.row(k) = at.v_mid;
  }
  const ConstraintSet& set = problem.spec(k).constraints;
  for (int c = 0; c < static_cast<int>(set.closures.size()); ++c) {
    const Closure& closure = set.closures[c];
    const bool loop = c < set.num_loops;
    const int index = loop ? c : set.getContact(c);
    (loop ? record.closure_wrenches : record.contact_wrenches).block<1, 6>(k, 6 * index) =
        expandRows(closure, at.lambda.segment(set.offsets[c], getRows(closure.kind)));
  }
}

}  // namespace

void startRecord(const Model& model, int stages, MotionRecord& record) {
  record.q_names = makePositionNames(model);
  record.v_names = makeVelocityNames(model);
  record.u_names = getNames(model.motors());
  record.closure_names = getNames(model.closures());
  record.contact_names = getNames(model.contacts());
  record.time.resize(stages + 1);
  for (const RecordTable& table : listTables(record))
    (record.*table.data).resize(stages + (table.per == RecordTable::Per::Node ? 1 : 0), table.columns.size());
}

void requireWhole(const MotionRecord& record) {
  const Eigen::Index nodes = record.time.size();
  const auto require = [](bool holds, const std::string& array) {
    if (!holds)
      throw InputError("", "record, array '" + array + "'", "its shape does not match the names and the times",
                       "give one row per node, or per stage, and one column per name");
  };
  require(nodes > 0, "time");
  for (const RecordTable& table : listTables(record)) {
    const RowMatrixXd& data = record.*table.data;
    require(data.rows() == nodes - (table.per == RecordTable::Per::Stage ? 1 : 0) &&
                data.cols() == static_cast<Eigen::Index>(table.columns.size()),
            table.array);
  }
  const Eigen::Index entries = MotionRecord::kFootholdEntries * static_cast<Eigen::Index>(record.contact_names.size());
  require(record.footholds.size() == 0 || (record.footholds.rows() == nodes && record.footholds.cols() == entries),
          "footholds");
  require(record.cycle.size() == 0 || record.cycle.size() == kCycleEntries, "cycle");
}

std::vector<RecordTable> listTables(const MotionRecord& r) {
  using Per = RecordTable::Per;
  using R = MotionRecord;
  std::vector<RecordTable> tables = {
      {"q", "q", Per::Node, r.q_names, &R::q, 0},
      {"v", "v", Per::Node, r.v_names, &R::v, 0},
      {"a", "a", Per::Stage, r.v_names, &R::a, 0},
      {"u", "u", Per::Stage, r.u_names, &R::u, 0},
      {"closure_wrenches", "closure", Per::Stage, makeWrenchNames(r.closure_names), &R::closure_wrenches, 6},
      {"contact_wrenches", "contact", Per::Stage, makeWrenchNames(r.contact_names), &R::contact_wrenches, 6},
      {"com", "com", Per::Node, {"x", "y", "z"}, &R::com, 0},
      {"gap", "gap", Per::Node, {"position", "angle"}, &R::gap, 0}};
  if (!r.has_midpoints) return tables;
  tables.push_back({"q_mid", "q_mid", Per::Stage, r.q_names, &R::q_mid, 0});
  tables.push_back({"v_mid", "v_mid", Per::Stage, r.v_names, &R::v_mid, 0});
  return tables;
}

MotionRecord makeRecord(const Motion& motion, const ShootingTrajectory& trajectory) {
  const RobotProblem& problem = *motion.problem;
  RobotEvaluator evaluator(problem);
  const Model& model = problem.model();
  const int stages = problem.numStages();
  MotionRecord record;
  record.has_midpoints = problem.spec(0).step == StepRule::Midpoint;
  startRecord(model, stages, record);
  Workspace ws(model);
  double time = 0;
  for (int k = 0; k <= stages; ++k) {
    record.time[k] = time;
    recordNode(model, ws, trajectory.xs[k], k, record);
    if (k == stages) break;
    recordStage(problem, evaluator, trajectory.xs[k], trajectory.us[k], k, record);
    time += problem.getTimeScale(k, trajectory.xs[k], trajectory.us[k]) * problem.spec(k).dt;
  }
  if (motion.cycle) {
    const SE3& X = *motion.cycle;
    record.cycle = Eigen::Vector4d(time, X.p.x(), X.p.y(), calcHeading(X));
  }
  return record;
}

MotionTrack makeTrack(const Model& model, const MotionRecord& record) {
  MotionTrack track;
  track.time.assign(record.time.begin(), record.time.end());
  track.contacts = record.contact_names;
  Workspace ws(model);
  SE3 upright;
  for (Eigen::Index k = 0; k < record.time.size(); ++k) {
    updatePlacements(model, ws, record.q.row(k).transpose());
    track.com.push_back(record.com.row(k));
    const SE3& base = ws.X_WB[std::min(1, model.numBodies() - 1)];
    if (k == 0) upright.R = findUprightAxes(base.R.row(2));
    track.heading.push_back(calcHeading(base * upright));
    track.feet.emplace_back();
    for (const ContactFrame& contact : model.contacts())
      track.feet.back().push_back(getPlacement(ws, contact.body, contact.X_BF));
    if (k == record.contact_wrenches.rows()) break;
    double load = 0;
    for (size_t c = 0; c < model.contacts().size(); ++c) load += record.contact_wrenches.block<1, 3>(k, 6 * c).norm();
    track.load.push_back(load);
  }
  return track;
}

Slip calcSlip(const Motion& motion, const MotionTrack& track) {
  Slip slip;
  const Model& model = motion.problem->model();
  std::vector<std::optional<SE3>> touch_down(model.contacts().size());
  for (size_t k = 0; k < track.feet.size(); ++k) {
    std::vector<bool> stands(model.contacts().size(), false);
    for (const ContactTarget& target : motion.schedule.getPhase(static_cast<int>(k)).contacts) {
      const ContactFrame& contact = model.contacts()[target.contact];
      const SE3& X_WF = track.feet[k][target.contact];
      std::optional<SE3>& start = touch_down[target.contact];
      if (!start) start = X_WF;
      const SE3 moved = start->inverseTimes(X_WF);
      slip.position = getLarger(slip.position, moved.p.norm());
      if (contact.kind == ContactKind::Surface6D) slip.angle = getLarger(slip.angle, log3(moved.R).norm());
      if (contact.kind == ContactKind::Edge5D)  // its direction
        slip.angle = getLarger(slip.angle, moved.R.col(0).tail<2>().norm());
      stands[target.contact] = true;
    }
    for (size_t c = 0; c < stands.size(); ++c)
      if (!stands[c]) touch_down[c].reset();
  }
  return slip;
}

}  // namespace bielle
