#pragma once
// The quadratic model of one node from its view, which the kernel has filled: F^T, and residuals by the chain rule.
#include "dynamics/linkage_workspace.h"
#include "math/lane_product.h"
#include "ocp/reduced/reduced_kernel.h"

namespace bielle {

class NodeAssembly {
 public:
  NodeAssembly(const Model& model, const Reduction& reduction, const ReducedLayout& layout, const NodeSizes& sizes);

  // Sets Fx, Fu and gap of a step, and the derivatives of its contact forces for setResiduals(). Overwrites the
  // accelerations of the view.
  void setStep(const StageSpec& spec, const ContactLayout& contacts, const ReducedEvaluation& at,
               const ReducedEvaluation& next, LaneView& view, StageModel& out);
  // Sets the derivatives of the speeds of the motors of a midpoint step, after setStep() for the same node.
  void setSpeeds(const ReducedEvaluation& at, const LaneView& view);
  // Sets the derivatives of the impulses of an impact with respect to q and v (rows x nv).
  void setImpulseDerivatives(ConstMatrixRef by_q, ConstMatrixRef by_v, const ReducedEvaluation& at,
                             const LaneView& view);
  // Sets the Gauss-Newton terms of the residuals, overwriting `out`, and the constraints that are wanted.
  void setResiduals(const NodeCosts& costs, const StageSpec& spec, const ContactLayout& contacts,
                    const std::vector<char>* wanted, const ReducedEvaluation& at, const LaneView& view,
                    StageModel& out);
  // The part of the gradient of the last setResiduals() that is not due to squares, by (u, s, dy, dy_v); zero where s is not
  // free.
  const VectorXd& gradientOfNoSquares() const { return no_squares_; }
  // Memory of residuals.
  LinkageWorkspaces& linkages() { return linkages_; }

  // Gap and derivatives of a joint outside all clusters: those of q+ with respect to dy and dv+, which are the identity
  // and h except for curved joints.
  struct FreeJoint {
    const Joint* joint;
    int offset, size;
    bool curved;
    JointMatrix q_y, q_v;              // of a curved one
    JointMatrix first_q_y, first_q_v;  // the same for the first drift of a midpoint step
  };
  std::vector<FreeJoint>& freeJoints() { return free_joints_; }
  // \param gap  2 size, the robot's part
  void calcFreeGaps(const ReducedEvaluation& at, const ReducedEvaluation& next, VectorRef gap) const;

  // out += (A X)^T with A for the whole model (k x nv) and X = N (joints outside all clusters: the identity) or Z
  // (zero).
  void addTimesN(ConstMatrixRef A, const ReducedEvaluation& at, MatrixRef out) const;
  void addTimesZ(ConstMatrixRef A, const LaneView& view, MatrixRef out) const;

 private:
  void addContactDerivatives(int leading, const ContactLayout& contacts,
                             const std::vector<LaneView::Contact>& derivatives, PaddedMap dlambda) const;
  void addMotorRows(const ReducedEvaluation& at, PaddedMap dydd) const;
  void addForeseenVelocity(double h, const ContactLayout& contacts, const ReducedEvaluation& at, LaneView& view);
  void updateFirstDrift(double h, const ReducedEvaluation& at);
  void addFirstDrift(double h, const ReducedEvaluation& at, const LaneView& view, PaddedMap rows);
  void addVelocity(bool midpoint, const ReducedEvaluation& at, const LaneView& view, PaddedMap dw) const;
  void updateFreeJoint(double h, const ReducedEvaluation& at, ConstVectorRef gap, FreeJoint& free) const;
  void setTransition(double h, bool midpoint, const ReducedEvaluation& at, const LaneView& view, PaddedMap dv,
                     MatrixMap Ft) const;
  void updateResidualDerivatives(const NodeCosts& costs, const ContactLayout& contacts, const ReducedEvaluation& at,
                                 const LaneView& view, PaddedMap Rt);

  // node_scale.cpp: derivatives by a free time scale, reduced_kernel.h Eq. (i)
  bool isFree(const ReducedEvaluation& at) const { return at.leading > model_.nu(); }
  void addForeseenScale(const ReducedEvaluation& at, PaddedMap foreseen);
  void addKickScale(const StageSpec& spec, const ReducedEvaluation& at, PaddedMap dv);
  void subtractVelocity(const ReducedEvaluation& at, const ReducedEvaluation& next, MatrixMap Ft);
  void updateFirstDriftScale(double h, const ReducedEvaluation& at, const LaneView& view);
  template <typename GetWN>
  void project(const VectorXd& v, const GetWN& get_WN, VectorRef out) const;

  Model model_;
  const Reduction& reduction_;
  const ReducedLayout& layout_;
  std::vector<FreeJoint> free_joints_;
  struct Motor {
    int cluster, row;  // cluster and row of its N; or -1 and reduced coordinate
  };
  std::vector<Motor> motors_;
  LinkageWorkspaces linkages_;
  ResidualJacobians jacobians_;
  CountedRows counted_;
  VectorXd Rt_, Rt_scaled_, gradient_;  // large enough for any node
  VectorXd dlambda_;        // (nu + 2 size) x contact rows, padded: derivatives of contact forces by (u, dy, dy_v)
  VectorXd dspeeds_;        // (nu + 1 + 2 size) x nu, padded: those of the speeds of the motors
  VectorXd room_;           // of solveDerivatives()
  VectorXd by_velocity_;    // of addForeseenVelocity(): rows by dy_v
  VectorXd column_;         // of addFirstDrift(): 2 r of the largest cluster
  VectorXd turn_, turned_;  // likewise: derivatives of a joint outside all clusters, and its rows, padded
  VectorXd y_;              // of node_scale.cpp: size
  VectorXd y_s_, y_v_s_;    // likewise: how the point half way moves with s
  VectorXd velocity_;       // likewise: nv
  VectorXd no_squares_;     // nu + 1 + 2 size
};

}  // namespace bielle
