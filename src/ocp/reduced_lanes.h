#pragma once
// Up to kLane steps and their derivatives at once, one node per lane (lanes.h): what reduced_node.h needs of the mechanism for
// its Eqs. (b) to (g). Nodes may have different contacts and time steps. What is left to each of them is the system of its
// contacts and its costs.
#include "bielle/dynamics/reduced_tree.h"

namespace bielle {

class NodeModel;
class ReducedNode;

// One block of loops at the nodes of all lanes.
struct BlockLanes {
  explicit BlockLanes(const LoopBlock& l);
  const LoopBlock& loop;
  BlockBasisOf<Lanes> at, next;                        // at the states, at q+
  WorkspaceOf<Lanes> own;                              // of the block's model at q+
  BlockMotionOf<Lanes> motion, ahead;                  // at the states, in the whole model; at q+, in the block
  VectorX<Lanes> left, step, zeta, independent, rows;  // n, n, rank, rank, m
  MatrixX<Lanes> HN, HnNn, JqN, P, Pn;                 // n x r, as in reduced_node.h
  MatrixX<Lanes> E, En, S, mixed, mixed_next;          // r x r: those of Eqs. (f) and (g), P^T N', P'^T N'
  // Of a step
  BlockScratchOf<Lanes> scratch;
  BlockStateOf<Lanes> closing;                                    // at q+
  VectorX<Lanes> drift, a_d, predicted, surplus, target, v_next;  // rank, n, rank, rank, r, n
};

// A contact that some node may have, always at the same body.
struct ContactLanes {
  int tip = 0;                 // index among the tips
  bool used = false;           // by some lane
  SE3Of<Lanes> X_WF;           // of the contact's frame
  Vector6<Lanes> wrench;       // on the body, world
  Lanes kd;                    // gain
  Matrix6<Lanes> kp_rate;      // kp times the residual's rate by the frame's twist
  Matrix6X<Lanes> dy, dv;      // 6 x outer coordinates of the tip: Eq. (c) for all six rows
  Vector6<Lanes> kp_residual;  // kp times the residual
  Matrix6X<Lanes> J;           // 6 x outer coordinates, all rows of J_c N
  Vector6<Lanes> gamma;        // all rows of gamma_c + J_c a_d
};

class ReducedLanes {
 public:
  // \param slots  tips of all contacts that one node may have, a tip with two contacts twice
  ReducedLanes(const Model& model, const Reduction& reduction, const std::vector<int>& tips,
               const std::vector<int>& slots);

  // Steps of at most kLane reduced nodes whose points and motor forces are there: up to the systems of the contacts, Eq. (b);
  // what these are for each node (f, and gamma at its contact rows); their solution back; and the rest. Tells which steps
  // went through.
  void startSteps(NodeModel* const* nodes, int count);
  void loadSystem(int lane, MatrixXd& M, MatrixXd& JcN, VectorXd& f, VectorXd& gamma) const;
  void storeAccelerations(int lane, const VectorXd& ydd);
  LaneMask finishSteps();

  // Derivatives about the last step of each of at most kLane reduced nodes.
  void linearize(NodeModel* const* nodes, int count);

  // Lane of a node of the last call, -1 for others.
  int findLane(const ReducedNode* node) const;

  const WorkspaceOf<Lanes>& workspace() const { return ws_; }
  const std::vector<BlockLanes>& blocks() const { return blocks_; }
  const std::vector<ContactLanes>& contacts() const { return contacts_; }
  const std::vector<int>& getOuter(const ContactLanes& contact) const { return tree_.getTip(contact.tip).outer; }
  const VectorX<Lanes>& accelerations() const { return a_; }
  const MatrixX<Lanes>& A_y() const { return A_y_; }
  const MatrixX<Lanes>& A_v() const { return A_v_; }

 private:
  template <typename Get>
  void pack(const Get& get, Eigen::Index size, Lanes* out) const;
  void setNodes(NodeModel* const* nodes, int count);
  void packNodes();
  template <typename GetBasis>
  void packBasis(const GetBasis& getBasis, BlockBasisOf<Lanes>& to) const;
  void packBlockStep(size_t i);
  void packBlock(size_t i);
  void updateContactRows(ContactLanes& contact);
  LaneMask close(BlockLanes& b);
  void packContact(size_t slot);
  void updateForces();
  void updateContact(ContactLanes& contact);
  void linearizeStep(BlockLanes& b);

  const Model& model_;
  const Reduction& reduction_;
  const std::vector<int>& tips_;
  std::vector<const ReducedNode*> nodes_;
  WorkspaceOf<Lanes> ws_;
  std::vector<BlockLanes> blocks_;
  std::vector<BlockLiftOf<Lanes>> lifts_;
  std::vector<ContactLanes> contacts_;
  struct FreeDofs {
    int dof, offset, size;  // of a joint outside all loops: velocity coordinates, reduced coordinates
  };
  std::vector<FreeDofs> free_;
  ReducedTreeOf<Lanes> tree_;
  std::vector<Vector6<Lanes>> f_ext_;  // nb
  VectorX<Lanes> v_, a_, tau_;         // nv
  Lanes h_;
  MatrixX<Lanes> A_y_, A_v_;  // size x size, reduced_tree.h Eqs. (2) and (3)
  MatrixX<Lanes> M_;          // size x size
  VectorX<Lanes> f_, ydd_;    // size
};

}  // namespace bielle
