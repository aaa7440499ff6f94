#include "bielle/worlds/bielle_world.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "math/decompositions.h"
#include "worlds/closed_tree.h"
#include "worlds/sole_track.h"

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

  void reset(ConstVectorRef q, ConstVectorRef v) override;
  void setTorques(ConstVectorRef u) override;
  void setPush(const Vector3d& force) override { push_ = force; }
  bool advance(double duration) override;
  const std::string& message() const override { return message_; }
  double time() const override { return time_; }
  const VectorXd& configuration() const override { return tree_.configuration(); }
  const VectorXd& velocity() const override { return tree_.velocity(); }
  const VectorXd& torques() const override { return u_; }
  const std::vector<FootReport>& feet() const override { return soles_.reports(); }
  Books books() const override;
  double gap() const override;

 private:
  // Forces at a velocity: their loads in reduced coordinates, and their damping if a matrix is given.
  void addForces(const VectorXd& w, VectorXd& loads, MatrixXd* damping);
  void addContacts(const VectorXd& w, VectorXd& loads, MatrixXd* damping);
  void addStops(const VectorXd& w, VectorXd& loads, MatrixXd* damping);
  Vector6d calcTwist(int tip, const VectorXd& w) const;
  void addWrench(int tip, const Vector6d& wrench, VectorXd& loads) const;
  bool kick(double h);
  void book(double h);
  double calcElasticEnergy(double* of_stops = nullptr) const;
  bool fail(const std::string& why);

  Model model_;
  const double time_step_;
  const std::atomic<bool>* const interrupt_;
  const int pushed_body_;
  const Terrain terrain_;
  const ConstraintSet loops_;
  ClosedTree tree_;
  std::vector<ContactPoint> points_;
  std::vector<ContactForce> forces_;  // of the last step, per point
  std::vector<Vector3d> places_;      // where they acted, m (world)
  std::vector<JointStop> stops_;
  std::vector<double> stop_forces_;
  SoleTrack soles_;
  VectorXd u_, tau_;                                              // nu, nv
  Vector3d push_ = Vector3d::Zero(), com_ = Vector3d::Zero();     // of the pushed body
  VectorXd w_mean_, dw_, correction_, loads_, half_last_, zero_;  // size
  MatrixXd damping_, system_;                                     // size x size
  Eigen::LLT<MatrixXd> factors_;
  double time_ = 0;
  double motor_work_ = 0, push_work_ = 0, contact_work_ = 0, stop_work_ = 0, joint_work_ = 0;  // on the robot, J
  double elastic_start_ = 0, stops_start_ = 0;
  std::string message_;
  mutable Workspace ws_;  // of books() and gap()
};

BielleWorld::BielleWorld(const Model& model, const BielleWorldOptions& options)
    : model_(model),
      time_step_(options.world.time_step > 0 ? options.world.time_step : kBielleTimeStep),
      interrupt_(options.world.interrupt),
      pushed_body_(options.world.pushed_body),
      terrain_(options.world.ground),
      loops_(makeConstraintSet(model)),
      tree_(model, findPosture(model), listTips(model, options.world.pushed_body)),
      points_(makeContactPoints(model, options.world.ground, options.contact)),
      forces_(points_.size()),
      places_(points_.size(), Vector3d::Zero()),
      stops_(makeJointStops(model)),
      stop_forces_(stops_.size(), 0.0),
      soles_(model),
      factors_(tree_.size()),
      ws_(model) {
  u_.setZero(model.nu());
  tau_.setZero(model.nv());
  for (VectorXd* x : {&w_mean_, &dw_, &correction_, &loads_, &half_last_, &zero_}) x->setZero(tree_.size());
  for (MatrixXd* x : {&damping_, &system_}) x->setZero(tree_.size(), tree_.size());
}

void BielleWorld::reset(ConstVectorRef q, ConstVectorRef v) {
  requireFinite(q, v);
  message_.clear();
  if (!tree_.set(q, v)) message_ = tree_.failure();
  time_ = motor_work_ = push_work_ = contact_work_ = stop_work_ = joint_work_ = 0;
  u_.setZero();
  tau_.setZero();
  push_.setZero();
  half_last_.setZero();
  soles_.reset();
  for (ContactPoint& point : points_) {
    point.touches = false;
    const Vector3d x = tree_.getPlacement(point.body).act(point.p);
    updateAnchor(terrain_, x, ContactForce(), point);
  }
  elastic_start_ = calcElasticEnergy(&stops_start_);
}

void BielleWorld::setTorques(ConstVectorRef u) {
  for (int m = 0; m < model_.nu(); ++m) {
    const Motor& motor = model_.motors()[m];
    u_[m] = motor.clampEffort(u[m], tree_.velocity()[motor.dof]);
  }
  calcMotorForces(model_, u_, tau_);
}

bool BielleWorld::fail(const std::string& why) {
  message_ = why;
  return false;
}

bool BielleWorld::advance(double duration) {
  if (!message_.empty()) return false;
  if (!(duration > 0)) return true;
  const double steps = std::max(1.0, std::ceil(duration / time_step_ - 1e-9));  // maybe more than an integer holds
  const double h = duration / steps;
  double taken = 0;
  while (taken < steps && !(taken > 0 && interrupt_ && *interrupt_)) {
    if (!tree_.drift(taken == 0 ? h / 2 : h)) return fail(tree_.failure());
    if (!kick(h)) return fail("the velocities are no longer finite");
    ++taken;
  }
  const bool is_done = taken == steps;
  time_ += is_done ? duration : taken * h;
  if (!tree_.drift(h / 2)) return fail(tree_.failure());
  soles_.update([this](int body) { return tree_.getPlacement(body); });
  return is_done;
}

// Eqs. (1) and (2)
bool BielleWorld::kick(double h) {
  tree_.updateMassMatrix();
  tree_.updateLoads(tau_, half_last_);
  for (size_t i = 0; i < points_.size(); ++i) places_[i] = tree_.getPlacement(points_[i].body).act(points_[i].p);
  com_ = tree_.getPlacement(pushed_body_).act(model_.bodies()[pushed_body_].inertia.com);
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
  for (size_t i = 0; i < points_.size(); ++i) updateAnchor(terrain_, places_[i], forces_[i], points_[i]);
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
  size_t i = 0;
  for (size_t c = 0; c < model_.contacts().size(); ++c) {
    const int tip = static_cast<int>(c);
    const Vector6d twist = calcTwist(tip, w);
    Vector6d wrench = Vector6d::Zero();
    Matrix6d D = Matrix6d::Zero();
    bool touches = false;
    for (; i < points_.size() && points_[i].contact == tip; ++i) {
      const Vector3d& x = places_[i];
      const Vector3d velocity = twist.head<3>() + twist.tail<3>().cross(x);
      forces_[i] = calcContactForce(terrain_, points_[i], x, velocity, damping != nullptr);
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
  for (size_t i = 0; i < stops_.size(); ++i) {
    const JointStop& stop = stops_[i];
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
  for (int m = 0; m < model_.nu(); ++m) motor_work_ += h * u_[m] * calcRate(model_.motors()[m].dof);
  for (const JointForce& force : model_.jointForces()) {
    const double rate = calcRate(force.dof);
    joint_work_ += h * calcDissipativeForce(force, rate) * rate;
  }
  int tip = static_cast<int>(model_.contacts().size()) + 1;
  for (const PointSpring& spring : model_.pointSprings()) {
    const Vector3d p1 = tree_.getPlacement(spring.body1).act(spring.point1),
                   p2 = tree_.getPlacement(spring.body2).act(spring.point2);
    const Vector6d twist1 = calcTwist(tip, w_mean_), twist2 = calcTwist(tip + 1, w_mean_);
    const auto at = &PointSpringLine<double>::calcVelocityAt;
    const double rate = calcLineDirection<double>(p2 - p1).dot(at(twist2, p2) - at(twist1, p1));
    joint_work_ -= h * spring.damping * rate * rate;
    tip += 2;
  }
  for (size_t i = 0; i < stops_.size(); ++i)
    if (stop_forces_[i] != 0) stop_work_ += h * stop_forces_[i] * calcRate(stops_[i].dof);
  if (!push_.isZero(0)) {
    const Vector6d twist = calcTwist(static_cast<int>(model_.contacts().size()), w_mean_);
    push_work_ += h * push_.dot(Vector3d(twist.head<3>() + twist.tail<3>().cross(com_)));
  }
  soles_.clearForces();
  for (size_t i = 0; i < points_.size(); ++i) {
    if (forces_[i].elastic == 0) continue;
    const Vector6d twist = calcTwist(points_[i].contact, w_mean_);
    const Vector3d& x = places_[i];
    contact_work_ += h * forces_[i].force.dot(Vector3d(twist.head<3>() + twist.tail<3>().cross(x)));
    soles_.addForce(points_[i].contact, x, forces_[i].force);
  }
}

double BielleWorld::calcElasticEnergy(double* of_stops) const {
  double contacts = 0, stops = 0;
  for (const ContactPoint& point : points_)
    contacts +=
        calcContactForce(terrain_, point, tree_.getPlacement(point.body).act(point.p), Vector3d::Zero()).elastic;
  for (const JointStop& stop : stops_) stops += calcStopForce(stop, tree_.configuration()[stop.coordinate], 0).elastic;
  if (of_stops) *of_stops = stops;
  return contacts + stops;
}

Books BielleWorld::books() const {
  updatePositions(model_, ws_, configuration());
  updateVelocities<double>(model_, ws_, velocity());
  Books books;
  books.kinetic = calcKineticEnergy(model_, ws_);
  books.potential = calcPotentialEnergy(model_, ws_);
  double stops = 0;
  books.elastic = calcElasticEnergy(&stops);
  books.motor_work = motor_work_;
  books.push_work = push_work_;
  books.contact_loss = -contact_work_ - (books.elastic - stops - (elastic_start_ - stops_start_));
  books.stop_loss = stops_start_ - stops - stop_work_;
  books.other_loss = -joint_work_;
  return books;
}

double BielleWorld::gap() const {
  updatePlacements<double>(model_, ws_, configuration());
  double gap = 0;
  for (const Closure& closure : model_.closures()) gap = std::max(gap, calcClosureGap(ws_, closure).position);
  return gap;
}

}  // namespace

std::unique_ptr<World> makeBielleWorld(const Model& model, const BielleWorldOptions& options) {
  return std::make_unique<BielleWorld>(model, options);
}

}  // namespace bielle::worlds
