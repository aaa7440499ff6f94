// Bricard's mechanism: five rods and six hinges at the corners of a cube. Six rows of a closure in place of six freedoms leave
// none by Gruebler's count; their rank is five, and it moves.
//
// Its angles are (-a, -b, -a, -b, -a) from the posture at the corners, with
//     (1 - sin a) (1 - sin b) = 1.                                                                                 (1)
// The curve is closed, and neither angle is a coordinate all along it. With 1 - sin a = 2^sin(psi), psi is one, of period 4 pi:
//     cos a = c(psi) sin(pi / 4 - psi / 2),   c^2 = 4 ln 2 E(ln 2 (1 - sin psi)) 2^sin(psi),   E(y) = (1 - e^-y) / y (2)
// and b follows from a by psi -> -psi.
#include <cmath>

#include "loops/parts.h"
#include "loops/problem.h"
#include "math/constants.h"

namespace bielle::loops::bricard {
namespace {

constexpr double kMass = 1, kLength = 1, kEdge = 0.1;
const Vector3d kGravity(0, -9.81, 0);

struct Rod {
  Vector3d end;   // from its first hinge to the next one
  Vector3d axis;  // of its first hinge
};
const Rod kRods[] = {{Vector3d::UnitX(), Vector3d::UnitY()},
                     {-Vector3d::UnitY(), Vector3d::UnitZ()},
                     {Vector3d::UnitZ(), Vector3d::UnitX()},
                     {-Vector3d::UnitX(), Vector3d::UnitY()},
                     {Vector3d::UnitY(), Vector3d::UnitZ()}};

Inertia makeInertia(const Rod& rod) {
  return makeRod(kMass, kLength * rod.end, kMass * kEdge * kEdge / 6, kMass * (kLength * kLength + kEdge * kEdge) / 12);
}

Model makeModel() {
  ModelBuilder builder("bricard");
  builder.setGravity(kGravity);
  std::string parent = "world";
  Vector3d at = Vector3d::Zero();
  for (int i = 0; i < 5; ++i) {
    const std::string name = "rod" + std::to_string(i + 1);
    builder.addLink(name, parent, makeHinge("p" + std::to_string(i), at, kRods[i].axis), makeInertia(kRods[i]));
    parent = name;
    at = kLength * kRods[i].end;
  }
  builder.addFrame("end", "rod5", makePlace(at));
  builder.addFrame("p5", "world", makePlace({0, 0, kLength}));
  builder.addClosure("loop", ClosureKind::Hinge5D, "end", "p5", Vector3d::UnitX());
  return builder.build();
}

// a of Eq. (2) and its derivative.
Eigen::Vector2d calcAngle(double psi) {
  const double ln2 = std::log(2.0), power = std::exp2(std::sin(psi));
  const double root = std::sin(kPi / 4 - psi / 2);
  const double y = 2 * ln2 * root * root;  // ln 2 (1 - sin psi)
  const double E = y > 0 ? -std::expm1(-y) / y : 1;
  double a = std::atan2(1 - power, root * std::sqrt(4 * ln2 * E * power));
  if (root < 0 && a > 0) a -= 2 * kPi;  // continuous
  return {a, -std::sin(kPi / 4 + psi / 2) * std::sqrt(ln2 * power / E)};
}

template <typename Visit>
void visitRods(const VectorXd& q, const VectorXd& rate, const Visit& visit) {
  MovingFrame frame;
  for (int i = 0; i < 5; ++i) {
    frame = frame.turned(kRods[i].axis, q[i], rate[i]);
    visit(i, frame);
    frame = frame.shifted(kLength * kRods[i].end);
  }
}

Posture calcPosture(double psi) {
  const Eigen::Vector2d a = calcAngle(psi), b = calcAngle(-psi);
  Posture posture;
  posture.q.resize(5);
  posture.q << -a[0], -b[0], -a[0], -b[0], -a[0];
  posture.q_slope.resize(5);
  posture.q_slope << -a[1], b[1], -a[1], b[1], -a[1];
  visitRods(posture.q, posture.q_slope, [&posture](int i, const MovingFrame& frame) {
    posture.energies.addBody(frame, makeInertia(kRods[i]), kGravity);
  });
  return posture;
}

VectorXd calcP3(const VectorXd& q, const VectorXd& v) {
  Vector3d p3;
  visitRods(q, v, [&p3](int i, const MovingFrame& frame) {
    if (i == 3) p3 = frame.p;
  });
  return p3;
}

}  // namespace
}  // namespace bielle::loops::bricard

namespace bielle::loops {

Problem makeBricard() {
  using namespace bricard;
  Problem problem;
  problem.name = "bricard";
  problem.title = "Bricard's mechanism";
  problem.model = makeModel();
  problem.torques.resize(0);
  problem.duration = 10;
  problem.times = {0.5, 1, 2, 10};
  problem.outputs = {{"x(P3)", "m"}, {"y(P3)", "m"}, {"z(P3)", "m"}};
  problem.judged = 3;
  problem.calcOutputs = calcP3;
  // It falls towards the side where the potential does.
  const double side = calcPosture(0).energies.slope > 0 ? -1 : 1;
  setMotion(problem,
            OneFreedom::makeSwinging(
                [side](double s) {
                  Posture posture = calcPosture(side * s);
                  posture.q_slope *= side;
                  posture.energies.slope *= side;
                  return posture;
                },
                0, 1.5 * kPi),
            0, 0);
  setEnergy(problem);
  constexpr double kPrinted = 1e-11;
  problem.digits = {
      {0.25, 0, 0.99809250226, kPrinted}, {0.25, 1, -1.05993979848, kPrinted}, {0.25, 2, 0.93826381180, kPrinted},
      {0.5, 0, 0.96828367911, kPrinted},  {0.5, 1, -1.22462515944, kPrinted},  {0.5, 2, 0.75014660944, kPrinted},
      {1, 0, 0.51050146119, kPrinted},    {1, 1, -1.64916759940, kPrinted},    {1, 2, 0.14012311455, kPrinted},
      {2, 0, -0.96934034478, kPrinted},   {2, 1, -1.22124689496, kPrinted},    {2, 2, 0.75427801078, kPrinted}};
  return problem;
}

}  // namespace bielle::loops
