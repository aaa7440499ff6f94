#pragma once
/// \file A robot beside measured torques: what is left of their balance, linear in its inertias, armatures and friction.
///
/// At a closed state (q, v, a) with the basis N of all closed motions (reduction.h; a joint outside all loops has its own), closure
/// forces do no work, and
///     e = N^T (M a + b - S^T u) = 0                                                                                  (1)
/// is linear in the spatial inertias Y_i (Khalil and Dombre, Modeling, Identification and Control of Robots, 2002, ch. 12): with the ten
/// matrices E_p that make them up, Y_i = sum_p pi_ip E_p, and in the frame of the body
///     de/dpi_ip = (J_i N)^T (E_p A_i + V_i x* E_p V_i),                                                              (2)
/// as well as in armatures, by N^T 1_m a_m, damping, by N^T 1_m v_m, and friction, by N^T 1_m s_m, s_m being the smooth sign of
/// v_m. Where a motor turns back, s_m jumps, and what smooths the torque must smooth s_m as well.
/// Of the ten numbers of a body, mass m and centre c change those of its link by
///     pi(m, c) = (m, m c, (m / m_0) I_0 + m (c^T c 1 - c c^T)).                                                       (3)
///
/// The rows of a reduced joint are over the noise in them: at first kTorqueNoise of the root mean square of N^T (M a + b), so that each
/// linkage and joint counts alike, whatever its size, then what is left of them. Rows are many and the numbers few: only the triangular
/// factor of the rows beside e is kept, from which |e|^2 and its derivatives follow for any numbers, exactly.
#include <vector>

#include "identify/loads.h"

namespace bielle {

inline constexpr double kTorqueNoise = 0.01;  ///< that is assumed, of the root mean square of torques
inline constexpr double kShareOfMass = 0.5;   ///< scale of masses: what is known no better is not seen
inline constexpr double kLeastLever = 0.01;   ///< m: least scale of centres of mass, beside radii of gyration

/// The smooth sign of a speed that friction at a motor's joint has (model.h).
double calcFrictionSign(const Model& model, const Motor& motor, double speed);

/// One instant of a log.
struct LoadedState {
  VectorXd q, v, a;  ///< nq, nv, nv; closed
  VectorXd u;        ///< nu, N m or N
  VectorXd signs;    ///< nu, calcFrictionSign() of the motors' speeds, smoothed as the torques are
  MatrixXd N;        ///< nv x reduced coordinates
};

/// Per reduced coordinate, 1 over the root mean square of N^T (M a + b - torques S^T u) in the rows of its group; 0 if there is none.
VectorXd calcRowWeights(const Model& model, const std::vector<LoadedState>& states, const std::vector<int>& groups,
                        double torques);

class TorqueFit {
 public:
  /// \param groups   number of reduced coordinates of each reduced joint, in their order in N
  /// \param weights  of the rows, as calcRowWeights(); empty: by kTorqueNoise
  TorqueFit(const Model& model, std::vector<LoadNumber> numbers, const std::vector<LoadedState>& states,
            const std::vector<int>& groups, VectorXd weights = {});

  const std::vector<LoadNumber>& numbers() const { return numbers_; }
  long numRows() const { return rows_; }  ///< of Eq. (1)
  /// Scales of the numbers: kShareOfMass of a mass, the radius of gyration of its body for a centre of mass; of armature, damping
  /// and friction as much as alone would take all of the motor's torque, in the root mean square.
  const VectorXd& scales() const { return scales_; }
  const VectorXd& weights() const { return weights_; }  ///< per reduced coordinate, 1 / (N m or N)

  /// e over the noise that is assumed, up to a rotation of all rows, for changes x of the numbers; and its derivative, if asked for.
  /// Numbers below zero are as good as others: what cannot be is for those who make a robot of them (changeLoads()).
  void evaluate(const VectorXd& x, VectorXd& r, MatrixXd* J) const;
  /// Root mean square of e as a share of that of torques, with the weights by kTorqueNoise.
  double calcShare(const VectorXd& r) const;

 private:
  void addRows(const MatrixXd& rows);
  void compress();
  void makeScales(const Model& model, const std::vector<LoadedState>& states);

  std::vector<LoadNumber> numbers_;
  std::vector<int> bodies_;        // that have numbers
  std::vector<Inertia> inertias_;  // theirs, as given
  std::vector<int>
      columns_;  // per number without bodies, its column of the factor; those of bodies come first, ten each
  VectorXd scales_, weights_;
  MatrixXd factor_;  // of which used_ rows are in use, x (columns, e)
  Eigen::Index used_ = 0;
  long rows_ = 0;
};

}  // namespace bielle
