#include "motion/kinematic_guess.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "dynamics/assembly_refinement.h"
#include "dynamics/linkage_workspace.h"
#include "dynamics/target_reach.h"

namespace bielle {
namespace {

class FeetPlacer {
 public:
  FeetPlacer(const Model& model, const Stance& stance)
      : model_(model), stance_(stance), linkages_(listLinkages(model, stance.q)) {
    height_ = stance.com.z() - 0.5 * (stance.feet[0].p.z() + stance.feet[1].p.z());
    options_.step = AssemblyStep::Shortest;
    options_.max_iterations = 15;
    options_.continuation_steps = 0;
    FrameTarget base;
    base.body = 1;
    for (const std::array<bool, 2>& flat : {std::array{false, false}, std::array{true, true}}) {
      const AssemblyProblem problem = makeProblem(stance.feet, flat, stance.q);
      for (size_t i = 0; i < 2; ++i) spans_[i][flat[i] ? 1 : 0] = calcSpan(model, base, problem.frames[i]);
    }
  }

  // None where no posture is found, after dozens of assemblies. Beside a posture that was found, the stance leads to others only
  // where a sole is free to turn: legs with flat soles under a given base have nothing to choose.
  // \param found  whether `before` is one
  std::optional<VectorXd> place(const PlannedPosture& planned, const VectorXd& before, bool found) {
    constexpr std::array<bool, 2> kBoth{true, true};
    constexpr double kNear = 0.06;  // of the base, over the height of the centre of mass
    const std::vector<const VectorXd*> starts = {&before, &stance_.q};
    std::optional<VectorXd> q =
        placeNear(planned, kBoth, found ? std::vector{&before} : starts, found, {0, kNear}, kEasyTransmission);
    if (!q && planned.stands != kBoth)
      q = placeNear(planned, planned.stands, starts, found, {0, kNear}, kEasyTransmission);
    if (!q) q = placeNear(planned, planned.stands, starts, found, {kNear, kFar}, kLeastTransmission);
    for (size_t i = 0; i < starts.size() && !q; ++i) q = placeFreely(planned, *starts[i]);
    return q;
  }

  // With the base where legs have it, near the start: they reach farther where the pelvis turns or leans.
  std::optional<VectorXd> placeFreely(const PlannedPosture& planned, const VectorXd& start) {
    AssemblyOptions options = options_;
    options.patience = 0;
    options.max_iterations = 50;
    std::optional<Posture> posture =
        accept(bielle::assemble(model_, makeProblem(planned.feet, planned.stands, start), options));
    if (!posture) return {};
    return std::move(posture->q);
  }

  // Whether there is such a posture, as far as that of the stance leads to it.
  bool reaches(const PlannedPosture& planned) {
    return placeNear(planned, planned.stands, {&stance_.q}, true, {0, kFar}, kLeastTransmission).has_value();
  }

  // With soles as they come to lie, or those of the stance.
  VectorXd hang(const PlannedPosture& planned) {
    const VectorXd base = planned.q.head<7>();
    if (std::optional<Posture> posture = assemble(base, planned.feet, {false, false}, stance_.q))
      return std::move(posture->q);
    VectorXd q = stance_.q;
    q.head<7>() = base;
    return q;
  }

  // The heights at which the base can be over the feet of the stance moved back by x, around one of them.
  // \param q  starts from here; then a posture of medium height  \param height  of the centre of mass in it
  bool findHeights(double x, VectorXd& q, double& height, double& shortest, double& longest) {
    constexpr double kStep = 0.015, kMost = 0.4;  // of the height of the centre of mass
    const double step = kStep * height_;
    std::array<SE3, 2> feet = stance_.feet;
    const Vector3d forward = calcMiddle(feet[0], feet[1]).R.col(0);
    for (SE3& foot : feet) foot.p -= x * forward;
    const auto assembleAt = [&](double z, const VectorXd& start) -> std::optional<VectorXd> {
      VectorXd base = stance_.q.head<7>();
      base[2] += z - height_;
      std::optional<Posture> posture = assemble(base, feet, {true, true}, start);
      if (!posture || posture->transmission <= kEasyTransmission) return {};
      return std::move(posture->q);
    };
    std::optional<VectorXd> found;
    for (int i = 0; i <= 8 && !found; i = i > 0 ? -i : 1 - i) {
      found = assembleAt(height + i * step, q);
      if (found) height += i * step;
    }
    if (!found) return false;
    q = *found;
    VectorXd middle = q;
    const auto travel = [&](double way) {
      VectorXd at = q;
      double z = height;
      while (std::abs(z + way - height_) <= kMost * height_) {
        std::optional<VectorXd> next = assembleAt(z + way, at);
        if (!next) break;
        at = std::move(*next);
        z += way;
      }
      return z;
    };
    shortest = travel(-step);
    longest = travel(step);
    if (const std::optional<VectorXd> medium = assembleAt(0.5 * (shortest + longest), q)) {
      q = *medium;
      height = 0.5 * (shortest + longest);
    }
    return true;
  }
  double height() const { return height_; }

 private:
  static constexpr double kFar = 0.24;  // of the base, over the height of the centre of mass

  struct Posture {
    VectorXd q;
    double transmission;  // the least, or the least inverse, over that of the stance
  };

  // With the base as little raised or lowered as can be; the first whose transmission is easy enough, else the first. Heights at
  // which legs reach are an interval: beyond its ends none is tried.
  // \param sure  that no other start leads to a posture where the first does not
  // \param ways  of the base, up and down, over the height of the centre of mass: the longest that failed before, and the longest
  // that is tried
  std::optional<VectorXd> placeNear(const PlannedPosture& planned, const std::array<bool, 2>& flat,
                                    const std::vector<const VectorXd*>& starts, bool sure,
                                    const std::array<double, 2>& ways, double easy) {
    const double step = ways[1] / 4;
    std::optional<VectorXd> first;
    int at = 0, first_left = -4, last_left = 4;  // steps downwards: of `first`, and of those that may reach
    for (int i = 0; i <= 4; i = i > 0 ? -i : 1 - i) {
      if (i < first_left || i > last_left || (ways[0] > 0 && std::abs(i) * step < ways[0] + 1e-9)) continue;
      VectorXd base = planned.q.head<7>();
      base[2] -= i * step * height_;
      bool reaches = false;
      for (const VectorXd* start : starts) {
        std::optional<Posture> posture = assemble(base, planned.feet, flat, *start);
        if (posture && posture->transmission > easy) return std::move(posture->q);
        reaches = reaches || posture;
        if (posture && !first) {
          first = std::move(posture->q);
          at = i;
          if (i > 0) first_left = i;
          if (i < 0) last_left = i;
        }
        if (!reaches && sure) break;
      }
      if (first && !reaches) (i < at ? first_left : last_left) = i;
    }
    return first;
  }

  AssemblyProblem makeProblem(const std::array<SE3, 2>& feet, const std::array<bool, 2>& flat,
                              const VectorXd& start) const {
    AssemblyProblem problem;
    problem.q_ref = start;
    for (int i = 0; i < 2; ++i) {
      problem.frames.push_back(makeFrameTarget(model_.contacts()[stance_.contacts[i]], feet[i]));
      if (!flat[i]) problem.frames.back().mask.tail<3>().setConstant(false);
    }
    return problem;
  }

  // \param flat  soles that are parallel to what is planned
  std::optional<Posture> assemble(const VectorXd& base, const std::array<SE3, 2>& feet, const std::array<bool, 2>& flat,
                                  const VectorXd& start) {
    if (!spansLegs(base, feet, flat)) return {};
    AssemblyProblem problem = makeProblem(feet, flat, start);
    problem.q_ref.head<7>() = base;
    options_.patience = flat[0] && flat[1] ? 2 : 0;  // soles that are free to turn often pass postures that are worse
    return accept(assembleUnderBase(model_, problem, options_));
  }

  // Whether straight legs are long enough, wherever else their linkages have them.
  bool spansLegs(const VectorXd& base, const std::array<SE3, 2>& feet, const std::array<bool, 2>& flat) const {
    const SE3 X_WB{Eigen::Quaterniond(base[6], base[3], base[4], base[5]).toRotationMatrix(), base.head<3>()};
    for (size_t i = 0; i < 2; ++i) {
      const Span& span = spans_[i][flat[i] ? 1 : 0];
      const SE3 X_WF = feet[i] * model_.contacts()[stance_.contacts[i]].X_BF.inverse();
      if (!span.bridges((X_WB.act(span.one) - X_WF.act(span.other)).norm())) return false;
    }
    return true;
  }

  // Keeps ranges of joints, and linkages on their side of dead points.
  std::optional<Posture> accept(AssemblyResult result) {
    if (result.status != NumericalStatus::Ok || !keepsRanges(result.q)) return {};
    const double transmission = calcTransmission(result.q);
    if (transmission <= kLeastTransmission) return {};
    return Posture{std::move(result.q), transmission};
  }

  double calcTransmission(const VectorXd& q) {
    double least = std::numeric_limits<double>::infinity();
    for (const Linkage& linkage : linkages_) {
      const double value = bielle::calcTransmission(linkage, memory_, model_, q);
      least = std::min({least, value, 1 / value});
    }
    return least;
  }

  bool keepsRanges(const VectorXd& q) const {
    for (int k = 0; k < model_.nv(); ++k) {
      const Joint& joint = model_.joints()[model_.dofs()[k].joint];
      if (joint.nv != 1) continue;
      if (q[joint.idx_q] < model_.lowerLimits()[k] || q[joint.idx_q] > model_.upperLimits()[k]) return false;
    }
    return true;
  }

  const Model& model_;
  const Stance& stance_;
  std::vector<Linkage> linkages_;
  LinkageWorkspaces memory_;
  double height_ = 0;                         // of the centre of mass over the feet
  std::array<std::array<Span, 2>, 2> spans_;  // of left and right leg, from the base to a sole that may tilt, or not
  AssemblyOptions options_;
};

}  // namespace

std::vector<VectorXd> placeFeet(const Model& model, const Stance& stance, const std::vector<PlannedPosture>& postures) {
  constexpr size_t kStride = 8;
  FeetPlacer placer(model, stance);
  std::vector<VectorXd> qs;
  size_t tried = 0;
  bool found = true;
  while (qs.size() < postures.size()) {
    // Beside a posture that is not found others mostly are not, either: one of several is tried, and those between are
    // like it.
    if (!found && qs.size() >= tried) {
      tried = std::min(qs.size() + kStride, postures.size());
      if (!placer.reaches(postures[tried - 1]) && !placer.placeFreely(postures[tried - 1], stance.q)) {
        while (qs.size() < tried) qs.push_back(placer.hang(postures[qs.size()]));
        continue;
      }
    }
    const PlannedPosture& planned = postures[qs.size()];
    std::optional<VectorXd> q = found || placer.reaches(planned)
                                    ? placer.place(planned, qs.empty() ? stance.q : qs.back(), found)
                                    : placer.placeFreely(planned, stance.q);
    found = q.has_value();
    qs.push_back(found ? std::move(*q) : placer.hang(planned));
  }
  return qs;
}

struct LegReach::Data {
  // Heights at multiples of the spacing ahead of the stance, or behind it, as far as they are known.
  struct Direction {
    double sign = 1;
    VectorXd q;
    double height = 0;
    std::vector<Heights> heights{};
    bool ended = false;  // no more of them
  };

  Data(const Model& model, const Stance& stance)
      : placer(model, stance),
        spacing(0.1 * placer.height()),
        ahead{1, stance.q, placer.height()},
        behind{-1, stance.q, placer.height()} {}

  // Of both directions the first entry is one beside the other's: at the stance, and one spacing behind it.
  void extend(Direction& direction, int count) {
    constexpr int kMost = 10;
    const int first = direction.sign > 0 ? 0 : 1;
    while (!direction.ended && static_cast<int>(direction.heights.size()) < count) {
      Heights at;
      const int i = first + static_cast<int>(direction.heights.size());
      direction.ended = i > kMost || !placer.findHeights(direction.sign * i * spacing, direction.q, direction.height,
                                                         at.shortest, at.longest);
      if (!direction.ended) direction.heights.push_back(at);
    }
  }
  const Heights& get(int i) const {
    return i >= 0 ? ahead.heights[static_cast<size_t>(i)] : behind.heights[static_cast<size_t>(-i - 1)];
  }

  FeetPlacer placer;
  double spacing;
  Direction ahead, behind;
};

LegReach::LegReach(const Model& model, const Stance& stance) : data_(std::make_unique<Data>(model, stance)) {}
LegReach::~LegReach() = default;

LegReach::Heights LegReach::calc(double ahead, double aside) {
  Data& data = *data_;
  const double way = std::clamp(ahead / data.spacing, -100.0, 100.0);  // more than there are
  const int below = static_cast<int>(std::floor(way));
  data.extend(data.ahead, below + 2);
  data.extend(data.behind, -below);
  const int first = -static_cast<int>(data.behind.heights.size()),
            last = static_cast<int>(data.ahead.heights.size()) - 1;
  if (last < first) return {0, std::numeric_limits<double>::infinity()};
  const double s = std::clamp(way, static_cast<double>(first), static_cast<double>(last));
  const int i = std::clamp(below, first, std::max(first, last - 1)), j = std::min(i + 1, last);
  const auto mix = [&](double a, double b) {
    const double length = a + (s - i) * (b - a);
    return std::sqrt(std::max(0.0, length * length - aside * aside));
  };
  return {mix(data.get(i).shortest, data.get(j).shortest), mix(data.get(i).longest, data.get(j).longest)};
}

}  // namespace bielle
