// Transmissions and dead points of linkages that can be described in two ways, or that have motions which move nothing: both
// descriptions answer the same.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/builder.h"
#include "dynamics/idle_spins.h"
#include "dynamics/linkage_ratio.h"
#include "dynamics/linkage_workspace.h"
#include "leg_biped.h"
#include "own_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Joint makeJoint(const std::string& name, JointKind kind, const Vector3d& axis, const Vector3d& place) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.axis = axis;
  joint.axis2 = Vector3d::UnitX();
  joint.X_PJ.p = place;
  return joint;
}

Inertia makeBody() {
  Inertia inertia;
  inertia.mass = 0.2;
  inertia.I_com = 1e-3 * Matrix3d::Identity();
  return inertia;
}

SE3 at(const Vector3d& place) { return {Matrix3d::Identity(), place}; }

enum class Output { Joints, Bodies };

Model makeFourBar(Output output) {
  ModelBuilder b("four");
  const Vector3d axis = -Vector3d::UnitY();
  b.addLink("rocker", "world", makeJoint("rocker", JointKind::Continuous, axis, {0.4, 0, 0}), makeBody());
  b.addLink("crank", "world", makeJoint("crank", JointKind::Continuous, axis, {0, 0, 0}), makeBody());
  b.addLink("coupler", "crank", makeJoint("coupler", JointKind::Continuous, axis, {0.15, 0, 0}), makeBody());
  b.addFrame("coupler_end", "coupler", at({0.35, 0, 0}));
  b.addFrame("rocker_end", "rocker", at({0.3, 0, 0}));
  b.addClosure("pin", ClosureKind::Hinge5D, "coupler_end", "rocker_end", Vector3d::UnitY());
  b.addMotor("crank", 0.001);
  if (output == Output::Joints) b.addSerialJoint("rocker");
  return b.build();
}

// A basis of the closed motions of one cluster, as given.
struct GivenBases : LoopBases {
  explicit GivenBases(const ReducedCluster& c) : cluster(c), basis(c) {}
  const ReducedCluster& cluster;
  ClusterBasis basis;
  const ReducedCluster& getCluster(int) const override { return cluster; }
  const ClusterBasis& getBasis(int) const override { return basis; }
};

// An ankle of two motors on the shank, cranks and rods to the foot. Rods are carried by universal joints, or by balls: then each
// can also spin about its own line.
// \param hinges  whether a ball is a universal joint with a hinge across
Model makeAnkle(JointKind rods, Output output, bool hinges = false) {
  ModelBuilder b("ankle");
  const Vector3d y = Vector3d::UnitY(), x = Vector3d::UnitX();
  for (const int i : {1, 2}) {
    const double side = i == 1 ? 0.04 : -0.04, length = i == 1 ? 0.2 : 0.14;
    const std::string n = std::to_string(i);
    b.addLink("crank" + n, "world", makeJoint("motor" + n, JointKind::Revolute, y, {-0.01, side, length - 0.3 + 0.02}),
              makeBody());
    const Vector3d end(-0.045, 0.1 * side, 0);
    if (hinges) {
      b.addLink("yoke" + n, "crank" + n, makeJoint("yoke" + n, JointKind::Universal, y, end), {});
      b.addLink("rod" + n, "yoke" + n, makeJoint("turn" + n, JointKind::Continuous, Vector3d::UnitZ(), {0, 0, 0}),
                makeBody());
    } else {
      b.addLink("rod" + n, "crank" + n, makeJoint("rod" + n, rods, y, end), makeBody());
    }
    b.addFrame("end" + n, "rod" + n, at({-0.002, -0.07 * side, -length}));
    b.addMotor("motor" + n, 0.004);
  }
  b.addLink("cross", "world", makeJoint("pitch", JointKind::Revolute, y, {0, 0, -0.3}), makeBody());
  b.addLink("foot", "cross", makeJoint("roll", JointKind::Revolute, x, {0, 0, -0.01}), makeBody());
  b.addFrame("heel1", "foot", at({-0.057, 0.042, 0.03}));
  b.addFrame("heel2", "foot", at({-0.057, -0.042, 0.03}));
  b.addFrame("sole", "foot", at({0.03, 0, -0.05}));
  b.addContact("sole", "sole", ContactKind::Surface6D, 0.1, 0.04);
  for (const std::string n : {"1", "2"}) b.addClosure("rod" + n, ClosureKind::Ball3D, "end" + n, "heel" + n);
  if (output == Output::Joints)
    for (const char* joint : {"pitch", "roll"}) b.addSerialJoint(joint);
  return b.build();
}

Vector3d onCircle(double radius, double degrees, double z) {
  return {radius * std::cos(degrees * M_PI / 180), radius * std::sin(degrees * M_PI / 180), z};
}

// A leg of the kind at its lower end, whose motor moves its length, to a ball on the platform.
void addLeg(ModelBuilder& b, const std::string& name, JointKind kind, const Vector3d& from, const Vector3d& platform,
            const Vector3d& to) {
  const Vector3d along = to - from;
  const Matrix3d R = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), along).toRotationMatrix();
  Joint end = makeJoint(name + "_end", kind, Vector3d::UnitY(), from);
  end.X_PJ.R = R;
  b.addLink(name + "_cylinder", "world", end, makeBody());
  b.addLink(name + "_piston", name + "_cylinder",
            makeJoint(name, JointKind::Prismatic, Vector3d::UnitZ(), {0, 0, 0.4 * along.norm()}), makeBody());
  b.addFrame(name + "_top", name + "_piston", at({0, 0, 0.6 * along.norm()}));
  b.addFrame(name + "_place", "platform", at(to - platform));
  b.addClosure(name + "_ball", ClosureKind::Ball3D, name + "_top", name + "_place");
  b.addMotor(name, 0.01);
}

// A platform on six legs. \param carries  whether it has a sole
Model makeHexapod(JointKind ends, bool carries = true) {
  ModelBuilder b("hexapod");
  const Vector3d place(0.02, 0.01, 0.5);
  b.addLink("platform", "world", makeJoint("platform", JointKind::FreeFlyer, Vector3d::UnitZ(), place), makeBody());
  b.addFrame("tool", "platform", at({0, 0, 0.1}));
  if (carries) b.addContact("sole", "tool", ContactKind::Surface6D, 0.1, 0.1);
  for (int i = 0; i < 6; ++i) {
    const double middle = 120.0 * (i / 2), side = i % 2 ? 1 : -1;
    addLeg(b, "leg" + std::to_string(i), ends, onCircle(0.4, middle + 12 * side, 0), place,
           onCircle(0.25, middle + 48 * side, 0.5));
  }
  return b.build();
}

// A delta: three arms, each with two rods to the tool. \param carries  whether that has a sole
Model makeDelta(JointKind ends, bool carries = true) {
  ModelBuilder b("delta");
  const Vector3d place(0.01, -0.02, -0.4);
  b.addLink("tool", "world", makeJoint("tool", JointKind::FreeFlyer, Vector3d::UnitZ(), place), makeBody());
  b.addFrame("tip", "tool", at({0, 0, -0.1}));
  if (carries) b.addContact("sole", "tip", ContactKind::Surface6D, 0.1, 0.1);
  for (int i = 0; i < 3; ++i) {
    const Vector3d x = onCircle(1, 120 * i, 0), y = Vector3d::UnitZ().cross(x);
    const std::string arm = "arm" + std::to_string(i);
    b.addLink(arm, "world", makeJoint(arm, JointKind::Revolute, y, 0.2 * x), makeBody());
    b.addMotor(arm, 0.01);
    for (const double side : {-1, 1}) {
      const std::string rod = "rod" + std::to_string(i) + (side < 0 ? "l" : "r");
      const Vector3d elbow = 0.45 * x + 0.03 * side * y, wrist = place + 0.06 * x + 0.03 * side * y;
      Joint end = makeJoint(rod, ends, y, elbow - 0.2 * x);
      end.axis2 = x;
      b.addLink(rod, arm, end, makeBody());
      b.addFrame(rod + "_end", rod, at(wrist - elbow));
      b.addFrame(rod + "_place", "tool", at(wrist - place));
      b.addClosure(rod, ClosureKind::Ball3D, rod + "_end", rod + "_place");
    }
  }
  return b.build();
}

// Closed with these angles of the ankle.
VectorXd closeAnkle(const Model& model, double pitch, double roll) {
  AssemblyProblem problem;
  problem.q_ref = model.makeNeutral();
  problem.weights = VectorXd::Constant(model.nv(), 1e-4);
  for (const auto& [name, angle] : {std::pair("pitch", pitch), std::pair("roll", roll)}) {
    const Joint& joint = model.joints()[model.findJoint(name)];
    problem.q_ref[joint.idx_q] = angle;
    problem.weights[joint.idx_v] = 1;
  }
  AssemblyResult result;
  for (int i = 0; i < 3; ++i) {  // the weights pull to these angles, but not to the last digit
    result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    problem.q_ref = result.q;
    problem.q_ref[model.joints()[model.findJoint("pitch")].idx_q] = pitch;
    problem.q_ref[model.joints()[model.findJoint("roll")].idx_q] = roll;
  }
  return result.q;
}

}  // namespace

TEST_CASE("linkages: no dead point is passed by on the way to it") {
  const Model& model = getBipetto();
  VectorXd q = findClosedConfiguration(model).q;
  const Linkage knee = makeLinkage(model, q, {"knee_left"});
  LoopCloser closer(model, q, {"knee_left"});
  const int angle = model.joints()[model.findJoint("knee_left")].idx_q;
  double last = kFarthestDeadPoint;
  int found = 0;
  for (int side : {1, -1}) {
    VectorXd p = q;
    last = kFarthestDeadPoint;
    for (int i = 0; i < 800 && last > 0.01; ++i) {
      p[angle] += 0.003 * side;
      if (closer.close(p).status != NumericalStatus::Ok) break;
      const double distance = std::min(findDeadPoint(knee, model, p).distance, kFarthestDeadPoint);
      CAPTURE(side, i, distance, last);
      if (last < kFarthestDeadPoint) REQUIRE(distance < last + 0.01);
      found += distance < 0.1;
      last = distance;
    }
  }
  CHECK(found > 3);
}

TEST_CASE("transmission: joints and bodies agree next to a dead point of the motor, and are infinite at it") {
  const std::vector<double> rates = {1e-3, 1e-8, 1e-300, -1e-8};
  std::vector<double> found[2];
  for (const Output output : {Output::Joints, Output::Bodies}) {
    const Model model = makeFourBar(output);
    const VectorXd q = closeConfiguration(model, (VectorXd(3) << 1.6, 1.0, -0.5).finished()).q;
    const std::vector<Linkage> linkages = listLinkages(model, q);
    REQUIRE(linkages.size() == 1);
    const Linkage& linkage = linkages[0];
    CHECK(linkage.joints.empty() == (output == Output::Bodies));
    GivenBases bases(*linkage.cluster);
    bases.basis.q = q;
    bases.basis.N = MatrixXd::Constant(3, 1, 0.7);
    Workspace ws(model);
    updatePositions(model, ws, q);
    LinkageWorkspaces memory;
    const auto calc = [&](double motor) {
      bases.basis.N(linkage.motor_dofs[0], 0) = motor;
      return calcTransmission(linkage, memory, model, ws, &bases);
    };
    CHECK(calc(0) == kInfinite);
    CHECK(calc(-0.0) == kInfinite);
    CHECK(std::abs(calc(1e-300)) > 1e290);
    for (const double rate : rates) found[static_cast<int>(output)].push_back(calc(rate) * rate);
    CHECK(std::isfinite(found[static_cast<int>(output)].back()));
    bases.basis.N.setZero();
    CHECK(calc(0) == 0);  // nothing moves
  }
  for (int i = 0; i < 2; ++i)  // over the motor's rate both are constant
    for (const double value : found[i]) CHECK(value == Approx(found[i][0]).epsilon(1e-3));
}

TEST_CASE("rods on two balls: transmission, its derivative and dead points are those of rods that cannot spin") {
  for (const Output output : {Output::Joints, Output::Bodies}) {
    const Model fixed = makeAnkle(JointKind::Universal, output), spinning = makeAnkle(JointKind::Spherical, output);
    const VectorXd q0 = closeAnkle(fixed, 0, 0), q1 = closeAnkle(spinning, 0, 0);
    const std::vector<Linkage> a = listLinkages(fixed, q0), b = listLinkages(spinning, q1);
    REQUIRE(a.size() == 1);
    REQUIRE(b.size() == 1);
    CHECK(a[0].idle == 0);
    CHECK(b[0].idle == 2);
    CHECK(a[0].output == b[0].output);
    CHECK(listLinkagesLeftOut(spinning, q1).empty());
    LinkageWorkspaces memory;
    int near = 0;
    for (const double pitch : {-0.5, 0.0, 0.2, 0.35})
      for (const double roll : {0.0, 0.15}) {
        CAPTURE(static_cast<int>(output), pitch, roll);
        const VectorXd p = closeAnkle(fixed, pitch, roll);
        VectorXd q = closeAnkle(spinning, pitch, roll);
        VectorXd by_motors[2] = {VectorXd(2), VectorXd(2)};
        const double expected = calcTransmission(a[0], memory, fixed, p, by_motors[0]);
        CHECK(calcTransmission(b[0], memory, spinning, q, by_motors[1]) == Approx(expected).epsilon(1e-6));
        CHECK(calcTransmission(b[0], memory, spinning, q) == Approx(expected).epsilon(1e-6));
        CHECK((by_motors[1] - by_motors[0]).norm() < 1e-5 * (1 + by_motors[0].norm()));
        const DeadPoint one = findDeadPoint(a[0], fixed, p), other = findDeadPoint(b[0], spinning, q);
        CHECK(one.kind == other.kind);
        near += one.kind != DeadPointKind::None;
        if (output == Output::Joints && one.kind != DeadPointKind::None)
          CHECK(other.distance == Approx(one.distance).epsilon(1e-4));
      }
    CHECK(near > 0);
    // Through the basis that a problem has at hand, in which spins are mixed with all other motions.
    Reduction reduction = makeReduction(spinning, q1);
    GivenBases bases(reduction.clusters[0]);
    ClusterPoint point(reduction.clusters[0]);
    VectorXd own(reduction.clusters[0].model.nq());
    gatherConfiguration(spinning, reduction.clusters[0], q1, own);
    REQUIRE(point.update(reduction.clusters[0], own));
    bases.basis = point.basis();
    Workspace ws(spinning);
    updatePositions(spinning, ws, q1);
    CHECK(calcTransmission(b[0], memory, spinning, ws, &bases) == Approx(1).epsilon(1e-9));
    MatrixXd row[2] = {MatrixXd::Zero(1, spinning.nv()), MatrixXd::Zero(1, spinning.nv())};
    calcTransmissionJacobian(b[0], memory, spinning, ws, row[0], &bases);
    calcTransmissionJacobian(b[0], memory, spinning, ws, row[1], nullptr);
    const MatrixXd along = (row[0] - row[1]) * bases.basis.N;  // rows agree along closed motions
    CHECK(along.norm() < 1e-9);
    for (Eigen::Index j = 0; j < bases.basis.N.cols(); ++j) {
      const double h = 1e-4;
      const auto calcAt = [&](double step) {
        REQUIRE(point.close(reduction.clusters[0], bases.basis, step * bases.basis.N.col(j), VectorXd()));
        VectorXd q = q1;
        scatterConfiguration(spinning, reduction.clusters[0], point.basis().q, q);
        return calcTransmission(b[0], memory, spinning, q);
      };
      CHECK((row[0] * bases.basis.N)(0, j) == Approx((calcAt(h) - calcAt(-h)) / (2 * h)).margin(1e-5));
    }
  }
}

TEST_CASE("idle spins are those of bodies that turn about a line through two balls, and carry nothing") {
  const auto count = [](const Model& model) { return countIdleSpins(model, findClosedConfiguration(model).q); };
  CHECK(count(makeAnkle(JointKind::Universal, Output::Joints)) == 0);
  CHECK(count(makeAnkle(JointKind::Spherical, Output::Joints)) == 2);
  CHECK(count(makeAnkle(JointKind::Spherical, Output::Bodies)) == 2);
  CHECK(count(makeAnkle(JointKind::Spherical, Output::Joints, true)) == 2);
  CHECK(count(makeDelta(JointKind::Universal)) == 0);
  CHECK(count(makeDelta(JointKind::Spherical)) == 6);
  CHECK(count(makeHexapod(JointKind::Universal)) == 0);
  CHECK(count(makeHexapod(JointKind::Spherical)) == 6);
  CHECK(count(makeFourBar(Output::Joints)) == 0);
  ModelParts parts = takeParts(makeFourBar(Output::Bodies));  // it moves, though nothing drives it
  parts.motors.clear();
  CHECK(count(ModelBuilder::restore(std::move(parts))) == 0);

  // A rod that carries something, or whose turning is driven or named.
  const Model ankle = makeAnkle(JointKind::Spherical, Output::Joints),
              hinges = makeAnkle(JointKind::Spherical, Output::Joints, true);
  const auto add = [](const Model& model, const std::function<void(ModelParts&)>& change) {
    ModelParts changed = takeParts(model);
    change(changed);
    return ModelBuilder::restore(std::move(changed));
  };
  CHECK(count(add(ankle, [&](ModelParts& all) {
          all.contacts.push_back(all.contacts[0]);
          all.contacts.back().name = "rod";
          all.contacts.back().body = ankle.findJoint("rod1");
        })) == 1);
  CHECK(count(add(hinges, [&](ModelParts& all) { all.serial_joints.push_back(hinges.findJoint("turn2")); })) == 1);
  CHECK(count(add(hinges, [&](ModelParts& all) {
          all.motors.push_back(all.motors[0]);
          all.motors.back().name = "turn2";
          all.motors.back().joint = hinges.findJoint("turn2");
          all.motors.back().dof = hinges.joints()[hinges.findJoint("turn2")].idx_v;
        })) == 1);
  const VectorXd q = closeAnkle(hinges, 0, 0);
  CHECK(makeLinkage(hinges, q, {"pitch", "roll"}).size() == 2);
  CHECK_THROWS_WITH(makeLinkage(hinges, q, {"turn1", "roll"}),
                    Catch::Contains("its linkage has mobility 3 and 2 motors (motor1, motor2)"));
}

TEST_CASE("ratios of rods on balls, their derivatives and dead points are those of rods that cannot spin") {
  const Model fixed = makeAnkle(JointKind::Universal, Output::Joints);
  for (const bool hinges : {false, true}) {
    // A heavy end on one side of the rod: it does not spin evenly, but the ratio is a matter of lengths.
    ModelParts parts = takeParts(makeAnkle(JointKind::Spherical, Output::Joints, hinges));
    for (Body& body : parts.bodies)
      if (body.name == "rod1") body.inertia.com = {0.03, 0.01, -0.1};
    const Model spinning = ModelBuilder::restore(std::move(parts));
    const std::vector<std::string> joints = {"pitch", "roll"};
    const auto prepare = [&](const Model& model, double pitch, double roll) {
      VectorXd q = closeAnkle(model, pitch, roll);
      LoopCloser closer(model, q, joints);
      q[model.joints()[model.findJoint("pitch")].idx_q] = pitch;
      q[model.joints()[model.findJoint("roll")].idx_q] = roll;
      REQUIRE(closer.close(q).status == NumericalStatus::Ok);
      return q;
    };
    const auto calcRatio = [&](const Model& model, const VectorXd& q) {
      const Linkage linkage = makeLinkage(model, q, joints);
      ClusterPoint point(*linkage.cluster);
      VectorXd own(linkage.cluster->model.nq());
      gatherConfiguration(model, *linkage.cluster, q, own);
      LinkageRatio ratio;
      REQUIRE(point.update(*linkage.cluster, own));
      REQUIRE(calcLinkageRatio(linkage, point, ratio));
      return ratio;
    };
    for (const double pitch : {-0.4, 0.0, 0.3})
      for (const double roll : {0.0, 0.15}) {
        CAPTURE(hinges, pitch, roll);
        const VectorXd p = prepare(fixed, pitch, roll);
        VectorXd q = prepare(spinning, pitch, roll);
        const LinkageRatio expected = calcRatio(fixed, p), found = calcRatio(spinning, q);
        CHECK((found.R - expected.R).norm() < 1e-10 * (1 + expected.R.norm()));
        for (int k = 0; k < 2; ++k) CHECK((found.dR[k] - expected.dR[k]).norm() < 1e-10 * (1 + expected.dR[k].norm()));
        CHECK(calcBalanceError(spinning, makeLinkage(spinning, q, joints), q, found.R) < 1e-9);
      }
    const VectorXd p = prepare(fixed, 0, 0), q = prepare(spinning, 0, 0);
    for (const int swept : {0, 1}) {
      const std::vector<RatioSample> expected = sweepRatio(fixed, makeLinkage(fixed, p, joints), p, swept).deadPoints(),
                                     found =
                                         sweepRatio(spinning, makeLinkage(spinning, q, joints), q, swept).deadPoints();
      REQUIRE(found.size() == expected.size());
      CHECK(!found.empty());
      for (size_t i = 0; i < found.size(); ++i) {
        CHECK(found[i].dead == expected[i].dead);
        CHECK((found[i].joints - expected[i].joints).norm() < 1e-10);
        CHECK((found[i].motors - expected[i].motors).norm() < 1e-10);
      }
    }
  }
}

TEST_CASE("deltas and hexapods on balls have the transmission and dead points of those on universal joints") {
  for (const auto& make : {makeDelta, makeHexapod}) {
    const Model fixed = make(JointKind::Universal, true), spinning = make(JointKind::Spherical, true);
    const VectorXd p0 = fixed.makeNeutral(), q0 = spinning.makeNeutral();
    CAPTURE(fixed.name());
    const std::vector<Linkage> a = listLinkages(fixed, p0), b = listLinkages(spinning, q0);
    REQUIRE(a.size() == 1);
    REQUIRE(b.size() == 1);
    CHECK(b[0].output == a[0].output);
    CHECK(b[0].output == (fixed.name() == "delta" ? "tool" : "platform"));
    CHECK(listLinkagesLeftOut(spinning, q0).empty());
    const std::vector<Linkage> bare = listLinkages(make(JointKind::Spherical, false), q0);
    REQUIRE(bare.size() == 1);
    CHECK(bare[0].output == b[0].output);  // legs have frames too, but they spin
    const DeadPoint at_start[] = {findDeadPoint(a[0], fixed, p0), findDeadPoint(b[0], spinning, q0)};
    CHECK(at_start[1].kind == at_start[0].kind);
    if (at_start[0].kind != DeadPointKind::None)  // the steepest way there depends on the coordinates of legs a little
      CHECK(at_start[1].distance == Approx(at_start[0].distance).epsilon(0.01));
    // Motors to positions all of their own.
    std::vector<std::string> motors;
    for (const Motor& motor : fixed.motors()) motors.push_back(motor.name);
    const auto move = [&](const Model& model, VectorXd q, double by) {
      LoopCloser closer(model, q, motors);
      for (size_t i = 0; i < motors.size(); ++i)
        q[model.joints()[model.findJoint(motors[i])].idx_q] += by * (i % 2 ? 0.3 + 0.1 * static_cast<double>(i) : -0.7);
      REQUIRE(closer.close(q).status == NumericalStatus::Ok);
      return q;
    };
    for (const double by : {0.1, -0.15}) {
      const double scale = fixed.name() == "delta" ? 1 : 0.3;
      const double expected = calcTransmission(a[0], fixed, move(fixed, p0, scale * by));
      CHECK(expected != Approx(1).epsilon(1e-3));
      CHECK(calcTransmission(b[0], spinning, move(spinning, q0, scale * by)) == Approx(expected).epsilon(1e-9));
    }
  }
}

TEST_CASE("linkages without a transmission are listed with the reason") {
  Model model = makeAnkle(JointKind::Spherical, Output::Joints);
  ModelParts parts = takeParts(model);
  parts.motors.pop_back();
  model = ModelBuilder::restore(std::move(parts));
  const VectorXd q = closeAnkle(model, 0, 0);
  CHECK(listLinkages(model, q).empty());
  const std::vector<LinkageLeftOut> left_out = listLinkagesLeftOut(model, q);
  REQUIRE(left_out.size() == 1);
  CHECK(left_out[0].name == "pitch, roll");
  CHECK(left_out[0].why == "1 motor for a mobility of 2");
  CHECK(left_out[0].has_motors);
}

TEST_CASE(
    "a sweep lists the motors' dead points where their volume vanishes, not where the held joint's motion reverses") {
  // Symmetric: with the foot level both rods are in line with their cranks at once.
  const Model model = makeLegBiped({{"knee", "serial"},
                                    {"ankle", "rsu"},
                                    {"ankle_arm", 0.047},
                                    {"ankle_crank", 0.038},
                                    {"ankle_half_width", 0.05},
                                    {"ankle_motor_height", 0.15},
                                    {"ankle_arm_angle", 0.4}});
  const VectorXd q = findClosedConfiguration(model).q;
  const Linkage linkage = makeLinkage(model, q, {"ankley_left"});
  const std::vector<RatioSample> dead = sweepRatio(model, linkage, q).deadPoints();
  int outputs = 0;
  for (const RatioSample& sample : dead) {
    ClusterPoint point(*linkage.cluster);
    REQUIRE(point.update(*linkage.cluster, sample.q));
    const MatrixXd N = point.basis().N;
    CAPTURE(sample.s, getName(sample.dead));
    const bool of_motors = std::abs(N(linkage.motor_dofs, Eigen::all).determinant()) < 1e-8;
    CHECK(of_motors == (sample.dead == DeadPointKind::Motors));
    outputs += sample.dead == DeadPointKind::Output;
  }
  CHECK(outputs == 2);
  CHECK(dead.size() == 2);
}
