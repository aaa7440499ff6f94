#include <algorithm>
#include <filesystem>
#include <memory>

#include "bielle/model/error.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/robots/generate.h"
#include "bielle/robots/robot_loader.h"
#include "formats/robot_files.h"
#include "model/listing.h"
#include "robots/cleobot.h"
#include "robots/composed_robot.h"
#include "robots/delta.h"
#include "robots/fivebar_leg.h"
#include "robots/generator_entry.h"
#include "robots/kangaroo.h"
#include "robots/spring_biped.h"
#include "robots/spring_leg.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

template <typename Parameters>
Generator makeGenerator(const std::string& name, const std::string& help, Model (*make)(const Parameters&)) {
  return {name, help, listOptions(Parameters(), "parameter", name),
          [make](const OptionSet& parameters) { return make(readOptions<Parameters>(parameters)); }};
}

// The chain of robots/fourbar_chain.h, its rods drawn.
struct FourBarChainParameters {
  FourBarChainParameters() {
    options.radius = 0.01;
    options.count = 3;
  }
  FourBarChainOptions options;
};

void describe(OptionFields& f, FourBarChainParameters& p) {
  FourBarChainOptions& o = p.options;
  f.integer("count", o.count, {1, 1000}, "number of four-bars");
  f.number("ground", o.ground, "m", {0.01, 10}, "distance between the pivots of crank and rocker");
  f.number("crank", o.crank, "m", {0.01, 10}, "length of the crank");
  f.number("coupler", o.coupler, "m", {0.01, 10}, "length of the coupler, the ground of the next four-bar");
  f.number("rocker", o.rocker, "m", {0.01, 10}, "length of the rocker");
  f.number("crank_angle", o.crank_angle, "rad", {-3.15, 3.15}, "angle from the ground in the reference `closed`");
  f.number("density", o.density, "kg/m", {0.01, 100}, "mass per length of the rods");
  f.number("radius", o.radius, "m", {0.001, 0.1}, "radius of the rods");
}

Model makeChain(const FourBarChainParameters& p) {
  checkParameters("fourbar_chain", p);
  return makeFourBarChain(p.options).model;
}

const std::vector<Generator>& getCompiledGenerators() {
  static const std::vector<Generator> generators = {
      makeGenerator("cleobot", "biped with parallel legs: 3-RRS lower legs, hips turned by three crank-and-rod chains",
                    makeCleobot),
      makeGenerator("kangaroo",
                    "biped driven only by ball screws: hip differentials, parallelograms; 96 redundant rows",
                    makeKangaroo),
      makeGenerator("kangaroo_leg", "left leg of kangaroo with the trunk on a vertical rail; 48 redundant rows",
                    makeKangarooLeg),
      makeGenerator("fivebar_leg", "planar leg on a rail: two coaxial motors, four rods, a point foot", makeFiveBarLeg),
      makeGenerator("spring_biped", "biped like Cassie: heel rods, leaf springs at shin and heel", makeSpringBiped),
      makeGenerator("spring_leg", "leg like Cassie's with rigid springs: tarsus and toe moved by four-bars",
                    makeSpringLeg),
      makeGenerator("delta", "Clavel's delta with hinges only: many more rows than rank", makeDelta),
      makeGenerator("fourbar_chain", "chain of planar four-bars, each on the coupler of the previous one", makeChain),
  };
  return generators;
}

// The file of a robot composed of parts in the directories of robots, or empty.
std::string findComposition(const std::string& name) {
  for (const std::string& directory : getRobotDirectories()) {
    const fs::path path = fs::path(directory) / name / (name + ".yaml");
    std::error_code error;
    if (fs::is_regular_file(path, error) && readYaml(path.string()).composed) return path.string();
  }
  return "";
}

std::shared_ptr<const ComposedRobot> makeComposed(const std::string& path, const OptionValues& settings) {
  std::map<std::string, std::string> parts;
  for (const auto& [name, value] : settings)
    if (const std::string* text = std::get_if<std::string>(&value))
      if (fs::path(*text).extension() == ".yaml") parts[name] = *text;
  return std::make_shared<const ComposedRobot>(path, parts);
}

Generator makeComposedGenerator(const std::string& path, const OptionValues& settings) {
  const auto robot = makeComposed(path, settings);
  return {fs::path(path).stem().string(), robot->help(), robot->parameters(),
          [robot](const OptionSet& parameters) { return combineFiles(robot->make(parameters), {}, nullptr); }};
}

// All in the directories of robots, by name.
std::map<std::string, std::string> listCompositions() {
  std::map<std::string, std::string> files;
  for (const std::string& name : listRobots())
    if (const std::string file = findComposition(name); !file.empty()) files[name] = file;
  return files;
}

// Of a generator that is not compiled; empty if there is none.
std::string findComposedFile(const std::string& name) {
  if (fs::path(name).extension() == ".yaml" && fs::exists(name)) {
    if (!readYaml(name).composed) throw InputError(name, "file", "it composes no robot", "give a file with a `tree`");
    return name;
  }
  return name.find('/') == std::string::npos ? findComposition(name) : "";
}

bool isCompiled(const std::string& name) {
  const std::vector<Generator>& generators = getCompiledGenerators();
  return std::any_of(generators.begin(), generators.end(), [&name](const Generator& g) { return g.name == name; });
}

// Whether some choice of what is open leads to a part with the parameter.
bool mayUse(const ComposedRobot& robot, const std::string& parameter, PartChoices chosen, OpenChoices open) {
  if (!robot.uses(parameter, chosen)) return false;
  if (open.empty()) return true;
  const auto first = *open.begin();
  open.erase(open.begin());
  return std::any_of(first.second.begin(), first.second.end(), [&](const std::string& choice) {
    chosen[first.first] = choice;
    return mayUse(robot, parameter, chosen, open);
  });
}

// What else to choose for all of them to be used, as `knee: belt`; empty if one choice does not do.
std::string findChoice(const ComposedRobot& robot, const OptionSet& parameters, const std::vector<std::string>& unused,
                       const PartChoices& chosen, const OpenChoices& open) {
  for (const Option& option : parameters)
    for (const std::string& choice : option.choices) {
      PartChoices other = chosen;
      OpenChoices others = open;
      other[option.name] = choice;
      others.erase(option.name);
      const auto is_used = [&](const std::string& name) { return mayUse(robot, name, other, others); };
      if (std::all_of(unused.begin(), unused.end(), is_used)) return "`" + option.name + ": " + choice + "`";
    }
  return "";
}

}  // namespace

std::optional<UnusedParameters> findUnused(const std::string& generator, const OptionValues& settings,
                                           const OpenChoices& open) {
  std::vector<std::string> names;
  for (const auto& [name, value] : settings) names.push_back(name);
  return findUnused(generator, names, settings, open);
}

std::optional<UnusedParameters> findUnused(const std::string& generator, const std::vector<std::string>& names,
                                           const OptionValues& settings, const OpenChoices& open) {
  if (isCompiled(generator)) return {};
  const auto robot = makeComposed(findComposedFile(generator), settings);
  OptionSet parameters = robot->parameters();
  for (const auto& [name, value] : settings) parameters.set(name, value);
  PartChoices chosen;
  for (const Option& option : parameters)
    if (const std::string* choice = std::get_if<std::string>(&option.value))
      if (!open.count(option.name)) chosen[option.name] = *choice;
  std::vector<std::string> unused;
  for (const std::string& name : names)
    if (!mayUse(*robot, name, chosen, open) && !contains(unused, name)) unused.push_back(name);
  if (unused.empty()) return {};
  const bool one = unused.size() == 1;
  const std::string choice = findChoice(*robot, parameters, unused, chosen, open);
  return UnusedParameters{
      unused,
      one ? "it would change nothing: it is a parameter of a part that is not chosen"
          : listItems(unused) + " would change nothing: no part that is chosen has them",
      std::string(one ? "remove it" : "remove them") + (choice.empty() ? "" : ", or choose " + choice)};
}

Model generateRobot(const std::string& name, const OptionValues& settings) {
  const Generator generator = findGenerator(name, settings);
  OptionSet parameters = generator.parameters;
  for (const auto& [parameter, value] : settings) parameters.set(parameter, value);
  Model model = generator.make(parameters);
  if (const std::optional<UnusedParameters> unused = findUnused(name, settings))
    throw InputError(name, "parameter '" + unused->names.front() + "'", unused->problem, unused->remedy);
  return model;
}

std::vector<Generator> listGenerators() {
  std::vector<Generator> out = getCompiledGenerators();
  for (const auto& [name, file] : listCompositions()) out.push_back(makeComposedGenerator(file, {}));
  return out;
}

Generator findGenerator(const std::string& name, const OptionValues& settings) {
  for (const Generator& generator : getCompiledGenerators())
    if (generator.name == name) return generator;
  if (const std::string file = findComposedFile(name); !file.empty()) return makeComposedGenerator(file, settings);
  std::vector<std::string> known;
  for (const Generator& generator : listGenerators()) known.push_back(generator.name);
  throw InputError("", "robot '" + name + "'", "there is no such generator as '" + name + "'",
                   "choose one of: " + listItems(known) + ", or give a file that composes a robot");
}

}  // namespace bielle
