#include "cli/synthesis.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/linkage.h"
#include "bielle/model/error.h"
#include "bielle/motion/registry.h"
#include "bielle/robots/robot_loader.h"
#include "cli/parameter_range.h"
#include "design/robot_ratios.h"
#include "design/spec.h"
#include "formats/text_file.h"
#include "formats/yaml_tree.h"
#include "model/number_text.h"
#include "robots/generator_entry.h"

namespace bielle::cli {
namespace {

constexpr int kRefinement = 10;       // evaluations from every robot of the front
constexpr double kMarginShare = 0.9;  // of the margin from dead points that a joint has at the largest ratio

GeneratorEntry findEntry(const std::string& robot) {
  const std::string file = findRobotFile(robot);
  std::optional<GeneratorEntry> entry = readGeneratorOf(file);
  if (!entry)
    throw InputError(file, "robot", "it is given by its figures and has no parameters",
                     "give a robot of a generator, or one composed of parts");
  return std::move(*entry);
}

void setValue(OptionValues& values, const std::string& name, const OptionValue& value) {
  for (auto& [known, old] : values)
    if (known == name) {
      old = value;
      return;
    }
  values.emplace_back(name, value);
}

YamlTree makeRobot(const SoughtLinkage& sought, const VectorXd& x) {
  OptionValues values = sought.settings;
  for (size_t i = 0; i < sought.variables.size(); ++i)
    setValue(values, sought.variables[i].parameter, x[static_cast<Eigen::Index>(i)]);
  YamlTree robot;
  robot["generator"] = sought.generator;
  for (const auto& [name, value] : values) robot["set"][name] = formatOption(value);
  return robot;
}

YamlTree makeVariable(const DesignVariable& variable) {
  YamlTree node = YamlTree::makeLine();
  node["name"] = variable.name;
  node["parameter"] = variable.parameter;
  node["unit"] = variable.unit;
  node["bounds"].add(formatExact(variable.lower));
  node["bounds"].add(formatExact(variable.upper));
  return node;
}

YamlTree makeMotion(const Json& summary) {
  YamlTree node = YamlTree::makeLine();
  const auto motion = summary.at("motion").get<std::string>();
  node["motion"] = motion;
  const OptionSet usual = findMotion("", motion).request.options;
  OptionSet options = usual;
  for (const auto& [name, value] : summary.at("options").items()) {
    if (name.rfind(kDeadPointMargin, 0) == 0) continue;  // designs have one of their own, and constraints
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    options.set(name, parseOption(text));
    if (options.get(name).value != usual.get(name).value) node["set"][name] = text;
  }
  return node;
}

YamlTree makeMeasure(const std::string& measure, const std::string& motors) {
  YamlTree node = YamlTree::makeLine();
  node["measure"] = measure;
  if (!motors.empty()) node["motors"].add(motors);
  return node;
}

YamlTree makeStart(const std::vector<DesignVariable>& variables, const VectorXd& x) {
  YamlTree node = YamlTree::makeLine();
  for (size_t i = 0; i < variables.size(); ++i) node[variables[i].name] = formatExact(x[static_cast<Eigen::Index>(i)]);
  return node;
}

// Of this side and the other.
std::string coverSides(std::string name) {
  for (const char* side : {"_left", "_right"})
    if (const size_t at = name.find(side); at != std::string::npos) name.replace(at, std::string(side).size(), "_*");
  return name;
}

// The first of the robots found is the start design.
std::string formatDesign(const SoughtLinkage& sought, const std::vector<FoundLinkage>& found, const ReportRun& motion,
                         const std::string& joint, const std::string& motor, const std::string& origin) {
  const Parametrization robot(sought.generator, sought.settings, sought.variables);
  const Model best = robot.make(found.front().x);
  const Linkage linkage = makeLinkage(best, findClosedConfiguration(best).q, {joint});
  const std::string motors = coverSides(linkage.motor_names.front());
  YamlTree design = makeRobot(sought, found.front().x);
  for (const DesignVariable& variable : sought.variables) design["variables"].add(makeVariable(variable));
  design["motions"].add(makeMotion(motion.summary));
  for (const char* measure : {"electrical_energy", "peak_torque"})
    design["objective"].add(makeMeasure(measure, motors));
  YamlTree margin = makeMeasure("margin", "");
  double largest = 0;
  for (const FoundLinkage& f : found) largest = std::max(largest, f.largest_ratio);
  margin["at_least"] = formatNumber(kMarginShare / std::hypot(1, largest), "%.3g");
  design["constraints"].add(margin);
  if (!motor.empty()) {
    YamlTree type = YamlTree::makeLine();
    type["name"] = "motor";
    type["motor"].add(motors);
    type["choices"].add(motor);
    design["variables"].add(type);
    design["constraints"].add(makeMeasure("envelope", motors));
  }
  YamlTree search;
  for (size_t k = 1; k < found.size(); ++k) search["starts"].add(makeStart(sought.variables, found[k].x));
  YamlTree refinement = YamlTree::makeLine();
  refinement["algorithm"] = "slsqp";
  refinement["evaluations"] = std::to_string(kRefinement);
  search["pareto"]["population"] = std::to_string(std::max<size_t>(8, (found.size() + 3) / 4 * 4));
  search["pareto"]["generations"] = "0";
  search["pareto"]["refine"] = refinement;
  design["search"] = search;
  return design.format("Robots found by `" + origin + "`, their motion solved anew; the best refined by gradients.");
}

}  // namespace

SoughtLinkage makeDrawnKnees(const std::string& robot, const FourBarSpace& space, const JointDemand& demand) {
  const GeneratorEntry entry = findEntry(robot);
  const Option* knee = entry.parameters.find("knee");
  if (!knee || std::find(knee->choices.begin(), knee->choices.end(), "drawn") == knee->choices.end())
    throw InputError(robot, "parameter 'knee'", "the robot has no part `drawn` to choose",
                     "give leg_biped or a robot with its legs, or say by --parameter what varies");
  SoughtLinkage sought{entry.name, {}, {}, makeFourBars(space, demand), "sine", space.margin};
  for (const auto& [name, value] : entry.listChanges())
    if (entry.parameters.find(name)->name.rfind("knee_", 0) != 0 || name == "knee_motor_mass")
      sought.settings.emplace_back(name, value);
  setValue(sought.settings, "knee", std::string("drawn"));
  setValue(sought.settings, "knee_drawn_at", demand.middle());
  const char* names[] = {"motor_x", "motor_z", "drawn_crank", "crank_angle", "drawn_arm", "arm_angle"};
  for (Eigen::Index i = 0; i < space.lower.size(); ++i) {
    DesignVariable variable;
    variable.name = names[i];
    variable.parameter = std::string("knee_") + names[i];
    variable.unit = variable.name.find("angle") == std::string::npos ? "m" : "rad";
    variable.lower = space.lower[i], variable.upper = space.upper[i];
    sought.variables.push_back(variable);
  }
  return sought;
}

SoughtLinkage makeVariedLinkages(const std::string& robot, const std::vector<std::string>& parameters,
                                 const std::string& joint, const JointDemand& demand, double distance) {
  const GeneratorEntry entry = findEntry(robot);
  SoughtLinkage sought{entry.name, entry.listChanges(), {}, {}, "dead point [rad]", distance};
  for (const std::string& text : parameters) {
    const ParameterRange range = readParameterRange("--parameter", text, entry.parameters);
    DesignVariable variable;
    variable.name = variable.parameter = range.name;
    variable.unit = range.unit;
    variable.lower = range.low, variable.upper = range.high;
    sought.variables.push_back(variable);
  }
  sought.family =
      makeRobotLinkages(Parametrization(entry.name, sought.settings, sought.variables), joint, demand.angles, distance);
  return sought;
}

std::string formatRobot(const SoughtLinkage& sought, const FoundLinkage& found, const std::string& origin) {
  return makeRobot(sought, found.x).format("Found by `" + origin + "`.");
}

std::optional<size_t> writeDesign(const std::string& path, const SoughtLinkage& sought, std::vector<FoundLinkage> found,
                                  const ReportRun& motion, const std::string& joint, const std::string& motor,
                                  const std::string& origin) {
  for (size_t start = 0; start < found.size(); ++start) {
    std::rotate(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(start > 0), found.end());
    writeTextFile(path, formatDesign(sought, found, motion, joint, motor, origin));
    try {
      makeEvaluator(readDesignSpec(path));
      return start;
    } catch (const InputError&) {  // it does not make the motion from its plan, but may from that of another
    }
  }
  return {};
}

}  // namespace bielle::cli
