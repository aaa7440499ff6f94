// The options of the motions by name. A program lists those of all motions, and may be linked without the motions themselves.
#include "bielle/motion/described_options.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/run.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "motion/footholds.h"
#include "motion/obstacles.h"
#include "solve/fddp_checks.h"

namespace bielle {

void describe(OptionFields& f, LocomotionOptions& o) {
  f.number("start_support", o.timing.start, "s", kNotNegative,
           "least duration of double support before the first step");
  f.number("start_pressure", o.start_pressure, "1", {0, 1},
           "start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never");
  f.number("single_support", o.timing.single, "s", kNotNegative, "duration with one foot on the ground");
  f.number("double_support", o.timing.both, "s", kNotNegative,
           "duration with both feet on the ground between two steps");
  f.number("end_support", o.timing.end, "s", kNotNegative, "duration of double support after the last step");
  f.number("time_step", o.timing.time_step, "s", kNotNegative,
           "length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings");
  f.number("swing_height", o.swing.height, "m", kNotNegative,
           "apex of the swing foot above the higher end of its path");
  f.number("swing_apex", o.swing.apex, "1", kNotNegative, "time of the apex as a fraction of the swing, from 0 to 1");
  f.number("swing_leave", o.swing.leave, "1", kNotNegative,
           "time at which the swing foot starts to move horizontally, from 0 to 1");
  f.number("swing_arrive", o.swing.arrive, "1", {0, 1},
           "time at which the swing foot is above its foothold, from 0 to 1");
  f.flag("rigid_landing", o.rigid_landing, "a rigid impact at every landing, as a separate stage");
  f.number("landing_speed", o.landing_speed, "m/s", kNotNegative,
           "with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest");
  f.number("foothold_room", o.foothold_room, "m", kNotNegative,
           "largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it");
  f.number("heading_weight", o.heading_weight, "1", kNotNegative,
           "keep the heading of the feet, within the state regularization");
  f.number("com_weight", o.com_weight, "1/m^2", kNotNegative, "horizontal position of the centre of mass");
  f.number("com_height_weight", o.com_height_weight, "1/m^2", kNotNegative, "height of the centre of mass");
  f.number("com_velocity_weight", o.com_velocity_weight, "s^2/m^2", kNotNegative,
           "velocity of the centre of mass in the direction of travel");
  f.number("swing_weight", o.swing_weight, "1/m^2", kNotNegative, "path of the swing foot");
  f.number("swing_velocity_weight", o.swing_velocity_weight, "s^2/m^2", kNotNegative,
           "velocity of the swing foot along its path");
  f.number("swing_rotation_weight", o.swing_rotation_weight, "1", kNotNegative, "orientation of the swing foot");
  f.number("foothold_weight", o.foothold_weight, "1/m^2", kNotNegative,
           "with foothold_room: land near the foothold, swing near its horizontal path");
  f.number("feet_distance", o.feet_distance, "m", kNotNegative,
           "least distance between the soles, or that of the footholds if smaller");
  f.number("terminal_weight", o.terminal_weight, "1/m^2", kNotNegative, "position of the centre of mass at the end");
  describe(f, static_cast<MotionOptions&>(o));
  f.number("closure_kp", o.closure_kp, "1/s^2", kNotNegative,
           "position gain of the stabilisation of closures (full formulation)");
  f.number("closure_kd", o.closure_kd, "1/s", kNotNegative,
           "velocity gain of the stabilisation of closures (full formulation)");
}

namespace {

constexpr const char* kPeriodic =
    "one cycle of two steady steps, whose end is its beginning, moved; steps, start_support and end_support do not "
    "count";
constexpr const char* kCycles = "with periodic: number of such cycles";

}  // namespace

void describe(OptionFields& f, WalkOptions& o) {
  f.number("speed", o.speed, "m/s", {}, "speed of the steady steps; negative: backward");
  f.integer("steps", o.steps, {2, 200}, "number of steps; the last one brings the feet together");
  f.flag("periodic", o.periodic, kPeriodic);
  f.integer("cycles", o.cycles, {1, 1000}, kCycles);
  describe(f, o.gait);
}

void describe(OptionFields& f, SideWalkOptions& o) {
  f.number("speed", o.speed, "m/s", {}, "speed of the steady steps to the left; negative: to the right");
  f.integer("steps", o.steps, {2, 200}, "number of steps: one opens the stance, the next one closes it");
  f.flag("periodic", o.periodic, kPeriodic);
  f.integer("cycles", o.cycles, {1, 1000}, kCycles);
  describe(f, o.gait);
}

void describe(OptionFields& f, TurnOptions& o) {
  f.number("angle", o.angle, "rad", {}, "angle to turn to the left; negative: to the right");
  f.number("radius", o.radius, "m", kNotNegative, "radius of the arc to walk along; 0: turn on the spot");
  f.integer("steps", o.steps, {2, 200}, "number of steps; the last one brings the feet together");
  f.flag("periodic", o.periodic, kPeriodic);
  f.integer("cycles", o.cycles, {1, 1000}, kCycles);
  describe(f, o.gait);
}

LocomotionOptions StairsOptions::makeGaitDefaults() {
  LocomotionOptions gait;
  gait.timing.both = 0.09;
  gait.swing.height = 0.03;
  gait.swing.leave = 0.1;
  gait.swing.arrive = 0.9;
  gait.com_height_weight = 1e3;
  return gait;
}

void describe(OptionFields& f, StairsOptions& o) {
  f.number("height", o.height, "m", {}, "height of a step; negative: down");
  f.number("depth", o.depth, "m", kNotNegative, "depth of a step; 0: 0.2 m, or a quarter more than the soles");
  f.number("slope", o.slope, "1", {}, "height over depth; replaces the height unless 0");
  f.integer("stairs", o.stairs, {1, 100}, "number of steps of the staircase");
  f.number("speed", o.speed, "m/s", kPositive, "forward speed; with the depth it determines the duration of a step");
  f.number("width", o.width, "m", kNotNegative, "width of the stairs");
  f.omit({"single_support"});
  describe(f, o.gait);
  f.omit({});
}

LocomotionOptions FootholdsOptions::makeGaitDefaults() {
  LocomotionOptions gait = StairsOptions::makeGaitDefaults();
  gait.timing.single = 0.5;
  gait.swing.height = 0.04;
  gait.swing.leave = 0.15;
  gait.swing.arrive = 0.85;
  return gait;
}

void describe(OptionFields& f, FootholdsOptions& o) {
  f.text("footholds", o.footholds, "the list of the file in one line: [{foot: right, x: 0.2, y: -0.1}, ...]");
  f.number("rim", o.rim, "m", {0, 1}, "width of the stones around the soles");
  describe(f, o.gait);
}

LocomotionOptions BoxOptions::makeGaitDefaults() {
  LocomotionOptions gait = StairsOptions::makeGaitDefaults();
  gait.timing.single = 0.6;
  gait.swing.leave = 0.25;
  gait.swing.arrive = 0.75;
  return gait;
}

void describe(OptionFields& f, BoxOptions& o) {
  f.number("height", o.height, "m", {0, 10, true}, "height of the box");
  f.number("length", o.length, "m", {0, 10},
           "length of its top; the feet stand in the middle; 0: 0.2 m, or a quarter more than the soles");
  f.number("width", o.width, "m", {0, 100}, "width of the box");
  f.number("distance", o.distance, "m", kNotNegative, "distance from the soles to the box");
  f.flag("down", o.down, "step down again behind the box");
  describe(f, o.gait);
}

void describe(OptionFields& f, GapOptions& o) {
  f.number("width", o.width, "m", kPositive, "width of the gap in the direction of travel");
  f.number("distance", o.distance, "m", kNotNegative, "distance of the soles from its edges, on both sides");
  f.number("depth", o.depth, "m", {0, 100, true}, "depth of the gap's floor below its banks");
  describe(f, o.gait);
}

void describe(OptionFields& f, JumpOptions& o) {
  f.number("flight", o.flight, "s", kNotNegative,
           "time in the air, rounded to an even number of time steps; the height follows");
  f.number("length", o.length, "m", {-2, 2}, "distance from take-off to landing, forward");
  f.number("stand", o.stand, "s", kNotNegative, "time at rest before the push");
  f.number("push", o.push, "s", kPositive, "time of acceleration with the feet on the ground");
  f.number("land", o.land, "s", kPositive, "time from touchdown until the body is braked");
  f.number("settle", o.settle, "s", kNotNegative, "time to come back to rest");
  f.number("stretch", o.stretch, "m", kNotNegative,
           "height of the centre of mass at take-off and touchdown above that at the start");
  f.number("clearance", o.clearance, "m", kNotNegative, "least height of the soles at mid-flight");
  f.number("time_step", o.time_step, "s", kPositive, "length of a shooting stage");
  f.number("apex_weight", o.apex_weight, "1/m^2", kNotNegative, "height of the centre of mass at mid-flight");
  f.number("com_weight", o.com_weight, "1/m^2", kNotNegative, "height of the centre of mass on the ground");
  f.number("swing_weight", o.swing_weight, "1/m^2", kNotNegative, "follow the path of the feet in flight");
  f.number("swing_rotation_weight", o.swing_rotation_weight, "1", kNotNegative, "keep the soles level in flight");
  f.number("terminal_weight", o.terminal_weight, "1/m^2", kNotNegative, "position of the centre of mass at the end");
  describe(f, static_cast<MotionOptions&>(o));
}

namespace {

// Supports and flights have options of their own.
void describeGait(OptionFields& f, LocomotionOptions& gait) {
  f.omit({"single_support", "double_support"});
  describe(f, gait);
  f.omit({});
  f.number("stretch", gait.stretch, "m", {-0.5, 0.5},
           "height of the centre of mass at take-off and touchdown above that at the start");
}

}  // namespace

LocomotionOptions RunOptions::makeGaitDefaults() {
  LocomotionOptions gait;
  gait.swing.arrive = 1;
  gait.force_weight = 100;
  return gait;
}

LocomotionOptions HopOptions::makeGaitDefaults() {
  LocomotionOptions gait = RunOptions::makeGaitDefaults();
  gait.timing.start = 0.6;
  gait.swing.height = 0.02;
  return gait;
}

void describe(OptionFields& f, RunOptions& o) {
  f.number("speed", o.speed, "m/s", {}, "speed of the steady steps; negative: backward");
  f.integer("steps", o.steps, {2, 200}, "number of steps; the last one brings the feet together");
  f.flag("periodic", o.periodic, kPeriodic);
  f.integer("cycles", o.cycles, {1, 1000}, kCycles);
  f.number("flight", o.flight, "s", kPositive, "time in the air between two steps");
  f.number("stance", o.stance, "s", kNotNegative, "time with one foot on the ground");
  describeGait(f, o.gait);
}

void describe(OptionFields& f, HopOptions& o) {
  f.choice("foot", o.foot, {"left", "right"}, "foot to hop on");
  f.integer("hops", o.hops, {1, 100}, "number of flights");
  f.number("flight", o.flight, "s", kPositive, "time in the air of each hop");
  f.number("length", o.length, "m", {}, "length of each hop, forward; negative: backward");
  f.number("stance", o.stance, "s", kNotNegative,
           "time on one foot before the first flight, between flights and after the last one");
  describeGait(f, o.gait);
}

void describe(OptionFields& f, LimitOptions& o) {
  f.number("dead_point_margin", o.dead_point_margin, "1", {},
           "least transmission of a linkage (joint speed over motor speed), relative to that at the start; the largest "
           "is its inverse; 0: no bounds. A motion within 0.1 rad of a dead point is solved again with a larger one, "
           "unless less than the default is given");
}

void describe(OptionFields& f, ObjectiveOptions& o) {
  f.choice("objective", o.objective, {"effort", "energy", "peak-torque"},
           "effort: weighted squares; energy: electrical energy of the motors; peak-torque: largest ratio of a torque "
           "to its limit. The last two start from the motion of least effort");
  f.number("regeneration", o.regeneration, "1", {0, 1}, "share of the regenerated electrical energy that is reused");
  f.number("regularization", o.regularization, "1", kPositive, "share of the other costs that is kept; default: 0.2");
}

void describe(OptionFields& f, ProblemOptions& o) {
  f.choice("formulation", o.formulation, {"full", "reduced"},
           "reduced: loops are closed at every node; full: all joints of the spanning tree, loops closed by "
           "accelerations");
  describe(f, o.limits);
  describe(f, o.objective);
}

void describe(OptionFields& f, ConstraintOptions& o) {
  f.number("tolerance", o.tolerance, "1", kPositive, "largest violation of a converged solve");
  f.number("initial_penalty", o.initial_penalty, "1", kPositive, "cost over squared violation");
  f.number("penalty_increase", o.penalty_increase, "1", {1}, "factor when the violation falls too slowly");
  f.number("max_penalty", o.max_penalty, "1", kPositive, "largest penalty");
  f.flag("multipliers", o.multipliers, "false: the penalty alone grows, for comparisons");
}

void describe(OptionFields& f, FddpOptions& o) {
  f.integer("max_iterations", o.max_iterations, {1, kMostIterations}, "largest number of iterations");
  f.flag("multiple_shooting", o.multiple_shooting, "rollouts stage by stage while the gaps of the guess are open");
  f.number("gradient_tolerance", o.gradient_tolerance, "1", kNotNegative, "(cost per unit of control)^2");
  f.number("gap_tolerance", o.gap_tolerance, "1", kNotNegative, "largest norm of a gap");
  f.number("cost_tolerance", o.cost_tolerance, "1", kNotNegative,
           "relative change of the cost by a full step; 0: never");
  f.number(
      "acceptable_decrease", o.acceptable_decrease, "1", kNotNegative,
      "share of the cost; a solve whose cost falls by less in 20 iterations ends within the constraints; 0: never");
  f.number("initial_regularization", o.initial_regularization, "1", kPositive, "regularization of the first sweep");
  f.number("min_regularization", o.min_regularization, "1", kPositive, "least regularization");
  f.number("max_regularization", o.max_regularization, "1", kPositive, "the solve gives up above this");
  f.number("regularization_increase", o.regularization_increase, "1", {1}, "factor");
  f.number("regularization_decrease", o.regularization_decrease, "1", {1}, "divisor");
  f.number("state_regularization_ratio", o.state_regularization_ratio, "1", kNotNegative,
           "ratio of the regularization of states to that of controls");
  f.number("long_step", o.long_step, "1", {0, 1}, "a step is long above this");
  f.number("short_step", o.short_step, "1", {0, 1}, "a step is short up to this");
  f.integer("num_step_lengths", o.num_step_lengths, {1}, "number of step lengths 1, 1/2, 1/4, ...");
  f.number("acceptance", o.acceptance, "1", {0, 1, true}, "share of the predicted decrease");
  f.integer("rollout_segments", o.rollout_segments, {1}, "largest number of segments of a rollout");
  f.integer("threads", o.threads, {0, kMostThreads}, "number of threads; 0: all; results do not depend on it");
}

void describe(OptionFields& f, LiftOptions& o) {
  f.choice("method", o.method, {"newton", "nlopt"},
           "newton: each node separately, torques from inverse dynamics; nlopt: one step of the closed dynamics after "
           "the other, torques by SLSQP, as in the paper's appendix");
  f.number("singular", o.singular, "1", {0, 1}, "margin below which a linkage is at a dead point");
  f.number("acceleration_tolerance", o.acceleration_tolerance, "1", kPositive,
           "tolerance of newton's accelerations: share of 1 rad/s^2 + the largest");
  f.number("position_tolerance", o.position_tolerance, "rad, m", kPositive, "tolerance of nlopt's positions");
  f.number("velocity_tolerance", o.velocity_tolerance, "rad/s, m/s", kPositive, "tolerance of nlopt's velocities");
}

}  // namespace bielle
