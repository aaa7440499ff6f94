// Andrews' squeezer: seven bodies in a plane, three loops, one freedom, driven by a constant torque against a spring. Its names
// and its data are those of Hairer and Wanner, "Solving Ordinary Differential Equations II", section VII.7.
//
// All rods follow from the angle beta of the crank, whose end is F, by meetings of circles: E is at the distances d from F and
// ss from B; G at zt from A and e from E; H at u from A and zf from E.
#include <array>
#include <cmath>

#include "loops/parts.h"
#include "loops/problem.h"

namespace bielle::loops::squeezer {
namespace {

using Eigen::Vector2d;

constexpr double kMasses[] = {.04325, .00365, .02373, .00706, .07050, .00706, .05498};
constexpr double kInertias[] = {2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5};
constexpr double kD = .028, kDa = .0115, kE = .02, kEa = .01421, kRr = .007, kRa = .00092, kSs = .035, kSa = .01874,
                 kSb = .01043, kSc = .018, kSd = .02, kTa = .02308, kTb = .00916, kU = .04, kUa = .01228, kUb = .00449,
                 kZf = .02, kZt = .04, kFa = .01421;
constexpr double kTorque = .033, kStiffness = 4530, kRest = .07785, kBeta = -0.0617138900142764;
const Vector2d kA(-.06934, -.00227), kB(-.03635, .03273), kC(.014, .072);

Vector3d raise(const Vector2d& p) { return {p.x(), p.y(), 0}; }
double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Bodies 1 to 7: where they hang, and their centres of mass in their frames.
struct Part {
  const char* name;
  const char* joint;
  const char* parent;
  Vector2d at, com;
};
const std::array<Part, 7> kParts = {{{"crank", "beta", "world", {0, 0}, {kRa, 0}},
                                     {"rod2", "Theta", "crank", {kRr, 0}, {-kDa, 0}},
                                     {"triangle", "gamma", "world", kB, {kSb, -kSa}},
                                     {"rod5", "delta", "world", kA, {kTa, kTb}},
                                     {"rod4", "Phi", "rod5", {kZt, 0}, {0, kEa - kE}},
                                     {"rod7", "epsilon", "world", kA, {-kUb, -kUa}},
                                     {"rod6", "Omega", "rod7", {0, -kU}, {kZf - kFa, 0}}}};
constexpr int kBody[] = {0, 1, 2, 4, 3, 6, 5};  // indices of masses

Inertia makePlate(int part) {
  const double inertia = kInertias[kBody[part]];
  return makeInertia(kMasses[kBody[part]], raise(kParts[part].com), {inertia / 2, inertia / 2, inertia});
}

Model makeModel(const VectorXd& start) {
  ModelBuilder builder("squeezer");
  builder.setGravity(Vector3d::Zero());
  std::vector<std::pair<std::string, std::vector<double>>> joints;
  for (int i = 0; i < 7; ++i) {
    const Part& part = kParts[i];
    builder.addLink(part.name, part.parent, makeHinge(part.joint, raise(part.at), Vector3d::UnitZ()), makePlate(i));
    joints.push_back({part.joint, {start[i]}});
  }
  const auto mark = [&builder](const char* name, const char* link, const Vector2d& at) {
    builder.addFrame(name, link, makePlace(raise(at)));
  };
  mark("e2", "rod2", {-kD, 0});
  mark("e3", "triangle", {0, -kSs});
  mark("e4", "rod4", {0, -kE});
  mark("e6", "rod6", {kZf, 0});
  mark("c", "world", kC);
  mark("d", "triangle", {kSd, -kSc});
  for (const char* other : {"e3", "e4", "e6"})
    builder.addClosure(std::string("e2_") + other, ClosureKind::Ball3D, "e2", other);
  PointSpring spring;
  spring.name = "spring";
  spring.stiffness = kStiffness;
  spring.rest = kRest;
  builder.addPointSpring("c", "d", spring);
  builder.addMotor("beta");
  addStart(builder, joints);
  return builder.build();
}

// A point of the plane and its derivative by beta.
struct Point {
  Vector2d p, slope = Vector2d::Zero();
};
Point operator-(const Point& a, const Point& b) { return {a.p - b.p, a.slope - b.slope}; }

// Where circles about two points meet, on the left of the way from the first to the second.
Point meet(const Point& a, double radius_a, const Point& b, double radius_b) {
  const Vector2d way = b.p - a.p;
  const double distance = way.norm();
  const double along = (distance * distance + radius_a * radius_a - radius_b * radius_b) / (2 * distance);
  const Vector2d x = way / distance, y(-x.y(), x.x());
  Point out{a.p + along * x + std::sqrt(radius_a * radius_a - along * along) * y};
  // The velocity relative to each centre is normal to its radius.
  Eigen::Matrix2d radii;
  radii << (out.p - a.p).transpose(), (out.p - b.p).transpose();
  const Vector2d rates(radii.row(0).dot(a.slope), radii.row(1).dot(b.slope));
  out.slope = radii.inverse() * rates;
  return out;
}

struct Angle {
  double value, slope;
};
Angle operator-(const Angle& a, const Angle& b) { return {a.value - b.value, a.slope - b.slope}; }

// Of a frame in which a point at the angle `own` is seen along `way`.
Angle calcAngle(const Point& way, const Vector2d& own) {
  return {std::atan2(cross(own, way.p), own.dot(way.p)), cross(way.p, way.slope) / way.p.squaredNorm()};
}

Posture calcPosture(double beta) {
  const Vector2d direction(std::cos(beta), std::sin(beta)), normal(-direction.y(), direction.x());
  const Point A{kA}, B{kB}, F{kRr * direction, kRr * normal};
  const Point E = meet(F, kD, B, kSs), G = meet(A, kZt, E, kE), H = meet(E, kZf, A, kU);
  const Angle crank{beta, 1}, rod2 = calcAngle(F - E, {1, 0}), gamma = calcAngle(E - B, {0, -1}),
                              delta = calcAngle(G - A, {1, 0}), rod4 = calcAngle(E - G, {0, -1}),
                              epsilon = calcAngle(H - A, {0, -1}), rod6 = calcAngle(E - H, {1, 0});
  const Angle angles[] = {crank, rod2 - crank, gamma, delta, rod4 - delta, epsilon, rod6 - epsilon};
  Posture posture;
  posture.q.resize(7);
  posture.q_slope.resize(7);
  std::array<MovingFrame, 7> frames;
  const int parents[] = {-1, 0, -1, -1, 3, -1, 5};
  for (int i = 0; i < 7; ++i) {
    posture.q[i] = angles[i].value;
    posture.q_slope[i] = angles[i].slope;
    const MovingFrame parent = parents[i] < 0 ? MovingFrame() : frames[parents[i]];
    frames[i] = parent.shifted(raise(kParts[i].at)).turned(Vector3d::UnitZ(), angles[i].value, angles[i].slope);
    posture.energies.addBody(frames[i], makePlate(i), Vector3d::Zero());
  }
  const Vector3d d = raise({kSd, -kSc}), line = frames[2].locate(d) - raise(kC);
  const double stretch = line.norm() - kRest;
  posture.energies.potential += 0.5 * kStiffness * stretch * stretch - kTorque * beta;
  posture.energies.slope += kStiffness * stretch * line.normalized().dot(frames[2].calcVelocity(d)) - kTorque;
  return posture;
}

}  // namespace
}  // namespace bielle::loops::squeezer

namespace bielle::loops {

Problem makeSqueezer() {
  using namespace squeezer;
  Problem problem;
  problem.name = "squeezer";
  problem.title = "Andrews' squeezer";
  const OneFreedom motion = OneFreedom::makeReleased(calcPosture, kBeta);
  setMotion(problem, motion, kBeta, 0);
  problem.model = makeModel(problem.start.q);
  problem.torques = VectorXd::Constant(1, kTorque);
  problem.duration = 0.05;
  problem.pace = 0.005;
  problem.times = {0.01, 0.03, 0.05};
  for (const Part& part : kParts) problem.outputs.push_back({part.joint, "rad"});
  problem.judged = 7;
  problem.calcOutputs = [](const VectorXd& q, const VectorXd&) { return q; };
  setEnergy(problem);
  // As printed, to the digits that are right (docs/results/loops.md).
  constexpr double kPrinted[] = {15.81077119629904,   -15.75637105984298, 0.04082224013073101, 0.5244099658805304,
                                 -0.5347301163226948, 1.048080741042263,  0.5347301163226948};
  for (int i = 0; i < 7; ++i) problem.digits.push_back({0.03, i, kPrinted[i], 2e-9});
  return problem;
}

}  // namespace bielle::loops
