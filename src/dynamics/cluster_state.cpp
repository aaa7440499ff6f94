// Bases of clusters and closing of their loops: Eqs. (1) and (2) of reduction.h.
#include <array>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/closure_change.h"
#include "dynamics/idle_spins.h"
#include "dynamics/nearby_closing.h"
#include "math/small_dense.h"
#include "model/joint.h"

namespace bielle {
namespace {

constexpr double kClosedTolerance = 1e-13;    // target of closeCluster()
constexpr double kAcceptedTolerance = 1e-11;  // accepted when rounding stops progress
// Relative differences of lengths below this are ignored. In symmetric postures whole rows are equally long and
// entries vanish: if rounding chose between them, the basis would depend on how the point was computed.
constexpr double kTie = 1e-7;

// Rows that one step of a factorization processes: a register of one node, or enough registers of lanes to hide the
// latency of a sum.
template <typename T>
using RowsOf = Eigen::Array<T, std::is_same_v<T, double> ? kLane : 6, 1>;

}  // namespace

template <typename T>
ClusterBasisOf<T>::ClusterBasisOf(const ReducedCluster& cluster) {
  const int n = cluster.model.nv();
  q.setZero(cluster.model.nq());
  N.setZero(n, cluster.size);
  WN.setZero(n, cluster.size);
  J.setZero(cluster.rank, n);
  L.setZero(cluster.rank, cluster.rank);
  rows.resize(cluster.rank);
}

template <typename T>
ClusterScratchOf<T>::ClusterScratchOf(const ReducedCluster& cluster) : ws(cluster.model) {
  const int n = cluster.model.nv(), m = cluster.numRows(), rank = cluster.rank;
  residual.setZero(m);
  correction.setZero(rank);
  J_all.setZero(m, n);
  J.setZero(rank, n);
  JW.setZero(rank, n);
  for (MatrixX<T>* x : {&newton, &fresh}) x->setZero(rank, rank);
  pivots.resize(rank);
  fresh_pivots.resize(rank);
  const Eigen::Index chunk = RowsOf<T>::RowsAtCompileTime, padded = (m + chunk - 1) / chunk * chunk;
  reflected.setZero(padded, n);
  reflectors.setZero(n, rank);
  products.setZero(padded);
  beta.setZero(rank);
  rest.setZero(m);
}

template <typename T>
ClusterStateOf<T>::ClusterStateOf(const ReducedCluster& cluster)
    : basis(cluster), placements(cluster.model.numBodies()) {
  zeta.setZero(cluster.rank);
  step.setZero(cluster.model.nv());
}

template <typename T>
void applyPseudoInverse(const ReducedCluster& cluster, const ClusterBasisOf<T>& basis, double s,
                        typename ArgumentsOf<T>::Matrix X, typename ArgumentsOf<T>::Matrix out) {
  solveGram(basis, X);
  out.setZero();
  addSmallProductTransposed(basis.J, X, out, s);
  for (Eigen::Index c = 0; c < out.cols(); ++c)
    for (Eigen::Index k = 0; k < out.rows(); ++k) out(k, c) *= cluster.inverse_metric[k];
}

namespace {

// Of a closure of the cluster, or null.
template <typename T>
const ClosureChangeOf<T>* getChange(const ReducedCluster& cluster, const ClusterScratchOf<T>& scratch, size_t closure) {
  if (!scratch.changes || scratch.changes->empty()) return nullptr;
  return &(*scratch.changes)[static_cast<size_t>(cluster.closure_indices[closure])];
}

template <typename T>
void updateJacobian(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch) {
  const ConstraintSet& set = cluster.closures;
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian<T>(scratch.ws, set.closures[c], getChange(cluster, scratch, c),
                           scratch.J_all.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  if constexpr (std::is_same_v<T, double>)
    if (cluster.holds_spins) updateSpinRows(cluster, scratch.J_all);
}

// Returns the largest entry, or NaN.
template <typename T>
T updateResidual(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch) {
  using std::abs;
  const ConstraintSet& set = cluster.closures;
  T largest = 0, sum = 0;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const int row = set.offsets[c], rows = getRows(set.closures[c].kind);
    scratch.residual.segment(row, rows) =
        calcClosureResidual(scratch.ws, set.closures[c], getChange(cluster, scratch, c));
    for (int r = row; r < row + rows; ++r) {
      const T size = abs(scratch.residual[r]);
      largest = select(size > largest, size, largest);
      sum += size;
    }
  }
  return largest + 0 * sum;
}

// Calls take(k, A(row, k)) from a column on. Lanes mostly name the same row, which is found out once for all columns.
template <typename T, typename Take>
void visitRow(const MatrixX<T>& A, const typename LogicOf<T>::Index& row, Eigen::Index first, const Take& take) {
  if constexpr (!std::is_same_v<T, double>) {
    if (isUniform(row)) {
      const T* entry = &A(row[0], first);
      for (Eigen::Index k = first; k < A.cols(); ++k, entry += A.outerStride()) take(k, *entry);
      return;
    }
  }
  for (Eigen::Index k = first; k < A.cols(); ++k) take(k, getEntry(&A(0, k), row));
}

// Selects the given rows of a matrix.
template <typename T>
void selectRows(const MatrixX<T>& all, const std::vector<typename LogicOf<T>::Index>& rows, MatrixX<T>& out) {
  for (size_t i = 0; i < rows.size(); ++i)
    visitRow(all, rows[i], 0, [&](Eigen::Index k, const T& entry) { out(static_cast<Eigen::Index>(i), k) = entry; });
}

// J W^{-1/2} = [L, 0] Q^T with Q = Q_1 Q_2 ..., Q_p = I - beta v v^T, the v in the columns of `reflectors`. Rows are
// taken by their remainder after the rows before, largest first, or from nearby in their order. False when the rank differs from the cluster's.
template <typename T>
typename LogicOf<T>::Mask factorize(const ReducedCluster& cluster, bool is_nearby, ClusterScratchOf<T>& scratch,
                                    ClusterBasisOf<T>& basis) {
  using std::abs;
  using std::sqrt;
  using Rows = RowsOf<T>;
  constexpr Eigen::Index kChunk = Rows::RowsAtCompileTime;
  const T taken = -std::numeric_limits<double>::infinity();
  MatrixX<T>& E = scratch.reflected;
  VectorX<T>&rest = scratch.rest, &products = scratch.products;
  const int m = static_cast<int>(rest.size()), n = static_cast<int>(E.cols()), rank = cluster.rank;
  for (int k = 0; k < n; ++k) E.col(k).head(m) = scratch.J_all.col(k) * cluster.inverse_root[k];
  rest = E.topRows(m).rowwise().squaredNorm();
  // Of what is left; the first one of rows that are equally long.
  const auto findLongest = [&](T& most) {
    auto row = makeIndex<T>(0);
    most = rest[0];
    for (int r = 1; r < m; ++r) {
      const auto larger = rest[r] > (1 + kTie) * most;
      most = select(larger, rest[r], most);
      row = select(larger, r, row);
    }
    return row;
  };
  const bool keeps_order = is_nearby && m == rank;
  T most = 0, last = 0;
  findLongest(most);
  const T first = sqrt(most);
  auto regular = T(0) <= T(0);
  for (int p = 0; p < rank; ++p) {
    const auto row = keeps_order ? makeIndex<T>(p) : findLongest(most);
    basis.rows[p] = row;
    T* v = &scratch.reflectors(0, p);
    visitRow(E, row, p, [v](Eigen::Index k, const T& entry) { v[k] = entry; });
    // Computes E x for the row x, including |x|^2, and from it E v with v = x - pivot e_p.
    for (Eigen::Index r = 0; r < E.rows(); r += kChunk) {
      Rows sum = Rows::Zero();
      for (int k = p; k < n; ++k) addScaled<kChunk>(v[k], &E(r, k), sum.data());
      products.template segment<kChunk>(r).array() = sum;
    }
    const T norm = sqrt(getEntry(products.data(), row)), pivot = select(v[p] > kTie * norm, -norm, norm);
    regular = regular && norm > kRankTolerance * first;
    if (!any(regular)) return regular;
    last = norm;
    const T beta = 1 / (norm * norm - pivot * v[p]);
    scratch.beta[p] = beta;
    v[p] -= pivot;
    for (Eigen::Index r = 0; r < E.rows(); r += kChunk) {
      const Rows Ev = products.template segment<kChunk>(r).array() - pivot * Eigen::Map<const Rows>(&E(r, p));
      const Rows scaled = -beta * Ev;
      for (int k = p; k < n; ++k) addScaled<kChunk>(v[k], scaled.data(), &E(r, k));
    }
    for (int r = 0; r < m; ++r) rest[r] -= E(r, p) * E(r, p);
    setEntry(rest.data(), row, taken);
  }
  for (int p = 0; p < rank; ++p)
    visitRow(E, basis.rows[p], 0, [&](Eigen::Index k, const T& entry) {
      if (k <= p) basis.L(p, k) = entry;
    });
  // The remainder must be nothing but rounding.
  T left = 0;
  for (int r = 0; r < m; ++r) {
    const T norm = E.row(r).tail(n - rank).squaredNorm();
    left = select(rest[r] > taken && norm > left, norm, left);
  }
  left = sqrt(left);
  return regular && (left <= kRankTolerance * last || left <= 1e-3 * kRankTolerance * first);
}

// Newton's matrix J(q) W^{-1} J(q_0)^T at the current iterate, for the lanes of the mask.
template <typename T>
typename LogicOf<T>::Mask updateNewton(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                       const ClusterBasisOf<T>& start, const typename LogicOf<T>::Mask& mask) {
  updateColumns(cluster.model, scratch.ws);
  updateJacobian(cluster, scratch);
  selectRows(scratch.J_all, start.rows, scratch.J);
  scratch.fresh.setZero();
  addSmallProduct(scratch.J, scratch.JW.transpose(), scratch.fresh);
  const auto regular = factorizeSmall(scratch.fresh, scratch.fresh_pivots);
  for (Eigen::Index c = 0; c < scratch.newton.cols(); ++c) {
    scratch.pivots[c] = select(mask, scratch.fresh_pivots[c], scratch.pivots[c]);
    for (Eigen::Index r = 0; r < scratch.newton.rows(); ++r)
      scratch.newton(r, c) = select(mask, scratch.fresh(r, c), scratch.newton(r, c));
  }
  return regular;
}

// Eq. (1): N = W^{-1/2} Q_2 with the last columns of Q, and L L^T = J W^{-1} J^T.
template <typename T>
typename LogicOf<T>::Mask updateBases(const ReducedCluster& cluster, bool is_nearby, ClusterScratchOf<T>& scratch,
                                      ClusterStateOf<T>& out) {
  const int rank = cluster.rank, size = cluster.size, n = static_cast<int>(cluster.metric.size());
  ClusterBasisOf<T>& basis = out.basis;
  out.placements = scratch.ws.X_WB;
  updateColumns(cluster.model, scratch.ws);
  updateJacobian(cluster, scratch);
  const auto regular = factorize(cluster, is_nearby, scratch, basis);
  if (!any(regular)) return regular;
  MatrixX<T>& N = basis.N;
  N.setZero();
  for (int c = 0; c < size; ++c) N(rank + c, c) = 1;
  for (int p = rank - 1; p >= 0; --p) {
    const T* v = &scratch.reflectors(0, p);
    for (int c = 0; c < size; ++c) {
      T dot = 0;
      for (int k = p; k < n; ++k) dot += v[k] * N(k, c);
      dot *= scratch.beta[p];
      for (int k = p; k < n; ++k) N(k, c) -= dot * v[k];
    }
  }
  for (int c = 0; c < size; ++c)
    for (int k = 0; k < n; ++k) {
      N(k, c) *= cluster.inverse_root[k];
      basis.WN(k, c) = cluster.metric[k] * N(k, c);
    }
  selectRows(scratch.J_all, basis.rows, basis.J);
  return regular;
}

}  // namespace

// The null space of J_D is one vector: by elimination in its Gram matrix, with pivots on the diagonal.
void updateSpinRows(const ReducedCluster& cluster, MatrixXd& J) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostSpinDofs, kMostSpinDofs> G;
  const int m = cluster.closures.rows;
  for (size_t i = 0; i < cluster.spins.size(); ++i) {
    const std::vector<int>& dofs = cluster.spins[i].dofs;
    const auto n = static_cast<int>(dofs.size());
    G.resize(n, n);
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b) G(a, b) = J.col(dofs[a]).head(m).dot(J.col(dofs[b]).head(m));
    std::array<bool, kMostSpinDofs> is_done{};
    const auto choosePivot = [&] {
      int pivot = -1;
      for (int a = 0; a < n; ++a)
        if (!is_done[a] && (pivot < 0 || G(a, a) > (1 + kTie) * G(pivot, pivot))) pivot = a;
      return pivot;
    };
    for (int step = 0; step + 1 < n; ++step) {
      const int p = choosePivot();
      is_done[p] = true;
      if (!(G(p, p) > 0)) continue;
      G.row(p) /= G(p, p);
      for (int a = 0; a < n; ++a)
        if (a != p) G.row(a) -= G(a, p) * G.row(p);
    }
    const int last = choosePivot();
    double sum = 1;
    for (int a = 0; a < n; ++a)
      if (a != last) sum += G(a, last) * G(a, last);
    auto row = J.row(m + static_cast<int>(i));
    row.setZero();
    for (int a = 0; a < n; ++a) row[dofs[a]] = (a == last ? 1 : -G(a, last)) / std::sqrt(sum);
  }
}

void loadClusterState(const ReducedCluster& cluster, const ClusterState& state, ClusterScratch& scratch) {
  scratch.ws.q = state.basis.q;
  scratch.ws.X_WB = state.placements;
  scratch.ws.stage = WorkspaceStage::Placement;
  updateColumns(cluster.model, scratch.ws);
}

namespace {

template <typename T>
typename LogicOf<T>::Mask updateAt(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                   typename ArgumentsOf<T>::ConstVector q, bool is_nearby, ClusterStateOf<T>& out) {
  scratch.closed = T(0) <= T(0);
  out.basis.q = q;
  updatePlacements<T>(cluster.model, scratch.ws, out.basis.q);
  return updateBases(cluster, is_nearby, scratch, out);
}

// scratch.correction <- the step of Newton's method for it: with scratch.newton where it is refreshed, else with the matrix at the start.
template <typename T>
void solveNewton(const ClusterBasisOf<T>& start, const typename LogicOf<T>::Mask& refreshed,
                 ClusterScratchOf<T>& scratch) {
  VectorX<T>& correction = scratch.correction;
  if (!any(refreshed)) {
    solveGram(start, correction);
    return;
  }
  auto nearby = scratch.rest.head(correction.size());
  if (any(!refreshed)) {
    nearby = correction;
    solveGram(start, nearby);
  }
  solveFactorized(scratch.newton, scratch.pivots, correction);
  if (any(!refreshed))
    for (Eigen::Index r = 0; r < correction.size(); ++r) correction[r] = select(refreshed, correction[r], nearby[r]);
}

// Newton on zeta with the matrix J(q) W^{-1} J(q_0)^T of the independent rows, refreshed while it pays; from nearby with that of
// q_0, whose factors are there, as long as that converges as fast. A lane that has converged is left unchanged.
template <typename T>
typename LogicOf<T>::Mask closeFrom(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                    const ClusterBasisOf<T>& start, typename ArgumentsOf<T>::ConstVector d,
                                    const VectorX<T>& zeta_guess, bool is_nearby, ClusterStateOf<T>& out) {
  using Mask = typename LogicOf<T>::Mask;
  const auto updateProducts = [&] {
    for (Eigen::Index k = 0; k < start.J.cols(); ++k) scratch.JW.col(k) = start.J.col(k) * cluster.inverse_metric[k];
  };
  if (!is_nearby) updateProducts();
  // step += s W^{-1} J(q_0)^T zeta, from nearby mostly without the products, and always rounded in the same way.
  const auto addToStep = [&](const VectorX<T>& zeta, double s) {
    if (!is_nearby) {
      addSmallProductTransposed(scratch.JW, zeta, out.step, s);
      return;
    }
    auto along = scratch.reflectors.col(0);
    along.setZero();
    addSmallProductTransposed(start.J, zeta, along, s);
    for (Eigen::Index k = 0; k < along.size(); ++k) out.step[k] += along[k] * cluster.inverse_metric[k];
  };
  out.step = d;
  out.zeta.setZero();
  if (zeta_guess.size()) {
    out.zeta = zeta_guess;
    addToStep(out.zeta, -1);
  }
  const Mask never = T(0) < T(0), always = T(0) <= T(0);
  Mask closed = never, failed = never, refreshed = never;
  T previous = 0;
  constexpr int kMaxIterations = 30;
  for (int i = 0; i <= kMaxIterations; ++i) {
    for (const Joint& joint : cluster.model.joints())
      if (joint.nv)
        integrateJoint<T>(joint, start.q.segment(joint.idx_q, joint.nq), out.step.segment(joint.idx_v, joint.nv),
                          out.basis.q.segment(joint.idx_q, joint.nq));
    updatePlacements<T>(cluster.model, scratch.ws, out.basis.q);
    const T gap = updateResidual(cluster, scratch);
    const Mask stalled = i > 0 ? gap > 0.5 * previous : never;
    failed = failed || !(gap <= std::numeric_limits<double>::max());
    closed = closed || gap <= kClosedTolerance || (stalled && gap <= kAcceptedTolerance);
    const Mask active = !(closed || failed);
    if (!any(active) || i == kMaxIterations) break;
    const Mask slow = i > 0 ? active && gap > 0.05 * previous : is_nearby ? never : active;
    if (is_nearby && any(slow)) updateProducts();
    if (any(slow)) failed = failed || (slow && !updateNewton(cluster, scratch, start, slow));
    refreshed = refreshed || slow;
    previous = gap;
    for (size_t r = 0; r < start.rows.size(); ++r)
      scratch.correction[r] = getEntry(scratch.residual.data(), start.rows[r]);
    // The residual falls by J dq (notation.h), and dq = -W^{-1} J(q_0)^T dzeta.
    solveNewton<T>(start, is_nearby ? refreshed : always, scratch);
    for (Eigen::Index r = 0; r < out.zeta.size(); ++r)
      scratch.correction[r] = select(active && !failed, scratch.correction[r], T(0));
    out.zeta -= scratch.correction;
    addToStep(scratch.correction, 1);
  }
  scratch.closed = closed;
  return any(closed) ? closed && updateBases(cluster, is_nearby, scratch, out) : closed;
}

}  // namespace

template <typename T>
typename LogicOf<T>::Mask updateClusterState(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                             typename ArgumentsOf<T>::ConstVector q, ClusterStateOf<T>& out) {
  return updateAt(cluster, scratch, q, false, out);
}

template <typename T>
typename LogicOf<T>::Mask updateNearbyCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                              typename ArgumentsOf<T>::ConstVector q, ClusterStateOf<T>& out) {
  return updateAt(cluster, scratch, q, true, out);
}

template <typename T>
typename LogicOf<T>::Mask closeCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                       const ClusterBasisOf<T>& start, typename ArgumentsOf<T>::ConstVector d,
                                       const VectorX<T>& zeta_guess, ClusterStateOf<T>& out) {
  return closeFrom(cluster, scratch, start, d, zeta_guess, false, out);
}

template <typename T>
typename LogicOf<T>::Mask closeNearbyCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                             const ClusterBasisOf<T>& start, typename ArgumentsOf<T>::ConstVector d,
                                             const VectorX<T>& zeta_guess, ClusterStateOf<T>& out) {
  return closeFrom(cluster, scratch, start, d, zeta_guess, true, out);
}

template <typename T>
std::string describeFailure(const ReducedCluster& cluster, const ClusterScratchOf<T>& scratch, int lane) {
  const ConstraintSet& set = cluster.closures;
  if (getLane(scratch.closed, lane))
    return "closure '" + set.closures.front().name + "': the rank of its loops is no longer " +
           std::to_string(cluster.rank - (cluster.numRows() - set.rows)) +
           ": a configuration where they gain other motions";
  size_t worst = 0;
  double largest = -1;
  for (size_t c = 0; c < set.closures.size(); ++c)
    for (int r = 0; r < getRows(set.closures[c].kind); ++r) {
      const double gap = std::abs(getLane(scratch.residual[set.offsets[c] + r], lane));
      if (gap > largest) largest = gap, worst = c;
    }
  return "closure '" + set.closures[worst].name +
         "' does not close: the step is too large, or the target is out of reach";
}

void ClusterPoint::selectIndependent(const MatrixXd& all, MatrixXd& out) const {
  selectRows<double>(all, basis().rows, out);
}

template <typename T>
void expandIndependent(const ClusterBasisOf<T>& basis, typename ArgumentsOf<T>::ConstVector independent,
                       typename ArgumentsOf<T>::Vector all) {
  all.setZero();
  for (size_t i = 0; i < basis.rows.size(); ++i) setEntry(all.data(), basis.rows[i], independent[i]);
}

template struct ClusterScratchOf<double>;
template struct ClusterScratchOf<Lanes>;
template struct ClusterStateOf<double>;
template struct ClusterStateOf<Lanes>;
template bool updateClusterState(const ReducedCluster&, ClusterScratch&, ConstVectorRef, ClusterState&);
template LaneMask updateClusterState(const ReducedCluster&, ClusterScratchOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector,
                                     ClusterStateOf<Lanes>&);
template bool updateNearbyCluster(const ReducedCluster&, ClusterScratch&, ConstVectorRef, ClusterState&);
template LaneMask updateNearbyCluster(const ReducedCluster&, ClusterScratchOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector,
                                      ClusterStateOf<Lanes>&);
template bool closeCluster(const ReducedCluster&, ClusterScratch&, const ClusterBasis&, ConstVectorRef, const VectorXd&,
                           ClusterState&);
template LaneMask closeCluster(const ReducedCluster&, ClusterScratchOf<Lanes>&, const ClusterBasisOf<Lanes>&,
                               ArgumentsOf<Lanes>::ConstVector, const VectorX<Lanes>&, ClusterStateOf<Lanes>&);
template bool closeNearbyCluster(const ReducedCluster&, ClusterScratch&, const ClusterBasis&, ConstVectorRef,
                                 const VectorXd&, ClusterState&);
template LaneMask closeNearbyCluster(const ReducedCluster&, ClusterScratchOf<Lanes>&, const ClusterBasisOf<Lanes>&,
                                     ArgumentsOf<Lanes>::ConstVector, const VectorX<Lanes>&, ClusterStateOf<Lanes>&);
template std::string describeFailure(const ReducedCluster&, const ClusterScratch&, int);
template std::string describeFailure(const ReducedCluster&, const ClusterScratchOf<Lanes>&, int);
template struct ClusterBasisOf<double>;
template struct ClusterBasisOf<Lanes>;
template void applyPseudoInverse(const ReducedCluster&, const ClusterBasis&, double, MatrixRef, MatrixRef);
template void applyPseudoInverse(const ReducedCluster&, const ClusterBasisOf<Lanes>&, double,
                                 ArgumentsOf<Lanes>::Matrix, ArgumentsOf<Lanes>::Matrix);
template void expandIndependent(const ClusterBasis&, ConstVectorRef, VectorRef);
template void expandIndependent(const ClusterBasisOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector,
                                ArgumentsOf<Lanes>::Vector);

}  // namespace bielle
