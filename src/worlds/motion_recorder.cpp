#include "worlds/motion_recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/names.h"
#include "dynamics/largest_gaps.h"
#include "math/largest.h"
#include "motion/record_tables.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Energy that motors, pushes and losses have moved between two instants, J.
double calcExchange(const Books& before, const Books& now) {
  return std::abs(now.motor_work - before.motor_work) + std::abs(now.push_work - before.push_work) +
         std::abs(now.contact_loss - before.contact_loss) + std::abs(now.stop_loss - before.stop_loss) +
         std::abs(now.other_loss - before.other_loss);
}

bool isWithinStops(const Model& model, const VectorXd& q) {
  for (const Joint& joint : model.joints()) {
    if (!hasStops(joint.kind)) continue;
    const auto at = q.segment(joint.idx_q, joint.nv).array();
    if (!(at >= model.lowerLimits().segment(joint.idx_v, joint.nv).array()).all() ||
        !(at <= model.upperLimits().segment(joint.idx_v, joint.nv).array()).all())
      return false;
  }
  return true;
}

}  // namespace

MotionRecorder::MotionRecorder(const World& world, int stages)
    : world_(world), model_(world_.model()), loops_(makeConstraintSet(model_)), terrain_(world.ground()), ws_(model_) {
  startRecord(model_, stages, record_);
}

void MotionRecorder::addNode(const std::vector<PredictedFoothold>& footholds) {
  const VectorXd &q = world_.configuration(), &v = world_.velocity();
  record_.time[node_] = world_.time();
  record_.q.row(node_) = q;
  record_.v.row(node_) = v;
  updatePositions(model_, ws_, q);
  record_.com.row(node_) = calcCom(model_, ws_);
  const ClosureGap gap = calcLargestGaps(model_, ws_);
  record_.gap.row(node_) << gap.position, gap.angle;
  if (node_ > 0)
    record_.a.row(node_ - 1) =
        (record_.v.row(node_) - record_.v.row(node_ - 1)) / (record_.time[node_] - record_.time[node_ - 1]);
  addFootholds(footholds);
  ++node_;
  books_.push_back(world_.books());
  if (node_ > 1) exchanged_ += calcExchange(books_[books_.size() - 2], books_.back());
}

void MotionRecorder::addStage() {
  const int stage = node_ - 1;
  record_.u.row(stage) = world_.torques();
  record_.closure_wrenches.row(stage).setConstant(kUnknown);
  for (size_t c = 0; c < world_.feet().size(); ++c)
    record_.contact_wrenches.block<1, 6>(stage, 6 * c) = world_.feet()[c].wrench;
}

void MotionRecorder::addClosureForces() {
  const int stage = node_ - 1;
  if (loops_.rows == 0 || !record_.contact_wrenches.row(stage).isZero(0) ||
      !isWithinStops(model_, world_.configuration()))
    return;
  if (updateConstrainedDynamics(model_, ws_, cws_, loops_, world_.configuration(), world_.velocity(),
                                calcMotorForces(model_, world_.torques())) != NumericalStatus::Ok)
    return;
  for (size_t c = 0; c < loops_.closures.size(); ++c) {
    const Closure& closure = loops_.closures[c];
    record_.closure_wrenches.block<1, 6>(stage, 6 * static_cast<Eigen::Index>(c)) =
        expandRows(closure, cws_.lambda.segment(loops_.offsets[c], getRows(closure.kind))).transpose();
  }
}

void MotionRecorder::noteAdvance(double seconds) {
  happened.world_seconds += seconds;
  happened.largest_gap = getLarger(happened.largest_gap, world_.gap());
  for (const FootReport& foot : world_.feet()) happened.largest_slip = getLarger(happened.largest_slip, foot.slip);
  for (size_t c = 0; c < world_.feet().size(); ++c) noteFoot(static_cast<int>(c));
}

// Of a sole its own normal counts, of an edge its direction; a point cannot turn.
void MotionRecorder::noteFoot(int c) {
  constexpr double kLoaded = 0.25;  // of the weight
  constexpr int kPoints = 5;        // along each side
  const ContactFrame& contact = model_.contacts()[c];
  const SE3& X_WF = world_.feet()[c].X_WF;
  const Vector3d normal = X_WF.R.transpose() * terrain_.find(X_WF.p.x(), X_WF.p.y()).normal;  // in the foot's axes
  if (normal.dot(world_.feet()[c].wrench.head<3>()) < kLoaded * model_.mass() * model_.gravity().norm()) return;
  if (contact.kind == ContactKind::Surface6D)
    happened.largest_tilt.note(std::atan2(normal.head<2>().norm(), normal.z()), world_.time(), c);
  else if (contact.kind == ContactKind::Edge5D)
    happened.largest_tilt.note(std::abs(std::atan2(normal.x(), normal.tail<2>().norm())), world_.time(), c);
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j) {
      const auto place = [](int k, double half) { return (2.0 * k / (kPoints - 1) - 1) * half; };
      const Vector3d point(place(i, contact.half_length), place(j, contact.half_width), 0);
      happened.largest_depth.note(terrain_.touch(X_WF.act(point)).depth, world_.time(), c);
    }
}

Execution MotionRecorder::describe(double since) const {
  Execution out = happened;
  out.outcome = Outcome::Running;
  out.duration = world_.time();
  out.start = books_.front();
  out.end = books_.back();
  out.integration = world_.integration();
  out.imbalance = calcImbalance(out.start, out.end);
  out.energy_balance = exchanged_ > 0 ? out.imbalance / exchanged_ : 0;
  out.record = getRecord(since);
  return out;
}

MotionRecord MotionRecorder::getRecord(double since) const {
  int first = 0;
  while (first + 2 < node_ && record_.time[first] < since) ++first;
  MotionRecord record = record_;
  if (record.footholds.rows() > 0) record.footholds = record_.footholds.middleRows(first, node_ - first);
  record.time = record_.time.segment(first, node_ - first);
  for (const RecordTable& table : listTables(record))
    record.*table.data =
        (record_.*table.data).middleRows(first, node_ - first - (table.per == RecordTable::Per::Node ? 0 : 1));
  return record;
}

void MotionRecorder::addFootholds(const std::vector<PredictedFoothold>& footholds) {
  constexpr int kEntries = MotionRecord::kFootholdEntries;
  RowMatrixXd& table = record_.footholds;
  if (table.rows() == 0 && !footholds.empty())
    table.setConstant(record_.time.size(), kEntries * static_cast<int>(model_.contacts().size()), kUnknown);
  for (const PredictedFoothold& foothold : footholds)
    table.row(node_).segment<kEntries>(kEntries * foothold.contact) << foothold.time, foothold.X_WF.p.transpose(),
        Eigen::Quaterniond(foothold.X_WF.R).coeffs().transpose();
}

double calcImbalance(const Books& start, const Books& end) {
  return end.energy() - start.energy() - end.motor_work - end.push_work + end.contact_loss + end.stop_loss +
         end.other_loss;
}

}  // namespace bielle::worlds
