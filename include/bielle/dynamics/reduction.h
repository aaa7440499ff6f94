#pragma once
/// \file Reduced coordinates: the manifold of closed configurations, loop cluster by loop cluster.
///
/// A cluster of loops touches few dofs (Bipetto's knee: 7, with 6 closure rows). Seen from the body that carries it, it
/// is a small mechanism of its own, here a `LoopBlock` with its own massless Model whose world is that body. At a
/// closed configuration, let J (rank x n) be independent rows of its closure Jacobian, chosen by pivoting, W the metric
/// of the block (diagonal, constant), and
///     J N = 0,   N^T W N = I,   J^+ = W^{-1} J^T (J W^{-1} J^T)^{-1}                                                  (1)
/// N (n x (n - rank)) is an orthonormal basis of the tangent space and (W N)^T reads its coordinates. Its choice is free at
/// every point: no chart is left, and a dead point of a linkage, where motor or joint coordinates break down, is nothing
/// special. Only a change of rank is.
///
/// Moving on the manifold from a point q_0: for a displacement d (n), close along the rows of the start,
///     q = q_0 (+) (d - W^{-1} J(q_0)^T zeta)    with zeta such that q is closed                                       (2)
/// so that (W N)(q_0)^T (q (-) q_0) = (W N)(q_0)^T d: (2) inverts the difference in reduced coordinates exactly.
///
/// W is the inertia that each dof moves at the configuration of the reduction: corrections go where they cost least, to
/// light rods rather than to legs, as constraint impulses do. It also settles what a metre is worth against a radian.
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "bielle/math/small_dense.h"

namespace bielle {

/// Dofs [begin, end) of a block that move each other's axes: those of one joint, or one of a universal joint.
struct DofGroup {
  int begin = 0, end = 0;
  int parent = -1;        ///< last dof of the group before it on the path to the root, -1: none
  int parent_group = -1;  ///< that group
};

/// One cluster of loops as a mechanism of its own.
struct LoopBlock {
  Model model;                        ///< joints and closures of the cluster, massless, over their common root
  ConstraintSet closures;             ///< of `model`, without stabilisation
  std::vector<int> cluster_closures;  ///< their indices in the whole model
  std::vector<Closure> placed;        ///< the same closures with the bodies of the whole model, dofs those of `model`
  int root = 0;                       ///< body of the whole model that carries the block
  std::vector<int> joints;            ///< joint indices in the whole model, in the order of `model`
  std::vector<int> dofs;              ///< velocity coordinates in the whole model (n)
  std::vector<int> own_dofs;          ///< 0, 1, .. n - 1
  std::vector<DofGroup> groups;       ///< parents first
  std::vector<int> body_dof;          ///< per body of `model`, the last dof on its path, -1 for the root
  VectorXd metric;                    ///< n, diagonal of W
  VectorXd inverse_metric;            ///< n, diagonal of W^{-1}
  VectorXd inverse_root;              ///< n, diagonal of W^{-1/2}
  int rank = 0;                       ///< of the closure Jacobian
  int offset = 0, size = 0;           ///< reduced coordinates [offset, offset + size), size = n - rank
};

/// A free joint or a block: what a coordinate of the reduced tree belongs to. Units come parents first.
struct ReducedUnit {
  int joint = -1, block = -1;  ///< one of them: joint of the whole model, or index into Reduction::blocks
  int offset = 0, size = 0;    ///< reduced coordinates
  int parent = -1;             ///< unit that carries it, -1: the world
  std::vector<int> path;       ///< dofs of the parent unit that move it: positions among the parent's dofs
  std::vector<int> outer;      ///< reduced coordinates of all units before it on the way to the root
};

/// How the velocity coordinates of a model split into blocks and free dofs.
struct Reduction {
  std::vector<LoopBlock> blocks;
  std::vector<int> free_joints;   ///< joints outside all loops
  std::vector<int> free_offsets;  ///< first reduced coordinate of each
  std::vector<ReducedUnit> units;
  std::vector<int> unit_of_body;  ///< per body of the whole model, -1 for the world
  int size = 0;                   ///< reduced coordinates: the mobility of the robot
};

/// \param q closed configuration at which ranks are taken
/// \throws ModelError when q is not closed (to 1e-8) or a loop leaves no mobility anywhere
Reduction makeReduction(const Model& model, ConstVectorRef q);

/// Parent, path and outer coordinates of something fixed to a body (no coordinates of its own).
ReducedUnit makeTip(const Model& model, const Reduction& reduction, int body);

/// Bases (1) at a closed configuration of a block.
struct BlockBasis {
  explicit BlockBasis(const LoopBlock& block);
  VectorXd q;             ///< nq of the block
  MatrixXd N;             ///< n x size
  MatrixXd WN;            ///< n x size
  MatrixXd J;             ///< rank x n, independent rows
  MatrixXd L;             ///< rank x rank, Cholesky factor of J W^{-1} J^T
  std::vector<int> rows;  ///< which closure rows J holds
};

/// (J W^{-1} J^T)^{-1} X in place (rank x k).
template <typename Matrix>
void solveGram(const BlockBasis& basis, Matrix&& X) {
  solveSmallCholesky(basis.L, X);
}
/// out = s J^+ X = s W^{-1} J^T (J W^{-1} J^T)^{-1} X for X (rank x k), which is overwritten; out n x k.
void applyPseudoInverse(const LoopBlock& block, const BlockBasis& basis, double s, MatrixRef X, MatrixRef out);

/// What updates and closings of a block need for a moment: one per thread.
struct BlockScratch {
  explicit BlockScratch(const LoopBlock& block);
  Workspace ws;  ///< of the block's model
  VectorXd residual, correction;
  MatrixXd J_all, J, JW;  // all rows; at the iterate of a closing; J W^{-1} where it starts
  MatrixXd newton;        // factors of the matrix of close()
  std::vector<int> pivots;
  MatrixXd reflected, reflectors;  // of J W^{-1/2}, rows padded; Householder vectors
  VectorXd beta, products, rest;   // their scales; scratch; squared norms of what is left of the rows
};

/// A closed configuration of a block with what was computed there. No allocation once made.
class BlockState {
 public:
  explicit BlockState(const LoopBlock& block);

  /// Kinematics, Jacobian and bases (1) at q (block's nq), which stay in the scratch too. False when the rank is not that
  /// of the block.
  bool update(const LoopBlock& block, BlockScratch& scratch, ConstVectorRef q);
  /// Closes from `start` as Eq. (2) and updates everything there. False when it does not close or the rank changes.
  /// \param zeta_guess  rank, where zeta is expected, or empty
  bool close(const LoopBlock& block, BlockScratch& scratch, const BlockBasis& start, ConstVectorRef d,
             const VectorXd& zeta_guess);
  /// Placements and columns of this point back into the scratch.
  void load(const LoopBlock& block, BlockScratch& scratch) const;

  const BlockBasis& basis() const { return basis_; }
  const std::vector<SE3>& placements() const { return placements_; }  ///< of the block's bodies, seen from its root
  const VectorXd& zeta() const { return zeta_; }                      ///< rank, of the last close()
  const VectorXd& step() const { return step_; }  ///< n, d - W^{-1} J(q_0)^T zeta of the last close()
  /// Why the last update() or close() returned false, naming a loop; with the scratch as they left it.
  std::string describeFailure(const LoopBlock& block, const BlockScratch& scratch) const;

 private:
  bool updateBases(const LoopBlock& block, BlockScratch& scratch);

  BlockBasis basis_;
  std::vector<SE3> placements_;
  VectorXd zeta_, step_;
  bool closed_ = false;  // the last close() got as far as the bases
};

/// A BlockState with a scratch of its own: simpler where there are few of them.
class BlockPoint {
 public:
  explicit BlockPoint(const LoopBlock& block) : scratch_(block), state_(block) {}
  bool update(const LoopBlock& block, ConstVectorRef q) { return state_.update(block, scratch_, q); }
  bool close(const LoopBlock& block, const BlockBasis& start, ConstVectorRef d, const VectorXd& zeta_guess) {
    return state_.close(block, scratch_, start, d, zeta_guess);
  }
  const BlockBasis& basis() const { return state_.basis(); }
  std::string describeFailure(const LoopBlock& block) const { return state_.describeFailure(block, scratch_); }
  Workspace& workspace() { return scratch_.ws; }  ///< positions are those of the last update() or close()
  void solveGram(MatrixRef X) const { bielle::solveGram(basis(), X); }
  /// Independent rows out of all rows (m x k -> rank x k).
  void selectIndependent(const MatrixXd& all, MatrixXd& out) const;

 private:
  BlockScratch scratch_;
  BlockState state_;
};

/// Forces on all rows (m) of forces on the independent ones.
void expandIndependent(const BlockBasis& basis, ConstVectorRef independent, VectorRef all);

/// Segments of a block in vectors of the whole model.
void gatherConfiguration(const Model& model, const LoopBlock& block, ConstVectorRef q, VectorRef q_block);
void scatterConfiguration(const Model& model, const LoopBlock& block, ConstVectorRef q_block, VectorRef q);
void gatherVelocity(const LoopBlock& block, ConstVectorRef v, VectorRef v_block);
void scatterVelocity(const LoopBlock& block, ConstVectorRef v_block, VectorRef v);

}  // namespace bielle
