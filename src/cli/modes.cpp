// bielle modes: frequencies, damping and shapes of small motions about a posture.
#include "bielle/dynamics/modes.h"

#include <algorithm>
#include <iostream>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/motion.h"
#include "cli/commands.h"
#include "cli/table.h"
#include "report/mode_view.h"
#include "results/option_flags.h"
#include "results/output_place.h"

namespace bielle::cli {
namespace {

// Accelerations above it, m/s^2 or rad/s^2, are no rounding.
constexpr double kRest = 1e-6;
constexpr size_t kListed = 4;       // joints by name, otherwise their number
constexpr int kShown = 3;           // joints of a shape in the table
constexpr double kSmallest = 0.01;  // share of the largest one that is still shown

struct ModesArguments {
  RobotArgument robot;
  std::string reference;
  std::vector<std::string> locked;
  std::string output;
  std::optional<double> contact_stiffness;  // N/m
  bool lock_motors = false, in_the_air = false, json = false;
};

void describe(OptionFields& f, ModesArguments& a) {
  f.text("reference", a.reference, "at this reference of the robot; default: its starting posture, or one that closes");
  f.flag("lock_motors", a.lock_motors, "joints with motors stand still");
  f.number("contact_stiffness", a.contact_stiffness, "N/m", kPositive,
           "of every sole in all directions, shared by its corners; by default soles stand still");
  f.flag("in_the_air", a.in_the_air, "the robot does not stand on its contacts");
  f.flag("json", a.json, "print JSON, with all of the shapes");
}

struct ModesReport {
  std::string posture;
  std::vector<std::string> contacts, locked;
  std::vector<int> standing;  // contacts that do not move
  VectorXd q, u;
  Modes modes;
};

VectorXd findPosture(const LoadedRobot& robot, const std::string& reference) {
  const Model& model = robot.model;
  if (reference.empty() && !model.references().empty()) return makeStandingPosture(model);
  const AssemblyResult result =
      reference.empty() ? findClosedConfiguration(model) : assembleReference(model, reference);
  if (result.status != NumericalStatus::Ok)
    throw InputError(robot.path(), reference.empty() ? "posture" : "reference '" + reference + "'", result.message,
                     "choose another one");
  return result.q;
}

int findLocked(const LoadedRobot& robot, const std::string& name) {
  const int joint = robot.model.findJoint(name);
  if (joint <= 0)
    throw InputError(robot.path(), "joint '" + name + "'", "the robot has no such joint", "correct the name");
  if (robot.model.joints()[joint].nv != 1)
    throw InputError(robot.path(), "joint '" + name + "'", "it has several coordinates",
                     "lock joints of one coordinate");
  return joint;
}

ModesReport analyse(const LoadedRobot& robot, const ModesArguments& arguments) {
  const Model& model = robot.model;
  ModesReport report;
  report.q = findPosture(robot, arguments.reference);
  report.posture = !arguments.reference.empty() ? "reference " + arguments.reference
                   : model.references().empty() ? "a closed posture"
                                                : "its starting posture";
  std::vector<int> contacts;
  if (!arguments.in_the_air)
    for (size_t c = 0; c < model.contacts().size(); ++c) {
      contacts.push_back(static_cast<int>(c));
      report.contacts.push_back(model.contacts()[c].name);
    }
  ConstraintSet constraints = makeConstraintSet(model, makeContactTargets(model, report.q, contacts, 0, 0));
  std::vector<int> locked;
  for (const std::string& name : arguments.locked) locked.push_back(findLocked(robot, name));
  if (arguments.lock_motors)
    for (const Motor& motor : model.motors())
      if (model.joints()[motor.joint].nv == 1) locked.push_back(motor.joint);
  std::sort(locked.begin(), locked.end());
  locked.erase(std::unique(locked.begin(), locked.end()), locked.end());
  report.u = calcStaticTorques(model, constraints, report.q).u;
  for (const int joint : locked) {
    addLock(model, report.q, joint, constraints);
    report.locked.push_back(model.joints()[joint].name);
  }
  report.standing = contacts;
  const VectorXd tau = calcMotorForces(model, report.u);
  report.modes = calcModes(model, constraints, report.q, tau);
  if (arguments.contact_stiffness && !contacts.empty() && report.modes.status == NumericalStatus::Ok) {
    const Model compliant =
        makeCompliantContacts(model, constraints, report.q, report.modes.lambda, *arguments.contact_stiffness);
    ConstraintSet loops = makeConstraintSet(compliant);
    for (const int joint : locked) addLock(compliant, report.q, joint, loops);
    report.standing.clear();
    report.modes = calcModes(compliant, loops, report.q, tau);
  }
  if (report.modes.status != NumericalStatus::Ok) throw std::runtime_error(getMessage(report.modes.status));
  return report;
}

Json listComponents(const VectorXd& vector) { return std::vector<double>(vector.begin(), vector.end()); }

Json describe(const Model& model, const ModesReport& report) {
  Json modes = Json::array();
  for (const Mode& mode : report.modes.modes)
    modes.push_back({{"frequency", mode.frequency},
                     {"damping", mode.damping},
                     {"eigenvalue", {mode.eigenvalue.real(), mode.eigenvalue.imag()}},
                     {"shape", listComponents(mode.shape.real())},
                     {"shape_imaginary", listComponents(mode.shape.imag())}});
  return {{"robot", model.name()},
          {"order", makeVelocityNames(model)},
          {"q", listComponents(report.q)},
          {"torques", listComponents(report.u)},
          {"contacts", report.contacts},
          {"locked", report.locked},
          {"mobility", report.modes.N.cols()},
          {"acceleration", report.modes.acceleration},
          {"at_rest", report.modes.acceleration < kRest},
          {"modes", modes}};
}

// The coordinates that move most, with their sizes; their phases where they are not together.
std::string describeShape(const std::vector<std::string>& names, const Eigen::VectorXcd& shape) {
  std::vector<int> order(shape.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return std::abs(shape[a]) > std::abs(shape[b]) * (1 + 1e-9); });
  std::string text;
  for (int i = 0; i < std::min<int>(kShown, shape.size()); ++i) {
    const std::complex<double> entry = shape[order[i]];
    if (std::abs(entry) < kSmallest) break;
    text += (i ? ", " : "") + names[order[i]] + formatNumber(entry.real(), " %.2f");
    if (std::abs(entry.imag()) > kSmallest) text += formatNumber(entry.imag(), "%+.2fi");
  }
  return text;
}

void print(std::ostream& out, const Model& model, const ModesReport& report) {
  const auto list = [](const std::vector<std::string>& names) {
    if (names.size() > kListed) return std::to_string(names.size()) + " joints";
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  };
  out << "modes of " << model.name() << " at " << report.posture << "\n";
  std::vector<Row> facts = {{"freedoms", std::to_string(report.modes.N.cols())}};
  if (!report.contacts.empty()) facts.push_back({"stands on", list(report.contacts)});
  if (!report.locked.empty()) facts.push_back({"locked", list(report.locked)});
  facts.push_back({"at rest", report.modes.acceleration < kRest
                                  ? "yes"
                                  : "no: accelerations of up to " + formatNumber(report.modes.acceleration, "%.3g")});
  printTable(out, facts);
  if (report.modes.modes.empty()) return;
  const std::vector<std::string> names = makeVelocityNames(model);
  std::vector<Row> rows = {{"frequency [Hz]", "damping", "s [1/s]", "moves most"}};
  for (const Mode& mode : report.modes.modes) {
    const bool is_real = mode.eigenvalue.imag() == 0;
    rows.push_back(
        {is_real ? "-" : formatNumber(mode.frequency, "%.4g"), is_real ? "-" : formatNumber(mode.damping, "%.3g"),
         formatNumber(mode.eigenvalue.real(), "%.3g") + (is_real ? "" : formatNumber(mode.eigenvalue.imag(), "%+.4gi")),
         describeShape(names, mode.shape)});
  }
  printTable(out, rows);
}

int run(const ModesArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  const std::string& page = arguments.output;
  if (!page.empty()) requireApart(page, listFiles(robot));
  const ModesReport report = analyse(robot, arguments);
  if (!page.empty()) writeModeView(page, robot, report.q, report.standing, report.modes.modes);
  if (arguments.json)
    std::cout << formatJson(describe(robot.model, report)) << "\n";
  else
    print(std::cout, robot.model, report);
  if (!page.empty() && !arguments.json) std::cout << page << "\n";
  return kOk;
}

}  // namespace

void addModes(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<ModesArguments>();
  addRobot(command, arguments->robot);
  command.add_option("--lock", arguments->locked, "joints that stand still");
  command.add_option("-o,--output", arguments->output, "a page on which the robot swings in its modes");
  addFlags(*arguments, command);
  addRobotFlags(command, arguments->robot);
  command.footer(
      "Motors that are not locked keep the torques that hold the posture, as far as they can. Springs, dampers, "
      "gravity "
      "and\n"
      "the forces of closures and contacts count. A mode moves as e^(s t): a frequency\n"
      "|Im s| / 2 pi and a damping ratio -Re s / |s|, or without oscillation, falling over if s > 0. Its shape shows "
      "the\n"
      "coordinates that move most, relative to the largest one (rad, m). Where the robot is not at rest, modes tell "
      "how\n"
      "neighbouring motions part.\n"
      "Examples:\n"
      "  bielle modes spring_biped --lock-motors -o modes.html\n"
      "  bielle modes fourbar --json");
  command.callback([&action, arguments] { action = [=] { return run(*arguments); }; });
}

}  // namespace bielle::cli
