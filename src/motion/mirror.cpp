#include "motion/mirror.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// Of lengths over the size of the robot, directions, and masses over its mass: what rounding of numbers in files leaves.
constexpr double kSame = 1e-9;

SE3 reflect(const Vector3d& normal, const Vector3d& point) {
  return {Matrix3d::Identity() - 2 * normal * normal.transpose(), 2 * normal.dot(point) * normal};
}

// Of the inverse map, from Eq. (1): axes of a joint turn the other way in the mirror.
double getAxisSign(JointKind kind, const Vector3d& mirrored, const Vector3d& axis) {
  const double along = mirrored.dot(axis);
  return (along < 0 ? -1 : 1) * (kind == JointKind::Prismatic ? 1 : -1);
}

double calcSize(const std::vector<SE3>& placements) {
  double size = 1e-3;  // m
  for (const SE3& X : placements) size = std::max(size, (X.p - placements[1].p).norm());
  return size;
}

}  // namespace

double MirroredRobot::compare(int i, int j, const SE3& S, const std::vector<SE3>& placements, Partner& partner,
                              std::string& what) const {
  const Joint &a = model_.joints()[i], &b = model_.joints()[j];
  const double size = calcSize(placements);
  double worst = 0;
  const auto add = [&](double off, const char* name, double shown, const char* unit) {
    if (!(off / kSame > worst)) return;
    worst = off / kSame;
    what = std::string(name) + " by " + formatNumber(shown, "%.2g") + unit;
  };
  partner = {j, placements[i].inverse() * S.inverse() * placements[j]};

  const auto addAxis = [&](const Vector3d& axis_a, const Vector3d& axis_b, double& sign) {
    const Vector3d mirrored = S.R * (placements[i].R * axis_a), axis = placements[j].R * axis_b;
    sign = getAxisSign(a.kind, mirrored, axis);
    const double off = mirrored.cross(axis).norm();
    add(off, "its axis", off, " rad");
  };
  Vector3d apart = placements[j].p - S.act(placements[i].p);
  if (a.kind == JointKind::Revolute || a.kind == JointKind::Continuous || a.kind == JointKind::Prismatic)
    addAxis(a.axis, b.axis, partner.sign);
  if (a.kind == JointKind::Universal) {
    addAxis(a.axis, b.axis, partner.sign);
    addAxis(a.axis2, b.axis2, partner.sign2);
  }
  if (a.kind == JointKind::Revolute || a.kind == JointKind::Continuous) {
    const Vector3d axis = placements[j].R * b.axis;
    apart -= apart.dot(axis) * axis;
  }
  if (a.kind != JointKind::Prismatic && a.kind != JointKind::FreeFlyer)
    add(apart.norm() / size, "the place of its joint", apart.norm(), " m");

  const Inertia A = model_.bodies()[i].inertia, B = model_.bodies()[j].inertia;
  add(std::abs(A.mass - B.mass) / model_.mass(), "its mass", std::abs(A.mass - B.mass), " kg");
  const double com = (placements[j].act(B.com) - S.act(placements[i].act(A.com))).norm();
  add(com * A.mass / (size * model_.mass()), "its centre of mass", com, " m");
  const Matrix3d R = S.R * placements[i].R;
  const double turned = (placements[j].R * B.I_com * placements[j].R.transpose() - R * A.I_com * R.transpose()).norm();
  const auto has_motor = [this](int body) {
    return std::any_of(model_.motors().begin(), model_.motors().end(),
                       [body](const Motor& m) { return m.joint == body; });
  };
  add(has_motor(i) == has_motor(j) ? 0 : 1, "its motors", 1, "");
  add(turned / (size * size * model_.mass()), "its moments of inertia", turned, " kg m^2");
  return worst;
}

bool MirroredRobot::pairChildren(int parent, const SE3& S, const std::vector<SE3>& placements, std::string& why) {
  const std::vector<Joint>& joints = model_.joints();
  const int size = model_.numBodies();
  for (int i = parent + 1; i < size; ++i) {
    if (joints[i].parent != parent || partners_[i].body >= 0) continue;
    double nearest = std::numeric_limits<double>::infinity();
    std::string off = "no other body has such a joint";
    for (int j = 1; j < size; ++j) {
      if (joints[j].parent != partners_[parent].body || joints[j].kind != joints[i].kind || partners_[j].body >= 0)
        continue;
      Partner partner;
      std::string what;
      const double far = compare(i, j, S, placements, partner, what);
      if (far >= nearest) continue;
      nearest = far;
      partners_[i] = partner;
      off = (i == j ? "it" : model_.bodies()[j].name) + " differs in " + what;
    }
    if (!(nearest < 1)) {
      why = model_.bodies()[i].name + " has no mirror image: " + off;
      return false;
    }
    const int j = partners_[i].body;
    compare(j, i, S, placements, partners_[j], off);
  }
  return true;
}

std::optional<MirroredRobot> MirroredRobot::find(const Model& model, int left, int right, std::string& why) {
  MirroredRobot mirrored(model);
  if (!model.hasFreeFlyer()) {
    why = "its base is not free";
    return {};
  }
  Workspace ws(model);
  updatePlacements(model, ws, model.makeNeutral());
  std::vector<SE3> placements;
  for (int i = 0; i < model.numBodies(); ++i) placements.push_back(getPlacement(ws, i, SE3()));
  const auto getPlace = [&](int c) { return placements[model.contacts()[c].body].act(model.contacts()[c].X_BF.p); };
  const Vector3d across = getPlace(left) - getPlace(right);
  if (across.norm() < kSame) {
    why = "its feet are in one place";
    return {};
  }
  const SE3 S = reflect(across.normalized(), 0.5 * (getPlace(left) + getPlace(right)));

  mirrored.partners_.resize(model.numBodies());
  mirrored.partners_[0].body = 0;
  for (int parent = 0; parent < model.numBodies(); ++parent)
    if (!mirrored.pairChildren(parent, S, placements, why)) return {};
  for (int i = 1; i < model.numBodies(); ++i)
    if (model.joints()[i].kind == JointKind::Planar || (i > 1 && model.joints()[i].kind == JointKind::FreeFlyer)) {
      why = model.joints()[i].name + " is no joint that is mirrored";
      return {};
    }
  for (const Motor& motor : model.motors()) {
    const int joint = mirrored.partners_[motor.joint].body;
    const auto other = std::find_if(model.motors().begin(), model.motors().end(), [&](const Motor& o) {
      return o.joint == joint && o.dof - model.joints()[joint].idx_v == motor.dof - model.joints()[motor.joint].idx_v;
    });
    if (other == model.motors().end()) {
      why = "no motor is the mirror image of " + motor.name;
      return {};
    }
    mirrored.motors_.push_back(static_cast<int>(other - model.motors().begin()));
  }
  return mirrored;
}

VectorXd MirroredRobot::mapState(const SE3& G, const VectorXd& x) const {
  VectorXd out = x;
  const int nq = model_.nq();
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint &from = model_.joints()[i], &to = model_.joints()[partners_[i].body];
    const Partner& partner = partners_[i];
    const int v = nq + from.idx_v, v_out = nq + to.idx_v;
    const Matrix3d Ct = partner.C.R.transpose();
    switch (from.kind) {
      case JointKind::FreeFlyer: {
        const Eigen::Quaterniond turn(Eigen::Vector4d(x.segment<4>(from.idx_q + 3)));
        const SE3 X = G * SE3(turn.toRotationMatrix(), x.segment<3>(from.idx_q)) * partner.C;
        out.segment<3>(to.idx_q) = X.p;
        out.segment<4>(to.idx_q + 3) = Eigen::Quaterniond(X.R).coeffs();
        const Vector3d w = x.segment<3>(v + 3);
        out.segment<3>(v_out) = Ct * (x.segment<3>(v) + w.cross(partner.C.p));
        out.segment<3>(v_out + 3) = -(Ct * w);
        break;
      }
      case JointKind::Spherical:
        out.segment<3>(to.idx_q) = -(Ct * x.segment<3>(from.idx_q));
        out[to.idx_q + 3] = x[from.idx_q + 3];
        out.segment<3>(v_out) = -(Ct * x.segment<3>(v));
        break;
      case JointKind::Universal:
        out[to.idx_q + 1] = partner.sign2 * x[from.idx_q + 1];
        out[v_out + 1] = partner.sign2 * x[v + 1];
        [[fallthrough]];
      default:
        if (from.nq == 0) break;
        out[to.idx_q] = partner.sign * x[from.idx_q];
        out[v_out] = partner.sign * x[v];
    }
  }
  return out;
}

VectorXd MirroredRobot::mapTorques(const VectorXd& u) const {
  VectorXd out = u;
  for (size_t m = 0; m < motors_.size(); ++m) {
    const Motor& motor = model_.motors()[m];
    const Partner& partner = partners_[motor.joint];
    const bool second = motor.dof > model_.joints()[motor.joint].idx_v;
    out[motors_[m]] = (second ? partner.sign2 : partner.sign) * u[static_cast<Eigen::Index>(m)];
  }
  return out;
}

int MirroredRobot::getContact(int contact) const {
  const ContactFrame& from = model_.contacts()[contact];
  const Partner& partner = partners_[from.body];
  const Vector3d place = partner.C.inverse().act(from.X_BF.p);
  for (size_t c = 0; c < model_.contacts().size(); ++c) {
    const ContactFrame& to = model_.contacts()[c];
    if (to.body == partner.body && (to.X_BF.p - place).norm() < 1e-6 && to.kind == from.kind)
      return static_cast<int>(c);
  }
  return -1;
}

SE3 MirroredRobot::getContactMap(int contact) const {
  const ContactFrame& from = model_.contacts()[contact];
  const ContactFrame& to = model_.contacts()[getContact(contact)];
  return from.X_BF.inverse() * partners_[from.body].C * to.X_BF;
}

}  // namespace bielle
