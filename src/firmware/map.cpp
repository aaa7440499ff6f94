#include "firmware/map.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <functional>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/linkage_workspace.h"
#include "dynamics/reduction.h"
#include "math/constants.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle::firmware {
namespace {

using Eigen::Index;

constexpr double kLongestWay = 0.05;  // from posture to posture, rad or m
constexpr int kVectors = 24;

std::vector<int> listIndices(int begin, int size) {
  std::vector<int> out;
  for (int i = 0; i < size; ++i) out.push_back(begin + i);
  return out;
}

bool isIdentifier(const std::string& name) {
  return !name.empty() && !std::isdigit(static_cast<unsigned char>(name[0])) &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return c == '_' || (c < 128 && std::isalnum(c)); });
}

// Calls `visit` at the points of a grid, each next to the one before it, until it returns false.
bool visitGrid(const VectorXd& lower, const VectorXd& upper, int per_axis,
               const std::function<bool(const VectorXd&)>& visit) {
  const Index m = lower.size();
  std::vector<int> at(static_cast<size_t>(m), 0), way(static_cast<size_t>(m), 1);
  for (;;) {
    VectorXd x(m);
    for (Index i = 0; i < m; ++i) x[i] = lower[i] + (upper[i] - lower[i]) * at[static_cast<size_t>(i)] / (per_axis - 1);
    if (!visit(x)) return false;
    size_t axis = 0;
    while (axis < at.size() && (at[axis] + way[axis] < 0 || at[axis] + way[axis] >= per_axis)) way[axis] *= -1, ++axis;
    if (axis == at.size()) return true;
    at[axis] += way[axis];
  }
}

// Follows the joints of a mechanism through a box, and notices where that is not possible.
class Explorer {
 public:
  explicit Explorer(const Mechanism& mechanism)
      : mechanism_(mechanism), numbers_(mechanism), given_(listIndices(0, mechanism.size)) {
    reference_.resize(static_cast<Index>(mechanism.coordinates.size()));
    for (Index c = 0; c < reference_.size(); ++c)
      reference_[c] = mechanism.coordinates[static_cast<size_t>(c)].reference;
    numbers_.close(given_, reference_);
    sign_ = numbers_.calcRates(reference_).R.determinant() > 0;
  }

  const VectorXd& reference() const { return reference_; }
  const NumericMechanism& numbers() const { return numbers_; }

  // What stops it: the joints there; nothing if the whole box is within one branch and `margin` away from dead points.
  struct Stop {
    VectorXd from, at;  // the last posture in order, and the one that is not
  };
  std::optional<Stop> explore(const VectorXd& lower, const VectorXd& upper, double margin,
                              Postures* postures = nullptr) const {
    const Index m = lower.size();
    const int per_axis = m == 1 ? 41 : m == 2 ? 9 : m == 3 ? 5 : 3;
    VectorXd z = reference_;
    std::optional<Stop> stop;
    if (postures) *postures = {reference_};
    visitGrid(lower, upper, per_axis, [&](const VectorXd& x) {
      stop = follow(x, margin, z);
      if (!stop && postures) postures->push_back(z);
      return !stop;
    });
    return stop;
  }

 private:
  std::optional<Stop> follow(const VectorXd& x, double margin, VectorXd& z) const {
    const VectorXd start = z.head(x.size());
    const int parts = std::max(1, static_cast<int>(std::ceil((x - start).cwiseAbs().maxCoeff() / kLongestWay)));
    for (int i = 1; i <= parts; ++i) {
      VectorXd next = z;
      next.head(x.size()) = start + (x - start) * i / parts;
      const Stop stop{z.head(x.size()), next.head(x.size())};
      if (!numbers_.close(given_, next) || (next - z).cwiseAbs().maxCoeff() > 1) return stop;
      const NumericMechanism::Rates rates = numbers_.calcRates(next);
      const double det = rates.R.determinant();
      if (!std::isfinite(det) || (det > 0) != sign_ || det == 0 || !(rates.distance > margin)) return stop;
      z = next;
    }
    return {};
  }

  const Mechanism& mechanism_;
  NumericMechanism numbers_;
  std::vector<int> given_;
  VectorXd reference_;
  bool sign_ = true;
};

struct Range {
  VectorXd lower, upper;
};

// Half-open sides grow around the reference as long as the box is in order: all at once, then each by itself.
Range growRange(const Explorer& explorer, const Range& most, const std::vector<std::pair<bool, bool>>& grows) {
  const Index m = most.lower.size();
  const VectorXd start = explorer.reference().head(m);
  VectorXd low = VectorXd::Zero(m), high = VectorXd::Zero(m);  // shares of the way
  const auto makeBox = [&] {
    Range box = most;
    for (Index i = 0; i < m; ++i) {
      if (grows[static_cast<size_t>(i)].first) box.lower[i] = start[i] + low[i] * (most.lower[i] - start[i]);
      if (grows[static_cast<size_t>(i)].second) box.upper[i] = start[i] + high[i] * (most.upper[i] - start[i]);
    }
    return box;
  };
  const auto grow = [&](const std::function<void(double)>& set, double at_least) {
    double good = at_least, bad = 1;
    set(1);
    for (int i = 0; i < 9; ++i) {
      const Range box = makeBox();
      const bool is_good = !explorer.explore(box.lower, box.upper, kNearDeadPoint);
      if (i == 0 && is_good) return;
      (is_good ? good : bad) = i == 0 ? 1 : (good + bad) / 2;
      set((good + bad) / 2);
    }
    set(good);
  };
  grow([&](double share) { low.setConstant(share), high.setConstant(share); }, 0);
  for (Index i = 0; i < m; ++i)
    for (VectorXd* side : {&low, &high}) {
      const double at_least = (*side)[i];
      grow([&](double share) { (*side)[i] = share; }, at_least);
    }
  Range box = makeBox();
  for (Index i = 0; i < m; ++i) {  // few digits, inward
    if (grows[static_cast<size_t>(i)].first && box.lower[i] < start[i])
      box.lower[i] = std::ceil(box.lower[i] * 1e3) / 1e3;
    if (grows[static_cast<size_t>(i)].second && box.upper[i] > start[i])
      box.upper[i] = std::floor(box.upper[i] * 1e3) / 1e3;
  }
  return box;
}

Range findRange(const Model& model, const Linkage& linkage, const Explorer& explorer, const FirmwareOptions& options) {
  const Index m = linkage.size();
  Range range{VectorXd(m), VectorXd(m)};
  std::vector<std::pair<bool, bool>> grows;
  bool any = false;
  const VectorXd start = explorer.reference().head(m);
  for (Index i = 0; i < m; ++i) {
    const std::string& name = linkage.joint_names[static_cast<size_t>(i)];
    const Joint& joint = model.joints()[static_cast<size_t>(linkage.joints[static_cast<size_t>(i)])];
    const double half = joint.kind == JointKind::Prismatic ? 1 : kPi;
    const auto given = options.ranges.find(name);
    double lower = model.lowerLimits()[joint.idx_v], upper = model.upperLimits()[joint.idx_v];
    if (given != options.ranges.end()) std::tie(lower, upper) = given->second;
    grows.emplace_back(!std::isfinite(lower), !std::isfinite(upper));
    any = any || grows.back().first || grows.back().second;
    range.lower[i] = std::isfinite(lower) ? lower : std::min(start[i] - half, upper - half);
    range.upper[i] = std::isfinite(upper) ? upper : std::max(start[i] + half, lower + half);
    if (!(range.lower[i] < range.upper[i]))
      throw InputError(model.name(), "joint '" + name + "'", "its range is empty",
                       "give --range " + name + " LOW HIGH");
  }
  return any ? growRange(explorer, range, grows) : range;
}

// Where a box leaves its branch.
[[noreturn]] void refuse(const Model& model, const Linkage& linkage, const Explorer& explorer, const Range& range,
                         const Explorer::Stop& stop) {
  Index worst = 0;
  (stop.at - explorer.reference().head(stop.at.size())).cwiseAbs().maxCoeff(&worst);
  const auto name = [&](Index i) { return linkage.joint_names[static_cast<size_t>(i)]; };
  std::string where;
  for (Index i = 0; i < stop.at.size(); ++i)
    where += (i ? ", " : "") + (i == worst ? "" : "'" + name(i) + "' at ") + formatNumber(stop.from[i], "%.4g") +
             (std::abs(stop.at[i] - stop.from[i]) > 1e-9 ? " and " + formatNumber(stop.at[i], "%.4g") : "");
  throw InputError(model.name(), "joint '" + name(worst) + "'",
                   "its range from " + formatNumber(range.lower[worst], "%.4g") + " to " +
                       formatNumber(range.upper[worst], "%.4g") +
                       " contains a dead point or another branch of its linkage, between " + where,
                   "give a range without it: --range " + name(worst) + " LOW HIGH");
}

// The exact mechanism, with all its bodies and closures, led along its joints.
class Exact {
 public:
  Exact(const Model& model, const Linkage& linkage, ConstVectorRef q)
      : linkage_(linkage),
        cluster_(*linkage.cluster),
        scratch_(cluster_),
        state_(cluster_),
        next_(cluster_),
        tangent_(cluster_) {
    VectorXd own(cluster_.model.nq());
    gatherConfiguration(model, cluster_, q, own);
    updateClusterState<double>(cluster_, scratch_, own, state_);
  }

  // To the joints x, by Newton's method along the closed motions. False if it does not get there.
  bool lead(const VectorXd& x) {
    for (int i = 0; i < 200; ++i) {
      const VectorXd gap = x - getPositions(linkage_.joint_positions);
      const double longest = gap.cwiseAbs().maxCoeff();
      if (longest < 1e-10) return true;  // where it is, and not where it ought to be, is what counts
      if (!(tangent_.update(state_.basis.N, linkage_.joint_dofs) > 1e-6)) return false;
      const VectorXd step = tangent_.T() * (gap * std::min(1.0, kLongestWay / longest));
      if (!closeCluster<double>(cluster_, scratch_, state_.basis, step, VectorXd(), next_)) return false;
      std::swap(state_, next_);
    }
    return false;
  }

  ExactPosture get() {
    polish();
    tangent_.update(state_.basis.N, linkage_.joint_dofs);
    ExactPosture out{getPositions(linkage_.joint_positions), getPositions(linkage_.motor_positions),
                     MatrixXd(linkage_.size(), linkage_.size())};
    for (Index i = 0; i < out.R.rows(); ++i)
      out.R.row(i) = tangent_.T().row(linkage_.motor_dofs[static_cast<size_t>(i)]);
    return out;
  }

 private:
  // A last step of Newton's method, below the tolerance to which loops are closed elsewhere.
  void polish() {
    Workspace& ws = scratch_.ws;
    ClusterBasis& basis = state_.basis;
    updatePositions(cluster_.model, ws, basis.q);
    VectorXd residual = VectorXd::Zero(cluster_.numRows()), independent(basis.J.rows()), step(basis.J.cols());
    for (size_t c = 0; c < cluster_.closures.closures.size(); ++c) {
      const auto rows = calcClosureResidual(ws, cluster_.closures.closures[c]);
      residual.segment(cluster_.closures.offsets[c], rows.size()) = rows;
    }
    for (Index r = 0; r < independent.size(); ++r) independent[r] = residual[basis.rows[static_cast<size_t>(r)]];
    applyPseudoInverse<double>(cluster_, basis, 1, independent, step);
    basis.q = cluster_.model.integrate(basis.q, step);
  }

  VectorXd getPositions(const std::vector<int>& entries) const { return state_.basis.q(entries); }
  const Linkage& linkage_;
  const ReducedCluster& cluster_;
  ClusterScratch scratch_;
  ClusterState state_, next_;
  LinkageTangent tangent_;
};

// Errors in a precision.
template <typename T>
class Meter {
 public:
  explicit Meter(const Maps& map)
      : map_(map), inverse_(map.inverse), direct_(map.direct), ratio_([&] {
          std::vector<Scalar> entries;
          for (Index i = 0; i < map.rates.R.rows(); ++i)
            for (Index j = 0; j < map.rates.R.cols(); ++j) entries.push_back(map.rates.R(i, j));
          return Program(entries);
        }()) {}

  // What the code makes of a posture of which only the joints, or only the motors, are known.
  Evaluated<T> evaluate(bool from_joints, const VectorXd& given, int iterations) const {
    const int first = from_joints ? 0 : map_.size();
    std::vector<T> z(map_.mechanism.coordinates.size());
    for (Index i = 0; i < given.size(); ++i) z[static_cast<size_t>(first + i)] = static_cast<T>(given[i]);
    return (from_joints ? inverse_ : direct_).template evaluate<T>(std::move(z), iterations);
  }

  // The fewest iterations whose error in the samples another one does not halve, and whose last step the code takes for the last
  // one. 0: it does not come near
  int findIterations(bool from_joints) const {
    const double enough = 8 * std::numeric_limits<T>::epsilon();
    double before = INFINITY;
    bool was_settled = false;
    for (int n = 1; n <= 12; ++n) {
      double error = 0, last = 0;
      for (const VectorXd& z : map_.samples) {
        const VectorXd given = z.segment(from_joints ? 0 : map_.size(), map_.size());
        const Evaluated<T> found = evaluate(from_joints, given, n);
        last = std::max(last, static_cast<double>(found.last));
        const Index wanted = from_joints ? map_.size() : 0;
        for (Index c = wanted; c < wanted + map_.size(); ++c)
          error = std::max(error, std::abs(static_cast<double>(found.z[static_cast<size_t>(c)]) - z[c]));
        if (!std::isfinite(error)) return 0;
      }
      const bool is_settled = last < kSettled / 2;
      if (error < enough && is_settled) return n;
      if (error > 0.5 * before && error < 1e-3 && was_settled) return n - 1;
      before = error;
      was_settled = is_settled;
    }
    return 0;
  }

  void add(const ExactPosture& exact, MapErrors& errors) const {
    const auto round = [](const VectorXd& x) { return x.cast<T>().template cast<double>().eval(); };
    const std::vector<T> there = evaluate(true, exact.joints, map_.inverse.iterations).z,
                         back = evaluate(false, exact.motors, map_.direct.iterations).z;
    // What is given was rounded; that is no error of the map.
    const VectorXd motors = exact.motors + exact.R * (round(exact.joints) - exact.joints),
                   joints = exact.joints + exact.R.lu().solve(round(exact.motors) - exact.motors);
    const auto raise = [](double& most, double error) { most = error <= most ? most : error; };  // also to NaN
    for (int i = 0; i < map_.size(); ++i) {
      raise(errors.motors, std::abs(static_cast<double>(there[static_cast<size_t>(map_.size() + i)]) - motors[i]));
      raise(errors.joints, std::abs(static_cast<double>(back[static_cast<size_t>(i)]) - joints[i]));
    }
    const std::vector<T> R = ratio_.evaluate(there);
    const double scale = exact.R.cwiseAbs().maxCoeff();
    for (Index i = 0; i < exact.R.rows(); ++i)
      for (Index j = 0; j < exact.R.cols(); ++j)
        raise(errors.ratio,
              std::abs(static_cast<double>(R[static_cast<size_t>(i * exact.R.cols() + j)]) - exact.R(i, j)) / scale);
  }

 private:
  const Maps& map_;
  SolutionPrograms inverse_, direct_;
  Program ratio_;
};

template <typename T>
void measure(const Model& model, const Linkage& linkage, ConstVectorRef q, int postures, Maps& map) {
  const auto requireIterations = [&](Solution& solution, bool from_joints) {
    if (solution.isClosedForm()) return;
    solution.iterations = Meter<T>(map).findIterations(from_joints);
    if (solution.iterations == 0)
      throw InputError(model.name(), "joint '" + linkage.joint_names.front() + "'",
                       "Newton's method does not reach the postures of its linkage from everywhere in its range",
                       "give a smaller one: --range " + linkage.joint_names.front() + " LOW HIGH");
  };
  requireIterations(map.inverse, true);
  requireIterations(map.direct, false);
  const Meter<T> meter(map);
  Exact exact(model, linkage, q);
  const int per_axis = std::max(3, static_cast<int>(std::ceil(std::pow(postures, 1.0 / map.size()) - 1e-9)));
  const long all = static_cast<long>(std::pow(per_axis, map.size()) + 0.5), every = std::max(1L, all / kVectors);
  // What is compared lies within the range, to which the code clamps.
  VectorXd last, way = VectorXd::Zero(map.size());  // of the motors, from posture to posture
  const VectorXd lower = map.lower.array() + 1e-9, upper = map.upper.array() - 1e-9;
  visitGrid(lower, upper, per_axis, [&](const VectorXd& x) {
    if (!exact.lead(x))
      throw InputError(model.name(), "joint '" + linkage.joint_names.front() + "'",
                       "the mechanism cannot be led to " + formatNumber(x[0], "%.4g"),
                       "give a smaller range: --range " + linkage.joint_names.front() + " LOW HIGH");
    const ExactPosture posture = exact.get();
    meter.add(posture, map.errors);
    map.largest_ratio = std::max(map.largest_ratio, posture.R.cwiseAbs().maxCoeff());
    if (map.postures > 0) way = way.cwiseMax((posture.motors - last).cwiseAbs());
    last = posture.motors;
    map.motor_lower = map.motor_lower.cwiseMin(posture.motors);
    map.motor_upper = map.motor_upper.cwiseMax(posture.motors);
    if (map.postures++ % every == every / 2) map.vectors.push_back(posture);
    return true;
  });
  map.motor_lower -= way;  // their extremes may lie between postures
  map.motor_upper += way;
}

}  // namespace

std::optional<Maps> makeMaps(const Model& model, const Linkage& linkage, ConstVectorRef q,
                             const FirmwareOptions& options) {
  Maps map;
  map.robot = model.name();
  map.base = model.bodies()[static_cast<size_t>(linkage.cluster->root)].name;
  for (size_t i = 0; i < linkage.joints.size(); ++i) {
    const std::string& name = linkage.joint_names[i];
    if (!isIdentifier(name))
      throw InputError(model.name(), "joint '" + name + "'",
                       "its name cannot be one of C, which has letters, digits and _", "rename the joint");
    map.name += (i ? "_" : "") + name;
    map.joint_slides.push_back(model.joints()[static_cast<size_t>(linkage.joints[i])].kind == JointKind::Prismatic);
  }
  for (int m : linkage.motors) {
    map.motors.push_back(model.motors()[static_cast<size_t>(m)]);
    map.motor_slides.push_back(model.joints()[static_cast<size_t>(map.motors.back().joint)].kind ==
                               JointKind::Prismatic);
  }
  map.joint_names = linkage.joint_names;
  map.motor_names = linkage.motor_names;

  map.mechanism = makeMechanism(model, linkage, q, true);
  std::optional<Explorer> explorer(map.mechanism);
  if (explorer->numbers().calcExcess(explorer->reference()) != 0) {
    map.mechanism = makeMechanism(model, linkage, q, false);
    explorer.emplace(map.mechanism);
    if (explorer->numbers().calcExcess(explorer->reference()) != 0) return {};
  }
  const Range range = findRange(model, linkage, *explorer, options);
  map.lower = range.lower;
  map.upper = range.upper;
  if (const auto stop = explorer->explore(range.lower, range.upper, 1e-3, &map.samples))
    refuse(model, linkage, *explorer, range, *stop);
  map.nearest = INFINITY;
  for (const VectorXd& z : map.samples) map.nearest = std::min(map.nearest, explorer->numbers().calcRates(z).distance);

  const int m = map.size();
  map.motor_lower = map.motor_upper = explorer->reference().segment(m, m);
  map.inverse = solve(map.mechanism, listIndices(0, m), map.samples);
  map.direct = solve(map.mechanism, listIndices(m, m), map.samples);
  map.rates = solveRates(map.mechanism, map.samples);
  if (options.is_single)
    measure<float>(model, linkage, q, options.postures, map);
  else
    measure<double>(model, linkage, q, options.postures, map);
  return map;
}

}  // namespace bielle::firmware
