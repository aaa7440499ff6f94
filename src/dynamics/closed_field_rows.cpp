// The set-up of a field: which rows are independent, and where everything is.
#include <algorithm>
#include <map>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/closed_field.h"

namespace bielle {
namespace {

constexpr double kRankTolerance = 1e-6;  // as in calcMobility()

bool isFlat(const Joint& joint) { return joint.nv <= 1 || joint.kind == JointKind::Universal; }

// Dofs of one tree over the world share a block.
std::vector<std::pair<int, int>> makePlaces(const Model& model, std::vector<std::vector<int>>& dofs) {
  std::vector<std::pair<int, int>> places(model.nv());
  for (int k = 0; k < model.nv(); ++k) {
    const int parent = model.dofs()[k].parent;
    if (parent < 0) {
      places[k] = {static_cast<int>(dofs.size()), 0};
      dofs.push_back({k});
    } else {
      const int block = places[parent].first;
      places[k] = {block, static_cast<int>(dofs[block].size())};
      dofs[block].push_back(k);
    }
  }
  return places;
}

// Independent columns, the most independent first.
std::vector<int> chooseColumns(const MatrixXd& columns) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(columns.rows(), columns.cols());
  qr.setThreshold(kRankTolerance);
  qr.compute(columns);
  std::vector<int> chosen;
  for (Eigen::Index i = 0; i < qr.rank(); ++i) chosen.push_back(qr.colsPermutation().indices()[i]);
  return chosen;
}

}  // namespace

ClosedField::ClosedField(const Model& model) : model_(model), set_(makeConstraintSet(model)), ws_(model) {
  std::vector<std::vector<int>> dofs;
  places_ = makePlaces(model, dofs);
  blocks_.resize(dofs.size());
  for (size_t b = 0; b < dofs.size(); ++b) {
    const auto n = static_cast<Eigen::Index>(dofs[b].size());
    blocks_[b].dofs = std::move(dofs[b]);
    blocks_[b].M.setZero(n, n);
    blocks_[b].factor.compute(MatrixXd::Identity(n, n));  // sizes it
    blocks_[b].x.setZero(n);
  }
  newtons_.resize(model.clusters().size());
  for (size_t c = 0; c < newtons_.size(); ++c)
    for (int closure : model.clusters()[c].closures) {
      newtons_[c].loops.push_back(static_cast<int>(loops_.size()));
      Loop loop;
      loop.cluster = static_cast<int>(c);
      loop.index = closure;
      loop.dofs = model.closures()[closure].dofs;
      loops_.push_back(std::move(loop));
    }
  for (size_t j = 1; j < model.joints().size(); ++j)
    if (!isFlat(model.joints()[j])) grouped_.push_back(static_cast<int>(j));
  scratch_.setZero(6, std::max(6, model.nv()));
  q_start_ = q_ = model.makeNeutral();
  for (VectorXd* x : {&delta_, &v_, &a_, &x_}) x->setZero(model.nv());
}

int ClosedField::select(ConstVectorRef q) {
  updatePositions(model_, ws_, q);
  for (const Newton& newton : newtons_) chooseRows(newton);
  rows_ = 0;
  for (Block& block : blocks_) block.rows.clear();
  for (Newton& newton : newtons_) {
    newton.offset = rows_;
    for (int l : newton.loops) placeRows(loops_[l]);
    newton.rows = rows_ - newton.offset;
    layOut(newton);
  }
  layOutSystem();
  return rows_;
}

// First among the rows of each closure, since those that are redundant there would only burden what follows, then among all of
// the cluster, unless they are too many: rows of many closures are taken to be independent.
void ClosedField::chooseRows(const Newton& newton) {
  const LoopCluster& cluster = model_.clusters()[loops_[newton.loops.front()].cluster];
  std::map<int, int> position;
  for (size_t k = 0; k < cluster.dofs.size(); ++k) position[cluster.dofs[k]] = static_cast<int>(k);
  std::vector<std::pair<int, int>> rows;  // loop and row of its closure
  std::vector<VectorXd> values;
  for (int l : newton.loops) {
    Loop& loop = loops_[l];
    loop.chosen.clear();
    const Closure& closure = model_.closures()[loop.index];
    const int count = getRows(closure.kind);
    auto J = scratch_.topLeftCorner(count, model_.nv());
    calcClosureJacobian<double>(ws_, closure, J);
    MatrixXd own(loop.dofs.size(), count);
    for (size_t k = 0; k < loop.dofs.size(); ++k) own.row(static_cast<int>(k)) = J.col(loop.dofs[k]).transpose();
    for (int row : chooseColumns(own)) {
      rows.emplace_back(l, row);
      values.push_back(own.col(row));
    }
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (count > kDenseRows) {
    for (const auto& [l, row] : rows) loops_[l].chosen.push_back(row);
    return;
  }
  MatrixXd all = MatrixXd::Zero(static_cast<Eigen::Index>(cluster.dofs.size()), count);
  for (Eigen::Index r = 0; r < count; ++r) {
    const Loop& loop = loops_[rows[r].first];
    for (size_t k = 0; k < loop.dofs.size(); ++k) all(position[loop.dofs[k]], r) = values[r][static_cast<int>(k)];
  }
  for (int r : chooseColumns(all)) loops_[rows[r].first].chosen.push_back(rows[r].second);
}

// Gives the chosen rows of a loop their places among all rows and in the blocks that they move.
void ClosedField::placeRows(Loop& loop) {
  std::sort(loop.chosen.begin(), loop.chosen.end());
  loop.offset = rows_;
  rows_ += static_cast<int>(loop.chosen.size());
  loop.J.setZero(loop.chosen.size(), loop.dofs.size());
  loop.J_start = loop.J;
  loop.blocks.clear();
  loop.places.clear();
  for (int dof : loop.dofs) {
    const auto [b, row] = places_[dof];
    size_t i = 0;
    while (i < loop.blocks.size() && loop.blocks[i].first != b) ++i;
    if (i == loop.blocks.size()) {
      loop.blocks.emplace_back(b, static_cast<int>(blocks_[b].rows.size()));
      for (size_t r = 0; r < loop.chosen.size(); ++r) blocks_[b].rows.push_back(loop.offset + static_cast<int>(r));
    }
    loop.places.emplace_back(static_cast<int>(i), row);
  }
}

void ClosedField::layOut(Newton& newton) {
  newton.x.setZero(newton.rows);
  newton.pairs.clear();
  std::map<int, std::vector<std::pair<int, int>>> by_dof;  // loops and their columns
  for (int l : newton.loops)
    for (size_t k = 0; k < loops_[l].dofs.size(); ++k) by_dof[loops_[l].dofs[k]].emplace_back(l, static_cast<int>(k));
  std::map<std::pair<int, int>, Pair> pairs;
  for (const auto& [dof, users] : by_dof)
    for (const auto& [a, k] : users)
      for (const auto& [b, j] : users) {
        Pair& pair = pairs[{a, b}];
        pair.a = a, pair.b = b;
        pair.columns.emplace_back(k, j);
      }
  for (auto& [key, pair] : pairs) newton.pairs.push_back(std::move(pair));
  newton.sparse.reset();
  newton.sparse_factor.reset();
  if (newton.rows <= kDenseRows) {
    newton.K.setZero(newton.rows, newton.rows);
    if (newton.rows > 0) newton.factor.compute(MatrixXd::Identity(newton.rows, newton.rows));
    return;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (const Pair& pair : newton.pairs)
    for (size_t i = 0; i < loops_[pair.a].chosen.size(); ++i)
      for (size_t j = 0; j < loops_[pair.b].chosen.size(); ++j)
        entries.emplace_back(loops_[pair.a].offset - newton.offset + static_cast<int>(i),
                             loops_[pair.b].offset - newton.offset + static_cast<int>(j), 1.0);
  newton.sparse = std::make_unique<Eigen::SparseMatrix<double>>(newton.rows, newton.rows);
  newton.sparse->setFromTriplets(entries.begin(), entries.end());
  newton.sparse_factor = std::make_unique<Eigen::SparseLU<Eigen::SparseMatrix<double>>>();
  newton.sparse_factor->analyzePattern(*newton.sparse);
}

// S and its blocks.
void ClosedField::layOutSystem() {
  for (Block& block : blocks_) {
    const auto n = static_cast<Eigen::Index>(block.dofs.size()), r = static_cast<Eigen::Index>(block.rows.size());
    for (MatrixXd* x : {&block.Jt, &block.W}) x->setZero(n, r);
    block.gram.setZero(r, r);
    block.y.setZero(r);
  }
  for (VectorXd* x : {&zeta_, &residual_, &gamma_, &lambda_, &r_}) x->setZero(rows_);
  S_sparse_.reset();
  S_sparse_factor_.reset();
  if (rows_ <= kDenseRows) {
    S_.setZero(rows_, rows_);
    if (rows_ > 0) S_factor_.compute(MatrixXd::Identity(rows_, rows_));
    return;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (const Block& block : blocks_)
    for (int i : block.rows)
      for (int j : block.rows)
        if (i >= j) entries.emplace_back(i, j, 1.0);
  S_sparse_ = std::make_unique<Eigen::SparseMatrix<double>>(rows_, rows_);
  S_sparse_->setFromTriplets(entries.begin(), entries.end());
  S_sparse_factor_ = std::make_unique<Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>>();
  S_sparse_factor_->analyzePattern(*S_sparse_);
}

}  // namespace bielle
