#include "mechanisms.h"

#include <Eigen/SVD>
#include <cmath>
#include <ostream>

#include "bielle/dynamics/kinematics.h"
#include "math/so3.h"

namespace bielle::testing {

VectorXd randomVector(std::mt19937& rng, int n, double scale) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  return VectorXd::NullaryExpr(n, [&](Eigen::Index) { return uniform(rng); });
}

SE3 randomPlacement(std::mt19937& rng) { return {exp3(randomVector(rng, 3, 1.5)), randomVector(rng, 3, 0.4)}; }

Inertia randomInertia(std::mt19937& rng) {
  // A few random point masses make a possible body.
  Inertia sum;
  for (int i = 0; i < 5; ++i) {
    Inertia point;
    point.mass = 0.2 + std::abs(randomVector(rng, 1)[0]);
    point.com = randomVector(rng, 3, 0.3);
    sum = sum + point;
  }
  return sum;
}

namespace {

void addRandomLink(ModelBuilder& builder, std::mt19937& rng, const std::string& name, const std::string& parent,
                   JointKind kind) {
  Joint joint;
  joint.name = "joint_" + name;
  joint.kind = kind;
  joint.X_PJ = randomPlacement(rng);
  joint.axis = randomVector(rng, 3).normalized();
  joint.axis2 = joint.axis.cross(Vector3d(randomVector(rng, 3))).normalized() + 0.2 * joint.axis;
  builder.addLink(name, parent, joint, randomInertia(rng));
}

// Joints of both branches; those of the given kind among them if they have one coordinate.
std::vector<std::string> listCoupled(JointKind kind) {
  if (getNv(kind) == 1) return {"joint_a0", "joint_b1", "joint_a1k"};
  return {"joint_a0", "joint_b1"};
}

void tieTips(ModelBuilder& builder, std::mt19937& rng, ClosureKind closure, const Model& tree, const VectorXd& q,
             double kp, double kd) {
  Workspace ws(tree);
  updatePositions(tree, ws, q);
  const auto place = [&](const std::string& link) { return ws.X_WB[tree.frames()[tree.findFrame(link)].body]; };
  const SE3 X_B1 = randomPlacement(rng);
  const Vector3d axis = randomVector(rng, 3).normalized();
  SE3 X_12;
  if (closure == ClosureKind::Distance) {  // along what moves most: near its dead points nothing is regular
    X_12 = randomPlacement(rng);
    const SE3 X_W1 = place("a2k") * X_B1;
    Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, tree.nv());
    for (const auto& [link, sign] : {std::pair("a2k", 1.0), {"b2k", -1.0}})
      for (int k : tree.supportDofs(tree.frames()[tree.findFrame(link)].body))
        J.col(k) += sign * linear(X_W1.actInvMotion(ws.J.col(k)));
    const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeThinU);
    X_12.p = (0.5 + 0.2 * randomVector(rng, 1)[0]) * svd.matrixU().col(0);
  }
  if (closure == ClosureKind::Slider) X_12.p = randomVector(rng, 1, 0.3)[0] * axis;
  builder.addFrame("tip1", "a2k", X_B1);
  builder.addFrame("tip2", "b2k", place("b2k").inverseTimes(place("a2k") * X_B1 * X_12));
  if (closure == ClosureKind::Distance)
    builder.addDistance("loop", "tip1", "tip2", X_12.p.norm(), kp, kd);
  else
    builder.addClosure("loop", closure, "tip1", "tip2", axis, kp, kd);
}

}  // namespace

void addRandomCoupler(ModelBuilder& builder, std::mt19937& rng, const std::string& name,
                      const std::vector<std::string>& joints, const Model& tree, const VectorXd& q, double kp,
                      double kd, bool is_cam) {
  std::map<std::string, double> coefficients;
  std::map<std::string, std::vector<double>> higher;
  double offset = 0;
  for (const std::string& joint : joints) {
    const double c = randomVector(rng, 1)[0], coefficient = c < 0 ? c - 0.5 : c + 0.5;
    coefficients[joint] = coefficient;
    const double at = q[tree.joints()[tree.findJoint(joint)].idx_q];
    offset += coefficient * at;
    if (!is_cam || joint != joints.back()) continue;
    for (int k = 2; k <= 4; ++k) {
      higher[joint].push_back(randomVector(rng, 1, 0.4)[0]);
      offset += higher[joint].back() * std::pow(at, k);
    }
  }
  builder.addCoupler(name, coefficients, offset, kp, kd, higher);
}

namespace {

enum class Extra { None, Belt, RepeatedBelt, Cam, Forces };

// On joints in a loop and, with a free base, on one outside.
void addRandomForces(ModelBuilder& builder, std::mt19937& rng, JointKind kind) {
  for (const std::string& joint : listCoupled(kind)) {
    const VectorXd x = randomVector(rng, 6);
    JointForce force;
    force.stiffness = 20 + 10 * x[0];
    force.rest = x[1];
    force.preload = 5 * x[2];
    force.damping = 2 + x[3];
    force.friction = 3 + x[4];
    force.friction_speed = 0.3 + 0.1 * x[5];
    builder.addJointForce(joint, force);
  }
}

// Within the loop, from it to the ground and, with a free base, to the branch outside.
void addRandomPointSprings(ModelBuilder& builder, std::mt19937& rng, MechanismBase base) {
  const auto add = [&](const std::string& link1, const std::string& link2) {
    const VectorXd x = randomVector(rng, 4);
    PointSpring spring;
    spring.name = link1 + "--" + link2;
    spring.point1 = randomVector(rng, 3, 0.3);
    spring.point2 = randomVector(rng, 3, 0.3);
    spring.stiffness = 30 + 10 * x[0];
    spring.rest = 0.4 + 0.2 * x[1];
    spring.preload = 3 * x[2];
    spring.damping = 2 + x[3];
    builder.addPointSpring(link1, link2, spring);
  };
  add("a1", "b1k");
  add("a0k", "a2k");
  add("world", "b2");
  if (base == MechanismBase::FreeFlyer) add("side", "b0k");
}

Mechanism makeMechanism(std::mt19937& rng, JointKind kind, ClosureKind closure, MechanismBase base, double kp,
                        double kd, Extra extra) {
  ModelBuilder builder("random");
  std::string root = "root";
  if (base == MechanismBase::FreeFlyer) {
    addRandomLink(builder, rng, root, "world", JointKind::FreeFlyer);
    addRandomLink(builder, rng, "side", root, JointKind::Universal);
  } else {
    addRandomLink(builder, rng, root, "world", JointKind::Revolute);
  }
  const int per_branch = 3;
  for (const std::string side : {"a", "b"}) {
    std::string parent = root;
    for (int i = 0; i < per_branch; ++i) {
      const std::string name = side + std::to_string(i);
      addRandomLink(builder, rng, name, parent, JointKind::Revolute);
      addRandomLink(builder, rng, name + "k", name, kind);
      parent = name + "k";
    }
  }
  const Model tree = builder.build();
  Mechanism out{tree, tree.integrate(tree.makeNeutral(), randomVector(rng, tree.nv(), 0.8))};
  if (closure == ClosureKind::Coupler)
    addRandomCoupler(builder, rng, "loop", listCoupled(kind), tree, out.q_closed, kp, kd);
  else
    tieTips(builder, rng, closure, tree, out.q_closed, kp, kd);
  builder.addMotor("joint_a0", 0.1);
  builder.addMotor("joint_b0", 0.1);
  builder.addContact("foot", "a1", ContactKind::Surface6D, 0.1, 0.05);
  builder.addContact("point", "b1", ContactKind::Point3D, 0, 0);
  if (extra == Extra::Forces) {
    addRandomForces(builder, rng, kind);
    addRandomPointSprings(builder, rng, base);
  }
  if (extra == Extra::Belt || extra == Extra::RepeatedBelt || extra == Extra::Cam)
    addRandomCoupler(builder, rng, "belt", listCoupled(kind), tree, out.q_closed, kp, kd, extra == Extra::Cam);
  out.model = builder.build();
  if (extra != Extra::RepeatedBelt) return out;
  Closure twin = out.model.closures().back();
  twin.name = "twin";
  twin.offset *= 2;
  for (CouplerTerm& term : twin.terms) term.coefficient *= 2;
  builder.copyClosure(out.model, twin);
  out.model = builder.build();
  return out;
}

}  // namespace

Mechanism makeRandomMechanism(std::mt19937& rng, JointKind kind, ClosureKind closure, MechanismBase base, double kp,
                              double kd) {
  return makeMechanism(rng, kind, closure, base, kp, kd, Extra::None);
}

std::vector<MechanismKind> listMechanismKinds() {
  std::vector<MechanismKind> kinds;
  for (JointKind joint : kJointKinds)
    for (ClosureKind closure : kClosureKinds)
      for (MechanismBase base : {MechanismBase::Fixed, MechanismBase::FreeFlyer})
        kinds.push_back({joint, closure, base});
  return kinds;
}

std::ostream& operator<<(std::ostream& out, const MechanismKind& kind) {
  return out << getName(kind.joint) << ", " << getName(kind.closure)
             << (kind.base == MechanismBase::Fixed ? ", on the ground" : ", free");
}

Mechanism makeBeltedMechanism(std::mt19937& rng, JointKind kind, ClosureKind closure, MechanismBase base, bool repeated,
                              double kp, double kd) {
  return makeMechanism(rng, kind, closure, base, kp, kd, repeated ? Extra::RepeatedBelt : Extra::Belt);
}

Mechanism makeCammedMechanism(std::mt19937& rng, JointKind kind, ClosureKind closure, MechanismBase base, double kp,
                              double kd) {
  return makeMechanism(rng, kind, closure, base, kp, kd, Extra::Cam);
}

Mechanism makeSprungMechanism(std::mt19937& rng, JointKind kind, ClosureKind closure, MechanismBase base) {
  return makeMechanism(rng, kind, closure, base, 0, 0, Extra::Forces);
}

Mechanism makePlanarFourBar(double ground, double crank, double coupler, double rocker, double angle) {
  ModelBuilder builder("fourbar");
  const auto rod = [](double length) {
    Inertia inertia;
    inertia.mass = length;
    inertia.com = {length / 2, 0, 0};
    const double i = inertia.mass * length * length / 12;
    inertia.I_com = Eigen::Vector3d(1e-4, i, i).asDiagonal();
    return inertia;
  };
  const auto hinge = [](const std::string& name, double x) {
    Joint joint;
    joint.name = name;
    joint.kind = JointKind::Revolute;
    joint.axis = Vector3d::UnitY();
    joint.X_PJ.p = {x, 0, 0};
    return joint;
  };
  builder.addLink("crank", "world", hinge("j_crank", 0), rod(crank));
  builder.addLink("coupler", "crank", hinge("j_coupler", crank), rod(coupler));
  builder.addLink("rocker", "coupler", hinge("j_rocker", coupler), rod(rocker));
  builder.addLink("pin", "rocker", hinge("j_pin", rocker), {});
  builder.addFrame("anchor", "world", {Matrix3d::Identity(), {ground, 0, 0}});
  builder.addClosure("loop", ClosureKind::Weld6D, "pin", "anchor");
  builder.addMotor("j_crank");
  builder.setArmature("j_pin", 1e-4);
  Mechanism out{builder.build(), {}};
  // Angles about y turn x towards -z; solve the triangle crank tip - anchor with the law of cosines.
  const Eigen::Vector2d tip = crank * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d d = Eigen::Vector2d(ground, 0) - tip;
  const double distance = d.norm(), heading = std::atan2(d.y(), d.x());
  const double inner =
      std::acos((coupler * coupler + distance * distance - rocker * rocker) / (2 * coupler * distance));
  const double coupler_angle = heading + inner;
  const Eigen::Vector2d joint = tip + coupler * Eigen::Vector2d(std::cos(coupler_angle), std::sin(coupler_angle));
  const double rocker_angle = std::atan2(-joint.y(), ground - joint.x());
  out.q_closed.resize(4);
  out.q_closed << -angle, -(coupler_angle - angle), -(rocker_angle - coupler_angle), rocker_angle;
  return out;
}

namespace {

MatrixXd differentiateAlong(int n, double h, const std::function<VectorXd(int, double)>& f) {
  MatrixXd out;
  for (int k = 0; k < n; ++k) {
    const VectorXd d1 = (f(k, h) - f(k, -h)) / (2 * h), d2 = (f(k, 2 * h) - f(k, -2 * h)) / (4 * h);
    if (k == 0) out.resize(d1.size(), n);
    out.col(k) = (4 * d1 - d2) / 3;
  }
  return out;
}

}  // namespace

MatrixXd differentiateTangent(const Model& model, const VectorXd& q, double h,
                              const std::function<VectorXd(const VectorXd&)>& f) {
  return differentiateAlong(
      model.nv(), h, [&](int k, double step) { return f(model.integrate(q, step * VectorXd::Unit(model.nv(), k))); });
}

MatrixXd differentiate(const VectorXd& x, double h, const std::function<VectorXd(const VectorXd&)>& f) {
  return differentiateAlong(static_cast<int>(x.size()), h,
                            [&](int k, double step) { return f(x + step * VectorXd::Unit(x.size(), k)); });
}

double calcRelativeError(const MatrixXd& a, const MatrixXd& b) {
  if (a.size() == 0) return 0;
  return (a - b).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() / std::max(b.cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace bielle::testing
