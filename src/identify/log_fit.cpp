#include "identify/log_fit.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "bielle/dynamics/kinematics.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr int kMostSteps = 60, kMostHalvings = 8;
constexpr double kLongestStep = 0.3;     // of a coordinate, rad or m
constexpr double kShortestStep = 1e-12;  // likewise; then Eq. (1) is met
constexpr double kStalled = 1e-8;        // steps as short as this stop where they no longer halve: rounding
constexpr double kRank = 1e-6;           // of A, relative: what moves less is a freedom that no sensor sees
constexpr int kChunk = 64;               // rows that a thread takes at once

double calcLongest(const VectorXd& v) { return v.size() ? v.cwiseAbs().maxCoeff() : 0; }

}  // namespace

struct LogFit::Memory {
  Memory(const ReducedCluster& cluster, size_t sensors)
      : scratch(cluster),
        state(cluster),
        next(cluster),
        variation(cluster.model),
        still(cluster.model),
        A(static_cast<Eigen::Index>(sensors), cluster.size),
        rest(static_cast<Eigen::Index>(sensors)) {}

  ClusterScratch scratch;
  ClusterState state, next;
  VariationWorkspace variation;
  MotionVariation still;
  VectorXd no_guess, d;
  MatrixXd A;
  VectorXd rest;                                             // y - o - S q over sigma
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;  // of A
};

LogFit::LogFit(std::shared_ptr<const ReducedCluster> cluster, std::vector<GeometryNumber> geometry,
               std::vector<LinkageSensor> sensors, MatrixXd readings, VectorXd q_start)
    : cluster_(std::move(cluster)),
      geometry_(std::move(geometry)),
      sensors_(std::move(sensors)),
      readings_(std::move(readings)),
      q_start_(std::move(q_start)) {
  for (const GeometryNumber& number : geometry_) variations_.push_back(makeVariation(cluster_->model, number));
}

void LogFit::addPlays(std::vector<LinkagePlay> plays, MatrixXd sides) {
  plays_ = std::move(plays), sides_ = std::move(sides);
  play_variations_.clear();
  for (const LinkagePlay& play : plays_) play_variations_.push_back(makeVariation(cluster_->model, play.rod));
}

std::vector<double> LogFit::listSides(Eigen::Index row) const {
  std::vector<double> sides;
  for (size_t p = 0; p < plays_.size(); ++p)
    if (plays_[p].sensor < 0) sides.push_back(sides_(row, static_cast<Eigen::Index>(p)));
  return sides;
}

LogFit::Variants LogFit::makeVariants(const VectorXd& x) const {
  const auto n = static_cast<Eigen::Index>(geometry_.size()), count = static_cast<Eigen::Index>(sensors_.size());
  std::vector<GeometryNumber> numbers = geometry_;
  std::vector<double> sizes;  // of the rods' plays
  for (size_t p = 0; p < plays_.size(); ++p) {
    if (plays_[p].sensor >= 0) continue;
    numbers.push_back(plays_[p].rod);
    sizes.push_back(plays_[p].size + x[n + count + static_cast<Eigen::Index>(p)]);
  }
  VectorXd changes(n + static_cast<Eigen::Index>(sizes.size()));
  changes.head(n) = x.head(n);
  Variants variants;
  for (const Eigen::Index row : used_) {
    const auto [at, is_new] = variants.try_emplace(listSides(row), *cluster_);
    if (!is_new) continue;
    for (size_t i = 0; i < sizes.size(); ++i) changes[n + static_cast<Eigen::Index>(i)] = at->first[i] * sizes[i] / 2;
    at->second.model = changeGeometry(cluster_->model, nullptr, numbers, changes);
    at->second.closures = makeConstraintSet(at->second.model);
  }
  return variants;
}

// Eq. (1) from memory.state, whose loops may be open, to a state that is closed; then A, its factors and r are those there.
bool LogFit::project(const ReducedCluster& cluster, const VectorXd& readings, Memory& m) const {
  double last = INFINITY;
  for (int step = 0; step < kMostSteps; ++step) {
    const ClusterBasis& basis = m.state.basis;
    for (size_t s = 0; s < sensors_.size(); ++s) {
      const auto i = static_cast<Eigen::Index>(s);
      m.A.row(i) = basis.N.row(sensors_[s].dof) / sensors_[s].noise;
      m.rest[i] = (readings[i] - basis.q[sensors_[s].position]) / sensors_[s].noise;
    }
    m.factors.setThreshold(kRank);
    m.factors.compute(m.A);
    m.d = basis.N * VectorXd(m.factors.solve(m.rest));  // Eq. (2)
    const double size = calcLongest(m.d);
    if (!std::isfinite(size)) return false;
    if (step > 0 && (size < kShortestStep || (size < kStalled && size > 0.5 * last))) return true;
    last = size;
    if (size > kLongestStep) m.d *= kLongestStep / size;
    int halving = 0;
    while (!closeCluster<double>(cluster, m.scratch, basis, m.d, m.no_guess, m.next)) {
      if (++halving > kMostHalvings) return false;
      m.d *= 0.5;
    }
    std::swap(m.state, m.next);
  }
  return false;
}

bool LogFit::follow(const std::atomic<bool>& interrupt) {
  Memory memory(*cluster_, sensors_.size());
  const Eigen::Index K = readings_.rows();
  q_.resize(q_start_.size(), K);
  used_.clear(), followed_.clear();
  VectorXd q = q_start_;
  for (Eigen::Index k = 0; k < K; ++k) {
    if (interrupt) return false;
    if (!updateClusterState<double>(*cluster_, memory.scratch, q, memory.state)) break;
    if (!project(*cluster_, readings_.row(k).transpose(), memory)) continue;
    q = memory.state.basis.q;
    followed_.push_back(k);
    if (!plays_.empty() && (sides_.row(k).array() == 0).any()) continue;
    q_.col(static_cast<Eigen::Index>(used_.size())) = q;
    used_.push_back(k);
  }
  q_.conservativeResize(Eigen::NoChange, numRows());
  return true;
}

// dq/dl (nv x variations), by Eq. (3).
void LogFit::updateMoves(const ReducedCluster& cluster, const std::vector<ModelVariation>& variations, Memory& m,
                         MatrixXd& e) const {
  const auto n = static_cast<Eigen::Index>(variations.size());
  e.resize(cluster.model.nv(), n);
  if (n == 0) return;
  loadClusterState(cluster, m.state, m.scratch);
  updateVelocities<double>(cluster.model, m.scratch.ws, VectorXd::Zero(cluster.model.nv()));
  updateAccelerations<double>(cluster.model, m.scratch.ws, VectorXd::Zero(cluster.model.nv()));
  MatrixXd dh = MatrixXd::Zero(cluster.rank, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ModelVariation& change = variations[static_cast<size_t>(i)];
    updateVariation(cluster.model, m.scratch.ws, change, m.still, m.variation);
    const VectorXd all = calcResidualVariation(m.scratch.ws, cluster.closures, change, m.variation);
    for (int p = 0; p < cluster.rank; ++p)  // rows of idle spins, which follow those of closures, do not change
      if (const auto at = m.state.basis.rows[static_cast<size_t>(p)]; at < all.size()) dh(p, i) = all[at];
  }
  applyPseudoInverse(cluster, m.state.basis, 1, dh, e);  // residuals fall by J dq (notation.h)
}

bool LogFit::evaluateRow(const ReducedCluster& cluster, const VectorXd& x, size_t row, Memory& m, VectorXd& r,
                         MatrixXd* J, int& told) {
  const auto n = static_cast<Eigen::Index>(geometry_.size()), count = static_cast<Eigen::Index>(sensors_.size());
  const auto k = static_cast<Eigen::Index>(row);
  if (!updateClusterState<double>(cluster, m.scratch, q_.col(k), m.state)) return false;
  VectorXd readings = readings_.row(used_[row]).transpose() - x.segment(n, count);
  for (size_t p = 0; p < plays_.size(); ++p) {
    const auto i = static_cast<Eigen::Index>(p);
    if (plays_[p].sensor >= 0)
      readings[plays_[p].sensor] -= sides_(used_[row], i) * (plays_[p].size + x[n + count + i]) / 2;
  }
  if (!project(cluster, readings, m)) return false;
  q_.col(k) = m.state.basis.q;
  r.segment(k * count, count) = m.rest;
  told = static_cast<int>(count - m.factors.rank());
  if (!J) return true;
  // Eq. (3) before P, then Eq. (4).
  MatrixXd D = MatrixXd::Zero(count, size()), e;
  const auto select = [&](Eigen::Index first) {
    for (Eigen::Index s = 0; s < count; ++s)
      D.row(s).segment(first, e.cols()) = -e.row(sensors_[static_cast<size_t>(s)].dof);
  };
  updateMoves(cluster, variations_, m, e);
  select(0);
  if (!plays_.empty()) updateMoves(cluster, play_variations_, m, e), select(n + count);
  D.middleCols(n, count).diagonal().setConstant(-1);
  for (size_t p = 0; p < plays_.size(); ++p) {
    const auto i = static_cast<Eigen::Index>(p);
    if (plays_[p].sensor >= 0) D.col(n + count + i) = D.col(n + plays_[p].sensor);
    D.col(n + count + i) *= sides_(used_[row], i) / 2;
  }
  for (Eigen::Index s = 0; s < count; ++s) D.row(s) /= sensors_[static_cast<size_t>(s)].noise;
  for (Eigen::Index i = 0; i < D.cols(); ++i) {
    const VectorXd column = D.col(i);
    J->block(k * count, i, count, 1) = column - m.A * VectorXd(m.factors.solve(column));
  }
  return true;
}

bool LogFit::evaluate(const VectorXd& x, VectorXd& r, MatrixXd* J) {
  const size_t rows = used_.size(), entries = rows * sensors_.size();
  const Variants variants = makeVariants(x);
  r.resize(static_cast<Eigen::Index>(entries));
  if (J) J->resize(static_cast<Eigen::Index>(entries), size());
  std::atomic<size_t> next{0};
  std::atomic<bool> fails{false};
  std::atomic<long> told{0};
  const MatrixXd before = q_;
  team_.run(getDefaultThreads(), [&](int) {
    Memory memory(*cluster_, sensors_.size());
    long own = 0;
    for (size_t begin = 0; (begin = next.fetch_add(kChunk)) < rows && !fails;)
      for (size_t row = begin; row < std::min(begin + kChunk, rows); ++row) {
        int of_row = 0;
        if (!evaluateRow(variants.at(listSides(used_[row])), x, row, memory, r, J, of_row)) fails = true;
        own += of_row;
      }
    told += own;
  });
  told_ = told;
  if (fails) q_ = before;  // the next search begins where configurations were found
  return !fails;
}

MatrixXd LogFit::calcLeft(const VectorXd& r) const {
  const auto count = static_cast<Eigen::Index>(sensors_.size());
  MatrixXd left = RowMatrixXd::Map(r.data(), r.size() / count, count);
  for (Eigen::Index s = 0; s < count; ++s) left.col(s) *= sensors_[static_cast<size_t>(s)].noise;
  return left;
}

int LogFit::calcSeenFreedoms(const VectorXd& q) const {
  ClusterPoint point(*cluster_);
  if (!point.update(*cluster_, q)) return 0;
  MatrixXd A(sensors_.size(), cluster_->size);
  for (size_t s = 0; s < sensors_.size(); ++s)
    A.row(static_cast<Eigen::Index>(s)) = point.basis().N.row(sensors_[s].dof);
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(kRank);
  return static_cast<int>(qr.compute(A).rank());
}

std::pair<MatrixXd, MatrixXd> LogFit::calcPlayMotions(const VectorXd& q) const {
  Memory memory(*cluster_, sensors_.size());
  MatrixXd e = MatrixXd::Zero(cluster_->model.nv(), static_cast<Eigen::Index>(plays_.size()));
  if (!updateClusterState<double>(*cluster_, memory.scratch, q, memory.state)) return {e, {}};
  updateMoves(*cluster_, play_variations_, memory, e);
  return {e, memory.state.basis.N};
}

}  // namespace bielle
