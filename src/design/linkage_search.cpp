#include "design/linkage_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <random>

#include "bielle/design/search.h"
#include "design/parallel.h"

namespace bielle {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kWorst = 1e6;      // in place of it where a search wants finite numbers
constexpr long kChunk = 1000;       // samples that share a generator of random numbers
constexpr double kAlike = 1e-3;     // of the width of the bounds
constexpr double kSmallest = 1e-7;  // steps of refinements, likewise

bool isBetter(const FoundLinkage& a, const FoundLinkage& b) { return a.value < b.value; }

VectorXd drawAtRandom(const LinkageFamily& family, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  VectorXd x = family.lower;
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] += uniform(random) * (family.upper[i] - family.lower[i]);
  return x;
}

// The best of one chunk, at most `most`.
std::vector<FoundLinkage> searchChunk(const LinkageFamily& family, const JointDemand& demand, long samples,
                                      std::uint64_t seed, size_t most) {
  std::mt19937_64 random(seed);
  std::vector<FoundLinkage> best;
  for (long i = 0; i < samples; ++i) {
    const FoundLinkage found = rateLinkage(family, drawAtRandom(family, random), demand);
    if (found.value == kNever || (best.size() == most && !isBetter(found, best.back()))) continue;
    best.insert(std::upper_bound(best.begin(), best.end(), found, isBetter), found);
    if (best.size() > most) best.pop_back();
  }
  return best;
}

FoundLinkage refine(const LinkageFamily& family, const FoundLinkage& start, const JointDemand& demand,
                    int evaluations) {
  SearchProblem problem;
  problem.lower = family.lower, problem.upper = family.upper, problem.start = start.x;
  problem.objective = [&](const VectorXd& x, const SearchStage&) {
    return std::min(rateLinkage(family, x, demand).value, kWorst);
  };
  return rateLinkage(family, minimizeByStages(problem, {{SearchAlgorithm::Sbplx, evaluations, kSmallest}}, 1).x,
                     demand);
}

}  // namespace

FoundLinkage rateLinkage(const LinkageFamily& family, const VectorXd& x, const JointDemand& demand) {
  FoundLinkage found;
  found.x = x;
  found.value = kNever;
  VectorXd ratios(demand.angles.size());
  if (!family.calcRatios(x, ratios, found.margin)) return found;
  found.least_ratio = ratios.minCoeff(), found.largest_ratio = ratios.maxCoeff();
  if (demand.torques.size() > 0) {
    const VectorXd torques = demand.torques.cwiseQuotient(ratios);
    found.peak_torque = torques.cwiseAbs().maxCoeff();
    found.rms_torque = torques.norm() / std::sqrt(static_cast<double>(torques.size()));
    found.peak_speed = demand.speeds.cwiseProduct(ratios).cwiseAbs().maxCoeff();
    if (demand.largest_speed > 0 && found.peak_speed > demand.largest_speed) return found;
    found.value = found.rms_torque;
  } else if (demand.ratios.size() > 0) {
    found.value = (ratios.cwiseQuotient(demand.ratios).array() - 1).abs().maxCoeff();
  } else {
    found.value = found.largest_ratio / found.least_ratio - 1;
  }
  return found;
}

std::vector<FoundLinkage> searchLinkages(const LinkageFamily& family, const JointDemand& demand,
                                         const LinkageSearchOptions& options) {
  const long chunks = (options.samples + kChunk - 1) / kChunk;
  const auto most = static_cast<size_t>(options.refined);
  std::vector<FoundLinkage> best;
  std::vector<std::vector<FoundLinkage>> of_chunks(static_cast<size_t>(chunks));
  std::mutex mutex;
  long rated = 0;
  doInParallel(of_chunks.size(), options.threads, [&](size_t k) {
    const auto chunk = static_cast<long>(k);
    const long samples = std::min(kChunk, options.samples - chunk * kChunk);
    const std::uint64_t seed = (static_cast<std::uint64_t>(options.seed) << 32) + static_cast<std::uint64_t>(chunk);
    of_chunks[k] = searchChunk(family, demand, samples, seed, most);
    const std::lock_guard<std::mutex> lock(mutex);
    rated += samples;
    if (options.progress) options.progress(rated);
  });
  for (const std::vector<FoundLinkage>& chunk : of_chunks) best.insert(best.end(), chunk.begin(), chunk.end());
  std::stable_sort(best.begin(), best.end(), isBetter);
  if (best.size() > most) best.resize(most);
  doInParallel(best.size(), options.threads,
               [&](size_t i) { best[i] = refine(family, best[i], demand, options.evaluations); });
  std::stable_sort(best.begin(), best.end(), isBetter);
  const VectorXd width = (family.upper - family.lower).cwiseMax(1e-12);
  std::vector<FoundLinkage> distinct;
  for (const FoundLinkage& found : best) {
    const auto is_alike = [&](const FoundLinkage& other) {
      return (found.x - other.x).cwiseQuotient(width).cwiseAbs().maxCoeff() < kAlike;
    };
    if (static_cast<int>(distinct.size()) < options.count && std::none_of(distinct.begin(), distinct.end(), is_alike))
      distinct.push_back(found);
  }
  return distinct;
}

}  // namespace bielle
