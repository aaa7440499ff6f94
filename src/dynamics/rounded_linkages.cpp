#include "dynamics/rounded_linkages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "dynamics/followed_linkage.h"
#include "dynamics/loop_problem.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr double kExact = 1e-13;   // what moves so needs no change, rad or L, of one loop; of many it adds up
constexpr double kCloses = 1e-12;  // as in assembly, rad or m
constexpr double kAdds = 20;       // rounded numbers along a loop: residuals and singular values, of the tolerance
constexpr double kFrameParts = 4;  // numbers that place a frame and may each be off: those of a quaternion
constexpr double kMoves = 0.2;     // what moves farther was meant to, rad or L
constexpr int kFirst = 4, kPostures = 12, kOthers = 50;

// Eq. (2). \param tolerances  of the places   \returns whether all postures close
bool mend(FollowedLinkage& linkage, std::vector<VectorXd>& postures, int m,
          const std::vector<RoundingTolerance>& tolerances) {
  constexpr int kMost = 25;
  const Eigen::Index places = static_cast<Eigen::Index>(tolerances.size());
  VectorXd units(6 * places);
  for (Eigen::Index i = 0; i < places; ++i)
    units.segment<6>(6 * i) << Vector3d::Constant(tolerances[i].length), Vector3d::Constant(tolerances[i].angle);
  const Eigen::Index dropped = linkage.numRows() - m, count = static_cast<Eigen::Index>(postures.size());
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMost; ++i) {
    const FollowedLinkage::Rows parallel = linkage.calcParallelRows(postures[0]);
    const Eigen::Index more = parallel.r.size();
    MatrixXd A(dropped * count + more, 6 * places);
    VectorXd b(dropped * count + more);
    A.bottomRows(more) = parallel.P * units.asDiagonal();
    b.tail(more) = -parallel.r;
    double gap = calcLargest(parallel.r);
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::optional<LinkageFit> posture = fitLinkage(linkage, postures[k], m);
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

// Places that a linkage can be followed from, the likelier ones first: references, the neutral configuration and what it closes to,
// which takes longest and is looked for only where these do not serve, and others beside it. Only values of the cluster's
// dofs matter.
class Starts {
 public:
  explicit Starts(const Model& model) : model_(model) {
    for (const Reference& reference : model.references()) q_.push_back(makeReferenceProblem(model, reference).q_ref);
    q_.push_back(model.makeNeutral());
    given_ = q_.size();
  }
  size_t size() const { return given_ + 1 + kRandom; }
  const VectorXd& get(size_t i) {
    if (i == given_ && q_.size() == given_) addOthers();
    return q_[i];
  }

 private:
  static constexpr size_t kRandom = 20;

  void addOthers() {
    constexpr double kSpread = 0.1;  // rad or m per start
    const VectorXd neutral = q_.back();
    q_.push_back(closeConfiguration(model_, neutral).q);
    std::mt19937 rng(1);
    for (size_t i = 1; i <= kRandom; ++i) {
      const double spread = kSpread * static_cast<double>(i);
      std::uniform_real_distribution<double> uniform(-spread, spread);
      q_.push_back(
          model_.integrate(neutral, VectorXd::NullaryExpr(model_.nv(), [&](Eigen::Index) { return uniform(rng); })));
    }
  }

  const Model& model_;
  std::vector<VectorXd> q_;
  size_t given_ = 0;
};

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

bool isWithin(const FollowedLinkage& linkage, const std::vector<RoundingTolerance>& tolerances) {
  for (size_t i = 0; i < tolerances.size(); ++i) {
    const SE3& change = linkage.changes()[i].change;
    if (!(change.p.norm() <= kFrameParts * tolerances[i].length &&
          log3(change.R).norm() <= kFrameParts * tolerances[i].angle))
      return false;
  }
  return true;
}

// Whether it can be changed so that postures of its way close, and fifty others, too, and no placement changes too much. Others that
// are far from those that were made to close may be open by more than these: then they are made to close as well.
bool makeIdeal(FollowedLinkage& linkage, std::vector<VectorXd> postures, const Finding& found,
               const std::vector<RoundingTolerance>& tolerances) {
  constexpr unsigned kRounds = 3;
  constexpr double kNearlyCloses = 1e-9;
  constexpr size_t kEach = 4;  // of the others is made to close
  for (unsigned round = 0; round < kRounds; ++round) {
    if (!mend(linkage, postures, found.rank, tolerances) || !isWithin(linkage, tolerances)) return false;
    const std::optional<LinkageFit> start = fitLinkage(linkage, found.q, found.rank);
    if (!start) return false;
    const LinkageWay others = followLinkage(linkage, *start, found.rank, kOthers, 2 + round, kNearlyCloses);
    if (others.gap <= kCloses) return others.moved >= kMoves;
    for (size_t i = 0; i < others.postures.size(); i += kEach) postures.push_back(others.postures[i]);
  }
  return false;
}

// Of the places of a linkage. Frames of hinges whose axis runs through two points turn as far as these may be off.
std::vector<RoundingTolerance> makeTolerances(const FollowedLinkage& linkage, const RoundingTolerance& given) {
  RoundingTolerance most;
  const double most_angle = given.is_given ? kMostGivenRounding : kMostAngleRounding,
               most_length = (given.is_given ? kMostGivenRounding : kMostLengthRounding) * linkage.length();
  if (given.angle > 0) most.angle = std::clamp(given.angle, kLeastRounding, most_angle);
  if (given.length > 0) most.length = std::clamp(given.length, kLeastRounding, std::max(kLeastRounding, most_length));
  std::vector<RoundingTolerance> out;
  for (const PlaceChange& change : linkage.changes()) {
    out.push_back(most);
    if (change.place.kind == ModelPlace::Kind::Joint) continue;
    const auto lever = given.levers.find(linkage.model().closures()[change.place.index].name);
    if (lever == given.levers.end()) continue;
    out.back().angle = std::max(most.angle, std::min(most.length / lever->second, kMostAngleRounding));
  }
  return out;
}

// Supposes ranks from the least upwards.
Finding examine(FollowedLinkage& linkage, Starts& starts, const std::vector<RoundingTolerance>& tolerances) {
  double size = 0;
  for (const RoundingTolerance& tolerance : tolerances)
    size = std::max({size, tolerance.angle, tolerance.length / linkage.length()});
  const double opening = std::max(kAdds * size, 10 * kCloses);
  const double exact = kExact * std::sqrt(static_cast<double>(linkage.model().closures().size()));
  Finding found;
  std::optional<LinkageFit> start;
  for (size_t i = 0; i < starts.size() && !start; ++i) {
    start = fitLinkage(linkage, starts.get(i), -1, std::max(opening, 1e-9));
    if (start && start->gap > opening) start.reset();
  }
  found.rank = found.written = -1;
  if (!start) return found;
  found.q = start->q;
  found.written = static_cast<int>((start->sigma.array() > 1e-9).count());
  const int least = std::min(found.written, static_cast<int>((start->sigma.array() > opening).count()));
  for (int m = least; m <= found.written; ++m) {
    found.rank = m;
    if (m == linkage.numRows()) {
      found.exact = true;  // no row is redundant
      return found;
    }
    const std::optional<LinkageFit> here = fitLinkage(linkage, start->q, m);
    if (!here) continue;
    const LinkageWay some = followLinkage(linkage, *here, m, kFirst, 1, opening);
    if (some.gap <= exact) {
      found.exact = true;
      return found;
    }
    if (m == linkage.numDofs() || some.gap > opening) continue;
    const LinkageWay way = followLinkage(linkage, *here, m, kPostures, 1, opening);
    if (way.moved < kMoves || way.gap > opening || way.postures.empty()) continue;
    const FollowedLinkage written = linkage;
    linkage.findPlaneLoops(start->q, opening);
    if (makeIdeal(linkage, way.postures, found, tolerances)) {
      linkage.alignFrames(found.q);
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
  closure.axis = changed.closures[place.index].axis;
}

RoundedLinkage describe(const Model& model, const LoopCluster& cluster, const FollowedLinkage& linkage,
                        const Finding& found) {
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
  RoundedLinkages out;
  out.model = model;
  if (model.clusters().empty()) return out;
  Starts starts(model);
  ModelParts parts = takeParts(model);
  for (const LoopCluster& cluster : model.clusters()) {
    FollowedLinkage linkage(model, cluster);
    const FollowedLinkage written = linkage;
    const std::vector<RoundingTolerance> own = makeTolerances(linkage, tolerance);
    const Finding found = examine(linkage, starts, own);
    if (found.mended) {
      out.mended.push_back(describe(model, cluster, linkage, found));
      const ModelParts changed = takeParts(linkage.model());
      for (const PlaceChange& change : linkage.changes()) setPlacement(changed, change.place, cluster.closures, parts);
    }
    const auto motors = std::count_if(model.motors().begin(), model.motors().end(), [&](const Motor& motor) {
      return std::binary_search(cluster.dofs.begin(), cluster.dofs.end(), motor.dof);
    });
    const bool is_open = found.rank < 0, is_short = !is_open && motors > linkage.numDofs() - found.rank;
    if ((found.exact || found.mended) && !is_short) continue;
    if (found.mended) {
      out.short_of_freedoms.push_back(out.mended.back());
      out.short_of_freedoms.back().written = out.mended.back().meant;
      continue;
    }
    linkage = written;
    const RoundingTolerance most = {kMostGivenRounding, kMostGivenRounding * linkage.length(), true, {}};
    const Finding far = examine(linkage, starts, std::vector<RoundingTolerance>(own.size(), most));
    if (far.mended) {
      out.locked.push_back(describe(model, cluster, linkage, far));
      if (is_open) out.locked.back().written = -1;
      if (out.locked.back().apart <= std::max(tolerance.angle, kLeastRounding)) out.locked.back().axes.clear();
    } else if (is_short) {
      out.short_of_freedoms.push_back(describe(model, cluster, linkage, found));
    }
  }
  if (!out.mended.empty()) out.model = ModelBuilder::restore(std::move(parts));
  return out;
}

}  // namespace bielle
