// Lengths, offsets and play from logs: numbers of the geometry, derivatives of what is left of a log, sides of play, and
// files of logs. Oracles: configurations closed by another way (LinkageMap), central differences, models measured again,
// forces of closures.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/model/names.h"
#include "bielle/robots/fourbar_chain.h"
#include "check_derivative.h"
#include "dynamics/linkage_workspace.h"
#include "get_error.h"
#include "identify/log.h"
#include "identify/log_fit.h"
#include "identify/play_sides.h"
#include "model/listing.h"
#include "own_robots.h"
#include "results/npz.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A linkage of a robot with its motors and serial joints, in the order of the cluster.
struct Trial {
  Trial(const Model& robot, const std::string& joint) : model(robot), q(findClosedConfiguration(robot).q) {
    for (const Linkage& linkage : selectLinkages(model, makeReduction(model, q))) {
      if (!contains(linkage.cluster->joints, model.findJoint(joint))) continue;
      cluster = linkage.cluster;
      motors = linkage.motors, joints = linkage.joints;
    }
    q_cluster.resize(cluster->model.nq());
    gatherConfiguration(model, *cluster, q, q_cluster);
    geometry = listGeometry(model, *cluster, q_cluster);
    for (size_t i = 0; i < cluster->joints.size(); ++i) {
      const int index = cluster->joints[i];
      const Joint &whole = model.joints()[static_cast<size_t>(index)], &own = cluster->model.joints()[i + 1];
      if (!contains(joints, index) && model.findMotor(whole.name) < 0) continue;
      LinkageSensor sensor;
      sensor.name = whole.name, sensor.position = own.idx_q, sensor.dof = own.idx_v, sensor.noise = 1;
      sensors.push_back(sensor);
    }
  }

  const GeometryNumber& get(const std::string& name) const {
    for (const GeometryNumber& number : geometry)
      if (number.name == name) return number;
    FAIL("there is no '" << name << "'");
    throw std::logic_error("");
  }

  // Readings of a robot with these changes, along a way of its motors, whose map finds the joints.
  MatrixXd measure(const std::vector<GeometryNumber>& numbers, const VectorXd& x, int rows) const {
    const auto n = static_cast<Eigen::Index>(numbers.size());
    const Model other = changeGeometry(model, cluster.get(), numbers, x.head(n));
    const AssemblyResult start = closeConfiguration(other, q);
    REQUIRE(start.status == NumericalStatus::Ok);
    LinkageMap map(other, start.q);
    VectorXd at(model.nu()), found(model.nu());
    for (int m = 0; m < model.nu(); ++m)
      at[m] = start.q[model.joints()[static_cast<size_t>(model.motors()[static_cast<size_t>(m)].joint)].idx_q];
    MatrixXd readings(rows, static_cast<Eigen::Index>(sensors.size()));
    for (int k = 0; k < rows; ++k) {
      VectorXd to = at;
      for (size_t i = 0; i < motors.size(); ++i)
        to[motors[i]] += 0.25 * std::sin(0.7 * k + static_cast<double>(i)) - 0.25 * std::sin(static_cast<double>(i));
      REQUIRE(map.calcJoints(to, found).status == NumericalStatus::Ok);
      for (size_t s = 0; s < sensors.size(); ++s)
        readings(k, static_cast<Eigen::Index>(s)) =
            map.q()[model.joints()[static_cast<size_t>(model.findJoint(sensors[s].name))].idx_q] +
            x[n + static_cast<Eigen::Index>(s)];
    }
    return readings;
  }

  Model model;
  VectorXd q, q_cluster;
  std::shared_ptr<const ReducedCluster> cluster;
  std::vector<int> motors, joints;
  std::vector<GeometryNumber> geometry;
  std::vector<LinkageSensor> sensors;
};

Model makeFourBar() { return loadOwn("fourbar").model; }

struct Named {
  std::string robot, joint;
  std::vector<std::string> free;
};
// Halves of rods welded to each other, plane and in space; rods on balls; screws.
const std::vector<Named> kTrials = {
    {"fourbar", "rocker_joint", {"coupler", "crank", "rocker"}},
    {"bipetto", "knee_left", {"knee_rod_lower_left", "knee_crank_left"}},
    {"rsu_biped", "ankley_left", {"rod_ankle1_left", "rod_ankle2_left", "crank_ankle1_left", "heel1_left.x"}}};

// The numbers that are there: names of generated robots may differ.
std::vector<GeometryNumber> choose(const Trial& trial, const Named& named) {
  std::vector<GeometryNumber> numbers;
  for (const GeometryNumber& number : trial.geometry)
    if (contains(named.free, number.name)) numbers.push_back(number);
  CAPTURE(named.robot, listItems(getNames(trial.geometry)));
  REQUIRE(numbers.size() == named.free.size());
  return numbers;
}

VectorXd makeErrors(const std::vector<GeometryNumber>& numbers, const std::vector<LinkageSensor>& sensors) {
  VectorXd x(numbers.size() + sensors.size());
  for (Eigen::Index i = 0; i < x.size(); ++i)
    x[i] = (i % 2 ? -1 : 1) * (i < static_cast<Eigen::Index>(numbers.size()) ? 1e-3 : 9e-3);
  return x;
}

}  // namespace

TEST_CASE("identify: lengths of links, and what changes them") {
  const Trial fourbar(makeFourBar(), "rocker_joint");
  CHECK(fourbar.get("coupler").value == Approx(0.35).epsilon(1e-12));
  CHECK(fourbar.get("crank").value == Approx(0.15).epsilon(1e-12));
  CHECK(fourbar.get("rocker").value == Approx(0.3).epsilon(1e-12));
  CHECK(fourbar.get("rocker_joint.x").value == 0.4);
  CHECK((fourbar.get("coupler").is_rod && !fourbar.get("crank").is_rod && !fourbar.get("rocker").is_rod));
  const Trial chain(makeFourBarChain().model, "rocker1");
  CHECK(chain.get("coupler1").value == Approx(0.35).epsilon(1e-12));
  for (const Named& named : kTrials) {
    const Trial trial(loadOwn(named.robot).model, named.joint);
    for (const GeometryNumber& number : choose(trial, named)) {
      CAPTURE(named.robot, number.name);
      const Model longer = changeGeometry(trial.model, trial.cluster.get(), {number}, VectorXd::Constant(1, 1e-3));
      const Trial again(longer, named.joint);
      CHECK(again.get(number.name).value - number.value == Approx(1e-3).margin(1e-10));
      const auto is_place = [](const GeometryNumber& one) { return one.name.find('.') != std::string::npos; };
      for (const GeometryNumber& other : trial.geometry)
        if (!is_place(number) && !is_place(other) && other.name != number.name)
          CHECK(again.get(other.name).value - other.value == Approx(0).margin(1e-10));
    }
  }
}

TEST_CASE("identify: nothing is left of exact readings, and derivatives are those of differences") {
  for (const Named& named : kTrials) {
    const Trial trial(loadOwn(named.robot).model, named.joint);
    const std::vector<GeometryNumber> numbers = choose(trial, named);
    const VectorXd x = makeErrors(numbers, trial.sensors);
    MatrixXd readings = trial.measure(numbers, x, 12);
    const std::atomic<bool> never{false};
    CAPTURE(named.robot);
    {
      LogFit fit(trial.cluster, numbers, trial.sensors, readings, trial.q_cluster);
      REQUIRE(fit.follow(never));
      REQUIRE(fit.numRows() == 12);
      VectorXd r;
      MatrixXd J;
      REQUIRE(fit.evaluate(VectorXd::Zero(x.size()), r, nullptr));
      CHECK(r.cwiseAbs().maxCoeff() > 1e-4);
      REQUIRE(fit.evaluate(x, r, &J));
      CHECK(r.cwiseAbs().maxCoeff() < 1e-9);
      CHECK(fit.numTold() == 12 * (static_cast<long>(trial.sensors.size()) - static_cast<long>(trial.motors.size())));
      checkDerivative(J, differentiate(x, 1e-4, [&](const VectorXd& at) {
                        VectorXd there;
                        REQUIRE(fit.evaluate(at, there, nullptr));
                        return there;
                      }));
    }
    // With noise, the gradient of the sum of squares is exact.
    std::mt19937 rng(3);
    for (Eigen::Index k = 0; k < readings.rows(); ++k) readings.row(k) += randomVector(rng, readings.cols(), 0.02);
    LogFit fit(trial.cluster, numbers, trial.sensors, readings, trial.q_cluster);
    REQUIRE(fit.follow(never));
    VectorXd r;
    MatrixXd J;
    REQUIRE(fit.evaluate(x, r, &J));
    CHECK(r.cwiseAbs().maxCoeff() > 1e-3);
    checkDerivative(r.transpose() * J, differentiate(x, 1e-4, [&](const VectorXd& at) {
                      VectorXd there;
                      REQUIRE(fit.evaluate(at, there, nullptr));
                      return VectorXd(VectorXd::Constant(1, 0.5 * there.squaredNorm()));
                    }));
  }
}

TEST_CASE("identify: play adds to readings and rods by its sides, and derivatives are those of differences") {
  constexpr double kGear = 4e-3, kRod = 6e-4;  // more than drawn
  constexpr Eigen::Index kRows = 16;
  for (const Named& named : kTrials) {
    const Trial trial(loadOwn(named.robot).model, named.joint);
    CAPTURE(named.robot);
    std::vector<GeometryNumber> numbers = choose(trial, named);
    std::vector<LinkagePlay> plays =
        listLinkagePlays(trial.model, *trial.cluster, trial.sensors,
                         {{trial.model.motors()[static_cast<size_t>(trial.motors.front())].name, 1e-3}});
    const auto n = static_cast<Eigen::Index>(numbers.size()), count = static_cast<Eigen::Index>(trial.sensors.size()),
               P = static_cast<Eigen::Index>(plays.size());
    CHECK(plays.front().size == 1e-3);
    CHECK(P == static_cast<Eigen::Index>(trial.motors.size() + trial.cluster->closures.closures.size()));
    VectorXd x(n + count + P);
    x.head(n + count) = makeErrors(numbers, trial.sensors);
    std::mt19937 rng(4);
    MatrixXd sides(kRows, P);
    for (double& side : sides.reshaped()) side = rng() % 2 ? 1 : -1;
    std::vector<GeometryNumber> all = numbers;
    for (const LinkagePlay& play : plays)
      if (play.sensor < 0) all.push_back(play.rod);
    const auto rods = static_cast<Eigen::Index>(all.size()) - n;
    REQUIRE((rods > 0 && rods < P));
    x.tail(P).head(P - rods).setConstant(kGear);
    x.tail(rods).setConstant(kRod);
    // Each row as if all had its sides.
    MatrixXd readings(kRows, count);
    for (Eigen::Index k = 0; k < kRows; ++k) {
      VectorXd changes(n + rods + count);
      changes << x.head(n), sides.row(k).tail(rods).transpose() * kRod / 2, x.segment(n, count);
      readings.row(k) = trial.measure(all, changes, kRows).row(k);
      for (Eigen::Index p = 0; p < P - rods; ++p)
        readings(k, plays[static_cast<size_t>(p)].sensor) +=
            sides(k, p) * (plays[static_cast<size_t>(p)].size + kGear) / 2;
    }
    sides(3, P - 1) = 0;
    LogFit fit(trial.cluster, numbers, trial.sensors, readings, trial.q_cluster);
    fit.addPlays(plays, sides);
    REQUIRE(fit.follow(std::atomic<bool>(false)));
    CHECK(fit.numRows() == kRows - 1);
    CHECK_FALSE(contains(fit.usedRows(), 3));
    CHECK(fit.followedRows().size() == kRows);
    VectorXd r, without = x;
    MatrixXd J;
    without.tail(P).setZero();
    REQUIRE(fit.evaluate(without, r, nullptr));
    CHECK(r.cwiseAbs().maxCoeff() > 1e-4);
    REQUIRE(fit.evaluate(x, r, &J));
    CHECK(r.cwiseAbs().maxCoeff() < 1e-9);
    checkDerivative(J, differentiate(x, 1e-4, [&](const VectorXd& at) {
                      VectorXd there;
                      REQUIRE(fit.evaluate(at, there, nullptr));
                      return there;
                    }));
    // At one side in all rows, it is a part of the offset or the length.
    LogFit still(trial.cluster, numbers, trial.sensors, readings, trial.q_cluster);
    still.addPlays(plays, MatrixXd::Ones(kRows, P));
    REQUIRE(still.follow(std::atomic<bool>(false)));
    REQUIRE(still.evaluate(x, r, &J));
    for (Eigen::Index p = 0; p < P - rods; ++p)
      CHECK((J.col(n + count + p) - J.col(n + plays[static_cast<size_t>(p)].sensor) / 2).norm() < 1e-12 * J.norm());
  }
}

TEST_CASE("identify: the load of a rod's play is the force of its closure along the rod") {
  for (const char* name : {"fourbar", "rsu_biped"}) {
    Model model = loadOwn(name).model;
    const Trial trial(model, name == std::string("fourbar") ? "rocker_joint" : "ankley_left");
    CAPTURE(name);
    const std::vector<LinkagePlay> plays = listLinkagePlays(model, *trial.cluster, trial.sensors, {});
    MeasuredLinkage linkage{trial.cluster, trial.sensors, trial.q_cluster, {}};
    // At rest, and let go under these torques.
    LoadedState state{trial.q, VectorXd::Zero(model.nv()), {}, VectorXd(model.nu()), VectorXd::Zero(model.nu()), {}};
    for (Eigen::Index m = 0; m < model.nu(); ++m) state.u[m] = 1.5 - 0.7 * static_cast<double>(m);
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const ConstraintSet closures = makeConstraintSet(model);
    REQUIRE(updateConstrainedDynamics(model, ws, cws, closures, state.q, state.v, calcMotorForces(model, state.u)) ==
            NumericalStatus::Ok);
    state.a = cws.a;
    const PlayLoads loads =
        calcPlayLoads(model, linkage, plays, {{state}, {0}, {}}, VectorXd::Constant(model.nu(), 1e-2));
    for (size_t p = 0; p < plays.size(); ++p) {
      const LinkagePlay& play = plays[p];
      const double load = loads.values(0, static_cast<Eigen::Index>(p));
      CAPTURE(play.name, load);
      CHECK(loads.least(0, static_cast<Eigen::Index>(p)) > 9e-3);
      if (play.sensor >= 0) {
        const Motor& motor = model.motors()[static_cast<size_t>(model.findMotor(play.name))];
        CHECK(load == Approx(state.u[model.findMotor(play.name)] - motor.armature * state.a[motor.dof]).epsilon(1e-9));
        continue;
      }
      constexpr double kStep = 1e-6;
      const auto calcResiduals = [&](double s) {
        const Model longer = changeGeometry(model, trial.cluster.get(), {play.rod}, VectorXd::Constant(1, s));
        Workspace there(longer);
        updatePositions(longer, there, state.q);
        VectorXd h = VectorXd::Zero(closures.rows);
        for (size_t c = 0; c < longer.closures().size(); ++c)
          h.segment(closures.offsets[c], getRows(longer.closures()[c].kind)) =
              calcClosureResidual(there, longer.closures()[c]);
        return h;
      };
      // Residuals fall by J dq (notation.h), so that work is lambda times what they grow by.
      const VectorXd slope = (calcResiduals(kStep) - calcResiduals(-kStep)) / (2 * kStep);
      CHECK(slope.norm() == Approx(1).epsilon(0.5));
      CHECK(std::abs(load) > 0.1);
      CHECK(load == Approx(-slope.dot(cws.lambda)).epsilon(1e-6));
      // The play of a world is that of the length.
      ModelParts parts = takeParts(model);
      for (Motor& motor : parts.motors) motor.armature = parts.armature[motor.dof] = 1e-3;
      const Model with = addPlay(ModelBuilder::restore(parts), {{play.name, 1e-2}});
      constexpr double kLonger = 2e-3;
      const AssemblyResult longer = closeConfiguration(
          changeGeometry(model, trial.cluster.get(), {play.rod}, VectorXd::Constant(1, kLonger)), state.q);
      REQUIRE(longer.status == NumericalStatus::Ok);
      VectorXd q = with.makeNeutral();
      for (size_t i = 1; i < model.joints().size(); ++i) {
        const Joint &joint = model.joints()[i], &same = with.joints()[static_cast<size_t>(with.findJoint(joint.name))];
        q.segment(same.idx_q, same.nq) = longer.q.segment(joint.idx_q, joint.nq);
      }
      Workspace there(with);
      updatePositions(with, there, q);
      CHECK(calcLargestGap(there, makeConstraintSet(with)) > 0.5 * kLonger);
      q[with.joints()[static_cast<size_t>(with.findJoint(getPlayName(play.name)))].idx_q] = kLonger;
      updatePositions(with, there, q);
      CHECK(calcLargestGap(there, makeConstraintSet(with)) < 1e-9);
    }
  }
}

TEST_CASE("identify: sides are those of loads that are clear before and after") {
  PlayLoads loads{MatrixXd(6, 1), MatrixXd::Constant(6, 1, 0.5)};
  loads.values << 1, 2, 0.4, -1, -3, -2;
  const VectorXd time = VectorXd::LinSpaced(13, 0, 6);
  const MatrixXd sides = findSides(time, {1, 2, 3, 4, 5, 5.6}, loads, 1.1);
  VectorXd expected = VectorXd::Zero(13);
  expected[3] = expected[4] = 1;           // 1.5 and 2, but not at the first one and before
  expected.segment(9, 3).setConstant(-1);  // 4.5, 5, 5.5
  CHECK(sides == expected);
  CHECK(findSides(time, {1, 2, 3, 4, 5, 5.6}, loads, 0.9).cwiseAbs().sum() == 1);  // 5.5
  CHECK(findSides(time, {1, 2, 3, 4, 5, 5.6}, loads, 0.1) == MatrixXd::Ones(13, 1));
}

TEST_CASE("identify: angles do not tell the size of a linkage") {
  const Trial trial(makeFourBar(), "rocker_joint");
  std::vector<GeometryNumber> numbers;
  VectorXd sizes(6);
  for (const char* name : {"coupler", "crank", "rocker", "rocker_joint.x"}) {
    sizes[static_cast<Eigen::Index>(numbers.size())] = trial.get(name).value;
    numbers.push_back(trial.get(name));
  }
  sizes.tail(2).setZero();
  LogFit fit(trial.cluster, numbers, trial.sensors, trial.measure(numbers, VectorXd::Zero(6), 12), trial.q_cluster);
  REQUIRE(fit.follow(std::atomic<bool>(false)));
  VectorXd r;
  MatrixXd J;
  REQUIRE(fit.evaluate(VectorXd::Zero(6), r, &J));
  CHECK((J * sizes).norm() < 1e-11 * J.norm());
  CHECK((J * VectorXd::Unit(6, 0)).norm() > 1e-3 * J.norm());
}

TEST_CASE("identify: readings that no configuration is near are left out") {
  const Trial trial(makeFourBar(), "rocker_joint");
  MatrixXd readings = trial.measure({}, VectorXd::Zero(2), 12);
  readings.row(5).setConstant(std::nan(""));
  LogFit fit(trial.cluster, {}, trial.sensors, readings, trial.q_cluster);
  REQUIRE(fit.follow(std::atomic<bool>(false)));
  CHECK(fit.numRows() == 11);
  CHECK_FALSE(contains(fit.usedRows(), 5));
  LogFit ended(trial.cluster, {}, trial.sensors, readings, trial.q_cluster);
  CHECK_FALSE(ended.follow(std::atomic<bool>(true)));
}

TEST_CASE("identify: logs as text and as arrays") {
  const RobotDirectory directory;
  const std::vector<std::string> wanted = {"crank", "knee"};
  const MotionLog log = readLog(
      directory.write("log.csv", "\xef\xbb\xbftime, \"crank\",other,q.knee\r\n0,1,x,2\r\n\r\n0.5,-1e-3,,.25\r\n"),
      wanted);
  CHECK(log.names == wanted);
  CHECK(log.time == VectorXd(Eigen::Vector2d(0, 0.5)));
  CHECK(log.values == MatrixXd(Eigen::Matrix2d{{1, 2}, {-1e-3, 0.25}}));
  CHECK(log.rows == std::vector<std::string>{"line 2", "line 4"});
  CHECK(log.find("knee") == 1);
  CHECK(log.find("other") == -1);

  NpyArrays arrays;
  arrays["time"] = {{3}, {0, 1, 2}, {}, false};
  arrays["crank"] = {{3}, {4, 5, 6}, {}, false};
  arrays["q"] = {{3, 2}, {1, 2, 3, 4, 5, 6}, {}, false};
  arrays["q_names"] = {{2}, {}, {"base.x", "knee"}, true};
  const auto writeArrays = [&] { return directory.write("log.npz", formatArchive(arrays)); };
  const MotionLog archive = readLog(writeArrays(), wanted);
  CHECK(archive.names == wanted);
  CHECK(archive.values == MatrixXd(Eigen::Matrix<double, 3, 2>{{4, 2}, {5, 4}, {6, 6}}));

  const auto refuse = [&](const std::string& text, const std::string& message) {
    CAPTURE(text);
    CHECK_THAT(getError([&] { readLog(directory.write("bad.csv", text), wanted); }), Catch::Contains(message));
  };
  refuse("", "bad.csv: file: it is empty; give a log");
  refuse("time,crank\n", "bad.csv: rows: there are none");
  refuse("time,crank\n0,1\n", "bad.csv: rows: there is one");
  refuse("crank,knee\n0,1\n1,1\n", "column 'time': it is missing; there are: crank, knee");
  refuse("time,crank\n0,1\n1\n", "line 3: it has 1 cells, and the header 2");
  refuse("time,crank\n0,1\n1,2,3\n", "line 3: it has 3 cells, and the header 2");
  refuse("time,crank\n0,1\n1,nan\n", "line 3, column 'crank': 'nan' is no finite number");
  refuse("time,crank\n0,.nan\n1,1\n", "line 2, column 'crank': '.nan' is no finite number");
  refuse("time,crank\n0,1\n1,\n", "line 3, column 'crank': '' is no finite number");
  refuse("time,crank\nzero,1\n1,1\n", "line 2, column 'time': 'zero' is no finite number");
  refuse("time,crank,q.crank\n0,1,1\n1,1,1\n", "column 'crank': it is there twice");
  refuse("time,crank\n1,1\n0,1\n", "line 3: its time, 0, is before that of the row above, 1");
  CHECK_THAT(getError([&] { readLog(directory.path() + "/none.csv", wanted); }), Catch::Contains("none.csv"));
  arrays["crank"].numbers[1] = INFINITY;
  CHECK_THAT(getError([&] { readLog(writeArrays(), wanted); }), Catch::Contains("row 1, column 'crank': 'inf'"));
  arrays["crank"].numbers[1] = 5;
  arrays["q"].shape = {2, 3};
  CHECK_THAT(getError([&] { readLog(writeArrays(), wanted); }), Catch::Contains("array 'q': its shape does not match"));
}
