#include "loops/one_freedom.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "math/constants.h"

namespace bielle::loops {
namespace {

// Of x: ten points each give the integrals of the problems here to rounding.
constexpr double kPanel = 0.05;
// From here on E - V is a difference.
constexpr double kNearRest = 0.3;
constexpr double kAtRest = 1e-8;

// Gauss's ten points on [-1, 1]: the positive ones and their weights.
constexpr std::array<double, 5> kPoints = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244,
                                           0.8650633666889845, 0.9739065285171717};
constexpr std::array<double, 5> kWeights = {0.2955242247147529, 0.2692667193099964, 0.2190863625159820,
                                            0.1494513491505806, 0.0666713443086881};

template <typename Function>
double integrate(const Function& f, double from, double to) {
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
  double sum = 0;
  for (size_t i = 0; i < kPoints.size(); ++i)
    sum += kWeights[i] * (f(middle - half * kPoints[i]) + f(middle + half * kPoints[i]));
  return half * sum;
}

}  // namespace

OneFreedom::OneFreedom(CalcPosture calc, Path path, double start, double other, double speed)
    : calc_(std::move(calc)), path_(path), start_(start), other_(other) {
  const Energies at_start = calc_(start).energies;
  energy_ = at_start.potential + 0.5 * at_start.inertia * speed * speed;
  if (speed < 0) sign_ = -1;
}

OneFreedom OneFreedom::makeRunning(CalcPosture calc, double start, double speed) {
  return {std::move(calc), Path::Runs, start, start, speed};
}

OneFreedom OneFreedom::makeReleased(CalcPosture calc, double start) {
  return {std::move(calc), Path::Released, start, start, 0};
}

OneFreedom OneFreedom::makeSwinging(CalcPosture calc, double start, double beyond) {
  const double energy = calc(start).energies.potential;
  if (!(calc(beyond).energies.potential > energy)) throw std::logic_error("the swing has no rest before its end");
  double below = start + 0.5 * (beyond - start), above = beyond;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (below + above);
    (calc(middle).energies.potential > energy ? above : below) = middle;
  }
  return {std::move(calc), Path::Swings, start, below, 0};
}

OneFreedom::Place OneFreedom::calcPlace(double x) const {
  switch (path_) {
    case Path::Runs:
      return {start_ + sign_ * x, sign_};
    case Path::Released:
      return {start_ + x * x / (1 + x), x * (2 + x) / ((1 + x) * (1 + x))};
    case Path::Swings:
      break;
  }
  const double half = 0.5 * (other_ - start_);
  // 1 - cos x, without cancellation
  return {start_ + 2 * half * std::sin(0.5 * x) * std::sin(0.5 * x), half * std::sin(x)};
}

double OneFreedom::calcSinceRest(double x) const {
  if (path_ == Path::Runs) return std::numeric_limits<double>::infinity();
  return path_ == Path::Swings ? std::remainder(x, kPi) : x;
}

double OneFreedom::calcFreeEnergy(double x) const {
  const double since_rest = calcSinceRest(x);
  if (std::abs(since_rest) > kNearRest) return energy_ - calc_(calcPlace(x).s).energies.potential;
  const auto calcPower = [this](double y) {
    const Place place = calcPlace(y);
    return -calc_(place.s).energies.slope * place.slope;
  };
  return integrate(calcPower, x - since_rest, x);
}

// dt/dx, which is smooth; at a rest it is the limit of 0 / 0.
double OneFreedom::calcPace(double x) const {
  if (std::abs(calcSinceRest(x)) < kAtRest) x += kAtRest;
  const Place place = calcPlace(x);
  return std::abs(place.slope) * std::sqrt(calc_(place.s).energies.inertia / (2 * calcFreeEnergy(x)));
}

double OneFreedom::calcTime(double from, double to) const {
  return integrate([this](double x) { return calcPace(x); }, from, to);
}

OneFreedom::State OneFreedom::calcState(double t) const {
  if (t < time_) x_ = time_ = 0;
  for (double duration; time_ + (duration = calcTime(x_, x_ + kPanel)) <= t; time_ += duration) x_ += kPanel;
  double x = x_ + 0.5 * kPanel;
  for (int i = 0; i < 20; ++i) {
    const double change = (t - time_ - calcTime(x_, x)) / calcPace(x);
    x = std::clamp(x + change, x_, x_ + kPanel);
    if (std::abs(change) < 1e-15 * (1 + x)) break;
  }
  const Place place = calcPlace(x);
  const double speed = std::sqrt(2 * std::max(0.0, calcFreeEnergy(x)) / calc_(place.s).energies.inertia);
  return {place.s, place.slope < 0 ? -speed : speed};
}

}  // namespace bielle::loops
