#include "bielle/worlds/world.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/largest_gaps.h"

namespace bielle::worlds {

World::World(const Model& model, const WorldOptions& options)
    : model_(model),
      ground_(options.ground),
      pushed_body_(options.pushed_body),
      q_(model.makeNeutral()),
      v_(VectorXd::Zero(model.nv())),
      u_(VectorXd::Zero(model.nu())),
      ws_(model),
      interrupt_(options.interrupt),
      feet_(model.contacts().size()),
      wrenches_(feet_.size(), Vector6d::Zero()),
      touchdowns_(feet_.size(), Vector3d::Zero()) {
  message_ = "it has not been reset";
  if (!options.wear.plays.empty()) throw std::logic_error("a world of a robot with play is made by makePlayWorld()");
}

void World::reset(ConstVectorRef q, ConstVectorRef v) {
  if (!q.allFinite() || !v.allFinite())
    throw std::invalid_argument(
        "world: the state has a number that is not finite; give a closed configuration and a velocity");
  message_.clear();
  integration_.shortest_step = integration_.longest_step = 0;
  time_ = 0;
  work_ = {};
  q_ = q;
  v_ = v;
  u_.setZero();
  push_.setZero();
  clearFootForces();
  for (FootReport& foot : feet_) foot = {};
  start();
}

void World::setTorques(ConstVectorRef u) {
  for (int m = 0; m < model_.nu(); ++m) {
    const Motor& motor = model_.motors()[m];
    u_[m] = motor.clampEffort(u[m], v_[motor.dof]);
  }
  noteForces();
}

void World::setPush(const Vector3d& force) {
  if (force == push_) return;
  push_ = force;
  noteForces();
}

bool World::advance(double duration) {
  if (!message_.empty()) return false;
  return !(duration > 0) || step(duration);
}

bool World::fail(const std::string& why) {
  message_ = why;
  return false;
}

void World::noteStep(double h) {
  integration_.longest_step = std::max(integration_.longest_step, h);
  const double shortest = integration_.shortest_step;
  integration_.shortest_step = shortest > 0 ? std::min(shortest, h) : h;
}

double World::countSteps(double duration, double time_step) {
  return std::max(1.0, std::ceil(duration / time_step - 1e-9));
}

// Eq. (1), but for the energy that springs of contacts and stops hold.
Books World::books() const {
  updatePositions(model_, ws_, q_);
  updateVelocities(model_, ws_, v_);
  Books books;
  books.kinetic = calcKineticEnergy(model_, ws_);
  books.potential = calcPotentialEnergy(model_, ws_);
  books.motor_work = work_.motor;
  books.push_work = work_.push;
  books.contact_loss = -work_.contact;
  books.stop_loss = -work_.stop;
  books.other_loss = -work_.joint;
  return books;
}

double World::gap() const {
  updatePlacements(model_, ws_, q_);
  return calcLargestGaps(model_, ws_).position;
}

void World::clearFootForces() {
  for (Vector6d& wrench : wrenches_) wrench.setZero();
}

void World::addFootForce(int contact, const Vector3d& x, const Vector3d& force) {
  wrenches_[contact].head<3>() += force;
  wrenches_[contact].tail<3>() += x.cross(force);
}

void World::setFootWrench(int contact, const Vector6d& wrench) { wrenches_[contact] = wrench; }

void World::reportFoot(size_t contact, const SE3& X_WF) {
  FootReport& foot = feet_[contact];
  foot.X_WF = X_WF;
  foot.wrench = X_WF.actInvForce(wrenches_[contact]);
  const bool touches = !wrenches_[contact].isZero(0);
  if (touches && !foot.touches) touchdowns_[contact] = X_WF.p;
  foot.touches = touches;
  foot.slip = touches ? (X_WF.p - touchdowns_[contact]).head<2>().norm() : 0;
}

}  // namespace bielle::worlds
