#include "worlds/torque_delay.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "control/clock.h"

namespace bielle::worlds {
namespace {

// Clocks that sum up their steps may differ by this much; without it, steps as short as rounding would arise.

size_t countUnderWay(double period, const DelayOptions& o) {
  if (!(o.jitter >= 0 && o.jitter <= o.delay && std::isfinite(o.delay) && period > 0))
    throw std::invalid_argument("TorqueDelay: the jitter must lie between 0 and the delay");
  return static_cast<size_t>(std::ceil((o.delay + o.jitter) / period));
}

}  // namespace

TorqueDelay::TorqueDelay(int nu, double period, const DelayOptions& options)
    : options_(options), generator_(options.seed) {
  ring_.resize(countUnderWay(period, options) + 2);
  for (Torques& torques : ring_) torques.u.setZero(nu);
}

void TorqueDelay::send(double time, ConstVectorRef u) {
  double delay = options_.delay;
  if (options_.jitter > 0)
    delay += std::uniform_real_distribution<double>(-options_.jitter, options_.jitter)(generator_);
  if (!started_) {
    started_ = true;
    ring_[acting_] = {time, u};
    return;
  }
  if (under_way_ + 1 == ring_.size()) throw std::logic_error("TorqueDelay: torques are sent faster than announced");
  ++under_way_;
  Torques& last = ring_[(acting_ + under_way_) % ring_.size()];
  last.time = time + delay;
  last.u = u;
}

const VectorXd& TorqueDelay::getTorques(double time) {
  for (size_t age = under_way_; age > 0; --age) {
    if (get(age).time > time + kClockTolerance) continue;
    acting_ = (acting_ + age) % ring_.size();
    under_way_ -= age;
    break;
  }
  return acting();
}

double TorqueDelay::nextChange() const {
  double next = std::numeric_limits<double>::infinity();
  for (size_t age = 1; age <= under_way_; ++age) next = std::min(next, get(age).time);
  return next;
}

}  // namespace bielle::worlds
