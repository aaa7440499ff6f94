#pragma once
// The problem of a robot by direct collocation over all joints of its tree: closures are constraints of every node, and
// their forces variables. About the configurations qg_k of a guess the variables are
//     z = (u_0, f_0, zeta_0, d_1, v_1, u_1, f_1, zeta_1, .., d_N, v_N),    q_k = qg_k (+) d_k,    q_0, v_0 given,     (1)
// f_k the forces of closures and contacts and zeta_k multipliers of closures, and the rows of the dynamics are those of
// collocation_step.h: its Eqs. (2) to (5) for every step. Costs and path constraints are those of the problem, at (x_k,
// u_k, l_k), the speeds of the motors being those of v_m. Steps are thus not those of the problem: both are of second
// order, and so is the difference of their optima. What a step adds to the armature for stiff springs
// (StageSpec::armature) is left out, since this rule needs none.
//
// Redundant rows have neither equations nor forces. They are found by QR decompositions with pivoting: of J(q_0)^T for
// the closures, whose other rows must stay independent along the guess; of the rest that J leaves of J_c for the
// contacts of a step. Forces are over the weight of the robot, and so are the rows (3); the rows (4) are times h.
#include "collocation_step.h"
#include "nonlinear_program.h"
#include "ocp/node_costs.h"

namespace bielle {

class Collocation : public NonlinearProgram {
 public:
  // \throws InputError where closures that are independent in the first posture of the guess are not so in another
  Collocation(const RobotProblem& problem, ShootingTrajectory guess);

  void getRows(VectorRef out) const override;
  void getGradient(VectorRef out) const override;
  void getJacobian(VectorRef values) const override;
  void getHessian(VectorRef values) const override;
  double calcGap() const override;

  // Rows of closures that are left out, such as "row 2 of knee_left".
  std::vector<std::string> listDropped() const;

 private:
  struct Node {
    explicit Node(const NodeCosts& costs) : costs(costs) {}
    NodeCosts costs;
    StepLayout at;                                   // of the terminal node q_0 and v_0 alone
    int d = 0;                                       // where d_k is in z, or at the first node u_0
    std::vector<int> z;                              // by column of the step: where it is in z, or -1
    VectorXd scale;                                  // likewise: of the variable
    std::vector<int> contacts;                       // rows of the constraints, that are kept
    std::vector<int> rows;                           // of the step, that are kept
    VectorXd row_scale;                              // of these
    int first = 0;                                   // the first of them in the program
    std::vector<std::vector<int>> path_columns;      // by kept path constraint
    std::vector<int> cost_columns;                   // of the step
    std::vector<std::pair<int, int>> cost_entries;   // of these, the lower triangle
    std::vector<std::pair<int, int>> step_entries;   // kept row, column of the step
    VectorXd lambda, zeta;                           // all rows
    VectorXd values;                                 // of the kept rows
    VectorXd gradient;                               // by cost_columns
    VectorXd path_jacobian, step_jacobian, hessian;  // in the order of the entries
  };
  using Pattern = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;
  bool update() override;
  bool differentiate() override;

  // collocation_layout.cpp
  MatrixXd calcJacobian(const ConstraintSet& set, ConstVectorRef q);
  void selectClosures();
  std::vector<int> selectContacts(int k);
  void listNodes();
  void listColumns(int k);
  void listRows(int k);
  void listStructure();
  void listStep(int k);
  Pattern findPattern(int k, const Residual& residual);
  void listPaths(int k);
  void listCosts(int k);
  void listEntries();
  void setStart();
  void makeEvaluations();

  bool isLast(int k) const { return k + 1 == static_cast<int>(nodes_.size()); }
  RobotEvaluation& getEvaluation(int k) { return static_cast<RobotEvaluation&>(*evaluations_[k]); }
  NodeView makeView(int k);
  CollocationStep::Input makeInput(int k) const;
  VectorXd calcMidpoint(int k) const;
  void read(int k);
  void updateCosts(int k);
  void updateStep(int k);
  void calcResiduals(int k, MatrixXd& by_columns);
  void differentiateCosts(int k);
  void addNodeCosts(int k, VectorXd& gradient, MatrixXd& hessian);
  void updateCharts();
  void linearizeStep(int k);

  const Model& model_;
  double weight_;
  std::vector<int> loops_;  // rows of the closures that are kept
  std::vector<Node> nodes_;
  CollocationStep step_;
  std::vector<JointBlocks> charts_;  // of q_k by d_k
  // Memory
  Workspace ws_;
  CountedRows counted_;
  ResidualJacobians jacobians_;
  VectorXd difference_, step_values_;
  MatrixXd step_jacobian_;  // by the columns of the step, with charts
};

}  // namespace bielle
