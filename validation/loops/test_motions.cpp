// The true motions: the methods that give them, and digits that others have printed.
#include <catch2/catch.hpp>
#include <cmath>

#include "loops/extrapolation.h"
#include "loops/problem.h"
#include "math/constants.h"

using namespace bielle;
using namespace bielle::loops;

namespace {

Posture makePosture(double s, const Energies& energies) {
  return {VectorXd::Constant(1, s), VectorXd::Ones(1), energies};
}

}  // namespace

TEST_CASE("motions by their energy, where they are known in closed form") {
  const auto oscillator = [](double s) { return makePosture(s, {1, s * s / 2, s}); };
  const auto swing = OneFreedom::makeSwinging(oscillator, -0.7, 2.1);
  for (const double t : {0.0, 0.01, 1.3, kPi - 1e-3, kPi, 9.5, 40.0}) {
    CAPTURE(t);
    const OneFreedom::State state = swing.calcState(t);
    CHECK(std::abs(state.s + 0.7 * std::cos(t)) < 3e-13);
    CHECK(std::abs(state.rate - 0.7 * std::sin(t)) < 3e-13);
  }
  CHECK(std::abs(swing.calcState(0.5).s + 0.7 * std::cos(0.5)) < 3e-13);  // back again
  const auto pulled = OneFreedom::makeReleased([](double s) { return makePosture(s, {2, -6 * s, -6}); }, 5);
  const auto thrown = OneFreedom::makeRunning([](double s) { return makePosture(s, {2, 6 * s, 6}); }, 5, -2);
  for (const double t : {1e-3, 0.2, 3.0}) {
    CAPTURE(t);
    CHECK(std::abs(pulled.calcState(t).s - 5 - 1.5 * t * t) < 1e-13 * (5 + t * t));
    CHECK(std::abs(thrown.calcState(t).s - 5 + 2 * t + 1.5 * t * t) < 1e-12);
    CHECK(std::abs(thrown.calcState(t).rate + 2 + 3 * t) < 1e-12);
  }
}

TEST_CASE("extrapolation follows a damped oscillator") {
  // y'' = -4 y' - 5 y from (1, 0): y = e^-2t (cos t + 2 sin t)
  const auto f = [](const VectorXd& y) -> VectorXd { return Eigen::Vector2d(y[1], -4 * y[1] - 5 * y[0]); };
  VectorXd y = Eigen::Vector2d(1, 0);
  for (int i = 0; i < 20; ++i) y = extrapolate(f, y, 0.1);
  CHECK(std::abs(y[0] - std::exp(-4.0) * (std::cos(2.0) + 2 * std::sin(2.0))) < 1e-14);
}

TEST_CASE("true motions have the digits that were printed, as far as these are right") {
  std::vector<std::string> names = listProblems();
  names.push_back("fourbars_10");
  for (const std::string& name : names) {
    const Problem problem = makeProblem(name);
    for (const Digits& digits : problem.digits) {
      const Motion motion = problem.calcMotion(digits.time);
      const double value = problem.calcOutputs(motion.q, motion.v)[digits.output];
      CAPTURE(name, digits.time, problem.outputs[digits.output].name, value - digits.value);
      CHECK(std::abs(value - digits.value) < digits.tolerance);
    }
  }
}

TEST_CASE("the printed angles of Andrews' squeezer are those of its motion a trillionth of a second later") {
  const Problem problem = makeSqueezer();
  const Motion motion = problem.calcMotion(0.03);
  for (const Digits& digits : problem.digits) {
    const double late = (digits.value - motion.q[digits.output]) / motion.v[digits.output];
    CAPTURE(problem.outputs[digits.output].name, late);
    CHECK(std::abs(late - 1.0e-12) < (std::abs(motion.v[digits.output]) > 10 ? 1e-14 : 2e-13));
  }
}

TEST_CASE("Bricard's mechanism comes to rest at the mirrored corners after half a period") {
  const Problem problem = makeBricard();
  const Motion motion = problem.calcMotion(2.495855756843);
  CHECK((problem.calcOutputs(motion.q, motion.v) - Vector3d(-1, -1, 1)).norm() < 1e-10);
  CHECK(motion.v.norm() < 1e-10);
  const Motion later = problem.calcMotion(2 * 2.495855756843);
  CHECK(later.q.norm() < 1e-10);
}

TEST_CASE("the motion of the governor does not depend on the steps of its integration") {
  const Problem problem = makeGovernor(), finer = makeGovernor(1e-4);
  for (const double t : {0.5, 2.0}) {
    const Motion motion = problem.calcMotion(t), other = finer.calcMotion(t);
    CAPTURE(t);
    CHECK((motion.q - other.q).cwiseAbs().maxCoeff() < 1e-11);
  }
}
