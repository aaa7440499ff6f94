#pragma once
/// \file First-order closing, and inverse dynamics of a closed mechanism whose motion is given by some of its
/// coordinates; and the derivatives of both with respect to the mechanism (variation.h).
///
/// **Closing.** Some dofs are held (row selector P), closures with Jacobian J must stay closed. With H = [J; P] and
/// H^+ its pseudo-inverse,
///     v = H^+ (0, v_P),    a = H^+ (-gamma, a_P),    T = H^+ (0, 1)                                                (1)
/// are velocities, accelerations and tangent for a given motion of the held dofs. With r_s, nu_s, a_s the changes of
/// residuals, velocities and accelerations at fixed q, v, a, by Eqs. (7) and (8) of variation.h,
///     dq = H^+ (r_s, 0),    dv = -H^+ (nu_s(dq), 0),    da = -H^+ (a_s(dq, dv), 0)                                 (2)
/// is how everything else moves when the mechanism changes (the residual moves with -J: notation.h). If the held dofs
/// do not determine the others, this is the least motion. A change that no motion can compensate, such as a longer rod
/// when everything else is held, leaves a gap in (2).
///
/// **Inverse problem.** The kept dofs determine the loops; their motion and contact forces lambda* are given. Motors
/// and contacts must balance
///     T^T (M a + b) = T^T B u + T^T J_f^T lambda_f = A u + F lambda_f                                              (3)
/// with the contact forces nearest to lambda* (in double support they are not determined). With multipliers mu,
///     [0 0 A^T; 0 -1 F^T; A F 0] (u, lambda_f, mu) = (0, -lambda*, T^T (M a + b))                                  (4)
/// m = T mu is a velocity that keeps loops closed and motors still. Eq. (4) reads J_l m = 0, B^T m = 0,
/// lambda_f - lambda* = J_f m. With e = d(J m) at fixed m (velocity changes, Eq. (7) of variation.h at v = m),
/// n = -H^+ (e_l, 0) and dID = d(M a + b - J^T lambda) at fixed forces, its derivative is the same matrix times
///     (du, dlambda_f, dmu) = (-B^T n, -(e_f + J_f n), T^T dID).                                                    (5)
/// Forces of the loops: J_l^T lambda_l = M a + b - B u - J_f^T lambda_f, redundant ones with least norm.
#include <Eigen/QR>
#include <optional>

#include "bielle/dynamics/variation.h"

namespace bielle {

/// H of Eq. (1) at a configuration.
class Closing {
 public:
  /// \param closures  those that must stay closed, feet included if they are among them   \param held  dofs
  /// Needs updatePositions, at a closed configuration.
  Closing(const Model& model, const Workspace& ws, const ConstraintSet& closures, std::vector<int> held);

  /// H^+ (rows, values).
  VectorXd solve(ConstVectorRef rows, ConstVectorRef values) const;
  /// (lambda, tau) of least norm with J^T lambda + P^T tau = force.
  VectorXd solveTransposed(ConstVectorRef force) const;
  MatrixXd calcTangent() const;  ///< T (nv x held)
  /// Whether nothing can move while the held dofs stand still.
  bool isDetermined() const { return decomposition_.rank() == H_.cols(); }

  /// Eq. (2); needs updateAccelerations. Returns the gap: the largest change of residuals (m, rad) that remains, per
  /// unit of the change.
  double calcMotion(const Model& model, const Workspace& ws, const ModelVariation& change,
                    MotionVariation& motion) const;

 private:
  ConstraintSet closures_;
  Eigen::Index rows_ = 0;
  MatrixXd H_;
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition_;
};

/// The inverse problem at one configuration.
class KeptMotion {
 public:
  /// \param kept  dofs, as many as the loops leave free
  KeptMotion(const Model& model, std::vector<int> kept);

  /// \param q  nq, closed   \param v_kept, a_kept  of the kept dofs
  /// \param constraints  the loops of the model, then contacts   \param forces  lambda*, on the rows of the contacts
  /// \return NearDeadPoint: the kept dofs do not determine the loops; Unbalanced: motors and contacts cannot produce
  /// this motion, or motors are not independent
  NumericalStatus update(const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v_kept,
                         ConstVectorRef a_kept, ConstVectorRef forces);
  const VectorXd& v() const { return v_; }            ///< nv
  const VectorXd& a() const { return ws_.a; }         ///< nv
  const VectorXd& u() const { return u_; }            ///< nu
  const VectorXd& lambda() const { return lambda_; }  ///< rows of the constraints

  /// Changes with the model at fixed motion of the kept dofs and fixed lambda*.
  struct Variation {
    explicit Variation(const Model& model) : motion(model) {}
    MotionVariation motion;
    VectorXd u, lambda;
  };
  const MatrixXd& tangent() const { return T_; }  ///< T (nv x kept)
  /// Needs an update() that was Ok. Contradictory (the change opens loops with redundant rows) or Unbalanced if the
  /// changed mechanism could not perform the motion.
  NumericalStatus calcVariation(const ModelVariation& change, Variation& out);
  /// Change (nv) of T w for speeds w of the kept dofs, dq being that of the motion: Eq. (2) at v = T w.
  VectorXd calcTangentVariation(const ModelVariation& change, const MotionVariation& motion, ConstVectorRef w);

 private:
  VectorXd selectMotors(const VectorXd& x) const;
  bool solveBalance(const VectorXd& rhs, VectorXd& solution) const;

  Model model_;
  std::vector<int> kept_;
  ConstraintSet constraints_, loops_;
  VectorXd calcLift(const ModelVariation& change, const VectorXd& dq, const VectorXd& v, VectorXd& rows);

  Workspace ws_, virtual_ws_;  // virtual_ws_: at the same configuration with other velocities
  std::optional<Closing> closing_;
  MatrixXd T_, J_contacts_, balance_;
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition_;
  VectorXd v_, u_, lambda_, m_;
};

}  // namespace bielle
