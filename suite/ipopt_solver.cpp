#include "ipopt_solver.h"

#define HAVE_CSTDDEF  // headers of IPOPT before 3.14 refuse to be included without
#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <cstdlib>
#include <ctime>

#include "bielle/model/error.h"
#include "collocation.h"
#include "multiple_shooting.h"

namespace bielle {
namespace {

using Ipopt::Index;
using Ipopt::Number;

constexpr double kNone = 1e20;  // of a bound that there is not: beyond nlp_upper_bound_inf

double getProcessorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// What IPOPT asks for, from a NonlinearProgram, and what it finds.
class ProgramAdapter : public Ipopt::TNLP {
 public:
  explicit ProgramAdapter(NonlinearProgram& program) : program_(program), begin_(getProcessorSeconds()) {}

  VectorXd z, multipliers;  // at the end
  std::vector<FddpIteration> log;

  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian, IndexStyleEnum& style) override {
    n = static_cast<Index>(program_.variables().lower.size());
    m = static_cast<Index>(program_.rows().lower.size());
    jacobian = program_.jacobian().size();
    hessian = program_.hessian().size();
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* row_lower, Number* row_upper) override {
    const auto put = [](const VectorXd& from, Number* to) {
      Eigen::Map<VectorXd>(to, from.size()) = from.cwiseMax(-kNone).cwiseMin(kNone);
    };
    put(program_.variables().lower, lower);
    put(program_.variables().upper, upper);
    put(program_.rows().lower, row_lower);
    put(program_.rows().upper, row_upper);
    return n == program_.variables().lower.size() && m == program_.rows().lower.size();
  }

  bool get_starting_point(Index n, bool init_z, Number* start, bool init_bounds, Number*, Number*, Index,
                          bool init_multipliers, Number*) override {
    if (init_z) Eigen::Map<VectorXd>(start, n) = program_.start();
    return !init_bounds && !init_multipliers;
  }

  bool eval_f(Index n, const Number* at, bool, Number& cost) override {
    if (!program_.evaluate(map(at, n))) return false;
    cost = program_.calcCost();
    return true;
  }
  bool eval_grad_f(Index n, const Number* at, bool, Number* gradient) override {
    if (!program_.linearize(map(at, n))) return false;
    program_.getGradient(map(gradient, n));
    return true;
  }
  bool eval_g(Index n, const Number* at, bool, Index m, Number* rows) override {
    if (!program_.evaluate(map(at, n))) return false;
    program_.getRows(map(rows, m));
    return true;
  }
  bool eval_jac_g(Index n, const Number* at, bool, Index, Index count, Index* rows, Index* columns,
                  Number* values) override {
    if (!values) return put(program_.jacobian(), rows, columns);
    if (!program_.linearize(map(at, n))) return false;
    program_.getJacobian(map(values, count));
    return true;
  }
  bool eval_h(Index n, const Number* at, bool, Number factor, Index, const Number*, bool, Index count, Index* rows,
              Index* columns, Number* values) override {
    if (!values) return put(program_.hessian(), rows, columns);
    if (!program_.linearize(map(at, n))) return false;
    program_.getHessian(map(values, count));
    map(values, count) *= factor;
    return true;
  }

  // Violations are those of constraints and gaps together.
  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number cost, Number violation, Number gradient,
                             Number, Number, Number regularization, Number, Number step, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    log.push_back(
        {iteration, cost, violation, violation, gradient, step, regularization, getProcessorSeconds() - begin_});
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* at, const Number*, const Number*, Index m,
                         const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    z = map(at, n);
    multipliers = map(lambda, m);
  }

 private:
  static Eigen::Map<const VectorXd> map(const Number* x, Index n) { return {x, n}; }
  static Eigen::Map<VectorXd> map(Number* x, Index n) { return {x, n}; }
  static bool put(const NonlinearProgram::Entries& entries, Index* rows, Index* columns) {
    std::copy(entries.rows.begin(), entries.rows.end(), rows);
    std::copy(entries.columns.begin(), entries.columns.end(), columns);
    return true;
  }

  NonlinearProgram& program_;
  double begin_;
};

// A number or a word: IPOPT knows which it wants.
bool set(Ipopt::IpoptApplication& solver, const std::string& name, const std::string& value) {
  char* end = nullptr;
  const double number = std::strtod(value.c_str(), &end);
  const Ipopt::SmartPtr<const Ipopt::RegisteredOption> option = solver.RegOptions()->GetOption(name);
  if (!IsValid(option)) return false;
  const bool is_number = !value.empty() && *end == '\0';
  switch (option->Type()) {
    case Ipopt::OT_Integer:
      return is_number && solver.Options()->SetIntegerValue(name, static_cast<Index>(number));
    case Ipopt::OT_Number:
      return is_number && solver.Options()->SetNumericValue(name, number);
    default:
      return solver.Options()->SetStringValue(name, value);
  }
}

void setOptions(Ipopt::IpoptApplication& solver, const IpoptOptions& options) {
  std::vector<std::pair<std::string, std::string>> all = listIpoptOptions();
  all.insert(all.end(), {{"hessian_approximation", options.hessian == IpoptHessian::Lbfgs ? "limited-memory" : "exact"},
                         {"max_iter", std::to_string(options.max_iterations)},
                         {"max_cpu_time", std::to_string(options.seconds)},
                         {"print_level", options.quiet ? "0" : "5"},
                         {"sb", "yes"}});
  all.insert(all.end(), options.settings.begin(), options.settings.end());
  for (const auto& [name, value] : all)
    if (!set(solver, name, value))
      throw InputError("", "option '" + name + "' of IPOPT", "it has no value " + value,
                       "see the reference of IPOPT's options, or print_user_options");
}

struct End {
  FddpTermination termination;
  const char* name;
};

End describe(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
      return {FddpTermination::Converged, "converged"};
    case Ipopt::Solved_To_Acceptable_Level:
      return {FddpTermination::Converged, "converged to an acceptable point"};
    case Ipopt::Maximum_Iterations_Exceeded:
      return {FddpTermination::MaxIterations, "iteration limit"};
    case Ipopt::Maximum_CpuTime_Exceeded:
      return {FddpTermination::MaxIterations, "too late"};
    case Ipopt::Infeasible_Problem_Detected:
      return {FddpTermination::Infeasible, "locally infeasible"};
    case Ipopt::Restoration_Failed:
      return {FddpTermination::Failed, "restoration failed"};
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return {FddpTermination::Failed, "search direction too small"};
    case Ipopt::Error_In_Step_Computation:
      return {FddpTermination::Failed, "error in the step computation"};
    case Ipopt::Invalid_Number_Detected:
      return {FddpTermination::Failed, "cannot be evaluated"};
    case Ipopt::Insufficient_Memory:
      return {FddpTermination::Failed, "too little memory"};
    default:
      return {FddpTermination::Failed, "failed"};
  }
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& listIpoptOptions() {
  static const std::vector<std::pair<std::string, std::string>> options = {{"linear_solver", "mumps"},
                                                                           {"mu_strategy", "adaptive"},
                                                                           {"nlp_scaling_method", "none"},
                                                                           {"limited_memory_max_history", "20"},
                                                                           {"bound_relax_factor", "0"},
                                                                           {"tol", "1e-6"},
                                                                           {"constr_viol_tol", "1e-8"},
                                                                           {"compl_inf_tol", "1e-6"},
                                                                           {"dual_inf_tol", "3e-5"},
                                                                           {"acceptable_iter", "1"},
                                                                           {"acceptable_tol", "1e-2"},
                                                                           {"acceptable_constr_viol_tol", "1e-8"},
                                                                           {"acceptable_compl_inf_tol", "1e-4"},
                                                                           {"acceptable_obj_change_tol", "5e-6"}};
  return options;
}

IpoptSolution solveByIpopt(const Motion& motion, const ShootingTrajectory& guess, const IpoptOptions& options) {
  const double begin = getProcessorSeconds();
  std::unique_ptr<NonlinearProgram> owned;
  std::vector<std::string> dropped;
  if (options.transcription == IpoptTranscription::Collocation) {
    auto collocation = std::make_unique<Collocation>(*motion.problem, guess);
    dropped = collocation->listDropped();
    owned = std::move(collocation);
  } else {
    owned = std::make_unique<MultipleShooting>(*motion.problem, guess);
  }
  NonlinearProgram& program = *owned;
  ProgramAdapter* const adapter = new ProgramAdapter(program);
  const Ipopt::SmartPtr<Ipopt::TNLP> owner = adapter;
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> solver = IpoptApplicationFactory();
  setOptions(*solver, options);
  IpoptSolution out{{motion, guess, {}}, "failed", dropped};
  FddpSummary& summary = out.solution.summary;
  if (const auto status = solver->Initialize(); status != Ipopt::Solve_Succeeded)
    throw InputError("", "IPOPT", "it refuses its options", "leave out those that were given");
  const Ipopt::ApplicationReturnStatus status = solver->OptimizeTNLP(owner);
  const End end = describe(status);
  summary.termination = end.termination;
  summary.acceptable = status == Ipopt::Solved_To_Acceptable_Level;
  summary.message = out.end = end.name;
  summary.log = adapter->log;
  if (!program.failure().empty() && end.termination == FddpTermination::Failed)
    summary.message += ": " + program.failure();
  if (IsValid(solver->Statistics())) summary.iterations = solver->Statistics()->IterationCount();
  if (adapter->z.size() > 0 && program.evaluate(adapter->z)) {
    out.solution.trajectory = program.trajectory();
    out.solution.multipliers = program.expand(adapter->multipliers);
    out.solution.multipliers.penalty = FddpOptions().constraints.initial_penalty;  // where a solve from there begins
    summary.cost = program.calcCost();
    summary.violation = program.calcViolation();
    summary.gap = program.calcGap();
    summary.penalty = out.solution.multipliers.penalty;
    for (const VectorXd& values : out.solution.multipliers.values)
      if (values.size() > 0) summary.multiplier = std::max(summary.multiplier, values.cwiseAbs().maxCoeff());
  }
  summary.seconds = getProcessorSeconds() - begin;
  return out;
}

}  // namespace bielle
