#include "design/fourbar_search.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "bielle/design/search.h"

namespace bielle {
namespace {

using Point = Eigen::Vector2d;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr long kChunk = 10000;  // samples that share a generator of random numbers
constexpr int kRefined = 50;
constexpr double kAlike = 1e-3;  // of the width of the bounds

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
Point point(double radius, double angle) { return {radius * std::cos(angle), radius * std::sin(angle)}; }

// Of the segment from a to b from the origin.
double calcDistance(const Point& a, const Point& b) {
  const Point way = b - a;
  return (a + std::clamp(-a.dot(way) / way.squaredNorm(), 0.0, 1.0) * way).norm();
}

FourBarDrawing drawAtRandom(const FourBarSpace& space, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  VectorXd x(FourBarDrawing::kCount);
  for (double& share : x) share = uniform(random);
  return FourBarDrawing::fromVector(space.lower + x.cwiseProduct(space.upper - space.lower));
}

bool isBetter(const FoundFourBar& a, const FoundFourBar& b) { return a.value < b.value; }

// The best of one chunk.
std::vector<FoundFourBar> searchChunk(const JointDemand& demand, const FourBarSpace& space, long samples,
                                      std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<FoundFourBar> best;
  for (long i = 0; i < samples; ++i) {
    const FoundFourBar found = rateFourBar(drawAtRandom(space, random), demand, space);
    if (found.value == kNever || (best.size() == kRefined && !isBetter(found, best.back()))) continue;
    best.insert(std::upper_bound(best.begin(), best.end(), found, isBetter), found);
    if (best.size() > kRefined) best.pop_back();
  }
  return best;
}

FoundFourBar refine(const FoundFourBar& start, const JointDemand& demand, const FourBarSpace& space) {
  const auto rate = [&](const VectorXd& x) { return rateFourBar(FourBarDrawing::fromVector(x), demand, space); };
  SearchProblem problem;
  problem.lower = space.lower, problem.upper = space.upper, problem.start = start.drawing.toVector();
  problem.objective = [&](const VectorXd& x, const SearchStage&) { return std::min(rate(x).value, 1e6); };
  SearchStage stage;
  stage.algorithm = SearchAlgorithm::Sbplx;
  stage.evaluations = 4000;
  stage.tolerance = 1e-7;
  return rate(minimizeByStages(problem, {stage}, 1).x);
}

}  // namespace

FourBarDrawing FourBarDrawing::fromVector(const VectorXd& x) { return {x[0], x[1], x[2], x[3], x[4], x[5]}; }
VectorXd FourBarDrawing::toVector() const {
  VectorXd x(kCount);
  x << motor_x, motor_z, crank, crank_angle, arm, arm_angle;
  return x;
}

FourBarState calcFourBar(const FourBarDrawing& d, double turn) {
  const Point M(d.motor_x, d.motor_z), B0 = M + point(d.crank, d.crank_angle), F0 = point(d.arm, d.arm_angle);
  const Point F = point(d.arm, d.arm_angle - turn), w = F - M;
  const double rod2 = (F0 - B0).squaredNorm(), l = w.norm(), h = (l * l + d.crank * d.crank - rod2) / (2 * l);
  const double square = d.crank * d.crank - h * h;
  FourBarState state;
  if (!(square > 0)) return state;
  const double side = cross(F0 - M, B0 - M) > 0 ? 1 : -1;
  const Point arm = h / l * w + side * std::sqrt(square) / l * Point(-w.y(), w.x()), r = F - M - arm;
  const double at_crank = cross(r, arm), at_joint = cross(r, F), rod = r.norm();
  state.closes = true;
  state.ratio = at_joint / at_crank;
  state.sine = std::min(std::abs(at_joint) / (rod * d.arm), std::abs(at_crank) / (rod * d.crank));
  state.turn = std::remainder(d.crank_angle - std::atan2(arm.y(), arm.x()), 2 * M_PI);
  state.nearest = calcDistance(M + arm, F);
  return state;
}

FoundFourBar rateFourBar(const FourBarDrawing& drawing, const JointDemand& demand, const FourBarSpace& space) {
  FoundFourBar found;
  found.drawing = drawing;
  found.value = kNever;
  found.least_ratio = found.least_sine = kNever;
  double deviation = 0, square = 0;
  for (Eigen::Index k = 0; k < demand.angles.size(); ++k) {
    const FourBarState state = calcFourBar(drawing, demand.angles[k] - demand.drawn_at);
    if (!state.closes || state.sine < space.margin || state.nearest < space.clearance) return found;
    const double ratio = std::abs(state.ratio);
    found.least_ratio = std::min(found.least_ratio, ratio);
    found.largest_ratio = std::max(found.largest_ratio, ratio);
    found.least_sine = std::min(found.least_sine, state.sine);
    if (demand.ratios.size()) deviation = std::max(deviation, std::abs(ratio / demand.ratios[k] - 1));
    if (!demand.torques.size()) continue;
    const double torque = std::abs(demand.torques[k]) / ratio, speed = std::abs(demand.speeds[k]) * ratio;
    if (demand.largest_speed > 0 && speed > demand.largest_speed) return found;
    found.peak_torque = std::max(found.peak_torque, torque);
    found.peak_speed = std::max(found.peak_speed, speed);
    square += torque * torque;
  }
  found.rms_torque = std::sqrt(square / static_cast<double>(demand.angles.size()));
  found.value = demand.torques.size()  ? found.rms_torque
                : demand.ratios.size() ? deviation
                                       : found.largest_ratio / found.least_ratio - 1;
  return found;
}

std::vector<FoundFourBar> searchFourBars(const JointDemand& demand, const FourBarSpace& space, long samples, int count,
                                         unsigned seed, int threads) {
  const long chunks = (samples + kChunk - 1) / kChunk;
  std::vector<std::vector<FoundFourBar>> of_chunks(static_cast<size_t>(chunks));
  std::atomic<long> next{0};
  std::vector<std::thread> team;
  for (int t = 0; t < std::max(1, threads); ++t)
    team.emplace_back([&] {
      for (long chunk = next++; chunk < chunks; chunk = next++)
        of_chunks[static_cast<size_t>(chunk)] =
            searchChunk(demand, space, std::min(kChunk, samples - chunk * kChunk),
                        (static_cast<std::uint64_t>(seed) << 32) + static_cast<std::uint64_t>(chunk));
    });
  for (std::thread& member : team) member.join();
  std::vector<FoundFourBar> best;
  for (const std::vector<FoundFourBar>& chunk : of_chunks) best.insert(best.end(), chunk.begin(), chunk.end());
  std::stable_sort(best.begin(), best.end(), isBetter);
  if (best.size() > kRefined) best.resize(kRefined);
  for (FoundFourBar& found : best) found = refine(found, demand, space);
  std::stable_sort(best.begin(), best.end(), isBetter);
  const VectorXd width = (space.upper - space.lower).cwiseMax(1e-12);
  std::vector<FoundFourBar> distinct;
  for (const FoundFourBar& found : best) {
    const auto is_alike = [&](const FoundFourBar& other) {
      return (found.drawing.toVector() - other.drawing.toVector()).cwiseQuotient(width).cwiseAbs().maxCoeff() < kAlike;
    };
    if (static_cast<int>(distinct.size()) < count && std::none_of(distinct.begin(), distinct.end(), is_alike))
      distinct.push_back(found);
  }
  return distinct;
}

}  // namespace bielle
