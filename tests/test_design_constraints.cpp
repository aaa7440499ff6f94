// Constraints on designs, and weights and payloads of motions: their gradients against central differences of measures
// over designs that are made and solved separately; robots that carry the same mass in their own files; what is refused.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "design/run.h"
#include "design_trials.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

namespace {

// A four-bar knee with motors of the catalogue, and what it is bounded by. Gears change limits and losses, lengths the rest.
const char* const kBounded = R"(generator: leg_biped
set: {knee: four_bar, knee_crank: 0.042, knee_middle: 1.26}
variables:
  - {name: crank, parameter: knee_crank, bounds: [0.035, 0.065]}
  - {name: middle, parameter: knee_middle, unit: rad, bounds: [1, 1.6]}
  - {name: motor, motor: "*knee*", choices: [ak80-9, ak10-9], mass: knee_motor_mass, start: ak10-9}
  - {name: gear, ratio: "*knee*", bounds: [9, 18], start: 12}
motions:
  - {motion: squat, set: {depth: 0.9, duration: 0.8, settle: 0.1, time_step: 0.02}}
mode: MODE
objective:
  - {measure: electrical_energy, motors: ["*knee*"]}
  - {measure: mass}
constraints:
  - {measure: envelope, motors: ["*knee*"], at_most: 0.2}
  - {measure: heat, motors: ["*knee*"], at_most: 0.3}
  - {measure: mass, at_most: 26}
  - {measure: rms_torque, motors: ["*knee*"], at_most: 12}
  - {measure: electrical_energy, motors: ["*knee*"], at_most: 30}
  - {measure: margin, at_least: 0.2}
search: {searches: 1, stages: [{algorithm: slsqp, evaluations: 12}]}
)";

// The measure of a constraint as its pieces have it, g <= 0.
double calcLimit(const DesignConstraint& constraint, double measure) {
  const double b = constraint.bound;
  if (constraint.measure == Measure::Margin) return (square(b) - square(measure)) / (2 * square(b));
  return (measure - b) / b;
}

// For each constraint the largest of its pieces: its gradient, by the continuous variables.
MatrixXd pickActive(const DesignEvaluator& evaluator, const SlopedEvaluation& here, const VectorXd& x) {
  const std::vector<Eigen::Index> continuous = evaluator.robot().listContinuous();
  const auto count = static_cast<Eigen::Index>(evaluator.constraints().size());
  MatrixXd out(count, static_cast<Eigen::Index>(continuous.size()));
  for (Eigen::Index i = 0; i < count; ++i) {
    const DesignConstraint& constraint = evaluator.constraints()[static_cast<size_t>(i)];
    const double expected = calcLimit(constraint, here.evaluation.constraints[static_cast<size_t>(i)]);
    Eigen::Index active = 0;
    const double distance = (here.limits.values.array() - expected).abs().minCoeff(&active);
    CAPTURE(getName(constraint.measure), expected, here.limits.values[active], x);
    CHECK(distance < 1e-3);  // half of the slack at most
    out.row(i) = here.limits.gradients(active, continuous);
  }
  return out;
}

EvaluationOptions makeExactOptions(MotionMode mode, const std::vector<DesignConstraint>& constraints = {}) {
  EvaluationOptions options;
  options.mode = mode;
  options.solver.gradient_tolerance = 1e-13;
  options.solver.cost_tolerance = 0;
  options.constraints = constraints;
  return options;
}

// Gradients of all constraints and of the two objectives of kBounded, over the width of the bounds.
struct Slopes {
  MatrixXd analytic, numeric;  // rows: constraints, then objectives; columns: continuous variables
};

Slopes calcSlopes(const DesignEvaluator& evaluator) {
  const Parametrization& robot = evaluator.robot();
  const std::vector<Eigen::Index> continuous = robot.listContinuous();
  const auto constraints = static_cast<Eigen::Index>(evaluator.constraints().size()),
             columns = static_cast<Eigen::Index>(continuous.size());
  const VectorXd x = robot.start(), width = robot.upper() - robot.lower();
  const SlopedEvaluation here = evaluator.differentiate(x);
  REQUIRE((here.terms.size() == 2 && here.evaluation.constraints.size() == evaluator.constraints().size()));
  Slopes out{MatrixXd(constraints + 2, columns), MatrixXd(constraints + 2, columns)};
  out.analytic.topRows(constraints) = pickActive(evaluator, here, x);
  for (int term = 0; term < 2; ++term) out.analytic.row(constraints + term) = here.terms[term].gradients(0, continuous);
  for (Eigen::Index k = 0; k < columns; ++k) {
    // So small that few motors change the sign of their power in between, where the energy has a kink.
    const double step = 1e-4 * width[continuous[static_cast<size_t>(k)]];
    const VectorXd dx = step * VectorXd::Unit(x.size(), continuous[static_cast<size_t>(k)]);
    const Evaluation ahead = evaluator.evaluate(x + dx), behind = evaluator.evaluate(x - dx);
    REQUIRE(ahead.constraints.size() == evaluator.constraints().size());
    REQUIRE(behind.constraints.size() == evaluator.constraints().size());
    for (Eigen::Index i = 0; i < constraints; ++i) {
      const auto c = static_cast<size_t>(i);
      out.numeric(i, k) = (calcLimit(evaluator.constraints()[c], ahead.constraints[c]) -
                           calcLimit(evaluator.constraints()[c], behind.constraints[c])) /
                          (2 * step);
    }
    for (size_t term = 0; term < 2; ++term)
      out.numeric(constraints + static_cast<Eigen::Index>(term), k) =
          (ahead.terms[term] - behind.terms[term]) / (2 * step * evaluator.start().terms[term]);
  }
  out.analytic *= width(continuous).asDiagonal();
  out.numeric *= width(continuous).asDiagonal();
  return out;
}

// What differences of second order and sweeps leave, and no more.
void checkSlopes(const Slopes& slopes, double tolerance) {
  INFO(slopes.analytic << "\n\n" << slopes.numeric);
  for (Eigen::Index i = 0; i < slopes.numeric.rows(); ++i) {
    const double size = slopes.numeric.row(i).cwiseAbs().maxCoeff();
    CAPTURE(i, size);
    CHECK(size > 1e-5);  // that of the mass
    CHECK((slopes.analytic.row(i) - slopes.numeric.row(i)).cwiseAbs().maxCoeff() < tolerance * size);
    for (Eigen::Index k = 0; k < slopes.numeric.cols(); ++k) {  // would an entry be missed?
      Eigen::RowVectorXd poisoned = slopes.analytic.row(i);
      poisoned[k] += 2 * tolerance * size;
      CHECK((poisoned - slopes.numeric.row(i)).cwiseAbs().maxCoeff() >= tolerance * size);
    }
  }
}

double getTolerance(MotionMode mode) { return mode == MotionMode::Kept ? 1e-4 : 5e-3; }

}  // namespace

TEST_CASE("design constraints: gradients, of motions kept and made anew, against differences of their measures") {
  const RobotDirectory directory;
  for (const MotionMode mode : {MotionMode::Kept, MotionMode::Reoptimized}) {
    CAPTURE(getName(mode));
    const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", replaceOnce(kBounded, "MODE", getName(mode))));
    const Parametrization robot = makeParametrization(spec);
    REQUIRE(robot.listContinuous().size() == 3);
    const DesignEvaluator evaluator(robot, {makeSquat(0.7)}, spec.objective, makeExactOptions(mode, spec.constraints));
    const Slopes slopes = calcSlopes(evaluator);
    checkSlopes(slopes, getTolerance(mode));
    CHECK(std::abs(slopes.analytic(5, 0)) > 0.01);  // the margin feels the crank, limits and losses the gear
    for (const int row : {0, 1, 4, 6}) CHECK(std::abs(slopes.analytic(row, 2)) > 0.01);
  }
}

TEST_CASE("design constraints: gradients with weights and payloads of motions, against differences of their measures") {
  const RobotDirectory directory;
  // The trunk's mass moves its centre, where one of the payloads is.
  const std::string text =
      replaceOnce(kBounded, "motions:", "  - {name: trunk, parameter: trunk_mass, unit: kg, bounds: [5, 9]}\nmotions:");
  DesignMotion heavy = makeSquat(0.7), light = makeSquat(0.8);
  // No motor's power changes its sign at a node within the reach of the differences: what it gives back is lost, which is a kink.
  heavy.weight = 2, heavy.payload = {5, Vector3d(0.04, 0.02, 0.1)};
  light.weight = 0.5, light.payload = {3, {}};
  for (const MotionMode mode : {MotionMode::Kept, MotionMode::Reoptimized}) {
    CAPTURE(getName(mode));
    const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", replaceOnce(text, "MODE", getName(mode))));
    const Parametrization robot = makeParametrization(spec);
    const DesignEvaluator evaluator(robot, {heavy, light, heavy}, spec.objective,
                                    makeExactOptions(mode, spec.constraints));
    const Slopes slopes = calcSlopes(evaluator);
    REQUIRE(slopes.numeric.cols() == 4);
    checkSlopes(slopes, getTolerance(mode));
    // Each motion by itself: sums are weighted, in constraints too, and what holds for every motion is not.
    const auto evaluate = [&](DesignMotion motion) {
      motion.weight = 1;
      return DesignEvaluator(robot, {motion}, spec.objective, makeExactOptions(mode, spec.constraints)).start();
    };
    const Evaluation a = evaluate(heavy), b = evaluate(light), &all = evaluator.start();
    CHECK(all.terms[0] == Approx(4 * a.terms[0] + 0.5 * b.terms[0]).epsilon(1e-12));
    CHECK(all.constraints[4] == Approx(all.terms[0]).epsilon(1e-12));
    for (const size_t i : {0, 1, 3})
      CHECK(all.constraints[i] == Approx(std::max(a.constraints[i], b.constraints[i])).epsilon(1e-12));
    CHECK(all.constraints[5] == Approx(std::min(a.constraints[5], b.constraints[5])).epsilon(1e-12));
    CHECK((all.terms[1] == robot.startModel().mass() && all.constraints[2] == all.terms[1]));
  }
}

TEST_CASE("design constraints: gradients by the dimensions of a 3-RRS hip, whose closures have redundant rows") {
  const RobotDirectory directory;
  const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", R"(generator: leg_biped
set: {hip: three_rrs, knee: belt}
variables:
  - {name: middle, parameter: hip_middle, unit: rad, bounds: [-1.2, 0]}
  - {name: radius, parameter: hip_radius, bounds: [0.08, 0.12]}
motions: [{motion: walk}]
objective: [{measure: electrical_energy, motors: ["*hip*"]}, {measure: energy, motors: ["*hip1*", "*hip3*"]}]
constraints: [{measure: rms_torque, motors: ["*hip*"], at_most: 10}]
)"));
  const Parametrization robot = makeParametrization(spec);
  WalkOptions options;
  options.speed = 0.4, options.steps = 2;
  const DesignMotion walk = {"walk", [options](const Model& model, const StandingRobot& standing) {
                               return planWalk(model, options, standing);
                             }};
  for (const MotionMode mode : {MotionMode::Kept, MotionMode::Reoptimized}) {
    CAPTURE(getName(mode));
    checkSlopes(calcSlopes(DesignEvaluator(robot, {walk}, spec.objective, makeExactOptions(mode, spec.constraints))),
                getTolerance(mode));
  }
}

TEST_CASE("design constraints: a payload is a mass on the trunk of the robot's own file") {
  const RobotDirectory directory;
  const Parametrization knee = makeParametrization(readDesignSpec(kKnee));
  writeRobot(knee.startModel(), directory.path() + "/bare", "");
  const Model bare = loadRobot(directory.path() + "/bare").model;
  const auto read = [&](const std::string& name) { return readFile(directory.path() + "/bare/" + name); };
  const Body& trunk = bare.bodies()[1];
  const auto load = [&](const Vector3d& at) {
    std::ostringstream bag;
    bag.precision(17);
    bag << "<link name=\"bag\"><inertial><origin xyz=\"" << at.transpose() << "\"/><mass value=\"4\"/>"
        << "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>"
        << "<joint name=\"strap\" type=\"fixed\"><parent link=\"" << trunk.name << "\"/><child link=\"bag\"/></joint>";
    directory.writeRobot(replaceOnce(read("bare.urdf"), "</robot>", bag.str() + "</robot>"), read("bare.yaml"));
    return loadRobot(directory.path() + "/robot.urdf").model;
  };
  for (const std::optional<Vector3d>& at : {std::optional<Vector3d>(), std::optional<Vector3d>({0.1, -0.05, 0.2})})
    for (const MotionMode mode : {MotionMode::Kept, MotionMode::Reoptimized}) {
      CAPTURE(at.has_value(), getName(mode));
      const Parametrization own(load(at.value_or(trunk.inertia.com)), knee.variables()),
          carried(bare, knee.variables());
      CHECK(own.startModel().mass() == Approx(bare.mass() + 4));
      DesignMotion squat = makeSquat(0.9), loaded = squat;
      loaded.payload = {4, at};
      const std::vector<ObjectiveTerm> objective = {{Measure::PeakTorque, {}, 1}, {Measure::ElectricalEnergy, {}, 1}};
      const DesignEvaluator with_own(own, {squat}, objective, makeExactOptions(mode)),
          with_payload(carried, {loaded}, objective, makeExactOptions(mode)),
          without(carried, {squat}, objective, makeExactOptions(mode));
      const VectorXd x = own.start() + 0.1 * (own.upper() - own.start());
      const Evaluation a = with_own.evaluate(x), b = with_payload.evaluate(x), c = without.evaluate(x);
      REQUIRE((a.terms.size() == 2 && b.terms.size() == 2 && c.terms.size() == 2));
      for (size_t i = 0; i < 2; ++i) {
        CHECK(b.terms[i] == Approx(a.terms[i]).epsilon(1e-7));
        CHECK(b.terms[i] > 1.02 * c.terms[i]);  // it matters
      }
    }
}

namespace {

// Rods at the ankles in the plane of the motors on the shank, to which they come too near when the robot squats, the less so the longer the cranks.
const char* const kRods = R"(generator: leg_biped
set: {knee: four_bar, ankle: rsu, knee_crank: 0.04, ankle_housing: 0}
variables: [{name: crank, parameter: ankle_crank, bounds: [0.05, 0.07]}]
motions: [{motion: squat, set: {depth: 0.7, duration: 0.8, settle: 0.1, time_step: 0.02}}]
mode: MODE
objective: [{measure: electrical_energy, motors: ["*ankle*"]}]
constraints: [{measure: distance, at_least: 0.002, except: [["hip_yaw*", "crank_knee*"]]}]
search: {searches: 1, stages: [{algorithm: slsqp, evaluations: 8}]}
)";

}  // namespace

TEST_CASE("design constraints: distances leave out what overlaps as drawn, and rods are moved away from the leg") {
  const RobotDirectory directory;
  for (const MotionMode mode : {MotionMode::Kept, MotionMode::Reoptimized}) {
    CAPTURE(getName(mode));
    const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", replaceOnce(kRods, "MODE", getName(mode))));
    const Parametrization robot = makeParametrization(spec);
    const DesignEvaluator evaluator(robot, {makeSquat(0.7)}, spec.objective, makeExactOptions(mode, spec.constraints));
    const std::vector<std::string> left_out = evaluator.listLeftOut(robot.start());
    const auto is_left_out = [&](const std::string& pair) {
      return std::count(left_out.begin(), left_out.end(), pair) == 1;
    };
    for (const std::string side : {"_left", "_right"}) {
      CHECK(is_left_out("shank" + side + " and foot_link" + side));         // they overlap
      CHECK(is_left_out("hip_yaw" + side + " and crank_knee" + side));      // named
      CHECK_FALSE(is_left_out("shank" + side + " and rod_ankle1" + side));  // on its way
      CHECK_FALSE(is_left_out("hip_roll" + side + " and crank_knee" + side));
    }
    CHECK(evaluator.start().status == DesignStatus::Violated);
    CHECK_THAT(evaluator.start().message, Contains("distance is -0.00") && Contains("rod_ankle"));

    // Where cranks and arms are equal, as at the start, rods and shank are parallel, and the nearest points are not unique.
    const VectorXd x = VectorXd::Constant(1, 0.052);
    const SlopedEvaluation here = evaluator.differentiate(x);
    Eigen::Index active = 0;
    here.limits.values.maxCoeff(&active);
    const double step = 1e-3 * (robot.upper()[0] - robot.lower()[0]);
    const auto calc = [&](double at) { return evaluator.evaluate(VectorXd::Constant(1, at)).constraints.at(0); };
    const double numeric = -(calc(x[0] + step) - calc(x[0] - step)) / (2 * step * 0.01),
                 analytic = here.limits.gradients(active, 0), tolerance = getTolerance(mode) * std::abs(numeric);
    CAPTURE(numeric, analytic);
    CHECK(numeric < -50);  // longer cranks hold the rods off
    CHECK(std::abs(analytic - numeric) < tolerance);
    CHECK(std::abs(analytic + 2 * tolerance - numeric) >= tolerance);  // would an error be missed?

    DesignRunOptions run;
    run.directory = directory.path() + "/" + getName(mode);
    const DesignRun done = runDesign(evaluator, spec, run);
    REQUIRE(done.evaluation.status == DesignStatus::Feasible);
    CHECK(done.evaluation.constraints[0] > 0.002 - kConstraintSlack * 0.01);
    CHECK(done.best[0] > robot.start()[0] + 0.002);
  }
  const std::string path = directory.write("spec.yaml", replaceOnce(kRods, "MODE", "kept")),
                    out = directory.path() + "/out";
  const CommandResult result = runCommand({BIELLE_COMMAND, "design", path, "-o", out});
  INFO(result.err);
  REQUIRE(result.status == 0);
  const std::string page = readFile(out + "/design.md");
  CHECK_THAT(page, Contains("The distance ignores bodies") && Contains("shank_left and foot_link_left"));

  const auto check = [&](const std::string& from, const std::string& to, const std::string& problem) {
    const std::string wrong = directory.write("wrong.yaml", replaceOnce(replaceOnce(kRods, "MODE", "kept"), from, to));
    const auto make = [&] {
      const DesignSpec spec = readDesignSpec(wrong);
      const Parametrization robot = makeParametrization(spec);
      DesignEvaluator(robot, {makeSquat(0.9)}, spec.objective, makeExactOptions(MotionMode::Kept, spec.constraints));
    };
    CHECK_THROWS_WITH(make(), Contains(problem));
  };
  check("\"hip_yaw*\"", "\"hip_jaw*\"", "except [hip_jaw*, crank_knee*]: there are no two such bodies; `bielle info`");
  check("[\"hip_yaw*\", \"crank_knee*\"]", "[\"hip_yaw*\"]", "it has 1 element(s)");
  check("measure: distance, at_least: 0.002", "measure: margin, at_least: 0.2", "only distances can exclude bodies");
}

TEST_CASE("design constraints: weights and payloads that cannot be are refused with their lines") {
  const RobotDirectory directory;
  const auto check = [&](const std::string& keys, const std::string& problem) {
    const std::string text =
        replaceOnce(replaceOnce(kBounded, "MODE", "kept"), "{motion: squat,", "{motion: squat, " + keys + ",");
    const std::string path = directory.write("spec.yaml", text);
    CAPTURE(keys);
    CHECK_THROWS_WITH(readDesignSpec(path), Contains(problem) && Contains("spec.yaml") && Contains("line"));
  };
  check("weight: -1", "it is negative; give its share");
  check("weight: .nan", "it is not finite");
  check("weight: 0", "no motion has a weight");
  check("payload: -2", "it is negative; give the mass");
  check("payload_at: [0, 0, 0]", "there is no payload");
  check("payload: 2, payload_at: [0, 0]", "it has 2 element(s)");
  check("payload: 2, payload_place: 3", "payload_place");
  const Model delta = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/delta").model;
  CHECK_THROWS_WITH(addPayload(delta, {1, {}}), Contains("delta") && Contains("no trunk") && Contains("leave it out"));
  CHECK(addPayload(delta, {}).mass() == delta.mass());
  // Comparisons have no payloads.
  const std::string path = directory.write(
      "two.yaml", "robots: {a: {robot: bipetto}}\nmotions:\n  - {motion: squat, payload: 3, set: {depth: 0.8}}\n");
  const CommandResult result = runCommand({BIELLE_COMMAND, "compare", path, "-o", directory.path() + "/two"});
  CHECK(result.status == 2);
  CHECK_THAT(result.err, Contains("payload"));
}

TEST_CASE("design constraints: distances of shapes, of motions kept and made anew") {
  // Balls on all bodies, large ones on the crank of a knee and on the trunk.
  ModelParts parts = takeParts(makeParametrization(readDesignSpec(kKnee)).startModel());
  const auto find = [&](const std::string& name) {
    const auto found =
        std::find_if(parts.bodies.begin(), parts.bodies.end(), [&](const Body& body) { return body.name == name; });
    REQUIRE(found != parts.bodies.end());
    return static_cast<int>(found - parts.bodies.begin());
  };
  parts.shapes.clear();
  parts.visuals.clear();  // or shapes would be fitted to them
  for (int body = 1; body < static_cast<int>(parts.bodies.size());
       ++body) {  // bodies without shapes count as parts of others
    const bool crank = body == find("knee_crank_left"), large = crank || body == 1;
    Shape shape;
    shape.body = body, shape.radius = large ? 0.03 : 1e-4;
    shape.X_BS.p = crank ? Vector3d(0.05, 0, 0) : Vector3d::Zero().eval();
    parts.shapes.push_back(shape);
  }
  const Parametrization all = makeParametrization(readDesignSpec(kKnee));
  const Parametrization robot(ModelBuilder::restore(parts), {all.variables()[0], all.variables()[4]});
  for (const MotionMode mode : {MotionMode::Kept, MotionMode::Reoptimized}) {
    EvaluationOptions options;
    options.mode = mode;
    options.solver.gradient_tolerance = 1e-13;
    options.solver.cost_tolerance = 0;
    options.constraints = {{Measure::Distance, {}, 0.02, true}};
    const DesignEvaluator evaluator(robot, {makeSquat(0.9)}, {{Measure::RmsTorque, {}, 1}}, options);
    const VectorXd x = robot.start();
    const SlopedEvaluation here = evaluator.differentiate(x);
    const double measure = here.evaluation.constraints.at(0);
    REQUIRE(std::isfinite(measure));
    Eigen::Index active = 0;
    CHECK((here.limits.values.array() - (0.02 - measure) / 0.01).abs().minCoeff(&active) < 1e-9);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const double step = 1e-3 * (robot.upper()[i] - robot.lower()[i]);
      const VectorXd dx = step * VectorXd::Unit(2, i);
      const double numeric =
          -(evaluator.evaluate(x + dx).constraints.at(0) - evaluator.evaluate(x - dx).constraints.at(0)) /
          (2 * step * 0.01);
      CAPTURE(getName(mode), i, measure, numeric, here.limits.gradients(active, i));
      CHECK(std::abs(numeric) > 0.1);
      CHECK(here.limits.gradients(active, i) == Approx(numeric).epsilon(mode == MotionMode::Kept ? 1e-4 : 5e-3));
    }
  }
}

TEST_CASE("design constraints: a search ends on the bound of a constraint that stands in its way") {
  const RobotDirectory directory;
  for (const std::string mode : {"kept", "reoptimized"})
    for (const std::string algorithm : {"slsqp", "mma"}) {
      CAPTURE(algorithm, mode);
      if (algorithm == "mma" && mode == "reoptimized")
        continue;  // it takes more steps, of which these are the dear ones
      std::string text = replaceOnce(kBounded, "MODE", mode);
      const size_t constraints = text.find("  - {measure: envelope"), search = text.find("search:");
      text.replace(constraints, search - constraints,
                   "  - {measure: mass, at_most: 26.8}\n  - {measure: margin, at_least: 0.27}\n");
      text = replaceOnce(text, "  - {measure: mass}\n", "");
      text = replaceOnce(text, "depth: 0.9", "depth: 0.7");
      text = replaceOnce(
          text, "slsqp, evaluations: 12",
          algorithm + (algorithm == "mma" ? ", evaluations: 60" : ", evaluations: 20") + ", tolerance: 1e-5");
      text = replaceOnce(text, "[ak80-9, ak10-9], mass: knee_motor_mass, start: ak10-9", "[ak10-9]");
      const DesignSpec spec = readDesignSpec(directory.write("spec.yaml", text));
      const Parametrization robot = makeParametrization(spec);
      EvaluationOptions options;
      options.mode = spec.mode;
      options.constraints = spec.constraints;
      const DesignEvaluator evaluator(robot, {makeSquat(0.7)}, spec.objective, options);
      DesignRunOptions run;
      run.directory = directory.path() + "/" + algorithm + mode;
      const DesignRun done = runDesign(evaluator, spec, run);
      REQUIRE(done.evaluation.status == DesignStatus::Feasible);
      CHECK(done.value < 0.9);
      const double margin = done.evaluation.constraints[1];
      CAPTURE(done.best.transpose(), done.value, done.evaluation.constraints[0], margin);
      CHECK(margin == Approx(0.27).epsilon(algorithm == "mma" ? 1e-2 : 2e-3));
      CHECK(margin > 0.27 * (1 - kConstraintSlack));
    }
}
