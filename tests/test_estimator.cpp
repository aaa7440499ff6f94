// The estimator: with exact sensors it finds the state of robots that stand and move; linkages at dead points; bad readings.
#include <catch2/catch.hpp>

#include "bielle/control/estimator.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/formats/reader.h"
#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "change_model.h"
#include "control/foot_model.h"
#include "count_allocations.h"
#include "math/so3.h"
#include "own_robots.h"

namespace bielle {
namespace {

using bielle::testing::changeModel;
using bielle::testing::loadOwn;

constexpr double kReadingPeriod = 2e-3;  // s

SE3 getTrunk(const VectorXd& q) { return {Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix(), q.head<3>()}; }

// A robot whose joints swing at random, all loops closed by assembly.h. One on a free-flyer stands on its first contact.
class Swing {
 public:
  Swing(const Model& model, unsigned seed) : model_(model), ws_(model), start_(makeStandingPosture(model)) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (VectorXd* x : {&amplitude_, &frequency_})
      *x = VectorXd::NullaryExpr(model.nv(), [&](Eigen::Index) { return uniform(rng); });
    if (model.hasFreeFlyer()) foot_ = calcFoot(start_);
  }
  VectorXd calcConfiguration(double time) {
    VectorXd d(model_.nv());
    for (int i = 0; i < d.size(); ++i) d[i] = 0.04 * amplitude_[i] * (1 - std::cos((4 + frequency_[i]) * time));
    const AssemblyResult closed = closeConfiguration(model_, model_.integrate(start_, d));
    REQUIRE(closed.status == NumericalStatus::Ok);
    VectorXd q = closed.q;
    if (!model_.hasFreeFlyer()) return q;
    const SE3 X = foot_ * calcFoot(q).inverse() * getTrunk(q);
    q.head<3>() = X.p;
    q.segment<4>(3) = Eigen::Quaterniond(X.R).coeffs();
    return q;
  }
  VectorXd calcVelocity(double time) {
    constexpr double h = 1e-4;
    return model_.difference(calcConfiguration(time - h), calcConfiguration(time + h)) / (2 * h);
  }
  VectorXd calcTorques(const VectorXd& q) const {
    std::vector<ContactTarget> contacts;
    if (model_.hasFreeFlyer()) contacts.emplace_back();
    return calcStaticTorques(model_, makeConstraintSet(model_, contacts), q).u;
  }
  const VectorXd& start() const { return start_; }

 private:
  SE3 calcFoot(const VectorXd& q) {
    updatePlacements<double>(model_, ws_, q);
    const ContactFrame& contact = model_.contacts().front();
    return ws_.X_WB[contact.body] * contact.X_BF;
  }
  const Model& model_;
  Workspace ws_;
  const VectorXd start_;
  VectorXd amplitude_, frequency_;
  SE3 foot_;
};

// What exact sensors read between two instants.
SensorReadings read(const Model& model, Swing& swing, const SE3& imu, double time) {
  SensorReadings out;
  const VectorXd q = swing.calcConfiguration(time);
  out.time = time;
  out.motor_torques = swing.calcTorques(q);
  out.motor_positions.setZero(model.nu());
  for (int m = 0; m < model.nu(); ++m) out.motor_positions[m] = q[model.joints()[model.motors()[m].joint].idx_q];
  if (!model.hasFreeFlyer()) return out;
  const auto calcImuVelocity = [&](double t) {
    const SE3 X = getTrunk(swing.calcConfiguration(t)) * imu;
    return Vector3d(X.R * imu.actInvMotion(Vector6d(swing.calcVelocity(t).head<6>())).head<3>());
  };
  const Matrix3d R = (getTrunk(q) * imu).R, before = (getTrunk(swing.calcConfiguration(time - kReadingPeriod)) * imu).R;
  const Vector3d turn = log3(Matrix3d(before.transpose() * R));
  out.angular_velocity = turn / kReadingPeriod;
  out.specific_force =
      (before * exp3(Vector3d(0.5 * turn))).transpose() *
      ((calcImuVelocity(time) - calcImuVelocity(time - kReadingPeriod)) / kReadingPeriod - model.gravity());
  return out;
}

double getLargest(const VectorXd& x) { return x.cwiseAbs().maxCoeff(); }

}  // namespace

TEST_CASE("estimator: exact sensors give the state of a robot on one foot") {
  for (const char* name : {"bipetto", "cleobot", "rsu_biped", "belt_biped"}) {
    CAPTURE(name);
    const LoadedRobot robot = loadOwn(name);
    const Model& model = robot.model;
    Swing swing(model, 5);
    EstimatorOptions options;
    options.imu = {exp3(Vector3d(0.3, -0.2, 0.5)), {0.05, 0.02, 0.1}};
    Estimator estimator(model, swing.start(), options);
    estimator.reset(0, swing.start(), VectorXd::Zero(model.nv()), {0});
    for (int i = 1; i <= 150; ++i)
      REQUIRE(estimator.update(read(model, swing, options.imu, i * kReadingPeriod), {0}) == NumericalStatus::Ok);
    const double time = 150 * kReadingPeriod;
    const VectorXd q = swing.calcConfiguration(time), v = swing.calcVelocity(time);
    const Measurement& found = estimator.measurement();
    CHECK(found.time == time);
    CHECK(found.contacts == std::vector<char>{1, 0});
    const VectorXd dq = model.difference(q, found.q), dv = found.v - v;
    REQUIRE(getLargest(model.difference(swing.start(), q).head<6>()) > 5e-3);
    REQUIRE(getLargest(v.head<6>()) > 0.02);
    CHECK(getLargest(dq.head<6>()) < 1e-4);
    CHECK(getLargest(dq.tail(model.nv() - 6)) < 1e-9);
    CHECK(getLargest(dv.head<6>()) < 2e-3);
    // The observers lag by 2 ms behind accelerations of about 1 rad/s^2, which rods enlarge.
    CHECK(getLargest(dv.tail(model.nv() - 6)) < 0.02);
    const double weight = model.mass() * 9.81;
    CHECK(estimator.getWrench(0)[2] == Approx(weight).epsilon(0.05));
    CHECK(std::abs(estimator.getWrench(1)[2]) < 0.05 * weight);
  }
}

TEST_CASE("estimator: a push on the trunk is no force of the ground on a foot in the air") {
  for (const char* name : {"bipetto", "cleobot"}) {
    CAPTURE(name);
    const LoadedRobot robot = loadOwn(name);
    const Model& model = robot.model;
    const VectorXd q = makeStandingPosture(model), rest = VectorXd::Zero(model.nv());
    const double weight = model.mass() * 9.81;
    const PassiveJoints joints(model, q);
    Workspace ws(model);
    updatePositions(model, ws, q);
    updateVelocities<double>(model, ws, rest);
    updateInverseDynamics<double>(model, ws, rest);
    MatrixXd T = MatrixXd::Zero(model.nv(), 6 + model.nu());  // of the speeds of trunk and motors
    T.topLeftCorner<6, 6>().setIdentity();
    for (int m = 0; m < model.nu(); ++m) joints.expand(VectorXd::Unit(model.nu(), m), T.col(6 + m));
    MatrixXd J = MatrixXd::Zero(6, model.nv());  // of the foot that stands, about the world's origin
    for (int k : model.supportDofs(model.contacts()[0].body)) J.col(k) = ws.J.col(k);
    // At rest: T^T b = B u + (J T)^T f + push, of which the rows of the trunk give f and the others u.
    Vector6d push = Vector6d::Zero();
    const Matrix3d R = getTrunk(q).R;
    push.head<3>() = R.transpose() * Vector3d(0.1, 0.4, 0) * weight;
    const MatrixXd A = J * T;
    const VectorXd b = T.transpose() * ws.b;
    const Vector6d f = A.leftCols<6>().transpose().lu().solve(b.head<6>() - push);
    SensorReadings readings;
    readings.motor_torques = b.tail(model.nu()) - A.rightCols(model.nu()).transpose() * f;
    readings.motor_positions.setZero(model.nu());
    for (int m = 0; m < model.nu(); ++m) readings.motor_positions[m] = q[model.joints()[model.motors()[m].joint].idx_q];
    readings.specific_force = -(R.transpose() * model.gravity());
    Estimator estimator(model, q);
    estimator.reset(0, q, rest, {0});
    for (int i = 1; i <= 100; ++i) {
      readings.time = i * kReadingPeriod;
      estimator.update(readings, {0});
      REQUIRE(estimator.contacts() == std::vector<char>{1, 0});
    }
    REQUIRE(f.head<2>().norm() > 0.4 * weight);
    CHECK(estimator.getWrench(0).head<3>().norm() == Approx(f.head<3>().norm()).epsilon(0.03));
    CHECK(estimator.getWrench(1).head<3>().norm() < 0.03 * weight);
  }
}

TEST_CASE("estimator: feet that stand are at rest, unless they roll") {
  const LoadedRobot robot = loadOwn("bipetto");
  const Model& model = robot.model;
  const VectorXd q = makeStandingPosture(model), rest = VectorXd::Zero(model.nv());
  const PassiveJoints joints(model, q);
  FootModel feet(model);
  feet.update(joints, q, rest, rest, VectorXd::Zero(model.nu()));
  const VectorXd unit = VectorXd::LinSpaced(model.nu(), -1, 1);
  for (const auto& [size, stays] : {std::pair(0.05, false), {5.0, true}}) {
    VectorXd speeds = size * unit;
    feet.calmFeet({1, 1}, VectorXd::Zero(6), speeds);
    CHECK((speeds == size * unit) == stays);
    if (!stays) CHECK(getLargest(speeds) < 1e-3 * size);  // twelve motors, two feet
  }
}

TEST_CASE("estimator: an edge bears no moment about itself, and a foot may roll about it") {
  const Model model = changeModel(loadOwn("bipetto").model, [](ModelParts& parts) {
    for (ContactFrame& contact : parts.contacts) contact.kind = ContactKind::Edge5D, contact.half_width = 0;
  });
  const VectorXd q = makeStandingPosture(model), rest = VectorXd::Zero(model.nv());
  const PassiveJoints joints(model, q);
  FootModel feet(model);
  feet.update(joints, q, rest, rest, VectorXd::LinSpaced(model.nu(), -1, 1));
  for (size_t c = 0; c < 2; ++c) {
    const Vector6d& wrench = feet.getWrench(c);
    CHECK(std::abs(wrench[3]) < 1e-9);
    CHECK(std::abs(wrench[4]) > 0.01);
  }
  // All motions in which both feet stand still or roll about their edges.
  Workspace ws(model);
  updatePositions(model, ws, q);
  MatrixXd T = MatrixXd::Zero(model.nv(), 6 + model.nu());
  T.topLeftCorner<6, 6>().setIdentity();
  for (int m = 0; m < model.nu(); ++m) joints.expand(VectorXd::Unit(model.nu(), m), T.col(6 + m));
  MatrixXd A(10, 6 + model.nu());  // rows of both edges
  for (int c = 0; c < 2; ++c) {
    const ContactFrame& contact = model.contacts()[c];
    const SE3 X_WF = getPlacement(ws, contact.body, contact.X_BF);
    MatrixXd J = MatrixXd::Zero(6, model.nv());
    for (int k : model.supportDofs(contact.body)) J.col(k) = ws.J.col(k);
    for (Eigen::Index k = 0; k < J.cols(); ++k) J.col(k).head<3>() += J.col(k).tail<3>().cross(X_WF.p);
    J.topRows<3>() = X_WF.R.transpose() * J.topRows<3>();
    J.bottomRows<3>() = X_WF.R.transpose() * J.bottomRows<3>();
    A.middleRows<3>(5 * c) = (J * T).topRows<3>();
    A.middleRows<2>(5 * c + 3) = (J * T).bottomRows<2>();
  }
  const MatrixXd kernel = A.fullPivLu().kernel();
  REQUIRE(kernel.cols() == model.nu() + 6 - 10);
  for (Eigen::Index k = 0; k < kernel.cols(); ++k) {
    const VectorXd motion = 0.05 * kernel.col(k).normalized();
    VectorXd speeds = motion.tail(model.nu());
    feet.calmFeet({1, 1}, motion.head<6>(), speeds);
    CHECK(getLargest(speeds - motion.tail(model.nu())) < 1e-4);
  }
}

TEST_CASE("estimator: passive joints of a fixed linkage follow its motors") {
  const LoadedRobot robot = loadOwn("fivebar");
  Swing swing(robot.model, 3);
  Estimator estimator(robot.model, swing.start());
  for (int i = 1; i <= 200; ++i) {
    REQUIRE(estimator.update(read(robot.model, swing, {}, i * kReadingPeriod), {}) == NumericalStatus::Ok);
    CHECK(getLargest(estimator.measurement().q - swing.calcConfiguration(i * kReadingPeriod)) < 1e-9);
  }
  CHECK(getLargest(estimator.measurement().v - swing.calcVelocity(200 * kReadingPeriod)) < 0.02);
}

TEST_CASE("estimator: near a dead point the status says so") {
  const LoadedRobot robot = loadOwn("fivebar");
  const Model& model = robot.model;
  const VectorXd q = makeStandingPosture(model);
  Estimator estimator(model, q);
  SensorReadings readings;
  readings.motor_torques.setZero(2);
  readings.motor_positions = Eigen::Vector2d(q[0], q[2]);
  bool warned = false;
  NumericalStatus status = NumericalStatus::Ok;
  for (int i = 0; i < 2000 && status != NumericalStatus::NotClosed; ++i) {  // the motors move apart
    readings.time = i * kReadingPeriod;
    readings.motor_positions += Eigen::Vector2d(-1e-3, 1e-3);
    status = estimator.update(readings, {});
    CHECK(estimator.measurement().q.allFinite());
    warned = warned || status == NumericalStatus::NearDeadPoint;
    if (status == NumericalStatus::Ok) {
      CHECK_FALSE(warned);
      CHECK(estimator.margin() >= 0.02);
      CHECK(estimator.message().empty());
    }
    if (status == NumericalStatus::NearDeadPoint) {
      CHECK(estimator.margin() < 0.02);
      CHECK(estimator.message().find("'pin' is near a dead point") != std::string::npos);
    }
  }
  CHECK(warned);
}

TEST_CASE("estimator: readings that are not finite change nothing") {
  const LoadedRobot robot = loadOwn("bipetto");
  const Model& model = robot.model;
  Swing swing(model, 1);
  Estimator estimator(model, swing.start());
  estimator.reset(0, swing.start(), VectorXd::Zero(model.nv()), {0});
  SensorReadings readings = read(model, swing, {}, kReadingPeriod);
  estimator.update(readings, {0});
  const Measurement before = estimator.measurement();
  for (int part = 0; part < 5; ++part) {
    SensorReadings bad = readings;
    (part == 0   ? bad.time
     : part == 1 ? bad.motor_positions[3]
     : part == 2 ? bad.motor_torques[0]
     : part == 3 ? bad.angular_velocity[1]
                 : bad.specific_force[2]) = std::numeric_limits<double>::quiet_NaN();
    CHECK(estimator.update(bad, {0}) == NumericalStatus::NotFinite);
    CHECK_FALSE(estimator.message().empty());
    CHECK(estimator.measurement().q == before.q);
    CHECK(estimator.measurement().v == before.v);
  }
  readings.time = 2 * kReadingPeriod;
  CHECK(estimator.update(readings, {0}) == NumericalStatus::Ok);
}

TEST_CASE("estimator: robots with joints that no motor determines are refused") {
  const LoadedRobot rail = loadOwn("fivebar_leg");
  CHECK_THROWS_AS(Estimator(rail.model, makeStandingPosture(rail.model)), InputError);
  const LoadedRobot chain = loadOwn("spring_leg");
  CHECK_THROWS_AS(Estimator(chain.model, makeStandingPosture(chain.model)), InputError);
}

TEST_CASE("estimator: an update does not allocate") {
  const LoadedRobot robot = loadOwn("bipetto");
  const Model& model = robot.model;
  Swing swing(model, 2);
  Estimator estimator(model, swing.start());
  estimator.reset(0, swing.start(), VectorXd::Zero(model.nv()), {0});
  std::vector<SensorReadings> readings;
  for (int i = 1; i <= 20; ++i) readings.push_back(read(model, swing, {}, i * kReadingPeriod));
  const std::vector<int> planned = {0, 1};
  const long before = num_allocations;
  for (const SensorReadings& reading : readings) estimator.update(reading, planned);
  const long allocations = num_allocations - before;
  CHECK(allocations == 0);
}

}  // namespace bielle
