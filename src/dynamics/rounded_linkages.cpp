#include "dynamics/rounded_linkages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "dynamics/loop_conflict.h"
#include "dynamics/loop_problem.h"
#include "math/decompositions.h"
#include "math/direction.h"
#include "math/largest.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr double kExact = 1e-13;   // what moves so needs no change, rad or L
constexpr double kCloses = 1e-12;  // as in assembly, rad or m
constexpr double kAdds = 20;       // rounded numbers along a loop: residuals and singular values, of the tolerance
constexpr double kFrameParts = 4;  // numbers that place a frame and may each be off: those of a quaternion
constexpr double kStride = 0.1;    // along a way, rad or L
constexpr double kMoves = 0.2;     // what moves farther was meant to, rad or L
constexpr double kRegular = 0.05;  // of the largest: least singular value of a regular posture
constexpr int kFirst = 4, kPostures = 12, kOthers = 50;

// Postures that a linkage, taken to have a rank, was followed to.
struct Way {
  std::vector<VectorXd> postures;
  double gap = 0;    // largest residual, rad or L
  double moved = 0;  // of a dof from the start, rad or L
};

// A placement and its twist, m and rad, in its frame.
struct PlaceChange {
  ModelPlace place;
  SE3 change;
};

// An axis of a loop: that of a joint, or of frame 1 of a hinge.
struct Axis {
  ModelPlace place;
  bool slides = false;
};

template <typename Parts>  // const or not
auto& findPlacement(Parts& parts, const ModelPlace& place) {
  if (place.kind == ModelPlace::Kind::Joint) return parts.joints[place.index].X_PJ;
  auto& closure = parts.closures[place.index];
  return place.kind == ModelPlace::Kind::Frame1 ? closure.X_B1 : closure.X_B2;
}

// One cluster, whose placements can be changed.
class Linkage {
 public:
  Linkage(const Model& model, const LoopCluster& cluster)
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

  double length() const { return length_; }
  int numDofs() const { return static_cast<int>(dofs_.size()); }
  int numRows() const { return set_.rows; }
  const Model& model() const { return model_; }
  const std::vector<PlaceChange>& changes() const { return changes_; }

  // Rows and their derivatives by the dofs, and by the twists of the places.
  struct Rows {
    VectorXd r;
    MatrixXd J, P;
  };
  Rows calcRows(const VectorXd& q, bool with_changes) {
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
      out.r.segment(row, 3) /= length_;
      out.J.middleRows(row, 3) /= length_;
      if (with_changes) out.P.middleRows(row, 3) /= length_;
    }
    return out;
  }

  VectorXd move(const VectorXd& q, const VectorXd& step) const {
    VectorXd dq = VectorXd::Zero(model_.nv());
    for (int k = 0; k < numDofs(); ++k) dq[dofs_[k]] = units_[k] * step[k];
    return model_.integrate(q, dq);
  }
  double calcDistance(const VectorXd& from, const VectorXd& to) const {
    const VectorXd d = model_.difference(from, to);
    double most = 0;
    for (int k = 0; k < numDofs(); ++k) most = std::max(most, std::abs(d[dofs_[k]]) / units_[k]);
    return most;
  }

  // Finds the loops whose axes are parallel to `most` rad in a posture: those of slides across the others.
  void findPlaneLoops(const VectorXd& q, double most) {
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
      if (closure.kind == ClosureKind::Hinge5D) loop.push_back({{ModelPlace::Kind::Frame1, c}, false});
      std::stable_sort(loop.begin(), loop.end(), [](const Axis& a, const Axis& b) { return a.slides < b.slides; });
      if (!is_plane || loop.size() < 3 || loop[1].slides) continue;
      const Vector3d normal = getDirection(loop[0].place);
      for (const Axis& axis : loop) {
        const Vector3d direction = getDirection(axis.place);
        is_plane = is_plane && (axis.slides ? std::abs(direction.dot(normal)) : direction.cross(normal).norm()) < most;
      }
      if (is_plane) plane_loops_.push_back(loop);
    }
  }

  // How far the axes of these loops are from parallel, two rows each, one of a slide; and the derivative by the twists of the places.
  // Ways of the dofs do not change it where it is zero.
  Rows calcParallelRows(const VectorXd& q) {
    updatePositions(model_, ws_, q);
    Eigen::Index count = 0, row = 0;
    for (const std::vector<Axis>& loop : plane_loops_) count += 2 * static_cast<Eigen::Index>(loop.size());
    Rows out{VectorXd::Zero(count), {}, MatrixXd::Zero(count, 6 * static_cast<Eigen::Index>(changes_.size()))};
    for (const std::vector<Axis>& loop : plane_loops_) {
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

  // Adds twists, six a place, to the changes.
  void change(const VectorXd& twists) {
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

 private:
  SE3 getPlacementInWorld(const ModelPlace& place) const {
    if (place.kind == ModelPlace::Kind::Joint) {
      const Joint& joint = model_.joints()[place.index];
      return ws_.X_WB[joint.parent] * joint.X_PJ;
    }
    const Closure& closure = model_.closures()[place.index];
    return place.kind == ModelPlace::Kind::Frame1 ? ws_.X_WB[closure.body1] * closure.X_B1
                                                  : ws_.X_WB[closure.body2] * closure.X_B2;
  }

  Vector3d getDirection(const ModelPlace& place) const {
    const bool is_joint = place.kind == ModelPlace::Kind::Joint;
    return getPlacementInWorld(place).R *
           (is_joint ? model_.joints()[place.index].axis : model_.closures()[place.index].axis);
  }

  // Adds `by_turn`, the derivative by a rotation of an axis in the world, as one by the twists of all places that turn it.
  void addTurns(const ModelPlace& axis, const Eigen::RowVector3d& by_turn,
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

  // A twist of a joint's placement moves all bodies behind it as the joint would.
  void addChanges(int c, MatrixXd& P) const {
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

  Model model_;
  ConstraintSet set_;
  Workspace ws_;
  std::vector<int> dofs_;
  double length_;
  std::vector<double> units_;  // of dofs, rad or m
  std::vector<PlaceChange> changes_;
  std::vector<std::vector<Axis>> plane_loops_;
};

// Eq. (1) at a posture.
struct Fit {
  VectorXd q;
  VectorXd sigma;
  MatrixXd N;    // of the ways that it can go, n x (n - m)
  MatrixXd U_0;  // of the rows that are to be dropped
  VectorXd r;
  double gap = 0;
};

// Goes to the nearest posture in the least-squares sense. Ranks are those of singular values above `least` if m < 0.
std::optional<Fit> fit(Linkage& linkage, VectorXd q, int m, double least = 0) {
  constexpr int kMost = 40;
  constexpr double kLongest = 0.3;
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMost; ++i) {
    const Linkage::Rows rows = linkage.calcRows(q, false);
    if (!rows.r.allFinite() || !rows.J.allFinite()) return {};
    const Eigen::JacobiSVD<MatrixXd> svd(rows.J, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const VectorXd& sigma = svd.singularValues();
    const int rank = m >= 0 ? m : static_cast<int>((sigma.array() > least).count());
    if (rank > sigma.size() || (rank > 0 && !(sigma[rank - 1] > 1e-9))) return {};
    const VectorXd along = svd.matrixU().leftCols(rank).transpose() * rows.r;
    const double error = along.norm(), damping = error < 1e-3 ? 0 : 0.3 * std::min(0.1, error);
    VectorXd step =
        -svd.matrixV().leftCols(rank) *
        (along.array() * sigma.head(rank).array() / (sigma.head(rank).array().square() + damping * damping)).matrix();
    const double size = calcLargest(step);
    if (size < 1e-14 || (size < 1e-11 && size > 0.3 * last)) {
      const Eigen::Index n = rows.J.cols(), all = rows.J.rows();
      return Fit{q,
                 sigma,
                 svd.matrixV().rightCols(n - rank),
                 svd.matrixU().rightCols(all - rank),
                 rows.r,
                 calcLargest(rows.r)};
    }
    if (size > kLongest) step *= kLongest / size;
    q = linkage.move(q, step);
    last = size;
  }
  return {};
}

// Follows a linkage of rank m along random ways from a posture, as far as its gaps stay within `opening` and it is regular.
Way follow(Linkage& linkage, const Fit& start, int m, int count, unsigned seed, double opening) {
  std::mt19937 rng(seed);
  const int freedoms = linkage.numDofs() - m;
  Way way;
  way.gap = start.gap;
  const double regular = m > 0 ? kRegular * start.sigma[m - 1] : 0;
  VectorXd first;
  double stride = kStride;
  for (int attempt = 0; attempt < 12 && static_cast<int>(way.postures.size()) < count; ++attempt) {
    // One freedom: there and back again, with shorter strides where the way is short.
    VectorXd heading = start.N * VectorXd::NullaryExpr(freedoms, [&](Eigen::Index) {
                         return static_cast<double>(rng()) / 4294967296.0 - 0.5;
                       });
    if (freedoms == 1 && attempt % 2 == 1) heading = -first;
    if (freedoms == 1 && attempt > 0 && attempt % 2 == 0) stride /= 3;
    first = heading;
    Fit here = start;
    const int most = freedoms == 1 ? (attempt % 2 ? count : count / 2) : std::max(2, count / 6);
    for (int i = 0; i < most * 2 && static_cast<int>(way.postures.size()) < count; ++i) {
      VectorXd step = here.N * (here.N.transpose() * heading);
      const double size = calcLargest(step);
      if (!(size > 1e-6)) break;
      heading = step;
      step *= stride / size;
      std::optional<Fit> next = fit(linkage, linkage.move(here.q, step), m);
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

// Eq. (2). \param tolerance  rad; m   \returns whether all postures close
bool mend(Linkage& linkage, std::vector<VectorXd>& postures, int m, const RoundingTolerance& tolerance) {
  constexpr int kMost = 25;
  const Eigen::Index places = static_cast<Eigen::Index>(linkage.changes().size());
  VectorXd units(6 * places);
  for (Eigen::Index i = 0; i < places; ++i)
    units.segment<6>(6 * i) << Vector3d::Constant(tolerance.length), Vector3d::Constant(tolerance.angle);
  const Eigen::Index dropped = linkage.numRows() - m, count = static_cast<Eigen::Index>(postures.size());
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMost; ++i) {
    const Linkage::Rows parallel = linkage.calcParallelRows(postures[0]);
    const Eigen::Index more = parallel.r.size();
    MatrixXd A(dropped * count + more, 6 * places);
    VectorXd b(dropped * count + more);
    A.bottomRows(more) = parallel.P * units.asDiagonal();
    b.tail(more) = -parallel.r;
    double gap = calcLargest(parallel.r);
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::optional<Fit> posture = fit(linkage, postures[k], m);
      if (!posture) return false;
      postures[k] = posture->q;
      A.middleRows(dropped * k, dropped) =
          posture->U_0.transpose() * linkage.calcRows(posture->q, true).P * units.asDiagonal();
      b.segment(dropped * k, dropped) = -posture->U_0.transpose() * posture->r;
      gap = std::max(gap, posture->gap);
    }
    if (!std::isfinite(gap)) return false;
    if (gap < 1e-15 || (gap < 1e-13 && gap > 0.3 * last)) return true;
    if (i > 6 && gap > 0.5 * last) return gap < 1e-13;
    last = gap;
    // Rows are off by about the gap: smaller pivots say nothing.
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
    factors.setThreshold(std::max(1e-9, 10 * gap));
    factors.compute(A);
    VectorXd step = factors.solve(b);
    linkage.change(units.cwiseProduct(step));
  }
  return false;
}

// Places that a linkage can be followed from, the likelier ones first. Only values of the cluster's dofs matter.
std::vector<VectorXd> makeStarts(const Model& model) {
  constexpr int kRandom = 20;
  constexpr double kSpread = 0.1;  // rad or m per start
  std::vector<VectorXd> starts;
  for (const Reference& reference : model.references()) starts.push_back(makeReferenceProblem(model, reference).q_ref);
  const VectorXd neutral = model.makeNeutral();
  starts.push_back(neutral);
  std::mt19937 rng(1);
  for (int i = 1; i <= kRandom; ++i) {
    std::uniform_real_distribution<double> uniform(-kSpread * i, kSpread * i);
    starts.push_back(
        model.integrate(neutral, VectorXd::NullaryExpr(model.nv(), [&](Eigen::Index) { return uniform(rng); })));
  }
  return starts;
}

// An axis of a linkage in the world.
struct Line {
  std::string name;
  Vector3d direction, point;
};

std::vector<Line> listAxes(const Model& model, const std::vector<int>& joints, const VectorXd& q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  std::vector<Line> lines;
  for (int j : joints) {
    const Joint& joint = model.joints()[j];
    const SE3 X = ws.X_WB[joint.parent] * joint.X_PJ;
    if (joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous)
      lines.push_back({"joint '" + joint.name + "'", X.R * joint.axis, X.p});
  }
  for (const Closure& closure : model.closures()) {
    const SE3 X = ws.X_WB[closure.body1] * closure.X_B1;
    if (closure.kind == ClosureKind::Hinge5D)
      lines.push_back({"closure '" + closure.name + "'", X.R * closure.axis, X.p});
  }
  return lines;
}

// Of a posture of an ideal linkage.
LinkageShape findShape(const std::vector<Line>& axes, double length) {
  constexpr double kSame = 1e-9;
  const auto all = [&](auto holds) { return axes.size() > 2 && std::all_of(axes.begin(), axes.end(), holds); };
  if (all([&](const Line& line) { return line.direction.cross(axes[0].direction).norm() < kSame; }))
    return LinkageShape::Plane;
  // The point next to all lines, in the least-squares sense.
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const Line& line : axes) {
    const Matrix3d across = Matrix3d::Identity() - line.direction * line.direction.transpose();
    normal += across;
    right += across * line.point;
  }
  const Vector3d center = normal.ldlt().solve(right);
  const auto meets = [&](const Line& line) {
    return line.direction.cross(Vector3d(line.point - center)).norm() < kSame * length;
  };
  return center.allFinite() && all(meets) ? LinkageShape::Spherical : LinkageShape::Other;
}

// What comes of a cluster.
struct Finding {
  bool exact = false, mended = false;
  int rank = 0;     // of what it is taken for
  int written = 0;  // rank of its rows as they are
  VectorXd q;       // a posture
};

bool isWithin(const Linkage& linkage, const RoundingTolerance& tolerance) {
  for (const PlaceChange& change : linkage.changes())
    if (!(change.change.p.norm() <= kFrameParts * tolerance.length &&
          log3(change.change.R).norm() <= kFrameParts * tolerance.angle))
      return false;
  return true;
}

// The rows close over fifty other postures, and no placement has changed too much.
bool isIdeal(Linkage& linkage, const Finding& found, const RoundingTolerance& tolerance) {
  if (!isWithin(linkage, tolerance)) return false;
  const std::optional<Fit> start = fit(linkage, found.q, found.rank);
  if (!start) return false;
  const Way others = follow(linkage, *start, found.rank, kOthers, 2, kCloses);
  return others.gap <= kCloses && others.moved >= kMoves;
}

// Supposes ranks from the least upwards.
Finding examine(Linkage& linkage, const std::vector<VectorXd>& starts, const RoundingTolerance& tolerance) {
  const double size = std::max(tolerance.angle, tolerance.length / linkage.length()),
               opening = std::max(kAdds * size, 10 * kCloses);
  Finding found;
  std::optional<Fit> start;
  for (size_t i = 0; i < starts.size() && !start; ++i) {
    start = fit(linkage, starts[i], -1, std::max(opening, 1e-9));
    if (start && start->gap > opening) start.reset();
  }
  found.rank = found.written = -1;
  if (!start) return found;
  const int least = static_cast<int>((start->sigma.array() > opening).count());
  found.written = static_cast<int>((start->sigma.array() > 1e-9).count());
  for (int m = least; m <= found.written; ++m) {
    found.rank = m;
    found.q = start->q;
    if (m == linkage.numRows()) {
      found.exact = true;  // no row is redundant
      return found;
    }
    const std::optional<Fit> here = fit(linkage, start->q, m);
    if (!here) continue;
    const Way some = follow(linkage, *here, m, kFirst, 1, opening);
    if (some.gap <= kExact) {
      found.exact = true;
      return found;
    }
    if (m == linkage.numDofs() || some.gap > opening) continue;
    Way way = follow(linkage, *here, m, kPostures, 1, opening);
    if (way.moved < kMoves || way.gap > opening || way.postures.empty()) continue;
    const Linkage written = linkage;
    linkage.findPlaneLoops(start->q, opening);
    if (mend(linkage, way.postures, m, tolerance) && isIdeal(linkage, found, tolerance)) {
      found.mended = true;
      return found;
    }
    linkage = written;
  }
  found.rank = found.written;
  return found;
}

// Takes the placement of a place from the parts of a cluster, whose closures have these indices, and the named frames that are
// the ends of its closures with it.
void setPlacement(const ModelParts& changed, ModelPlace place, const std::vector<int>& closures, ModelParts& parts) {
  const SE3 X = findPlacement(changed, place);
  if (place.kind == ModelPlace::Kind::Joint) {
    parts.joints[place.index].X_PJ = X;
    return;
  }
  Closure& closure = parts.closures[closures[place.index]];
  const bool first = place.kind == ModelPlace::Kind::Frame1;
  const int body = first ? closure.body1 : closure.body2;
  SE3& X_BF = first ? closure.X_B1 : closure.X_B2;
  for (Frame& frame : parts.frames)
    if (frame.body == body && frame.name != parts.bodies[body].name && frame.X_BF.p == X_BF.p && frame.X_BF.R == X_BF.R)
      frame.X_BF = X;
  X_BF = X;
}

RoundedLinkage describe(const Model& model, const LoopCluster& cluster, const Linkage& linkage, const Finding& found) {
  RoundedLinkage out;
  out.closures = cluster.closures;
  for (int k : cluster.dofs)
    if (out.joints.empty() || out.joints.back() != model.dofs()[k].joint) out.joints.push_back(model.dofs()[k].joint);
  out.written = linkage.numDofs() - found.written;
  out.meant = linkage.numDofs() - found.rank;
  for (const PlaceChange& change : linkage.changes()) {
    out.angle = std::max(out.angle, log3(change.change.R).norm());
    out.length = std::max(out.length, change.change.p.norm());
  }
  out.shape = findShape(listAxes(linkage.model(), out.joints, found.q), linkage.length());
  // The two axes that differ most of those that were meant to be parallel.
  if (out.shape == LinkageShape::Plane) {
    const Model part = selectClosures(model, cluster.closures);
    const std::vector<Line> axes = listAxes(part, out.joints, found.q);
    for (size_t i = 0; i < axes.size(); ++i)
      for (size_t j = 0; j < i; ++j) {
        const double apart = axes[i].direction.cross(axes[j].direction).norm();
        if (apart > out.apart) out.apart = apart, out.axes = {axes[j].name, axes[i].name};
      }
  }
  return out;
}

}  // namespace

RoundedLinkages findRoundedLinkages(const Model& model, const RoundingTolerance& tolerance) {
  constexpr double kFar = 3e-3;  // rad, and of the size: beyond rounding, but hardly meant
  RoundedLinkages out;
  out.model = model;
  if (model.clusters().empty()) return out;
  const std::vector<VectorXd> starts = makeStarts(model);
  ModelParts parts = takeParts(model);
  for (const LoopCluster& cluster : model.clusters()) {
    Linkage linkage(model, cluster);
    const Linkage written = linkage;
    RoundingTolerance own;
    if (tolerance.angle > 0) own.angle = std::clamp(tolerance.angle, kLeastRounding, kMostAngleRounding);
    if (tolerance.length > 0)
      own.length = std::clamp(tolerance.length, kLeastRounding,
                              std::max(kLeastRounding, kMostLengthRounding * linkage.length()));
    Finding found = examine(linkage, starts, own);
    if (found.mended) {
      out.mended.push_back(describe(model, cluster, linkage, found));
      const ModelParts changed = takeParts(linkage.model());
      for (const PlaceChange& change : linkage.changes()) setPlacement(changed, change.place, cluster.closures, parts);
    }
    const auto motors = std::count_if(model.motors().begin(), model.motors().end(), [&](const Motor& motor) {
      return std::binary_search(cluster.dofs.begin(), cluster.dofs.end(), motor.dof);
    });
    const bool is_open = found.rank < 0;
    if (!is_open && motors <= linkage.numDofs() - found.rank) continue;
    linkage = written;
    const Finding far = examine(linkage, starts, {kFar, kFar * linkage.length()});
    if (far.mended) {
      out.locked.push_back(describe(model, cluster, linkage, far));
      if (is_open) out.locked.back().written = -1;
    } else if (!is_open) {
      out.short_of_freedoms.push_back(describe(model, cluster, linkage, found));
    }
  }
  if (!out.mended.empty()) out.model = ModelBuilder::restore(std::move(parts));
  return out;
}

}  // namespace bielle
