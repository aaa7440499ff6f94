#include "bielle/dynamics/linkage.h"
#include "firmware/languages.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle::firmware {
namespace {

using Eigen::Index;

void append(const MatrixXs& A, std::vector<Scalar>& out) {
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < A.cols(); ++j) out.push_back(A(i, j));
}

std::string plural(int n, const std::string& what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

std::string describe(const OperationCount& n) {
  return plural(n.multiplications, "multiplication") + ", " + plural(n.additions, "addition") + ", " +
         plural(n.divisions, "division") + ", " + plural(n.roots, "root") + ", " +
         plural(n.trigonometric, "trigonometric call");
}

std::string describe(const Solution& solution, long postures) {
  const SolutionPrograms programs(solution);
  std::string how = "closed form";
  if (!solution.isClosedForm())
    how = "Newton's method on " + plural(static_cast<int>(solution.unknowns.size()), "coordinate") + ", " +
          plural(solution.iterations, "iteration") + ", tested at " + std::to_string(postures) + " postures";
  return how + "; " + describe(programs.count());
}

}  // namespace

Formulas::Formulas(const Maps& maps) {
  const Mechanism& mechanism = maps.mechanism;
  const RateSolution& rates = maps.rates;
  const Index n = rates.T.rows(), m = rates.T.cols();
  std::vector<Scalar> entries;
  append(rates.R, entries);
  append(rates.S, entries);
  const Eigen::VectorXd& reference = maps.samples.front();
  std::vector<double> inputs(reference.data(), reference.data() + n);
  inputs.resize(static_cast<size_t>(mechanism.velocity() + m));
  const double there = Program({rates.ratio_determinant}).evaluate(inputs)[0];
  entries.push_back(there > 0 ? rates.ratio_determinant : -rates.ratio_determinant);
  ratio = Program(entries);

  entries.clear();
  append(rates.R_rate, entries);
  entries.push_back(rates.log_rate);
  ratio_rate = Program(entries);

  // Each coordinate's part is the same in all columns.
  std::vector<Scalar> slopes;
  for (Index c = 0; c < n; ++c) slopes.push_back(Derivative({{static_cast<int>(c), 1.0}})(mechanism.potential));
  entries.clear();
  for (Index k = 0; k < m; ++k) {
    Scalar sum = 0;
    for (Index c = 0; c < n; ++c) sum += rates.T(c, k) * slopes[static_cast<size_t>(c)];
    entries.push_back(sum);
  }
  held = Program(entries);
}

std::vector<std::string> describe(const Maps& maps, bool is_single) {
  std::vector<std::string> out;
  const auto unit = [](bool slides) { return slides ? " m" : " rad"; };
  const auto number = [](double x) { return formatNumber(x, "%.4g"); };
  for (size_t i = 0; i < maps.joint_names.size(); ++i)
    out.push_back("joint[" + std::to_string(i) + "]: " + maps.joint_names[i] + ", " +
                  number(maps.lower[static_cast<Index>(i)]) + " to " + number(maps.upper[static_cast<Index>(i)]) +
                  unit(maps.joint_slides[i]));
  for (size_t i = 0; i < maps.motor_names.size(); ++i)
    out.push_back("motor[" + std::to_string(i) + "]: " + maps.motor_names[i] + ", " +
                  number(maps.motor_lower[static_cast<Index>(i)]) + " to " +
                  number(maps.motor_upper[static_cast<Index>(i)]) + unit(maps.motor_slides[i]));
  for (size_t c = 2 * maps.joint_names.size(); c < maps.mechanism.coordinates.size(); ++c)
    out.push_back("passive[" + std::to_string(c - 2 * maps.joint_names.size()) +
                  "]: " + maps.mechanism.coordinates[c].name);
  out.push_back("Rods and struts, whose ends are held at a distance: " + listItems(maps.mechanism.rods));
  out.push_back("joint_to_motor: " + describe(maps.inverse, maps.postures));
  out.push_back("motor_to_joint: " + describe(maps.direct, maps.postures));
  const Formulas formulas(maps);
  out.push_back("update_ratio: " + describe(formulas.ratio.count()));
  out.push_back("Largest errors at " + std::to_string(maps.postures) +
                " postures against the mechanism with all bodies and closures, in " + (is_single ? "float" : "double") +
                ":");
  out.push_back("motors " + formatNumber(maps.errors.motors, "%.2g") + ", joints " +
                formatNumber(maps.errors.joints, "%.2g") + " (rad, m), R " + formatNumber(maps.errors.ratio, "%.2g") +
                " of its largest entry");
  out.push_back("Largest entry of R: " + number(maps.largest_ratio) +
                "; nearest dead point in the range, as estimated: " +
                (maps.nearest < 100 ? formatNumber(maps.nearest, "%.2g") : std::string("none")));
  return out;
}

}  // namespace bielle::firmware
