#include "motion/foot_tasks.h"

#include <cmath>

#include "bielle/dynamics/distance.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr double kFree = std::numeric_limits<double>::infinity();
// Violations that count as 1, of the reference robot.
constexpr double kPosition = 0.01, kAngle = 0.1, kVelocity = 0.1;  // m, rad, m/s and rad/s

// Makes the first rows zero and leaves the others free.
PathConstraint makeEquation(const std::string& name, std::shared_ptr<const Residual> residual, int rows,
                            const VectorXd& scale) {
  VectorXd bound = VectorXd::Constant(scale.size(), kFree);
  bound.head(rows).setZero();
  return {name, std::move(residual), -bound, bound, scale};
}

Shape makeSoleCapsule(const ContactFrame& contact) {
  const bool along_x = contact.half_length >= contact.half_width;
  const Vector3d half = along_x ? Vector3d(contact.half_length, 0, 0) : Vector3d(0, contact.half_width, 0);
  return makeCapsule(contact.body, contact.X_BF.act(-half), contact.X_BF.act(half),
                     std::min(contact.half_length, contact.half_width));
}

BodyFrame getFrame(const ContactFrame& contact) { return {contact.body, contact.X_BF}; }

// z up, x where that of a foothold, or of the base, lies seen from above. Rows in these axes are violated as much whichever way the
// robot faces, and so the solver goes the same way.
Matrix3d makeLevelAxes(const Matrix3d& R) {
  constexpr double kRounding = 1e-9;  // rad: what faces x does so exactly
  const double heading = std::atan2(R(1, 0), R(0, 0));
  return makeAxisRotation(Vector3d::UnitZ(), std::abs(heading) < kRounding ? 0 : heading);
}

FootTask& getTask(int contact, FootRole role, StageSpec& stage) {
  for (FootTask& foot : stage.feet)
    if (foot.contact == contact && foot.role == role) return foot;
  stage.feet.push_back({contact, role});
  return stage.feet.back();
}

}  // namespace

void addSwing(const Model& model, int contact, const SE3& X_WF, const Vector6d& weights, StageSpec& stage) {
  if (weights.isZero(0)) return;
  const ContactFrame& foot = model.contacts()[contact];
  stage.costs.push_back(
      {"swing " + foot.name, 1, Activation::makeQuadratic(weights), makeFramePlacement(getFrame(foot), X_WF)});
  getTask(contact, FootRole::Swing, stage).place = stage.costs.back().residual;
}

void addSwingVelocity(const Model& model, int contact, const Vector6d& V_F, const Vector6d& weights, StageSpec& stage) {
  if (weights.isZero(0)) return;
  const ContactFrame& foot = model.contacts()[contact];
  stage.costs.push_back({"swing velocity " + foot.name, 1, Activation::makeQuadratic(weights),
                         makeFrameVelocity(getFrame(foot), V_F), true});
  getTask(contact, FootRole::Swing, stage).velocity = stage.costs.back().residual;
}

LandingRegion findLandingRegion(const ContactFrame& foot, const SE3& X_WF, double room, const Ground& ground) {
  constexpr double kLevel = 1e-3, kBeyond = 1e-6;  // m
  constexpr double kRightAngle = 1.57079632679489662;
  LandingRegion region{Eigen::Vector2d::Constant(-room), Eigen::Vector2d::Constant(room), room};
  for (const GroundStep& step : ground.steps) {
    const double height = step.calcHeight(X_WF.p.x(), X_WF.p.y());
    if (!step.covers(X_WF.p.x(), X_WF.p.y()) || std::abs(height - X_WF.p.z()) > kLevel) continue;
    for (int i = 0; i < 4; ++i) {
      const double angle = step.yaw + i * kRightAngle;
      const Eigen::Vector2d out(std::cos(angle), std::sin(angle));  // of one side
      const double side = out.dot(step.top.head<2>()) + (i % 2 == 0 ? step.length : step.width) / 2;
      Eigen::Vector2d outmost = X_WF.p.head<2>();
      for (double x : {-foot.half_length, foot.half_length})
        for (double y : {-foot.half_width, foot.half_width}) {
          const Eigen::Vector2d corner = X_WF.act(Vector3d(x, y, 0)).head<2>();
          if (out.dot(corner) > out.dot(outmost)) outmost = corner;
        }
      const double left = std::max(0.0, side - out.dot(outmost));
      const Eigen::Vector2d beyond = outmost + (left + kBeyond) * out;
      if (std::abs(ground.calcHeight(beyond.x(), beyond.y()) - step.calcHeight(beyond.x(), beyond.y())) < kLevel)
        continue;  // the ground goes on
      const Eigen::Vector2d axes(out.dot(X_WF.R.col(0).head<2>()), out.dot(X_WF.R.col(1).head<2>()));
      const double most = left / 2 / axes.lpNorm<1>();
      for (int k = 0; k < 2; ++k) {
        if (axes[k] > kBeyond) region.upper[k] = std::min(region.upper[k], most);
        if (axes[k] < -kBeyond) region.lower[k] = std::max(region.lower[k], -most);
      }
      region.turn = std::min(region.turn, left / 2);
    }
  }
  return region;
}

void addLanding(const Model& model, const RobotSize& size, int contact, const SE3& X_WF, const LandingRegion& region,
                double speed, StageSpec& stage) {
  const ContactFrame& foot = model.contacts()[contact];
  const BodyFrame frame = getFrame(foot);
  const bool point = foot.kind == ContactKind::Point3D, edge = foot.kind == ContactKind::Edge5D;
  const Vector3d position = Vector3d::Constant(kPosition * size.length), angle = Vector3d::Constant(kAngle);
  const Matrix3d axes = makeLevelAxes(X_WF.R);
  PathConstraint place = point ? makeEquation("landing of " + foot.name,
                                              makeTurned(makeFrameTranslation(frame, X_WF.p), axes), 3, position)
                               : makeEquation("landing of " + foot.name, makeFramePlacement(frame, X_WF), 6,
                                              (Vector6d() << position, angle).finished());
  const double reach = std::hypot(foot.half_length, foot.half_width);
  if (!point && reach > 0) place.upper[5] = region.turn / reach;
  if (edge) place.upper[3] = kFree;  // it rolls
  place.lower = -place.upper;
  place.upper.head<2>() = region.upper;
  place.lower.head<2>() = region.lower;
  Vector6d rates;
  rates << Vector3d::Constant(kVelocity * size.velocity()), Vector3d::Constant(kVelocity / size.time);
  PathConstraint velocity = makeEquation("landing velocity of " + foot.name, makeTurned(makeFrameVelocity(frame), axes),
                                         point ? 3 : 6, rates);
  velocity.lower.head<3>().setConstant(-speed);
  velocity.upper.head<3>() << speed, speed, -speed;
  if (edge) {
    velocity.upper[3] = kFree;
    velocity.lower[3] = -kFree;
  }
  const double room = std::max(region.upper.maxCoeff(), -region.lower.minCoeff());
  stage.feet.push_back({contact, FootRole::Landing, room, place.residual, velocity.residual});
  stage.path_constraints.push_back(std::move(place));
  stage.path_constraints.push_back(std::move(velocity));
}

double getLandingRoom(int contact, const StageSpec& stage) {
  for (const FootTask& foot : stage.feet)
    if (foot.contact == contact && foot.role == FootRole::Landing) return foot.room;
  return kFree;
}

void addClearance(const Model& model, const RobotSize& size, int contact, const Ground& ground, double ramp,
                  double least, StageSpec& stage) {
  const ContactFrame& foot = model.contacts()[contact];
  std::shared_ptr<const Residual> residual =
      makeSoleClearance(getFrame(foot), foot.half_length, foot.half_width, ground, ramp);
  const int n = residual->size();
  stage.path_constraints.push_back({"clearance of " + foot.name, residual, VectorXd::Constant(n, least),
                                    VectorXd::Constant(n, kFree), VectorXd::Constant(n, kPosition * size.length)});
  getTask(contact, FootRole::Swing, stage).clearance = residual;
}

void lowerFoot(const Model& model, int contact, double speed, StageSpec& stage) {
  Vector6d down = Vector6d::Zero();
  down[2] = -speed;
  for (FootTask& foot : stage.feet) {
    if (foot.contact != contact) continue;
    for (PathConstraint& constraint : stage.path_constraints) {
      if (constraint.residual == foot.clearance) constraint.lower.setConstant(-kFree);
      if (constraint.residual == foot.place) {
        constraint.lower[2] = -kFree;
        constraint.upper[2] = kFree;
      }
      if (constraint.residual == foot.velocity) constraint.lower[2] = constraint.upper[2] = -speed;
    }
    for (Cost& cost : stage.costs) {
      if (cost.residual == foot.place) cost.activation.weights[2] = 0;
      if (cost.residual == foot.velocity)
        cost.residual = foot.velocity = makeFrameVelocity(getFrame(model.contacts()[contact]), down);
    }
  }
}

double chooseRamp(const Model& model, const Ground& ground, const std::vector<ContactTarget>& soles) {
  constexpr double kWidest = 0.02, kLeast = 1e-3;  // m
  double room = kWidest;
  for (const ContactTarget& sole : soles) {
    const ContactFrame& contact = model.contacts()[sole.contact];
    for (double x : {-contact.half_length, contact.half_length})
      for (double y : {-contact.half_width, contact.half_width}) {
        const Vector3d corner = sole.X_WT.act(Vector3d(x, y, 0));
        for (const GroundStep& step : ground.steps)
          if (step.top.z() > corner.z() + kLeast) room = std::min(room, step.calcDistance(corner.x(), corner.y()));
      }
  }
  return std::max(kLeast, room);
}

void addDistance(const RobotSize& size, const ContactFrame& swinging, const SE3& X_path, const ContactFrame& standing,
                 const SE3& X_standing, double least, StageSpec& stage) {
  constexpr double kTracking = 0.01;  // of the reference robot, m
  for (const ContactFrame* contact : {&swinging, &standing})
    if (contact->half_length == 0) return;
  const Shape a = makeSoleCapsule(swinging), b = makeSoleCapsule(standing);
  const double of_path =
      calcDistance(a, X_path * swinging.X_BF.inverse(), b, X_standing * standing.X_BF.inverse()).distance;
  stage.path_constraints.push_back({"distance of " + swinging.name + " and " + standing.name, makeShapeDistance(a, b),
                                    VectorXd::Constant(1, std::min(least, of_path - kTracking * size.length)),
                                    VectorXd::Constant(1, kFree), VectorXd::Constant(1, kPosition * size.length)});
}

void addRest(const Model& model, const RobotSize& size, StageSpec& terminal) {
  std::vector<PathConstraint>& constraints = terminal.path_constraints;
  const bool flies = model.hasFreeFlyer(), is_planar = hasPlanarBase(model);
  Vector3d bound(flies ? 0 : kFree, flies ? 0 : kFree, 0);
  if (is_planar)  // along the axes of the world that are in its plane
    bound = model.joints()[1].axis.cwiseAbs().unaryExpr([](double x) { return x > 0.5 ? kFree : 0.0; });
  const Matrix3d axes =
      flies ? makeLevelAxes(Eigen::Quaterniond(Eigen::Vector4d(terminal.state.q_ref.segment<4>(3))).toRotationMatrix())
            : Matrix3d::Identity();
  constraints.push_back({"rest of the centre of mass at the end", makeTurned(makeComVelocity(Vector3d::Zero()), axes),
                         -bound, bound, Vector3d::Constant(kVelocity * size.velocity())});
  if (flies)
    constraints.push_back(makeEquation("rest of the torso at the end", makeJointVelocity({3, 4, 5}), 3,
                                       Vector3d::Constant(kVelocity / size.time)));
  if (is_planar)
    constraints.push_back(makeEquation("rest of the torso at the end", makeJointVelocity({2}), 1,
                                       VectorXd::Constant(1, kVelocity / size.time)));
}

}  // namespace bielle
