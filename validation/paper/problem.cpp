#include "paper/problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/math/se3.h"
#include "motion/robot_size.h"

namespace bielle::paper {
namespace {

SE3 getFrame(const NodeView& node, const BodyFrame& frame) { return getPlacement(node.ws, frame.body, frame.X_BF); }

// Velocity of the world point p carried by a spatial world velocity V: v + w x p.
Vector3d calcPointVelocity(const Vector6d& V, const Vector3d& p) { return V.head<3>() + V.tail<3>().cross(p); }

class FlyHigh : public Residual {
 public:
  FlyHigh(const BodyFrame& frame, double slope, double ground) : frame_(frame), slope_(slope), ground_(ground) {}
  int size() const override { return 2; }
  void calc(const NodeView& node, VectorRef r) const override {
    const Vector3d p = getFrame(node, frame_).p;
    r = calcPointVelocity(node.ws.V[frame_.body], p).head<2>() * calcFade(p);
  }
  // With rnea.h Eq. (2), the world velocity of a body changes by dV_k + J_k x V, its point p by J_k acting on p.
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const Vector6d& V = node.ws.V[frame_.body];
    const Vector3d p = getFrame(node, frame_).p, velocity = calcPointVelocity(V, p);
    const double fade = calcFade(p);
    for (int k : node.model.supportDofs(frame_.body)) {
      const Vector6d dV = node.ws.dV.col(k) + crossMotion(node.ws.J.col(k), V);
      const Vector3d dp = calcPointVelocity(node.ws.J.col(k), p);
      const Vector3d dvelocity = calcPointVelocity(dV, p) + Vector3d(V.tail<3>()).cross(dp);
      rows.q.col(k) = fade * (dvelocity.head<2>() - slope_ * dp.z() * velocity.head<2>());
      rows.v.col(k) = fade * dp.head<2>();
    }
  }

 private:
  double calcFade(const Vector3d& p) const { return std::exp(-slope_ * (p.z() - ground_)); }
  BodyFrame frame_;
  double slope_, ground_;
};

class FrameDistance : public Residual {
 public:
  FrameDistance(const BodyFrame& a, const BodyFrame& b) : a_(a), b_(b) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override { r[0] = calcOffset(node).norm(); }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const Eigen::Vector2d offset = calcOffset(node);
    const Eigen::Vector2d direction = offset / std::max(offset.norm(), 1e-9);
    const Vector3d pa = getFrame(node, a_).p, pb = getFrame(node, b_).p;
    for (int body : {a_.body, b_.body})
      for (int k : node.model.supportDofs(body)) rows.q(0, k) = 0;
    for (int k : node.model.supportDofs(a_.body))
      rows.q(0, k) += direction.dot(calcPointVelocity(node.ws.J.col(k), pa).head<2>());
    for (int k : node.model.supportDofs(b_.body))
      rows.q(0, k) -= direction.dot(calcPointVelocity(node.ws.J.col(k), pb).head<2>());
  }

 private:
  Eigen::Vector2d calcOffset(const NodeView& node) const {
    return (getFrame(node, a_).p - getFrame(node, b_).p).head<2>();
  }
  BodyFrame a_, b_;
};

}  // namespace

std::unique_ptr<Residual> makeFlyHigh(const BodyFrame& frame, double slope, double ground) {
  return std::make_unique<FlyHigh>(frame, slope, ground);
}

std::unique_ptr<Residual> makeFrameDistance(const BodyFrame& a, const BodyFrame& b) {
  return std::make_unique<FrameDistance>(a, b);
}

void addLandingCosts(const ContactFrame& foot, const SE3& X_WF, const LandingWeights& weights,
                     const std::string& suffix, StageSpec& stage) {
  const BodyFrame frame{foot.body, foot.X_BF};
  const double h = stage.dt;
  stage.costs.push_back({"landing height" + suffix, weights.height / h, Activation::makeQuadratic(Vector3d::UnitZ()),
                         makeFrameTranslation(frame, X_WF.p)});
  stage.costs.push_back({"landing tilt" + suffix, weights.tilt / h, Activation::makeQuadratic(Vector3d(1, 1, 0)),
                         makeFrameRotation(frame, X_WF.R)});
  stage.costs.push_back({"landing velocity" + suffix, weights.velocity / h, Activation::makeQuadratic(Vector6d::Ones()),
                         makeFrameVelocity(frame)});
}

StageSpec makeRegularizedStage(const Model& model, const VectorXd& q, double state_weight, const VectorXd& weights,
                               double control_weight) {
  StageSpec stage;
  stage.dt = kTimeStep;
  stage.state = {state_weight, q, VectorXd::Zero(model.nv()), weights};
  stage.control = {control_weight, VectorXd::Zero(model.nu()), makeControlWeights(model)};
  stage.effort_limits.setConstant(model.nu(), std::numeric_limits<double>::infinity());
  return stage;
}

void addPhase(const Model& model, const std::string& name, int nodes, const std::vector<ContactTarget>& contacts,
              const VectorXd& q, Motion& motion) {
  motion.schedule.phases.push_back({name, nodes, kTimeStep, contacts});
  const VectorXd u = contacts.empty() ? VectorXd::Zero(model.nu()).eval()
                                      : calcStaticTorques(model, makeConstraintSet(model, contacts), q).u;
  motion.guess.us.insert(motion.guess.us.end(), nodes, u);
}

}  // namespace bielle::paper
