// Fourbar1 of Modelica's library of multibody mechanics: a crank about x, a slider along x, and between them a rod with a ball
// at the crank and hinges about y and z at the slider. Nothing in it is redundant.
//
// From the angle phi of the crank follow its end P and, with w the vector along the rod,
//     w = R_y(alpha) R_z(beta) r = P - (1.2 + s, 0.2, 0)                                                           (1)
// whose y gives beta, whose z then gives alpha, and whose x gives s.
#include <cmath>

#include "loops/parts.h"
#include "loops/problem.h"
#include "math/constants.h"

namespace bielle::loops::spatial_fourbar {
namespace {

constexpr double kDiameter = 0.05, kDensity = 7700, kSpeed = 5.235987755982989, kBase = 1.2;
const Vector3d kGravity(0, -9.80665, 0), kCrank(0, 0.5, 0.1), kPost(0, 0.2, 0), kRod(-1, 0.3, 0.1);

Inertia makeCylinder(const Vector3d& end) {
  const double r = kDiameter / 2, length = end.norm(), mass = kDensity * kPi * r * r * length;
  return makeRod(mass, end, mass * r * r / 2, mass * (length * length / 12 + r * r / 4));
}

Model makeModel(const VectorXd& start) {
  ModelBuilder builder("spatial_fourbar");
  builder.setGravity(kGravity);
  builder.addLink("crank", "world", makeHinge("phi", Vector3d::Zero(), Vector3d::UnitX()), makeCylinder(kCrank));
  builder.addLink("post", "world", makeJoint("s", JointKind::Prismatic, {kBase, 0, 0}, Vector3d::UnitX()),
                  makeCylinder(kPost));
  builder.addLink("rod", "post",
                  makeJoint("universal", JointKind::Universal, kPost, Vector3d::UnitY(), Vector3d::UnitZ()),
                  makeCylinder(kRod));
  builder.addFrame("crank_end", "crank", makePlace(kCrank));
  builder.addFrame("rod_end", "rod", makePlace(kRod));
  builder.addClosure("ball", ClosureKind::Ball3D, "rod_end", "crank_end");
  addStart(builder, {{"phi", {start[0]}}, {"s", {start[1]}}, {"universal", {start[2], start[3]}}});
  return builder.build();
}

Posture calcPosture(double phi) {
  const MovingFrame crank = MovingFrame().turned(Vector3d::UnitX(), phi, 1);
  const Vector3d P = crank.locate(kCrank), P_slope = crank.calcVelocity(kCrank);
  // In the plane of x and y, r has the length rho and the angle eta; turned by beta it points to negative x.
  const double rho = kRod.head<2>().norm(), eta = std::atan2(kRod.y(), kRod.x());
  const double y = P.y() - kPost.y(), x = -std::sqrt(rho * rho - y * y);
  const double beta = std::atan2(y, x) - eta, beta_slope = P_slope.y() / x, x_slope = -y * beta_slope;
  // In the plane of z and x, (z, x) of the rod is turned by alpha.
  const double z = kRod.z(), square = z * z + x * x;
  const double w_x = -std::sqrt(square - P.z() * P.z()), w_x_slope = (x * x_slope - P.z() * P_slope.z()) / w_x;
  const double alpha = std::atan2(w_x, P.z()) - std::atan2(x, z);
  const double alpha_slope = (P.z() * w_x_slope - w_x * P_slope.z() - z * x_slope) / square;
  Posture posture;
  posture.q = Eigen::Vector4d(phi, -w_x - kBase, alpha, std::remainder(beta, 2 * kPi));
  posture.q_slope = Eigen::Vector4d(1, -w_x_slope, alpha_slope, beta_slope);
  const MovingFrame post = MovingFrame().shifted({kBase, 0, 0}).moved(Vector3d::UnitX(), posture.q[1], -w_x_slope);
  const MovingFrame rod =
      post.shifted(kPost).turned(Vector3d::UnitY(), alpha, alpha_slope).turned(Vector3d::UnitZ(), beta, beta_slope);
  posture.energies.addBody(crank, makeCylinder(kCrank), kGravity);
  posture.energies.addBody(post, makeCylinder(kPost), kGravity);
  posture.energies.addBody(rod, makeCylinder(kRod), kGravity);
  return posture;
}

}  // namespace
}  // namespace bielle::loops::spatial_fourbar

namespace bielle::loops {

Problem makeSpatialFourbar() {
  using namespace spatial_fourbar;
  Problem problem;
  problem.name = "spatial_fourbar";
  problem.title = "Spatial four-bar";
  setMotion(problem, OneFreedom::makeRunning(calcPosture, 0, kSpeed), 0, kSpeed);
  problem.model = makeModel(problem.start.q);
  problem.torques.resize(0);
  problem.duration = 5;
  problem.times = {0.5, 1, 2, 5};
  problem.outputs = {{"phi", "rad"}, {"s", "m"}, {"d phi/dt", "rad/s"}};
  problem.judged = 2;
  problem.calcOutputs = [](const VectorXd& q, const VectorXd& v) { return Vector3d(q[0], q[1], v[0]); };
  setEnergy(problem);
  problem.digits = {{0.1, 0, 0.573724545385, 1e-12}, {0.1, 1, -0.227237700479, 1e-12}, {0.1, 2, 6.46079600351, 1e-11},
                    {1, 0, 7.802163425546, 1e-12},   {1, 2, 9.36170825130, 1e-11},     {2, 0, 16.536122506719, 1e-12}};
  return problem;
}

}  // namespace bielle::loops
