#include "dynamics/followed_linkage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/loop_problem.h"
#include "dynamics/rounded_linkages.h"
#include "math/decompositions.h"
#include "math/direction.h"
#include "math/largest.h"

namespace bielle {
namespace {

constexpr double kStride = 0.1;    // along a way, rad or L
constexpr double kRegular = 0.05;  // of the largest: least singular value of a regular posture

}  // namespace

FollowedLinkage::FollowedLinkage(const Model& model, const LoopCluster& cluster)
    : model_(selectClosures(model, cluster.closures)),
      set_(makeConstraintSet(model_)),
      ws_(model_),
      dofs_(cluster.dofs),
      length_(calcTypicalLength(model, cluster.closures)) {
  std::set<int> joints;
  for (int k : dofs_) {
    joints.insert(model.dofs()[k].joint);
    const Joint& joint = model.joints()[model.dofs()[k].joint];
    const bool is_length = joint.kind == JointKind::Prismatic ||
                           (joint.kind == JointKind::Planar && k - joint.idx_v < 2) ||
                           (joint.kind == JointKind::FreeFlyer && k - joint.idx_v < 3);
    units_.push_back(is_length ? length_ : 1);
  }
  for (int joint : joints) changes_.push_back({{ModelPlace::Kind::Joint, joint}, {}});
  for (int c = 0; c < static_cast<int>(model_.closures().size()); ++c) {
    if (model_.closures()[c].kind == ClosureKind::Coupler) continue;
    changes_.push_back({{ModelPlace::Kind::Frame1, c}, {}});
    changes_.push_back({{ModelPlace::Kind::Frame2, c}, {}});
  }
}

FollowedLinkage::Rows FollowedLinkage::calcRows(const VectorXd& q, bool with_changes) {
  updatePositions(model_, ws_, q);
  const int n = numDofs();
  Rows out{VectorXd(set_.rows), MatrixXd(set_.rows, n), {}};
  if (with_changes) out.P = MatrixXd::Zero(set_.rows, 6 * static_cast<Eigen::Index>(changes_.size()));
  MatrixXd H = MatrixXd::Zero(6, model_.nv());
  for (size_t c = 0; c < set_.closures.size(); ++c) {
    const Closure& closure = set_.closures[c];
    const int row = set_.offsets[c], size = getRows(closure.kind);
    out.r.segment(row, size) = calcClosureResidual(ws_, closure);
    H.setZero();
    calcClosureResidualJacobian(ws_, closure, H.topRows(size));
    for (int k = 0; k < n; ++k) out.J.block(row, k, size, 1) = units_[k] * H.col(dofs_[k]).head(size);
    if (closure.kind == ClosureKind::Coupler) continue;
    if (with_changes) addChanges(static_cast<int>(c), out.P);
    const int lengths = getLengthRows(closure.kind);
    out.r.segment(row, lengths) /= length_;
    out.J.middleRows(row, lengths) /= length_;
    if (with_changes) out.P.middleRows(row, lengths) /= length_;
  }
  return out;
}

VectorXd FollowedLinkage::move(const VectorXd& q, const VectorXd& step) const {
  VectorXd dq = VectorXd::Zero(model_.nv());
  for (int k = 0; k < numDofs(); ++k) dq[dofs_[k]] = units_[k] * step[k];
  return model_.integrate(q, dq);
}

double FollowedLinkage::calcDistance(const VectorXd& from, const VectorXd& to) const {
  const VectorXd d = model_.difference(from, to);
  double most = 0;
  for (int k = 0; k < numDofs(); ++k) most = std::max(most, std::abs(d[dofs_[k]]) / units_[k]);
  return most;
}

void FollowedLinkage::findPlaneLoops(const VectorXd& q, double most) {
  updatePositions(model_, ws_, q);
  for (int c = 0; c < static_cast<int>(set_.closures.size()); ++c) {
    const Closure& closure = set_.closures[c];
    std::vector<Axis> loop;
    bool is_plane = closure.kind != ClosureKind::Coupler;
    for (int k : closure.dofs) {
      const JointKind kind = model_.joints()[model_.dofs()[k].joint].kind;
      is_plane =
          is_plane && (kind == JointKind::Revolute || kind == JointKind::Continuous || kind == JointKind::Prismatic);
      loop.push_back({{ModelPlace::Kind::Joint, model_.dofs()[k].joint}, kind == JointKind::Prismatic});
    }
    if (hasAxis(closure.kind)) loop.push_back({{ModelPlace::Kind::Frame1, c}, closure.kind == ClosureKind::Slider});
    std::stable_sort(loop.begin(), loop.end(), [](const Axis& a, const Axis& b) { return a.slides < b.slides; });
    if (!is_plane || loop.size() < 3 || loop[1].slides) continue;
    const Vector3d normal = getDirection(loop[0].place);
    for (const Axis& axis : loop) {
      const Vector3d direction = getDirection(axis.place);
      is_plane = is_plane && (axis.slides ? std::abs(direction.dot(normal)) : direction.cross(normal).norm()) < most;
    }
    if (is_plane) plane_loops_.push_back({c, loop});
  }
}

FollowedLinkage::Rows FollowedLinkage::calcParallelRows(const VectorXd& q) {
  updatePositions(model_, ws_, q);
  Eigen::Index count = 0, row = 0;
  for (const PlaneLoop& loop : plane_loops_) count += 2 * static_cast<Eigen::Index>(loop.axes.size());
  Rows out{VectorXd::Zero(count), {}, MatrixXd::Zero(count, 6 * static_cast<Eigen::Index>(changes_.size()))};
  for (const auto& [closure, loop] : plane_loops_) {
    const Vector3d normal = getDirection(loop[0].place);
    const Matrix3d turn = calcRotationOfZ(normal);
    for (size_t i = 1; i < loop.size(); ++i, row += 2) {
      const Vector3d direction = getDirection(loop[i].place);
      if (loop[i].slides) {
        out.r[row] = direction.dot(normal);
        addTurns(loop[i].place, direction.cross(normal).transpose(), out.P.row(row));
        addTurns(loop[0].place, normal.cross(direction).transpose(), out.P.row(row));
        continue;
      }
      const double side = direction.dot(normal) < 0 ? -1 : 1;
      for (int a = 0; a < 2; ++a) {
        const Vector3d across = turn.col(a);
        out.r[row + a] = across.dot(direction) - side * across.dot(normal);
        addTurns(loop[i].place, direction.cross(across).transpose(), out.P.row(row + a));
        addTurns(loop[0].place, -side * normal.cross(across).transpose(), out.P.row(row + a));
      }
    }
  }
  return out;
}

void FollowedLinkage::change(const VectorXd& twists) {
  ModelParts parts = takeParts(model_);
  for (size_t i = 0; i < changes_.size(); ++i) {
    auto& [place, change] = changes_[i];
    const SE3 more = exp6(Vector6d(twists.segment<6>(6 * static_cast<Eigen::Index>(i))));
    change = change * more;
    SE3& X = findPlacement(parts, place);
    X = X * more;
  }
  model_ = ModelBuilder::restore(std::move(parts));
  set_ = makeConstraintSet(model_);
}

void FollowedLinkage::alignFrames(const VectorXd& q) {
  updatePositions(model_, ws_, q);
  ModelParts parts = takeParts(model_);
  for (const PlaneLoop& loop : plane_loops_) {
    Closure& closure = parts.closures[static_cast<size_t>(loop.closure)];
    const bool is_hinge = closure.kind == ClosureKind::Hinge5D;
    if (!is_hinge && closure.kind != ClosureKind::Ball3D) continue;
    const Matrix3d R_W1 = ws_.X_WB[closure.body1].R * closure.X_B1.R;
    const Vector3d normal = R_W1.transpose() * getDirection(loop.axes[0].place);
    const NearestAxis across = findNearestAxis(normal);
    if (across.angle == 0 || across.angle > kMostAngleRounding) continue;
    closure.X_B1.R = closure.X_B1.R * across.turn;
    if (!is_hinge) continue;
    closure.X_B2.R = closure.X_B2.R * across.turn;
    closure.axis =
        across.axis * std::copysign(1.0, across.axis.dot(closure.axis));  // along the normal, to the last digits
  }
  model_ = ModelBuilder::restore(std::move(parts));
  set_ = makeConstraintSet(model_);
}

SE3 FollowedLinkage::getPlacementInWorld(const ModelPlace& place) const {
  if (place.kind == ModelPlace::Kind::Joint) {
    const Joint& joint = model_.joints()[place.index];
    return ws_.X_WB[joint.parent] * joint.X_PJ;
  }
  const Closure& closure = model_.closures()[place.index];
  return place.kind == ModelPlace::Kind::Frame1 ? ws_.X_WB[closure.body1] * closure.X_B1
                                                : ws_.X_WB[closure.body2] * closure.X_B2;
}

Vector3d FollowedLinkage::getDirection(const ModelPlace& place) const {
  const bool is_joint = place.kind == ModelPlace::Kind::Joint;
  return getPlacementInWorld(place).R *
         (is_joint ? model_.joints()[place.index].axis : model_.closures()[place.index].axis);
}

void FollowedLinkage::addTurns(const ModelPlace& axis, const Eigen::RowVector3d& by_turn,
                               Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row) const {
  const bool is_joint = axis.kind == ModelPlace::Kind::Joint;
  const int body = is_joint ? axis.index : model_.closures()[axis.index].body1;
  for (size_t i = 0; i < changes_.size(); ++i) {
    const ModelPlace& place = changes_[i].place;
    const bool turns = place.kind == ModelPlace::Kind::Joint
                           ? model_.isAncestorOrSelf(place.index, body)
                           : !is_joint && place.kind == axis.kind && place.index == axis.index;
    if (turns) row.segment<3>(6 * static_cast<Eigen::Index>(i) + 3) += by_turn * getPlacementInWorld(place).R;
  }
}

void FollowedLinkage::addChanges(int c, MatrixXd& P) const {
  const Closure& closure = set_.closures[c];
  const int row = set_.offsets[c], size = getRows(closure.kind);
  const SE3 X_W1 = ws_.X_WB[closure.body1] * closure.X_B1;
  const RowsBy6 rate = calcClosureResidualRate(ws_, closure);
  for (size_t i = 0; i < changes_.size(); ++i) {
    const ModelPlace& place = changes_[i].place;
    double sign = place.kind == ModelPlace::Kind::Frame2 ? -1 : 1;
    if (place.kind == ModelPlace::Kind::Joint) {
      sign = static_cast<int>(model_.isAncestorOrSelf(place.index, closure.body1)) -
             static_cast<int>(model_.isAncestorOrSelf(place.index, closure.body2));
    } else if (place.index != c) {
      continue;
    }
    if (sign != 0)
      P.block(row, 6 * static_cast<Eigen::Index>(i), size, 6) =
          sign * rate * X_W1.inverseTimes(getPlacementInWorld(place)).toActionMatrix();
  }
}

namespace {

// The singular value decomposition of J, by that of the triangle of a QR decomposition where J has more rows than columns: large
// linkages have several times as many, and the rows of U beyond the rank are only asked for in the end.
class RowDecomposition {
 public:
  explicit RowDecomposition(const MatrixXd& J) : rows_(J.rows()), is_tall_(J.rows() > J.cols()) {
    if (!is_tall_) {
      svd_.compute(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
      return;
    }
    const Eigen::Index n = J.cols();
    qr_.compute(J);
    const MatrixXd triangle = qr_.matrixR().topLeftCorner(n, n).triangularView<Eigen::Upper>();
    svd_.compute(triangle * qr_.colsPermutation().transpose(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  }
  const VectorXd& sigma() const { return svd_.singularValues(); }
  const MatrixXd& V() const { return svd_.matrixV(); }

  // U_m^T r
  VectorXd project(VectorXd r, Eigen::Index m) const {
    if (is_tall_) r.applyOnTheLeft(qr_.householderQ().adjoint());
    return svd_.matrixU().leftCols(m).transpose() * r.head(svd_.matrixU().rows());
  }
  // The columns of U from m on.
  MatrixXd calcRest(Eigen::Index m) const {
    const MatrixXd& own = svd_.matrixU();
    const Eigen::Index n = own.rows();
    MatrixXd rest = MatrixXd::Zero(rows_, rows_ - m);
    rest.topLeftCorner(n, n - m) = own.rightCols(n - m);
    rest.bottomRightCorner(rows_ - n, rows_ - n).setIdentity();
    if (is_tall_) rest.applyOnTheLeft(qr_.householderQ());
    return rest;
  }

 private:
  Eigen::Index rows_;
  bool is_tall_;
  Eigen::ColPivHouseholderQR<MatrixXd> qr_;
  Eigen::JacobiSVD<MatrixXd> svd_;
};

}  // namespace

std::optional<LinkageFit> fitLinkage(FollowedLinkage& linkage, VectorXd q, int m, double least) {
  constexpr int kMost = 40;
  constexpr double kLongest = 0.3;
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMost; ++i) {
    const FollowedLinkage::Rows rows = linkage.calcRows(q, false);
    if (!rows.r.allFinite() || !rows.J.allFinite()) return {};
    const RowDecomposition svd(rows.J);
    const VectorXd& sigma = svd.sigma();
    const int rank = m >= 0 ? m : static_cast<int>((sigma.array() > least).count());
    if (rank > sigma.size() || (rank > 0 && !(sigma[rank - 1] > 1e-9))) return {};
    const VectorXd along = svd.project(rows.r, rank);
    const double error = along.norm(), damping = error < 1e-3 ? 0 : 0.3 * std::min(0.1, error);
    VectorXd step =
        -svd.V().leftCols(rank) *
        (along.array() * sigma.head(rank).array() / (sigma.head(rank).array().square() + damping * damping)).matrix();
    const double size = calcLargest(step);
    if (size < 1e-14 || (size < 1e-11 && size > 0.3 * last)) {
      return LinkageFit{
          q, sigma, svd.V().rightCols(rows.J.cols() - rank), svd.calcRest(rank), rows.r, calcLargest(rows.r)};
    }
    if (size > kLongest) step *= kLongest / size;
    q = linkage.move(q, step);
    last = size;
  }
  return {};
}

namespace {

// Whether postures that way are less regular than those the other way: the same for mirror images, which so come out alike.
bool leadsToLess(FollowedLinkage& linkage, const LinkageFit& start, int m, const VectorXd& heading) {
  const auto measure = [&](double way) {
    const VectorXd step = way / std::max(calcLargest(heading), 1e-300) * heading;
    const std::optional<LinkageFit> there = fitLinkage(linkage, linkage.move(start.q, step), m);
    return there && m > 0 ? there->sigma[m - 1] : 0;
  };
  return measure(kStride) < measure(-kStride);
}

}  // namespace

LinkageWay followLinkage(FollowedLinkage& linkage, const LinkageFit& start, int m, int count, unsigned seed,
                         double opening) {
  std::mt19937 rng(seed);
  const int freedoms = linkage.numDofs() - m;
  LinkageWay way;
  way.gap = start.gap;
  const double regular = m > 0 ? kRegular * start.sigma[m - 1] : 0;
  VectorXd first;
  double stride = kStride;
  for (int attempt = 0; attempt < 12 && static_cast<int>(way.postures.size()) < count; ++attempt) {
    // One freedom: there and back again, with shorter strides where the way is short.
    VectorXd heading = start.N * VectorXd::NullaryExpr(freedoms, [&](Eigen::Index) {
                         return static_cast<double>(rng()) / 4294967296.0 - 0.5;
                       });
    if (freedoms == 1 && attempt == 0 && leadsToLess(linkage, start, m, heading)) heading = -heading;
    if (freedoms == 1 && attempt % 2 == 1) heading = -first;
    if (freedoms == 1 && attempt > 0 && attempt % 2 == 0) stride /= 3;
    first = heading;
    LinkageFit here = start;
    const int most = freedoms == 1 ? (attempt % 2 ? count : count / 2) : std::max(2, count / 6);
    for (int i = 0; i < most * 2 && static_cast<int>(way.postures.size()) < count; ++i) {
      VectorXd step = here.N * (here.N.transpose() * heading);
      const double size = calcLargest(step);
      if (!(size > 1e-6)) break;
      heading = step;
      step *= stride / size;
      std::optional<LinkageFit> next = fitLinkage(linkage, linkage.move(here.q, step), m);
      if (!next || (m > 0 && next->sigma[m - 1] < regular) || linkage.calcDistance(here.q, next->q) > 3 * stride) break;
      here = std::move(*next);
      way.gap = std::max(way.gap, here.gap);
      if (here.gap > opening) return way;
      way.moved = std::max(way.moved, linkage.calcDistance(start.q, here.q));
      if (i % 2 == 1 || freedoms > 1) way.postures.push_back(here.q);
    }
  }
  return way;
}

}  // namespace bielle
