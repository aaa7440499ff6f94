// The stiff flyball governor: a shaft about the vertical, two rods with balls at its top, a slider along it, and springs with
// dampers where couplers would tie the middles of the rods to the slider. It has no loops; its springs are stiff.
//
// By symmetry its true motion has three freedoms: the turn phi of the shaft, the angle alpha of both rods below the horizontal
// and the height s of the slider. With the inertia J(alpha) about the vertical and the length l(alpha, s) of the springs,
//     J phi' = const,   2 A alpha'' = J_alpha phi'^2 / 2 - V_alpha - 2 f l_alpha,   m s'' = -m g - 2 f l_s,         (1)
//     f = k (l - l_0) + c l'.
#include <cmath>
#include <memory>

#include "bielle/dynamics/kinematics.h"
#include "loops/extrapolation.h"
#include "loops/parts.h"
#include "loops/problem.h"
#include "math/constants.h"

namespace bielle::loops::governor {
namespace {

constexpr double kGravity = 9.81, kLength = 1, kWidth = 0.01, kCube = 0.1, kDensity = 3000, kBall = 5;
constexpr double kStiffness = 8e5, kDamping = 4e4, kRest = 0.5;
constexpr double kStart = 0.5, kAlpha = 30 * kDegree, kSpeed = 2 * kPi;
constexpr double kRodMass = kDensity * kLength * kWidth * kWidth, kSliderMass = kDensity * kCube * kCube * kCube;
constexpr double kAlong = kRodMass * kWidth * kWidth / 6,
                 kAcross = kRodMass * (kLength * kLength + kWidth * kWidth) / 12,
                 kSliderMoment = kSliderMass * kCube * kCube / 6;

Model makeModel() {
  ModelBuilder builder("governor");
  builder.setGravity({0, -kGravity, 0});
  const Vector3d up = Vector3d::UnitY(), top = kLength * up;
  builder.addLink("shaft", "world", makeHinge("phi", Vector3d::Zero(), up), makeRod(kRodMass, top, kAlong, kAcross));
  builder.addLink("slider", "shaft", makeJoint("s", JointKind::Prismatic, Vector3d::Zero(), up),
                  makeInertia(kSliderMass, Vector3d::Zero(), Vector3d::Constant(kSliderMoment)));
  for (const int side : {1, -1}) {
    const std::string n = side > 0 ? "1" : "2", rod = "rod" + n;
    const Vector3d end(side * kLength, 0, 0);
    // Positive angles lower the rods.
    builder.addLink(rod, "shaft", makeHinge("alpha" + n, top, -side * Vector3d::UnitZ()),
                    makeRod(kRodMass, end, kAlong, kAcross) + makeInertia(kBall, end, Vector3d::Zero()));
    PointSpring spring;
    spring.name = "coupler" + n;
    spring.point1 = 0.5 * end;
    spring.stiffness = kStiffness;
    spring.rest = kRest;
    spring.damping = kDamping;
    builder.addPointSpring(rod, "slider", spring);
  }
  return builder.build();
}

// y = (phi, alpha, alpha', s, s'); phi' follows from the momentum about the vertical.
double calcMoment(double alpha) {
  const double cos = std::cos(alpha), sin = std::sin(alpha);
  return kAlong + kSliderMoment +
         2 * ((kRodMass * kLength * kLength / 4 + kBall * kLength * kLength + kAcross) * cos * cos +
              kAlong * sin * sin);
}

VectorXd calcSlope(const VectorXd& y) {
  static const double momentum = kSpeed * calcMoment(kAlpha);
  const double alpha = y[1], s = y[3], cos = std::cos(alpha), sin = std::sin(alpha);
  const double swing = kRodMass * kLength * kLength / 4 + kBall * kLength * kLength + kAcross;  // A
  const double rate = momentum / calcMoment(alpha), moment_slope = 4 * (kAlong - swing) * sin * cos;
  const double x = kLength / 2 * cos, drop = kLength - kLength / 2 * sin - s, l = std::hypot(x, drop);
  const double l_alpha = (-x * kLength / 2 * sin - drop * kLength / 2 * cos) / l, l_s = -drop / l;
  const double f = kStiffness * (l - kRest) + kDamping * (l_alpha * y[2] + l_s * y[4]);
  const double weight = 2 * kGravity * kLength * (kRodMass / 2 + kBall) * cos;  // -V_alpha
  VectorXd slope(5);
  slope << rate, y[2], (0.5 * moment_slope * rate * rate + weight - 2 * f * l_alpha) / (2 * swing), y[4],
      -kGravity - 2 * f * l_s / kSliderMass;
  return slope;
}

// Goes on from the last time, so that increasing times are quickest.
class GovernorMotion {
 public:
  explicit GovernorMotion(double step) : step_(step) { restart(); }

  Motion calc(double t) {
    if (t < time_) restart();
    for (; time_ + step_ <= t; time_ += step_) y_ = extrapolate(calcSlope, y_, step_);
    const VectorXd y = t > time_ ? extrapolate(calcSlope, y_, t - time_) : y_;
    const VectorXd slope = calcSlope(y);
    return {Eigen::Vector4d(y[0], y[3], y[1], y[1]), Eigen::Vector4d(slope[0], y[4], y[2], y[2])};
  }

 private:
  void restart() {
    time_ = 0;
    y_.resize(5);
    y_ << 0, kAlpha, 0, kStart, 0;
  }
  double step_, time_ = 0;
  VectorXd y_;
};

// About the vertical, by the energies of the model: the derivative of twice the kinetic energy by the speed of the shaft.
double calcMomentum(const Model& model, Workspace& ws, const VectorXd& q, const VectorXd& v) {
  updatePositions(model, ws, q);
  double energies[2];
  for (int i = 0; i < 2; ++i) {
    VectorXd turned = v;
    turned[0] += i == 0 ? -0.5 : 0.5;
    updateVelocities<double>(model, ws, turned);
    energies[i] = calcKineticEnergy(model, ws);
  }
  return energies[1] - energies[0];  // exact: the energy is quadratic
}

}  // namespace
}  // namespace bielle::loops::governor

namespace bielle::loops {

Problem makeGovernor(double step) {
  using namespace governor;
  Problem problem;
  problem.name = "governor";
  problem.title = "Stiff flyball governor";
  problem.model = makeModel();
  problem.torques.resize(0);
  problem.duration = 10;
  problem.times = {1, 5, 10};
  problem.outputs = {{"s", "m"}, {"alpha", "rad"}, {"d phi/dt", "rad/s"}};
  problem.judged = 2;
  problem.calcOutputs = [](const VectorXd& q, const VectorXd& v) { return Vector3d(q[1], q[2], v[0]); };
  problem.calcMotion = [motion = GovernorMotion(step)](double t) mutable { return motion.calc(t); };
  problem.start = problem.calcMotion(0);
  problem.invariant = "momentum about the shaft";
  problem.calcInvariant = [model = problem.model, ws = Workspace(problem.model)](
                              const VectorXd& q, const VectorXd& v) mutable { return calcMomentum(model, ws, q, v); };
  problem.invariant_scale = problem.calcInvariant(problem.start.q, problem.start.v);
  return problem;
}

}  // namespace bielle::loops
