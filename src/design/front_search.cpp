#include "design/front_search.h"

#include <algorithm>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/moead.hpp>
#include <pagmo/algorithms/nsga2.hpp>
#include <pagmo/bfe.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <pagmo/utils/multi_objective.hpp>
#include <stdexcept>

namespace bielle {
namespace {

// Distribution indices of crossover and mutation, and the probability of the former, are those of Deb et al. for real numbers.
constexpr double kCrossover = 0.9, kCrossoverIndex = 20, kMutationIndex = 20;
constexpr unsigned kMostNeighbours = 20;  // of MOEA/D

VectorXd makeDesign(const double* x, Eigen::Index size) { return VectorXd::Map(x, size); }

// As pagmo wants problems: a value with these members.
struct PagmoProblem {
  const FrontProblem* problem = nullptr;

  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    return problem->evaluate({makeDesign(x.data(), problem->start.size())}).front();
  }
  pagmo::vector_double::size_type get_nobj() const {
    return static_cast<pagmo::vector_double::size_type>(problem ? problem->objectives : 1);
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    if (!problem) return {{0}, {1}};
    return {{problem->lower.begin(), problem->lower.end()}, {problem->upper.begin(), problem->upper.end()}};
  }
};

// A generation at once.
struct PagmoBatch {
  pagmo::vector_double operator()(const pagmo::problem& of, const pagmo::vector_double& xs) const {
    const FrontProblem& problem = *of.extract<PagmoProblem>()->problem;
    const auto n = static_cast<size_t>(problem.start.size());
    std::vector<VectorXd> designs;
    for (size_t i = 0; i < xs.size(); i += n) designs.push_back(makeDesign(&xs[i], problem.start.size()));
    pagmo::vector_double out;
    for (const std::vector<double>& objectives : problem.evaluate(designs))
      out.insert(out.end(), objectives.begin(), objectives.end());
    return out;
  }
};

pagmo::algorithm makeAlgorithm(const FrontProblem& problem, const FrontOptions& options, unsigned seed) {
  const auto generations = static_cast<unsigned>(options.generations);
  if (options.algorithm == SearchAlgorithm::Nsga2) {
    const double mutation = 1.0 / static_cast<double>(problem.start.size());
    pagmo::nsga2 nsga2(generations, kCrossover, kCrossoverIndex, mutation, kMutationIndex, seed);
    nsga2.set_bfe(pagmo::bfe(PagmoBatch()));
    return pagmo::algorithm(nsga2);
  }
  if (options.algorithm != SearchAlgorithm::Moead) throw std::invalid_argument("no algorithm for several objectives");
  const unsigned neighbours = std::min(kMostNeighbours, static_cast<unsigned>(options.population) / 2);
  return pagmo::algorithm(pagmo::moead(generations, "low discrepancy", "tchebycheff", neighbours, 1.0, 0.5,
                                       kMutationIndex, 0.9, 2, true, seed));
}

}  // namespace

bool hasFrontSearch() { return true; }

void searchFront(const FrontProblem& problem, const FrontOptions& options, unsigned seed) {
  pagmo::population population(pagmo::problem(PagmoProblem{&problem}), 0, seed);
  std::vector<VectorXd> designs = {problem.start};
  while (static_cast<int>(designs.size()) < options.population) {
    const pagmo::vector_double x = population.random_decision_vector();
    designs.push_back(makeDesign(x.data(), problem.start.size()));
  }
  const std::vector<std::vector<double>> objectives = problem.evaluate(designs);
  for (size_t i = 0; i < designs.size(); ++i)
    population.push_back(pagmo::vector_double(designs[i].begin(), designs[i].end()), objectives[i]);
  makeAlgorithm(problem, options, seed).evolve(population);
}

std::vector<size_t> selectFront(const std::vector<std::vector<double>>& objectives, size_t most) {
  std::vector<size_t> front(objectives.size());
  for (size_t i = 0; i < front.size(); ++i) front[i] = i;
  if (objectives.size() > 1) front = std::get<0>(pagmo::fast_non_dominated_sorting(objectives)).front();
  if (front.size() > most) {
    std::vector<std::vector<double>> of_front;
    for (size_t i : front) of_front.push_back(objectives[i]);
    std::vector<size_t> kept;
    for (size_t i : pagmo::select_best_N_mo(of_front, most)) kept.push_back(front[i]);
    front = kept;
  }
  std::sort(front.begin(), front.end(),
            [&](size_t i, size_t j) { return std::pair(objectives[i], i) < std::pair(objectives[j], j); });
  return front;
}

}  // namespace bielle
