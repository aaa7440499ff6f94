#include "firmware/languages.h"
#include "firmware/printer.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle::firmware {
namespace {

using Eigen::Index;

// In place of NumPy, whose names the rest of a module uses.
constexpr const char* kTorchText = R"(import math

import torch


def _take_numbers(function):
    def call(*values):
        like = next(x for x in values if torch.is_tensor(x) and x.is_floating_point())
        return function(*(x if torch.is_tensor(x) else torch.as_tensor(x, dtype=like.dtype, device=like.device) for x in values))
    return call


class np:
    """Of NumPy what the rest calls, which is the text of `--to numpy`."""
    inf = math.inf
    abs, amax, amin, isnan, sin, cos, sqrt, stack = torch.abs, torch.amax, torch.amin, torch.isnan, torch.sin, torch.cos, torch.sqrt, torch.stack
    arctan2, maximum, minimum, where = map(_take_numbers, (torch.atan2, torch.maximum, torch.minimum, torch.where))
    broadcast_arrays = torch.broadcast_tensors

    def array(values):
        return torch.tensor(values, dtype=torch.float64)

    def asarray(values, _):
        return torch.as_tensor(values, dtype=torch.float64)

    def einsum(indices, *values):
        return torch.einsum(indices, *(np.asarray(x, float) for x in values))


def to(device):
    """Moves the constants to where the tensors are that functions get."""
    global LOWER, UPPER, MOTOR_LOWER, MOTOR_UPPER, ROTOR, EFFORT, SPEED
    LOWER, UPPER, MOTOR_LOWER, MOTOR_UPPER, ROTOR, EFFORT, SPEED = (
        x.to(device) for x in (LOWER, UPPER, MOTOR_LOWER, MOTOR_UPPER, ROTOR, EFFORT, SPEED))
)";

// Keys: SIZE, @..@.
constexpr const char* kModuleText = R"("""@title@

@about@
Arrays hold a posture a row: joints and motors (N, SIZE), or (SIZE,) for one.
"""
@import@

SIZE = SIZE_
LOWER, UPPER = np.array([@lower@]), np.array([@upper@])  # of the joints
MOTOR_LOWER, MOTOR_UPPER = np.array([@motor_lower@]), np.array([@motor_upper@])
ROTOR = np.array([@rotor@])  # inertia, kg m^2 or kg
EFFORT, SPEED = np.array([@effort@]), np.array([@speed@])  # limits of the motors


def root(x):
    return np.sqrt(np.maximum(x, 0.0))


def least(a, b):
    return np.minimum(a, b)


def _limit(x, low, high):
    return np.minimum(np.maximum(np.where(np.isnan(x), low, x), low), high)


def _solve_motors(q):
@solve_motors@

def _solve_joints(q):
@solve_joints@

def joint_to_motor(joints):
    """Motors for joints, clamped to the range, and whether they were in it and reached."""
    joints = np.asarray(joints, float)
    q = _start(_limit(joints, LOWER, UPPER), 0)
    reached = _solve_motors(q)
    return _stack(q[SIZE:2 * SIZE]), reached & ((joints >= LOWER) & (joints <= UPPER)).all(-1)


def motor_to_joint(motors):
    """Joints for motors, likewise."""
    motors = np.asarray(motors, float)
    q = _start(_limit(motors, MOTOR_LOWER, MOTOR_UPPER), SIZE)
    reached = _solve_joints(q)
    joints = _stack(q[:SIZE])
    inside = ((motors >= MOTOR_LOWER) & (motors <= MOTOR_UPPER)).all(-1) & ((joints >= LOWER - 1e-9) & (joints <= UPPER + 1e-9)).all(-1)
    return _limit(joints, LOWER, UPPER), reached & inside


def _start(given, first):
    q = [0 * given[..., 0]] * @coordinates@
    q[first:first + SIZE] = [given[..., i] for i in range(SIZE)]
    return q


def _stack(values):
    return np.stack(np.broadcast_arrays(*values), -1)


def _close(joints):
    q = _start(_limit(np.asarray(joints, float), LOWER, UPPER), 0)
    _solve_motors(q)
    return q


def _ratio(q):
    """R and its inverse, by rows, and what is positive on the branch of the robot's file."""
    r = [None] * (2 * SIZE * SIZE + 1)
@ratio@    return r


def ratio(joints):
    """R (N, SIZE, SIZE), speeds of motors over those of joints, and its inverse."""
    q = _close(joints)
    both = _stack([x + 0 * q[0] for x in _ratio(q)[:-1]])
    both = both.reshape(both.shape[:-1] + (2, SIZE, SIZE))
    return both[..., 0, :, :], both[..., 1, :, :]


def ratio_rate(joints, joint_velocities):
    """Time derivative of R (N, SIZE, SIZE)."""
    q = _close(joints)
    R = _ratio(q)
    v = [np.asarray(joint_velocities, float)[..., i] for i in range(SIZE)]
    r = [None] * (SIZE * SIZE + 1)
@rate@    rate = _stack([x + 0 * q[0] for x in r[:-1]])
    return rate.reshape(rate.shape[:-1] + (SIZE, SIZE))


def held_torque(joints, gravity=(0, 0, -9.81)):
    """What springs and the weight of cranks and rods ask of the joints (N, SIZE); gravity (3,) or (N, 3) in the frame of @base@."""
    q = _close(joints)
    R = _ratio(q)
    gravity = [np.asarray(gravity, float)[..., i] for i in range(3)]
    h = [None] * SIZE
@held@    return _stack([x + 0 * q[0] for x in h])


def motor_velocity(joints, joint_velocities):
    return np.einsum("...ij,...j->...i", ratio(joints)[0], joint_velocities)


def motor_torque(joints, joint_torques, gravity=None):
    """By virtual work; with what springs and weight take, if gravity is given."""
    torques = np.asarray(joint_torques, float) + (0 if gravity is None else held_torque(joints, gravity))
    return np.einsum("...ji,...j->...i", ratio(joints)[1], torques)


def joint_torque(joints, motor_torques, gravity=None):
    torques = np.einsum("...ji,...j->...i", ratio(joints)[0], motor_torques)
    return torques - (0 if gravity is None else held_torque(joints, gravity))


def clip_joint_torque(joints, joint_torques):
    """Joint torques, shortened where the motors cannot give them: what a policy's action becomes."""
    needed = np.maximum(np.abs(motor_torque(joints, joint_torques)), 1e-200)
    share = np.amin(np.minimum(EFFORT / needed, 1.0), -1)
    return np.asarray(joint_torques, float) * share[..., None]


def reflected_inertia(joints):
    """Of the rotors (N, SIZE, SIZE), kg m^2."""
    R = ratio(joints)[0]
    return np.einsum("...ki,k,...kj->...ij", R, ROTOR, R)
)";

}  // namespace

std::map<std::string, std::string> writePython(const Maps& maps, bool is_torch) {
  const int m = maps.size();
  const Mechanism& mechanism = maps.mechanism;
  Style style;
  style.declare = "  ";
  style.end = "";
  style.functions = "np.";
  const auto nameInput = [&](int i) {
    const auto entry = [](const char* array, int k) { return std::string(array) + "[" + std::to_string(k) + "]"; };
    if (i < mechanism.gravity()) return entry("q", i);
    if (i < mechanism.velocity()) return entry("gravity", i - mechanism.gravity());
    return i < mechanism.ratio() ? entry("v", i - mechanism.velocity()) : entry("R", i - mechanism.ratio());
  };
  const auto deepen = [](const std::string& text, const std::string& by) {
    std::string out;
    for (size_t at = 0, end = 0; at < text.size(); at = end) {
      end = text.find('\n', at) + 1;
      const size_t first = text.find_first_not_of(' ', at);
      out += by + text.substr(first, end - first);
    }
    return out;
  };
  const auto print = [&](const Program& program, const std::vector<std::string>& targets) {
    return deepen(printProgram(program, style, nameInput, targets), "    ");
  };
  const auto printSolution = [&](const Solution& s) {
    const std::string first = nameInput(s.given.front());
    std::string out = "    reached = " + first + " == " + first + "\n";
    const auto addClosedForms = [&](const std::vector<std::pair<int, Scalar>>& list, const Scalar& least) {
      std::vector<Scalar> formulas;
      std::vector<std::string> targets;
      for (const auto& [c, formula] : list) formulas.push_back(formula), targets.push_back(nameInput(c));
      if (!least.isConstant()) formulas.push_back(least), targets.emplace_back("margin");
      if (list.empty()) return;
      out += print(Program(formulas), targets);
      if (!least.isConstant()) out += "    reached = reached & (margin >= 0)\n";
    };
    addClosedForms(s.before, s.least_before);
    if (!s.unknowns.empty()) {
      std::vector<std::string> unknowns, steps;
      for (size_t u = 0; u < s.unknowns.size(); ++u) {
        unknowns.push_back(nameInput(s.unknowns[u]));
        steps.push_back("d[" + std::to_string(u) + "]");
      }
      const std::string U = std::to_string(s.unknowns.size());
      out += print(Program(s.guesses), unknowns);
      const LoopText loop = printLoop(Program(s.steps), style, nameInput, steps, s.unknowns);
      out += deepen(loop.before, "    ") + "    for _ in range(" + std::to_string(s.iterations) +
             "):\n        d = [None] * " + U + "\n" + deepen(loop.body, "        ") + "        d = [_limit(x, " +
             formatConstant(-kLongestStep, style) + ", " + formatConstant(kLongestStep, style) + ") for x in d]\n";
      for (size_t u = 0; u < unknowns.size(); ++u)
        out += "        " + unknowns[u] + " = " + unknowns[u] + " + " + steps[u] + "\n";
      out += "    reached = reached & (np.amax(np.abs(_stack(d)), -1) <= 1e-3)\n";
    }
    addClosedForms(s.after, s.least_after);
    return out + "    return reached\n";
  };
  const auto list = [&](const auto& get) {
    std::vector<std::string> out;
    for (int i = 0; i < m; ++i) {
      const double x = get(i);
      out.push_back(std::isinf(x) ? (x < 0 ? "-np.inf" : "np.inf") : formatConstant(x, style));
    }
    return listItems(out);
  };
  const auto listTargets = [](const char* array, int n) {
    std::vector<std::string> out;
    for (int i = 0; i < n; ++i) out.push_back(std::string(array) + "[" + std::to_string(i) + "]");
    return out;
  };
  const Formulas formulas(maps);
  std::string about;
  for (const std::string& line : describe(maps, false)) about += line + "\n";
  const auto motor = [&](int i) -> const Motor& { return maps.motors[static_cast<size_t>(i)]; };
  return {{maps.name + ".py",
           fillIn(kModuleText,
                  {{"@import@", is_torch ? kTorchText : "import numpy as np"},
                   {"SIZE_", std::to_string(m)},
                   {"@lower@", list([&](int i) { return maps.lower[i]; })},
                   {"@upper@", list([&](int i) { return maps.upper[i]; })},
                   {"@motor_lower@", list([&](int i) { return maps.motor_lower[i]; })},
                   {"@motor_upper@", list([&](int i) { return maps.motor_upper[i]; })},
                   {"@rotor@", list([&](int i) { return motor(i).armature; })},
                   {"@effort@", list([&](int i) { return motor(i).effort_limit; })},
                   {"@speed@", list([&](int i) { return motor(i).velocity_limit; })},
                   {"@solve_motors@", printSolution(maps.inverse)},
                   {"@solve_joints@", printSolution(maps.direct)},
                   {"@coordinates@", std::to_string(mechanism.coordinates.size())},
                   {"@ratio@", print(formulas.ratio, listTargets("r", 2 * m * m + 1))},
                   {"@rate@", print(formulas.ratio_rate, listTargets("r", m * m + 1))},
                   {"@held@", print(formulas.held, listTargets("h", m))},
                   {"@about@", about},
                   {"@base@", maps.base},
                   {"@title@", maps.robot + ": " + listItems(maps.joint_names) + " by " + listItems(maps.motor_names) +
                                   ". Written by `bielle convert --to " + (is_torch ? "torch" : "numpy") + "`."}})}};
}

}  // namespace bielle::firmware
