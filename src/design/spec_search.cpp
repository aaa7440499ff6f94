#include <algorithm>
#include <cmath>

#include "bielle/model/names.h"
#include "design/spec_parts.h"

namespace bielle {
namespace {

const YamlKeys kSearchKeys("design", "search", {"seed", "searches", "starts", "stages", "pareto"});
const YamlKeys kStageKeys("design", "search.stages[], search.pareto.refine", {"algorithm", "evaluations", "tolerance"});
const YamlKeys kFrontKeys("design", "search.pareto", {"algorithm", "population", "generations", "refine"});

// The mode, the objective and the constraints have been read.
SearchStage readStage(const YamlEntry& item, const std::vector<SearchAlgorithm>& algorithms, const DesignSpec& spec) {
  const YamlFields fields = item.getFields(kStageKeys);
  SearchStage stage;
  stage.algorithm = readChoice<SearchAlgorithm>(require(fields, "algorithm", item), algorithms);
  if (needsGradient(stage.algorithm))
    if (const auto obstacle = findGradientObstacle(spec.mode, spec.objective, spec.constraints))
      item.fail(obstacle->problem, obstacle->remedy);
  stage.evaluations = readCount(require(fields, "evaluations", item), 1000000);
  if (const YamlEntry* tolerance = find(fields, "tolerance")) stage.tolerance = tolerance->getNumber();
  if (!(stage.tolerance >= 0 && stage.tolerance < 1))
    item.fail("its tolerance is outside 0 .. 1", "give a share of the bounds, e.g. 1e-3");
  return stage;
}

FrontSpec readFront(const YamlEntry& entry, const DesignSpec& spec) {
  if (!hasFrontSearch())
    entry.fail("this program was built without pagmo, which searches for fronts",
               "install libpagmo-dev and build it again, or give `stages`");
  const YamlFields fields = entry.getFields(kFrontKeys);
  FrontSpec front;
  FrontOptions& options = front.options;
  if (const YamlEntry* algorithm = find(fields, "algorithm"))
    options.algorithm = readChoice<SearchAlgorithm>(*algorithm, {SearchAlgorithm::Nsga2, SearchAlgorithm::Moead});
  if (const YamlEntry* population = find(fields, "population")) {
    options.population = readCount(*population, 10000);
    if (options.population < 8 || options.population % 4 != 0)
      population->fail("it is not a multiple of 4, or less than 8", "give e.g. 24");
  }
  if (const YamlEntry* generations = find(fields, "generations"))
    options.generations = readCount(*generations, 100000, 0);
  if (const YamlEntry* refine = find(fields, "refine"))
    front.refine = readStage(*refine, {SearchAlgorithm::Slsqp, SearchAlgorithm::Mma}, spec);
  const bool has_choices = std::any_of(spec.variables.begin(), spec.variables.end(),
                                       [](const DesignVariable& variable) { return variable.isChoice(); });
  if (has_choices && options.algorithm == SearchAlgorithm::Moead)
    entry.fail("moead needs continuous variables, but choices have no order", "use nsga2");
  if (spec.objective.size() < 2) entry.fail("a single objective has no front", "give a second one, or `stages`");
  return front;
}

// Values by the names of variables.
VectorXd readStart(const YamlEntry& entry, const std::vector<DesignVariable>& variables) {
  VectorXd x = VectorXd::Constant(static_cast<Eigen::Index>(variables.size()), NAN);
  for (const auto& [name, value] : entry.getMap()) {
    const auto is_it = [&name = name](const DesignVariable& variable) { return variable.name == name; };
    const auto variable = std::find_if(variables.begin(), variables.end(), is_it);
    if (variable == variables.end()) value.failUnknown("variable", name, getNames(variables));
    double& number = x[variable - variables.begin()];
    number = variable->isChoice() ? readChoiceNumber(value, variable->choices) : value.getNumber();
    if (!variable->isChoice() && !(number >= variable->lower && number <= variable->upper))
      value.fail("it is outside the bounds of variable '" + name + "'", "correct it, or widen the bounds");
  }
  return x;
}

}  // namespace

void readSearch(const YamlEntry& entry, DesignSpec& spec) {
  const YamlFields fields = entry.getFields(kSearchKeys);
  if (const YamlEntry* seed = find(fields, "seed")) spec.seed = static_cast<unsigned>(readCount(*seed, 1000000000));
  if (const YamlEntry* searches = find(fields, "searches")) spec.searches = readCount(*searches, 1000);
  const YamlEntry *stages = find(fields, "stages"), *starts = find(fields, "starts");
  if (starts) {
    if (find(fields, "searches"))
      starts->fail("it cannot be combined with `searches`", "remove either: there is one search from each start");
    for (const YamlEntry& item : starts->getList()) spec.starts.push_back(readStart(item, spec.variables));
    if (spec.starts.empty()) starts->fail("there are none", "give one, or leave the key out");
  }
  if (const YamlEntry* pareto = find(fields, "pareto")) {
    if (stages || find(fields, "searches"))
      pareto->fail("it cannot be combined with `stages` and `searches`", "remove them, or `pareto`");
    spec.front = readFront(*pareto, spec);
    if (static_cast<int>(spec.starts.size()) >= spec.front->options.population)
      pareto->fail(
          "its population has no room for the start design and " + std::to_string(spec.starts.size()) + " `starts`",
          "enlarge `population`");
  }
  if (!stages) return;
  spec.stages.clear();
  for (const YamlEntry& item : stages->getList())
    spec.stages.push_back(readStage(item,
                                    {SearchAlgorithm::Crs, SearchAlgorithm::Isres, SearchAlgorithm::Bobyqa,
                                     SearchAlgorithm::Sbplx, SearchAlgorithm::Slsqp, SearchAlgorithm::Mma},
                                    spec));
  if (spec.stages.empty()) stages->fail("there are no stages", "give one, or leave the key out");
}

}  // namespace bielle
