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
///
/// Play (model/wear.h) of the size w lets a gear or a rod be at either of two stops. With the side g = +-1 of a row, which the load
/// tells (play_sides.h), a motor reads by g w / 2 more than where its link is, and a rod is longer by g w / 2:
///     o_s -> o_s + g w / 2,   l_i -> l_i + g w / 2,   dr/dw = g/2 dr/do_s  or  g/2 dr/dl_i                           (4)
/// Where g never changes, w cannot be told from the offset or the length.
#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <utility>
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

/// What of a linkage may have play.
struct LinkagePlay {
  std::string name;    ///< of a motor or a closure
  double size = 0;     ///< w of the given robot, rad or m
  int sensor = -1;     ///< of a gear: that of its motor
  GeometryNumber rod;  ///< of a closure: how its rod gets longer
};

class LogFit {
 public:
  /// \param cluster   with idle spins held   \param q_start  nq of the cluster, closed
  /// \param readings  K x sensors, rad or m, each row next to the one before it
  LogFit(std::shared_ptr<const ReducedCluster> cluster, std::vector<GeometryNumber> geometry,
         std::vector<LinkageSensor> sensors, MatrixXd readings, VectorXd q_start);
  /// With play, x = (l, o, w); before follow(). \param sides  K x plays: g of Eq. (4); 0: not known, and the row is left out
  void addPlays(std::vector<LinkagePlay> plays, MatrixXd sides);

  const std::vector<GeometryNumber>& geometry() const { return geometry_; }
  const std::vector<LinkageSensor>& sensors() const { return sensors_; }
  const std::vector<LinkagePlay>& plays() const { return plays_; }
  int size() const { return static_cast<int>(geometry_.size() + sensors_.size() + plays_.size()); }  ///< of x

  /// Follows the given robot through the readings, once, before everything else. Rows where no configuration is found are left out.
  /// \return false if `interrupt` asked for the end
  bool follow(const std::atomic<bool>& interrupt);
  int numRows() const { return static_cast<int>(used_.size()); }
  const std::vector<Eigen::Index>& usedRows() const { return used_; }  ///< in increasing order
  /// Those with a configuration, also where play is at no stop that is known
  const std::vector<Eigen::Index>& followedRows() const { return followed_; }
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
  /// dq/dl of the rods that have play, motors as heavy as joints (nv of the cluster x plays; 0 for gears), and the basis N, at a
  /// configuration of the given robot. \param q  nq, closed
  std::pair<MatrixXd, MatrixXd> calcPlayMotions(const VectorXd& q) const;

 private:
  struct Memory;
  // The cluster with the lengths of x, one for each way in which rods are at their stops.
  using Variants = std::map<std::vector<double>, ReducedCluster>;
  std::vector<double> listSides(Eigen::Index row) const;  // of the rods; row of the readings
  Variants makeVariants(const VectorXd& x) const;
  bool project(const ReducedCluster& cluster, const VectorXd& readings, Memory& memory) const;
  void updateMoves(const ReducedCluster& cluster, const std::vector<ModelVariation>& variations, Memory& memory,
                   MatrixXd& e) const;
  bool evaluateRow(const ReducedCluster& cluster, const VectorXd& x, size_t row, Memory& memory, VectorXd& r,
                   MatrixXd* J, int& told);

  std::shared_ptr<const ReducedCluster> cluster_;
  std::vector<GeometryNumber> geometry_;
  std::vector<ModelVariation> variations_;  // by the numbers
  std::vector<LinkageSensor> sensors_;
  std::vector<LinkagePlay> plays_;
  std::vector<ModelVariation> play_variations_;  // by the rods, empty moves for gears
  MatrixXd readings_, sides_;
  VectorXd q_start_;
  std::vector<Eigen::Index> used_, followed_;  // rows of the readings
  MatrixXd q_;                                 // nq x used rows: where the search of Eq. (1) begins
  long told_ = 0;
  Team team_;
};

}  // namespace bielle
