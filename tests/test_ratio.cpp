// Reduction ratios. Oracles: the closed-form four-bar, virtual work in the constrained dynamics, differences, and dead
// points found without any Jacobian.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/ocp/cost.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "dynamics/linkage_ratio.h"
#include "math/constants.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kA = 0.15, kB = 0.35, kC = 0.30, kD = 0.40;  // robots/fourbar/README.md

struct Robot {
  explicit Robot(const std::string& name, const std::vector<std::string>& joints)
      : model(loadRobot(name).model), q(findClosedConfiguration(model).q), linkage(makeLinkage(model, q, joints)) {}
  VectorXd getWhole(const RatioSample& sample) const { return carryLinkage(model, linkage, sample, q); }
  Model model;
  VectorXd q;
  Linkage linkage;
};

// dtheta2 / dtheta4 from the derivative of Freudenstein's equation.
double calcFourBarRatio(double theta2, double theta4) {
  const double sine = std::sin(theta2 - theta4);
  return (kD / kA * std::sin(theta4) + sine) / (kD / kC * std::sin(theta2) + sine);
}

// Angle of the rocker with crank and coupler aligned, their sum or difference `reach` long.
double calcExtremeRocker(double reach) { return kPi - std::acos((kC * kC + kD * kD - reach * reach) / (2 * kC * kD)); }

// Closed with one joint at an angle: it is pulled there, the others follow.
VectorXd closeAt(const Model& model, const VectorXd& q, const std::string& joint, double angle) {
  const Joint& pulled = model.joints()[model.findJoint(joint)];
  AssemblyProblem problem;
  problem.q_ref = q;
  problem.q_ref[pulled.idx_q] = angle;
  problem.weights = VectorXd::Constant(model.nv(), 1e-7);
  problem.weights[pulled.idx_v] = 1;
  const AssemblyResult result = assemble(model, problem);
  REQUIRE(result.status == NumericalStatus::Ok);
  REQUIRE(std::abs(result.q[pulled.idx_q] - angle) < 1e-10);
  return result.q;
}

void checkRatioDerivatives(const Robot& robot, const RatioSample& sample) {
  const ReducedCluster& cluster = *robot.linkage.cluster;
  const int m = robot.linkage.size();
  ClusterPoint center(cluster), moved(cluster);
  LinkageRatio ratio, side;
  REQUIRE(center.update(cluster, sample.q));
  REQUIRE(calcLinkageRatio(robot.linkage, center, ratio));
  const auto move = [&](const VectorXd& dq, VectorXd& joints) {
    REQUIRE(moved.close(cluster, center.basis(), dq, VectorXd()));
    joints.resize(m);
    for (int j = 0; j < m; ++j) joints[j] = moved.basis().q[robot.linkage.joint_positions[j]];
    REQUIRE(calcLinkageRatio(robot.linkage, moved, side));
    return side.R;
  };
  const double h = 1e-4;
  for (int k = 0; k < m; ++k) {
    // Richardson's extrapolation in the length of the step, the steps of all joints being measured.
    MatrixXd numeric[2], analytic[2];
    for (int i : {0, 1}) {
      const VectorXd dq = (i + 1) * h * center.basis().N.col(k);
      VectorXd up, down;
      const MatrixXd R_up = move(dq, up), R_down = move(-dq, down);
      numeric[i] = (R_up - R_down) / (2 * (i + 1) * h);
      analytic[i] = MatrixXd::Zero(m, m);
      for (int j = 0; j < m; ++j) analytic[i] += ratio.dR[j] * (up[j] - down[j]) / (2 * (i + 1) * h);
    }
    checkDerivative((4 * analytic[0] - analytic[1]) / 3, (4 * numeric[0] - numeric[1]) / 3);
  }
}

}  // namespace

TEST_CASE("the transmission of an optimal control problem is the inverse of the ratio, and vanishes at a dead point") {
  for (const char* joint : {"knee_right", "ankley_right"}) {
    const Robot robot(std::string(joint) == "knee_right" ? "bipetto" : "rsu_biped", {joint});
    const std::vector<Linkage> all = listLinkages(robot.model, robot.q);
    const auto own = std::find_if(all.begin(), all.end(), [&](const Linkage& linkage) {
      return linkage.output.find(joint) != std::string::npos;
    });
    REQUIRE(own != all.end());
    constexpr double kLargest = 3;  // beyond it the residual is linear in the arctangent
    const auto residual = makeTransmission(*own, kLargest);
    const auto find = [](double r) {
      return r <= kLargest ? r : std::tan(std::atan(kLargest) + (r - kLargest) / (1 + kLargest * kLargest));
    };
    const ConstraintSet set = makeConstraintSet(robot.model);
    Workspace ws(robot.model);
    const VectorXd none;
    int dead = 0;
    double reference = 0;
    const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
    for (const RatioSample& sample : sweep.samples)
      if (sample.s == 0) reference = sample.ratio.R.determinant();
    for (const RatioSample& sample : sweep.samples) {
      if (sample.loses_rank) continue;
      updatePositions(robot.model, ws, robot.getWhole(sample));
      VectorXd r(1);
      residual->calc({robot.model, ws, set, none, none}, r);
      if (sample.dead == DeadPointKind::Output) {
        ++dead;
        CHECK(std::abs(r[0]) < 1e-8);
      } else if (sample.dead == DeadPointKind::None) {
        CHECK(std::abs(find(r[0]) * sample.ratio.R.determinant() / reference - 1) < 1e-8);
      }
    }
    if (std::string(joint) == "knee_right") CHECK(dead > 0);
  }
}

TEST_CASE("four-bar: the ratio on paper, over both branches of a full turn") {
  const Robot robot("fourbar", {"rocker_joint"});
  const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  CHECK(sweep.full_turn);
  int branches[2] = {0, 0};
  double last = -1e9;
  for (const RatioSample& sample : sweep.samples) {
    CHECK(sample.s > last);
    last = sample.s;
    if (sample.dead != DeadPointKind::None) continue;
    const double expected = calcFourBarRatio(sample.motors[0], sample.joints[0]);
    CHECK(std::abs(sample.ratio.R(0, 0) - expected) < 1e-9 * (1 + expected * expected));
    REQUIRE((sample.branch == 0 || sample.branch == 1));
    ++branches[sample.branch];
  }
  CHECK(branches[0] > 50);
  CHECK(branches[1] > 50);
  // The crank has turned once.
  CHECK(sweep.samples.back().motors[0] - sweep.samples.front().motors[0] == Approx(2 * kPi).margin(0.05));

  const std::vector<RatioSample> dead = sweep.deadPoints();
  REQUIRE(dead.size() == 2);
  CHECK(dead[0].dead == DeadPointKind::Output);
  CHECK(dead[1].dead == DeadPointKind::Output);
  CHECK(std::abs(dead[0].joints[0] - calcExtremeRocker(kB + kA)) < 1e-11);
  CHECK(std::abs(dead[1].joints[0] - calcExtremeRocker(kB - kA)) < 1e-11);
  CHECK(std::isinf(dead[0].ratio.R(0, 0)));
}

TEST_CASE("four-bar driven by its rocker: the dead points are the motor's") {
  FourBarChainOptions options;
  options.motor = FourBarMotor::Rocker;
  const FourBarChain chain = makeFourBarChain(options);
  const Linkage linkage = makeLinkage(chain.model, chain.q_closed, {"crank1"});
  const RatioSweep sweep = sweepRatio(chain.model, linkage, chain.q_closed);
  CHECK(sweep.full_turn);
  const std::vector<RatioSample> dead = sweep.deadPoints();
  REQUIRE(dead.size() == 2);
  for (const RatioSample& sample : dead) {
    CHECK(sample.dead == DeadPointKind::Motors);
    CHECK(std::abs(sample.ratio.R(0, 0)) < 1e-10);
  }
  const double low = std::min(dead[0].motors[0], dead[1].motors[0]);
  const double high = std::max(dead[0].motors[0], dead[1].motors[0]);
  CHECK(std::abs(low - calcExtremeRocker(kB + kA)) < 1e-11);
  CHECK(std::abs(high - calcExtremeRocker(kB - kA)) < 1e-11);
}

TEST_CASE("virtual work balances in the constrained dynamics, and a wrong ratio does not") {
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"fourbar", {"rocker_joint"}}, {"fivebar", {"elbow_left", "elbow_right"}},
      {"bipetto", {"knee_right"}},   {"bipetto", {"knee_left"}},
      {"bipetto", {"ankley_right"}}, {"bipetto", {"anklex_left", "ankley_left"}}};
  for (const auto& [name, joints] : cases) {
    CAPTURE(name, joints.front());
    const Robot robot(name, joints);
    const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
    for (size_t i = 0; i < sweep.samples.size(); i += 40) {
      const RatioSample& sample = sweep.samples[i];
      if (sample.dead == DeadPointKind::Output) continue;
      MatrixXd R = sample.ratio.R;
      CHECK(calcBalanceError(robot.model, robot.linkage, robot.getWhole(sample), R) < 1e-10);
      R(0, 0) += 1e-3 * R.cwiseAbs().maxCoeff();
      CHECK(calcBalanceError(robot.model, robot.linkage, robot.getWhole(sample), R) > 1e-6);
      if (sample.ratio.R.cwiseAbs().maxCoeff() < 10) checkRatioDerivatives(robot, sample);
    }
  }
}

TEST_CASE("the knee of Bipetto folds as far as its motor takes it") {
  const Robot robot("bipetto", {"knee_right"});
  const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  const RatioSample* dead = nullptr;
  for (const RatioSample& sample : sweep.samples)
    if (sample.dead == DeadPointKind::Output && sample.joints[0] > 0) dead = &sample;
  REQUIRE(dead);
  CHECK(dead->joints[0] == Approx(1.325).margin(1e-3));
  // The largest knee angle over the motor's angle, by golden section.
  const int knee = robot.model.joints()[robot.model.findJoint("knee_right")].idx_q;
  VectorXd q = robot.q;
  for (double angle = 0.9; angle < 2; angle += 0.1) q = closeAt(robot.model, q, "motor_knee_right", angle);
  double low = 1.9, high = 2.4;
  const double golden = (std::sqrt(5.0) - 1) / 2;
  while (high - low > 1e-5) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    if (closeAt(robot.model, q, "motor_knee_right", a)[knee] > closeAt(robot.model, q, "motor_knee_right", b)[knee])
      high = b;
    else
      low = a;
  }
  CHECK(std::abs(dead->joints[0] - closeAt(robot.model, q, "motor_knee_right", low)[knee]) < 1e-8);
  CHECK(dead->motors[0] == Approx(low).margin(1e-3));
}

TEST_CASE("the map of an ankle: the other joint is held, rows end at dead points") {
  const Robot robot("bipetto", {"ankley_right"});
  CHECK(robot.linkage.joint_names == std::vector<std::string>{"ankley_right", "anklex_right"});
  const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  for (const RatioSample& sample : sweep.samples)
    CHECK(std::abs(sample.joints[1] - sweep.samples.front().joints[1]) < 1e-10);
  int motor_dead = 0;
  for (const RatioSample& sample : sweep.deadPoints()) {
    if (sample.dead != DeadPointKind::Motors) continue;
    ++motor_dead;
    CHECK(sample.ratio.condition > 1e8);
  }
  CHECK(motor_dead > 0);

  const RatioMap map = mapRatio(robot.model, robot.linkage, robot.q, 8);
  REQUIRE(map.rows.size() == 8);
  for (size_t i = 0; i < map.rows.size(); ++i) {
    REQUIRE_FALSE(map.rows[i].empty());
    for (const RatioSample& sample : map.rows[i]) {
      CHECK(std::abs(sample.joints[0] - map.first[i]) < 1e-10);
      const auto same = [&](double angle) { return std::abs(sample.joints[1] - angle) < 1e-10; };
      CHECK(std::count_if(map.second.begin(), map.second.end(), same) == 1);
      CHECK(calcBalanceError(robot.model, robot.linkage, robot.getWhole(sample), sample.ratio.R) < 1e-10);
      const Eigen::JacobiSVD<MatrixXd> svd(sample.ratio.R);
      CHECK(sample.ratio.condition == Approx(svd.singularValues()[0] / svd.singularValues()[1]));
    }
  }
  CHECK(map.dead_points.size() == 2 + 2 * map.rows.size());
}

TEST_CASE("a sweep ends at joint limits, and where loops lose rank") {
  const std::string place = std::string(BIELLE_SOURCE_DIR) + "/robots/fourbar/fourbar";
  const auto read = [](const std::string& path) {
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  };
  const std::string before = "<child link=\"crank\"/>\n    <axis xyz=\"0 -1 0\"/>\n    <limit ";
  const RobotDirectory directory;
  directory.writeRobot(replaceOnce(read(place + ".urdf"), before + "lower=\"-1e16\" upper=\"1e16\" ",
                                   before + "lower=\"0.8\" upper=\"1.5\" "),
                       read(place + ".yaml"));
  const Robot robot(directory.path(), {"rocker_joint"});
  const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  CHECK_FALSE(sweep.full_turn);
  CHECK(sweep.begin == "limit of joint 'crank_joint'");
  CHECK(sweep.end == "limit of joint 'crank_joint'");
  CHECK(std::abs(sweep.samples.front().motors[0] - 0.8) < 1e-10);
  CHECK(std::abs(sweep.samples.back().motors[0] - 1.5) < 1e-10);

  FourBarChainOptions parallelogram;
  parallelogram.ground = parallelogram.coupler = 0.4;
  parallelogram.crank = parallelogram.rocker = 0.2;
  const FourBarChain chain = makeFourBarChain(parallelogram);
  const Linkage linkage = makeLinkage(chain.model, chain.q_closed, {"rocker1"});
  const RatioSweep folded = sweepRatio(chain.model, linkage, chain.q_closed);
  CHECK_FALSE(folded.full_turn);
  CHECK_THAT(folded.begin + folded.end, Catch::Contains("'loop1'"));
  for (const RatioSample& sample : folded.samples) CHECK(sample.ratio.R(0, 0) == Approx(1).margin(1e-6));
  for (size_t i = 0; i < folded.samples.size(); ++i)
    CHECK(folded.samples[i].loses_rank == (i == 0 || i + 1 == folded.samples.size()));
  CHECK(folded.samples.front().motors[0] == Approx(0).margin(1e-3));
  CHECK(folded.samples.back().motors[0] == Approx(kPi).margin(1e-3));
}

TEST_CASE("virtual work balances where the motor stands still too, and another ratio is seen there") {
  const Robot robot("spring_leg", {"toe_joint"});
  const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  CHECK(sweep.full_turn);
  int dead = 0;
  for (const RatioSample& sample : sweep.samples) {
    if (sample.dead == DeadPointKind::Motors) ++dead;
    CHECK(calcBalanceError(robot.model, robot.linkage, robot.getWhole(sample), sample.ratio.R) < 1e-10);
    const MatrixXd other = sample.ratio.R + MatrixXd::Constant(1, 1, 1e-4);
    CHECK(calcBalanceError(robot.model, robot.linkage, robot.getWhole(sample), other) > 1e-6);
  }
  CHECK(dead == 2);
}

TEST_CASE("a polynomial does not repeat after a turn, though all angles and their rates nearly do") {
  const auto sweep = [](double square) {
    ModelBuilder builder("cam");
    for (const char* name : {"wheel", "follower"}) {
      Joint joint;
      joint.name = name;
      joint.kind = JointKind::Continuous;
      Inertia inertia;
      inertia.mass = 1;
      inertia.I_com = Matrix3d::Identity();
      builder.addLink(name + std::string("_link"), "world", joint, inertia);
    }
    // The follower is at x + square x (x - 2 pi): at 0 and at 2 pi it is where the wheel is.
    builder.addCoupler("cam", {{"follower", -1}, {"wheel", 1 - 2 * kPi * square}}, 0, 0, 0, {{"wheel", {square}}});
    builder.addMotor("wheel");
    const Model model = builder.build();
    const VectorXd q = model.makeNeutral();
    return sweepRatio(model, makeLinkage(model, q, {"follower"}), q);
  };
  CHECK_FALSE(sweep(0.05).full_turn);
  CHECK(sweep(0.05).end == "length of the curve");
}

TEST_CASE("belts: a sweep is one turn of the joint, whatever the ratio") {
  const Model belt = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/belt_biped").model;
  for (const double ratio : {2.0, 1.58, 3.3}) {
    CAPTURE(ratio);
    ModelParts parts = takeParts(belt);
    for (Closure& closure : parts.closures)
      for (CouplerTerm& term : closure.terms)
        if (closure.name == "knee_belt_left" && term.coefficient < 0) term.coefficient = -ratio;
    const Model model = ModelBuilder::restore(parts);
    const VectorXd q = findClosedConfiguration(model).q;
    const RatioSweep sweep = sweepRatio(model, makeLinkage(model, q, {"knee_left"}), q);
    CHECK(sweep.full_turn);
    CHECK(sweep.deadPoints().empty());
    const double range = sweep.samples.back().joints[0] - sweep.samples.front().joints[0];
    CHECK(range <= 2 * kPi);
    CHECK(range > 2 * kPi - SweepOptions().step);
    for (const RatioSample& sample : sweep.samples) CHECK(sample.ratio.R(0, 0) == Approx(ratio).epsilon(1e-9));
  }
}

TEST_CASE("joints without a linkage of their own: direct, or refused") {
  const Robot robot("bipetto", {"hipx_left"});
  CHECK(robot.linkage.isDirect());
  const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  REQUIRE(sweep.samples.size() == 2);
  CHECK(sweep.samples[0].ratio.R(0, 0) == 1);
  CHECK(sweep.samples[0].joints[0] == Approx(-kPi / 6).epsilon(1e-3));
  CHECK(calcBalanceError(robot.model, robot.linkage, robot.q, sweep.samples[0].ratio.R) < 1e-12);

  const auto refuse = [](const std::string& name, const std::vector<std::string>& joints, const std::string& text) {
    CHECK_THROWS_WITH(Robot(name, joints), Catch::Contains(text));
    CHECK_THROWS_AS(Robot(name, joints), InputError);
  };
  refuse("bipetto", {"knee"}, "there is no moving joint of this name");
  refuse("bipetto", {"free_knee_left"}, "universal joint of 2 coordinates");
  refuse("bipetto", {"knee_left", "knee_right"}, "not in the linkage of 'knee_left'");
  refuse("bipetto", {"ankley_left", "ankley_left"}, "named twice");
  refuse("fivebar", {"elbow_left"}, "name 2 joints of this linkage");
  refuse("bipetto", {}, "none are named");
}

TEST_CASE("the nearest dead point is that of the sweep, by the way of joint or motor; far away there is none") {
  for (const char* name : {"fourbar", "bipetto"}) {
    const Robot robot(name, {std::string(name) == "fourbar" ? "rocker_joint" : "knee_right"});
    const std::vector<Linkage> all = listLinkages(robot.model, robot.q);
    const auto own = std::find_if(all.begin(), all.end(), [&](const Linkage& linkage) {
      return linkage.output == robot.linkage.joint_names.front();
    });
    REQUIRE(own != all.end());
    const RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
    int near = 0, far = 0;
    for (size_t i = 0; i < sweep.samples.size(); i += 5) {
      const RatioSample& sample = sweep.samples[i];
      if (sample.loses_rank || sample.dead != DeadPointKind::None) continue;
      // To the dead points next to the sample on either side: along the sweep all coordinates move at once.
      double least = std::numeric_limits<double>::infinity();
      const auto look = [&](int step) {
        double joint = 0, motor = 0;  // largest ways
        for (int k = static_cast<int>(i); k >= 0 && k < static_cast<int>(sweep.samples.size()); k += step) {
          const RatioSample& at = sweep.samples[static_cast<size_t>(k)];
          joint = std::abs(at.joints[0] - sample.joints[0]);
          motor = std::abs(at.motors[0] - sample.motors[0]);
          if (at.dead == DeadPointKind::None) continue;
          least = std::min(least, std::max(joint, motor));
          return;
        }
      };
      look(1);
      look(-1);
      CAPTURE(name, sample.joints[0], least);
      const DeadPoint found = findDeadPoint(*own, robot.model, robot.getWhole(sample));
      if (least < 0.99 * kFarthestDeadPoint) {
        CHECK(found.distance == Approx(least).epsilon(1e-6));
        CHECK(found.kind == DeadPointKind::Output);
        ++near;
      } else if (!sweep.full_turn && least > 1.01 * kFarthestDeadPoint) {  // a full turn goes on beyond its ends
        CHECK(found.kind == DeadPointKind::None);
        ++far;
      }
    }
    CHECK(near > 10);
    CHECK((sweep.full_turn || far > 0));
  }
}

TEST_CASE("a sweep tells the distance of each of its samples, and a motion along it the least and where") {
  const Robot robot("bipetto", {"knee_right"});
  RatioSweep sweep = sweepRatio(robot.model, robot.linkage, robot.q);
  addDistances(robot.model, robot.linkage, robot.q, sweep);
  for (const RatioSample& sample : sweep.samples) {
    REQUIRE(sample.nearest);
    CHECK((sample.nearest->distance == 0) == (sample.dead != DeadPointKind::None));
  }
  // Once to and fro between the start and 0.01 rad of the motor before the dead point.
  const auto dead = std::find_if(sweep.samples.begin(), sweep.samples.end(), [](const RatioSample& sample) {
    return sample.dead == DeadPointKind::Output && sample.joints[0] > 0;
  });
  REQUIRE(dead != sweep.samples.end());
  std::vector<VectorXd> there;
  for (const RatioSample& sample : sweep.samples)
    if (sample.s >= 0 && sample.s < dead->s && dead->motors[0] - sample.motors[0] > 0.01)
      there.push_back(robot.getWhole(sample));
  const int turned = static_cast<int>(there.size()) - 1;
  REQUIRE(turned > 20);
  RowMatrixXd qs(2 * turned + 1, robot.model.nq());
  for (int k = 0; k < qs.rows(); ++k) qs.row(k) = there[static_cast<size_t>(k <= turned ? k : 2 * turned - k)];
  for (int samples : {0, 10}) {
    const std::vector<DeadPointTrace> traces = traceDeadPoints(robot.model, qs, samples);
    REQUIRE(traces.size() == 4);
    for (const DeadPointTrace& trace : traces) {
      CHECK(trace.nodes.size() == trace.points.size());
      CHECK(static_cast<int>(trace.nodes.size()) >= std::max(2, samples));
      CHECK(std::is_sorted(trace.nodes.begin(), trace.nodes.end()));
      if (trace.output != "knee_right") continue;
      CHECK(trace.getNearestNode() == turned);
      CHECK(trace.getNearest().kind == DeadPointKind::Output);
      CHECK(trace.getNearest().distance == Approx(findDeadPoint(robot.linkage, robot.model, there.back()).distance));
      CHECK(trace.getNearest().distance < 0.2);
    }
  }
}

TEST_CASE("a posture at a dead point has the distance 0, and is no reference of a transmission") {
  const FourBarChain chain = makeFourBarChain(FourBarChainOptions());
  const Linkage linkage = makeLinkage(chain.model, chain.q_closed, {"rocker1"});
  const RatioSweep sweep = sweepRatio(chain.model, linkage, chain.q_closed);
  REQUIRE_FALSE(sweep.deadPoints().empty());
  for (const RatioSample& sample : sweep.deadPoints()) {
    const VectorXd q = carryLinkage(chain.model, linkage, sample, chain.q_closed);
    CHECK(findDeadPoint(linkage, chain.model, q).distance < 1e-6);
  }
}

namespace {

// A mechanism in the xz plane, whose angles turn from x to z.
class PlaneBuilder {
 public:
  explicit PlaneBuilder(const std::string& name) : builder(name) {}
  void addHinge(const std::string& name, const std::string& parent, double x, double z) {
    add(name, parent, JointKind::Continuous, -Vector3d::UnitY(), {x, 0, z});
  }
  void add(const std::string& name, const std::string& parent, JointKind kind, const Vector3d& axis,
           const Vector3d& p) {
    Joint joint;
    joint.name = name;
    joint.kind = kind;
    joint.axis = axis;
    joint.X_PJ.p = p;
    Inertia inertia;
    inertia.mass = 0.3;
    inertia.I_com = 1e-3 * Matrix3d::Identity();
    builder.addLink(name, parent, joint, inertia);
  }
  // Points along x of two bodies.
  void pin(const std::string& a, double x_a, const std::string& b, double x_b) {
    const std::string name = a + "_" + b;
    builder.addFrame(name + "1", a, {Matrix3d::Identity(), {x_a, 0, 0}});
    builder.addFrame(name + "2", b, {Matrix3d::Identity(), {x_b, 0, 0}});
    builder.addClosure(name, ClosureKind::Ball3D, name + "1", name + "2");
  }
  ModelBuilder builder;
};

constexpr double kBar = 0.5;

// Three stages of crossed bars on a foot that slides; a0 is the angle of the bars, the foot is at kBar cos(a0).
Model makeScissor() {
  PlaneBuilder b("scissor");
  for (const int i : {0, 1, 2}) {
    const std::string n = std::to_string(i);
    b.addHinge("a" + n, i == 0 ? "world" : "b" + std::to_string(i - 1), i == 0 ? 0 : -kBar / 2, 0);
    b.addHinge("b" + n, "a" + n, kBar / 2, 0);
    if (i > 0) b.pin("a" + std::to_string(i - 1), kBar, "b" + n, kBar / 2);
  }
  b.add("foot", "world", JointKind::Prismatic, Vector3d::UnitX(), Vector3d::Zero());
  b.pin("b0", kBar / 2, "foot", 0);
  b.builder.addMotor("foot", 0.01);
  return b.builder.build();
}

}  // namespace

TEST_CASE("a sweep stops where two rows of the loops are lost at once, and distances fall to zero there") {
  const Model model = makeScissor();
  const double start = 0.4;
  VectorXd q(model.nq());
  const std::vector<std::pair<std::string, double>> angles = {{"a0", start},
                                                              {"b0", -2 * start},
                                                              {"a1", 2 * start},
                                                              {"b1", -2 * start},
                                                              {"a2", 2 * start},
                                                              {"b2", -2 * start},
                                                              {"foot", kBar * std::cos(start)}};
  for (const auto& [name, angle] : angles) q[model.joints()[model.findJoint(name)].idx_q] = angle;
  VectorXd flat = VectorXd::Zero(model.nq());
  flat[model.joints()[model.findJoint("foot")].idx_q] = kBar;
  REQUIRE(calcMobility(model, q).rank == 6);
  REQUIRE(calcMobility(model, flat).rank == 4);
  const Linkage linkage = makeLinkage(model, q, {"a0"});
  RatioSweep sweep = sweepRatio(model, linkage, q);
  addDistances(model, linkage, q, sweep);
  CHECK_FALSE(sweep.full_turn);
  CHECK_THAT(sweep.begin, Catch::Contains("its loops lose rank"));
  CHECK_THAT(sweep.end, Catch::Contains("its loops lose rank"));
  CHECK(sweep.samples.front().joints[0] > 0);
  CHECK(sweep.samples.front().joints[0] < 1e-3);
  CHECK(sweep.samples.back().joints[0] == Approx(kPi / 2).margin(1e-3));  // all bars on one another
  int near = 0;
  for (const RatioSample& sample : sweep.samples) {
    const double a = sample.joints[0];
    CAPTURE(a);
    CHECK(sample.ratio.R(0, 0) == Approx(-kBar * std::sin(a)).margin(1e-9));
    if (a > 0.48) continue;
    ++near;
    REQUIRE(sample.nearest);
    CHECK(sample.nearest->kind == DeadPointKind::Motors);
    CHECK(sample.nearest->distance == Approx(a).margin(1e-6));
  }
  CHECK(near > 10);
}

TEST_CASE("a sweep of Peaucellier's inversor stops where its rhombus folds") {
  // Arms from O to A and C, and sides of the rhombus A B C D; B is on a crank about Q, and circles through O.
  const double arm = 0.4, side = 0.15, radius = 0.3;
  PlaneBuilder b("inversor");
  b.addHinge("crank", "world", radius, 0);
  b.addHinge("ba", "crank", radius, 0);
  b.addHinge("bc", "crank", radius, 0);
  b.addHinge("oa", "world", 0, 0);
  b.addHinge("ad", "oa", arm, 0);
  b.addHinge("oc", "world", 0, 0);
  b.addHinge("cd", "oc", arm, 0);
  b.pin("ba", side, "oa", arm);
  b.pin("bc", side, "oc", arm);
  b.pin("ad", side, "cd", side);
  b.builder.addMotor("crank", 0.01);
  const Model model = b.builder.build();
  const auto get = [&](const char* name) { return model.joints()[model.findJoint(name)].idx_q; };
  const double turn = 1.2, reach = 2 * radius * std::cos(turn / 2);  // O B, at half the angle of the crank
  const double at_o = std::acos((arm * arm + reach * reach - side * side) / (2 * arm * reach));
  const double at_b = std::acos((side * side + reach * reach - arm * arm) / (2 * side * reach));
  const double middle = turn / 2;
  VectorXd q(model.nq());
  q[get("crank")] = turn;
  q[get("oa")] = middle + at_o;
  q[get("oc")] = middle - at_o;
  q[get("ba")] = middle + kPi - at_b - turn;
  q[get("bc")] = middle + kPi + at_b - turn;
  const Eigen::Vector2d A(arm * std::cos(middle + at_o), arm * std::sin(middle + at_o));
  const Eigen::Vector2d B(reach * std::cos(middle), reach * std::sin(middle)),
      C(arm * std::cos(middle - at_o), arm * std::sin(middle - at_o));
  const Eigen::Vector2d D = A + C - B;
  q[get("ad")] = std::atan2(D.y() - A.y(), D.x() - A.x()) - (middle + at_o);
  q[get("cd")] = std::atan2(D.y() - C.y(), D.x() - C.x()) - (middle - at_o);
  REQUIRE(closeConfiguration(model, q).status == NumericalStatus::Ok);
  REQUIRE((closeConfiguration(model, q).q - q).norm() < 1e-9);
  const Linkage linkage = makeLinkage(model, q, {"oa"});
  const RatioSweep sweep = sweepRatio(model, linkage, q);
  std::vector<double> reached;
  for (const auto& [end, sample] :
       {std::pair(sweep.begin, sweep.samples.front()), std::pair(sweep.end, sweep.samples.back())}) {
    CHECK_THAT(end, Catch::Contains("its loops lose rank"));
    reached.push_back(2 * radius * std::abs(std::cos(sample.motors[0] / 2)));
  }
  std::sort(reached.begin(), reached.end());
  CHECK(reached[0] == Approx(std::sqrt(arm * arm - side * side)).margin(1e-3));  // D is on B, between A and C
  CHECK(reached[1] == Approx(arm + side).margin(1e-3));                          // A is on C
}
