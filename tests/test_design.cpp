// Design: robots made from numbers, their values, and searches that resume after being killed.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/robots/robot_loader.h"
#include "design/draft.h"
#include "design/run.h"
#include "design_trials.h"
#include "get_error.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

const std::string kRobots = std::string(BIELLE_SOURCE_DIR) + "/robots/";
const Vector3d kX = Vector3d::UnitX(), kZ = Vector3d::UnitZ();

DesignVariable makeLength(const std::string& name, double lower, double upper, std::vector<LengthChange> lengths) {
  DesignVariable variable;
  variable.name = name, variable.lower = lower, variable.upper = upper, variable.lengths = std::move(lengths);
  return variable;
}

DesignVariable makeShift(const std::string& name, double lower, double upper, std::vector<ShiftChange> shifts) {
  DesignVariable variable;
  variable.name = name, variable.lower = lower, variable.upper = upper, variable.shifts = std::move(shifts);
  return variable;
}

std::vector<DesignVariable> makeKnee() {
  return {makeLength("crank", 0.03, 0.08,
                     {{"motor_knee_right", "transmission_knee_right", kZ, "knee_crank_right"},
                      {"motor_knee_left", "transmission_knee_left", kZ, "knee_crank_left"}}),
          makeShift("motor", -0.03, 0.03, {{"motor_knee_right", kX}, {"motor_knee_left", kX}})};
}

const std::vector<ObjectiveTerm> kKneePeak = {{Measure::PeakTorque, {"motor_knee_left", "motor_knee_right"}, 1}};

}  // namespace

TEST_CASE("design: lengths of rods without a body, of left and right alike") {
  ModelBuilder builder("rods");
  Joint joint;
  joint.kind = JointKind::Revolute, joint.axis = Vector3d::UnitY();
  for (const std::string side : {"left", "right"}) {
    joint.name = side, joint.X_PJ.p.x() += 0.3;
    builder.addLink(side + "_bar", "world", joint, {1, {0, 0, 0.1}, 0.01 * Matrix3d::Identity()});
    builder.addFrame(side + "_end", side + "_bar", {Matrix3d::Identity(), {0, 0, 0.2}});
    builder.addDistance(side + "_rod", side + "_end", "world");
  }
  const Model model = builder.build();
  const double left = std::hypot(0.3, 0.2), right = std::hypot(0.6, 0.2);
  const auto makeRods = [](double lower, const std::string& second = "right_rod") {
    std::vector<LengthChange> rods(2);
    rods[0].rod = "left_rod", rods[1].rod = second;
    return std::vector{makeLength("rod", lower, 0.5, rods)};
  };
  const Parametrization robot(model, makeRods(0.3));
  CHECK(robot.start()[0] == Approx(left).epsilon(1e-15));  // std::hypot rounds otherwise
  const Model made = robot.make(VectorXd::Constant(1, 0.4));
  CHECK(made.closures()[0].length == Approx(0.4).epsilon(1e-15));
  CHECK(made.closures()[1].length == Approx(right + 0.4 - left).epsilon(1e-15));
  CHECK(robot.make(robot.start()).closures()[1].length == right);
  const auto getRodError = [&](double lower, const std::string& second) {
    return getError([&] { Parametrization(model, makeRods(lower, second)); });
  };
  CHECK_THAT(getRodError(0.3, "left"), Contains("rod 'left': there is no closure of type distance with this name"));
  CHECK_THAT(getRodError(-0.1, "right_rod"), Contains("the length of 'left_rod' is zero, or would become zero"));
}

TEST_CASE("design: lengths of a four-bar are those of its maker") {
  FourBarChainOptions options;
  const Model start = makeFourBarChain(options).model;
  const std::vector<DesignVariable> variables = {
      makeLength("crank", 0.1, 0.2, {{"crank1", "coupler1", Vector3d::Zero(), "crank1"}}),
      makeLength("coupler", 0.3, 0.45, {{"coupler1", "end of coupler1", Vector3d::Zero(), "coupler1"}}),
      makeLength("rocker", 0.2, 0.4, {{"rocker1", "end of rocker1", Vector3d::Zero(), "rocker1"}}),
      makeShift("ground", -0.1, 0.1, {{"rocker1", kX}})};
  const Parametrization robot(start, variables);
  CHECK(robot.start().isApprox(Eigen::Vector4d(options.crank, options.coupler, options.rocker, 0), 1e-14));

  FourBarChainOptions other = options;
  other.crank = 0.13, other.coupler = 0.41, other.rocker = 0.27, other.ground = options.ground + 0.03;
  const Model made = robot.make(Eigen::Vector4d(other.crank, other.coupler, other.rocker, 0.03));
  const Model expected = makeFourBarChain(other).model;
  for (int i = 1; i < made.numBodies(); ++i) {
    CAPTURE(made.joints()[i].name);
    CHECK(made.joints()[i].name == expected.joints()[i].name);
    CHECK((made.joints()[i].X_PJ.p - expected.joints()[i].X_PJ.p).norm() < 1e-14);
    const Matrix6d Y = made.bodies()[i].inertia.toMatrix(), Y_expected = expected.bodies()[i].inertia.toMatrix();
    CHECK((Y - Y_expected).norm() < 1e-14 * Y_expected.norm());
  }
  CHECK((made.closures()[0].X_B1.p - expected.closures()[0].X_B1.p).norm() < 1e-14);
  CHECK((made.closures()[0].X_B2.p - expected.closures()[0].X_B2.p).norm() < 1e-14);
}

TEST_CASE("design: the start of a parametrization is the robot, to the last letter") {
  const Model bipetto = loadBipetto();
  const Parametrization robot(bipetto, makeKnee());
  const RobotText made = formatRobot(robot.make(robot.start())), given = formatRobot(bipetto);
  CHECK(made.urdf == given.urdf);
  CHECK(made.yaml == given.yaml);
  CHECK(robot.start()[0] == Approx(std::hypot(0.048296, 0.012941)).epsilon(1e-12));
}

TEST_CASE("design: both legs change by as much, and nothing else does") {
  const Model bipetto = loadBipetto();
  const Parametrization robot(bipetto, makeKnee());
  VectorXd x = robot.start();
  x[0] += 0.01, x[1] = 0.004;
  const Model made = robot.make(x);
  for (int i = 1; i < made.numBodies(); ++i) {
    const Joint &a = bipetto.joints()[i], &b = made.joints()[i];
    CAPTURE(a.name);
    REQUIRE(a.name == b.name);
    const double change = (b.X_PJ.p - a.X_PJ.p).norm();
    const bool crank = a.name.rfind("transmission_knee", 0) == 0, motor = a.name.rfind("motor_knee", 0) == 0;
    CHECK(change == Approx(crank ? 0.01 : motor ? 0.004 : 0).margin(1e-14));
    if (crank) CHECK(b.X_PJ.p.z() == a.X_PJ.p.z());  // along its axis nothing moves
  }
  const auto mass = [](const Model& model) {
    for (const Body& body : model.bodies())
      if (body.name == "knee_crank_left") return body.inertia.mass;
    return 0.0;
  };
  CHECK(mass(made) == Approx(mass(bipetto) * (robot.start()[0] + 0.01) / robot.start()[0]).epsilon(1e-5));
}

TEST_CASE("design: a stretched body stays a possible one") {
  const Model bipetto = loadBipetto();
  RobotDraft draft(bipetto);
  const Vector3d direction = Vector3d(1, -2, 0.5).normalized();
  draft.stretch("shin_left", Vector3d(0.1, 0, 0), direction, 0.2);
  const Model made = draft.build();
  int body = 1;
  while (made.bodies()[body].name != "shin_left") ++body;
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(made.bodies()[body].inertia.I_com).eigenvalues();
  CHECK(moments[0] > 0);
  CHECK(moments[0] + moments[1] >= moments[2]);
  CHECK(made.bodies()[body].inertia.mass == Approx(0.2 * bipetto.bodies()[body].inertia.mass));
  // Across the direction the second moments only lose mass.
  const Vector3d across = direction.cross(kZ).normalized();
  const auto second = [&](const Inertia& i) { return i.I_com.trace() / 2 - across.dot(i.I_com * across); };
  CHECK(second(made.bodies()[body].inertia) == Approx(0.2 * second(bipetto.bodies()[body].inertia)));
}

TEST_CASE("design: a spring moves with the frame that it was attached to") {
  ModelParts parts = takeParts(loadBipetto());
  const auto frame = std::find_if(parts.frames.begin(), parts.frames.end(),
                                  [&](const Frame& f) { return f.body > 0 && f.name != parts.bodies[f.body].name; });
  REQUIRE(frame != parts.frames.end());
  PointSpring spring;
  spring.name = "spring", spring.body2 = frame->body, spring.point2 = frame->X_BF.p, spring.rest = 0.1;
  parts.point_springs.push_back(spring);
  const Model model = ModelBuilder::restore(parts);
  RobotDraft draft(model);
  const Vector3d place = frame->X_BF.p + Vector3d(0.01, 0.02, 0.03);
  draft.setPlace(frame->name, place);
  const Model made = draft.build();
  REQUIRE(made.pointSprings().size() == 1);
  CHECK(made.pointSprings()[0].point2 == place);
  CHECK(made.pointSprings()[0].point1 == Vector3d::Zero());
}

TEST_CASE("design: a heavier trunk") {
  const Model bipetto = loadBipetto();
  RobotDraft draft(bipetto);
  draft.scaleMass(bipetto.bodies()[1].name, 1.5);
  const Inertia before = bipetto.bodies()[1].inertia, after = draft.build().bodies()[1].inertia;
  CHECK(after.mass == Approx(1.5 * before.mass));
  CHECK((after.I_com - 1.5 * before.I_com).norm() < 1e-14);
  CHECK(after.com == before.com);
  CHECK_THROWS_AS(draft.scaleMass("nothing", 2), InputError);
}

TEST_CASE("design: parameters of a generator") {
  DesignVariable variable;
  variable.name = "thigh", variable.parameter = "thigh_length", variable.lower = 0.05, variable.upper = 0.5;
  const Parametrization robot("cleobot", {}, {variable});
  const Generator& generator = findGenerator("cleobot");
  OptionSet parameters = generator.parameters;
  const double length = robot.start()[0];
  parameters.set("thigh_length", length * 1.02);
  CHECK(formatRobot(robot.make(1.02 * robot.start())).urdf == formatRobot(generator.make(parameters)).urdf);
  CHECK(formatRobot(robot.make(robot.start())).urdf != formatRobot(generator.make(parameters)).urdf);
}

TEST_CASE("design: measures by hand") {
  const Model model = makeFourBarChain().model;  // the motor is that of the crank, dof 1
  ShootingTrajectory trajectory;
  const VectorXd q = makeFourBarChain().q_closed;
  for (double speed : {0.5, -2.0, 9.0}) {
    VectorXd x = VectorXd::Zero(6);
    x << q, 0, speed, 0;
    trajectory.xs.push_back(x);
  }
  for (double torque : {3.0, -4.0}) trajectory.us.push_back(VectorXd::Constant(1, torque));
  const MotionMeasures measures = calcMotionMeasures(model, {0.1, 0.3}, trajectory);
  CHECK(measures.motors[0].peak_torque == 4);
  CHECK(measures.motors[0].rms_torque == Approx(std::sqrt((0.1 * 9 + 0.3 * 16) / 0.4)));
  CHECK(measures.motors[0].peak_speed == 2);
  CHECK(measures.motors[0].energy == Approx(0.1 * 1.5 + 0.3 * 8));
  // A unit motion of one mobility: the speeds of rocker, crank and coupler by the loop's equations,
  //     -a s2 w2 - b s3 w3 = -c s4 w4,   a c2 w2 + b c3 w3 = c c4 w4   with w2 = 1.
  const FourBarChainOptions o;
  const double t4 = q[0], t2 = q[1], t3 = q[1] + q[2];
  const double w4 = o.crank * std::sin(t2 - t3) / (o.rocker * std::sin(t4 - t3));
  const double w3 = o.crank * std::sin(t2 - t4) / (o.coupler * std::sin(t4 - t3));
  CHECK(measures.conditioning == Approx(std::sqrt(1 + w4 * w4 + (w3 - 1) * (w3 - 1))).epsilon(1e-9));
}

TEST_CASE("design: a shorter crank is evaluated, an impossible one penalized") {
  const Parametrization robot(loadBipetto(), makeKnee());
  const DesignEvaluator evaluator(robot, {makeSmallSquat()}, kKneePeak);
  CHECK(evaluator.start().value == 1);
  VectorXd x = robot.start();
  x[0] -= 0.003;
  const Evaluation shorter = evaluator.evaluate(x), again = evaluator.evaluate(x);
  REQUIRE(shorter.status == DesignStatus::Feasible);
  CHECK(shorter.value == Approx(shorter.terms[0] / evaluator.start().terms[0]));
  CHECK(shorter.value == again.value);
  CHECK(std::abs(shorter.value - 1) > 1e-3);

  // The start's motion kept gives nearly the same torques: the motion hardly depends on so small a change.
  EvaluationOptions kept;
  kept.mode = MotionMode::Kept;
  const Evaluation recomputed = DesignEvaluator(robot, {makeSmallSquat()}, kKneePeak, kept).evaluate(x);
  REQUIRE(recomputed.status == DesignStatus::Feasible);
  CHECK(recomputed.value == Approx(shorter.value).epsilon(0.05));

  // Designs ever further out of reach: worse than any feasible one, and continuous.
  const Parametrization wide(loadBipetto(), {makeLength("rod", 0.01, 0.3,
                                                        {{"free_knee_right", "closure_knee_right_A", kZ, ""},
                                                         {"free_knee_left", "closure_knee_left_A", kZ, ""}})});
  const DesignEvaluator reach(wide, {makeSmallSquat()}, kKneePeak);
  double last = 1.5;
  for (double length : {0.06, 0.05, 0.04, 0.03}) {
    CAPTURE(length);
    const Evaluation open = reach.evaluate(VectorXd::Constant(1, length));
    CHECK(open.status == DesignStatus::LoopOpen);
    CHECK(open.value > last);
    last = open.value;
  }
  const double near = reach.evaluate(VectorXd::Constant(1, 0.03 + 1e-6)).value;
  CHECK(std::abs(near - last) < 1e-3);
}

TEST_CASE("design: searches find a minimum, the same one for the same seed") {
  SearchProblem problem;
  problem.lower = Eigen::Vector2d(-1, 0), problem.upper = Eigen::Vector2d(3, 10), problem.start = Eigen::Vector2d(0, 9);
  std::vector<VectorXd> points;
  problem.objective = [&](const VectorXd& x, const SearchStage&) {
    points.push_back(x);
    return std::pow(x[0] - 1, 2) + std::pow((x[1] - 4) / 3, 2);
  };
  for (SearchAlgorithm global : {SearchAlgorithm::Crs, SearchAlgorithm::Isres})
    for (SearchAlgorithm local : {SearchAlgorithm::Bobyqa, SearchAlgorithm::Sbplx}) {
      const std::vector<SearchStage> stages = {{global, 100, 1e-4}, {local, 150, 1e-6}};
      points.clear();
      const SearchResult result = minimizeByStages(problem, stages, 7);
      CHECK((result.x - Eigen::Vector2d(1, 4)).norm() < 1e-2);
      CHECK(result.evaluations == static_cast<int>(points.size()));
      const std::vector<VectorXd> first = points;
      points.clear();
      minimizeByStages(problem, stages, 7);
      CHECK(points == first);
      points.clear();
      minimizeByStages(problem, stages, 8);
      CHECK(points != first);
    }
  problem.objective = [](const VectorXd&, const SearchStage&) -> double { throw InputError("a", "b", "c", "d"); };
  CHECK_THROWS_AS(minimizeByStages(problem, {{}}, 1), InputError);
}

TEST_CASE(
    "design: every search keeps the best point that it saw, whatever its algorithm returns, and says why it ended") {
  // Where x + y < 1 no loop closes: infinite or no number. The least value there is would be on that border.
  for (const double open : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    double least = std::numeric_limits<double>::infinity();
    const auto rate = [&least, open](const VectorXd& x) {
      const double value = x[0] + x[1] < 1 ? open : x.squaredNorm();
      if (value < least) least = value;
      return value;
    };
    SearchProblem problem;
    problem.lower = Eigen::Vector2d(-1, -1), problem.upper = Eigen::Vector2d(3, 3),
    problem.start = Eigen::Vector2d(2, 2.5);
    problem.objective = [&rate](const VectorXd& x, const SearchStage&) { return rate(x); };
    problem.sloped = [&rate](const VectorXd& x, const SearchStage&) {
      SlopedValue out;
      out.value = rate(x);
      if (!std::isfinite(out.value)) return out;
      out.terms = {{VectorXd::Constant(1, out.value), 2 * x.transpose()}};
      out.limits = {VectorXd::Constant(2, 1 - x[0] - x[1]), MatrixXd::Constant(2, 2, -1)};  // a repeated row
      return out;
    };
    for (const SearchAlgorithm algorithm : {SearchAlgorithm::Crs, SearchAlgorithm::Isres, SearchAlgorithm::Bobyqa,
                                            SearchAlgorithm::Sbplx, SearchAlgorithm::Slsqp, SearchAlgorithm::Mma}) {
      CAPTURE(getName(algorithm), open);
      least = std::numeric_limits<double>::infinity();
      const SearchResult result = minimizeByStages(problem, {{algorithm, 120, 1e-6}}, 3);
      CHECK(result.value == least);
      CHECK(result.value <= problem.start.squaredNorm());
      CHECK(result.x.squaredNorm() == result.value);
      CHECK(result.x.sum() >= 1);
      REQUIRE(result.ends.size() == 1);
      CHECK(result.ends[0].algorithm == algorithm);
      CHECK_FALSE(result.ends[0].reason.empty());
    }
  }
  // Only what is near the start can be evaluated, and the slope leads far beyond it.
  for (const SearchAlgorithm algorithm : {SearchAlgorithm::Slsqp, SearchAlgorithm::Mma}) {
    CAPTURE(getName(algorithm));
    SearchProblem narrow;
    narrow.lower = Eigen::Vector2d(0, 0), narrow.upper = Eigen::Vector2d(1, 1),
    narrow.start = Eigen::Vector2d(0.8, 0.8);
    narrow.sloped = [](const VectorXd& x, const SearchStage&) {
      SlopedValue out;
      out.value = x.minCoeff() < 0.6 ? 2 : x.maxCoeff();
      if (out.value == 2) return out;
      out.terms = {{x, MatrixXd::Identity(2, 2)}};
      out.limits = {VectorXd::Constant(1, x.sum() - 10), MatrixXd::Constant(1, 2, 1)};  // far away
      return out;
    };
    const SearchResult result = minimizeByStages(narrow, {{algorithm, 60, 1e-3}}, 1);
    CHECK(result.value < 0.61);
    CHECK(result.evaluations <= 60);
    REQUIRE(result.ends.size() == 1);
    CHECK(result.ends[0].evaluations == result.evaluations);
  }
  SearchProblem bowl;
  bowl.lower = VectorXd::Constant(1, -1), bowl.upper = VectorXd::Constant(1, 1),
  bowl.start = VectorXd::Constant(1, 0.7);
  bowl.objective = [](const VectorXd& x, const SearchStage&) { return x[0] * x[0]; };
  const SearchResult cut =
      minimizeByStages(bowl, {{SearchAlgorithm::Sbplx, 4, 1e-9}, {SearchAlgorithm::Sbplx, 400, 1e-3}}, 1);
  REQUIRE(cut.ends.size() == 2);
  CHECK(cut.ends[0].reason == "it had all its evaluations");
  CHECK(cut.ends[0].evaluations == 4);
  CHECK(cut.ends[1].reason == "its steps are smaller than the tolerance");
}

TEST_CASE("evaluations: what is not one is refused") {
  LoggedEvaluation e{"slsqp", VectorXd::Constant(2, 0.1), DesignStatus::Feasible, 0.75, 1.5, {}, {}, {0.5, 2}, {3}};
  e.terms.push_back({VectorXd::Constant(2, 0.3), MatrixXd::Constant(2, 2, 0.7)});
  const std::string line = formatEvaluation(e);
  CHECK(formatEvaluation(readEvaluation(line)) == line);
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{{"0.75", "null"},
                                                                                 {"0.75", "NaN"},
                                                                                 {"0.75", "1e999"},
                                                                                 {"[0.7,0.7]", "[0.7]"},
                                                                                 {"[0.7,0.7]", "[0.7,null]"},
                                                                                 {"[[0.7,0.7],", "["},
                                                                                 {"[0.5,2.0]", "[0.5,null]"},
                                                                                 {"[3.0]", "[null]"},
                                                                                 {"feasible", "perfect"},
                                                                                 {"\"value\"", "\"worth\""},
                                                                                 {"}", ""}})
    CHECK_THROWS(readEvaluation(replaceOnce(line, from, to)));
}

namespace {

const char* const kCrankSpec = R"(robot: ROBOT
variables:
  - name: crank
    bounds: [0.03, 0.08]
    length:
      - {from: motor_knee_right, to: transmission_knee_right, across: [0, 0, 1], stretch: knee_crank_right}
      - {from: motor_knee_left, to: transmission_knee_left, across: [0, 0, 1], stretch: knee_crank_left}
  - name: motor
    bounds: [-0.01, 0.01]
    shift: [{of: motor_knee_right, along: [1, 0, 0]}, {of: motor_knee_left, along: [1, 0, 0]}]
motions:
  - {motion: squat, set: {depth: 0.95, duration: 0.6, settle: 0.06, time_step: 0.03}}
objective:
  - {measure: peak_torque, motors: [motor_knee_left, motor_knee_right]}
search:
  searches: 2
  stages:
    - {algorithm: crs, evaluations: 40}
    - {algorithm: sbplx, evaluations: 10}
)";

std::string makeCrankSpec(const std::string& robot = kRobots + "bipetto") {
  return replaceOnce(kCrankSpec, "ROBOT", robot);
}

// Bipetto, whose reference also gives the angles of the knees' motors, which depend on the length of the crank.
std::string writeBipettoWithMotors(const RobotDirectory& directory) {
  const Model model = loadRobot(kRobots + "bipetto").model;
  const AssemblyResult standing = assembleReference(model, "half_sitting");
  std::string yaml = readFile(kRobots + "bipetto/bipetto.yaml");
  for (const std::string side : {"left", "right"}) {
    const std::string knee = "      knee_" + side + ":", motor = "motor_knee_" + side;
    const double angle = standing.q[model.joints()[model.findJoint(motor)].idx_q];
    yaml = replaceOnce(yaml, knee, "      " + motor + ": " + std::to_string(angle) + "\n" + knee);
  }
  directory.write("driven/driven.yaml", yaml);
  directory.write("driven/driven.urdf", readFile(kRobots + "bipetto/bipetto.urdf"));
  return directory.path() + "/driven";
}

}  // namespace

TEST_CASE("design: a search that is killed goes on and ends the same way", "[long]") {
  const RobotDirectory directory;
  const std::string robot = writeBipettoWithMotors(directory);
  const std::string spec = directory.write("spec.yaml", makeCrankSpec(robot));
  const std::string whole = directory.path() + "/whole", killed = directory.path() + "/killed";
  const CommandResult first = runCommand({BIELLE_COMMAND, "design", spec, "-o", whole, "--jobs", "1"});
  INFO(first.err);
  REQUIRE(first.status == 0);
  CHECK_THAT(first.out, Contains("infeasible"));

  {
    Command command({BIELLE_COMMAND, "design", spec, "-o", killed});
    REQUIRE(command.waitForOutput("evaluation 20", 120));
    command.sendSignal(9);
    CHECK(command.wait().status == 128 + 9);
  }
  const std::string log = killed + "/search1.jsonl";
  CHECK_FALSE(fs::exists(killed + "/design.md"));
  const int done = countLines(log) - 1;
  CHECK(done > 0);
  CHECK(done < 50);
  std::ofstream(log, std::ios::app) << "{\"stage\": \"cr";                    // a line that was not finished
  for (const char* file : {"design.md", "best/best.urdf", "best/best.yaml"})  // as if it was killed while it wrote
    directory.write(std::string("killed/") + file + ".part99999999", "half");
  const CommandResult second = runCommand({BIELLE_COMMAND, "design", spec, "-o", killed});
  INFO(second.err);
  REQUIRE(second.status == 0);
  CHECK_THAT(second.out, !Contains(", 0 of them from the logs"));
  for (const char* file :
       {"/design.md", "/best/best.urdf", "/best/best.yaml", "/design_mechanism.svg", "/design.html"}) {
    CAPTURE(file);
    CHECK_FALSE(readFile(whole + file).empty());
    CHECK(readFile(whole + file) == readFile(killed + file));
  }
  const bool is_drawn = fs::exists(whole + "/design.svg");  // where there is gnuplot
  for (const char* figure : {"/design.svg", "/design_squat.svg"}) {
    CAPTURE(figure);
    CHECK(fs::exists(whole + figure) == is_drawn);
    CHECK(readFile(whole + figure) == readFile(killed + figure));
    if (is_drawn) CHECK_THAT(readFile(whole + figure), Contains("before") || Contains("best of search 2"));
  }
  CHECK(countLines(log) == countLines(whole + "/search1.jsonl"));
  for (const auto& entry : fs::recursive_directory_iterator(killed))
    CHECK_THAT(entry.path().string(), !Contains(".part"));

  // The design is a robot, better than the start.
  const std::string page = readFile(whole + "/design.md"), row = "| value | 1 | ";
  REQUIRE_THAT(page, Contains(row));
  CHECK(std::strtod(page.c_str() + page.find(row) + row.size(), nullptr) < 1);
  CHECK_NOTHROW(loadRobot(whole + "/best"));
  const CommandResult info = runCommand({BIELLE_COMMAND, "info", whole + "/best"});
  CHECK(info.status == 0);
  CHECK(info.err.empty());  // its reference has the angles of its own linkages

  // The log of another problem is refused.
  directory.write("spec.yaml", replaceOnce(makeCrankSpec(robot), "evaluations: 40", "evaluations: 41"));
  const CommandResult other = runCommand({BIELLE_COMMAND, "design", spec, "-o", killed});
  CHECK(other.status == 2);
  CHECK_THAT(other.err, Contains("the log is of another design problem"));
}

TEST_CASE("design: errors are reported with their places and remedies") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string spec = directory.write("spec.yaml", replaceOnce(makeCrankSpec(), from, to));
    const CommandResult result = runCommand({BIELLE_COMMAND, "design", spec, "-o", directory.path() + "/out"});
    CAPTURE(to, result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains(problem));
    CHECK_FALSE(fs::exists(directory.path() + "/out"));
  };
  check("[0.03, 0.08]", "[0.08, 0.03]", "wrong order");
  check("[0.03, 0.08]", "[0.06, 0.08]", "outside its bounds");
  check("[0.03, 0.08]", "[0.03]", "give 2");
  check("to: transmission_knee_right", "to: transmission", "there is no such joint or frame");
  check("from: motor_knee_right", "from: knee_left", "not to 'knee_crank_right'");
  check("stretch: knee_crank_right", "stretch: crank", "there is no such body");
  check("- name: motor\n", "- name: crank\n", "given twice");
  check("motions:\n", "  - {name: x, bounds: [-1, 1], shift: {of: motor_knee_left, along: [-1, 0, 0]}}\nmotions:\n",
        "variables 'motor' and 'x': both set the place of 'motor_knee_left' along [1, 0, 0]");
  check("[0.03, 0.08]", "[-5, 0.08]", "zero, or would become zero");
  check("motion: squat", "motion: dance", "there is no such motion");
  check("depth: 0.95", "dept: 0.95", "dept");
  check("measure: peak_torque", "measure: peak", "use one of peak_torque, rms_torque");
  check("motors: [motor_knee_left", "motors: [motor_knee", "there is no motor 'motor_knee'; known are ");
  check("algorithm: crs", "algorithm: newton", "use one of crs");
  check("objective:", "objectiv:", "it is unknown");
  check("depth: 0.95", "depth: 0.05", "start design");
  CHECK_THROWS_AS(readDesignSpec(directory.path() + "/none.yaml"), InputError);
  DesignVariable unknown;
  unknown.name = "x", unknown.parameter = "no_such", unknown.lower = 0, unknown.upper = 1;
  CHECK_THROWS_WITH(Parametrization("cleobot", {}, {unknown}), Contains("no_such"));
}
