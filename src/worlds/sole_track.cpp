#include "worlds/sole_track.h"

namespace bielle::worlds {

SoleTrack::SoleTrack(const Model& model)
    : model_(model),
      reports_(model.contacts().size()),
      wrenches_(reports_.size(), Vector6d::Zero()),
      touchdowns_(reports_.size(), Vector3d::Zero()) {}

void SoleTrack::reset() {
  clearForces();
  for (FootReport& report : reports_) report = {};
}

void SoleTrack::clearForces() {
  for (Vector6d& wrench : wrenches_) wrench.setZero();
}

void SoleTrack::addForce(int contact, const Vector3d& x, const Vector3d& force) {
  wrenches_[contact].head<3>() += force;
  wrenches_[contact].tail<3>() += x.cross(force);
}

void SoleTrack::updateFoot(size_t contact, const SE3& X_WF) {
  FootReport& report = reports_[contact];
  report.wrench = X_WF.actInvForce(wrenches_[contact]);
  const bool touches = !wrenches_[contact].isZero(0);
  if (touches && !report.touches) touchdowns_[contact] = X_WF.p;
  report.touches = touches;
  report.slip = touches ? (X_WF.p - touchdowns_[contact]).head<2>().norm() : 0;
}

}  // namespace bielle::worlds
