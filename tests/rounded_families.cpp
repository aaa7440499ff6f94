#include "rounded_families.h"

#include <cmath>

#include "math/direction.h"
#include "math/so3.h"
#include "mechanisms.h"

namespace bielle::testing {
namespace {

double draw(std::mt19937& rng, double from, double to) { return std::uniform_real_distribution<double>(from, to)(rng); }

Matrix3d drawRotation(std::mt19937& rng) {
  return exp3(Vector3d(draw(rng, -2, 2), draw(rng, -2, 2), draw(rng, -2, 2)));
}

// The angle at b between a and c is neither small nor nearly straight.
bool isRegular(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = (a - b).normalized(), v = (c - b).normalized();
  return u.cross(v).norm() > 0.5 && (a - b).norm() > 0.05 && (c - b).norm() > 0.05;
}

Vector3d drawPoint(std::mt19937& rng) { return {draw(rng, -0.4, 0.4), draw(rng, -0.4, 0.4), 0}; }

// In the plane of z = 0; hinges are turned about their axes and moved along them at will.
HingeNet makePlaneNet(std::mt19937& rng, bool parallelogram, bool six) {
  Vector3d a, b, c, d;
  do {
    a = drawPoint(rng), b = drawPoint(rng), c = drawPoint(rng);
    d = parallelogram ? Vector3d(a + c - b) : drawPoint(rng);
  } while (!isRegular(a, b, c) || !isRegular(b, c, d) || (a - d).norm() < 0.05 ||
           (parallelogram && !isRegular(c, d, a)));
  const auto hinge = [&](int body1, int body2, const Vector3d& point) {
    return HingeNet::Hinge{
        body1, body2, {exp3(Vector3d(0, 0, draw(rng, -3, 3))), Vector3d(point + Vector3d(0, 0, draw(rng, -0.1, 0.1)))}};
  };
  HingeNet net{4, {hinge(0, 1, a), hinge(1, 2, b), hinge(0, 3, d), hinge(2, 3, c)}};
  if (!six) return net;
  // A dyad between a point of the coupler and the ground.
  Vector3d e, f, g;
  do e = drawPoint(rng), f = drawPoint(rng), g = drawPoint(rng);
  while (!isRegular(e, f, g));
  net.bodies = 6;
  net.hinges.insert(net.hinges.end(), {hinge(2, 4, e), hinge(0, 5, g), hinge(4, 5, f)});
  return net;
}

HingeNet makeSphericalNet(std::mt19937& rng) {
  Vector3d axes[4];
  const auto regular = [&](int i, int j, int k) {
    const Vector3d u = axes[i].cross(axes[j]), v = axes[j].cross(axes[k]);
    return u.norm() > 0.3 && v.norm() > 0.3 && u.normalized().cross(v.normalized()).norm() > 0.5;
  };
  do
    for (Vector3d& axis : axes) axis = drawRotation(rng).col(2);
  while (!regular(0, 1, 2) || !regular(1, 2, 3) || axes[3].cross(axes[0]).norm() < 0.3);
  const Vector3d center(draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3));
  const auto hinge = [&](int body1, int body2, const Vector3d& axis) {
    const Matrix3d R = calcRotationOfZ(axis);
    return HingeNet::Hinge{
        body1, body2, {R * exp3(Vector3d(0, 0, draw(rng, -3, 3))), Vector3d(center + draw(rng, -0.3, 0.3) * axis)}};
  };
  return {4, {hinge(0, 1, axes[0]), hinge(1, 2, axes[1]), hinge(0, 3, axes[3]), hinge(2, 3, axes[2])}};
}

// Bennett's: opposite links are alike, a / sin(alpha) = b / sin(beta), no offsets, and
// tan(t1 / 2) tan(t2 / 2) = sin((alpha + beta) / 2) / sin((beta - alpha) / 2).
HingeNet makeBennettNet(std::mt19937& rng) {
  double alpha, beta;
  do alpha = draw(rng, 0.4, 2.7), beta = draw(rng, 0.4, 2.7);
  while (std::abs(alpha - beta) < 0.4 || std::abs(alpha + beta - 3.1416) < 0.4);
  const double a = draw(rng, 0.1, 0.4), b = a * std::sin(beta) / std::sin(alpha), t1 = draw(rng, 0.7, 2.4);
  const double t2 = 2 * std::atan2(std::sin((alpha + beta) / 2) / std::sin((beta - alpha) / 2), std::tan(t1 / 2));
  const auto link = [](double turn, double length, double twist) {
    return SE3(exp3(Vector3d(0, 0, turn)), Vector3d::Zero()) * SE3(exp3(Vector3d(twist, 0, 0)), Vector3d(length, 0, 0));
  };
  const SE3 X0(drawRotation(rng), Vector3d(draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3)));
  // Axis 1 on the ground, then along the links; the last link, back to axis 1, is the ground.
  const SE3 X1 = X0, X2 = X1 * link(t1, a, alpha), X3 = X2 * link(t2, b, beta), X4 = X3 * link(-t1, a, alpha);
  const auto hinge = [&](int body1, int body2, const SE3& X) {
    return HingeNet::Hinge{body1, body2,
                           X * SE3(exp3(Vector3d(0, 0, draw(rng, -3, 3))), Vector3d(0, 0, draw(rng, -0.1, 0.1)))};
  };
  return {4, {hinge(0, 1, X1), hinge(1, 2, X2), hinge(2, 3, X3), hinge(3, 0, X4)}};
}

// Bricard's of threefold symmetry: six links of one length, twisted by a right angle one way and the other, without offsets, and
// cos(t1) cos(t2) + cos(t1) + cos(t2) = 0 of its angles by turns.
HingeNet makeBricardNet(std::mt19937& rng) {
  const double length = draw(rng, 0.1, 0.4), t1 = draw(rng, 1.6, 2.05), c = std::cos(t1);
  const double t2 = std::acos(-c / (1 + c)), right = std::acos(0.0);
  const auto link = [&](double turn, double twist) {
    return SE3(exp3(Vector3d(0, 0, turn)), Vector3d::Zero()) * SE3(exp3(Vector3d(twist, 0, 0)), Vector3d(length, 0, 0));
  };
  const auto close = [&](double sign) {
    SE3 X;
    for (int i = 0; i < 3; ++i) X = X * link(t1, right) * link(sign * t2, -right);
    return X;
  };
  const double sign = close(1).p.norm() < 1e-9 * length ? 1 : -1;
  SE3 X(drawRotation(rng), Vector3d(draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3)));
  HingeNet net{6, {}};
  for (int i = 0; i < 6; ++i) {
    net.hinges.push_back({i, (i + 1) % 6, X});
    X = X * (i % 2 == 0 ? link(t1, right) : link(sign * t2, -right));
  }
  return net;
}

double roundTo(double value, std::optional<int> decimals) {
  const double unit = decimals ? std::pow(10, -*decimals) : 0;
  return decimals ? std::round(value / unit) * unit : value;
}

SE3 roundPlacement(const SE3& X, std::optional<int> decimals) {
  if (!decimals) return X;
  Vector3d rpy = calcRollPitchYaw(X.R);
  for (double& angle : rpy) angle = roundTo(angle, decimals);
  SE3 out(makeRotation(rpy), X.p);
  for (double& x : out.p) x = roundTo(x, decimals);
  return out;
}

}  // namespace

const char* getName(Family family) {
  constexpr const char* kNames[] = {"plane four-bar", "six-bar",        "spherical", "Bennett",
                                    "parallelogram",  "plane in space", "Bricard"};
  return kNames[static_cast<int>(family)];
}

HingeNet makeHingeNet(Family family, std::mt19937& rng) {
  if (family == Family::Spherical) return makeSphericalNet(rng);
  if (family == Family::Bennett) return makeBennettNet(rng);
  if (family == Family::Bricard) return makeBricardNet(rng);
  HingeNet net = makePlaneNet(rng, family == Family::Parallelogram, family == Family::SixBar);
  // In the plane x-z, or in any plane.
  const SE3 X = family == Family::PlaneInSpace
                    ? SE3(drawRotation(rng), Vector3d(draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3), draw(rng, -0.3, 0.3)))
                    : SE3(exp3(Vector3d(std::acos(0.0), 0, 0)), Vector3d(0, 0, 0.5));
  for (HingeNet::Hinge& hinge : net.hinges) hinge.X_W = X * hinge.X_W;
  return net;
}

Model makeModel(const HingeNet& net, std::optional<int> decimals, ClosureKind kind) {
  ModelBuilder builder("net");
  const auto name = [](int body) { return body == 0 ? std::string("world") : "link" + std::to_string(body); };
  std::vector<SE3> X_WB(net.bodies);
  std::vector<bool> is_carried(net.bodies, false);
  is_carried[0] = true;
  int count = 0;
  for (const HingeNet::Hinge& hinge : net.hinges) {
    const std::string number = std::to_string(++count);
    if (!is_carried[hinge.body2]) {
      is_carried[hinge.body2] = true;
      X_WB[hinge.body2] = hinge.X_W;
      Joint joint;
      joint.name = "hinge" + number;
      joint.kind = JointKind::Continuous;
      joint.X_PJ = roundPlacement(X_WB[hinge.body1].inverse() * hinge.X_W, decimals);
      builder.addLink(name(hinge.body2), name(hinge.body1), joint,
                      {1, Vector3d(0.1, 0, 0), 0.01 * Matrix3d::Identity()});
      continue;
    }
    const std::string ends[2] = {"end" + number + "a", "end" + number + "b"};
    int i = 0;
    for (int body : {hinge.body1, hinge.body2}) {
      const SE3 turned = hinge.X_W * SE3(exp3(Vector3d(0, 0, i)), Vector3d::Zero());
      builder.addFrame(ends[i++], name(body), roundPlacement(X_WB[body].inverse() * turned, decimals));
    }
    builder.addClosure("pin" + number, kind, ends[0], ends[1]);
  }
  builder.addMotor("hinge1");
  return builder.build();
}

}  // namespace bielle::testing
