#pragma once
// Constraints for the small problems of solve_problems.h, with derivatives by complex steps, and one such problem.
#include <functional>
#include <limits>
#include <string>

#include "solve_problems.h"

namespace bielle::test {

using Complex = std::complex<double>;

/// One row: lower <= value(x, u) <= upper at the nodes first to last. At the terminal node u is null.
struct Row {
  std::string name;
  int first = 0, last = 0;
  double lower = 0, upper = 0;
  std::function<Complex(const Complex* x, const Complex* u)> value;
};

template <class Base>
class Constrained : public Base {
 public:
  using Base::difference, Base::evaluate, Base::integrate, Base::linearize;
  explicit Constrained(const Base& base) : Base(base) {}

  std::vector<Row> rows;

  int constraintSize(int node) const override {
    int size = 0;
    for (const Row& row : rows) size += isAt(row, node);
    return size;
  }
  void getConstraintBounds(int node, VectorRef lower, VectorRef upper) const override {
    visit(node, [&](const Row& row, int i) {
      lower[i] = row.lower;
      upper[i] = row.upper;
    });
  }
  std::string getConstraintName(int node, int index) const override {
    std::string name;
    visit(node, [&](const Row& row, int i) {
      if (i == index) name = row.name;
    });
    return name;
  }
  void evaluate(EvaluateTask& task, ProblemScratch* scratch) const override {
    Base::evaluate(task, scratch);
    NodeEvaluation& out = *task.out;
    out.constraints.resize(constraintSize(task.node));
    visit(task.node, [&](const Row& row, int i) { out.constraints[i] = calc(row, task.node, out, -1).real(); });
  }
  void linearize(LinearizeTask& task, ProblemScratch* scratch) const override {
    Base::linearize(task, scratch);
    if (!task.rows) return;
    const int nx = Base::kX, nu = task.node < this->numStages() ? Base::kU : 0;
    visit(task.node, [&](const Row& row, int i) {
      auto column = task.out->Ct().col(i);  // poisoned where it is not wanted
      for (int j = 0; j < nu + nx; ++j) {
        const int seed = j < nu ? nx + j : j - nu;
        column[j] = (*task.rows)[i] ? calc(row, task.node, *task.at, seed).imag() / kStep : NAN;
      }
    });
  }

 private:
  static constexpr double kStep = 1e-30;

  bool isAt(const Row& row, int node) const { return node >= row.first && node <= row.last; }
  template <class Visit>
  void visit(int node, const Visit& work) const {
    int i = 0;
    for (const Row& row : rows)
      if (isAt(row, node)) work(row, i++);
  }
  // Entry `seed` of (x, u) carries the complex step.
  Complex calc(const Row& row, int node, const NodeEvaluation& at, int seed) const {
    std::array<Complex, Base::kX> x;
    std::array<Complex, Base::kU> u;
    for (int i = 0; i < Base::kX; ++i) x[i] = at.x[i];
    const bool running = node < this->numStages();
    for (int i = 0; running && i < Base::kU; ++i) u[i] = at.u[i];
    if (seed >= 0) (seed < Base::kX ? x[seed] : u[seed - Base::kX]) += Complex(0, kStep);
    return row.value(x.data(), running ? u.data() : nullptr);
  }
};

constexpr double kFree = std::numeric_limits<double>::infinity();

inline Complex getTip(const Complex* x, const Complex*) { return x[0] + 0.5 * std::sin(x[1]); }

// A cart that catches its pole: the tip must not go far, there is a limit to the force that falls with the speed, and the
// end is exactly at rest.
constexpr double kFarthest = 0.74, kPush = 6;
inline Constrained<PlantProblem<CartPole>> makeBoundedCartPole() {
  Constrained<PlantProblem<CartPole>> p(makeCartPole());
  const int N = p.stages;
  p.start << 0.3, 0.3, 0, 0;
  p.terminal_weight.setConstant(1);
  p.rows.push_back({"tip", 1, N, -kFree, kFarthest, getTip});
  p.rows.push_back({"push", 0, N - 1, -kPush, kFree, [](const Complex* x, const Complex* u) { return u[0] - x[2]; }});
  for (int i = 0; i < 4; ++i)
    p.rows.push_back({"end " + std::to_string(i), N, N, 0, 0, [i](const Complex* x, const Complex*) { return x[i]; }});
  return p;
}

}  // namespace bielle::test
