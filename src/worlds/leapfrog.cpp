#include "worlds/leapfrog.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/motion/motion.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "math/small_dense.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

constexpr int kMaxNewton = 20;
constexpr double kNewtonTolerance = 1e-10;  // of a change of velocity, relative to 1 (m/s, rad/s) and the largest
constexpr int kMostNearby = 2;              // steps more with the factors of one, where they promise to suffice:
constexpr double kNearby = 0.1;             // to leave less than this of the tolerance
constexpr double kLeastShare = 1.0 / 64;    // of a Newton step that must lower the residual
constexpr int kMostHalvings = 10;           // of a step
constexpr double kSpan = 20;                // steps between closed ends, to which it returns to halve them
constexpr double kEnergyError = 3e-4;       // of a step, over the kinetic energy and what forces take of it
constexpr double kLeastEnergy = 1e-3;       // J/kg of the robot, as that of a sinking by 0.1 mm: below it none counts

// The bodies of all contacts, then the trunk, then those of point springs, two of each.
std::vector<int> listTips(const Model& model, int pushed_body) {
  std::vector<int> tips;
  for (const ContactFrame& contact : model.contacts()) tips.push_back(contact.body);
  tips.push_back(pushed_body);
  for (const PointSpring& spring : model.pointSprings()) tips.push_back(spring.body1), tips.push_back(spring.body2);
  return tips;
}

// Any closed configuration will do to determine the ranks of the closures.
VectorXd findPosture(const Model& model) {
  return model.references().empty() ? findClosedConfiguration(model).q : makeStandingPosture(model);
}

// Largest |entry|, NaN if any entry is.
template <typename T>
T calcLargestOf(const VectorX<T>& x) {
  using std::abs;
  T largest = 0, sum = 0;
  for (const T& entry : x) {
    const T size = abs(entry);
    largest = select(size > largest, size, largest);
    sum += size;
  }
  return largest + 0 * sum;
}

// Factors of A as those of factorizeSmall(), but without swaps, which lanes would do each for itself. \returns where they are sound:
// where pivots stay well above zero, as they do while the symmetric part of A is positive definite
template <typename T>
MaskOf<T> factorizeInOrder(const VectorX<T>& least, MatrixX<T>& A) {
  const auto n = static_cast<int>(A.rows());
  auto sound = makeMask<T>(true);
  for (int p = 0; p < n; ++p) {
    const T* __restrict pivot = &A(0, p);
    sound = sound && pivot[p] > least[p];
    const T inverse = 1 / pivot[p];
    for (int c = p + 1; c < n; ++c) {
      T* __restrict x = &A(0, c);
      const T f = x[p] *= inverse;
      for (int r = p + 1; r < n; ++r) x[r] -= f * pivot[r];
    }
  }
  return sound;
}

template <typename T>
void assignMoment(const MaskOf<T>& mask, const typename LeapfrogOf<T>::Moment& from,
                  typename LeapfrogOf<T>::Moment& to) {
  if (all(mask)) {
    to = from;
    return;
  }
  for (auto part : {&LeapfrogOf<T>::Moment::owed, &LeapfrogOf<T>::Moment::length, &LeapfrogOf<T>::Moment::energy})
    assignLanes(mask, from.*part, to.*part);
  assignLanes(mask, from.half_last, to.half_last);
  for (auto part : {&WorksOf<T>::motor, &WorksOf<T>::push, &WorksOf<T>::contact, &WorksOf<T>::stop, &WorksOf<T>::joint})
    assignLanes(mask, from.works.*part, to.works.*part);
  for (size_t c = 0; c < to.wrenches.size(); ++c) assignLanes(mask, from.wrenches[c], to.wrenches[c]);
  assignLanes(mask, from.rod_forces, to.rod_forces);
}

template <typename T>
void assignPoints(const MaskOf<T>& mask, const std::vector<ContactPointOf<T>>& from,
                  std::vector<ContactPointOf<T>>& to) {
  for (size_t i = 0; i < to.size(); ++i) {
    for (auto part : {&ContactPointOf<T>::p, &ContactPointOf<T>::anchor, &ContactPointOf<T>::from})
      assignLanes(mask, from[i].*part, to[i].*part);
    to[i].touches = select(mask, from[i].touches, to[i].touches);
    assignLanes(mask, from[i].share, to[i].share);
  }
}

}  // namespace

template <typename T>
LeapfrogOf<T>::LeapfrogOf(const Model& model, const WorldOptions& options, const ContactOptions& contact)
    : model_(model),
      pushed_body_(options.pushed_body),
      friction_(options.ground.friction),
      tree_(model, findPosture(model), listTips(model, pushed_body_)),
      contacts_(model, options.ground, contact),
      forces_(contacts_.points.size()),
      steps_(contacts_.points.size()),
      touches_(contacts_.points.size()),
      places_(contacts_.points.size(), Vector3<T>::Zero()),
      stop_forces_(contacts_.stops.size(), T(0)),
      stop_rates_(stop_forces_),
      rods_(model, tree_, options.wear.frictions),
      on_bodies_(model.numBodies(), Vector6<T>::Zero()),
      factors_(tree_.size()),
      pivots_(tree_.size()),
      swaps_(tree_.size()) {
  u_.setZero(model.nu());
  tau_.setZero(model.nv());
  for (Vector* x : {&w_mean_, &dw_, &correction_, &residual_, &start_, &loads_, &product_, &moment_.half_last})
    x->setZero(tree_.size());
  for (MatrixX<T>* x : {&damping_, &system_, &swapped_}) x->setZero(tree_.size(), tree_.size());
  moment_.wrenches.assign(model.contacts().size(), Vector6<T>::Zero());
  moment_.rod_forces.setZero(static_cast<Eigen::Index>(rods_.closures().size()));
  on_dofs_.setZero(model.nv());
  moment_kept_ = moment_before_ = moment_;
  points_kept_ = points_before_ = contacts_.points;
}

template <typename T>
MaskOf<T> LeapfrogOf<T>::start(const Vector& q, const Vector& v, const Mask& which) {
  moment_before_ = moment_;
  points_before_ = contacts_.points;
  const Mask done = tree_.set(q, v, which);
  u_.setZero();
  tau_.setZero();
  push_.setZero();
  is_pushed_ = false;
  moment_.half_last.setZero();
  moment_.owed = moment_.length = 0;
  moment_.works = {};
  for (Vector6<T>& wrench : moment_.wrenches) wrench.setZero();
  moment_.rod_forces.setZero();
  if (any(done)) {
    moment_.energy = tree_.calcEnergy();
    contacts_.reset([this](int body) { return tree_.getPlacement(body); });
  }
  if (!all(which)) {
    assignMoment<T>(!which, moment_before_, moment_);
    assignPoints<T>(!which, points_before_, contacts_.points);
  }
  return done;
}

template <typename T>
void LeapfrogOf<T>::vary(const Vector& mass_factors, const Vector& armature, const T& friction, const Mask& which) {
  tree_.setInertias(mass_factors, armature, which);
  assignLanes(which, friction, friction_);
  assignLanes(which, T(tree_.calcMass() / T(model_.mass())), mass_ratio_);
  contacts_.setHardness(mass_ratio_);
  assignLanes(which, T(tree_.calcEnergy() - moment_.works.sum()), moment_.energy);
}

template <typename T>
void LeapfrogOf<T>::command(const Vector& u, const Vector3<T>& push) {
  u_ = u;
  tau_.setZero();
  for (int m = 0; m < model_.nu(); ++m) tau_[model_.motors()[m].dof] = u[m];
  push_ = push;
  is_pushed_ = false;
  for (const T& x : push) is_pushed_ = is_pushed_ || any(x < T(0) || x > T(0));
}

template <typename T>
void LeapfrogOf<T>::swap(State& state) {
  tree_.swap(state.tree);
  std::swap(moment_, state.moment);
  contacts_.points.swap(state.points);
  std::swap(friction_, state.friction);
  std::swap(mass_ratio_, state.mass_ratio);
  std::swap(contacts_.grounds, state.grounds);
}

// How one robot goes along. Where a step cannot be taken, all that led there, since the cause is often a kick some steps before, are
// taken again in steps of half the length; beyond that place they are as long as before.
template <typename T>
struct LeapfrogOf<T>::Pace {
  double span = 0, taken = 0;               // steps between closed ends: of them all, so far
  double share = 1, least = 1, passed = 0;  // shortest share so far; no longer steps before this place
  bool is_under_way = false, begins = false, ends = false;
};

template <typename T>
void LeapfrogOf<T>::advance(double h, const Mask& which, const std::atomic<bool>* interrupt, Courses& courses) {
  const auto isInterrupted = [&] { return interrupt && *interrupt; };
  std::array<Pace, kLanesOf<T>> paces;
  for (int l = 0; l < kLanesOf<T>; ++l) {
    paces[l].is_under_way = getLane(which, l);
    paces[l].begins = true;
    courses[l].taken = courses[l].shortest_step = courses[l].longest_step = 0;
    courses[l].message.clear();
  }
  for (;;) {
    Mask active = makeMask<T>(false), begin = active, back = active;
    T length = h;  // of those that are not under way, for want of a better one
    for (int l = 0; l < kLanesOf<T>; ++l) {
      Pace& pace = paces[l];
      if (!pace.is_under_way) continue;
      if (pace.begins) pace = {std::min(kSpan, courses[l].steps - courses[l].taken), 0, 1, 1, 0, true, true, false};
      pace.ends = pace.taken == pace.span || (pace.taken > 0 && isInterrupted());
      setLaneOf(active, l, true);
      setLaneOf(begin, l, pace.begins);
      setLaneOf(length, l, pace.ends ? 0 : pace.share * h);
      pace.begins = false;
    }
    if (!any(active)) return;
    if (any(begin)) keep(begin);
    const Mask done = takeStep(length, active);
    for (int l = 0; l < kLanesOf<T>; ++l) {
      Pace& pace = paces[l];
      Course& course = courses[l];
      if (!pace.is_under_way) continue;
      const double own = pace.share * h;
      if (getLane(done, l)) {
        if (pace.ends) {
          course.taken += pace.taken;
          pace.begins = course.taken < course.steps && !isInterrupted();
          pace.is_under_way = pace.begins;
          continue;
        }
        course.longest_step = std::max(course.longest_step, own);
        course.shortest_step = course.shortest_step > 0 ? std::min(course.shortest_step, own) : own;
        pace.taken += pace.share;
        if (pace.share < 1 && pace.taken >= pace.passed && std::fmod(pace.taken, 2 * pace.share) == 0) pace.share *= 2;
        continue;
      }
      const bool is_shortest = pace.share == pace.least;
      if (is_shortest && pace.share <= std::ldexp(1.0, -kMostHalvings)) {
        course.message = describeTrouble(l, course.time + course.taken * h + pace.taken * h, own);
        pace.is_under_way = false;
      }
      pace.passed = std::max(pace.passed, pace.taken + pace.share);
      if (is_shortest) pace.least /= 2;
      pace.share = pace.least;
      pace.taken = 0;
      setLaneOf(back, l, true);
    }
    if (any(back)) rewind(back);
  }
}

// From the middle of the last step to that of one of length h or, with 0, to the end of the last one. Where it fails, the state is
// on the way.
template <typename T>
MaskOf<T> LeapfrogOf<T>::takeStep(const T& h, const Mask& which) {
  note(Trouble::Loops, which);
  const Mask moved = tree_.drift(moment_.owed + 0.5 * h, which), kicks = moved && h > T(0), ends = moved && !kicks;
  assignLanes(moved, T(0.5 * h), moment_.owed);
  Mask done = makeMask<T>(false);
  if (any(ends)) {
    const T energy = tree_.calcEnergy();
    done = balance(energy - tree_.calcPotential(), energy - moment_.works.sum(), ends);
  }
  if (!any(kicks)) return done;
  if (all(kicks)) return kick(h, kicks);
  moment_before_ = moment_;
  points_before_ = contacts_.points;
  done = done || kick(h, kicks);
  assignMoment<T>(!kicks, moment_before_, moment_);
  assignPoints<T>(!kicks, points_before_, contacts_.points);
  return done;
}

template <typename T>
void LeapfrogOf<T>::keep(const Mask& which) {
  assignLanes(which, T(0), moment_.owed);
  assignMoment<T>(which, moment_, moment_kept_);
  assignPoints<T>(which, contacts_.points, points_kept_);
  tree_.keep(which);
}

template <typename T>
void LeapfrogOf<T>::rewind(const Mask& which) {
  assignMoment<T>(which, moment_kept_, moment_);
  assignPoints<T>(which, points_kept_, contacts_.points);
  tree_.restore(which);
}

template <typename T>
void LeapfrogOf<T>::note(Trouble trouble, const Mask& which) {
  for (int l = 0; l < kLanesOf<T>; ++l)
    if (getLane(which, l)) trouble_[l] = trouble;
}

template <typename T>
std::string LeapfrogOf<T>::describeTrouble(int lane, double time, double h) const {
  std::string why = tree_.failure(lane);
  const std::string amount = formatNumber(getLane(amount_, lane), "%.3g");
  if (trouble_[lane] == Trouble::Forces)
    why = "no forces of contacts, stops and dampers fit the velocities: " + amount + " m/s or rad/s are left";
  if (trouble_[lane] == Trouble::Energy) why = "its energy is off by " + amount + " J";
  return "after " + formatNumber(time, "%.6g") + " s, in a step of " + formatNumber(h, "%.3g") + " s: " + why;
}

// product_ = M^ w
template <typename T>
void LeapfrogOf<T>::multiply(const Vector& w) {
  if constexpr (std::is_same_v<T, double>) {
    product_.noalias() = tree_.massMatrix() * w;
  } else {
    product_.setZero();
    addSmallProduct(tree_.massMatrix(), w, product_);
  }
}

// Eqs. (1) and (2)
template <typename T>
MaskOf<T> LeapfrogOf<T>::kick(const T& h, const Mask& which) {
  tree_.updateMassMatrix();
  moment_.half_last *= select(moment_.length > T(0), T(h / moment_.length), T(1));
  moment_.length = h;
  tree_.updateLoads(tau_, moment_.half_last, which);
  std::vector<ContactPointOf<T>>& points = contacts_.points;
  for (size_t i = 0; i < points.size(); ++i) {
    places_[i] = getPlace(points[i].body, points[i].p);
    touches_[i] = findTouch<T>(contacts_.grounds, places_[i], points[i].from);
  }
  for (size_t c = 0, i = 0; c < model_.contacts().size(); ++c) {
    const int tip = static_cast<int>(c);
    const Vector6<T> twist = calcTwist(tip, tree_.reducedVelocity());
    for (; i < points.size() && points[i].contact == tip; ++i)
      steps_[i] = {h, linear(twist) + angular(twist).cross(places_[i])};
  }
  for (size_t i = 0; i < contacts_.stops.size(); ++i)
    stop_rates_[i] = calcRate(contacts_.stops[i].dof, tree_.reducedVelocity());
  com_ = getPlace(pushed_body_, model_.bodies()[pushed_body_].inertia.com.cast<T>());
  rods_.update(tree_);
  const Mask solved = solve(h, which);
  if (!any(solved)) return solved;
  const T before = moment_.works.sum();
  book(h);
  // At the middle, the mean of before and after the kick.
  const Vector& w = tree_.reducedVelocity();
  multiply(w_mean_);
  const T added = product_.dot(dw_);
  multiply(w);
  const T kinetic = 0.5 * product_.dot(w) + 0.5 * added;
  using std::abs;
  const Mask done =
      balance(kinetic + abs(added), kinetic + tree_.calcPotential() - 0.5 * (before + moment_.works.sum()), solved);
  if (!any(done)) return done;
  for (size_t i = 0; i < points.size(); ++i) updateAnchor<T>(contacts_.grounds, places_[i], forces_[i], points[i]);
  contacts_.settle([this](int body) { return tree_.getPlacement(body); });
  if (!rods_.empty()) updateRodForces(h);
  tree_.kick(dw_, done);
  moment_.half_last = 0.5 * dw_;
  return done;
}

// Newton's method on Eq. (1), with shorter steps where they do not lower the residual. Further steps with the factors of a step d_1 are
// each |d_2| / |d_1| times as long as the one before: where few of them suffice, no new factors are needed. A robot is solved where
// its forces ask for no other correction; whether it is solved or given up, it stays as it is.
template <typename T>
MaskOf<T> LeapfrogOf<T>::solve(const T& h, const Mask& which) {
  note(Trouble::Forces, which);
  assignLanes(which, T(0), amount_);
  dw_.setZero();
  T size = updateResidual(h, &damping_);
  Mask active = which && size <= T(std::numeric_limits<double>::max()), solved = makeMask<T>(false);
  for (int i = 0; i < kMaxNewton && any(active); ++i) {
    ++rounds_;
    factorize(h);
    updateCorrection();
    const T first = calcLargestOf<T>(correction_);
    start_ = dw_;
    T share = 1, next = 0;
    for (Mask tried = active;;) {
      assignLanes(tried, start_ + share * correction_, dw_);
      next = updateResidual(h, nullptr);
      tried = tried && !(next < size || share <= T(kLeastShare));
      if (!any(tried)) break;
      share = select(tried, T(0.5 * share), share);
    }
    updateCorrection();
    const T second = calcLargestOf<T>(correction_), least = kNewtonTolerance * (1 + calcLargestOf<T>(dw_));
    assignLanes(active, second, amount_);
    const T ratio = second / (share * first);
    Mask near = active && (second < least || ratio * ratio * second < kNearby * least);
    for (int k = 0; k < kMostNearby && any(near); ++k) {
      assignLanes(near, dw_ + correction_, dw_);
      next = select(near, updateResidual(h, nullptr), next);
      updateCorrection();
      assignLanes(near, calcLargestOf<T>(correction_), amount_);
      solved = solved || (near && amount_ < least);
      near = near && !solved;
    }
    active = active && !solved && next < size;
    if (any(active)) size = updateResidual(h, &damping_);
  }
  return solved;
}

template <typename T>
void LeapfrogOf<T>::factorize(const T& h) {
  system_ = tree_.massMatrix();
  system_ += T(0.5 * h) * damping_;
  if constexpr (std::is_same_v<T, double>) {
    if (!slides_) {
      factors_.compute(system_);
      if (factors_.info() == Eigen::Success) return;
      slides_ = true;
    }
  }
  if constexpr (!std::is_same_v<T, double>) {
    constexpr double kLeastPivot = 1e-4;  // over that of M^ alone
    for (size_t p = 0; p < pivots_.size(); ++p) pivots_[p] = makeIndex<T>(static_cast<int>(p));
    product_ = kLeastPivot * tree_.massMatrix().diagonal();
    const Mask sound = factorizeInOrder(product_, system_);
    if (all(sound)) return;
    swapped_ = tree_.massMatrix();
    swapped_ += T(0.5 * h) * damping_;
    factorizeSmall(swapped_, swaps_);
    assignLanes(!sound, swapped_, system_);
    for (size_t p = 0; p < pivots_.size(); ++p) pivots_[p] = select(sound, pivots_[p], swaps_[p]);
  } else {
    factorizeSmall(system_, pivots_);
  }
}

template <typename T>
void LeapfrogOf<T>::updateCorrection() {
  correction_ = residual_;
  if constexpr (std::is_same_v<T, double>) {
    if (!slides_) {
      factors_.solveInPlace(correction_);
      return;
    }
  }
  solveFactorized(system_, pivots_, correction_);
}

// Right side of Eq. (2), and its size. \param damping  set if it is given
template <typename T>
T LeapfrogOf<T>::updateResidual(const T& h, MatrixX<T>* damping) {
  using std::sqrt;
  w_mean_ = tree_.reducedVelocity() + 0.5 * dw_;
  loads_ = tree_.loads();
  if (damping) {
    damping->setZero();
    slides_ = false;
  }
  addForces(w_mean_, loads_, damping);
  residual_ = h * loads_;
  if constexpr (std::is_same_v<T, double>)
    residual_.noalias() -= tree_.massMatrix() * dw_;
  else
    addSmallProduct(tree_.massMatrix(), dw_, residual_, -1);
  return sqrt((residual_.array().square() / tree_.massMatrix().diagonal().array()).sum());
}

// Whether the energy less the works is what it was in the middle of the last step: turns that are large for the step, and b at
// a velocity that was foreseen wrongly, change it.
template <typename T>
MaskOf<T> LeapfrogOf<T>::balance(const T& kinetic, const T& energy, const Mask& which) {
  using std::abs;
  note(Trouble::Energy, which);
  assignLanes(which, T(abs(energy - moment_.energy)), amount_);
  const Mask holds = which && amount_ <= kEnergyError * kinetic + kLeastEnergy * model_.mass() * mass_ratio_;
  assignLanes(holds, energy, moment_.energy);
  return holds;
}

template <typename T>
void LeapfrogOf<T>::addForces(const Vector& w, Vector& loads, MatrixX<T>* damping) {
  if (is_pushed_) {
    Vector6<T> wrench;
    wrench << push_, com_.cross(push_);
    addWrench(static_cast<int>(model_.contacts().size()), wrench, loads);
  }
  addContacts(w, loads, damping);
  addStops(w, loads, damping);
  addJoints(w, loads, damping);
  rods_.add(moment_.rod_forces, w, loads, damping);
}

// Of a coordinate.
template <typename T>
T LeapfrogOf<T>::calcRate(int dof, const Vector& w) const {
  T v = 0;
  tree_.visitRow(dof, [&](int k, const T& entry) { v += entry * w[k]; });
  return v;
}

// A force on a coordinate, and its resistance if there is a matrix for it.
template <typename T>
void LeapfrogOf<T>::addRow(int dof, const T& force, const T& resistance, Vector& loads, MatrixX<T>* damping) {
  tree_.visitRow(dof, [&](int k, const T& entry) {
    loads[k] += entry * force;
    if (damping) tree_.visitRow(dof, [&](int l, const T& other) { (*damping)(k, l) += entry * resistance * other; });
  });
}

// Dampers and friction of joints.
template <typename T>
void LeapfrogOf<T>::addJoints(const Vector& w, Vector& loads, MatrixX<T>* damping) {
  for (const JointForce& force : model_.jointForces()) {
    if (!isDissipative(force)) continue;
    const T v = calcRate(force.dof, w);
    addRow(force.dof, calcDissipativeForce<T>(force, v), damping ? calcResistance<T>(force, v) : T(0), loads, damping);
  }
}

// After book(), whose wrenches of the ground they are balanced with.
template <typename T>
void LeapfrogOf<T>::updateRodForces(const T& h) {
  for (Vector6<T>& wrench : on_bodies_) wrench.setZero();
  on_dofs_.setZero();
  for (size_t c = 0; c < model_.contacts().size(); ++c) on_bodies_[model_.contacts()[c].body] += moment_.wrenches[c];
  if (is_pushed_) {
    linear(on_bodies_[pushed_body_]) += push_;
    angular(on_bodies_[pushed_body_]) += com_.cross(push_);
  }
  for (size_t i = 0; i < stop_forces_.size(); ++i) on_dofs_[contacts_.stops[i].dof] += stop_forces_[i];
  for (const JointForce& force : model_.jointForces())
    on_dofs_[force.dof] += calcDissipativeForce<T>(force, calcRate(force.dof, w_mean_));
  rods_.addToDofs(tree_, on_dofs_);
  tree_.updateClosureForces(h, dw_, on_bodies_, on_dofs_, rods_.closures(), moment_.rod_forces);
}

template <typename T>
Vector6<T> LeapfrogOf<T>::calcTwist(int tip, const Vector& w) const {
  const typename ReducedTreeOf<T>::Columns& columns = tree_.getTip(tip);
  Vector6<T> twist = Vector6<T>::Zero();
  for (size_t o = 0; o < columns.outer.size(); ++o) twist += columns.J.col(o) * w[columns.outer[o]];
  return twist;
}

template <typename T>
void LeapfrogOf<T>::addWrench(int tip, const Vector6<T>& wrench, Vector& loads) const {
  const typename ReducedTreeOf<T>::Columns& columns = tree_.getTip(tip);
  for (size_t o = 0; o < columns.outer.size(); ++o) loads[columns.outer[o]] += columns.J.col(o).dot(wrench);
}

template <typename T>
void LeapfrogOf<T>::addContacts(const Vector& w, Vector& loads, MatrixX<T>* damping) {
  const std::vector<ContactPointOf<T>>& points = contacts_.points;
  size_t i = 0;
  for (size_t c = 0; c < model_.contacts().size(); ++c) {
    const int tip = static_cast<int>(c);
    const Vector6<T> twist = calcTwist(tip, w);
    Vector6<T> wrench = Vector6<T>::Zero();
    Matrix6<T> D = Matrix6<T>::Zero();
    bool touches = false;
    for (; i < points.size() && points[i].contact == tip; ++i) {
      const Vector3<T>& x = places_[i];
      const Vector3<T> velocity = linear(twist) + angular(twist).cross(x);
      forces_[i] = calcContactForce<T>(touches_[i], friction_, points[i], x, velocity, damping != nullptr, steps_[i]);
      if (!any(forces_[i].elastic > T(0))) continue;
      touches = true;
      linear(wrench) += forces_[i].force;
      angular(wrench) += x.cross(forces_[i].force);
      if (!damping) continue;
      slides_ = slides_ || any(forces_[i].slides);
      const Matrix3<T> X = skew(x), DX = forces_[i].damping * X;
      D.template topLeftCorner<3, 3>() += forces_[i].damping;
      D.template topRightCorner<3, 3>() -= DX;
      D.template bottomLeftCorner<3, 3>() += X * forces_[i].damping;
      D.template bottomRightCorner<3, 3>() -= X * DX;
    }
    if (!touches) continue;
    addWrench(tip, wrench, loads);
    if (!damping) continue;
    const typename ReducedTreeOf<T>::Columns& columns = tree_.getTip(tip);
    for (size_t o = 0; o < columns.outer.size(); ++o) {
      const Vector6<T> DJ = D * columns.J.col(o);
      for (size_t p = 0; p < columns.outer.size(); ++p)
        (*damping)(columns.outer[p], columns.outer[o]) += columns.J.col(p).dot(DJ);
    }
  }
}

template <typename T>
void LeapfrogOf<T>::addStops(const Vector& w, Vector& loads, MatrixX<T>* damping) {
  for (size_t i = 0; i < contacts_.stops.size(); ++i) {
    const JointStop& stop = contacts_.stops[i];
    const T q = tree_.configuration()[stop.coordinate];
    StopForceOf<T> force = calcStopForce<T>(stop, q, calcRate(stop.dof, w), {moment_.length, stop_rates_[i]});
    for (T StopForceOf<T>::*part : {&StopForceOf<T>::force, &StopForceOf<T>::elastic, &StopForceOf<T>::damping})
      force.*part *= mass_ratio_;
    stop_forces_[i] = force.force;
    if (any(force.elastic > T(0))) addRow(stop.dof, force.force, force.damping, loads, damping);
  }
}

// Work at the mean velocity of the step.
template <typename T>
void LeapfrogOf<T>::book(const T& h) {
  WorksOf<T>& works = moment_.works;
  for (int m = 0; m < model_.nu(); ++m) works.motor += h * u_[m] * calcRate(model_.motors()[m].dof, w_mean_);
  for (const JointForce& force : model_.jointForces()) {
    const T rate = calcRate(force.dof, w_mean_);
    works.joint += h * calcDissipativeForce<T>(force, rate) * rate;
  }
  works.joint += h * rods_.power();
  int tip = static_cast<int>(model_.contacts().size()) + 1;
  for (const PointSpring& spring : model_.pointSprings()) {
    const Vector3<T> p1 = getPlace(spring.body1, spring.point1.cast<T>()),
                     p2 = getPlace(spring.body2, spring.point2.cast<T>());
    const Vector6<T> twist1 = calcTwist(tip, w_mean_), twist2 = calcTwist(tip + 1, w_mean_);
    const auto at = &PointSpringLine<T>::calcVelocityAt;
    const T rate = calcLineDirection<T>(p2 - p1).dot(at(twist2, p2) - at(twist1, p1));
    works.joint -= h * spring.damping * rate * rate;
    tip += 2;
  }
  for (size_t i = 0; i < stop_forces_.size(); ++i)
    if (any(stop_forces_[i] < T(0) || stop_forces_[i] > T(0)))
      works.stop += h * stop_forces_[i] * calcRate(contacts_.stops[i].dof, w_mean_);
  if (is_pushed_) {
    const Vector6<T> twist = calcTwist(static_cast<int>(model_.contacts().size()), w_mean_);
    works.push += h * push_.dot(Vector3<T>(linear(twist) + angular(twist).cross(com_)));
  }
  for (Vector6<T>& wrench : moment_.wrenches) wrench.setZero();
  for (size_t i = 0; i < forces_.size(); ++i) {
    if (!any(forces_[i].elastic > T(0))) continue;
    const int contact = contacts_.points[i].contact;
    const Vector6<T> twist = calcTwist(contact, w_mean_);
    const Vector3<T>& x = places_[i];
    works.contact += h * forces_[i].force.dot(Vector3<T>(linear(twist) + angular(twist).cross(x)));
    linear(moment_.wrenches[contact]) += forces_[i].force;
    angular(moment_.wrenches[contact]) += x.cross(forces_[i].force);
  }
}

template class LeapfrogOf<double>;
template class LeapfrogOf<Lanes>;

}  // namespace bielle::worlds
