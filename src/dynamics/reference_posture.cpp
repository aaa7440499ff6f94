// Where a reference of a robot's file puts its base and its feet.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/so3.h"
#include "math/upright.h"

namespace bielle {
namespace {

const ContactFrame& getFoot(const Model& model, const Reference& reference, const std::string& name) {
  const int index = model.findContact(name);
  if (index < 0)
    throw InputError(model.name(), "reference '" + reference.name + "'", "there is no contact '" + name + "'",
                     "name one of the contacts of the file");
  return model.contacts()[index];
}

// Zero for what is only rounding, so that robots that face x do so exactly.
double dropRounding(double angle) { return std::abs(angle) < 1e-9 ? 0 : angle; }

// Angle about the vertical by which points turn to lie as others do, about the middle of each, in the least-squares sense; 0 for
// fewer than two.
double calcTurn(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to) {
  Vector3d middle_from = Vector3d::Zero(), middle_to = Vector3d::Zero();
  for (size_t i = 0; i < from.size(); ++i) {
    middle_from += from[i] / static_cast<double>(from.size());
    middle_to += to[i] / static_cast<double>(to.size());
  }
  double sine = 0, cosine = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    const Vector3d a = from[i] - middle_from, b = to[i] - middle_to;
    sine += a.x() * b.y() - a.y() * b.x();
    cosine += a.x() * b.x() + a.y() * b.y();
  }
  return dropRounding(std::atan2(sine, cosine));
}

// Where the feet of a reference are, and which way those without a yaw of their own face.
class ReferenceFeet {
 public:
  // \param q_ref  preferred configuration, with a base that is not given at the origin
  ReferenceFeet(const Model& model, const Reference& reference, VectorXd q_ref)
      : model_(model), reference_(reference), ws_(model) {
    is_placed_ = !model.hasFreeFlyer() || reference.joints.count(model.joints()[1].name) > 0;
    unbent_ = model.makeNeutral();
    if (model.hasFreeFlyer() && is_placed_) unbent_.head<7>() = q_ref.head<7>();
    if (!is_placed_) {
      upright_ = findUpright(q_ref);
      q_ref.segment<4>(3) = unbent_.segment<4>(3) = Eigen::Quaterniond(upright_).coeffs();
    }
    if (reference.feet.empty()) return;
    lowest_ = std::numeric_limits<double>::infinity();
    for (const auto& [name, place] : reference.feet) {
      middle_ += place / static_cast<double>(reference.feet.size());
      lowest_ = std::min(lowest_, place.z());
    }
    heading_ = is_placed_ ? findHeadingOfBase() : findHeadingOfFeet(q_ref);
  }

  // Whether the base is where the file puts it, or the reference.
  bool is_placed() const { return is_placed_; }
  double lowest() const { return lowest_; }

  // Over the base, in the preferred configuration.
  double calcHeight(const FrameTarget& frame, const VectorXd& q_ref) {
    updatePositions(model_, ws_, q_ref);
    return getPlacement(ws_, frame.body, frame.X_BF).p.z() - q_ref[2];
  }

  double getYaw(const std::string& name) const {
    const auto yaw = reference_.yaws.find(name);
    return yaw == reference_.yaws.end() ? heading_ : yaw->second;
  }

  // Over the middle of the feet, and facing as they do in the mean. Where the base is far beside them, on unbent legs and by the given
  // angles, it is so here; unless a height is given, as high as on unbent legs.
  SE3 findBase(const VectorXd& q_ref) {
    constexpr double kBeside = 0.1;  // of the way to the feet
    const auto isBeside = [](const Vector3d& way) { return way.head<2>().norm() > kBeside * way.norm(); };
    double sine = 0, cosine = 0;
    for (const auto& [name, place] : reference_.feet) {
      sine += std::sin(getYaw(name));
      cosine += std::cos(getYaw(name));
    }
    const Matrix3d turn = makeAxisRotation(Vector3d::UnitZ(), reference_.feet.empty() ? 0 : std::atan2(sine, cosine));
    SE3 base{turn * upright_, {middle_.x(), middle_.y(), lowest_}};
    VectorXd given = q_ref;
    given.head<7>() = unbent_.head<7>();
    const Vector3d way = calcWay(unbent_);
    if (isBeside(way) && isBeside(calcWay(given))) base.p.head<2>() -= (turn * way).head<2>();
    if (reference_.height_frame.empty()) base.p.z() -= way.z();
    return base;
  }
  // The coordinate of the base's place that is the vertical one, or nearest to it.
  int findVertical() const {
    int axis = 0;
    upright_.row(2).cwiseAbs().maxCoeff(&axis);
    return axis;
  }

  // The contact flat at its place. It turns freely about the vertical where the reference gives a joint that turns it so, and no
  // yaw.
  FrameTarget makeTarget(const std::string& name, const Vector3d& place) {
    const ContactFrame& contact = getFoot(model_, reference_, name);
    FrameTarget target = makeFrameTarget(contact, {makeAxisRotation(Vector3d::UnitZ(), getYaw(name)), place});
    if (!reference_.yaws.count(name) && isTurned(contact)) target.mask[5] = false;
    return target;
  }

 private:
  // From the base to the middle of the feet, m (world).
  Vector3d calcWay(const VectorXd& q) {
    Vector3d way = Vector3d::Zero();
    updatePositions(model_, ws_, q);
    for (const auto& [name, place] : reference_.feet) {
      const ContactFrame& contact = getFoot(model_, reference_, name);
      way += getPlacement(ws_, contact.body, contact.X_BF).p / static_cast<double>(reference_.feet.size());
    }
    return way;
  }

  // Axes z and x of the soles, in the mean.
  using Soles = std::pair<Vector3d, Vector3d>;
  Soles findSoles(const VectorXd& q) {
    updatePositions(model_, ws_, q);
    Vector3d up = Vector3d::Zero(), ahead = Vector3d::Zero();
    for (const ContactFrame& contact : model_.contacts()) {
      if (contact.kind == ContactKind::Point3D) continue;
      const Matrix3d R = getPlacement(ws_, contact.body, contact.X_BF).R;
      up += R.col(2);
      ahead += R.col(0);
    }
    return {up, ahead};
  }

  // Attitude of a base that need not have z up and x ahead: that in which its soles on unbent legs have so. By right angles,
  // unless only another one lays them flat by the given angles, too: feet may hang down from unbent legs.
  Matrix3d findUpright(const VectorXd& q_ref) {
    constexpr double kInclined = 0.01;  // rad, of soles by right angles
    constexpr double kFlat = 0.1;       // of that
    constexpr double kBent = 1e-3;      // rad or m
    constexpr double kAlike = 0.1;      // of their axes z in the mean: x axes that cancel face nowhere
    const Soles unbent = findSoles(unbent_), given = findSoles(q_ref);
    const Matrix3d right = findRightAngles(unbent, given);
    if (unbent.first.isZero(0) || (q_ref - unbent_).tail(model_.nq() - 7).isZero(kBent)) return right;
    for (const Soles& soles : {unbent, given})
      if (!(soles.first.cross(soles.second).norm() > kAlike * soles.first.squaredNorm())) return right;
    const Matrix3d R = makeAttitude(unbent), flat = makeAttitude(given);
    const double inclined = log3(right * flat).norm();
    return inclined > kInclined && log3(R.transpose() * flat).norm() < kFlat * inclined ? R.transpose() : right;
  }

  static Matrix3d makeAttitude(const Soles& soles) {
    const Vector3d z = soles.first.normalized(), y = z.cross(soles.second).normalized();
    return (Matrix3d() << y.cross(z), y, z).finished();
  }

  Matrix3d findRightAngles(const Soles& unbent, const Soles& given) const {
    constexpr double kQuarter = 1.57079632679489662;  // turn
    if (unbent.first.isZero(0)) return Matrix3d::Identity();
    Matrix3d upright = findUprightAxes(unbent.first).transpose();
    if (!((upright * given.first).z() > given.first.z())) upright.setIdentity();
    const auto countQuarters = [&](const Vector3d& axis) {
      const Vector3d ahead = upright * axis;
      if (!(ahead.head<2>().norm() > 0.5 * ahead.norm())) return 0.0;
      const double quarters = std::round(std::atan2(ahead.y(), ahead.x()) / kQuarter);
      return quarters == -2 ? 2 : quarters;
    };
    const double quarters = countQuarters(unbent.second);
    if (quarters == 0 || quarters != countQuarters(given.second)) return upright;
    return makeAxisRotation(Vector3d::UnitZ(), -quarters * kQuarter) * upright;
  }

  // That of soles on unbent legs: their axes across stay level as legs bend.
  double findHeadingOfBase() {
    updatePositions(model_, ws_, unbent_);
    Vector3d across = Vector3d::Zero();
    for (const auto& [name, place] : reference_.feet) {
      const ContactFrame& contact = getFoot(model_, reference_, name);
      if (contact.kind != ContactKind::Point3D) across += getPlacement(ws_, contact.body, contact.X_BF).R.col(1);
    }
    const bool is_level = across.head<2>().norm() > 0.5 * across.norm();
    return is_level ? dropRounding(std::atan2(-across.x(), across.y())) : 0;
  }

  // That of a base which brings the feet nearest to their places. Two feet stand across or along the robot: by the line between
  // them, so that small differences of legs turn nothing.
  double findHeadingOfFeet(const VectorXd& q_ref) {
    updatePositions(model_, ws_, q_ref);
    std::vector<Vector3d> from, to;
    for (const auto& [name, place] : reference_.feet) {
      const ContactFrame& contact = getFoot(model_, reference_, name);
      from.push_back(getPlacement(ws_, contact.body, contact.X_BF).p);
      to.push_back(place);
    }
    if (from.size() != 2) return calcTurn(from, to);
    constexpr double kQuarter = 1.57079632679489662;  // turn
    const Vector3d a = from[1] - from[0], b = to[1] - to[0];
    const double along = kQuarter * std::round(std::atan2(a.y(), a.x()) / kQuarter);
    return dropRounding(std::remainder(std::atan2(b.y(), b.x()) - along, 4 * kQuarter));
  }

  // Whether an angle is given of a joint between base and foot that turns about the vertical while the legs are not bent. None turns
  // the foot: it faces ahead.
  bool isTurned(const ContactFrame& contact) {
    constexpr double kUpright = 0.9;  // least cosine between its axis and the vertical
    constexpr double kTurned = 1e-3;  // rad
    updatePositions(model_, ws_, unbent_);
    for (int i = contact.body; i > (model_.hasFreeFlyer() ? 1 : 0); i = model_.joints()[i].parent) {
      const Joint& joint = model_.joints()[i];
      const auto given = reference_.joints.find(joint.name);
      if (given == reference_.joints.end()) continue;
      const std::vector<double>& q = given->second;
      const auto turns = [&](const Vector3d& axis, double angle) {
        return std::abs((ws_.X_WB[i].R * axis).z()) > kUpright && std::abs(angle) > kTurned;
      };
      const bool is_hinge = joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous;
      if ((is_hinge || joint.kind == JointKind::Universal) && turns(joint.axis, q[0])) return true;
      if (joint.kind == JointKind::Universal && turns(joint.axis2, q[1])) return true;
      if (joint.kind == JointKind::Spherical && std::abs(2 * std::atan2(q[2], q[3])) > kTurned) return true;
    }
    return false;
  }

  const Model& model_;
  const Reference& reference_;
  Workspace ws_;
  bool is_placed_ = false;
  VectorXd unbent_;  // neutral but for a base that is given, or upright
  Matrix3d upright_ = Matrix3d::Identity();
  Vector3d middle_ = Vector3d::Zero();
  double lowest_ = 0, heading_ = 0;
};

}  // namespace

AssemblyProblem makeReferenceProblem(const Model& model, const Reference& reference) {
  AssemblyProblem problem;
  problem.q_ref = model.makeNeutral();
  // Listed joints are preferences; the others follow from the closures, with a weight that only settles ties.
  constexpr double kTie = 1e-3;
  problem.weights = VectorXd::Constant(model.nv(), kTie);
  for (const auto& [name, values] : reference.joints) {
    const int index = model.findJoint(name);
    const std::string element = "reference '" + reference.name + "'";
    if (index < 0) throw InputError(model.name(), element, "there is no joint '" + name + "'", "name a moving joint");
    const Joint& joint = model.joints()[index];
    if (static_cast<int>(values.size()) != joint.nq)
      throw InputError(
          model.name(), element,
          "joint '" + name + "' has " + std::to_string(joint.nq) + " values, not " + std::to_string(values.size()),
          "give its q in the order of notation.h");
    problem.q_ref.segment(joint.idx_q, joint.nq) = Eigen::Map<const VectorXd>(values.data(), joint.nq);
    problem.weights.segment(joint.idx_v, joint.nv).setOnes();
  }
  if (model.hasFreeFlyer()) problem.weights.head<6>().setOnes();
  ReferenceFeet feet(model, reference, problem.q_ref);
  if (!feet.is_placed()) {
    const SE3 base = feet.findBase(problem.q_ref);
    problem.q_ref.head<7>() << base.p, Eigen::Quaterniond(base.R).coeffs();
    // Without a height, the legs decide, from unbent ones.
    if (!reference.feet.empty() && reference.height_frame.empty()) problem.weights[feet.findVertical()] = kTie;
  }
  for (const auto& [name, place] : reference.feet) problem.frames.push_back(feet.makeTarget(name, place));
  if (!reference.height_frame.empty()) {
    const int index = model.findFrame(reference.height_frame);
    if (index < 0)
      throw InputError(model.name(), "reference '" + reference.name + "'",
                       "there is no frame '" + reference.height_frame + "'", "name a link or frame");
    FrameTarget target;
    target.name = "height of " + reference.height_frame;
    target.body = model.frames()[index].body;
    target.X_BF = model.frames()[index].X_BF;
    target.X_WT.p.z() = feet.lowest() + reference.height;
    target.mask << false, false, true, false, false, false;
    problem.frames.push_back(target);
    if (model.hasFreeFlyer()) problem.q_ref[2] = target.X_WT.p.z() - feet.calcHeight(target, problem.q_ref);
  }
  return problem;
}

}  // namespace bielle
