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

// As pagmo wants problems: a value with these members. Whole numbers come last there; its NSGA-II gives them the value of either parent
// or any other, and refuses those that have only one, which it does not see.
struct PagmoProblem {
  const FrontProblem* problem;
  std::vector<Eigen::Index> order;  // variables in pagmo's order
  pagmo::vector_double::size_type num_whole = 0;

  explicit PagmoProblem(const FrontProblem* p = nullptr) : problem(p) {
    for (const bool whole : {false, true})
      for (Eigen::Index i = 0; p && i < p->lower.size(); ++i) {
        const bool is_whole = static_cast<size_t>(i) < p->whole.size() && p->whole[static_cast<size_t>(i)];
        if (is_whole != whole || p->lower[i] == p->upper[i]) continue;
        order.push_back(i);
        num_whole += whole;
      }
  }
  VectorXd makeDesign(const double* x) const {
    VectorXd design = problem->starts.front();
    for (size_t i = 0; i < order.size(); ++i) design[order[i]] = x[i];
    return design;
  }
  pagmo::vector_double sort(const VectorXd& x) const {
    pagmo::vector_double sorted;
    for (const Eigen::Index i : order) sorted.push_back(x[i]);
    return sorted;
  }
  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    return problem->evaluate({makeDesign(x.data())}).front();
  }
  pagmo::vector_double::size_type get_nobj() const {
    return static_cast<pagmo::vector_double::size_type>(problem ? problem->objectives : 1);
  }
  pagmo::vector_double::size_type get_nix() const { return num_whole; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    if (!problem) return {{0}, {1}};
    return {sort(problem->lower), sort(problem->upper)};
  }
};

// A generation at once.
struct PagmoBatch {
  pagmo::vector_double operator()(const pagmo::problem& of, const pagmo::vector_double& xs) const {
    const PagmoProblem& problem = *of.extract<PagmoProblem>();
    std::vector<VectorXd> designs;
    for (size_t i = 0; i < xs.size(); i += problem.order.size()) designs.push_back(problem.makeDesign(&xs[i]));
    pagmo::vector_double out;
    for (const std::vector<double>& objectives : problem.problem->evaluate(designs))
      out.insert(out.end(), objectives.begin(), objectives.end());
    return out;
  }
};

pagmo::algorithm makeAlgorithm(const FrontProblem& problem, const FrontOptions& options, unsigned seed) {
  const auto generations = static_cast<unsigned>(options.generations);
  if (options.algorithm == SearchAlgorithm::Nsga2) {
    const double mutation = 1.0 / static_cast<double>(problem.lower.size());
    pagmo::nsga2 nsga2(generations, kCrossover, kCrossoverIndex, mutation, kMutationIndex, seed);
    nsga2.set_bfe(pagmo::bfe(PagmoBatch()));
    return pagmo::algorithm(nsga2);
  }
  if (options.algorithm != SearchAlgorithm::Moead)
    throw std::invalid_argument("the algorithm does not support several objectives");
  const unsigned neighbours = std::min(kMostNeighbours, static_cast<unsigned>(options.population) / 2);
  return pagmo::algorithm(pagmo::moead(generations, "low discrepancy", "tchebycheff", neighbours, 1.0, 0.5,
                                       kMutationIndex, 0.9, 2, true, seed));
}

}  // namespace

bool hasFrontSearch() { return true; }

void searchFront(const FrontProblem& problem, const FrontOptions& options, unsigned seed) {
  if (options.generations == 0) {
    problem.evaluate(problem.starts);
    return;
  }
  const PagmoProblem of_pagmo(&problem);
  if (of_pagmo.num_whole > 0 && options.algorithm == SearchAlgorithm::Moead)
    throw std::invalid_argument("moead does not support integers");
  pagmo::population population(pagmo::problem(of_pagmo), 0, seed);
  std::vector<VectorXd> designs = problem.starts;
  while (static_cast<int>(designs.size()) < options.population) {
    const pagmo::vector_double x = population.random_decision_vector();
    designs.push_back(of_pagmo.makeDesign(x.data()));
  }
  const std::vector<std::vector<double>> objectives = problem.evaluate(designs);
  for (size_t i = 0; i < designs.size(); ++i) population.push_back(of_pagmo.sort(designs[i]), objectives[i]);
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
