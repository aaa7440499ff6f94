// N four-bars side by side: N + 1 vertical and N horizontal thin rods. Wherever all rods lie in a line the rank of the closures
// falls by N, and the mobility jumps from 1 to N + 1.
//
// All vertical rods turn alike, the horizontal ones do not turn: with theta from the vertical,
//     M = m l^2 ((N + 1) / 3 + N),   V = m g l ((N + 1) / 2 + N) cos theta                                         (1)
#include <cmath>

#include "loops/parts.h"
#include "loops/problem.h"

namespace bielle::loops::fourbars {
namespace {

constexpr double kMass = 1, kLength = 1, kGravity = 9.81, kSpeed = 1;

Model makeModel(int count) {
  ModelBuilder builder("fourbars_" + std::to_string(count));
  builder.setGravity({0, -kGravity, 0});
  const Vector3d up(0, kLength, 0), along(kLength, 0, 0), axis = -Vector3d::UnitZ();
  const Inertia vertical = makeRod(kMass, up, 0, kMass * kLength * kLength / 12),
                horizontal = makeRod(kMass, along, 0, kMass * kLength * kLength / 12);
  for (int i = 0; i <= count; ++i) {
    const std::string n = std::to_string(i);
    builder.addLink("vertical" + n, "world", makeHinge("hinge" + n, i * along, axis), vertical);
    builder.addFrame("top" + n, "vertical" + n, makePlace(up));
    if (i > 0) builder.addClosure("loop" + n, ClosureKind::Ball3D, "end" + n, "top" + n);
    if (i == count) break;
    const std::string next = std::to_string(i + 1);
    builder.addLink("horizontal" + next, "vertical" + n, makeHinge("knee" + next, up, axis), horizontal);
    builder.addFrame("end" + next, "horizontal" + next, makePlace(along));
  }
  return builder.build();
}

Posture calcPosture(int count, double theta) {
  Posture posture;
  posture.q.resize(2 * count + 1);
  posture.q_slope.resize(2 * count + 1);
  for (int i = 0; i <= 2 * count; ++i) {
    const int sign = i % 2 == 0 ? 1 : -1;
    posture.q[i] = sign * theta;
    posture.q_slope[i] = sign;
  }
  const double weight = kMass * kGravity * kLength * (0.5 * (count + 1) + count);
  posture.energies = {kMass * kLength * kLength * ((count + 1) / 3.0 + count), weight * std::cos(theta),
                      -weight * std::sin(theta)};
  return posture;
}

}  // namespace
}  // namespace bielle::loops::fourbars

namespace bielle::loops {

Problem makeFourbars(int count) {
  using namespace fourbars;
  Problem problem;
  problem.name = "fourbars_" + std::to_string(count);
  problem.title = std::to_string(count) + (count == 1 ? " four-bar" : " four-bars");
  problem.model = makeModel(count);
  problem.torques.resize(0);
  problem.duration = 10;
  problem.times = {1, 5, 10};
  problem.outputs = {{"x(B0)", "m"}, {"y(B0)", "m"}};
  problem.judged = 2;
  problem.calcOutputs = [](const VectorXd& q, const VectorXd&) {
    return Eigen::Vector2d(kLength * std::sin(q[0]), kLength * std::cos(q[0]));
  };
  setMotion(problem, OneFreedom::makeRunning([count](double s) { return calcPosture(count, s); }, 0, kSpeed / kLength),
            0, kSpeed / kLength);
  setEnergy(problem);
  constexpr double kPrinted = 1e-11;
  if (count == 2)
    problem.digits = {{1, 0, -0.19502030195, kPrinted},   {1, 1, -0.98079920566, kPrinted},
                      {5, 0, -0.81131046101, kPrinted},   {5, 1, -0.58461554535, kPrinted},
                      {10, 0, 0.3284581115408, kPrinted}, {10, 1, 0.9445185381786, kPrinted}};
  if (count == 10) problem.digits = {{10, 0, 0.20435356099, kPrinted}, {10, 1, 0.97889714583, kPrinted}};
  return problem;
}

}  // namespace bielle::loops
