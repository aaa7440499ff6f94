#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/so3.h"
#include "ocp/residual_data.h"

namespace bielle {
namespace {

SE3 getPlacement(const NodeView& node, const BodyFrame& frame) {
  return bielle::getPlacement(node.ws, frame.body, frame.X_BF);
}

// Velocity of the world point p carried by a spatial world velocity V: v + w x p.
Vector3d calcPointVelocity(const Vector6d& V, const Vector3d& p) { return V.head<3>() + V.tail<3>().cross(p); }

class FramePlacement : public DescribedResidual {
 public:
  FramePlacement(const BodyFrame& frame, const SE3& X_WT) : frame_(frame), X_WT_(X_WT) {}
  int size() const override { return 6; }
  void calc(const NodeView& node, VectorRef r) const override {
    r = log6(X_WT_.inverseTimes(getPlacement(node, frame_)));
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const SE3 X_WF = getPlacement(node, frame_);
    const Matrix6d dlog = calcLogJacobian6(X_WT_.inverseTimes(X_WF));
    for (int k : node.model.supportDofs(frame_.body)) rows.q.col(k) = dlog * X_WF.actInvMotion(node.ws.J.col(k));
  }
  ResidualData describe() const override {
    ResidualData data{"frame_placement", {{"body", frame_.body}}};
    addPlacement("_BF", frame_.X_BF, data);
    addPlacement("_WT", X_WT_, data);
    return data;
  }

 private:
  BodyFrame frame_;
  SE3 X_WT_;
};

class FrameTranslation : public DescribedResidual {
 public:
  FrameTranslation(const BodyFrame& frame, const Vector3d& reference) : frame_(frame), reference_(reference) {}
  int size() const override { return 3; }
  void calc(const NodeView& node, VectorRef r) const override { r = getPlacement(node, frame_).p - reference_; }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const Vector3d p = getPlacement(node, frame_).p;
    for (int k : node.model.supportDofs(frame_.body)) rows.q.col(k) = calcPointVelocity(node.ws.J.col(k), p);
  }
  ResidualData describe() const override {
    return {"frame_translation",
            {{"body", frame_.body}, {"p_BF", VectorXd(frame_.X_BF.p)}, {"reference", VectorXd(reference_)}}};
  }

 private:
  BodyFrame frame_;
  Vector3d reference_;
};

class FrameRotation : public DescribedResidual {
 public:
  FrameRotation(const BodyFrame& frame, const Matrix3d& R_WT) : frame_(frame), R_WT_(R_WT) {}
  int size() const override { return 3; }
  void calc(const NodeView& node, VectorRef r) const override {
    r = log3(R_WT_.transpose() * getPlacement(node, frame_).R);
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const Matrix3d R = getPlacement(node, frame_).R;
    const Matrix3d dlog = calcRightJacobianInverse3(log3(R_WT_.transpose() * R)) * R.transpose();
    for (int k : node.model.supportDofs(frame_.body)) rows.q.col(k) = dlog * node.ws.J.col(k).tail<3>();
  }
  ResidualData describe() const override {
    return {"frame_rotation", {{"body", frame_.body}, {"R_BF", MatrixXd(frame_.X_BF.R)}, {"R_WT", MatrixXd(R_WT_)}}};
  }

 private:
  BodyFrame frame_;
  Matrix3d R_WT_;
};

// With rnea.h Eq. (2), the world velocity of body i changes by dV_k + J_k x V_i, its point p by J_k acting on p.
Vector6d calcVelocityDerivative(const NodeView& node, int body, int k) {
  return node.ws.dV.col(k) + crossMotion(node.ws.J.col(k), node.ws.V[body]);
}

class FrameVelocity : public DescribedResidual {
 public:
  FrameVelocity(const BodyFrame& frame, const Vector6d& reference) : frame_(frame), reference_(reference) {}
  int size() const override { return 6; }
  void calc(const NodeView& node, VectorRef r) const override {
    const Vector6d& V = node.ws.V[frame_.body];
    r.head<3>() = calcPointVelocity(V, getPlacement(node, frame_).p);
    r.tail<3>() = V.tail<3>();
    r -= reference_ / node.time_scale;
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const Vector3d p = getPlacement(node, frame_).p, w = node.ws.V[frame_.body].tail<3>();
    for (int k : node.model.supportDofs(frame_.body)) {
      const Vector6d J = node.ws.J.col(k), dV = calcVelocityDerivative(node, frame_.body, k);
      rows.q.col(k).head<3>() = calcPointVelocity(dV, p) + w.cross(calcPointVelocity(J, p));
      rows.q.col(k).tail<3>() = dV.tail<3>();
      rows.v.col(k).head<3>() = calcPointVelocity(J, p);
      rows.v.col(k).tail<3>() = J.tail<3>();
    }
    rows.s = reference_ / (node.time_scale * node.time_scale);
  }
  ResidualData describe() const override {
    return {"frame_velocity",
            {{"body", frame_.body}, {"p_BF", VectorXd(frame_.X_BF.p)}, {"reference", VectorXd(reference_)}}};
  }

 private:
  BodyFrame frame_;
  Vector6d reference_;
};

}  // namespace

BodyFrame getBodyFrame(const Model& model, const std::string& name) {
  if (const int contact = model.findContact(name); contact >= 0)
    return {model.contacts()[contact].body, model.contacts()[contact].X_BF};
  if (const int frame = model.findFrame(name); frame >= 0)
    return {model.frames()[frame].body, model.frames()[frame].X_BF};
  throw InputError(model.name(), "frame '" + name + "'", "the robot has no such link, frame or contact",
                   "see `bielle info` for its names");
}

std::unique_ptr<Residual> makeFramePlacement(const BodyFrame& frame, const SE3& X_WT) {
  return std::make_unique<FramePlacement>(frame, X_WT);
}
std::unique_ptr<Residual> makeFrameTranslation(const BodyFrame& frame, const Vector3d& reference) {
  return std::make_unique<FrameTranslation>(frame, reference);
}
std::unique_ptr<Residual> makeFrameRotation(const BodyFrame& frame, const Matrix3d& R_WT) {
  return std::make_unique<FrameRotation>(frame, R_WT);
}
std::unique_ptr<Residual> makeFrameVelocity(const BodyFrame& frame, const Vector6d& reference) {
  return std::make_unique<FrameVelocity>(frame, reference);
}

}  // namespace bielle
