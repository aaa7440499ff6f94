#include "bielle/dynamics/distance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/cell.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

using Matrix36d = Eigen::Matrix<double, 3, 6>;
using UpToThreeColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 3>;

// Below this a sine or cosine counts as zero.
constexpr double kTiny = 1e-10;

// x of the point of Eq. (1) that is nearest to the origin.
class NearestPoint {
 public:
  NearestPoint(const Vector3d& c, const Matrix36d& G) : c_(c), G_(G) {
    constexpr int kMost = 100;  // a handful is usual
    for (int i = 0; i < kMost; ++i) {
      const int k = chooseCoordinate();
      if (k < 0) return;
      free_[n_++] = k;
      while (n_ > 0 && !descend())
        ;
    }
  }
  const Vector6d& x() const { return x_; }

 private:
  bool isFree(int k) const { return std::find(free_.begin(), free_.begin() + n_, k) != free_.begin() + n_; }

  // The one along which the point comes nearer fastest, -1 if there is none. Its column is independent of the free ones, to
  // which r is normal: there are three of them only where r = 0.
  int chooseCoordinate() const {
    const Vector3d r = c_ + G_ * x_;
    const double size = r.norm();
    if (n_ == 3 || !(size > kTiny * (c_.norm() + G_.norm()))) return -1;
    int chosen = -1;
    double steepest = kTiny * size;
    for (int k = 0; k < 6; ++k) {
      const double length = G_.col(k).norm();
      if (length == 0 || isFree(k)) continue;
      const double slope = G_.col(k).dot(r) / length;
      const double descent = x_[k] >= 1 ? slope : x_[k] <= -1 ? -slope : std::abs(slope);
      if (descent > steepest) steepest = descent, chosen = k;
    }
    return chosen;
  }

  // Of the free coordinates to their optimum: least squares. The reflections are applied one by one here; Eigen's solve compiles
  // those of blocks as well, which takes longer than the rest of this file.
  Vector3d calcStep() const {
    UpToThreeColumns columns(3, n_);
    for (int i = 0; i < n_; ++i) columns.col(i) = G_.col(free_[i]);
    const Eigen::ColPivHouseholderQR<UpToThreeColumns> qr(columns);
    const UpToThreeColumns& QR = qr.matrixQR();
    Vector3d y = -(c_ + G_ * x_), step = Vector3d::Zero();
    const int rank = static_cast<int>(qr.nonzeroPivots());
    for (int k = 0; k < rank; ++k) {
      Vector3d v = Vector3d::Unit(k);
      for (int i = k + 1; i < 3; ++i) v[i] = QR(i, k);
      y -= qr.hCoeffs()[k] * v.dot(y) * v;
    }
    for (int k = rank - 1; k >= 0; --k) {
      for (int i = k + 1; i < rank; ++i) y[k] -= QR(k, i) * y[i];
      y[k] /= QR(k, k);
      step[qr.colsPermutation().indices()[k]] = y[k];
    }
    return step;
  }

  // Moves the free coordinates to their optimum, and true, or until the first one reaches its bound, where it stays.
  bool descend() {
    const Vector3d step = calcStep();
    double share = 1;
    int first = -1;
    for (int i = 0; i < n_; ++i) {
      const double x = x_[free_[i]], room = step[i] > 0 ? 1 - x : -1 - x;
      if (std::abs(step[i]) * share > std::abs(room)) share = std::abs(room / step[i]), first = i;
    }
    for (int i = 0; i < n_; ++i) x_[free_[i]] += share * step[i];
    if (first < 0) return true;
    x_[free_[first]] = step[first] > 0 ? 1 : -1;
    std::copy(free_.begin() + first + 1, free_.begin() + n_, free_.begin() + first);
    --n_;
    return false;
  }

  Vector3d c_;
  Matrix36d G_;
  Vector6d x_ = Vector6d::Zero();
  std::array<int, 6> free_{};
  int n_ = 0;
};

struct Face {
  Vector3d normal = Vector3d::UnitZ();
  double distance = -std::numeric_limits<double>::infinity();  // of its plane from the origin, d of Eq. (2)
};

Face findNearestFace(const Vector3d& c, const Matrix36d& G) {
  Face nearest;
  const auto tryNormal = [&](const Vector3d& direction, double least) {
    const double length = direction.norm();
    if (!(length > least)) return;
    const Vector3d n = direction / length;
    const double d = std::abs(n.dot(c)) - (n.transpose() * G).cwiseAbs().sum();
    if (d > nearest.distance) nearest = {n.dot(c) < 0 ? Vector3d(-n) : n, d};
  };
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) tryNormal(G.col(i).cross(G.col(j)), kTiny * G.col(i).norm() * G.col(j).norm());
  if (std::isfinite(nearest.distance)) return nearest;
  // All edges are parallel to one line, or there are none.
  Eigen::Index longest = 0;
  G.colwise().norm().maxCoeff(&longest);
  if (G.col(longest).isZero(0))
    tryNormal(c.isZero(0) ? Vector3d(Vector3d::UnitZ()) : c, 0);
  else
    tryNormal(G.col(longest).unitOrthogonal(), 0);
  return nearest;
}

// x of the point of the face that is nearest to the origin.
Vector6d findPoint(const Face& face, const Vector3d& c, const Matrix36d& G) {
  Vector6d x = Vector6d::Zero();
  Matrix36d within = G;
  for (int k = 0; k < 6; ++k) {
    const double along = face.normal.dot(G.col(k));
    if (std::abs(along) <= kTiny * G.col(k).norm()) continue;
    x[k] = along > 0 ? -1 : 1;
    within.col(k).setZero();
  }
  return x + NearestPoint(c + G * x - face.distance * face.normal, within).x();
}

}  // namespace

ShapeDistance calcCellDistance(const Cell& a, const Cell& b) {
  const Vector3d c = a.center - b.center;
  Matrix36d G;
  G << a.edges, -b.edges;
  Vector6d x = NearestPoint(c, G).x();
  Vector3d between = c + G * x;
  ShapeDistance out;
  out.distance = between.norm();
  if (out.distance > kTiny * (c.norm() + G.norm())) {
    out.normal = between / out.distance;
  } else {
    const Face face = findNearestFace(c, G);
    x = findPoint(face, c, G);
    out.normal = face.normal;
    out.distance = face.distance;
  }
  out.distance -= a.radius + b.radius;
  out.point_a = a.center + a.edges * x.head<3>() - a.radius * out.normal;
  out.point_b = b.center + b.edges * x.tail<3>() + b.radius * out.normal;
  return out;
}

ShapeDistance calcDistance(const Shape& a, const SE3& X_WA, const Shape& b, const SE3& X_WB) {
  return calcCellDistance(makeCell(a, X_WA), makeCell(b, X_WB));
}

void addDistanceGradient(const Model& model, const Workspace& ws, const Shape& a, const Shape& b,
                         const ShapeDistance& distance, MatrixRef gradient) {
  const auto add = [&](int body, const Vector3d& p, double sign) {
    for (int k : model.supportDofs(body)) {
      const auto J = ws.J.col(k);
      gradient(0, k) += sign * distance.normal.dot(J.head<3>() + J.tail<3>().cross(p));
    }
  };
  add(a.body, distance.point_a, 1);
  add(b.body, distance.point_b, -1);
}

}  // namespace bielle
