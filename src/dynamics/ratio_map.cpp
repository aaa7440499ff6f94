#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "dynamics/linkage_curve.h"

namespace bielle {
namespace {

// The samples around the start, up to the first dead points, with these.
std::vector<RatioSample> getMainBranch(const RatioSweep& sweep) {
  const std::vector<RatioSample>& all = sweep.samples;
  const auto start = std::find_if(all.begin(), all.end(), [](const RatioSample& sample) { return sample.s == 0; });
  auto first = start, last = start;
  while (first != all.begin() && first->dead == DeadPointKind::None) --first;
  while (last + 1 != all.end() && last->dead == DeadPointKind::None) ++last;
  return {first, last + 1};
}

// Samples around the start at given angles of the swept joint, as far as it reaches them.
std::vector<RatioSample> sampleAt(const Linkage& linkage, const RatioSweep& sweep, const std::vector<double>& angles) {
  std::vector<RatioSample> out;
  const std::vector<RatioSample> branch = getMainBranch(sweep);
  for (const double angle : angles) {
    const auto f = [&](const RatioSample& sample) { return sample.joints[sweep.joint] - angle; };
    for (size_t i = 0; i + 1 < branch.size(); ++i) {
      if (f(branch[i]) > 0 || f(branch[i + 1]) < 0) continue;
      LinkageCurve curve(linkage, sweep.joint, branch[i].q);
      CurvePoint from, at;
      if (!curve.start(from)) break;
      // Angles are relative to the start of the sweep; the curve is restarted.
      const double wanted = from.q[linkage.joint_positions[sweep.joint]] - f(branch[i]);
      const double h = curve.findRoot(from, branch[i + 1].s - branch[i].s, 1e-12, [&](const CurvePoint& point) {
        return point.q[linkage.joint_positions[sweep.joint]] - wanted;
      });
      if (!curve.advance(from, h, at)) break;
      out.push_back(curve.makeSample(at));
      out.back().s = branch[i].s + h;
      break;
    }
  }
  return out;
}

void append(const RatioSweep& sweep, std::vector<RatioSample>& dead_points) {
  for (const RatioSample& sample : getMainBranch(sweep))
    if (sample.dead != DeadPointKind::None) dead_points.push_back(sample);
}

}  // namespace

RatioMap mapRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int count,
                  const SweepOptions& options) {
  if (linkage.size() != 2)
    throw InputError(model.name(), "linkage of joint '" + linkage.joint_names.front() + "'",
                     "it has mobility " + std::to_string(linkage.size()) + ", but a map needs two joints",
                     "sweep one joint");
  RatioMap map;
  const RatioSweep spine = sweepRatio(model, linkage, q, 0, options);
  append(spine, map.dead_points);
  const std::vector<RatioSample> branch = getMainBranch(spine);
  const double lowest = branch.front().joints[0], highest = branch.back().joints[0];
  const double spacing = (highest - lowest) / count;
  // In the middle of `count` cells: the ends are dead points or limits.
  for (int i = 0; i < count; ++i) map.first.push_back(lowest + (i + 0.5) * spacing);
  std::vector<RatioSweep> ribs;
  double low = INFINITY, high = -INFINITY;
  VectorXd whole = q;
  for (const RatioSample& sample : sampleAt(linkage, spine, map.first)) {
    scatterConfiguration(model, *linkage.cluster, sample.q, whole);
    ribs.push_back(sweepRatio(model, linkage, whole, 1, options));
    append(ribs.back(), map.dead_points);
    const std::vector<RatioSample> rib = getMainBranch(ribs.back());
    low = std::min(low, rib.front().joints[1]);
    high = std::max(high, rib.back().joints[1]);
  }
  for (double i = std::ceil(low / spacing); i * spacing <= high; ++i) map.second.push_back(i * spacing);
  for (const RatioSweep& rib : ribs) map.rows.push_back(sampleAt(linkage, rib, map.second));
  return map;
}

}  // namespace bielle
