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
#include "worlds/closed_tree.h"
#include "worlds/contact_law.h"
#include "worlds/left_out.h"

namespace bielle::worlds {
namespace {

constexpr int kMaxNewton = 8;
constexpr double kNewtonTolerance = 1e-10;  // of a change of velocity, relative to 1 (m/s, rad/s) and the largest

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
  bool kick(double h);
  void book(double h);
  bool move(double duration);
  Vector3d getPlace(int body, const Vector3d& point) const { return tree_.getPlacement(body).act(point); }

  const double time_step_;
  ClosedTree tree_;
  ContactSet contacts_;
  std::vector<ContactForce> forces_;  // of the last step, per point
  std::vector<Vector3d> places_;      // where they acted, m (world)
  std::vector<double> stop_forces_;
  VectorXd tau_;                                           // nv
  Vector3d com_ = Vector3d::Zero();                        // of the pushed body
  VectorXd w_mean_, dw_, correction_, loads_, half_last_;  // size
  MatrixXd damping_, system_;                              // size x size
  Eigen::LLT<MatrixXd> factors_;
};

BielleWorld::BielleWorld(const Model& model, const BielleWorldOptions& options)
    : World(model, options.world),
      time_step_(options.world.time_step > 0 ? options.world.time_step : kBielleTimeStep),
      tree_(model, findPosture(model), listTips(model, pushed_body_)),
      contacts_(model, ground_, options.contact),
      forces_(contacts_.points.size()),
      places_(contacts_.points.size(), Vector3d::Zero()),
      stop_forces_(contacts_.stops.size(), 0.0),
      factors_(tree_.size()) {
  integration_.integrator = "leapfrog";
  warnings_ = listMissingStops(model);
  tau_.setZero(model.nv());
  for (VectorXd* x : {&w_mean_, &dw_, &correction_, &loads_, &half_last_}) x->setZero(tree_.size());
  for (MatrixXd* x : {&damping_, &system_}) x->setZero(tree_.size(), tree_.size());
}

void BielleWorld::start() {
  if (!tree_.set(q_, v_)) fail(tree_.failure());
  q_ = tree_.configuration();
  v_ = tree_.velocity();
  tau_.setZero();
  half_last_.setZero();
  const auto place = [this](int body, const Vector3d& point) { return getPlace(body, point); };
  contacts_.resetAnchors(place);
  contacts_.setStart(place, [this](const JointStop& stop) { return q_[stop.coordinate]; });
}

bool BielleWorld::step(double duration) {
  const bool is_done = move(duration);
  q_ = tree_.configuration();
  v_ = tree_.velocity();
  return is_done;
}

bool BielleWorld::move(double duration) {
  const double steps = countSteps(duration, time_step_), h = duration / steps;
  double taken = 0;
  while (taken < steps && !(taken > 0 && isInterrupted())) {
    if (!tree_.drift(taken == 0 ? h / 2 : h)) return fail(tree_.failure());
    if (!kick(h)) return fail("the velocities are no longer finite");
    noteStep(h);
    ++taken;
  }
  const bool is_done = taken == steps;
  time_ += is_done ? duration : taken * h;
  if (!tree_.drift(h / 2)) return fail(tree_.failure());
  reportFeet([this](int body) { return tree_.getPlacement(body); });
  return is_done;
}

// Eqs. (1) and (2)
bool BielleWorld::kick(double h) {
  tree_.updateMassMatrix();
  tree_.updateLoads(tau_, half_last_);
  std::vector<ContactPoint>& points = contacts_.points;
  for (size_t i = 0; i < points.size(); ++i) places_[i] = getPlace(points[i].body, points[i].p);
  com_ = getPlace(pushed_body_, model_.bodies()[pushed_body_].inertia.com);
  dw_.setZero();
  for (int i = 0; i < kMaxNewton; ++i) {
    w_mean_ = tree_.reducedVelocity() + 0.5 * dw_;
    loads_ = tree_.loads();
    damping_.setZero();
    addForces(w_mean_, loads_, &damping_);
    system_ = tree_.massMatrix();
    correction_ = h * loads_;
    correction_.noalias() -= system_ * dw_;
    system_ += 0.5 * h * damping_;
    factors_.compute(system_);
    if (factors_.info() != Eigen::Success) return false;
    factors_.solveInPlace(correction_);
    dw_ += correction_;
    if (correction_.cwiseAbs().maxCoeff() < kNewtonTolerance * (1 + dw_.cwiseAbs().maxCoeff())) break;
  }
  if (!dw_.allFinite()) return false;
  w_mean_ = tree_.reducedVelocity() + 0.5 * dw_;
  loads_.setZero();
  addForces(w_mean_, loads_, nullptr);
  book(h);
  for (size_t i = 0; i < points.size(); ++i) updateAnchor(contacts_.terrain, places_[i], forces_[i], points[i]);
  tree_.kick(dw_);
  half_last_ = 0.5 * dw_;
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
      forces_[i] = calcContactForce(contacts_.terrain, points[i], x, velocity, damping != nullptr);
      if (forces_[i].elastic == 0) continue;
      touches = true;
      wrench.head<3>() += forces_[i].force;
      wrench.tail<3>() += x.cross(forces_[i].force);
      if (!damping) continue;
      const Matrix3d X = skew(x), DX = forces_[i].damping * X;
      D.topLeftCorner<3, 3>() += forces_[i].damping;
      D.topRightCorner<3, 3>() -= DX;
      D.bottomRightCorner<3, 3>() -= X * DX;
    }
    if (!touches) continue;
    addWrench(tip, wrench, loads);
    if (!damping) continue;
    D.bottomLeftCorner<3, 3>() = D.topRightCorner<3, 3>().transpose();
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
    stop_forces_[i] = 0;
    if (q <= stop.upper && q >= stop.lower) continue;
    double v = 0;
    tree_.visitRow(stop.dof, [&](int k, double entry) { v += entry * w[k]; });
    const StopForce force = calcStopForce(stop, q, v);
    stop_forces_[i] = force.force;
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
