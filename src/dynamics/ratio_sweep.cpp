#include <algorithm>
#include <cmath>

#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"
#include "dynamics/linkage_curve.h"
#include "math/constants.h"

namespace bielle {
namespace {

constexpr double kSmallestStep = 1e-7;    // of the default step
constexpr double kBeforeRankLoss = 0.99;  // of the step that leads to it

// A turn later, a cam is another one: its polynomial does not repeat.
bool followsPolynomial(const Model& model, int joint) {
  for (const Closure& closure : model.closures()) {
    const auto& terms = closure.terms;
    if (std::any_of(terms.begin(), terms.end(), [&](const CouplerTerm& t) { return t.joint == joint; }) &&
        std::any_of(terms.begin(), terms.end(), [](const CouplerTerm& t) { return !t.isLinear(); }))
      return true;
  }
  return false;
}

// q (-) q0 with angles up to whole turns.
VectorXd calcWrappedDifference(const Model& model, const VectorXd& q0, const VectorXd& q) {
  VectorXd d = model.difference(q0, q);
  for (int k = 0; k < model.nv(); ++k) {
    const int joint = model.dofs()[k].joint;
    const JointKind kind = model.joints()[joint].kind;
    if ((kind == JointKind::Revolute || kind == JointKind::Continuous || kind == JointKind::Universal) &&
        !followsPolynomial(model, joint))
      d[k] = std::remainder(d[k], 2 * kPi);
  }
  return d;
}

// The coordinate of a dof of a cluster that has a limit: its entry in q. Limits are those of joints of one coordinate.
struct Limit {
  int position;
  double lower, upper;
  std::string joint;
};

std::vector<Limit> listLimits(const Model& model, const ReducedCluster& cluster) {
  std::vector<Limit> limits;
  for (size_t i = 0; i < cluster.joints.size(); ++i) {
    const Joint& joint = model.joints()[cluster.joints[i]];
    if (joint.nq != joint.nv) continue;
    for (int k = 0; k < joint.nv; ++k) {
      const double lower = model.lowerLimits()[joint.idx_v + k], upper = model.upperLimits()[joint.idx_v + k];
      if (std::isfinite(lower) || std::isfinite(upper))
        limits.push_back({cluster.model.joints()[i + 1].idx_q + k, lower, upper, joint.name});
    }
  }
  return limits;
}

// Entry in q of the cluster of a joint that turns and is coupled by belts and gears alone, or -1. Ratios repeat with every
// turn of it, though the motor may need many until it is where it was, or may never come there.
int findGearedJoint(const Model& model, const Linkage& linkage, int joint) {
  const ReducedCluster& cluster = *linkage.cluster;
  const int index = linkage.joints[static_cast<size_t>(joint)];
  const JointKind kind = model.joints()[static_cast<size_t>(index)].kind;
  if (kind != JointKind::Revolute && kind != JointKind::Continuous) return -1;
  for (const Closure& closure : cluster.model.closures())
    if (closure.kind != ClosureKind::Coupler ||
        !std::all_of(closure.terms.begin(), closure.terms.end(), [](const CouplerTerm& t) { return t.isLinear(); }))
      return -1;
  const auto found = std::find(cluster.joints.begin(), cluster.joints.end(), index);
  return cluster.model.joints()[static_cast<size_t>(found - cluster.joints.begin()) + 1].idx_q;
}

// One direction of the curve from its start.
class Walk {
 public:
  Walk(const Model& model, const Linkage& linkage, int joint, LinkageCurve& curve, const SweepOptions& options)
      : model_(model),
        geared_(findGearedJoint(model, linkage, joint)),
        linkage_(linkage),
        curve_(curve),
        options_(options),
        limits_(listLimits(model, *linkage.cluster)) {}

  std::vector<RatioSample> samples;  // without the start
  std::string end;
  double turn = 0;  // length of the full turn, if there is one

  void run(const CurvePoint& start, double sign) {
    CurvePoint at = start, next;
    int branch = 0;
    double h = options_.step;
    while (end.empty()) {
      if (std::abs(at.s) >= options_.length) {
        end = "length of the curve";
      } else if (!curve_.advance(at, sign * h, next)) {
        h /= 2;
        if (h < kSmallestStep * options_.step) end = curve_.why();
      } else {
        double reached = stopAtLimit(at, sign * h, next);
        if (curve_.findRankLoss(at, next, reached)) {
          end = curve_.why();
          if (!curve_.advance(at, kBeforeRankLoss * reached, next)) break;
        }
        addEvents(at, next, reached, branch, sign > 0 ? 1 : -1);
        if (returns(start, at, next)) {
          end = "full turn";
          break;
        }
        add(next, DeadPointKind::None, branch);
        at = next;
        h = std::min(2 * h, options_.step);
      }
    }
  }

 private:
  void add(const CurvePoint& point, DeadPointKind dead, int branch) {
    samples.push_back(curve_.makeSample(point, dead));
    samples.back().branch = branch;
  }

  // Truncates the step h at the first limit that it passes; returns the remaining step.
  double stopAtLimit(const CurvePoint& at, double h, CurvePoint& next) {
    double best = h;
    for (const Limit& limit : limits_)
      for (const bool upper : {false, true}) {
        const double bound = upper ? limit.upper : limit.lower;
        const auto excess = [&](const CurvePoint& point) {
          return upper ? point.q[limit.position] - bound : bound - point.q[limit.position];
        };
        if (!(excess(at) <= 0 && excess(next) > 0)) continue;
        const double root = excess(at) == 0 ? 0 : curve_.findRoot(at, h, options_.tolerance, excess);
        if (std::abs(root) > std::abs(best)) continue;
        best = root;
        end = "limit of joint '" + limit.joint + "'";
      }
    if (best != h) curve_.advance(at, best, next);
    return best;
  }

  // Dead points between the two, in their order.
  void addEvents(const CurvePoint& at, const CurvePoint& next, double h, int& branch, int direction) {
    const auto joint = [](const CurvePoint& point) { return point.joint_rate; };
    const auto motor = [](const CurvePoint& point) { return point.motor_volume; };
    std::vector<std::pair<double, DeadPointKind>> events;
    if (joint(at) * joint(next) < 0)
      events.emplace_back(curve_.findRoot(at, h, options_.tolerance, joint), DeadPointKind::Output);
    if (motor(at) * motor(next) < 0)
      events.emplace_back(curve_.findRoot(at, h, options_.tolerance, motor), DeadPointKind::Motors);
    std::sort(events.begin(), events.end(),
              [](const auto& a, const auto& b) { return std::abs(a.first) < std::abs(b.first); });
    for (const auto& [root, kind] : events) {
      CurvePoint point;
      if (!curve_.advance(at, root, point)) continue;
      add(point, kind, branch);
      if (kind == DeadPointKind::Output) branch += direction;
    }
  }

  // Whether the step from `at` to `next` passes the start, in the direction of the start, or a turn of a joint with gears.
  bool returns(const CurvePoint& start, const CurvePoint& at, const CurvePoint& next) {
    if (geared_ >= 0) {
      const double before = std::abs(at.q[geared_] - start.q[geared_]),
                   after = std::abs(next.q[geared_] - start.q[geared_]);
      if (after < 2 * kPi) return false;
      turn = std::abs(at.s) + (2 * kPi - before) / (after - before) * std::abs(next.s - at.s);
      return true;
    }
    if (std::abs(at.s) < 2 * options_.step) return false;
    const Model& cluster = linkage_.cluster->model;
    const VectorXd before = calcWrappedDifference(cluster, start.q, at.q);
    const VectorXd after = calcWrappedDifference(cluster, start.q, next.q);
    const VectorXd& t = start.tangent;
    if (std::min(before.norm(), after.norm()) > options_.step || t.dot(before) * t.dot(after) > 0 ||
        t.dot(next.tangent) < 0.5)
      return false;
    turn = at.s - t.dot(before);
    return true;
  }

  const Model& model_;
  int geared_;
  const Linkage& linkage_;
  LinkageCurve& curve_;
  const SweepOptions& options_;
  std::vector<Limit> limits_;
};

// A full turn has no ends: samples after its last dead point of the joint move before the start, onto the start's
// branch.
void closeTurn(const RatioSample& start, double length, RatioSweep& sweep) {
  std::vector<RatioSample>& samples = sweep.samples;
  size_t last = samples.size();
  while (last-- > 0 && samples[last].dead != DeadPointKind::Output) {
  }
  if (last >= samples.size() || samples[last].branch < 1) return;  // one branch only
  // Full turns of the angles at the end of the curve.
  const RatioSample& end = samples.back();
  const auto countTurns = [](const VectorXd& from, const VectorXd& to) {
    return VectorXd(((to - from) / (2 * kPi)).array().round() * 2 * kPi);
  };
  const VectorXd joints = countTurns(start.joints, end.joints), motors = countTurns(start.motors, end.motors);
  for (size_t i = last; i < samples.size(); ++i) {
    samples[i].s -= length;
    samples[i].branch = 0;
    samples[i].joints -= joints;
    samples[i].motors -= motors;
  }
  std::rotate(samples.begin(), samples.begin() + last, samples.end());
}

RatioSweep sweepDirect(const Model& model, const Linkage& linkage) {
  const int dof = model.joints()[linkage.joints[0]].idx_v;
  const double lower = model.lowerLimits()[dof], upper = model.upperLimits()[dof];
  RatioSweep sweep;
  sweep.begin = std::isfinite(lower) ? "limit of joint '" + linkage.joint_names[0] + "'" : "full turn";
  sweep.end = std::isfinite(upper) ? "limit of joint '" + linkage.joint_names[0] + "'" : "full turn";
  for (const double angle : {std::isfinite(lower) ? lower : -kPi, std::isfinite(upper) ? upper : kPi}) {
    RatioSample sample;
    sample.s = angle;
    sample.joints = sample.motors = VectorXd::Constant(1, angle);
    sample.ratio.R = MatrixXd::Identity(1, 1);
    sample.ratio.dR = {MatrixXd::Zero(1, 1)};
    sweep.samples.push_back(sample);
  }
  return sweep;
}

}  // namespace

std::vector<RatioSample> RatioSweep::deadPoints() const {
  std::vector<RatioSample> points;
  for (const RatioSample& sample : samples)
    if (sample.dead != DeadPointKind::None) points.push_back(sample);
  return points;
}

RatioSweep sweepRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int joint,
                      const SweepOptions& options) {
  if (linkage.isDirect()) return sweepDirect(model, linkage);
  VectorXd q_cluster(linkage.cluster->model.nq());
  gatherConfiguration(model, *linkage.cluster, q, q_cluster);
  LinkageCurve curve(linkage, joint, q_cluster);
  CurvePoint start;
  if (!curve.start(start) || std::abs(start.joint_rate) < 1e-9)
    throw InputError(model.name(), "joint '" + linkage.joint_names[joint] + "'",
                     curve.why().empty() ? "the start is one of its dead points" : curve.why(),
                     "start from another configuration");
  RatioSweep sweep;
  sweep.joint = joint;
  Walk up(model, linkage, joint, curve, options), down(model, linkage, joint, curve, options);
  up.run(start, 1);
  sweep.end = up.end;
  sweep.full_turn = up.turn > 0;
  if (!sweep.full_turn) down.run(start, -1);
  sweep.begin = sweep.full_turn ? up.end : down.end;
  sweep.samples.assign(down.samples.rbegin(), down.samples.rend());
  const RatioSample first = curve.makeSample(start);
  sweep.samples.push_back(first);
  sweep.samples.insert(sweep.samples.end(), up.samples.begin(), up.samples.end());
  if (sweep.full_turn) closeTurn(first, up.turn, sweep);
  return sweep;
}

void addDistances(const Model& model, const Linkage& linkage, ConstVectorRef q, RatioSweep& sweep) {
  for (RatioSample& sample : sweep.samples)
    sample.nearest = sample.dead == DeadPointKind::None
                         ? findDeadPoint(linkage, model, carryLinkage(model, linkage, sample, q))
                         : DeadPoint{sample.dead, 0};
}

}  // namespace bielle
