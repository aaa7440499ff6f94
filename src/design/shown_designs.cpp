#include "design/shown_designs.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <mutex>

#include "bielle/dynamics/assembly.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/results/result.h"
#include "bielle/results/robot_info.h"
#include "design/parallel.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

// Best first; the same design once.
std::vector<VectorXd> rankSearches(const DesignRun& run) {
  std::vector<const LoggedEvaluation*> bests;
  for (const auto& search : run.searches) {
    const LoggedEvaluation* best = nullptr;
    for (const LoggedEvaluation& e : search)
      if (e.status == DesignStatus::Feasible && (!best || e.value < best->value)) best = &e;
    if (best) bests.push_back(best);
  }
  std::stable_sort(bests.begin(), bests.end(),
                   [](const LoggedEvaluation* a, const LoggedEvaluation* b) { return a->value < b->value; });
  std::vector<VectorXd> out;
  for (const LoggedEvaluation* e : bests)
    if (std::find(out.begin(), out.end(), e->x) == out.end()) out.push_back(e->x);
  return out;
}

std::vector<ShownDesign> chooseDesigns(const DesignEvaluator& evaluator, const DesignRun& run) {
  std::vector<ShownDesign> out = {{"start", "start", evaluator.robot().start(), {}, {}}};
  std::vector<VectorXd> others;
  for (const FrontDesign& design : run.front) others.push_back(design.x);
  if (run.front.empty()) others = rankSearches(run);
  for (size_t i = 0; i < others.size(); ++i) {
    const std::string name = getNumberName(i);
    out.push_back({name, (run.front.empty() ? "ranked/" : "front/") + name, others[i], {}, {}});
  }
  return out;
}

// Names of directories, different ones.
std::vector<std::string> nameMotions(const std::vector<DesignMotion>& motions) {
  std::vector<std::string> names;
  std::map<std::string, int> uses;
  for (const DesignMotion& motion : motions) {
    const int use = ++uses[motion.name];
    names.push_back(motion.name + (use > 1 ? "_" + std::to_string(use) : ""));
  }
  return names;
}

void writeDesignFiles(const std::string& directory, const DesignEvaluator& evaluator, ShownDesign& design) {
  const fs::path place = fs::path(directory) / design.directory;
  writeRobot(makeWritten(evaluator.robot(), design.x), place.string(), "Written by `bielle design`.");
  std::vector<MotionOutcome> outcomes;
  design.evaluation = evaluator.evaluate(design.x, &outcomes);
  const std::vector<std::string> names = nameMotions(evaluator.motions());
  const LoadedRobot written = loadRobot((place / (place.filename().string() + ".urdf")).string());
  for (size_t i = 0; i < names.size(); ++i) {
    design.results.emplace_back();
    if (i >= outcomes.size() || !outcomes[i].solution) continue;
    design.results.back() = design.directory + "/" + names[i];
    writeResult((place / names[i]).string(), makeResult(makeRunInfo(design.directory, written), *outcomes[i].solution));
  }
}

}  // namespace

std::string getNumberName(size_t i) { return (i < 9 ? "0" : "") + std::to_string(i + 1); }

Model makeWritten(const Parametrization& robot, const VectorXd& x) {
  const Model model = robot.make(x);
  ModelParts parts = takeParts(model);
  for (Reference& reference : parts.references) {
    const AssemblyResult result = assembleReference(model, reference.name);
    const std::vector<ReferenceJoint> joints = listReferenceJoints(model, reference, result.q);
    const bool moves = std::any_of(joints.begin(), joints.end(),
                                   [](const ReferenceJoint& joint) { return joint.moved > kReferenceTolerance; });
    if (!moves || result.status != NumericalStatus::Ok) continue;
    for (const ReferenceJoint& joint : joints)
      reference.joints[model.joints()[joint.joint].name].assign(joint.assembled.begin(), joint.assembled.end());
    if (model.hasFreeFlyer()) reference.joints[model.joints()[1].name].assign(result.q.begin(), result.q.begin() + 7);
  }
  return ModelBuilder::restore(std::move(parts));
}

std::vector<ShownDesign> writeShownDesigns(const std::string& directory, const DesignEvaluator& evaluator,
                                           const DesignRun& run, int jobs,
                                           const std::function<void(const std::string& line)>& progress) {
  std::vector<ShownDesign> designs = chooseDesigns(evaluator, run);
  std::mutex mutex;
  size_t done = 0;
  doInParallel(designs.size(), jobs, [&](size_t i) {
    writeDesignFiles(directory, evaluator, designs[i]);
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress("page, design " + std::to_string(done) + " of " + std::to_string(designs.size()));
  });
  return designs;
}

}  // namespace bielle
