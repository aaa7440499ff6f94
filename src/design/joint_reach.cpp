#include "design/joint_reach.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
#include "math/constants.h"
#include "model/number_text.h"

namespace bielle {
namespace {

using Way = std::vector<RatioSample>;

// The samples from the configuration where a sweep begins up to limits and dead points: their angles rise, or fall.
Way cutWay(const RatioSweep& sweep) {
  const std::vector<RatioSample>& samples = sweep.samples;
  const auto is_end = [](const RatioSample& sample) { return sample.dead != DeadPointKind::None || sample.loses_rank; };
  const auto start = std::min_element(samples.begin(), samples.end(),
                                      [](const auto& a, const auto& b) { return std::abs(a.s) < std::abs(b.s); });
  auto first = start, last = start;
  while (first != samples.begin() && !is_end(*first)) --first;
  while (last + 1 != samples.end() && !is_end(*last)) ++last;
  return {first, last + 1};
}

std::pair<double, double> getEnds(const Way& way, int joint) {
  return std::minmax({way.front().joints[joint], way.back().joints[joint]});
}

JointReach measureWay(const Way& way, const std::string& name, int joint) {
  JointReach reach;
  reach.joint = name;
  std::tie(reach.lower, reach.upper) = getEnds(way, joint);
  if (way.front().ratio.R.size() != 1) return reach;
  reach.ratio = {std::numeric_limits<double>::infinity(), 0};
  for (const RatioSample& sample : way) {
    const double ratio = std::abs(sample.ratio.R(0, 0));
    reach.ratio = {std::min(reach.ratio->first, ratio), std::max(reach.ratio->second, ratio)};
  }
  return reach;
}

bool isChanged(const JointReach& a, const JointReach& b) {
  constexpr double kShare = 1e-3;
  const auto differ = [](double x, double y, double size) { return std::abs(x - y) > kShare * size; };
  const double width = a.upper - a.lower;
  return differ(a.lower, b.lower, width) || differ(a.upper, b.upper, width) ||
         (a.ratio && b.ratio &&
          (differ(a.ratio->first, b.ratio->first, a.ratio->first) ||
           differ(a.ratio->second, b.ratio->second, a.ratio->second)));
}

std::string formatEnds(double lower, double upper) {
  const auto format = [](double x) { return formatNumber(std::abs(x) < 1e-9 ? 0 : x, "%.4g"); };
  return format(lower) + " .. " + format(upper);
}

// None of a linkage that starts at a dead point of the joint.
std::optional<RatioSweep> trySweep(const Model& model, const Linkage& linkage, const VectorXd& q, size_t joint) {
  try {
    return sweepRatio(model, linkage, q, static_cast<int>(joint));
  } catch (const InputError&) {
    return {};
  }
}

// |R| between two samples: near a dead point of the joint, where it is infinite, it grows with the inverse root of the way to there.
double interpolateRatio(const RatioSample& a, const RatioSample& b, double angle) {
  const double t = (angle - a.joints[0]) / (b.joints[0] - a.joints[0]), p = std::abs(a.ratio.R(0, 0)),
               r = std::abs(b.ratio.R(0, 0));
  if (std::isfinite(p) && std::isfinite(r)) return p + t * (r - p);
  return 1 / std::sqrt((1 - t) / (p * p) + t / (r * r));
}

// Joints that linkages move, and those with a motor of their own, with the number of motors that drive them together.
std::vector<std::pair<std::string, int>> listDriven(const Model& model, const VectorXd& q) {
  std::vector<std::pair<std::string, int>> driven;
  for (const Linkage& linkage : listLinkages(model, q))
    for (const std::string& joint : linkage.joint_names) driven.emplace_back(joint, linkage.size());
  for (const Motor& motor : model.motors()) {
    const auto is_in_loop = [&](const LoopCluster& cluster) {
      return std::binary_search(cluster.dofs.begin(), cluster.dofs.end(), motor.dof);
    };
    const Joint& joint = model.joints()[static_cast<size_t>(motor.joint)];
    if (joint.nv == 1 && std::none_of(model.clusters().begin(), model.clusters().end(), is_in_loop))
      driven.emplace_back(joint.name, 1);
  }
  return driven;
}

JointWay sweepWay(const Model& model, const VectorXd& q, const std::string& joint) {
  const Linkage linkage = makeLinkage(model, q, {joint});
  const auto found = std::find(linkage.joint_names.begin(), linkage.joint_names.end(), joint);
  const auto index = static_cast<size_t>(found - linkage.joint_names.begin());
  const std::optional<RatioSweep> sweep = trySweep(model, linkage, q, index);
  JointWay out{sweep ? cutWay(*sweep) : Way(), static_cast<int>(index)};
  const bool has_no_ends = sweep && (sweep->full_turn || (sweep->begin == "full turn" && sweep->end == "full turn"));
  if (has_no_ends && out.samples.size() == sweep->samples.size()) {
    const auto [lower, upper] = getEnds(out.samples, out.joint);
    out.turns = upper - lower > kPi;  // else it comes back the same way
  }
  return out;
}

}  // namespace

std::vector<JointReach> listReaches(const Model& model) {
  std::vector<JointReach> reaches;
  const VectorXd q = findClosedConfiguration(model).q;
  for (const Linkage& linkage : listLinkages(model, q))
    for (size_t j = 0; j < linkage.joints.size(); ++j)
      if (const std::optional<RatioSweep> sweep = trySweep(model, linkage, q, j))
        reaches.push_back(measureWay(cutWay(*sweep), linkage.joint_names[j], sweep->joint));
  return reaches;
}

std::vector<ReachChange> listReachChanges(const Model& before, const Model& after) {
  std::vector<ReachChange> changes;
  const std::vector<JointReach> reaches = listReaches(after);
  for (const JointReach& a : listReaches(before))
    for (const JointReach& b : reaches)
      if (a.joint == b.joint && isChanged(a, b)) changes.push_back({a, b});
  return changes;
}

std::vector<JointRange> findRanges(const Model& start, const JointAngles& requested, bool needs_ratio,
                                   const char* where) {
  std::vector<JointRange> ranges;
  const VectorXd q = findClosedConfiguration(start).q;
  const auto fail = [&](const std::string& problem, const std::string& remedy) {
    throw InputError(start.name(), std::string(where) + ": joints", problem, remedy);
  };
  const auto add = [&](const std::string& joint) {
    if (requested.angles) {
      ranges.push_back({joint, (*requested.angles)[0], (*requested.angles)[1]});
    } else if (const JointWay way = sweepWay(start, q, joint); !way.samples.empty()) {
      const auto [lower, upper] = getEnds(way.samples, way.joint);
      if (lower < upper) ranges.push_back({joint, lower, upper});
    }
  };
  const std::vector<std::pair<std::string, int>> driven = listDriven(start, q);
  for (const std::string& name : requested.joints) {
    bool any = false;
    for (const auto& [joint, motors] : driven) {
      if (fnmatch(name.c_str(), joint.c_str(), FNM_NOESCAPE) != 0) continue;
      any = true;
      if (needs_ratio && motors > 1) {
        if (name != joint) continue;
        fail("several motors drive '" + joint + "' together, so that it has no ratio of its own",
             "bound its `range`, or name joints of one motor");
      }
      add(joint);
    }
    if (!any) fail("motors drive no joint '" + name + "'", "`bielle ratio` lists them; * stands for any text");
  }
  if (requested.joints.empty())
    for (const JointReach& reach : listReaches(start))
      if (!needs_ratio || reach.ratio) add(reach.joint);
  if (ranges.empty()) fail("there are none", "name joints that one motor drives each, or remove it");
  return ranges;
}

const JointWay& JointWays::find(const std::string& joint) {
  if (q_.size() == 0) q_ = findClosedConfiguration(model_).q;
  const auto it = ways_.find(joint);
  return it != ways_.end() ? it->second : ways_.emplace(joint, sweepWay(model_, q_, joint)).first->second;
}

RangeCoverage JointWays::calcCoverage(const JointRange& range) {
  const JointWay& of = find(range.joint);
  const Way& way = of.samples;
  RangeCoverage out;
  if (way.empty()) return out;
  const auto get = [&of](const RatioSample& sample) { return sample.joints[of.joint]; };
  auto [lower, upper] = getEnds(way, of.joint);
  if (!of.turns) lower = std::max(lower, range.lower), upper = std::min(upper, range.upper);
  if (lower > upper) return out;
  out.share = std::min(1.0, (upper - lower) / (range.upper - range.lower));
  if (of.turns) out.share = 1;
  if (way.front().ratio.R.size() != 1) return out;
  out.least = std::numeric_limits<double>::infinity(), out.largest = 0;
  const auto add = [&](double ratio) {
    out.least = std::min(out.least, ratio), out.largest = std::max(out.largest, ratio);
  };
  for (size_t i = 0; i < way.size(); ++i) {
    if (get(way[i]) >= lower && get(way[i]) <= upper) add(std::abs(way[i].ratio.R(0, 0)));
    for (const double end : {lower, upper})
      if (i > 0 && (get(way[i - 1]) - end) * (get(way[i]) - end) < 0) add(interpolateRatio(way[i - 1], way[i], end));
  }
  return out;
}

std::string formatRange(const JointReach& reach) { return formatEnds(reach.lower, reach.upper); }

std::string formatRatio(const JointReach& reach) { return formatEnds(reach.ratio->first, reach.ratio->second); }

}  // namespace bielle
