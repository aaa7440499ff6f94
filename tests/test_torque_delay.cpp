// Torques that act some time after what they were computed from was measured.
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "worlds/torque_delay.h"

namespace bielle::worlds {
namespace {

VectorXd make(double value) { return VectorXd::Constant(1, value); }

}  // namespace

TEST_CASE("torque delay: without a delay torques act at once") {
  TorqueDelay delay(1, 1e-3);
  for (int tick = 0; tick < 5; ++tick) {
    delay.send(1e-3 * tick, make(tick));
    CHECK(delay.getTorques(1e-3 * tick)[0] == tick);
    CHECK(delay.nextChange() == std::numeric_limits<double>::infinity());
  }
}

TEST_CASE("torque delay: the first torques act at once, later ones after the delay") {
  TorqueDelay delay(1, 1e-3, {2.5e-3, 0, 1});
  for (int tick = 0; tick < 50; ++tick) {
    const double now = 1e-3 * tick;
    delay.send(now, make(tick));
    // The last but two is 3 ms old, the last but one 2 ms.
    CHECK(delay.getTorques(now)[0] == std::max(0, tick - 3));
    if (tick > 0) CHECK(delay.nextChange() == Approx(std::max(now - 2e-3, 1e-3) + 2.5e-3));
    const double half = now + 0.5e-3;
    CHECK(delay.getTorques(half)[0] == std::max(0, tick - 2));
  }
}

TEST_CASE("torque delay: delays lie within the jitter, and torques that are overtaken never act") {
  constexpr double kPeriod = 1e-3, kDelay = 4e-3, kJitter = 3e-3;
  TorqueDelay delay(1, kPeriod, {kDelay, kJitter, 7}), same(1, kPeriod, {kDelay, kJitter, 7});
  double least = 1, most = 0, last = 0;
  int skipped = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    delay.send(kPeriod * tick, make(tick));
    same.send(kPeriod * tick, make(tick));
    for (double now = kPeriod * tick; now < kPeriod * (tick + 1);) {
      const double acting = delay.getTorques(now)[0];
      CHECK(same.getTorques(now)[0] == acting);
      CHECK(acting >= last);
      if (acting != last) {
        const double age = now - kPeriod * acting;
        least = std::min(least, age);
        most = std::max(most, age);
        skipped += static_cast<int>(acting - last) - 1;
      }
      last = acting;
      now = std::max(delay.nextChange(), now + 1e-6);
    }
  }
  CHECK(least >= kDelay - kJitter - 1e-9);
  CHECK(least < kDelay - 0.9 * kJitter);
  CHECK(most <= kDelay + kJitter + 1e-9);
  CHECK(skipped > 100);
}

TEST_CASE("torque delay: a jitter beyond the delay is refused") {
  CHECK_THROWS_AS(TorqueDelay(1, 1e-3, {1e-3, 2e-3, 1}), std::invalid_argument);
}

}  // namespace bielle::worlds
