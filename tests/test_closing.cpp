// Closing with held joints, and motors for joints and back. Oracles: closed forms of a four-bar and of an ankle on two rods (RSU).
#include <catch2/catch.hpp>
#include <cmath>
#include <ctime>
#include <iostream>
#include <random>
#include <sstream>

#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "count_allocations.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "own_robots.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kGround = 0.4, kCrank = 0.15, kCoupler = 0.35, kRocker = 0.3;
constexpr const char *kCrankJoint = "crank_joint", *kRockerJoint = "rocker_joint";

int getEntry(const Model& model, const std::string& joint) {
  return model.joints()[static_cast<size_t>(model.findJoint(joint))].idx_q;
}

double calcGap(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  return calcLargestGap(ws, makeConstraintSet(model));
}

// The left ankle of rsu_biped (robots/parts/ankle/rsu.yaml): cranks of length c at (0, +-w, h) over the ankle, whose ends rods
// tie to the heels of the foot.
struct RsuAnkle {
  static constexpr double kArm = 0.05, kLength = 0.05, kWidth = 0.06, kHeight = 0.17, kAngle = 0.6;

  // |m + R_y(theta) c u - heel| = h:  A cos theta + B sin theta = C, on the branch of theta = 0. NaN out of reach.
  static double calcMotor(double pitch, double roll, int number) {
    const double w = number == 1 ? kWidth : -kWidth;
    const Vector3d aside(-std::cos(kAngle), 0, std::sin(kAngle)), y = Vector3d::UnitY();
    const Matrix3d R = makeAxisRotation(y, pitch) * makeAxisRotation(Vector3d::UnitX(), roll);
    const Vector3d p = R * (kArm * aside + w * y) - Vector3d(0, w, kHeight);
    const double A = p.dot(aside), B = p.dot(y.cross(aside)),
                 C = (p.squaredNorm() + kLength * kLength - kHeight * kHeight) / (2 * kLength);
    const double angle = std::acos(C / std::hypot(A, B)), start = std::atan2(B, A);
    const double one = std::remainder(start + angle, 2 * M_PI), other = std::remainder(start - angle, 2 * M_PI);
    return std::abs(one - pitch) < std::abs(other - pitch) ? one : other;
  }
};

}  // namespace

TEST_CASE("closing: a four-bar with its crank held, and with its rocker held, against the closed form") {
  const Mechanism start = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, 1);
  const Model& model = start.model;
  const std::string crank = model.joints()[1].name;
  // Far from the start, at once.
  for (const double angle : {0.7, 1.3, 2.0, -0.5}) {
    VectorXd q = start.q_closed;
    q[0] = -angle;
    const AssemblyResult result = closeConfiguration(model, q, {crank});
    CAPTURE(angle, result.message);
    REQUIRE(result.status == NumericalStatus::Ok);
    CHECK(result.q[0] == -angle);
    CHECK(calcGap(model, result.q) < 1e-10);
    const VectorXd exact = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, angle).q_closed;
    for (int k = 0; k < 4; ++k) CHECK(std::abs(std::remainder(result.q[k] - exact[k], 2 * M_PI)) < 1e-9);
  }
  // Without holding, the crank moves.
  VectorXd q = start.q_closed;
  q[0] -= 0.5;
  CHECK(std::abs(closeConfiguration(model, q).q[0] - q[0]) > 0.05);
  CHECK(closeConfiguration(model, q, std::vector<std::string>()).q == closeConfiguration(model, q).q);
  CHECK_THROWS_WITH(closeConfiguration(model, q, {"elbow"}),
                    Catch::Contains("joint 'elbow'") && Catch::Contains("choose some of: " + crank));
}

TEST_CASE("closing: two joints that cannot be held together are both at the nearest values, which then can be") {
  const Mechanism start = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, 1);
  const Model& model = start.model;
  const std::string crank = model.joints()[1].name;
  for (int other = 1; other < 3; ++other) {
    const std::string name = model.joints()[static_cast<size_t>(other) + 1].name;
    for (const double off : {0.3, -0.2, 1e-6}) {
      CAPTURE(name, off);
      VectorXd q = start.q_closed;
      q[other] += off;
      const AssemblyResult result = closeConfiguration(model, q, {crank, name});
      CHECK(result.status == NumericalStatus::NotClosed);
      CHECK(calcGap(model, result.q) < 1e-10);
      // Of all angles of the crank, that which leaves the least sum of squares.
      const auto calcSum = [&](double angle) {
        const VectorXd exact = makePlanarFourBar(kGround, kCrank, kCoupler, kRocker, angle).q_closed;
        return std::pow(std::remainder(exact[0] - q[0], 2 * M_PI), 2) +
               std::pow(std::remainder(exact[other] - q[other], 2 * M_PI), 2);
      };
      double low = 0.5, high = 1.5;
      while (high - low > 1e-9) {
        const double a = low + (high - low) / 3, b = high - (high - low) / 3;
        (calcSum(a) < calcSum(b) ? high : low) = calcSum(a) < calcSum(b) ? b : a;
      }
      CHECK(std::remainder(result.q[0] + low, 2 * M_PI) == Approx(0).margin(1e-5 * std::abs(off) + 1e-7));
      CHECK_THAT(result.message, Catch::Contains("joints " + crank + ", " + name + " cannot be held at ") &&
                                     Catch::Contains(" together: the nearest values in reach are ") &&
                                     Catch::Contains("; alone, " + crank + ", " + name + " can be held where asked"));
      q[0] = result.q[0], q[other] = result.q[other];
      CHECK(closeConfiguration(model, q, {crank, name}).status == NumericalStatus::Ok);
    }
  }
}

TEST_CASE("closing: a rocker beyond its dead point is refused with the gap and the nearest value, and nothing jumps") {
  const Model model = loadOwn("fourbar").model;
  const VectorXd start = assembleReference(model, model.references()[0].name).q;
  const int rocker = getEntry(model, kRockerJoint);
  // The rocker turns back where crank and coupler are in line, or folded: |AD|^2 + r^2 - 2 |AD| r cos(angle) = (b +- a)^2.
  const auto calcEnd = [](double reach) {
    return M_PI - std::acos((kGround * kGround + kRocker * kRocker - reach * reach) / (2 * kGround * kRocker));
  };
  const double ends[] = {calcEnd(kCoupler - kCrank), calcEnd(kCoupler + kCrank)};
  const double lower = std::min(ends[0], ends[1]), upper = std::max(ends[0], ends[1]);
  LinkageMap map(model, start);
  REQUIRE(map.joints() == std::vector<int>{model.findJoint(kRockerJoint)});
  VectorXd joint(1), motor(1), back(1);
  const double sign = start[rocker] > 0 ? 1 : -1;
  REQUIRE((std::abs(start[rocker]) > lower && std::abs(start[rocker]) < upper));
  for (const double beyond : {0.2, 0.01, 1e-4}) {
    for (const double end : {lower, upper}) {
      CAPTURE(beyond, end);
      const double asked = sign * (end == lower ? end - beyond : end + beyond);
      joint[0] = asked;
      const HeldResult result = map.calcMotors(joint, motor);
      CHECK(result.status == NumericalStatus::NotClosed);
      CHECK(result.gap == Approx(beyond).margin(1e-8));
      CHECK(result.joint == map.joints()[0]);
      CHECK(std::abs(map.q()[rocker]) == Approx(end).margin(1e-8));
      CHECK(calcGap(model, map.q()) < 1e-10);
      // The next one is on the same branch again.
      joint[0] = start[rocker];
      CHECK(map.calcMotors(joint, motor).status == NumericalStatus::Ok);
      CHECK(motor[0] == Approx(start[getEntry(model, kCrankJoint)]).margin(1e-9));
    }
  }
  // At the dead point itself it is reached, and said to be one: by the square of the angle's error.
  joint[0] = sign * upper;
  CHECK(map.calcMotors(joint, motor).status == NumericalStatus::NearDeadPoint);
  VectorXd q = start;
  q[rocker] = sign * (upper + 0.1);
  const AssemblyResult refused = closeConfiguration(model, q, {kRockerJoint});
  CHECK(refused.status == NumericalStatus::NotClosed);
  CHECK_THAT(refused.message,
             Catch::Contains("'rocker_joint' cannot be held at") && Catch::Contains("nearest value in reach"));
  CHECK(std::abs(refused.q[rocker]) == Approx(upper).margin(1e-8));
  joint[0] = std::nan("");
  CHECK(map.calcMotors(joint, motor).status == NumericalStatus::NotFinite);
}

namespace {

// The values in reach that a message tells, as they are told.
std::vector<double> readReach(const std::string& message) {
  const std::string one = "the nearest value in reach is ", several = "the nearest values in reach are ";
  const bool is_one = message.find(one) != std::string::npos;
  std::stringstream text(message.substr(message.find(is_one ? one : several) + (is_one ? one : several).size()));
  std::vector<double> values;
  for (double value; text >> value; text.ignore(1)) values.push_back(value);
  if (is_one) values.resize(1);  // its distance follows
  return values;
}

}  // namespace

TEST_CASE("closing: values in reach can be held as they are told, with few digits") {
  const Model fourbar = loadOwn("fourbar").model, biped = loadOwn("bipetto").model, ankles = loadOwn("rsu_biped").model;
  const auto follow = [](const Model& model, const std::string& reference, const std::vector<std::string>& held,
                         const std::vector<double>& asked) {
    VectorXd q = assembleReference(model, reference).q;
    for (size_t i = 0; i < held.size(); ++i) q[getEntry(model, held[i])] = asked[i];
    const AssemblyResult refused = closeConfiguration(model, q, held);
    CAPTURE(asked, refused.message);
    REQUIRE(refused.status == NumericalStatus::NotClosed);
    const std::vector<double> told = readReach(refused.message);
    REQUIRE(told.size() == held.size());
    for (size_t i = 0; i < held.size(); ++i) {
      CHECK(told[i] == Approx(refused.q[getEntry(model, held[i])]).margin(1e-3));
      q[getEntry(model, held[i])] = told[i];
    }
    CHECK(closeConfiguration(model, q, held).status != NumericalStatus::NotClosed);
  };
  for (const double angle : {1.5, 1.57, 2.7, 3.0})
    follow(fourbar, fourbar.references()[0].name, {kRockerJoint}, {angle});
  const std::vector<std::string> ankle = {"ankley_left", "anklex_left"};
  for (const std::vector<double>& angles : std::vector<std::vector<double>>{{0, 2}, {0.9, 0}, {1.5, 0}, {0, -0.8}})
    follow(biped, "half_sitting", ankle, angles);
  for (const std::vector<double>& angles : std::vector<std::vector<double>>{{0.1, 0.5}, {0, 2}, {0, -0.8}})
    follow(ankles, "half_sitting", ankle, angles);
}

TEST_CASE("closing: motors of an ankle on two rods for its joints and back, against the closed form") {
  const Model model = loadOwn("rsu_biped").model;
  const VectorXd start = assembleReference(model, "half_sitting").q;
  const std::vector<std::string> held = {"ankley_left", "anklex_left"};
  const int pitch = getEntry(model, held[0]), roll = getEntry(model, held[1]);
  const int motors[] = {getEntry(model, "motor_ankle1_left"), getEntry(model, "motor_ankle2_left")};
  LinkageMap map(model, start);
  REQUIRE(map.joints().size() == static_cast<size_t>(model.nu()));
  VectorXd joints(model.nu()), u(model.nu()), back(model.nu());
  for (int i = 0; i < model.nu(); ++i)
    joints[i] = start[model.joints()[static_cast<size_t>(map.joints()[static_cast<size_t>(i)])].idx_q];
  const auto set = [&](int entry, double value) {
    for (int i = 0; i < model.nu(); ++i)
      if (model.joints()[static_cast<size_t>(map.joints()[static_cast<size_t>(i)])].idx_q == entry) joints[i] = value;
  };
  for (const auto& [p, r] : {std::pair(-0.3, 0.1), {0.2, -0.2}, {0.0, 0.0}, {-0.5, 0.15}, {0.3, 0.25}}) {
    CAPTURE(p, r);
    set(pitch, p), set(roll, r);
    REQUIRE(map.calcMotors(joints, u).status == NumericalStatus::Ok);
    REQUIRE(map.q()[pitch] == Approx(p).margin(1e-10));
    for (int i = 0; i < 2; ++i) CHECK(map.q()[motors[i]] == Approx(RsuAnkle::calcMotor(p, r, i + 1)).margin(1e-9));
    for (int m = 0; m < model.nu(); ++m)
      CHECK(u[m] == map.q()[model.joints()[static_cast<size_t>(model.motors()[static_cast<size_t>(m)].joint)].idx_q]);
    REQUIRE(map.calcJoints(u, back).status == NumericalStatus::Ok);
    CHECK((back - joints).cwiseAbs().maxCoeff() < 1e-9);
    // From the standing posture, at once.
    VectorXd q = start;
    q[pitch] = p, q[roll] = r;
    const AssemblyResult closed = closeConfiguration(model, q, held);
    REQUIRE(closed.status == NumericalStatus::Ok);
    CHECK((closed.q[pitch] == p && closed.q[roll] == r));
    CHECK(calcGap(model, closed.q) < 1e-10);
    for (int i = 0; i < 2; ++i) CHECK(closed.q[motors[i]] == Approx(RsuAnkle::calcMotor(p, r, i + 1)).margin(1e-9));
    // The rest of the robot stays.
    for (int k = 0; k < 7; ++k) CHECK(closed.q[k] == Approx(start[k]).margin(1e-12));
    CHECK(closed.q[getEntry(model, "knee_left")] == Approx(start[getEntry(model, "knee_left")]).margin(1e-12));
  }
  // Only one of them held: the other one moves least.
  VectorXd q = start;
  q[pitch] -= 0.1;
  LoopCloser closer(model, start, {held[0]});
  REQUIRE(closer.close(q).status == NumericalStatus::Ok);
  CHECK(q[pitch] == start[pitch] - 0.1);
  CHECK(std::abs(q[roll] - start[roll]) < 1e-4);
  CHECK(q[motors[0]] == Approx(RsuAnkle::calcMotor(q[pitch], q[roll], 1)).margin(1e-9));
  // Beyond reach: the gap is told, and the value is one that the closed form knows.
  set(pitch, 0), set(roll, 2.5);
  const HeldResult beyond = map.calcMotors(joints, u);
  CHECK(beyond.status == NumericalStatus::NotClosed);
  CHECK(beyond.gap == Approx(2.5 - map.q()[roll]));
  CHECK(beyond.joint == model.findJoint(held[1]));
  CHECK(calcGap(model, map.q()) < 1e-10);
  CHECK_FALSE(map.reset(model.integrate(start, 0.1 * VectorXd::Ones(model.nv()))));
  CHECK(map.reset(start));
}

TEST_CASE("closing: joints of several coordinates are held in random linkages") {
  int met = 0;
  for (const JointKind kind : {JointKind::Universal, JointKind::Spherical, JointKind::Planar, JointKind::FreeFlyer})
    for (unsigned seed = 0; seed < 12; ++seed) {
      std::mt19937 rng(seed);
      const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::Fixed);
      const Model& model = mechanism.model;
      const AssemblyResult start = closeConfiguration(model, mechanism.q_closed);
      REQUIRE(start.status == NumericalStatus::Ok);
      for (const Joint& joint : model.joints()) {
        if (joint.kind != kind || joint.nv == 0) continue;
        CAPTURE(getName(kind), seed, joint.name);
        // Where another closed configuration has it: in reach, with all that the other joints do.
        const AssemblyResult there =
            closeConfiguration(model, model.integrate(start.q, randomVector(rng, model.nv(), 0.05)));
        if (there.status != NumericalStatus::Ok) continue;
        VectorXd asked = start.q;
        asked.segment(joint.idx_q, joint.nq) = there.q.segment(joint.idx_q, joint.nq);
        const AssemblyResult held = closeConfiguration(model, asked, {joint.name});
        if (held.status == NumericalStatus::NotClosed) continue;  // on another branch
        ++met;
        CHECK(calcGap(model, held.q) < 1e-9);
        CHECK(held.q.segment(joint.idx_q, joint.nq) == asked.segment(joint.idx_q, joint.nq));
        LoopCloser closer(model, start.q, {joint.name});
        VectorXd q = asked;
        const HeldResult result = closer.close(q);
        if (result.status == NumericalStatus::NotClosed) continue;
        CHECK(calcGap(model, q) < 1e-9);
        CHECK(q.segment(joint.idx_q, joint.nq) == asked.segment(joint.idx_q, joint.nq));
      }
    }
  CHECK(met > 40);
}

namespace {

// A body on a ball, tied to the ground by a rod from its arm: the rod lets it turn in a cone.
Model makeTethered() {
  ModelBuilder builder("tethered");
  Joint ball;
  ball.name = "ball";
  ball.kind = JointKind::Spherical;
  std::mt19937 rng(1);
  builder.addLink("body", "world", ball, randomInertia(rng));
  builder.addFrame("arm", "body", {Matrix3d::Identity(), {0.3, 0, 0}});
  builder.addFrame("anchor", "world", {Matrix3d::Identity(), {0.3, 0, 0.5}});
  builder.addDistance("rod", "arm", "anchor", 0.5);
  return builder.build();
}

}  // namespace

TEST_CASE("closing: a ball that cannot be held is at the nearest rotation, which then can be as it is told") {
  const Model model = makeTethered();
  VectorXd q(4);
  q << 0, 0, 0, 1;
  REQUIRE(calcGap(model, q) < 1e-12);
  const Eigen::Quaterniond asked(makeAxisRotation(Vector3d(0.2, 1, 0.1).normalized(), 0.4));
  q = asked.coeffs();
  const AssemblyResult refused = closeConfiguration(model, q, {"ball"});
  REQUIRE(refused.status == NumericalStatus::NotClosed);
  CHECK(calcGap(model, refused.q) < 1e-9);
  CHECK_THAT(refused.message,
             Catch::Contains("joint 'ball' cannot be held at (") && Catch::Contains("the nearest value in reach is ("));
  // Nearest: no rotation beside it, along the cone, is nearer.
  const auto calcAngle = [&](const VectorXd& at) {
    return asked.angularDistance(Eigen::Quaterniond(Eigen::Vector4d(at.normalized())));
  };
  std::mt19937 rng(3);
  for (int i = 0; i < 20; ++i) {
    const AssemblyResult beside = closeConfiguration(model, model.integrate(refused.q, randomVector(rng, 3, 0.02)));
    REQUIRE(beside.status == NumericalStatus::Ok);
    CHECK(calcAngle(beside.q) > calcAngle(refused.q) - 1e-6);
  }
  const std::string told = refused.message.substr(refused.message.find("in reach is (") + 13);
  std::stringstream text(told);
  for (int k = 0; k < 4; ++k, text.ignore(1)) text >> q[k];
  const AssemblyResult held = closeConfiguration(model, q, {"ball"});
  CAPTURE(refused.message, held.message);
  CHECK(held.status != NumericalStatus::NotClosed);
}

TEST_CASE("closing: no allocation, and a linkage without joints is refused") {
  const Model model = loadOwn("rsu_biped").model;
  const VectorXd start = assembleReference(model, "half_sitting").q;
  LinkageMap map(model, start);
  LoopCloser closer(model, start, {"ankley_left", "anklex_left"});
  VectorXd joints(model.nu()), u(model.nu()), q = start;
  for (int i = 0; i < model.nu(); ++i)
    joints[i] = start[model.joints()[static_cast<size_t>(map.joints()[static_cast<size_t>(i)])].idx_q];
  const long before = num_allocations;
  for (int i = 0; i < 20; ++i) {
    joints.array() += 0.005;
    q[getEntry(model, "ankley_left")] -= i == 19 ? 3 : 0.005;  // at last beyond reach
    map.calcMotors(joints, u);
    map.calcJoints(u, joints);
    closer.close(q);
  }
  CHECK(num_allocations - before <= 20);  // names for getEntry()
  // What they move is a body: the remedy is followed.
  for (const char* robot : {"delta", "cleobot"}) {
    const Model parallel = loadOwn(robot).model;
    const VectorXd closed = findClosedConfiguration(parallel).q;
    CHECK_THROWS_WITH(LinkageMap(parallel, closed),
                      Catch::Contains("0 serial joint(s)") && Catch::Contains("may be a body") &&
                          Catch::Contains("serial_joints") && Catch::Contains("LoopCloser"));
    std::vector<std::string> motors;
    for (const Motor& motor : parallel.motors()) motors.push_back(motor.name);
    LoopCloser held(parallel, closed, motors);
    VectorXd moved = closed;
    for (const Motor& motor : parallel.motors())
      moved[parallel.joints()[static_cast<size_t>(motor.joint)].idx_q] += 0.01;
    CHECK(held.close(moved).status != NumericalStatus::NotClosed);
    CHECK(calcGap(parallel, moved) < 1e-9);
  }
}

TEST_CASE("closing: time of a call", "[.time]") {
  const Model model = loadOwn("rsu_biped").model;
  const VectorXd start = assembleReference(model, "half_sitting").q;
  LoopCloser closer(model, start, {"ankley_left", "anklex_left"});
  const int pitch = getEntry(model, "ankley_left"), roll = getEntry(model, "anklex_left");
  for (const double step : {1e-3, 1e-2, 1e-1}) {
    VectorXd q = start;
    const int calls = 20000;
    const std::clock_t begin = std::clock();
    for (int i = 0; i < calls; ++i) {
      q[pitch] = start[pitch] + (i % 2 ? step : 0);
      q[roll] = start[roll] - (i % 2 ? step : 0);
      REQUIRE(closer.close(q).status == NumericalStatus::Ok);
    }
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    std::cout << "closing an ankle on two rods, " << step << " rad a call: " << 1e6 * seconds / calls << " us\n";
  }
}
