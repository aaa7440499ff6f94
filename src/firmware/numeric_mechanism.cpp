#include "firmware/numeric_mechanism.h"

#include <Eigen/Dense>
#include <algorithm>

#include "model/listing.h"

namespace bielle::firmware {

using Eigen::MatrixXd, Eigen::VectorXd, Eigen::Index;

std::vector<Scalar> listRows(const Mechanism& mechanism) {
  std::vector<Scalar> rows;
  for (const Equation& equation : mechanism.equations)
    rows.insert(rows.end(), equation.rows.begin(), equation.rows.end());
  return rows;
}

MatrixXs derive(const std::vector<Scalar>& rows, const std::vector<int>& columns) {
  MatrixXs J(rows.size(), columns.size());
  for (size_t c = 0; c < columns.size(); ++c) {
    Derivative derivative({{columns[c], 1.0}});
    for (size_t r = 0; r < rows.size(); ++r) J(static_cast<Index>(r), static_cast<Index>(c)) = derivative(rows[r]);
  }
  return J;
}

std::vector<int> listRange(int begin, int end) {
  std::vector<int> out;
  for (int i = begin; i < end; ++i) out.push_back(i);
  return out;
}

std::vector<Scalar> listEntries(const MatrixXs& A) {
  std::vector<Scalar> out;
  for (Index r = 0; r < A.rows(); ++r)
    for (Index c = 0; c < A.cols(); ++c) out.push_back(A(r, c));
  return out;
}

std::vector<double> toInputs(const Mechanism& mechanism, const VectorXd& z) {
  std::vector<double> inputs(z.data(), z.data() + z.size());
  inputs.resize(static_cast<size_t>(mechanism.velocity()) + mechanism.coordinates.size());
  return inputs;
}

MatrixXd toMatrix(const std::vector<double>& entries, Index rows, Index columns) {
  return Eigen::Map<const RowMatrixXd>(entries.data(), rows, columns);
}

NumericMechanism::NumericMechanism(const Mechanism& mechanism) : mechanism_(mechanism) {
  const std::vector<Scalar> rows = listRows(mechanism);
  num_rows_ = static_cast<Index>(rows.size());
  const int n = static_cast<int>(mechanism.coordinates.size());
  const MatrixXs J = derive(rows, listRange(0, n));
  rows_ = Program(rows);
  jacobian_ = Program(listEntries(J));
  std::map<int, Scalar> rates;
  for (int c = 0; c < n; ++c) rates.emplace(c, makeInput(mechanism.velocity() + c));
  Derivative derivative(rates);
  std::vector<Scalar> drift;
  for (const Scalar& entry : listEntries(J)) drift.push_back(derivative(entry));
  drift_ = Program(drift);
}

MatrixXd NumericMechanism::calcJacobian(const VectorXd& z) const {
  return toMatrix(jacobian_.evaluate(toInputs(mechanism_, z)), num_rows_, z.size());
}

bool NumericMechanism::close(const std::vector<int>& given, VectorXd& z) const {
  std::vector<int> free;
  for (int c = 0; c < z.size(); ++c)
    if (!contains(given, c)) free.push_back(c);
  for (int i = 0; i < 30; ++i) {
    const std::vector<double> r = rows_.evaluate(toInputs(mechanism_, z));
    const MatrixXd J = calcJacobian(z)(Eigen::all, free);
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
    factors.setThreshold(1e-8);
    factors.compute(J);
    const VectorXd step = factors.solve(Eigen::Map<const VectorXd>(r.data(), num_rows_));
    if (!step.allFinite()) return false;
    const double longest = step.size() ? step.cwiseAbs().maxCoeff() : 0;
    z(free) -= step * std::min(1.0, 0.3 / std::max(longest, 1e-300));
    if (longest < 1e-13) {
      const std::vector<double> rest = rows_.evaluate(toInputs(mechanism_, z));
      return Eigen::Map<const VectorXd>(rest.data(), num_rows_).cwiseAbs().maxCoeff() < 1e-11;
    }
  }
  return false;
}

int NumericMechanism::calcExcess(const VectorXd& z) const {
  Eigen::JacobiSVD<MatrixXd> svd(calcJacobian(z));
  svd.setThreshold(1e-7);
  return static_cast<int>(z.size() - svd.rank()) - mechanism_.size;
}

NumericMechanism::Rates NumericMechanism::calcRates(const VectorXd& z) const {
  const Index m = mechanism_.size, n = z.size();
  const MatrixXd J = calcJacobian(z);
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
  factors.setThreshold(1e-8);
  factors.compute(J.rightCols(n - m));
  MatrixXd T(n, m);
  T << MatrixXd::Identity(m, m), -factors.solve(J.leftCols(m));
  Rates out;
  out.R = T.middleRows(m, m);
  std::vector<MatrixXd> dR;
  VectorXd g(m);
  for (Index k = 0; k < m; ++k) {
    std::vector<double> inputs = toInputs(mechanism_, z);
    for (Index c = 0; c < n; ++c) inputs[static_cast<size_t>(mechanism_.velocity() + c)] = T(c, k);
    const MatrixXd drift = toMatrix(drift_.evaluate(inputs), num_rows_, n);
    dR.push_back(-factors.solve(drift * T).topRows(m));
    g[k] = factors.solve(drift.rightCols(n - m)).trace();
  }
  out.distance = calcDistance(out.R, dR, g);
  return out;
}

double calcDistance(const MatrixXd& R, const std::vector<MatrixXd>& dR, const VectorXd& g) {
  const MatrixXd S = R.inverse();
  VectorXd other = g;
  for (Index k = 0; k < g.size(); ++k) other[k] += (S * dR[static_cast<size_t>(k)]).trace();
  double nearest = INFINITY;
  for (const VectorXd& way : {g, other}) {
    const double steepest = std::min(way.norm(), (S.transpose() * way).norm());
    if (steepest > 0) nearest = std::min(nearest, 1 / steepest);
  }
  return nearest;
}

}  // namespace bielle::firmware
