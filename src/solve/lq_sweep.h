#pragma once
/// \file The linear-quadratic (Riccati) sweep over a shooting problem's quadratic models. It knows no robot.
///
/// With the models of StageModel, to whose cost weights of constraints add gradient . dc + 1/2 dc . diag(hessian) . dc,
/// dc = Cx dx + Cu du, and regularizations mu_x, mu_u >= 0, find the step (dx, du), dx_0 = 0, that minimizes
///     sum_k [ lx.dx + lu.du + 1/2 dx.(lxx + mu_x I).dx + du.lux.dx + 1/2 du.(luu + mu_u I).du ]_k
///           + [ lx.dx + 1/2 dx.(lxx + mu_x I).dx ]_N      s.t.  dx_{k+1} = Fx dx_k + Fu du_k + gap_k.            (1)
/// The cost to go from node k is V_k(dx) = v_k + Vx.dx + 1/2 dx.Vxx.dx, with V_N = the terminal term. Backwards, with
/// V' = V_{k+1} and the value gradient carried over the gap (Mastalli et al., "Crocoddyl", ICRA 2020, eq. 12):
///     p   = Vx' + Vxx' gap                                                                                      (2)
///     Qx  = lx + Fx^T p                         Qu  = lu + Fu^T p                                               (3)
///     Qxx = lxx + mu_x I + Fx^T Vxx' Fx         Qux = lux + Fu^T Vxx' Fx      Quu = luu + mu_u I + Fu^T Vxx' Fu (4)
/// The control du = k + K dx that minimizes the stage's quadratic, and the resulting value, with Quu = L L^T:
///     k = -Quu^{-1} Qu                          K = -Quu^{-1} Qux = -L^{-T} Y,   Y = L^{-1} Qux                 (5)
///     Vx = Qx + Qux^T k                         Vxx = Qxx - Y^T Y                                               (6)
///     v_k = v_{k+1} + Qu.k + 1/2 k.Quu.k + Vx'.gap + 1/2 gap.Vxx'.gap                                           (7)
/// so that v_0, the *expected change*, is the optimal value of (1).
///
/// With boxes, lower <= du <= upper at dx = 0, k solves the box QP of Quu and Qu instead, and the rows of K of its
/// clamped components are zero: (5) for K and (6) then hold with L and Y of the free components (see box_qp.h).
///
/// The step of length alpha takes alpha k and alpha gap in place of k and gap: (dx, du) scale with alpha, and the
/// models predict the change of cost
///     alpha slope + 1/2 alpha^2 curvature,     slope = sum_k lx.dx + lu.du,     slope + 1/2 curvature = v_0.       (8)
/// Without gaps and boxes curvature = -slope.
#include <vector>

#include "bielle/solve/fddp.h"
#include "bielle/solve/shooting_problem.h"
#include "solve/box_qp.h"

namespace bielle {

struct LqRegularization {
  double control = 0;  ///< mu_u, added to the diagonal of every Quu
  double state = 0;    ///< mu_x, added to the diagonal of every Vxx
};

/// What is added to the cost of a node for its constraints, to second order about c without second derivatives of c.
struct ConstraintWeights {
  VectorXd gradient, hessian;  ///< constraintSize, or none; both are zero in rows that do not matter at present
};

/// Bounds of du at one stage (nu each), infinite if there are none; lower <= 0 <= upper.
struct ControlBox {
  VectorXd lower, upper;
};

struct LqResult {
  NumericalStatus status = NumericalStatus::Ok;  ///< Indefinite: Quu of `node`; NotFinite: the models from `node` on
  int node = -1;                                 ///< where the sweep stopped, -1 if it succeeded
  double expected_change = 0;                    ///< v_0, Eq. (7)
};

/// Owns all data that a sweep writes. Sized by the first update(); later ones of the same sizes allocate nothing.
class LqSweep {
 public:
  /// Results of the sweep at node k: k and K of Eq. (5), and the value function; at the terminal node Vx and Vxx only.
  struct Node : Gains {
    VectorXd Vx;        ///< ndx_k
    MatrixXd Vxx;       ///< ndx_k x ndx_k, symmetric, both triangles
    VectorXd Qu;        ///< nu_k
    VectorXd gradient;  ///< of the cost, with weights: (lu, lx)
  };

  /// Solves (1) for N + 1 models, the last one terminal. boxes: N of them, or none; weights: N + 1, or none.
  LqResult update(const std::vector<StageModel>& models, const LqRegularization& regularization,
                  const std::vector<ControlBox>& boxes = {}, const std::vector<ConstraintWeights>& weights = {});

  /// The same node by node, for models that become available one by one: start(), then updateNode(k) for
  /// k = N .. 0 as long as the status is Ok. start() reads only the sizes of the models.
  void start(const std::vector<StageModel>& models, const LqRegularization& regularization);
  NumericalStatus updateNode(int k, const StageModel& model, const ControlBox* box = nullptr,
                             const ConstraintWeights* weights = nullptr);
  /// Result of the nodes updated so far.
  const LqResult& result() const { return result_; }

  const std::vector<Node>& nodes() const { return nodes_; }

  /// The solution of (1) of the last update() on the same models: dx_k (N + 1) and du_k (N), resized if necessary.
  /// Returns slope of Eq. (8).
  double calcStep(const std::vector<StageModel>& models, std::vector<VectorXd>& dx, std::vector<VectorXd>& du) const;

 private:
  void resize(const std::vector<StageModel>& models);
  MatrixMap copyHessian(const StageModel& model);
  void addConstraints(const StageModel& model, const ConstraintWeights& weights, MatrixMap Q, VectorXd& gradient);
  // Q: the Hessian, which becomes [Quu . ; Qxu Qxx]; then its first columns become L over Y^T.
  NumericalStatus updateStage(const StageModel& model, const Node& next, const ControlBox* box, MatrixMap Q,
                              Node& node);
  void updateQuadratic(const StageModel& model, const Node& next, MatrixMap Q, Node& node);
  NumericalStatus eliminateControls(MatrixMap Q, Node& node);
  NumericalStatus eliminateBoxedControls(const ControlBox& box, MatrixMap Q, Node& node);
  void updateGains(int num_free, MatrixMap Q, Node& node);

  std::vector<Node> nodes_;
  LqRegularization regularization_;
  LqResult result_;
  BoxQp box_qp_;
  // Buffers of one node, sized for the largest; columns of matrices are padded like those of a StageModel. With
  // F = [Fu Fx]: [Qu Qx], F^T Vxx', Q, C^T of rows that have a Hessian, also times that, and K^T.
  VectorXd p_, Vxx_gap_, gradient_, Ft_Vxx_, hessian_, Ct_, Ct_scaled_, Kt_;
};

}  // namespace bielle
