// A spatial slider-crank: the rod has a ball at the crank and a universal joint at the slider, whose first axis is that of the
// slider. Which axis that is, and whether the rod spins, decides the motion.
//
// From the angle phi of the crank follow its end B, the place x of the slider, and the angles of the universal joint, for which
//     R_x(alpha) R_y(beta) (-l, 0, 0) = B - (x, 0, 0).                                                             (1)
#include <cmath>

#include "loops/parts.h"
#include "loops/problem.h"

namespace bielle::loops::slider_crank {
namespace {

constexpr double kCrank = 0.08, kRod = 0.3, kSpeed = 6, kSlider = 2;
const Vector3d kA(0, 0.1, 0.12), kGravity(0, 0, -9.81);

// Only its inertia about x matters.
Inertia makeCrank() { return makeInertia(0.12, {0, 0, kCrank / 2}, Vector3d::Constant(1e-4)); }
Inertia makeLongRod() { return makeRod(0.5, {-kRod, 0, 0}, 4e-4, 4e-3); }

Model makeModel(const VectorXd& start) {
  ModelBuilder builder("slider_crank");
  builder.setGravity(kGravity);
  builder.addLink("crank", "world", makeHinge("phi", kA, Vector3d::UnitX()), makeCrank());
  builder.addLink("slider", "world", makeJoint("x", JointKind::Prismatic, Vector3d::Zero(), Vector3d::UnitX()),
                  makeInertia(kSlider, Vector3d::Zero(), Vector3d::Constant(1e-3)));
  builder.addLink("rod", "slider",
                  makeJoint("universal", JointKind::Universal, Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitY()),
                  makeLongRod());
  builder.addFrame("crank_end", "crank", makePlace({0, 0, kCrank}));
  builder.addFrame("rod_end", "rod", makePlace({-kRod, 0, 0}));
  builder.addClosure("ball", ClosureKind::Ball3D, "rod_end", "crank_end");
  addStart(builder, {{"phi", {start[0]}}, {"x", {start[1]}}, {"universal", {start[2], start[3]}}});
  return builder.build();
}

Posture calcPosture(double phi) {
  const MovingFrame crank = MovingFrame().shifted(kA).turned(Vector3d::UnitX(), phi, 1);
  const Vector3d end(0, 0, kCrank), B = crank.locate(end), B_slope = crank.calcVelocity(end);
  const double square = B.y() * B.y() + B.z() * B.z(), radius = std::sqrt(square);
  const double x = std::sqrt(kRod * kRod - square), x_slope = -(B.y() * B_slope.y() + B.z() * B_slope.z()) / x;
  const double alpha = std::atan2(-B.y(), B.z()), alpha_slope = (B.y() * B_slope.z() - B.z() * B_slope.y()) / square;
  const double beta = std::atan2(radius, x), beta_slope = -x_slope / radius;
  Posture posture;
  posture.q = Eigen::Vector4d(phi, x, alpha, beta);
  posture.q_slope = Eigen::Vector4d(1, x_slope, alpha_slope, beta_slope);
  const MovingFrame slider = MovingFrame().moved(Vector3d::UnitX(), x, x_slope);
  const MovingFrame rod =
      slider.turned(Vector3d::UnitX(), alpha, alpha_slope).turned(Vector3d::UnitY(), beta, beta_slope);
  posture.energies.addBody(crank, makeCrank(), kGravity);
  posture.energies.addBody(slider, makeInertia(kSlider, Vector3d::Zero(), Vector3d::Zero()), kGravity);
  posture.energies.addBody(rod, makeLongRod(), kGravity);
  return posture;
}

}  // namespace
}  // namespace bielle::loops::slider_crank

namespace bielle::loops {

Problem makeSliderCrank() {
  using namespace slider_crank;
  Problem problem;
  problem.name = "slider_crank";
  problem.title = "Spatial slider-crank";
  setMotion(problem, OneFreedom::makeRunning(calcPosture, 0, kSpeed), 0, kSpeed);
  problem.model = makeModel(problem.start.q);
  problem.torques.resize(0);
  problem.duration = 5;
  problem.times = {0.5, 1, 2, 5};
  problem.outputs = {{"x", "m"}, {"phi", "rad"}, {"d phi/dt", "rad/s"}};
  problem.judged = 2;
  problem.calcOutputs = [](const VectorXd& q, const VectorXd& v) { return Vector3d(q[1], q[0], v[0]); };
  setEnergy(problem);
  problem.digits = {{0.1, 0, 0.226787188553, 1e-12}, {0.1, 1, 0.56003148209, 1e-11}, {0.1, 2, 5.8288881347, 1e-10},
                    {0.5, 0, 0.184952629778, 1e-12}, {0.5, 1, 5.58376255331, 1e-11}, {0.5, 2, 14.4081608102, 1e-10},
                    {1, 0, 0.211721661393, 1e-12},   {1, 1, 10.91359072986, 1e-11},  {1, 2, 10.4275930004, 1e-10},
                    {2, 0, 0.289085197067, 1e-12},   {2, 1, 21.07274452278, 1e-11},  {2, 2, 22.5842400278, 1e-10}};
  return problem;
}

}  // namespace bielle::loops
