#include "design/joint_reach.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// \param start  a sample of the sweep   \param step  -1 or 1
void addWay(const RatioSweep& sweep, int start, int step, JointReach& reach) {
  for (int i = start; i >= 0 && i < static_cast<int>(sweep.samples.size()); i += step) {
    const RatioSample& sample = sweep.samples[static_cast<size_t>(i)];
    const double angle = sample.joints[sweep.joint];
    reach.lower = std::min(reach.lower, angle);
    reach.upper = std::max(reach.upper, angle);
    if (sample.ratio.R.size() == 1) {
      const double ratio = std::abs(sample.ratio.R(0, 0));
      if (!reach.ratio) reach.ratio = {ratio, ratio};
      reach.ratio = {std::min(reach.ratio->first, ratio), std::max(reach.ratio->second, ratio)};
    }
    if (sample.dead != DeadPointKind::None || sample.loses_rank) return;
  }
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

}  // namespace

std::vector<JointReach> listReaches(const Model& model) {
  std::vector<JointReach> reaches;
  const VectorXd q = findClosedConfiguration(model).q;
  for (const Linkage& linkage : listLinkages(model, q))
    for (size_t j = 0; j < linkage.joints.size(); ++j) {
      try {
        const RatioSweep sweep = sweepRatio(model, linkage, q, static_cast<int>(j));
        const auto start = std::min_element(sweep.samples.begin(), sweep.samples.end(),
                                            [](const auto& a, const auto& b) { return std::abs(a.s) < std::abs(b.s); });
        JointReach reach;
        reach.joint = linkage.joint_names[j];
        reach.lower = reach.upper = start->joints[sweep.joint];
        for (const int step : {-1, 1}) addWay(sweep, static_cast<int>(start - sweep.samples.begin()), step, reach);
        reaches.push_back(reach);
      } catch (const InputError&) {  // it starts at a dead point
      }
    }
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

std::string formatRange(const JointReach& reach) { return formatEnds(reach.lower, reach.upper); }

std::string formatRatio(const JointReach& reach) { return formatEnds(reach.ratio->first, reach.ratio->second); }

}  // namespace bielle
