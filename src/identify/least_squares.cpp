// The only file that uses Ceres.
#include "identify/least_squares.h"

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

namespace bielle {
namespace {

// Steps are relative to x, whose entries are shares of scales: these are far below any deviation.
constexpr double kShortestStep = 1e-10, kLeastDecrease = 1e-12, kLeastGradient = 1e-14;

class Cost : public ceres::CostFunction {
 public:
  explicit Cost(const LeastSquares& problem) : problem_(problem) {
    mutable_parameter_block_sizes()->push_back(problem.size);
    set_num_residuals(problem.residuals);
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const VectorXd x = VectorXd::Map(parameters[0], problem_.size);
    const bool with_jacobian = jacobians && jacobians[0];
    VectorXd r;
    MatrixXd J;
    if (!problem_.evaluate(x, r, with_jacobian ? &J : nullptr)) return false;
    VectorXd::Map(residuals, r.size()) = r;
    if (with_jacobian) RowMatrixXd::Map(jacobians[0], J.rows(), J.cols()) = J;
    return true;
  }

 private:
  const LeastSquares& problem_;
};

class Progress : public ceres::IterationCallback {
 public:
  explicit Progress(const LeastSquares& problem) : problem_(problem) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (summary.iteration > 0 && !summary.step_is_successful) return ceres::SOLVER_CONTINUE;
    interrupted = problem_.progress && !problem_.progress(summary.iteration, summary.cost);
    is_enough = summary.cost <= problem_.enough;
    return interrupted || is_enough ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool interrupted = false, is_enough = false;

 private:
  const LeastSquares& problem_;
};

}  // namespace

LeastSquaresEnd minimize(const LeastSquares& problem) {
  LeastSquaresEnd end;
  end.x = VectorXd::Zero(problem.size);
  if (problem.size == 0) {
    end.converged = true;
    end.message = "there is nothing to find";
    return end;
  }
  ceres::Problem posed;
  posed.AddResidualBlock(new Cost(problem), nullptr, end.x.data());  // which the problem owns
  Progress progress(problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = problem.iterations;
  options.function_tolerance = kLeastDecrease;
  options.parameter_tolerance = kShortestStep;
  options.gradient_tolerance = kLeastGradient;
  options.num_threads = 1;  // the evaluation has its own threads; the same sum in the same order
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&progress);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &posed, &summary);
  end.iterations = static_cast<int>(summary.iterations.size()) - 1;
  end.interrupted = progress.interrupted;
  end.converged = summary.termination_type == ceres::CONVERGENCE || (progress.is_enough && !end.interrupted);
  end.message = end.converged                                       ? "converged"
                : end.interrupted                                   ? "interrupted"
                : summary.termination_type == ceres::NO_CONVERGENCE ? "the iterations ended before it converged"
                                                                    : "it failed: " + summary.message;
  return end;
}

}  // namespace bielle
