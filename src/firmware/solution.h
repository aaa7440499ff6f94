#pragma once
// How the coordinates of a mechanism follow from some of them, and their rates from those.
#include <optional>

#include "firmware/numeric_mechanism.h"

namespace bielle::firmware {

// Coordinates from the given ones: `before` one after the other in closed form, then `unknowns` by Newton's method, then `after`.
struct Solution {
  std::vector<int> given;
  std::vector<std::pair<int, Scalar>> before, after;  // formulas of what is known by then
  Scalar least_before = 1, least_after = 1;           // radicands: negative out of reach
  std::vector<int> unknowns;
  std::vector<Scalar> guesses;  // of the unknowns, polynomials of the given coordinates
  std::vector<Scalar> steps;    // of Newton's method, formulas of the coordinates
  int iterations = 0;

  bool isClosedForm() const { return unknowns.empty(); }
};
// \param samples  closed postures over the range; the first one is the reference
// \throws InputError when the equations do not determine the coordinates
Solution solve(const Mechanism& mechanism, const std::vector<int>& given, const Postures& samples);

// Rates of the first order. R, the rates of the motors for unit rates of the joints, comes first; what follows from it has its
// entries as inputs (Mechanism::ratio()), and the rates of the joints (Mechanism::velocity()).
struct RateSolution {
  MatrixXs R, S;                 // S = R^-1
  Scalar determinant = 1;        // D_J of numeric_mechanism.h, Eq. (3)
  Scalar ratio_determinant = 1;  // of R, but for the sign
  MatrixXs T;                    // rates of all coordinates (coordinates x size)
  MatrixXs R_rate;               // dR/dt
  Scalar log_rate = 0;           // d log D_J/dt
};
RateSolution solveRates(const Mechanism& mechanism, const Postures& samples);

// X with A X = B, by elimination of as many independent rows as A has columns, in an order that samples of the inputs show to be
// safe. Columns without a pivot, which have no effect, get zeros.
struct Elimination {
  MatrixXs X;
  Scalar determinant = 1;  // of A's independent rows, but for the sign
};
Elimination eliminate(MatrixXs A, MatrixXs B, const Postures& samples);

// T: double or float. Largest step of Newton's method that the last iteration makes goes to `last`, the least radicand to `least`.
template <typename T>
struct Evaluated {
  std::vector<T> z;
  T least = 1, last = 0;
};

// A solution as programs: what is generated, and how it is measured.
struct SolutionPrograms {
  explicit SolutionPrograms(const Solution& solution);
  Program before, step, after;  // outputs: coordinates, then the radicand (but of step); `before` has the guesses, too
  Solution solution;

  OperationCount count() const;
  // \param z  in: given coordinates; the others are overwritten
  template <typename T>
  Evaluated<T> evaluate(std::vector<T> z, int iterations) const;
};

constexpr double kLongestStep = 0.5;  // rad or m
constexpr double kSettled = 1e-3;     // the last step of what is reached

template <typename T>
Evaluated<T> SolutionPrograms::evaluate(std::vector<T> z, int iterations) const {
  Evaluated<T> out;
  const auto put = [&](int c, T value) { z[static_cast<size_t>(c)] = value; };
  const std::vector<T> first = before.evaluate(z);
  size_t k = 0;
  for (const auto& [c, formula] : solution.before) put(c, first[k++]);
  for (int c : solution.unknowns) put(c, first[k++]);
  out.least = first[k];
  for (int i = 0; i < iterations && !solution.isClosedForm(); ++i) {
    const std::vector<T> steps = step.evaluate(z);
    out.last = 0;
    for (size_t u = 0; u < steps.size(); ++u) {
      const T most = static_cast<T>(kLongestStep);
      const T d = steps[u] > most ? most : steps[u] >= -most ? steps[u] : -most;
      out.last = std::max(out.last, std::abs(d));
      z[static_cast<size_t>(solution.unknowns[u])] += d;
    }
  }
  if (!solution.after.empty()) {
    const std::vector<T> last = after.evaluate(z);
    k = 0;
    for (const auto& [c, formula] : solution.after) put(c, last[k++]);
    out.least = std::min(out.least, last[k]);
  }
  out.z = std::move(z);
  return out;
}

}  // namespace bielle::firmware
