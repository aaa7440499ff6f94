#pragma once
/// \file Forward dynamics under closures and contacts, and its derivatives (the paper's eqs. 4 to 6).
///
///     M a - J^T lambda = tau - b,     J a = -gamma                                                                 (1)
///
/// where gamma gathers the drift and the stabilisation of the closures: the system of saddle_point.h, redundant rows
/// included. Its derivatives take dID = d(M a + b - J^T lambda - tau)/dz and da_c = d(J a + gamma)/dz at fixed a and
/// lambda.
#include <memory>

#include "bielle/dynamics/closure.h"

namespace bielle {

class SaddlePoint;

/// The factorised system of Eq. (1) (src/dynamics/saddle_point.h). Copies are deep.
class SaddlePointMemory {
 public:
  SaddlePointMemory();
  ~SaddlePointMemory();
  SaddlePointMemory(const SaddlePointMemory& other);
  SaddlePointMemory(SaddlePointMemory&& other) noexcept;
  SaddlePointMemory& operator=(const SaddlePointMemory& other);
  SaddlePointMemory& operator=(SaddlePointMemory&& other) noexcept;
  SaddlePoint& operator*() { return *system_; }
  SaddlePoint* operator->() { return system_.get(); }
  const SaddlePoint* operator->() const { return system_.get(); }

 private:
  std::unique_ptr<SaddlePoint> system_;
};

/// Memory of one constrained solve; sized for a constraint set at first use and then reused without allocation.
struct ConstrainedWorkspace {
  MatrixXd J;           ///< rows x nv
  VectorXd gamma;       ///< rows
  VectorXd a;           ///< nv, accelerations
  VectorXd lambda;      ///< rows, closure and contact forces, each in its frame 1
  double residual = 0;  ///< largest |J a + gamma|: not small when redundant rows contradict each other

  MatrixXd da_dq, da_dv;            ///< nv x nv
  MatrixXd da_du;                   ///< nv x nu
  MatrixXd dlambda_dq, dlambda_dv;  ///< rows x nv
  MatrixXd dlambda_du;              ///< rows x nu

  // Intermediate
  SaddlePointMemory saddle_point;
  VectorXd force;               ///< nv
  VectorXd violation;           ///< rows, J a + gamma
  VectorXd stabilization;       ///< rows
  std::vector<Vector6d> f_ext;  ///< nb
};

/// Rows contradict each other when |J a + gamma| exceeds this share of |gamma| + |J| |a|, both the largest over all
/// rows. Redundant loops that drift open in the full formulation, by millimetres in tenths of a metre, stay below it.
constexpr double kContradiction = 0.05;

/// Accelerations and forces for generalized forces tau (nv) at (q, v). Fills `ws` up to the accelerations.
/// \return Singular, NotFinite, or Contradictory: no a satisfies (1), and `a` is the least-squares solution
NumericalStatus updateConstrainedDynamics(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                          const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef v,
                                          ConstVectorRef tau);

/// Derivatives at the solution held by the workspaces; to be called after updateConstrainedDynamics. Ok or NotFinite.
NumericalStatus updateConstrainedDerivatives(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                             const ConstraintSet& constraints);

/// Generalized forces of motor torques u (nu).
void calcMotorForces(const Model& model, ConstVectorRef u, VectorRef tau);
VectorXd calcMotorForces(const Model& model, ConstVectorRef u);

/// Rank of the closure Jacobian at q and the mobility nv - rank.
struct Mobility {
  int rows = 0, rank = 0, mobility = 0;
  VectorXd singular_values;
};
/// \param tolerance singular values below it times the largest count as zero. It equals kRankTolerance of reduction.h,
///   since both decide how a mechanism can move; assembly.h, which must still move along weak directions, uses less.
Mobility calcMobility(const Model& model, ConstVectorRef q, double tolerance = 1e-6);

}  // namespace bielle
