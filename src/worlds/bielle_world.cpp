#include "bielle/worlds/bielle_world.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "math/decompositions.h"
#include "math/small_dense.h"
#include "model/number_text.h"
#include "worlds/closed_tree.h"
#include "worlds/contact_law.h"
#include "worlds/left_out.h"

namespace bielle::worlds {
namespace {

constexpr int kMaxNewton = 20;
constexpr double kNewtonTolerance = 1e-10;  // of a change of velocity, relative to 1 (m/s, rad/s) and the largest
constexpr double kLeastShare = 1.0 / 64;    // of a Newton step that must lower the residual
constexpr int kMostHalvings = 6;            // of a step
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

double sum(const Works& w) { return w.motor + w.push + w.contact + w.stop + w.joint; }

class BielleWorld : public World {
 public:
  BielleWorld(const Model& model, const BielleWorldOptions& options);

  Books books() const override;

 private:
  void start() override;
  bool step(double duration) override;
  void noteForces() override { calcMotorForces(model_, u_, tau_); }
  // Forces at a velocity: their loads in reduced coordinates, and their damping if a matrix is given.
  void addForces(const VectorXd& w, VectorXd& loads, MatrixXd* damping);
  void addContacts(const VectorXd& w, VectorXd& loads, MatrixXd* damping);
  void addStops(const VectorXd& w, VectorXd& loads, MatrixXd* damping);
  Vector6d calcTwist(int tip, const VectorXd& w) const;
  void addWrench(int tip, const Vector6d& wrench, VectorXd& loads) const;
  double takeSteps(double steps, double h);
  bool takeStep(double h);
  void rewind();
  bool kick(double h);
  bool solve(double h);
  double updateResidual(double h, MatrixXd* damping);
  void updateCorrection();
  void book(double h);
  bool balance(double kinetic, double energy);
  std::string describeTrouble(double since, double h) const;
  bool move(double duration);
  Vector3d getPlace(int body, const Vector3d& point) const { return tree_.getPlacement(body).act(point); }

  const double time_step_;
  ClosedTree tree_;
  ContactSet contacts_;
  std::vector<ContactForce> forces_;     // of the last step, per point
  std::vector<ContactStep> steps_;       // of the points
  std::vector<Terrain::Touch> touches_;  // at places_
  std::vector<Vector3d> places_;         // where they acted, m (world)
  std::vector<double> stop_forces_;
  VectorXd tau_;                                                  // nv
  Vector3d com_ = Vector3d::Zero();                               // of the pushed body
  VectorXd w_mean_, dw_, correction_, residual_, start_, loads_;  // size
  MatrixXd damping_, system_;                                     // size x size
  bool slides_ = false;                                           // whether damping_ is not symmetric
  Eigen::LLT<MatrixXd> factors_;
  std::vector<int> pivots_;  // size; of system_, where it slides
  // What a step changes beside the tree.
  struct Moment {
    double taken = 0;    // steps of full length in takeSteps()
    double owed = 0;     // s, the drift that completes the last step
    double length = 0;   // s, of the last step
    double energy = 0;   // at its middle, less the works up to there, J
    VectorXd half_last;  // size, half of its dw
    Works works;
    std::vector<ContactPoint> points;
  };
  Moment now_, kept_;  // works and points of the former are those of the world
  enum class Trouble { Loops, Forces, Energy } trouble_ = Trouble::Loops;
  double amount_ = 0;  // of it: what is left of the change of velocity, m/s or rad/s; J
};

BielleWorld::BielleWorld(const Model& model, const BielleWorldOptions& options)
    : World(model, options.world),
      time_step_(options.world.time_step > 0 ? options.world.time_step : kBielleTimeStep),
      tree_(model, findPosture(model), listTips(model, pushed_body_)),
      contacts_(model, ground_, options.contact),
      forces_(contacts_.points.size()),
      steps_(contacts_.points.size()),
      touches_(contacts_.points.size()),
      places_(contacts_.points.size(), Vector3d::Zero()),
      stop_forces_(contacts_.stops.size(), 0.0),
      factors_(tree_.size()),
      pivots_(tree_.size()) {
  integration_.integrator = "leapfrog";
  warnings_ = listMissingStops(model);
  tau_.setZero(model.nv());
  for (VectorXd* x : {&w_mean_, &dw_, &correction_, &residual_, &start_, &loads_, &now_.half_last})
    x->setZero(tree_.size());
  for (MatrixXd* x : {&damping_, &system_}) x->setZero(tree_.size(), tree_.size());
  now_.points = contacts_.points;
  kept_ = now_;
}

void BielleWorld::start() {
  if (!tree_.set(q_, v_)) fail(tree_.failure());
  q_ = tree_.configuration() + tree_.turns();
  v_ = tree_.velocity();
  tau_.setZero();
  now_.half_last.setZero();
  now_.owed = now_.length = 0;
  now_.energy = tree_.calcEnergy();
  const auto place = [this](int body, const Vector3d& point) { return getPlace(body, point); };
  contacts_.reset([this](int body) { return tree_.getPlacement(body); });
  contacts_.setStart(place, [this](const JointStop& stop) { return q_[stop.coordinate]; });
}

bool BielleWorld::step(double duration) {
  const bool is_done = move(duration);
  q_ = tree_.configuration() + tree_.turns();
  v_ = tree_.velocity();
  return is_done;
}

bool BielleWorld::move(double duration) {
  const double steps = countSteps(duration, time_step_), h = duration / steps;
  const double begin = time_;
  double taken = 0;
  while (taken < steps && message_.empty() && !(taken > 0 && isInterrupted())) {
    taken += takeSteps(std::min(kSpan, steps - taken), h);
    time_ = begin + (taken == steps ? duration : taken * h);
  }
  reportFeet([this](int body) { return tree_.getPlacement(body); });
  return taken == steps && message_.empty();
}

// Takes steps of length h, whose ends are closed and balance. Where one cannot be taken, all that led there, since the cause is
// often a kick some steps before, are taken again in steps of half the length; beyond that place they are as long as before.
// \returns how many were taken: fewer where it was interrupted, or fails
double BielleWorld::takeSteps(double steps, double h) {
  double share = 1, least = 1, passed = 0;  // shortest share so far; no longer steps before this place
  now_.taken = now_.owed = 0;
  kept_ = now_;
  kept_.works = work_;
  kept_.points = contacts_.points;
  tree_.keep();
  for (;;) {
    const bool ends = now_.taken == steps || (now_.taken > 0 && isInterrupted());
    if (takeStep(ends ? 0 : share * h)) {
      if (ends) return now_.taken;
      noteStep(share * h);
      now_.taken += share;
      if (share < 1 && now_.taken >= passed && std::fmod(now_.taken, 2 * share) == 0) share *= 2;
      continue;
    }
    const bool is_shortest = share == least;
    if (is_shortest && share <= std::ldexp(1.0, -kMostHalvings)) fail(describeTrouble(now_.taken * h, share * h));
    passed = std::max(passed, now_.taken + share);
    if (is_shortest) least /= 2;
    share = least;
    rewind();
    if (!message_.empty()) return 0;
  }
}

// From the middle of the last step to that of one of length h or, with 0, to the end of the last one. If it fails, the state is
// on the way.
bool BielleWorld::takeStep(double h) {
  trouble_ = Trouble::Loops;
  if (!tree_.drift(now_.owed + 0.5 * h)) return false;
  now_.owed = 0.5 * h;
  if (h > 0) return kick(h);
  const double energy = tree_.calcEnergy();
  return balance(energy - tree_.calcPotential(), energy - sum(work_));
}

void BielleWorld::rewind() {
  now_ = kept_;
  work_ = kept_.works;
  contacts_.points = kept_.points;
  tree_.restore();
}

std::string BielleWorld::describeTrouble(double since, double h) const {
  std::string why = tree_.failure();
  if (trouble_ == Trouble::Forces)
    why = "no forces of contacts, stops and dampers fit the velocities: " + formatNumber(amount_, "%.3g") +
          " m/s or rad/s are left";
  if (trouble_ == Trouble::Energy) why = "its energy is off by " + formatNumber(amount_, "%.3g") + " J";
  return "after " + formatNumber(time_ + since, "%.6g") + " s, in a step of " + formatNumber(h, "%.3g") + " s: " + why;
}

// Eqs. (1) and (2)
bool BielleWorld::kick(double h) {
  tree_.updateMassMatrix();
  if (now_.length > 0) now_.half_last *= h / now_.length;
  now_.length = h;
  tree_.updateLoads(tau_, now_.half_last);
  std::vector<ContactPoint>& points = contacts_.points;
  for (size_t i = 0; i < points.size(); ++i) {
    places_[i] = getPlace(points[i].body, points[i].p);
    touches_[i] = contacts_.terrain.touch(places_[i], points[i].from);
  }
  for (size_t c = 0, i = 0; c < model_.contacts().size(); ++c) {
    const int tip = static_cast<int>(c);
    const Vector6d twist = calcTwist(tip, tree_.reducedVelocity());
    for (; i < points.size() && points[i].contact == tip; ++i)
      steps_[i] = {h, twist.head<3>() + twist.tail<3>().cross(places_[i])};
  }
  com_ = getPlace(pushed_body_, model_.bodies()[pushed_body_].inertia.com);
  if (!solve(h)) return false;
  w_mean_ = tree_.reducedVelocity() + 0.5 * dw_;
  loads_.setZero();
  addForces(w_mean_, loads_, nullptr);
  const double before = sum(work_);
  book(h);
  // At the middle, the mean of before and after the kick.
  const VectorXd& w = tree_.reducedVelocity();
  residual_.noalias() = tree_.massMatrix() * w_mean_;
  const double added = residual_.dot(dw_);
  residual_.noalias() = tree_.massMatrix() * w;
  const double kinetic = 0.5 * residual_.dot(w) + 0.5 * added;
  if (!balance(kinetic + std::abs(added), kinetic + tree_.calcPotential() - 0.5 * (before + sum(work_)))) return false;
  for (size_t i = 0; i < points.size(); ++i) updateAnchor(contacts_.terrain, places_[i], forces_[i], points[i]);
  contacts_.settle([this](int body) { return tree_.getPlacement(body); });
  tree_.kick(dw_);
  now_.half_last = 0.5 * dw_;
  return true;
}

// Newton's method on Eq. (1), with shorter steps where they do not lower the residual.
bool BielleWorld::solve(double h) {
  trouble_ = Trouble::Forces;
  dw_.setZero();
  double size = updateResidual(h, &damping_);
  for (int i = 0; i < kMaxNewton && std::isfinite(size); ++i) {
    system_ = tree_.massMatrix();
    system_ += 0.5 * h * damping_;
    if (slides_)
      factorizeSmall(system_, pivots_);
    else
      factors_.compute(system_);
    updateCorrection();
    start_ = dw_;
    double share = 1, next = 0;
    for (;; share *= 0.5) {
      dw_ = start_ + share * correction_;
      next = updateResidual(h, nullptr);
      if (next < size || share <= kLeastShare) break;
    }
    updateCorrection();  // with the same matrix: good enough to tell whether another one is needed
    amount_ = correction_.cwiseAbs().maxCoeff();
    if (amount_ < kNewtonTolerance * (1 + dw_.cwiseAbs().maxCoeff())) {
      dw_ += correction_;
      return true;
    }
    if (!(next < size)) return false;
    size = updateResidual(h, &damping_);
  }
  return false;
}

// Right side of Eq. (2), and its size. \param damping  set if it is given
double BielleWorld::updateResidual(double h, MatrixXd* damping) {
  w_mean_ = tree_.reducedVelocity() + 0.5 * dw_;
  loads_ = tree_.loads();
  if (damping) {
    damping->setZero();
    slides_ = false;
  }
  addForces(w_mean_, loads_, damping);
  residual_ = h * loads_;
  residual_.noalias() -= tree_.massMatrix() * dw_;
  return std::sqrt((residual_.array().square() / tree_.massMatrix().diagonal().array()).sum());
}

void BielleWorld::updateCorrection() {
  correction_ = residual_;
  if (slides_)
    solveFactorized(system_, pivots_, correction_);
  else
    factors_.solveInPlace(correction_);
}

// Whether the energy less the works is what it was in the middle of the last step: turns that are large for the step, and b at
// a velocity that was foreseen wrongly, change it.
bool BielleWorld::balance(double kinetic, double energy) {
  trouble_ = Trouble::Energy;
  amount_ = std::abs(energy - now_.energy);
  if (!(amount_ <= kEnergyError * kinetic + kLeastEnergy * model_.mass())) return false;
  now_.energy = energy;
  return true;
}

void BielleWorld::addForces(const VectorXd& w, VectorXd& loads, MatrixXd* damping) {
  if (!push_.isZero(0)) {
    Vector6d wrench;
    wrench << push_, com_.cross(push_);
    addWrench(static_cast<int>(model_.contacts().size()), wrench, loads);
  }
  addContacts(w, loads, damping);
  addStops(w, loads, damping);
}

Vector6d BielleWorld::calcTwist(int tip, const VectorXd& w) const {
  const ReducedTree::Columns& columns = tree_.getTip(tip);
  Vector6d twist = Vector6d::Zero();
  for (size_t o = 0; o < columns.outer.size(); ++o) twist += columns.J.col(o) * w[columns.outer[o]];
  return twist;
}

void BielleWorld::addWrench(int tip, const Vector6d& wrench, VectorXd& loads) const {
  const ReducedTree::Columns& columns = tree_.getTip(tip);
  for (size_t o = 0; o < columns.outer.size(); ++o) loads[columns.outer[o]] += columns.J.col(o).dot(wrench);
}

void BielleWorld::addContacts(const VectorXd& w, VectorXd& loads, MatrixXd* damping) {
  const std::vector<ContactPoint>& points = contacts_.points;
  size_t i = 0;
  for (size_t c = 0; c < model_.contacts().size(); ++c) {
    const int tip = static_cast<int>(c);
    const Vector6d twist = calcTwist(tip, w);
    Vector6d wrench = Vector6d::Zero();
    Matrix6d D = Matrix6d::Zero();
    bool touches = false;
    for (; i < points.size() && points[i].contact == tip; ++i) {
      const Vector3d& x = places_[i];
      const Vector3d velocity = twist.head<3>() + twist.tail<3>().cross(x);
      forces_[i] =
          calcContactForce(touches_[i], ground_.friction, points[i], x, velocity, damping != nullptr, steps_[i]);
      if (forces_[i].elastic == 0) continue;
      touches = true;
      wrench.head<3>() += forces_[i].force;
      wrench.tail<3>() += x.cross(forces_[i].force);
      if (!damping) continue;
      slides_ = slides_ || forces_[i].slides;
      const Matrix3d X = skew(x), DX = forces_[i].damping * X;
      D.topLeftCorner<3, 3>() += forces_[i].damping;
      D.topRightCorner<3, 3>() -= DX;
      D.bottomLeftCorner<3, 3>() += X * forces_[i].damping;
      D.bottomRightCorner<3, 3>() -= X * DX;
    }
    if (!touches) continue;
    addWrench(tip, wrench, loads);
    if (!damping) continue;
    const ReducedTree::Columns& columns = tree_.getTip(tip);
    for (size_t o = 0; o < columns.outer.size(); ++o) {
      const Vector6d DJ = D * columns.J.col(o);
      for (size_t p = 0; p < columns.outer.size(); ++p)
        (*damping)(columns.outer[p], columns.outer[o]) += columns.J.col(p).dot(DJ);
    }
  }
}

void BielleWorld::addStops(const VectorXd& w, VectorXd& loads, MatrixXd* damping) {
  for (size_t i = 0; i < contacts_.stops.size(); ++i) {
    const JointStop& stop = contacts_.stops[i];
    const double q = tree_.configuration()[stop.coordinate];
    double before = 0, v = 0;  // in the first half of the step, and in all of it
    tree_.visitRow(stop.dof, [&](int k, double entry) {
      before += entry * tree_.reducedVelocity()[k];
      v += entry * w[k];
    });
    const StopForce force = calcStopForce(stop, q, v, {now_.length, before});
    stop_forces_[i] = force.force;
    if (force.elastic == 0) continue;
    tree_.visitRow(stop.dof, [&](int k, double entry) {
      loads[k] += entry * force.force;
      if (damping)
        tree_.visitRow(stop.dof, [&](int l, double other) { (*damping)(k, l) += entry * force.damping * other; });
    });
  }
}

// Work at the mean velocity of the step.
void BielleWorld::book(double h) {
  const auto calcRate = [this](int dof) {
    double v = 0;
    tree_.visitRow(dof, [&](int k, double entry) { v += entry * w_mean_[k]; });
    return v;
  };
  for (int m = 0; m < model_.nu(); ++m) work_.motor += h * u_[m] * calcRate(model_.motors()[m].dof);
  for (const JointForce& force : model_.jointForces()) {
    const double rate = calcRate(force.dof);
    work_.joint += h * calcDissipativeForce(force, rate) * rate;
  }
  int tip = static_cast<int>(model_.contacts().size()) + 1;
  for (const PointSpring& spring : model_.pointSprings()) {
    const Vector3d p1 = getPlace(spring.body1, spring.point1), p2 = getPlace(spring.body2, spring.point2);
    const Vector6d twist1 = calcTwist(tip, w_mean_), twist2 = calcTwist(tip + 1, w_mean_);
    const auto at = &PointSpringLine<double>::calcVelocityAt;
    const double rate = calcLineDirection<double>(p2 - p1).dot(at(twist2, p2) - at(twist1, p1));
    work_.joint -= h * spring.damping * rate * rate;
    tip += 2;
  }
  for (size_t i = 0; i < stop_forces_.size(); ++i)
    if (stop_forces_[i] != 0) work_.stop += h * stop_forces_[i] * calcRate(contacts_.stops[i].dof);
  if (!push_.isZero(0)) {
    const Vector6d twist = calcTwist(static_cast<int>(model_.contacts().size()), w_mean_);
    work_.push += h * push_.dot(Vector3d(twist.head<3>() + twist.tail<3>().cross(com_)));
  }
  clearFootForces();
  for (size_t i = 0; i < forces_.size(); ++i) {
    if (forces_[i].elastic == 0) continue;
    const int contact = contacts_.points[i].contact;
    const Vector6d twist = calcTwist(contact, w_mean_);
    const Vector3d& x = places_[i];
    work_.contact += h * forces_[i].force.dot(Vector3d(twist.head<3>() + twist.tail<3>().cross(x)));
    addFootForce(contact, x, forces_[i].force);
  }
}

Books BielleWorld::books() const {
  Books books = World::books();
  contacts_.addTo(
      books, [this](int body, const Vector3d& point) { return getPlace(body, point); },
      [this](const JointStop& stop) { return q_[stop.coordinate]; });
  return books;
}

}  // namespace

std::unique_ptr<World> makeBielleWorld(const Model& model, const BielleWorldOptions& options) {
  return std::make_unique<BielleWorld>(model, options);
}

}  // namespace bielle::worlds
