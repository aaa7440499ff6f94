#pragma once
/// \file A linkage beside measured positions of its motors and joints: what is left of them, and its derivatives.
///
/// Unknown are changes of numbers of the geometry (geometry.h) and an offset of each sensor, x = (l, o). The sensor s reads
/// coordinate c_s with noise of the standard deviation sigma_s, y = q_c + o + noise, motors and joints alike (errors in variables).
/// At a row of the log, the configuration is the likeliest of those that close the loops with the lengths l,
///     q(x) = argmin |r|^2  such that  h(q, l) = 0,    r = W (y - o - S q),    W = diag(1/sigma)                      (1)
/// with S selecting coordinates. The likeliest x minimizes the sum of |r(x)|^2 over all rows. Gauss-Newton steps of (1) go along
/// the basis N of closed motions (reduction.h),
///     dq = N z,    z = argmin |A z - r|,    A = W S N,                                                               (2)
/// each closed again. With x, the loops move q by e_i = J^+ dh/dl_i and N z on top, and with P = 1 - A A^+
///     dr/dl_i = -P W S e_i,    dr/do_s = -P W 1_s                                                                   (3)
/// is Kaufman's form of the derivative of a separable least-squares problem (Golub and Pereyra, Inverse Problems 19, 2003): exact
/// where r vanishes, and with an exact gradient of |r|^2 everywhere, since A^T r = 0. The rank of P, the number of sensors less the
/// freedoms of the linkage, is how many numbers a row has to tell about x.
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "dynamics/reduction.h"
#include "identify/geometry.h"
#include "solve/team.h"

namespace bielle {

/// A measured coordinate of a linkage.
struct LinkageSensor {
  std::string name;     ///< of the coordinate, and of the column
  int position = 0;     ///< entry of the cluster's q
  int dof = 0;          ///< and v
  double noise = 1e-4;  ///< sigma, rad or m
  bool is_length = false;
};

class LogFit {
 public:
  /// \param cluster   with idle spins held   \param q_start  nq of the cluster, closed
  /// \param readings  K x sensors, rad or m, each row next to the one before it
  LogFit(std::shared_ptr<const ReducedCluster> cluster, std::vector<GeometryNumber> geometry,
         std::vector<LinkageSensor> sensors, MatrixXd readings, VectorXd q_start);

  const std::vector<GeometryNumber>& geometry() const { return geometry_; }
  const std::vector<LinkageSensor>& sensors() const { return sensors_; }
  int size() const { return static_cast<int>(geometry_.size() + sensors_.size()); }  ///< of x

  /// Follows the given robot through the readings, once, before everything else. Rows where no configuration is found are left out.
  /// \return false if `interrupt` asked for the end
  bool follow(const std::atomic<bool>& interrupt);
  int numRows() const { return static_cast<int>(used_.size()); }
  const std::vector<Eigen::Index>& usedRows() const { return used_; }  ///< in increasing order
  const MatrixXd& configurations() const { return q_; }  ///< nq x used rows, closed, of the last evaluation

  /// r of all rows that are used (rows x sensors, one after the other), and its derivative by Eq. (3) (entries of r x size()), if
  /// asked for. The results do not depend on the number of threads. False if a configuration is not found.
  bool evaluate(const VectorXd& x, VectorXd& r, MatrixXd* J);
  /// Of the last evaluation: the ranks of P, summed over the rows.
  long numTold() const { return told_; }
  /// y - o - S q (rows x sensors), rad or m, from r.
  MatrixXd calcLeft(const VectorXd& r) const;
  /// Number of freedoms that the sensors see at a row's configuration: rank of A. \param q  nq, closed
  int calcSeenFreedoms(const VectorXd& q) const;

 private:
  struct Memory;
  bool project(const ReducedCluster& cluster, const VectorXd& readings, Memory& memory) const;
  bool evaluateRow(const ReducedCluster& cluster, const VectorXd& x, size_t row, Memory& memory, VectorXd& r,
                   MatrixXd* J, int& told);

  std::shared_ptr<const ReducedCluster> cluster_;
  std::vector<GeometryNumber> geometry_;
  std::vector<ModelVariation> variations_;  // by the numbers
  std::vector<LinkageSensor> sensors_;
  MatrixXd readings_;
  VectorXd q_start_;
  std::vector<Eigen::Index> used_;  // rows of the readings
  MatrixXd q_;                      // nq x used rows: where the search of Eq. (1) begins
  long told_ = 0;
  Team team_;
};

}  // namespace bielle
