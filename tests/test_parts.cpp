// Robots composed of parts: every part against a closed form of its linkage, derivatives by parameters, mirror images, and what is
// wrong with a file.
#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "bielle/design/parametrization.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/generate.h"
#include "check_derivative.h"
#include "formats/expressions.h"
#include "leg_biped.h"
#include "model/listing.h"
#include "robot_directory.h"
#include "robots/generator_entry.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Contains;

namespace {

double& getCoordinate(const Model& model, VectorXd& q, const std::string& joint) {
  return q[model.joints()[static_cast<size_t>(model.findJoint(joint))].idx_q];
}

// The closed configuration near half_sitting with these angles.
VectorXd closeAt(const Model& model, const std::vector<std::pair<std::string, double>>& angles) {
  VectorXd q = assembleReference(model, "half_sitting").q;
  const VectorXd start = q;
  for (int step = 1; step <= 10; ++step) {
    for (const auto& [joint, angle] : angles) {
      VectorXd from = start;
      getCoordinate(model, q, joint) = getCoordinate(model, from, joint) * (1 - 0.1 * step) + 0.1 * step * angle;
    }
    const AssemblyResult closed = closeConfiguration(model, q);
    REQUIRE(closed.status == NumericalStatus::Ok);
    q = closed.q;
  }
  return q;
}

// Where two circles about a and b meet; the side to the left of the way from a to b, if it is positive.
Eigen::Vector2d intersect(const Eigen::Vector2d& a, double ra, const Eigen::Vector2d& b, double rb, double side) {
  const Eigen::Vector2d w = b - a;
  const double l = w.norm(), h = (l * l + ra * ra - rb * rb) / (2 * l), s = std::sqrt(ra * ra - h * h);
  return a + h * w / l + side * s / l * Eigen::Vector2d(-w.y(), w.x());
}

// Turned about y: x and z of a point of the plane.
Eigen::Vector2d turn(double angle, const Eigen::Vector2d& p) {
  return {std::cos(angle) * p.x() + std::sin(angle) * p.y(), -std::sin(angle) * p.x() + std::cos(angle) * p.y()};
}

Vector3d locate(const Model& model, const VectorXd& q, const std::string& frame, const std::string& base) {
  Workspace ws(model);
  updatePlacements(model, ws, q);
  const auto place = [&](const std::string& name) {
    for (const Frame& f : model.frames())
      if (f.name == name) return ws.X_WB[static_cast<size_t>(f.body)] * f.X_BF;
    for (int i = 0; i < model.numBodies(); ++i)
      if (model.bodies()[static_cast<size_t>(i)].name == name) return ws.X_WB[static_cast<size_t>(i)];
    FAIL("no frame " << name);
    return SE3();
  };
  return (place(base).inverse() * place(frame)).p;
}

// Crank and slider, drawn stretched.
const char* const kSlider =
    R"(parameters: {crank: {value: 0.1, unit: m, bounds: [0.05, 0.2], help: length of the crank}}
let: {rod: 3*crank}
base: fixed
tree:
  slide: {parent: world, joint: slide, type: prismatic, axis: x, place: [rod + crank, 0, 0], range: [-1, 1],
          solids: [{box: [0.1, 0.1, 0.1], material: steel}]}
linkage:
  base: world
  density: 1
  points: {pivot: [0, 0], end: [crank, 0], pin: [crank + rod, 0]}
  fixed: {world: [pivot], slide: [pin]}
  bars: {crank: [pivot, end], rod: [end, pin]}
  hinges: {pivot: motor}
motors: {motor: {armature: 0.001}}
)";

// A pendulum.
const char* const kRodPart = R"(mounts: {base: link}
points: [at]
parameters:
  length: {unit: m}
  density: {unit: kg/m}
  radius: {value: 0.01, unit: m, bounds: [0.001, 0.1], help: radius}
requires: [{that: length > 0, problem: the rod has no length, remedy: make it longer}]
tree:
  rod_{part}: {parent: base, joint: "swing_{part}", place: at, axis: y,
               solids: [{rod: [origin, -length*z], radius: radius, density: density}]}
)";

// Two double pendula, mirrored.
const char* const kRobotOfRods = R"(parameters:
  span: {value: 0.5, unit: m, bounds: [0.1, 1], help: length}
  density: {value: 2, unit: kg/m, bounds: [1, 10], help: mass per length}
tree:
  upper: {part: rod, prefix: upper_, sides: [_left, _right], mounts: {base: world}, set: {at: 0.2*y, length: span}}
  lower: {part: rod, prefix: lower_, sides: [_left, _right], mounts: {base: "rod_upper{side}"}, set: {at: -span*z, length: span/2}}
)";

VectorXd closeAngle(const Model& slider, double angle) {
  VectorXd q = slider.makeNeutral();
  for (int step = 1; step <= 20; ++step) {
    getCoordinate(slider, q, "motor") = angle * step / 20;
    q = closeConfiguration(slider, q).q;
  }
  return q;
}

// A part with what it needs.
OptionValues chooseParts(const std::string& joint, const std::string& part) {
  if (part == "passive" || part == "cable_differential")
    return {{"knee", std::string("passive")}, {"ankle", std::string("cable_differential")}};
  return {{joint, part}};
}

const double kThigh = 0.22, kShank = 0.24, kMiddle = 1.2;
const std::vector<double> kKnees = {0.5, 0.9, 1.2, 1.6};

}  // namespace

TEST_CASE("parts: every one of the biped stands, closes and moves in as many ways as it has motors and springs") {
  const Generator generator = findGenerator("leg_biped");
  for (const char* joint : {"hip", "knee", "ankle"})
    for (const std::string& part : generator.parameters.get(joint).choices) {
      CAPTURE(joint, part);
      const Model model = makeLegBiped(chooseParts(joint, part));
      const AssemblyResult standing = assembleReference(model, "half_sitting");
      REQUIRE(standing.status == NumericalStatus::Ok);
      CHECK(model.nu() == 12);
      CHECK(calcMobility(model, standing.q).mobility == (part == "leaf" ? 20 : 18));
      // The right leg is the mirror image of the left one.
      Workspace ws(model);
      updatePlacements(model, ws, standing.q);
      for (int i = 1; i < model.numBodies(); ++i) {
        const std::string name = model.bodies()[static_cast<size_t>(i)].name;
        const size_t at = name.find("_left");
        if (at == std::string::npos) continue;
        const std::string mirrored = name.substr(0, at) + "_right" + name.substr(at + 5);
        int other = 1;
        while (model.bodies()[static_cast<size_t>(other)].name != mirrored) ++other;
        const auto place = [&](int body) {
          const SE3& X = ws.X_WB[static_cast<size_t>(body)];
          return Vector3d(X.p + X.R * model.bodies()[static_cast<size_t>(body)].inertia.com);
        };
        CAPTURE(name);
        CHECK((place(i) - Vector3d(1, -1, 1).cwiseProduct(place(other))).norm() < 1e-9);
      }
    }
}

TEST_CASE("parts: a linkage in any plane, drawn at an angle, has a mirror image that moves as it does") {
  const std::string wing = R"(mounts: {base: link}
tree:
  wing: {parent: base, joint: flap, place: [0.02, 0.1, 0.03], axis: AXIS, range: [-2, 2],
         solids: [{rod: [origin, [0.1, 0.2, 0.1]], radius: 0.01, mass: 0.5}]}
linkage:
  base: base
  normal: NORMAL
  through: [0.02, 0.1, 0.03]
  density: 1
  points: {motor: [0.0, 0.15], crank: [0.04, 0.15], arm: [0.05, 0.02]}
  fixed: {base: [motor], wing: {points: [arm], angles: {flap: 0.3}}}
  bars: {crank: {points: [motor, crank], radius: 0.005}, rod: [crank, arm]}
  hinges: {motor: motor_flap}
motors: {motor_flap: {armature: 0.001}}
)";
  const std::string bird = R"(base: fixed
tree:
  body: {parent: world, joint: fix, type: fixed, solids: [{box: [0.1, 0.1, 0.1], mass: 1}]}
  w: {part: wing.yaml, sides: [_left, _right], mounts: {base: body}}
)";
  for (const char* normal : {"x", "y", "z"}) {
    CAPTURE(normal);
    const RobotDirectory files;
    std::string text = replaceOnce(replaceOnce(wing, "AXIS", normal), "NORMAL", normal);
    if (*normal == 'y') text = replaceOnce(text, "motor: [0.0,", "motor: [-0.01,");
    files.write("bird/wing.yaml", text);
    const Model model = loadRobot(files.write("bird/bird.yaml", bird)).model;
    const double sign = *normal == 'y' ? 1 : -1;
    for (const double angle : {0.3, 0.1, -0.1}) {
      CAPTURE(angle);
      AssemblyProblem problem;
      problem.q_ref = findClosedConfiguration(model).q;
      problem.weights = VectorXd::Constant(model.nv(), 1e-6);
      for (const char* flap : {"flap_left", "flap_right"}) {
        getCoordinate(model, problem.q_ref, flap) = flap == std::string("flap_left") ? angle : sign * angle;
        problem.weights[model.joints()[model.findJoint(flap)].idx_v] = 1;
      }
      VectorXd q = assemble(model, problem).q;
      REQUIRE(getCoordinate(model, q, "flap_left") == Approx(angle));
      REQUIRE(getCoordinate(model, q, "flap_right") == Approx(sign * angle));
      CHECK(getCoordinate(model, q, "motor_flap_right") ==
            Approx(sign * getCoordinate(model, q, "motor_flap_left")).margin(1e-9));
      Workspace ws(model);
      updatePlacements(model, ws, q);
      for (const char* body : {"wing", "crank", "rod"}) {
        const auto place = [&](const std::string& side) {
          size_t i = 0;
          while (model.bodies()[i].name != body + side) ++i;
          return Vector3d(ws.X_WB[i].act(model.bodies()[i].inertia.com));
        };
        CHECK((place("_left") - Vector3d(1, -1, 1).cwiseProduct(place("_right"))).norm() < 1e-9);
      }
      if (angle == 0.3) CHECK(std::abs(getCoordinate(model, q, "motor_flap_left")) < 1e-7);  // as drawn
    }
  }
}

TEST_CASE("parts: a linkage of a slide that is drawn off its zero, in every plane and mirrored") {
  const std::string car = R"(mounts: {base: link}
tree:
  car: {parent: base, joint: slide, type: prismatic, place: [0.02, 0.1, 0.03], axis: AXIS, range: [-0.2, 0.2],
        solids: [{box: [0.05, 0.04, 0.03], at: [0.01, 0.02, 0.03], mass: 0.5}]}
linkage:
  base: base
  normal: NORMAL
  through: [0.02, 0.1, 0.03]
  density: 1
  points: {motor: MOTOR, crank: CRANK, arm: ARM}
  fixed: {base: [motor], car: {points: [arm], angles: {slide: 0.03}}}
  bars: {crank: {points: [motor, crank], radius: 0.005}, rod: [crank, arm]}
  hinges: {motor: motor_slide}
motors: {motor_slide: {armature: 0.001}}
)";
  const std::string cart = R"(base: fixed
tree:
  body: {parent: world, joint: fix, type: fixed, solids: [{box: [0.1, 0.1, 0.1], mass: 1}]}
  c: {part: car.yaml, sides: [_left, _right], mounts: {base: body}}
)";
  const std::string axes = "xyz";
  for (const char normal : axes)
    for (const char axis : axes) {
      if (axis == normal) continue;
      CAPTURE(normal, axis);
      // Coordinates of the plane are the other axes in their order; the rod holds the middle of the car.
      const bool is_first = axes.find(axis) == (normal == 'x' ? 1u : 0u);
      std::string text = replaceOnce(replaceOnce(car, "AXIS", {axis}), "NORMAL", {normal});
      text = replaceOnce(text, "ARM", is_first ? "[0.03, 0]" : "[0, 0.03]");
      text = replaceOnce(text, "CRANK", is_first ? "[-0.1, 0.05]" : "[0.05, -0.1]");
      text = replaceOnce(text, "MOTOR", is_first ? "[-0.15, 0.02]" : "[0.02, -0.15]");
      const RobotDirectory files;
      files.write("cart/car.yaml", text);
      const Model model = loadRobot(files.write("cart/cart.yaml", cart)).model;
      const double sign = axis == 'y' ? -1 : 1, spin = normal == 'y' ? 1 : -1;
      for (const double way : {0.03, 0.02}) {
        VectorXd q = findClosedConfiguration(model).q;
        getCoordinate(model, q, "slide_left") = way;
        getCoordinate(model, q, "slide_right") = sign * way;
        const AssemblyResult closed = closeConfiguration(model, q, {"slide_left", "slide_right"});
        REQUIRE(closed.status == NumericalStatus::Ok);
        q = closed.q;
        const double motor = getCoordinate(model, q, "motor_slide_left");
        CHECK(getCoordinate(model, q, "motor_slide_right") == Approx(spin * motor).margin(1e-9));
        CHECK((std::abs(motor) < 1e-9) == (way == 0.03));  // as drawn
        Workspace ws(model);
        updatePlacements(model, ws, q);
        for (const char* body : {"car", "crank", "rod"}) {
          const auto place = [&](const std::string& side) {
            size_t i = 0;
            while (model.bodies()[i].name != body + side) ++i;
            return Vector3d(ws.X_WB[i].act(model.bodies()[i].inertia.com));
          };
          CHECK((place("_left") - Vector3d(1, -1, 1).cwiseProduct(place("_right"))).norm() < 1e-9);
        }
      }
    }
}

TEST_CASE("parts: six-bars by circles that meet") {
  const Eigen::Vector2d hip(0, 0), knee(0, -kThigh);
  const Model watt = makeLegBiped({{"knee", "watt"}});
  const Eigen::Vector2d bell(0, -0.11), out = 0.04 * Eigen::Vector2d(-std::cos(0.3), -std::sin(0.3));
  const double second = ((bell + out) - (knee + Eigen::Vector2d(-0.05, 0))).norm();
  const Model stephenson = makeLegBiped({{"knee", "stephenson"}});
  double least = 9, most = 0;  // angles of the knee that were tried
  for (const double angle : kKnees) {
    CAPTURE(angle);
    // Watt: from the arm to the bell crank, from that to the crank, which is as long as its arm: both turn as far.
    VectorXd q = closeAt(watt, {{"knee_left", angle}, {"knee_right", angle}});
    const double at = getCoordinate(watt, q, "knee_left");
    least = std::min(least, at), most = std::max(most, at);
    const Eigen::Vector2d moved = knee + turn(at - kMiddle, {-0.05, 0});
    const Eigen::Vector2d place = intersect(bell, 0.04, moved, second, -1) - bell;
    const double expected = std::atan2(out.y(), out.x()) - std::atan2(place.y(), place.x());
    CHECK(getCoordinate(watt, q, "motor_knee_left") == Approx(std::remainder(expected, 2 * M_PI)).margin(1e-8));

    // Stephenson: with the crank's angle as it came out, the coupler's pivots are where circles meet, and the rod has its length.
    q = closeAt(stephenson, {{"knee_left", angle}, {"knee_right", angle}});
    const Eigen::Vector2d b = turn(getCoordinate(stephenson, q, "motor_knee_left"), {-0.05, 0}), d(0.013, -0.089);
    const Eigen::Vector2d b0(-0.05, 0), c0 = d - 0.053 * Eigen::Vector2d(std::cos(0.03), std::sin(0.03)),
                                        e0 = c0 - Eigen::Vector2d(0.006, 0.041);
    const Eigen::Vector2d c = intersect(d, 0.053, b, (c0 - b0).norm(), 1);
    const double tilt = std::atan2((c - b).y(), (c - b).x()) - std::atan2((c0 - b0).y(), (c0 - b0).x());
    const Eigen::Vector2d e = b + turn(-tilt, e0 - b0);
    const Eigen::Vector2d f = knee + turn(getCoordinate(stephenson, q, "knee_left") - kMiddle, {-0.05, 0});
    CHECK((f - e).norm() == Approx((knee + Eigen::Vector2d(-0.05, 0) - e0).norm()).epsilon(1e-8));
  }
  CHECK(most - least > 0.4);
}

TEST_CASE("parts: parallelograms, screws, leaves and rods by their closed forms") {
  const Model pantograph = makeLegBiped({{"knee", "pantograph"}}), screw = makeLegBiped({{"knee", "ball_screw"}}),
              leaf = makeLegBiped({{"knee", "leaf"}}), idlers = makeLegBiped({{"ankle", "thigh_rods"}}),
              strut = makeLegBiped({{"ankle", "spu"}}), across = makeLegBiped({{"ankle", "biarticular"}});
  for (const double angle : kKnees) {
    CAPTURE(angle);
    const std::vector<std::pair<std::string, double>> bent = {{"knee_left", angle}, {"ankley_left", -0.6 * angle}};
    VectorXd q = closeAt(pantograph, bent);
    CHECK(getCoordinate(pantograph, q, "motor_knee_left") ==
          Approx(getCoordinate(pantograph, q, "hipy_left") + getCoordinate(pantograph, q, "knee_left") - kMiddle)
              .margin(1e-8));
    // The law of cosines between the hinge of the screw and its arm.
    q = closeAt(screw, bent);
    const Eigen::Vector2d hinge(-0.04, -0.03), knee(0, -kThigh);
    const auto calcLength = [&](double at) { return (knee + turn(at - kMiddle, {-0.05, 0}) - hinge).norm(); };
    CHECK(-getCoordinate(screw, q, "motor_knee_left") ==
          Approx(calcLength(getCoordinate(screw, q, "knee_left")) - calcLength(kMiddle)).margin(1e-9));
    q = closeAt(leaf, bent);
    CHECK(getCoordinate(leaf, q, "motor_knee_left") + getCoordinate(leaf, q, "spring_knee_left") ==
          Approx(getCoordinate(leaf, q, "knee_left")).margin(1e-12));
    // Over idlers as long as cranks and arms, the motors turn with the foot against the thigh; drawn at 1.2 and -0.6.
    q = closeAt(idlers, bent);
    for (const char* motor : {"motor_ankle1_left", "motor_ankle2_left"})
      CHECK(getCoordinate(idlers, q, motor) ==
            Approx(getCoordinate(idlers, q, "knee_left") + getCoordinate(idlers, q, "ankley_left") - 0.6).margin(1e-8));
    q = closeAt(strut, bent);
    for (const char* number : {"1", "2"}) {
      const std::string name = std::string(number) + "_left";
      const Vector3d top(-0.05 * std::cos(0.6), number[0] == '1' ? 0.06 : -0.06, 0.2 - kShank);
      const double length = 0.2 - 0.05 * std::sin(0.6);
      CHECK((locate(strut, q, "heel" + name, "shank_left") - top).norm() ==
            Approx(length - getCoordinate(strut, q, "motor_ankle" + name)).epsilon(1e-9));
    }
    // The rod across the knee has the length that it has in the drawing.
    q = closeAt(across, bent);
    const Vector3d axis(0, 0.05, 0.03 - kThigh), heel = locate(across, q, "heel_left", "thigh_left");
    const auto point = [](const Eigen::Vector2d& p, double y) { return Vector3d(p.x(), y, p.y()); };
    const Eigen::Vector2d back(-std::cos(kMiddle), std::sin(kMiddle)), down(-std::sin(kMiddle), -std::cos(kMiddle));
    const Vector3d elbow = axis + point(turn(getCoordinate(across, q, "motor_ankle1_left"), 0.05 * back), 0);
    const Vector3d drawn = point(Eigen::Vector2d(0, -kThigh) + kShank * down + 0.05 * back, 0.05);
    CHECK((heel - elbow).norm() == Approx((drawn - axis - point(0.05 * back, 0)).norm()).epsilon(1e-9));
  }
  // A spring beside the motor.
  const Model spring = makeLegBiped({{"knee", "parallel_spring"}});
  REQUIRE(spring.jointForces().size() == 2);
  CHECK(spring.jointForces()[0].stiffness == 10);
  CHECK(spring.jointForces()[0].rest == 0.3);
}

TEST_CASE("parts: accelerations by their parameters, against robots made anew") {
  const Generator generator = findGenerator("leg_biped");
  for (const char* joint : {"hip", "knee", "ankle"})
    for (const std::string& part : generator.parameters.get(joint).choices) {
      std::vector<DesignVariable> variables;
      const Model model = makeLegBiped(chooseParts(joint, part));
      const std::string file =
          readFile(std::string(BIELLE_SOURCE_DIR) + "/robots/parts/" + joint + "/" + part + ".yaml");
      for (const Option& p : generator.parameters) {
        const double* value = std::get_if<double>(&p.value);
        if (!value || p.name.find("on_joint") != std::string::npos) continue;
        const std::string prefix = std::string(joint) + "_";
        const bool is_own =
            p.name.rfind(prefix, 0) == 0 && file.find("  " + p.name.substr(prefix.size()) + ": {value") != file.npos;
        if (!is_own && p.name != "thigh_length" && p.name != "rod_density") continue;
        DesignVariable variable;
        variable.name = variable.parameter = p.name;
        const double width = std::max(p.unit == "m" || p.unit == "rad" ? 5e-3 : 0.0, 0.1 * std::abs(*value));
        variable.lower = std::max(p.bounds.lower, *value - width);
        variable.upper = std::min(p.bounds.upper, *value + width);
        variables.push_back(variable);
      }
      CAPTURE(joint, part);
      const Parametrization robot("leg_biped", chooseParts(joint, part), variables);
      std::mt19937 random(7);
      std::uniform_real_distribution<double> uniform(-1, 1);
      const VectorXd q = assembleReference(model, "half_sitting").q;
      VectorXd v = VectorXd::NullaryExpr(model.nv(), [&] { return uniform(random); });
      const VectorXd u = VectorXd::NullaryExpr(model.nv(), [&] { return 10 * uniform(random); });
      const auto calcAcceleration = [&](const Model& of) {
        Workspace ws(of);
        const ConstraintSet constraints = makeConstraintSet(of);
        ConstrainedWorkspace cws;
        updateConstrainedDynamics(of, ws, cws, constraints, q, v, u);
        return VectorXd(cws.a);
      };
      Workspace ws(model);
      const ConstraintSet constraints = makeConstraintSet(model);
      ConstrainedWorkspace cws;
      updateConstrainedDynamics(model, ws, cws, constraints, q, v, u);
      v -= MatrixXd(cws.J).completeOrthogonalDecomposition().solve(cws.J * v);  // loops stay closed
      updateConstrainedDynamics(model, ws, cws, constraints, q, v, u);
      const MatrixXd analytic =
          calcConstrainedVariation(model, ws, cws, constraints, calcDesignVariations(robot, robot.start())).a;
      MatrixXd numeric(model.nv(), static_cast<Eigen::Index>(variables.size()));
      for (Eigen::Index i = 0; i < numeric.cols(); ++i) {
        const double h = 6e-4 * (robot.upper()[i] - robot.lower()[i]);
        const VectorXd step = h * VectorXd::Unit(numeric.cols(), i);
        numeric.col(i) =
            (calcAcceleration(robot.make(robot.start() + step)) - calcAcceleration(robot.make(robot.start() - step))) /
            (2 * h);
      }
      checkDerivative(analytic, numeric, part);
    }
}

TEST_CASE("parts: bars that are drawn with a slide, against the closed form of crank and slider") {
  const RobotDirectory files;
  const std::string file = files.write("slider/slider.yaml", kSlider);
  const Model model = loadRobot(file).model;
  CHECK(model.name() == "slider");
  CHECK(model.nv() == 4);
  REQUIRE(model.nu() == 1);
  CHECK(model.motors()[0].name == "motor");
  const Mobility mobility = calcMobility(model, closeAngle(model, 0.3));
  CHECK(mobility.mobility == 1);
  CHECK(mobility.rank == mobility.rows);
  for (const double angle : {0.3, 1.0, 2.0}) {
    VectorXd q = closeAngle(model, angle);
    const double at = getCoordinate(model, q, "motor"), c = 0.1 * std::cos(at), s = 0.1 * std::sin(at);
    CHECK(at == Approx(angle).margin(0.1));
    CHECK(getCoordinate(model, q, "slide") == Approx(c + std::sqrt(0.09 - s * s) - 0.4).margin(1e-9));
  }
  // A body of steel, 0.1 m wide.
  CHECK(model.bodies()[1].inertia.mass + model.bodies()[2].inertia.mass + model.bodies()[3].inertia.mass ==
        Approx(7.85 + 0.4).epsilon(1e-12));
}

TEST_CASE("parts: one of one's own beside the robot that chooses it, with what the robot shares and sets") {
  const RobotDirectory files;
  files.write("mine/rod.yaml", kRodPart);
  const std::string file = files.write("mine/mine.yaml", kRobotOfRods);
  const Model model = loadRobot(file).model;
  CHECK(model.nv() == 4 * 1);
  const auto place = [&](const std::string& joint) {
    return model.joints()[static_cast<size_t>(model.findJoint(joint))].X_PJ.p;
  };
  CHECK(place("swing_upper_left") == Vector3d(0, 0.2, 0));
  CHECK(place("swing_upper_right") == Vector3d(0, -0.2, 0));
  CHECK(place("swing_lower_left") == Vector3d(0, 0, -0.5));
  const auto mass = [&](const std::string& joint) {
    return model.bodies()[static_cast<size_t>(model.findJoint(joint))].inertia.mass;
  };
  CHECK(mass("swing_upper_left") == Approx(0.5 * 2));  // the density is shared, the length that of the robot
  CHECK(mass("swing_lower_right") == Approx(0.25 * 2));
  const Generator generator = findGenerator(file);
  CHECK(generator.parameters.find("upper_radius"));  // by its prefix
  CHECK_FALSE(generator.parameters.find("upper_density"));

  // Chosen by its path, on a robot that has others.
  files.write("knee.yaml", readFile(std::string(BIELLE_SOURCE_DIR) + "/robots/parts/knee/belt.yaml"));
  const std::string chosen =
      files.write("own/own.yaml", "generator: leg_biped\nset: {knee: ../knee.yaml, knee_ratio: 3}\n");
  const Model own = loadRobot(chosen).model;
  bool found = false;
  for (const Closure& closure : own.closures())
    if (closure.name == "knee_belt_left")
      for (const CouplerTerm& term : closure.terms) found = found || term.coefficient == -3;
  CHECK(found);
}

TEST_CASE("parts: lengths from pivot to pivot are those of the parameters") {
  const nlohmann::json info = nlohmann::json::parse(makeRobotInfo(loadRobot("leg_biped")));
  std::map<std::string, double> lengths;
  for (const nlohmann::json& entry : info["lengths"])
    lengths[entry["from"].get<std::string>() + " " + entry["to"].get<std::string>()] = entry["length"].get<double>();
  CHECK(lengths.at("motor_knee_left elbow_knee_left") == Approx(0.05));
  CHECK(lengths.at("elbow_knee_left knee_rod_left") == Approx(kThigh));  // as of a parallelogram
  CHECK(lengths.at("hipy_left knee_left") == Approx(kThigh));
  CHECK(lengths.at("knee_left knee_rod_left") == Approx(std::hypot(0.05, 0.086)));
  CHECK(lengths.count("root_joint hipz_left") == 0);
}

TEST_CASE("parts: motors of a catalogue by their role") {
  const RobotDirectory files;
  const std::string text = "tree: {biped: {part: leg_biped}}\nroles: {knee: {type: ak80-9, ratio: 18}}\n";
  const Model model = loadRobot(files.write("typed/typed.yaml", text)).model;
  int count = 0;
  for (const Motor& motor : model.motors()) {
    const bool is_knee = motor.name.rfind("motor_knee", 0) == 0;
    CHECK((motor.drive.type == "ak80-9") == is_knee);
    CHECK((motor.armature == 1e-3) != is_knee);
    count += is_knee;
  }
  CHECK(count == 2);
  CHECK_THROWS_WITH(loadRobot(files.write("typed/typed.yaml", replaceOnce(text, "knee:", "elbow:"))),
                    Contains("no motor has the role 'elbow'; known are hip, knee, ankle"));
}

TEST_CASE("parts: errors give the file, the line, the name and what to do") {
  const RobotDirectory files;
  const auto refuse = [&](const std::string& text, const std::string& from, const std::string& to,
                          const std::vector<std::string>& messages) {
    files.write("bad/rod.yaml", kRodPart);
    const std::string file = files.write("bad/bad.yaml", replaceOnce(text, from, to));
    CAPTURE(from, to);
    for (const std::string& message : messages)
      CHECK_THROWS_WITH(loadRobot(file), Contains(files.path() + "/bad/") && Contains(message));
  };
  refuse(kRobotOfRods, "value: 2,", "value: 200,", {"outside the bounds"});
  refuse(kRobotOfRods, "part: rod, prefix: upper_", "part: rods, prefix: upper_",
         {"there is no part 'rods'", "searched were"});
  refuse(kRobotOfRods, "mounts: {base: world}", "mounts: {bases: world}",
         {"key 'bases' (line ", "there is no mount 'bases'; known are base"});
  refuse(kRobotOfRods, "mounts: {base: world}", "mounts: {base: swing_upper_left}",
         {"there is no link 'swing_upper_left'"});
  files.write("bad/motor.yaml", "mounts: {on: joint}\ntree: {}\nmotors: {on: {armature: 0.1}}\n");
  for (const char* name : {"rod_upper_left", "nothing"})
    refuse(kRobotOfRods + std::string("  motor: {part: motor, mounts: {on: swing_upper_left}}\n"),
           "on: swing_upper_left", std::string("on: ") + name,
           {"the part wants a joint here, and '" + std::string(name) + "' is"});
  refuse(kRobotOfRods, "density: {value", "dens: {value", {"nothing gives it a value", "density"});
  for (const char* whole : {"play: {knee: 0.01}", "rod_friction: {rod: 0.1}", "rounding: 1e-4"})
    refuse(kSlider, "tree:", std::string(whole) + "\ntree:", {"it belongs to a whole robot", "beside `model: "});
  refuse(kRobotOfRods, "length: span/2", "length: spam/2", {"'spam' is unknown; known are", "line"});
  refuse(kRobotOfRods, "length: span/2", "length: span/", {"is not an expression", "key 'length'"});
  refuse(kRobotOfRods, "length: span/2", "length: -span", {"the rod has no length", "make it longer"});
  refuse(kRobotOfRods, "length: span}}", "length: span, radius: -0.2}}",
         {"bad.yaml: key 'tree': key 'upper': key 'set': key 'radius' (line ", "-0.2 is outside 0.001 .. 0.1"});
  refuse(kRobotOfRods, "lower: {part: rod,", "upper: {part: rod,", {"given twice"});
  refuse(kSlider, "hinges: {pivot", "hinges: {pivots", {"there is no point 'pivots'; known are end, pin, pivot"});
  refuse(kSlider, "rod: [end, pin]", "rod: [end]", {"a bar joins two points or more"});
  refuse(kSlider, "crank: [pivot, end]", "crank: [pin, end]", {"key 'crank'", "no point in common"});
  refuse(kSlider, "axis: x, place", "place", {"it has no 'axis'"});
  refuse(kSlider, "material: steel", "material: cheese", {"'cheese' is unknown; use one of aluminium"});
  refuse(kSlider, "material: steel", "color: steel", {"its mass is not given once"});
  refuse(kSlider, "type: prismatic", "type: sliding", {"joint type 'sliding' is unknown"});
  refuse(kSlider, "end: [crank, 0]", "end: [0, 0]", {"are in one place"});
  refuse(kSlider, "tree:", "trees: {}\ntree:", {"'trees'", "known keys are"});
  refuse(kRobotOfRods,
         "tree:", "motor_catalogue: none.yaml\ntree:", {"key 'motor_catalogue'", "no motor is taken from it"});
  CHECK_THROWS_WITH(loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/parts/knee/belt.yaml"),
                    Contains("it is a part of a robot"));
}

TEST_CASE("parts: parameters of parts that are not chosen are refused, but where a design may choose them") {
  const RobotDirectory files;
  const auto load = [&](const std::string& set) {
    return loadRobot(files.write("legs/legs.yaml", "generator: leg_biped\nset: {" + set + "}\n"));
  };
  CHECK(load("knee: belt, knee_ratio: 3, thigh_length: 0.25, hip_height: 0.5").warnings.empty());
  CHECK(load("hip: three_rrs, hip_middle: -0.5").warnings.empty());
  CHECK_THROWS_WITH(load("knee: belt, knee_crank: 0.04"),
                    Contains(files.path() + "/legs/legs.yaml: key 'set': key 'knee_crank' (line 2)") &&
                        Contains("it would change nothing") && Contains("choose `knee: four_bar`"));
  CHECK_NOTHROW(load("knee: four_bar, knee_crank: 0.04"));  // as it says
  CHECK_THROWS_WITH(load("hip_middle: -0.5"), Contains("key 'hip_middle'") && Contains("choose `hip: three_rrs`"));
  const auto find = [](const OptionValues& settings, const OpenChoices& open) {
    const std::optional<UnusedParameters> unused = findUnused("leg_biped", settings, open);
    return unused ? listItems(unused->names) : "";
  };
  const OptionValues crank = {{"knee", std::string("belt")}, {"knee_crank", 0.04}};
  CHECK(find(crank, {}) == "knee_crank");
  CHECK(find(crank, {{"knee", {"serial", "belt"}}}) == "knee_crank");
  CHECK(find(crank, {{"knee", {"belt", "four_bar"}}, {"hip", {"serial", "three_rrs"}}}) == "");
  CHECK(find({{"knee_crank", 0.04}, {"hip_middle", -0.5}}, {{"knee", {"belt", "four_bar"}}}) == "hip_middle");
  CHECK(find({{"knee_crank", 0.04}, {"hip_middle", -0.5}},
             {{"knee", {"belt", "four_bar"}}, {"hip", {"serial", "three_rrs"}}}) == "");
  // All that went with a part are one error, whose remedy helps all of them.
  const OptionValues two = {{"knee", std::string("belt")}, {"knee_crank", 0.04}, {"knee_arm", 0.055}};
  CHECK_THROWS_WITH(generateRobot("leg_biped", two), Contains("leg_biped: parameter 'knee_crank'") &&
                                                         Contains("knee_crank, knee_arm would change nothing") &&
                                                         Contains("remove them, or choose `knee: four_bar`"));
  CHECK_NOTHROW(generateRobot("leg_biped", {two.begin() + 1, two.end()}));
  CHECK(find({{"knee", std::string("belt")}, {"knee_crank", 0.04}, {"hip_middle", -0.5}}, {}) ==
        "knee_crank, hip_middle");
  std::vector<DesignVariable> variables(2);
  variables[0].name = "crank", variables[0].parameter = "knee_crank";
  variables[1].name = "arm", variables[1].parameter = "knee_arm";
  for (DesignVariable& variable : variables) variable.lower = 0.04, variable.upper = 0.06;
  const auto design = [&](const std::string& knee) { Parametrization("leg_biped", {{"knee", knee}}, variables); };
  CHECK_NOTHROW(design("four_bar"));
  CHECK_THROWS_WITH(design("belt"), Contains("variables 'crank', 'arm'") && Contains("choose `knee: four_bar`"));
}

TEST_CASE("expressions: numbers, points by component, and what is not one") {
  Symbols symbols;
  symbols.define("a", 2.0);
  symbols.define("p", Vector3d(1, 2, 3));
  CHECK(symbols.calcNumber("a^3 + p.z/2") == 9.5);
  CHECK(symbols.calcNumber("a > 1 && a < 3 ? sqrt(16) : 0") == 4);
  CHECK(symbols.calcNumber("(0.5 && 0.5) + (0.5 || 0)") == 2);  // where muParser simplifies, they are 0
  CHECK(symbols.calcPoint("2*p - a*z") == Vector3d(2, 4, 4));
  CHECK(symbols.calcPoint("a - 2") == Vector3d::Zero());
  CHECK_THROWS_AS(symbols.calcPoint("a"), ExpressionError);  // as `gravity: -9.81`
  CHECK(symbols.usesPoints("a*p"));
  CHECK_FALSE(symbols.usesPoints("a*p.x"));
  const auto refuse = [&](const std::string& expression, const std::string& problem) {
    CAPTURE(expression);
    std::string message;
    try {
      symbols.calcNumber(expression);
    } catch (const ExpressionError& error) {
      message = error.problem + "; " + error.remedy;
    }
    CHECK_THAT(message, Contains(problem));
  };
  refuse("a + b", "'b' is unknown; known are a, pi, origin, p, x, y, z");
  refuse("a +", "'a +' is not an expression");
  refuse("sqrt(-a)", "is not finite");
  refuse("a/0", "is not finite");
  refuse("2*p", "'p' is a point, not a number");
  refuse("", "is not an expression");
  CHECK_THROWS_AS(symbols.define("a", 1.0), ExpressionError);
  CHECK_THROWS_AS(symbols.define("sin", 1.0), ExpressionError);
  CHECK_THROWS_AS(symbols.define("1a", 1.0), ExpressionError);
}
