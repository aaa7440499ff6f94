#include "design/spec.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "design/open_choices.h"
#include "design/spec_parts.h"
#include "formats/motor_catalogue.h"
#include "formats/text_file.h"
#include "model/number_text.h"
#include "robots/generator_entry.h"

namespace bielle {
namespace {

using Entry = YamlEntry;
using Fields = YamlFields;

const YamlKeys kDesignKeys("design", "",
                           {"robot", "generator", "set", "architecture", "variables", "motor_catalogue", "motions",
                            "mode", "margin", "objective", "constraints", "drives", "search"});
const YamlKeys kVariableKeys("design", "variables[]",
                             {"name", "unit", "bounds", "length", "shift", "parameter", "ratio", "gear", "motor",
                              "choices", "mass", "start"});
const YamlKeys kLengthKeys("design", "variables[].length[]", {"from", "to", "across", "stretch", "rod"});
const YamlKeys kShiftKeys("design", "variables[].shift[]", {"of", "along"});
const YamlKeys kGearKeys("design", "variables[].gear", {"loss", "mass"});
const YamlKeys kTermKeys("design", "objective[]", {"measure", "motors", "weight", "region", "joints", "angles"});
const YamlKeys kRegionKeys("design", "objective[].region",
                           {"foot", "base", "max_conditioning", "x", "y", "z", "roll", "pitch", "yaw"});
const YamlKeys kConstraintKeys("design", "constraints[]",
                               {"measure", "motors", "at_most", "at_least", "except", "joints", "angles"});
const YamlKeys kDesignDriveKeys("design", "drives", {"motor_constant", "motors", "regeneration"});

Vector3d readDirection(const Entry& entry) {
  const Vector3d direction = entry.getVector3();
  if (direction.norm() < 1e-9) entry.fail("it is not a direction", "give three numbers that are not all zero");
  return direction.normalized();
}

// A list, or its only element.
std::vector<Entry> getItems(const Entry& entry) { return entry.isList() ? entry.getList() : std::vector<Entry>{entry}; }

LengthChange readLength(const Entry& entry) {
  const Fields fields = entry.getFields(kLengthKeys);
  LengthChange change;
  if (const Entry* rod = find(fields, "rod")) {
    if (fields.size() > 1) rod->fail("it has places beside a rod", "give either `rod` or `from` and `to`");
    change.rod = rod->getText();
    return change;
  }
  change.from = require(fields, "from", entry).getText();
  change.to = require(fields, "to", entry).getText();
  if (const Entry* across = find(fields, "across")) change.across = readDirection(*across);
  if (const Entry* link = find(fields, "stretch")) change.stretched = link->getText();
  return change;
}

ShiftChange readShift(const Entry& entry) {
  const Fields fields = entry.getFields(kShiftKeys);
  return {require(fields, "of", entry).getText(), readDirection(require(fields, "along", entry))};
}

// Names of motors: a list, or its only element.
std::vector<std::string> readNames(const Entry& entry) {
  return entry.isList() ? entry.getTexts() : std::vector<std::string>{entry.getText()};
}

void requireMasses(const Entry& choices, const std::vector<Motor>& types, const char* remedy) {
  for (size_t i = 0; i < types.size(); ++i)
    if (!(types[i].drive.mass > 0)) choices.getList()[i].fail("its mass is not in the catalogue", remedy);
}

void readChoices(const Entry& choices, const Fields& fields, const DesignSpec& spec, const Entry* catalogues,
                 DesignVariable& variable) {
  variable.choices = choices.getTexts();
  if (std::set<std::string>(variable.choices.begin(), variable.choices.end()).size() < variable.choices.size())
    choices.fail("one of them is listed twice", "remove it");
  if (variable.choices.empty()) choices.fail("there is nothing to choose", "give one or more");
  if (spec.robot.generator.empty()) {
    if (!find(fields, "motor"))
      choices.fail("a given robot has no parts to choose",
                   "give the `motor` or the `ratio` of its motors, or a generator");
    if (const Entry* mass = find(fields, "mass"))
      mass->fail("a given robot has no parameters; the links that carry its motors change their masses by themselves",
                 "remove it");
    variable.types = readMotorTypes(choices.getList(), spec.path, catalogues);
    requireMasses(choices, variable.types, "add it there");
    return;
  }
  const OptionSet parameters = findGenerator(spec.robot.generator, spec.robot.settings).parameters;
  const auto getParameter = [&](const Entry& entry) -> const Option& {
    if (const Option* parameter = parameters.find(entry.getText())) return *parameter;
    entry.fail("the generator has no parameter '" + entry.getText() + "'",
               "`bielle generate " + spec.robot.generator + " --help` lists them");
  };
  if (const Entry* parameter = find(fields, "parameter"))
    for (const Entry& name : choices.getList()) {
      const std::vector<std::string>& known = getParameter(*parameter).choices;
      if (std::find(known.begin(), known.end(), name.getText()) == known.end())
        name.fail("'" + name.getText() + "' is not one of the choices of '" + parameter->getText() + "'",
                  "`bielle generate " + spec.robot.generator + " --help` lists them");
    }
  if (!find(fields, "motor")) return;
  variable.types = readMotorTypes(choices.getList(), spec.path, catalogues);
  const Entry* mass = find(fields, "mass");
  if (!mass) return;
  for (const Entry& name : getItems(*mass)) variable.masses.push_back(getParameter(name).name);
  requireMasses(choices, variable.types, "add it there, or leave `mass` out");
}

GearCost readGearCost(const Entry& entry) {
  const Fields fields = entry.getFields(kGearKeys);
  GearCost cost;
  if (const Entry* loss = find(fields, "loss")) cost.loss = loss->getNumber();
  if (const Entry* mass = find(fields, "mass")) cost.mass_per_effort = mass->getNumber();
  if (!(cost.loss >= 0 && cost.loss < 1 && cost.mass_per_effort >= 0))
    entry.fail("its loss is no share, or its mass negative", "give e.g. {loss: 0.03, mass: 0.0054}, in kg per N m");
  return cost;
}

DesignVariable readVariable(const Entry& entry, const DesignSpec& spec, const Entry* catalogues) {
  const Fields fields = entry.getFields(kVariableKeys);
  DesignVariable variable;
  variable.name = require(fields, "name", entry).getText();
  if (const Entry* lengths = find(fields, "length"))
    for (const Entry& item : getItems(*lengths)) variable.lengths.push_back(readLength(item));
  if (const Entry* shifts = find(fields, "shift"))
    for (const Entry& item : getItems(*shifts)) variable.shifts.push_back(readShift(item));
  if (const Entry* parameter = find(fields, "parameter")) variable.parameter = parameter->getText();
  const Entry *ratio = find(fields, "ratio"), *motor = find(fields, "motor"), *choices = find(fields, "choices");
  if (ratio) variable.motors = readNames(*ratio), variable.unit = "1";
  if (const Entry* gear = find(fields, "gear")) {
    if (!ratio) gear->fail("only ratios have a gear", "give `ratio`, or remove it");
    variable.gear = readGearCost(*gear);
  }
  if (motor) variable.motors = readNames(*motor);
  const int kinds = !variable.lengths.empty() + !variable.shifts.empty() + !variable.parameter.empty() +
                    (ratio != nullptr) + (motor != nullptr);
  if (kinds != 1)
    entry.fail(
        "variable '" + variable.name + "' is not exactly one of a length, a shift, a parameter, a ratio and a motor",
        "give one of `length`, `shift`, `parameter`, `ratio` and `motor`");
  if (const Entry* unit = find(fields, "unit")) variable.unit = unit->getText();
  const Entry* start = find(fields, "start");
  if (start && !choices && !ratio)
    start->fail("only ratios and choices have a start value",
                "remove it; other variables start from the robot's values");
  if (const Entry* mass = find(fields, "mass"); mass && !motor)
    mass->fail("only motors have a mass", "give `motor` with its choices, or remove it");
  if (motor && !choices)
    entry.fail("'" + variable.name + "' has no choices", "list motors of a catalogue as `choices`");
  if (choices) {
    if (!motor && variable.parameter.empty())
      choices->fail("only parameters and motors have choices", "give `parameter` or `motor`, or `bounds` instead");
    if (const Entry* bounds = find(fields, "bounds")) bounds->fail("choices have no bounds", "remove them");
    readChoices(*choices, fields, spec, catalogues, variable);
    variable.unit = "1";
    if (start) variable.start = readChoiceNumber(*start, variable.choices);
    return variable;
  }
  if (start) variable.start = start->getNumber();
  const Entry& bounds = require(fields, "bounds", entry);
  const std::vector<double> values = bounds.getNumbers(2);
  variable.lower = values[0], variable.upper = values[1];
  if (!(variable.lower < variable.upper))
    bounds.fail("the bounds of variable '" + variable.name + "' are in the wrong order", "give the lower one first");
  if (ratio && !(variable.lower > 0)) bounds.fail("a ratio is not positive", "give turns of the rotor per turn");
  return variable;
}

// A variable for each part of the generator that several are named of; one alone is a setting.
void readArchitecture(const Entry& entry, DesignSpec& spec) {
  if (spec.robot.generator.empty())
    entry.fail("a given robot has one architecture", "give a generator of parts, e.g. leg_biped");
  const OptionSet parameters = findGenerator(spec.robot.generator, spec.robot.settings).parameters;
  std::map<std::string, DesignVariable> parts;
  // hip_drive is a choice of a part that hip has chosen.
  const auto is_within_part = [&parameters](const Option& p) {
    return std::any_of(parameters.begin(), parameters.end(), [&p](const Option& other) {
      return !other.choices.empty() && p.name.rfind(other.name + "_", 0) == 0;
    });
  };
  std::map<std::string, int> count;  // of parameters with such a choice, but for those within parts
  std::string known;
  for (const Option& p : parameters)
    for (const std::string& choice : p.choices) {
      known += (known.empty() ? "" : ", ") + choice + "_" + p.name;
      count[choice] += !is_within_part(p);
    }
  if (known.empty())
    entry.fail("generator '" + spec.robot.generator + "' does not compose robots from parts",
               "give one that does, e.g. leg_biped");
  for (const Entry& item : entry.getList()) {
    bool found = false;
    for (const Option& p : parameters)
      for (const std::string& choice : p.choices) {
        const bool is_short = choice == item.getText() && count[choice] == 1 && !is_within_part(p);
        if (choice + "_" + p.name != item.getText() && !is_short) continue;
        found = true;
        DesignVariable& part = parts[p.name];
        if (std::find(part.choices.begin(), part.choices.end(), choice) != part.choices.end())
          item.fail("'" + item.getText() + "' is listed twice", "remove one");
        part.choices.push_back(choice);
      }
    if (!found) item.fail("there is no part '" + item.getText() + "'", "use some of " + known);
  }
  for (const Option& p : parameters) {
    if (!parts.count(p.name)) continue;
    DesignVariable& part = parts[p.name];
    if (part.choices.size() == 1) {
      spec.robot.settings.emplace_back(p.name, part.choices.front());
      continue;
    }
    part.name = part.parameter = p.name;
    part.unit = "1";
    spec.variables.push_back(part);
  }
}

WorkspaceAxis readAxis(const Entry& entry) {
  WorkspaceAxis axis;
  axis.kind = WorkspaceAxis::Kind::Range;
  if (!entry.isList()) {
    if (entry.isWord("free"))
      axis.kind = WorkspaceAxis::Kind::Free;
    else
      axis.lower = axis.upper = entry.getNumber();
    return axis;
  }
  const std::vector<Entry> items = entry.getList();
  if (items.size() != 2 && items.size() != 3) entry.fail("it is not a range", "give [from, to] or [from, to, points]");
  axis.lower = items[0].getNumber(), axis.upper = items[1].getNumber();
  if (!(axis.lower < axis.upper)) entry.fail("the range is in the wrong order", "give the lower bound first");
  if (items.size() == 3) axis.points = readCount(items[2], 1000);
  return axis;
}

WorkspaceRegion readRegion(const Entry& entry) {
  const Fields fields = entry.getFields(kRegionKeys);
  WorkspaceRegion region;
  if (const Entry* foot = find(fields, "foot")) region.foot = foot->getText();
  if (const Entry* base = find(fields, "base")) region.base = base->getText();
  if (const Entry* bound = find(fields, "max_conditioning")) {
    region.max_conditioning = bound->getNumber();
    if (!(region.max_conditioning >= 1))
      bound->fail("the conditioning of a linkage is at least 1", "give a number of 1 or more");
  }
  int i = 0;
  for (const char* name : {"x", "y", "z", "roll", "pitch", "yaw"}) {
    if (const Entry* axis = find(fields, name)) region.axes[i] = readAxis(*axis);
    ++i;
  }
  return region;
}

void addMotorNames(const Entry& list, DesignSpec& spec) {
  for (const Entry& entry : list.getList()) spec.motor_names.emplace_back(entry.getText(), entry);
}

DriveTable readDrives(const Entry& entry, DesignSpec& spec) {
  const Fields fields = entry.getFields(kDesignDriveKeys);
  DriveTable drives;
  if (const Entry* constant = find(fields, "motor_constant")) drives.motor_constant = constant->getNumber();
  if (const Entry* share = find(fields, "regeneration")) drives.regeneration = share->getNumber();
  if (const Entry* motors = find(fields, "motors"))
    for (const auto& [name, value] : motors->getMap()) {
      drives.motor_constants.emplace_back(name, value.getNumber());
      spec.motor_names.emplace_back(name, value);
    }
  return drives;
}

// `joints` and `angles` of a measure of joints, which no other one has.
JointAngles readJointAngles(const Fields& fields, Measure measure) {
  JointAngles range;
  const Entry *joints = find(fields, "joints"), *angles = find(fields, "angles");
  for (const Entry* entry : {joints, angles})
    if (entry && !isOfJoints(measure)) entry->fail("only ranges and ratios are about joints", "remove it");
  if (joints) range.joints = readNames(*joints);
  if (!angles) return range;
  const std::vector<Entry> ends = angles->getList();
  if (ends.size() != 2) angles->fail("it is not a range", "give [from, to], rad (m of sliders)");
  range.angles = {ends[0].getNumber(), ends[1].getNumber()};
  if (!((*range.angles)[0] < (*range.angles)[1]))
    angles->fail("the range is in the wrong order", "give the lower angle first");
  return range;
}

ObjectiveTerm readTerm(const Entry& entry, DesignSpec& spec) {
  const Fields fields = entry.getFields(kTermKeys);
  ObjectiveTerm term;
  term.measure =
      readChoice<Measure>(require(fields, "measure", entry),
                          {Measure::PeakTorque, Measure::RmsTorque, Measure::Energy, Measure::ElectricalEnergy,
                           Measure::Cost, Measure::Conditioning, Measure::Workspace, Measure::Mass, Measure::Range,
                           Measure::LeastRatio, Measure::LargestRatio});
  const Entry *motors = find(fields, "motors"), *region = find(fields, "region");
  const bool is_workspace = term.measure == Measure::Workspace;
  if (motors && is_workspace) motors->fail("a workspace does not depend on motors", "remove it");
  if (motors && term.measure == Measure::Mass) motors->fail("the mass is that of the whole robot", "remove it");
  if (motors && isOfJoints(term.measure)) motors->fail("the measure does not depend on motors", "give `joints`");
  term.range = readJointAngles(fields, term.measure);
  if (motors && term.measure == Measure::Cost) motors->fail("the cost is that of the whole motion", "remove it");
  if (region && !is_workspace) region->fail("only a workspace has a region", "remove it");
  if (region) term.region = readRegion(*region);
  if (motors) term.motors = motors->getTexts(), addMotorNames(*motors, spec);
  if (const Entry* weight = find(fields, "weight")) term.weight = weight->getNumber();
  if (!(term.weight > 0)) entry.fail("its weight is not positive", "give a positive number, or none");
  return term;
}

DesignConstraint readConstraint(const Entry& entry, DesignSpec& spec) {
  const Fields fields = entry.getFields(kConstraintKeys);
  DesignConstraint constraint;
  constraint.measure = readChoice<Measure>(
      require(fields, "measure", entry),
      {Measure::Envelope, Measure::Heat, Measure::Mass, Measure::Margin, Measure::DeadPointDistance, Measure::Distance,
       Measure::PeakTorque, Measure::RmsTorque, Measure::Energy, Measure::ElectricalEnergy, Measure::Conditioning,
       Measure::Range, Measure::LeastRatio, Measure::LargestRatio});
  const Entry *most = find(fields, "at_most"), *least = find(fields, "at_least"), *motors = find(fields, "motors");
  if (motors && !isOfMotors(constraint.measure)) motors->fail("the measure does not depend on motors", "remove it");
  if (motors) constraint.motors = motors->getTexts(), addMotorNames(*motors, spec);
  constraint.range = readJointAngles(fields, constraint.measure);
  constraint.at_least = constraint.measure == Measure::Range;
  const bool is_share =
      constraint.measure == Measure::Envelope || constraint.measure == Measure::Heat || constraint.at_least;
  if ((most && least) || (!most && !least && !is_share))
    entry.fail("it does not have exactly one bound", "give one of `at_most` and `at_least`");
  const bool is_least = isLeast(constraint.measure);
  if (is_least && most) most->fail("larger values of this measure are better", "give `at_least`");
  if (!is_least && constraint.measure != Measure::Mass && least)
    least->fail("smaller values of this measure are better", "give `at_most`");
  if (most) constraint.bound = most->getNumber();
  if (least) constraint.bound = least->getNumber(), constraint.at_least = true;
  if (constraint.measure == Measure::Range && constraint.bound > 1)
    least->fail("the share of a range is at most 1", "leave it out, or give `angles` that are wider");
  if (constraint.measure == Measure::DeadPointDistance && constraint.bound > kFarthestDeadPoint)
    least->fail("dead points are looked for within " + formatNumber(kFarthestDeadPoint) + " rad", "give less");
  if (const Entry* except = find(fields, "except")) {
    if (constraint.measure != Measure::Distance) except->fail("only distances can exclude bodies", "remove it");
    for (const Entry& pair : except->getList()) {
      const std::vector<std::string> names = pair.getTexts(2);
      constraint.except.push_back({names[0], names[1]});
    }
  }
  if (constraint.measure != Measure::Distance && !(constraint.bound > 0))
    (most ? *most : *least).fail("the bound is not positive", "give a positive number");
  return constraint;
}

void readRoot(const Entry& root, DesignSpec& spec) {
  const Fields fields = root.getFields(kDesignKeys);
  spec.robot = readRobotSpec(fields, root);
  const Entry *architecture = find(fields, "architecture"), *variables = find(fields, "variables"),
              *catalogue = find(fields, "motor_catalogue");
  if (architecture) readArchitecture(*architecture, spec);
  if (!architecture || variables)
    for (const Entry& item : require(fields, "variables", root).getList())
      spec.variables.push_back(readVariable(item, spec, catalogue));
  if (const Entry* set = find(fields, "set"))
    requireUsed(spec.robot.generator, *set, listOpenChoices(spec.robot.settings, spec.variables));
  if (catalogue && std::none_of(spec.variables.begin(), spec.variables.end(),
                                [](const DesignVariable& variable) { return !variable.types.empty(); }))
    catalogue->fail("no motor is taken from it", "give a variable with a `motor` and `choices`, or remove it");
  if (const Entry* motions = find(fields, "motions")) spec.motions = readMotionSpecs(*motions, true);
  if (const Entry* drives = find(fields, "drives")) spec.drives = readDrives(*drives, spec);
  if (const Entry* mode = find(fields, "mode"))
    spec.mode = readChoice<MotionMode>(*mode, {MotionMode::Reoptimized, MotionMode::Kept});
  if (const Entry* margin = find(fields, "margin")) {
    spec.margin = margin->getNumber();
    if (!(spec.margin >= 1e-3 && spec.margin < 1)) margin->fail("it is outside 0.001 .. 1", "give e.g. 0.1");
  }
  for (const Entry& item : require(fields, "objective", root).getList()) spec.objective.push_back(readTerm(item, spec));
  if (const Entry* constraints = find(fields, "constraints"))
    for (const Entry& item : constraints->getList()) spec.constraints.push_back(readConstraint(item, spec));
  if (const Entry* search = find(fields, "search")) readSearch(*search, spec);
}

}  // namespace

DesignSpec readDesignSpec(const std::string& path) {
  DesignSpec spec;
  spec.path = path;
  spec.text = readTextFile(path, "give the path of a specification");
  readYamlDocument(path, spec.text, [&](const Entry& root) { readRoot(root, spec); });
  return spec;
}

std::vector<VectorXd> listStarts(const DesignSpec& spec, const Parametrization& robot) {
  std::vector<VectorXd> starts = spec.starts;
  for (VectorXd& x : starts) x = x.array().isNaN().select(robot.start(), x);
  return starts;
}

Parametrization makeParametrization(const DesignSpec& spec) {
  const RobotSpec& robot = spec.robot;
  if (!robot.generator.empty()) return Parametrization(robot.generator, robot.settings, spec.variables, spec.path);
  return Parametrization(makeRobot(robot, spec.path), spec.variables, spec.path);
}

}  // namespace bielle
