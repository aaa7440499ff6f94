#include "results/problem_file.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "bielle/model/error.h"
#include "ocp/residual_data.h"
#include "results/npz.h"
#include "results/problem_values.h"
#include "results/remade_motion.h"

namespace bielle {
namespace {

// Between the trajectory in the files and the problem made again: rounding of the last step of the solve.
constexpr double kSameState = 1e-8;

// Entries that many stages share: each is listed once.
class SharedEntries {
 public:
  int add(const Json& entry) {
    const auto [it, is_new] = indices_.emplace(entry.dump(), static_cast<int>(list_.size()));
    if (is_new) list_.push_back(entry);
    return it->second;
  }
  const Json& list() const { return list_; }

 private:
  std::map<std::string, int> indices_;
  Json list_ = Json::array();
};

class ProblemWriter {
 public:
  ProblemWriter(const Motion& motion, const MotionSummary& summary) : motion_(motion), summary_(summary) {}

  Json write(const Json& robot_files) {
    const RobotProblem& problem = *motion_.problem;
    const Model& model = problem.model();
    Json stages = Json::array();
    for (int k = 0; k <= problem.numStages(); ++k)
      stages.push_back(describeStage(problem.spec(k), k < problem.numStages()));
    const VectorXd& x0 = problem.initialState();
    return {
        {"format", "bielle problem 1"},
        {"name", model.name() + " " + motion_.name},
        {"motion", motion_.name},
        {"robot", model.name()},
        {"robot_files", robot_files},
        {"made_by", "Bielle " + getBuildInfo().bielle},
        {"mechanism", describeMechanism(model, x0.head(model.nq()))},
        {"initial", {{"q", listVector(x0.head(model.nq()))}, {"v", listVector(x0.segment(model.nq(), model.nv()))}}},
        {"step", getName(problem.spec(0).step)},
        {"phases", describePhases()},
        {"contact_sets", contact_sets_.list()},
        {"state_costs", states_.list()},
        {"control_costs", controls_.list()},
        {"effort_limits", limits_.list()},
        {"costs", costs_.list()},
        {"constraints", constraints_.list()},
        {"stages", stages}};
  }

 private:
  Json describePhases() const {
    Json phases = Json::array();
    int node = 0;
    for (const ContactPhase& phase : motion_.schedule.phases) {
      Json feet = Json::array();
      for (const ContactTarget& target : phase.contacts)
        feet.push_back(motion_.problem->model().contacts()[target.contact].name);
      phases.push_back(
          {{"name", phase.name}, {"first_stage", node}, {"stages", phase.nodes}, {"dt", phase.dt}, {"contacts", feet}});
      node += phase.nodes;
    }
    return phases;
  }

  Json describeStage(const StageSpec& spec, bool running) {
    Json json = Json::object();
    if (running) {
      json["kind"] = spec.kind == StageKind::Impact ? "impact" : "step";
      json["dt"] = spec.dt;
      json["contacts"] = contact_sets_.add(describePlaces(spec.constraints));
      json["effort_limit"] = limits_.add(listVector(spec.effort_limits));
      if (spec.control.weight != 0)
        json["control_cost"] = controls_.add({{"weight", spec.control.weight},
                                              {"reference", listVector(spec.control.reference)},
                                              {"weights", listVector(spec.control.weights)}});
    }
    if (spec.state.weight != 0) {
      const StateCost& cost = spec.state;
      Json state = {{"weight", cost.weight},
                    {"q", listVector(cost.q_ref)},
                    {"v", listVector(cost.v_ref)},
                    {"weights", listVector(cost.weights)}};
      if (motion_.problem->model().hasFreeFlyer())
        for (int row = 0; row < 3; ++row) state["axes"].push_back(listVector(cost.axes.row(row)));
      json["state_cost"] = states_.add(state);
    }
    json["costs"] = json["constraints"] = Json::array();
    for (const Cost& cost : spec.costs) json["costs"].push_back(costs_.add(describeCost(cost)));
    for (const PathConstraint& constraint : spec.path_constraints)
      json["constraints"].push_back(constraints_.add({{"name", constraint.name},
                                                      {"residual", describeData(constraint.name, *constraint.residual)},
                                                      {"lower", listVector(constraint.lower)},
                                                      {"upper", listVector(constraint.upper)},
                                                      {"scale", listVector(constraint.scale)}}));
    return json;
  }

  static Json describePlaces(const ConstraintSet& set) {
    Json contacts = Json::array();
    for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
      const Closure& closure = set.closures[c];
      Json json = {{"contact", set.getContact(static_cast<int>(c))}};
      addPlacement(json, "_WT", closure.X_B2);
      json["kp"] = closure.kp;
      json["kd"] = closure.kd;
      contacts.push_back(json);
    }
    return contacts;
  }

  Json describeCost(const Cost& cost) const {
    const Activation& activation = cost.activation;
    Json json = {{"name", cost.name}, {"weight", cost.weight}};
    switch (activation.kind) {
      case ActivationKind::Quadratic:
        json["activation"] = {{"kind", "quadratic"}, {"weights", listVector(activation.weights)}};
        break;
      case ActivationKind::Barrier:
        json["activation"] = {{"kind", "barrier"},
                              {"weights", listVector(activation.weights)},
                              {"lower", listVector(activation.lower)},
                              {"upper", listVector(activation.upper)}};
        break;
      case ActivationKind::Energy:
        json["activation"] = {{"kind", "energy"},
                              {"weights", listVector(activation.weights)},
                              {"share", activation.share},
                              {"smoothing", activation.smoothing}};
        break;
    }
    json["residual"] = describeData(cost.name, *cost.residual);
    return json;
  }

  Json describeData(const std::string& name, const Residual& residual) const {
    const ResidualData data = describeResidual(residual);
    if (data.kind.empty())
      throw InputError(summary_.file, "residual '" + name + "'", "nothing describes it as data",
                       "export the motion without it");
    struct Writer {
      Json operator()(const VectorXd& x) const { return listVector(x); }
      Json operator()(const MatrixXd& x) const { return listMatrix(x); }
      Json operator()(const std::vector<int>& x) const { return x; }
      Json operator()(const std::string& x) const { return x; }
      Json operator()(int x) const { return x; }
      Json operator()(double x) const { return x; }
    };
    Json json = {{"kind", data.kind}};
    for (const auto& [key, value] : data.values) json[key] = std::visit(Writer(), value);
    return json;
  }

  const Motion& motion_;
  const MotionSummary& summary_;
  SharedEntries contact_sets_, states_, controls_, limits_, costs_, constraints_;
};

NpyArray makeNumbers(std::vector<size_t> shape, const double* data, Eigen::Index size) {
  return {std::move(shape), {data, data + size}, {}, false};
}

NpyArray makeTable(const RowMatrixXd& table, int entries = 0) {
  const auto rows = static_cast<size_t>(table.rows()), columns = static_cast<size_t>(table.cols());
  return makeNumbers(entries > 0 ? std::vector<size_t>{rows, columns / entries, static_cast<size_t>(entries)}
                                 : std::vector<size_t>{rows, columns},
                     table.data(), table.size());
}

NpyArray makeList(const std::vector<double>& list) { return {{list.size()}, list, {}, false}; }

void requireSame(const MotionSummary& summary, bool holds, const std::string& what) {
  if (!holds)
    throw InputError(summary.file, "motion '" + summary.motion + "'",
                     what + " of the problem made again from the summary differ from those in the files",
                     "solve the motion with this version of Bielle, with limits, and without a problem of your own");
}

// What the problem gives along the trajectory: values of costs and constraints, node by node.
void addValues(const Motion& motion, const MotionSummary& summary, const MotionRecord& record, NpyArrays& arrays) {
  const RobotProblem& problem = *motion.problem;
  const Model& model = problem.model();
  RobotEvaluator evaluator(problem);
  std::vector<double> cost, constraints, rows;
  const bool known = record.multipliers.values.size() == static_cast<size_t>(problem.numStages() + 1);
  for (int k = 0; k <= problem.numStages(); ++k) {
    const bool running = k < problem.numStages();
    VectorXd x(problem.stateSize());
    x << record.q.row(k).transpose(), record.v.row(k).transpose();
    const RobotEvaluation& at = evaluator.evaluate(k, x, running ? VectorXd(record.u.row(k).transpose()) : VectorXd());
    requireSame(summary, at.status == NumericalStatus::Ok, "states");
    requireSame(summary, !known || record.multipliers.values[k].size() == problem.constraintSize(k), "constraints");
    cost.push_back(at.cost);
    rows.push_back(static_cast<double>(at.constraints.size()));
    constraints.insert(constraints.end(), at.constraints.begin(), at.constraints.end());
    if (!running) break;
    const VectorXd q = record.q.row(k + 1).transpose(), v = record.v.row(k + 1).transpose();
    const double gap = std::max(model.difference(q, at.x_next.head(model.nq())).cwiseAbs().maxCoeff(),
                                (at.x_next.segment(model.nq(), model.nv()) - v).cwiseAbs().maxCoeff());
    requireSame(summary, gap <= kSameState * std::max(1.0, v.cwiseAbs().maxCoeff()), "states");
  }
  arrays["cost"] = makeList(cost);
  arrays["constraints"] = makeList(constraints);
  arrays["constraint_rows"] = makeList(rows);
}

void addGuess(const Motion& motion, NpyArrays& arrays) {
  const Model& model = motion.problem->model();
  const int stages = motion.problem->numStages();
  RowMatrixXd q(stages + 1, model.nq()), v(stages + 1, model.nv()), u(stages, model.nu());
  for (int k = 0; k <= stages; ++k) {
    q.row(k) = motion.guess.xs[k].head(model.nq()).transpose();
    v.row(k) = motion.guess.xs[k].segment(model.nq(), model.nv()).transpose();
    if (k < stages) u.row(k) = motion.guess.us[k].head(model.nu()).transpose();
  }
  arrays["guess_q"] = makeTable(q);
  arrays["guess_v"] = makeTable(v);
  arrays["guess_u"] = makeTable(u);
}

std::string formatOptimum(const Motion& motion, const MotionSummary& summary, const MotionRecord& record) {
  NpyArrays arrays;
  arrays["time"] = makeNumbers({static_cast<size_t>(record.time.size())}, record.time.data(), record.time.size());
  for (const auto& [name, table] : {std::pair("q", &record.q),
                                    {"v", &record.v},
                                    {"u", &record.u},
                                    {"a", &record.a},
                                    {"q_mid", &record.q_mid},
                                    {"v_mid", &record.v_mid}})
    arrays[name] = makeTable(*table);
  arrays["closure_wrenches"] = makeTable(record.closure_wrenches, 6);
  arrays["contact_wrenches"] = makeTable(record.contact_wrenches, 6);
  addValues(motion, summary, record, arrays);
  if (record.multipliers.penalty > 0) {
    std::vector<double> multipliers;
    for (const VectorXd& node : record.multipliers.values)
      multipliers.insert(multipliers.end(), node.begin(), node.end());
    arrays["multipliers"] = makeList(multipliers);
  }
  addGuess(motion, arrays);
  return formatArchive(arrays);
}

}  // namespace

ProblemText formatProblem(const Model& model, const MotionSummary& summary, const MotionRecord& record,
                          const Json& robot_files) {
  const auto refuse = [&summary](const std::string& element, const std::string& problem, const std::string& remedy) {
    throw InputError(summary.file, element, problem, remedy);
  };
  if (record.cycle.size() > 0)
    refuse("periodic", "its first state is free, which the format does not have", "solve it without --periodic");
  if (!summary.converged) refuse("converged", "the motion is no optimum", "solve it to convergence");
  const Motion motion = remakeMotion(model, summary);
  if (summary.formulation != Formulation::Reduced || summary.step != StepRule::Midpoint)
    refuse("formulation", "problems are written for closed states and midpoint steps",
           "solve the motion without --formulation and --step");
  requireSame(summary,
              record.q.rows() == motion.problem->numStages() + 1 && record.q.cols() == model.nq() &&
                  record.u.cols() == model.nu(),
              "stages");
  ProblemText text;
  text.npz = formatOptimum(motion, summary, record);
  text.json = formatJson(ProblemWriter(motion, summary).write(robot_files)) + "\n";
  return text;
}

}  // namespace bielle
