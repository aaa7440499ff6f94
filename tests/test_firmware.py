"""test_firmware.py BIELLE [all [POSTURES]]: maps of linkages in C are compiled and compared with closed forms and with the mechanism.

With "all", every linkage of the included robots, of every part of a biped, and an ankle whose rods cross, in both precisions at 1e5
postures, and a table of them (docs/firmware.md)."""
import ctypes
import importlib.machinery
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BIELLE = os.path.abspath(sys.argv[1])
ALL = "all" in sys.argv[2:]
POSTURES = sys.argv[3] if len(sys.argv) > 3 else "100000"
SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.argv = sys.argv[:1]
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
STRICT = ["-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]
OK, CLAMPED, NEAR, NOT_REACHED = range(4)
# An emulated Cortex-M4F.
ARM = ["arm-none-eabi-gcc", "-std=gnu99", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
EMULATOR = ["qemu-system-arm", "-M", "mps2-an386", "-icount", "shift=7", "-nographic", "-semihosting", "-kernel"]
HAS_ARM = shutil.which(ARM[0]) and shutil.which(EMULATOR[0])
if not COMPILERS:
    print("neither gcc nor clang is there")
    sys.exit(77)


def run(*command, status=0, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
    assert done.returncode == status, (command, done.stdout, done.stderr)
    return done


def convert(robot, place, *options, status=0):
    return run(BIELLE, "convert", robot, "-o", place, *options, status=status)


def list_names(place):
    return sorted(re.sub(r"_test\.(c|cpp)$", "", name) for name in os.listdir(place) if re.search(r"_test\.c", name))


def build_test(place, name, compiler="gcc", standard="c99", end="c"):
    program = os.path.join(place, name + ".out")
    run(compiler, "-std=" + standard, "-O1", *STRICT, name + "." + end, name + "_test." + end, "-lm", "-o", program, cwd=place)
    return program


# Postures drawn at random in the range: joints to motors, motors to joints, and the ratio, without guesses. Prints a hash of all
# results, and, on Arm, the largest number of instructions: at this -icount, 40 of them are 128 ticks of SysTick.
SAMPLER = r"""
#include "NAME.c"
#include <stdio.h>
#include <string.h>
#ifdef __arm__
#define REGISTER(address) (*(volatile unsigned *)(address))
extern void _mainCRTStartup(void);
void reset(void) { REGISTER(0xE000ED88) |= 0xF00000; /* the floating-point unit */ _mainCRTStartup(); }
__attribute__((section(".vectors"), used)) void *const vectors[2] = {(void *)0x20100000, (void *)reset};
#define START() (REGISTER(0xE000E014) = 0xFFFFFF, REGISTER(0xE000E018) = 0, REGISTER(0xE000E010) = 5)
#define TICKS() (0xFFFFFF - REGISTER(0xE000E018))
#else
#define START() (void)0
#define TICKS() 0u
#endif
static unsigned state = 1, hash = 2166136261u, most;
static float draw(void) { return (float)((state = state * 1664525u + 1013904223u) >> 8) * (1.0f / 16777216.0f); }
static void add(const void *x, size_t n) { size_t i; for (i = 0; i < n; ++i) hash = (hash ^ ((const unsigned char *)x)[i]) * 16777619u; }
int main(void) {
  int n, i;
  for (n = 0; n < COUNT; ++n) {
    NAME_posture at, back;
    NAME_ratio ratio;
    float joint[NAME_SIZE];
    unsigned ticks;
    memset(&at, 0, sizeof at), memset(&back, 0, sizeof back);
    for (i = 0; i < NAME_SIZE; ++i) joint[i] = lower[i] + (upper[i] - lower[i]) * draw();
    START();
    NAME_joint_to_motor(joint, NULL, &at), NAME_motor_to_joint(at.motor, NULL, &back), NAME_update_ratio(&at, &ratio);
    ticks = TICKS();
    if (ticks > most) most = ticks;
    add(&at, sizeof at), add(&back, sizeof back), add(&ratio, sizeof ratio);
  }
  printf("%08x %u\n", hash, most);
  return 0;
}
"""


def run_on_arm(place, name, count):
    """Hashes of `count` postures here and on Arm, and there the largest number of instructions and, by -Os, the bytes of all functions."""
    source, host, arm = (os.path.join(place, name + end) for end in ("_sampler.c", "_host", "_arm"))
    with open(source, "w") as file:
        file.write(SAMPLER.replace("NAME", name).replace("COUNT", str(count)))
    run(COMPILERS[0], "-std=c99", "-O2", source, "-lm", "-o", host)
    run(*ARM, "-O2", "-fno-math-errno", source, "-lm", "--specs=rdimon.specs", "-Wl,--section-start=.vectors=0", "-o", arm)
    run(*ARM, "-Os", *STRICT, "-Wdouble-promotion", "-c", os.path.join(place, name + ".c"), "-o", arm + ".o")
    text, data = run("arm-none-eabi-size", arm + ".o").stdout.split("\n")[1].split()[:2]
    there, ticks = run(*EMULATOR, arm, stdin=subprocess.DEVNULL, timeout=300).stdout.split()
    return run(host).stdout.split()[0], there, int(ticks) * 40 // 128, int(text) + int(data)


class Linkage:
    """The functions of a linkage of one joint, in double, called from Python."""

    def __init__(self, place, name):
        path = os.path.join(place, name + ".so")
        run(COMPILERS[0], "-std=c99", "-O2", "-shared", "-fPIC", name + ".c", "-lm", "-o", path, cwd=place)
        self.library, self.name = ctypes.CDLL(path), name

    def call(self, function, *arguments, result=None):
        found = getattr(self.library, self.name + "_" + function)
        found.restype = result
        return found(*arguments)

    def solve(self, function, value):
        """Status, joint, motor."""
        at = (ctypes.c_double * 16)()
        status = self.call(function, (ctypes.c_double * 1)(value), None, at, result=ctypes.c_int)
        return status, at[0], at[1], at


# What of ros2_control its transmissions need: our own words for its interfaces.
ROS_STUBS = {
    "hardware_interface/hardware_info.hpp": """
#include <string>
#include <vector>
namespace hardware_interface {
struct JointInfo { std::string name; double mechanical_reduction = 1, offset = 0; };
using ActuatorInfo = JointInfo;
struct TransmissionInfo { std::string name; std::vector<JointInfo> joints; std::vector<ActuatorInfo> actuators; };
}
""",
    "hardware_interface/types/hardware_interface_type_values.hpp": """
namespace hardware_interface {
constexpr char HW_IF_POSITION[] = "position", HW_IF_VELOCITY[] = "velocity", HW_IF_EFFORT[] = "effort";
}
""",
    "pluginlib/class_list_macros.hpp": """
#define PLUGINLIB_EXPORT_CLASS(type, base) namespace { [[maybe_unused]] base* make() { return new type; } }
""",
    "transmission_interface/exception.hpp": """
#include <stdexcept>
namespace transmission_interface { using Exception = std::runtime_error; }
""",
    "transmission_interface/transmission.hpp": """
#include <string>
#include <vector>
namespace transmission_interface {
class Handle {
 public:
  Handle(const std::string& prefix, const std::string& interface, double* value) : prefix_(prefix), interface_(interface), value_(value) {}
  const std::string& get_prefix_name() const { return prefix_; }
  const std::string& get_interface_name() const { return interface_; }
  double get_value() const { return *value_; }
  bool set_value(double value) { *value_ = value; return true; }
 private:
  std::string prefix_, interface_;
  double* value_;
};
struct JointHandle : Handle { using Handle::Handle; };
struct ActuatorHandle : Handle { using Handle::Handle; };
class Transmission {
 public:
  virtual ~Transmission() = default;
  virtual void configure(const std::vector<JointHandle>&, const std::vector<ActuatorHandle>&) = 0;
  virtual void actuator_to_joint() = 0;
  virtual void joint_to_actuator() = 0;
  virtual std::size_t num_actuators() const = 0;
  virtual std::size_t num_joints() const = 0;
};
}
""",
    "transmission_interface/transmission_loader.hpp": """
#include <memory>
#include "hardware_interface/hardware_info.hpp"
#include "transmission_interface/transmission.hpp"
namespace transmission_interface {
struct TransmissionLoader {
  virtual ~TransmissionLoader() = default;
  virtual std::shared_ptr<Transmission> load(const hardware_interface::TransmissionInfo&) = 0;
};
}
""",
}
# main ACTUATOR OFFSET JOINT VELOCITY EFFORT: reads an actuator behind a gear of 50 that turns at 0.2 rad/s with 0.04 N m, commands a joint;
# then does both again where positions are unknown; then tells errors.
ROS_MAIN = r"""
#include "ros2_control.cpp"
#include <cstdio>
#include <cstdlib>
int main(int, char** argument) {
  const char* kinds[] = {"position", "velocity", "effort"};
  double actuator[3] = {std::atof(argument[1]), 0.2, 0.04}, joint[3] = {};
  std::vector<transmission_interface::JointHandle> joints;
  std::vector<transmission_interface::ActuatorHandle> actuators;
  for (int k = 0; k < 3; ++k) joints.emplace_back("rocker_joint", kinds[k], joint + k), actuators.emplace_back("gearbox", kinds[k], actuator + k);
  hardware_interface::TransmissionInfo info{"knee", {{"rocker_joint", 1, std::atof(argument[2])}}, {{"gearbox", 50, 0}}};
  const auto transmission = fourbar_linkages::rocker_joint_loader().load(info);
  transmission->configure(joints, actuators);
  transmission->actuator_to_joint();
  std::printf("%.17g %.17g %.17g ", joint[0], joint[1], joint[2]);
  for (int k = 0; k < 3; ++k) joint[k] = std::atof(argument[3 + k]);
  transmission->joint_to_actuator();
  std::printf("%.17g %.17g %.17g\n", actuator[0], actuator[1], actuator[2]);
  actuator[0] = joint[0] = NAN;
  transmission->joint_to_actuator();
  std::printf("%.17g ", actuator[0]);
  const double effort = actuator[2];
  transmission->actuator_to_joint();
  std::printf("%.17g %.17g\n", joint[0], effort);
  const auto say = [](const auto& work) {
    try {
      work();
    } catch (const transmission_interface::Exception& error) {
      std::printf("%s; ", error.what());
    }
  };
  info.joints[0].name = "knee";
  say([&] { fourbar_linkages::rocker_joint_loader().load(info); });
  info.joints[0].name = "rocker_joint", info.actuators[0].mechanical_reduction = 0;
  say([&] { fourbar_linkages::rocker_joint_loader().load(info); });
  say([&] { transmission->configure({}, actuators); });
  return 0;
}
"""

GROUND, CRANK, COUPLER, ROCKER = 0.4, 0.15, 0.35, 0.3


def calc_fourbar(rocker):
    """The crank of robots/fourbar for its rocker, by the angle between coupler and diagonal."""
    x, z = GROUND + ROCKER * math.cos(rocker), ROCKER * math.sin(rocker)
    diagonal = math.hypot(x, z)
    return math.atan2(z, x) + math.acos((diagonal**2 + CRANK**2 - COUPLER**2) / (2 * diagonal * CRANK))


class FirmwareTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(place.cleanup)
        cls.place = place.name
        cls.fourbar = os.path.join(cls.place, "fourbar")
        convert("fourbar", cls.fourbar, "--to", "c", "--postures", "500")
        cls.linkage = Linkage(cls.fourbar, "rocker_joint")
        with open(os.path.join(cls.fourbar, "rocker_joint.h")) as file:
            cls.low, cls.high = map(float, re.search(r"rocker_joint, ([\d.]+) to ([\d.]+) rad", file.read()).groups())

    def test_generated_tests_of_all_kinds(self):
        """Closed forms (four-bar, motors of an RSU), slides as struts, Newton's method; all compilers, without warnings."""
        for robot, precision, language in (("rsu_biped", "double", "c"), ("kangaroo_leg", "float", "c"), ("fourbar", "float", "cpp")):
            place = os.path.join(self.place, robot + precision)
            convert(robot, place, "--to", language, "--precision", precision, "--postures", "400")
            names = list_names(place)
            self.assertTrue(names)
            self.assertIn("README.md", os.listdir(place))
            for name in names if robot != "rsu_biped" else names[:1]:
                for compiler in COMPILERS:
                    program = build_test(place, name, *((compiler,) if language == "c" else
                                                        ({"gcc": "g++", "clang": "clang++"}[compiler], "c++11", "cpp")))
                    self.assertIn(": ok", run(program).stdout)
                with open(os.path.join(place, name + (".c" if language == "c" else ".cpp"))) as file:
                    text = file.read()
                self.assertNotRegex(text, r"malloc|while|goto")
                if precision == "float":  # no number or function of double
                    self.assertNotRegex(re.sub(r"/\*.*?\*/", "", text, flags=re.S), r"double|\d\.\d+(?![\d.]*(e[-+]?\d+)?f)|\b(sin|cos|sqrt)\(")

    def test_a_wrong_entry_is_noticed(self):
        place = os.path.join(self.place, "poisoned")
        for number, (found, wrong) in enumerate(((r"(ratio->motor_per_joint\[0\]\[0\] = )", r"\g<1>1.001 * "),
                                                 (r"(rate->motor_per_joint\[0\]\[0\] = )", r"\g<1>1.01 * "),
                                                 (r"(at->motor\[0\] = )\(", r"\g<1>1e-9 + ("))):
            shutil.copytree(self.fourbar, place + str(number))
            path = os.path.join(place + str(number), "rocker_joint.c")
            with open(path) as file:
                text = file.read()
            with open(path, "w") as file:
                file.write(re.sub(found, wrong, text))
            run(build_test(place + str(number), "rocker_joint"), status=1)
        run(build_test(self.fourbar, "rocker_joint"))

    def test_four_bar_in_closed_form(self):
        for i in range(1001):
            rocker = min(self.low + (self.high - self.low) * i / 1000, self.high)
            crank = calc_fourbar(rocker)
            status, joint, motor, at = self.linkage.solve("joint_to_motor", rocker)
            self.assertEqual(status, OK)
            self.assertLess(abs(motor - crank), 1e-12)
            status, joint, motor, at = self.linkage.solve("motor_to_joint", crank)
            self.assertEqual(status, OK)
            self.assertLess(abs(joint - rocker), 1e-12)
            self.assertEqual(self.linkage.call("on_branch", at, result=ctypes.c_int), 1)
        with open(os.path.join(self.fourbar, "rocker_joint.h")) as file:
            n = list(map(int, re.search(r"joint_to_motor: closed form; (\d+) mult\w+, \d+ add\w+, (\d+) div\w+, (\d+) root, (\d+) trig",
                                        file.read()).groups()))
        self.assertLessEqual(n[0], 60)
        self.assertEqual(n[2:], [1, 3])

    def test_hinges_that_cross_are_one_universal_joint(self):
        """An ankle in a file of MuJoCo, whose rods hang on a cross each: the motors in closed form, as published for such ankles."""
        place = os.path.join(self.place, "crossing")
        os.makedirs(place)
        for name, text in (("ankle.xml", CROSSING), ("ankle.yaml", "model: ankle.xml\nserial_joints: [pitch, roll]\n")):
            with open(os.path.join(place, name), "w") as file:
                file.write(text)
        maps = os.path.join(place, "maps")
        convert(os.path.join(place, "ankle.yaml"), maps, "--to", "c", "--postures", "400", "--range", "pitch", "-0.5", "0.5", "--range", "roll",
                "-0.2", "0.2")
        for compiler in COMPILERS:
            self.assertIn(": ok", run(build_test(maps, "pitch_roll", compiler)).stdout)
        with open(os.path.join(maps, "pitch_roll.h")) as file:
            text = file.read()
        self.assertIn("held at a distance: u1x, u2x\n", text)
        self.assertRegex(text, r"joint_to_motor: closed form; .* 2 roots, 6 trig")

        def turn_y(angle, p):
            c, s = math.cos(angle), math.sin(angle)
            return c * p[0] + s * p[2], p[1], c * p[2] - s * p[0]

        # Hinges of the cranks, from there the rods' upper ends, their lower ends on the foot, and their upper ends from these: at zero.
        ankle = Linkage(maps, "pitch_roll")
        for joints in ((-0.3, 0.1), (0.25, -0.2), (0.5, 0.2), (-0.5, -0.2), (0, 0)):
            at = (ctypes.c_double * 16)()
            self.assertEqual(ankle.call("joint_to_motor", (ctypes.c_double * 2)(*joints), None, at, result=ctypes.c_int), OK)
            for i, (hinge, crank, foot, rod) in enumerate((((-0.002, 0.036, 0.212), (-0.04, 0, 0.002), (-0.055, 0.03, 0.025), (0.01, 0.004, 0.2)),
                                                           ((-0.004, -0.04, 0.15), (-0.04, 0, 0.003), (-0.055, -0.032, 0.025), (0.008, -0.006, 0.14)))):
                c, s = math.cos(joints[1]), math.sin(joints[1])
                end = turn_y(joints[0], (foot[0] + 0.004, c * foot[1] - s * foot[2], s * foot[1] + c * foot[2] - 0.015))
                apart = [e - h for e, h in zip(end, hinge)]
                # The anchors are where the file's posture has them, a little off the rods' drawn ends.
                start = (foot[0] + 0.004, foot[1], foot[2] - 0.015)
                length = math.dist([h + k for h, k in zip(hinge, crank)], start)
                A = crank[0] * apart[0] + crank[2] * apart[2]
                B = crank[2] * apart[0] - crank[0] * apart[2]
                C = (sum(x * x for x in apart) + sum(x * x for x in crank) - length**2) / 2 - crank[1] * apart[1]
                middle, off = math.atan2(B, A), math.acos(C / math.hypot(A, B))
                self.assertLess(min(abs((at[2 + i] - middle - sign * off + math.pi) % (2 * math.pi) - math.pi) for sign in (1, -1)), 1e-12)

    def test_rods_in_single_precision(self):
        """The length of a rod and the distance of its pivots cancel before they are rounded; iterations are enough for the last to be small."""
        for part, most in (("four_bar", 3e-6), ("stephenson", 6e-6)):
            robot, maps = os.path.join(self.place, part), os.path.join(self.place, part + "_maps")
            run(BIELLE, "generate", "leg_biped", "--set", "knee=" + part, "--set", "ankle=serial", "--set", "hip=serial", "-o", robot)
            convert(robot, maps, "--to", "c", "--precision", "float", "--postures", "4000")
            self.assertIn(": ok", run(build_test(maps, "knee_left")).stdout)
            with open(os.path.join(maps, "knee_left.h")) as file:
                self.assertLess(read_header(file.read())[0], most)

    def test_out_of_range_and_no_numbers(self):
        for value, expected in ((self.high + 0.1, self.high), (self.low - 5, self.low), (math.inf, self.high), (math.nan, self.low)):
            status, joint, motor, _ = self.linkage.solve("joint_to_motor", value)
            self.assertEqual((status, joint), (CLAMPED, expected))
            self.assertLess(abs(motor - calc_fourbar(expected)), 1e-12)
        for value in (math.nan, -math.inf, 0.0, 100.0):
            status, joint, motor, _ = self.linkage.solve("motor_to_joint", value)
            self.assertEqual(status, CLAMPED)
            self.assertLess(abs(motor - calc_fourbar(joint)), 1e-8)

    def test_rates_torques_gains_limits(self):
        def make(*numbers):
            return (ctypes.c_double * len(numbers))(*numbers)

        h = 1e-5
        for rocker in (1.7, 2.0, 2.5):
            at = self.linkage.solve("joint_to_motor", rocker)[3]
            ratio, rate, out = make(0, 0), make(0, 0), make(0)
            self.linkage.call("update_ratio", at, ratio)
            R = (calc_fourbar(rocker + h) - calc_fourbar(rocker - h)) / (2 * h)
            self.assertLess(abs(ratio[0] - R), 1e-7 * abs(R))
            self.assertLess(abs(ratio[0] * ratio[1] - 1), 1e-14)
            self.linkage.call("update_ratio_rate", at, ratio, make(0.7), rate)
            self.assertLess(abs(rate[0] - 0.7 * (calc_fourbar(rocker + h) - 2 * calc_fourbar(rocker) + calc_fourbar(rocker - h)) / h**2),
                            2e-4 * abs(rate[0]))
            self.assertLess(abs(rate[1] + rate[0] / R**2), 1e-6 * abs(rate[1]))

            # Weight of crank and coupler, of 2 kg/m each; the rocker is part of the serial model.
            def calc_energy(rocker):
                z_crank, z_rocker = CRANK * math.sin(calc_fourbar(rocker)), ROCKER * math.sin(rocker)
                return 9.81 * 2 * (CRANK * z_crank / 2 + COUPLER * (z_crank + z_rocker) / 2)

            held = make(0)
            self.linkage.call("held_torque", at, ratio, make(0, 0, -9.81), held)
            self.assertLess(abs(held[0] - (calc_energy(rocker + h) - calc_energy(rocker - h)) / (2 * h)), 1e-6)
            motor, joint = make(0), make(0)
            self.linkage.call("motor_torque", ratio, make(3), held, motor)
            self.assertLess(abs(motor[0] * R - 3 - held[0]), 1e-6)
            self.linkage.call("joint_torque", ratio, motor, held, joint)
            self.assertLess(abs(joint[0] - 3), 1e-13)
            # 10 N m and 20 rad/s of the motor.
            self.assertLess(abs(self.linkage.call("torque_limit", ratio, None, make(0), make(1), result=ctypes.c_double) - 10 * abs(R)), 1e-5)
            self.assertLess(abs(self.linkage.call("torque_limit", ratio, held, make(0), make(1), result=ctypes.c_double) -
                                (10 * abs(R) - math.copysign(1, R) * held[0] * math.copysign(1, R))), 1e-5)
            self.assertLess(abs(self.linkage.call("speed_limit", ratio, make(-1), result=ctypes.c_double) - 20 / abs(R)), 1e-5)
            gain, left = make(0), make(0)
            self.linkage.call("motor_gain", ratio, make(50), gain, left)
            self.assertLess(abs(gain[0] - 50 / R**2), 1e-4)
            self.assertLess(abs(left[0]), 1e-12)
            self.linkage.call("joint_gain", ratio, gain, out)
            self.assertLess(abs(out[0] - 50), 1e-12)
        # At the upper end the crank is next to where the rocker turns back: crank and coupler in line.
        at = self.linkage.solve("joint_to_motor", self.high)[3]
        distance = self.linkage.call("dead_point_distance", at, result=ctypes.c_double)
        end = math.pi - math.acos((GROUND**2 + ROCKER**2 - (COUPLER - CRANK) ** 2) / (2 * GROUND * ROCKER))
        crank = math.atan2(ROCKER * math.sin(end), GROUND + ROCKER * math.cos(end)) + math.pi
        self.assertLess(abs(distance - abs(crank - at[1])), 0.2 * distance)

    def test_numpy(self):
        """The same formulas, over many postures at once."""
        try:
            import numpy as np
        except ImportError:
            self.skipTest("NumPy is not installed")
        place = os.path.join(self.place, "arrays")
        convert("fourbar", place, "--to", "numpy", "--postures", "200")
        convert("rsu_biped", os.path.join(place, "ankles"), "--to", "numpy", "--postures", "200")
        sys.path[:0] = [place, os.path.join(place, "ankles")]
        import ankley_left_anklex_left as ankle
        import rocker_joint as rocker

        angles = np.linspace(self.low, self.high, 301)[:, None]
        motors, inside = rocker.joint_to_motor(angles)
        self.assertTrue(inside.all())
        self.assertLess(max(abs(motors[i, 0] - calc_fourbar(angles[i, 0])) for i in range(301)), 1e-12)
        self.assertFalse(rocker.joint_to_motor([self.high + 0.1])[1])
        self.assertTrue(np.isfinite(rocker.joint_to_motor([np.nan])[0]).all())
        at, ratio, held = self.linkage.solve("joint_to_motor", 2.0)[3], (ctypes.c_double * 2)(), (ctypes.c_double * 1)()
        self.linkage.call("update_ratio", at, ratio)
        self.linkage.call("held_torque", at, ratio, (ctypes.c_double * 3)(0, 0, -9.81), held)
        self.assertLess(abs(rocker.held_torque([2.0])[0] - held[0]), 1e-13)
        # Two joints: there and back, rates by differences, power.
        share = np.random.default_rng(0).uniform(0.05, 0.95, (500, 2))
        joints = ankle.LOWER + share * (ankle.UPPER - ankle.LOWER)
        motors, inside = ankle.joint_to_motor(joints)
        self.assertTrue(inside.all())
        back, inside = ankle.motor_to_joint(motors)
        self.assertTrue(inside.all())
        self.assertLess(abs(back - joints).max(), 1e-12)
        h, v = 1e-6, np.array([0.3, -0.8])
        R, S = ankle.ratio(joints)
        change = (ankle.joint_to_motor(joints + h * v)[0] - ankle.joint_to_motor(joints - h * v)[0]) / (2 * h)
        self.assertLess(abs(change - ankle.motor_velocity(joints, v)).max(), 1e-7)
        change = (ankle.ratio(joints + h * v)[0] - ankle.ratio(joints - h * v)[0]) / (2 * h)
        rate = ankle.ratio_rate(joints, v * np.ones_like(joints))
        self.assertLess(abs(change - rate).max(), 1e-6 * abs(rate).max())
        torques = np.array([5.0, 2.0]) * np.ones_like(joints)
        self.assertLess(abs((ankle.motor_torque(joints, torques) * (R @ v)).sum(-1) - torques @ v).max(), 1e-12)
        self.assertLess(abs(ankle.joint_torque(joints, ankle.motor_torque(joints, torques, (0, 0, -9.81)), (0, 0, -9.81)) - torques).max(), 1e-12)

    def test_own_functions_of_single_precision(self):
        source, library = os.path.join(self.place, "own.c"), os.path.join(self.place, "own.so")
        with open(source, "w") as file:
            for name in ("sine", "arctangent"):
                with open(os.path.join(SOURCE, "src", "firmware", name + ".h")) as text:
                    file.write(text.read().replace("static ", "", 1))
        run(COMPILERS[0], "-std=c99", "-O2", "-shared", "-fPIC", *STRICT, source, "-o", library)
        own = ctypes.CDLL(library)
        own.sine.restype = own.arctangent.restype = ctypes.c_float
        single = lambda x: ctypes.c_float(x).value
        sine = lambda x, n: own.sine(ctypes.c_float(x), n)
        arctangent = lambda y, x: own.arctangent(ctypes.c_float(y), ctypes.c_float(x))
        for i in range(-20000, 20001):
            for x in (single(i * 3.1e-4), single(i * 0.2047)):
                for n in (-1, 0, 1, 2):
                    self.assertLess(abs(sine(x, n) - math.sin(x + n * math.pi / 2)), 1e-7)
            y, x = single(3.7 * math.sin(i * 1.57e-4)), single(3.7 * math.cos(i * 1.57e-4))
            exact = math.atan2(y, x)
            self.assertLessEqual(abs(arctangent(y, x) - exact), 3.1 * 2.0 ** (math.frexp(exact)[1] - 24))
        self.assertEqual([sine(x, n) for x in (math.nan, math.inf, -5000, 1e30) for n in (0, 1)], [0, 1] * 4)
        self.assertEqual((arctangent(0, 0), arctangent(0, -1), arctangent(-2, 0)), (0, single(math.pi), -single(math.pi / 2)))

    def test_torch(self):
        """The text of NumPy's module, with tensors."""
        modules = {}
        for kind in ("numpy", "torch"):
            place = os.path.join(self.place, kind + "_ankles")
            convert("rsu_biped", place, "--to", kind, "--postures", "200")
            path = os.path.join(place, "ankley_left_anklex_left.py")
            with open(path) as file:
                text = file.read()
            modules[kind] = path, text[text.index("\nSIZE = "):]
        self.assertEqual(modules["numpy"][1], modules["torch"][1])
        try:
            import numpy as np
            import torch
        except ImportError:
            self.skipTest("NumPy or PyTorch is not installed")
        arrays, tensors = (importlib.machinery.SourceFileLoader(kind + "_ankle", modules[kind][0]).load_module() for kind in modules)
        joints = arrays.LOWER + np.random.default_rng(0).uniform(-0.05, 1.05, (200, 2)) * (arrays.UPPER - arrays.LOWER)
        joints[0, 0] = np.nan
        motors = arrays.joint_to_motor(np.clip(joints, arrays.LOWER, arrays.UPPER))[0]
        for name, arguments in (("joint_to_motor", (joints,)), ("motor_to_joint", (motors,)), ("ratio", (joints,)), ("ratio_rate", (joints, joints)),
                                ("held_torque", (joints,)), ("motor_velocity", (joints, motors)), ("motor_torque", (joints, motors, (0, 0, -9.81))),
                                ("joint_torque", (joints, motors)), ("clip_joint_torque", (joints, motors)), ("reflected_inertia", (joints,))):
            # The clamped postures of numbers that are none have rates of none.
            wanted, found = (getattr(module, name)(*arguments) for module in (arrays, tensors))
            for a, b in zip(*((x if isinstance(x, tuple) else (x,)) for x in (wanted, found))):
                self.assertLess(np.nanmax(abs(a * 1.0 - b.double().numpy()), initial=0), 1e-10 * max(1, np.nanmax(abs(a * 1.0), initial=0)), name)
                self.assertTrue((np.isnan(a * 1.0) == np.isnan(b.double().numpy())).all(), name)
        # R is the gradient of the motors' positions.
        inner = torch.as_tensor(joints[1:].clip(arrays.LOWER + 1e-3, arrays.UPPER - 1e-3)).requires_grad_()
        motors = tensors.joint_to_motor(inner)[0]
        rows = [torch.autograd.grad(motors[:, i].sum(), inner, retain_graph=True)[0] for i in range(2)]
        self.assertLess((torch.stack(rows, 1) - tensors.ratio(inner)[0]).abs().max().item(), 1e-9)

    @unittest.skipUnless(HAS_ARM, "arm-none-eabi-gcc and qemu-system-arm are not installed")
    def test_the_same_bits_on_arm(self):
        place = os.path.join(self.place, "arm")
        convert("rsu_biped", place, "--to", "c", "--precision", "float", "--postures", "400")
        here, there, instructions, size = run_on_arm(place, "ankley_left_anklex_left", 1000)
        self.assertEqual(here, there)
        self.assertLess(instructions, 10000)
        self.assertLess(size, 8192)
        source = os.path.join(place, "ankley_left_anklex_left.c")
        with open(source) as file:
            text = file.read()
        # Nothing is fused, in C++ either, where no standard forbids it; without the pragma much is.
        pragma = '#pragma GCC optimize("fp-contract=off")'
        self.assertIn(pragma, text)
        for language, standard in (("c", "gnu99"), ("c++", "c++11")):
            for code, is_fused in ((text, False), (text.replace(pragma, ""), True)):
                made = run(*ARM, "-O2", "-x", language, "-std=" + standard, "-S", "-", "-o", "-", "-I", place, input=code).stdout
                self.assertEqual("vfma" in made, is_fused, standard)
        # Another last bit of a constant is noticed.
        with open(source, "w") as file:
            file.write(text.replace("0.166666552f", "0.166666567f"))
        self.assertNotEqual(run_on_arm(place, "ankley_left_anklex_left", 1000)[0], here)

    def test_transmissions_of_ros2_control(self):
        """Compiled against stubs of its interfaces, as published."""
        place = os.path.join(self.place, "ros")
        convert("fourbar", place, "--to", "ros2_control", "--postures", "200")
        for name, text in ROS_STUBS.items():
            path = os.path.join(place, "stubs", name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w") as file:
                file.write("#pragma once\n" + text)
        with open(os.path.join(place, "main.cpp"), "w") as file:
            file.write(ROS_MAIN)
        program = os.path.join(place, "main")
        run("g++", "-std=c++17", "-O1", *STRICT, "-Istubs", "main.cpp", "rocker_joint.cpp", "-o", program, cwd=place)
        rocker, rate, torque, gear, offset, h = 2.0, 0.3, 5.0, 50.0, 0.1, 1e-5
        crank = calc_fourbar(rocker)
        R = (calc_fourbar(rocker + h) - calc_fourbar(rocker - h)) / (2 * h)
        read, unread, said = run(program, repr(gear * crank), repr(offset), repr(rocker + offset), repr(rate), repr(torque)).stdout.strip().split("\n")
        for found, wanted in zip(map(float, read.split()), (rocker + offset, 0.2 / gear / R, 0.04 * gear * R, gear * crank, gear * R * rate, torque / R / gear)):
            self.assertLess(abs(found - wanted), 1e-8 * (1 + abs(wanted)))
        # What nobody has measured or commanded is none; efforts are carried over where the robot was measured last.
        unread = list(map(float, unread.split()))
        self.assertTrue(all(map(math.isnan, unread[:2])))
        self.assertLess(abs(unread[2] - torque / R / gear), 1e-8)
        self.assertRegex(said, r"joint 'rocker_joint' is missing.*its reduction is zero.*no interface")
        with open(os.path.join(place, "ros2_control_plugins.xml")) as file:
            self.assertIn('type="fourbar_linkages::rocker_joint_loader"', file.read())
        with open(os.path.join(place, "README.md")) as file:
            self.assertIn("<plugin>fourbar_linkages/rocker_joint</plugin>", file.read())

    def test_bad_input_writes_nothing(self):
        place = os.path.join(self.place, "nothing")
        for robot, options, said in (
                ("fourbar", ("--range", "rocker_joint", "1", "2.5"), r"joint 'rocker_joint': its range from 1 to 2.5 contains a dead point.* "
                 r"between 1\.\d+ and 1\.\d+; .*--range rocker_joint LOW HIGH"),
                ("fourbar", ("--range", "knee", "1", "2"), r"--range knee.*it is no serial joint.*rocker_joint"),
                ("fourbar", ("--range", "rocker_joint", "2", "1"), r"is no range"),
                ("fivebar", (), r"serial_joints"),
                ("cleobot", (), r"serial_joints")):
            error = convert(robot, place, "--to", "c", *options, status=2).stderr
            self.assertRegex(error, said)
            self.assertFalse(os.path.exists(place))
        # The remedies help.
        convert("fourbar", place, "--to", "c", "--range", "rocker_joint", "1.7", "2.5", "--postures", "100")
        # A name that C does not know.
        other = os.path.join(self.place, "renamed", "fourbar")
        shutil.copytree(os.path.join(SOURCE, "robots", "fourbar"), other)
        for name in ("fourbar.urdf", "fourbar.yaml"):
            with open(os.path.join(other, name)) as file:
                text = file.read()
            with open(os.path.join(other, name), "w") as file:
                file.write(text.replace("rocker_joint", "rocker-joint"))
        error = convert(other, os.path.join(self.place, "none"), "--to", "c", status=2).stderr
        self.assertRegex(error, "joint 'rocker-joint': its name cannot be one of C.*rename")
        self.assertFalse(os.path.exists(os.path.join(self.place, "none")))

    def test_directory_is_whole_or_as_it_was(self):
        place = os.path.join(self.place, "again")
        convert("fourbar", place, "--to", "c", "--postures", "100")
        before = {name: os.path.getmtime(os.path.join(place, name)) for name in os.listdir(place)}
        convert("fourbar", place, "--to", "c", "--postures", "100")  # replaced
        self.assertEqual(set(before), set(os.listdir(place)))
        with open(os.path.join(place, "mine.txt"), "w") as file:
            file.write("notes")
        error = convert("fourbar", place, "--to", "c", "--postures", "100", status=2).stderr
        self.assertIn("'mine.txt'", error)
        self.assertEqual(set(before) | {"mine.txt"}, set(os.listdir(place)))
        self.assertFalse([name for name in os.listdir(self.place) if ".part" in name])
        convert("fourbar", os.path.join(self.place, "no", "such"), "--to", "c", "--postures", "100", status=2)


ROBOTS = ("fourbar", "bipetto", "rsu_biped", "kangaroo_leg", "humanoid", "leg_biped", "belt_biped", "differential_ankle", "spring_biped",
          "spring_leg")
# Parts whose motors do not determine serial joints through a linkage, and what their maps are refused for.
NO_MAP = {("knee", "leaf"): "1 motor for a mobility of 2", ("knee", "parallel_spring"): "none has motors",
          ("hip", "parallel_spring"): "none has motors", ("ankle", "cable_differential"): "3 motors for a mobility of 2"}
NO_LINKAGE = {("knee", "serial"), ("knee", "passive"), ("ankle", "serial"), ("hip", "serial")}
# The whole range of a hip on three cranks has postures that are reached from the guess alone.
RANGES = {("hip", "three_rrs"): [word for side in ("left", "right") for name in ("hipx", "hipy", "hipz")
                                 for word in ("--range", f"{name}_{side}", "-0.3", "0.3")]}
CROSSING = """<mujoco model="crossing"><compiler angle="radian" autolimits="true"/><default><geom type="capsule" size="0.006" density="2000"/></default>
<worldbody><body name="shank" pos="0 0 0.6"><geom fromto="0 0 0 0 0 -0.3"/>
  <body name="cross" pos="0 0 -0.3"><joint name="pitch" axis="0 1 0" range="-0.8 0.6"/><inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/>
    <body name="foot" pos="0.004 0 -0.015"><joint name="roll" axis="1 0 0" range="-0.35 0.35"/><geom type="box" size="0.1 0.04 0.01" mass="0.6"/>
      <body name="u1" pos="-0.055 0.03 0.025"><joint name="u1y" axis="0 1 0"/><inertial pos="0 0 0" mass="0.004" diaginertia="2e-7 2e-7 2e-7"/>
        <body name="rod1"><joint name="u1x" axis="1 0 0"/><geom fromto="0 0 0 0.01 0.004 0.2"/></body></body>
      <body name="u2" pos="-0.055 -0.032 0.025"><joint name="u2y" axis="0 1 0"/><inertial pos="0 0 0" mass="0.004" diaginertia="2e-7 2e-7 2e-7"/>
        <body name="rod2"><joint name="u2x" axis="1 0 0"/><geom fromto="0 0 0 0.008 -0.006 0.14"/></body></body></body></body>
  <body name="m1" pos="-0.002 0.036 -0.088"><joint name="motor1" axis="0 1 0" range="-1.2 1.2"/><geom fromto="0 0 0 -0.04 0 0.002"/></body>
  <body name="m2" pos="-0.004 -0.04 -0.15"><joint name="motor2" axis="0 1 0" range="-1.2 1.2"/><geom fromto="0 0 0 -0.04 0 0.003"/></body>
</body></worldbody>
<equality><connect body1="m1" body2="rod1" anchor="-0.04 0 0.002"/><connect body1="m2" body2="rod2" anchor="-0.04 0 0.003"/></equality>
<actuator><motor joint="motor1"/><motor joint="motor2"/></actuator></mujoco>
"""


def list_parts(kind):
    return sorted(name[:-len(".yaml")] for name in os.listdir(os.path.join(SOURCE, "robots/parts", kind)))


def generate(place, kind, part):
    """A biped with one part and serial joints elsewhere."""
    out = os.path.join(place, kind + "_" + part)
    sets = [f"{other}={part if other == kind else 'serial'}" for other in ("knee", "ankle", "hip")]
    run(BIELLE, "generate", "leg_biped", *(word for one in sets for word in ("--set", one)), "-o", out)
    return out


def read_header(text):
    """Largest error, rad or m; largest entry of the ratio; how the ways are computed."""
    errors = list(map(float, re.search(r"motors (\S+), joints (\S+) ", text).groups()))
    ways = []
    for function in ("joint_to_motor", "motor_to_joint"):
        how, n, roots, calls = re.search(function + r": (.*); (\d+) mult.* (\d+) roots?, (\d+) trig", text).groups()
        steps = re.search(r"(\d+) iteration", how)
        ways.append((steps.group(1) + " steps" if steps else "closed") + f": {n}, {roots}, {calls}")
    return max(errors), float(re.search(r"Largest entry of R: (\S+);", text).group(1)), ways


class AllTest(unittest.TestCase):
    def check(self, title, robot, place, *options):
        texts = {}
        for precision in ("double", "float"):
            out = os.path.join(place, title.replace(" ", "_"), precision)
            os.makedirs(os.path.dirname(out), exist_ok=True)
            convert(robot, out, "--to", "c", "--precision", precision, "--postures", POSTURES, *options)
            for name in list_names(out):
                for compiler in COMPILERS:
                    self.assertIn(": ok", run(build_test(out, name, compiler)).stdout)
                with open(os.path.join(out, name + ".h")) as file:
                    texts[name, precision] = file.read()
        names = sorted({name for name, _ in texts})
        self.assertTrue(names, title)
        for name in names:
            error, ratio, ways = read_header(texts[name, "double"])
            in_float = read_header(texts[name, "float"])[0]
            self.assertLess(error, 1e-12, name)
            instructions = size = "-"
            if HAS_ARM:
                here, there, instructions, size = run_on_arm(os.path.join(place, title.replace(" ", "_"), "float"), name, int(POSTURES))
                self.assertEqual(here, there, name)
            print(f"| {title}: {name} | {ways[0]} | {ways[1]} | {error:.1e} | {in_float:.1e} | {in_float / (2e-6 * max(1, ratio)):.2f} | "
                  f"{instructions} | {size} |", flush=True)

    def test_all(self):
        print("| linkage | joint to motor | motor to joint | error (double) | error (float) | over goal | instructions | bytes |\n"
              "|---|---|---|---|---|---|---|---|")
        with tempfile.TemporaryDirectory() as place:
            for robot in ROBOTS:
                self.check(robot, robot, place)
            for kind in ("knee", "ankle", "hip"):
                for part in list_parts(kind):
                    if (kind, part) in NO_LINKAGE:
                        continue
                    robot = generate(place, kind, part)
                    if (kind, part) in NO_MAP:
                        self.assertIn(NO_MAP[kind, part], convert(robot, robot + "_c", "--to", "c", status=2).stderr)
                        continue
                    self.check(f"{kind} {part}", robot, place, *RANGES.get((kind, part), ()))
            for name, text in (("crossing.xml", CROSSING), ("crossing.yaml", "model: crossing.xml\nserial_joints: [pitch, roll]\n")):
                with open(os.path.join(place, name), "w") as file:
                    file.write(text)
            self.check("ankle of crossing rods", os.path.join(place, "crossing.yaml"), place, "--range", "pitch", "-0.55", "0.55", "--range", "roll", "-0.25", "0.25")


if __name__ == "__main__":
    unittest.main(defaultTest="AllTest" if ALL else "FirmwareTest")
