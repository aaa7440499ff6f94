// Rows of contact forces and of the limits of joints and motors.
#include <algorithm>
#include <cmath>

#include "check_rows.h"
#include "math/lanes.h"
#include "math/largest.h"
#include "wrench_cone.h"

namespace bielle::validation {
namespace {

// A load below this share of the weight is replaced by it: ratios of two tiny numbers are meaningless.
constexpr double kLeastLoad = 0.01;

struct ContactForces {
  Worst normal{CheckRow::Kind::AtLeast}, friction, pressure, torsion{CheckRow::Kind::Note},
      cone{CheckRow::Kind::AtLeast}, point, in_air;
};

void addWrench(const ContactFrame& contact, Vector6d wrench, const CheckContext& context, double least_load, int node,
               ContactForces& out) {
  const Vector3d f = wrench.head<3>();
  const double load = getLarger(f.z(), least_load);
  out.normal.add(f.z(), node, contact.name);
  out.friction.add(f.head<2>().norm() / load, node, contact.name);
  if (contact.kind == ContactKind::Point3D) {
    out.point.add(calcLargest(wrench.tail<3>()), node, contact.name);
    return;
  }
  if (contact.kind == ContactKind::Edge5D) {
    out.point.add(std::abs(wrench[3]), node, contact.name);
    wrench[3] = 0;  // what remains is within the cone of a sole without width
  }
  const Vector3d n = wrench.tail<3>();
  const ConeMargin cone = calcConeMargin(wrench, contact.half_length, contact.half_width,
                                         context.motion.summary.ground.friction, least_load);
  out.cone.add(cone.value, node, contact.name + ", " + cone.limit);
  // The centre of pressure is (-n_y, n_x) / f_z; the sole must resist the vertical moment about it by twisting
  // friction.
  const double x = -n.y() / load, y = n.x() / load;
  out.torsion.add(std::abs(n.z() - (x * f.y() - y * f.x())) / load, node, contact.name);
  out.pressure.add(getLarger(std::abs(x) - contact.half_length, std::abs(y) - contact.half_width), node, contact.name);
}

// A wrench in the frame of a contact, in the axes of the ground under a point or an edge, which may tilt on it: those of the
// world, or of the place where an edge stands.
Vector6d turnToGround(const CheckContext& context, int c, int node, const Vector6d& wrench) {
  const ContactFrame& contact = context.model().contacts()[c];
  if (contact.kind == ContactKind::Surface6D) return wrench;
  Matrix3d R = context.trace.nodes[node].feet[c].R;
  if (contact.kind == ContactKind::Edge5D)
    for (const ContactTarget& stance : context.motion.getContacts(context.motion.findPhase(node)))
      if (stance.contact == c) R = stance.X_WT.R.transpose() * R;
  Vector6d out;
  out << R * wrench.head<3>(), R * wrench.tail<3>();
  if (contact.kind == ContactKind::Edge5D) out[3] = wrench[3];  // about itself, wherever it slips to
  return out;
}

// Largest |value| / limit of the motors that have a limit, with both in the note.
class LimitUse {
 public:
  void add(double value, double limit, const std::string& unit, int node, const std::string& name) {
    if (!std::isfinite(limit)) return;
    const double use = std::abs(value) / limit;
    const double size = std::abs(value);
    const int more = size > limit ? countMoreDigits(size, limit) : 0;
    worst_.add(use, node, name + " " + formatNumber(size, more) + " of " + formatNumber(limit, more) + " " + unit);
  }
  const Worst& worst() const { return worst_; }

 private:
  Worst worst_;
};

// Impulses are checked like forces: neither landing feet nor standing ones slip or pull.
void addImpactRows(CheckContext& context) {
  constexpr double kLeastChange = 1e-3;  // m/s, of the robot's speed: smaller impulses are ignored
  const Model& model = context.model();
  ContactForces impulses;
  bool any = false;
  for (int k = 0; k < context.motion.numStages(); ++k) {
    if (!context.motion.isImpact(k)) continue;
    any = true;
    for (int c = 0; c < static_cast<int>(model.contacts().size()); ++c)
      if (const Vector6d& impulse = context.trace.stages[k].impulses[c];
          context.motion.stands(c, k) && !(impulse.head<3>().norm() < kLeastChange * model.mass()))
        addWrench(model.contacts()[c], turnToGround(context, c, k, impulse), context, kLeastChange * model.mass(), k,
                  impulses);
  }
  if (!any) return;
  const std::string nothing = "no impulse changes the robot's speed by 1 mm/s";
  context.add(impulses.normal, "impact: least normal impulse", "N s", 0, nothing);
  context.add(impulses.friction, "impact: tangential over normal", "1", context.motion.summary.ground.friction,
              nothing);
  context.add(impulses.cone, "impact: wrench cone of the sole", "m", context.bounds.wrench_cone, nothing);
}

// c of MotorDrive Eq. (1), by the sign of the power.
double getCurrentFactor(const Motor& motor, double u, double w) {
  return u * w < 0 ? motor.drive.back_efficiency : 1 / motor.drive.efficiency;
}

double getSpeed(const CheckContext& context, int k, const Motor& motor) {
  const MotionRecord& record = context.motion.record;
  return record.has_midpoints ? record.v_mid(k, motor.dof) : record.v(k, motor.dof);
}

// MotorDrive Eq. (1), with the torque and the speed of the same instant.
LimitUse addVoltages(const CheckContext& context) {
  LimitUse use;
  for (int k = 0; k < context.motion.numStages(); ++k) {
    if (context.motion.isImpact(k)) continue;
    for (int m = 0; m < context.model().nu(); ++m) {
      const Motor& motor = context.model().motors()[m];
      const MotorDrive& drive = motor.drive;
      if (!motor.hasEnvelope()) continue;
      const double u = context.motion.record.u(k, m), w = getSpeed(context, k, motor),
                   current = getCurrentFactor(motor, u, w) * u / (drive.ratio * drive.torque_constant);
      use.add(drive.resistance * current + drive.ratio * drive.torque_constant * w, drive.voltage, "V", k, motor.name);
    }
  }
  return use;
}

// Of the motion, were it repeated for ever.
LimitUse addHeat(const CheckContext& context) {
  const MotionRecord& record = context.motion.record;
  const int stages = context.motion.numStages();
  LimitUse use;
  for (int m = 0; m < context.model().nu(); ++m) {
    const Motor& motor = context.model().motors()[m];
    double sum = 0;
    for (int k = 0; k < stages; ++k) {
      const double u = record.u(k, m), c = getCurrentFactor(motor, u, getSpeed(context, k, motor));
      sum += (record.time[k + 1] - record.time[k]) * std::pow(c * u, 2);
    }
    use.add(std::sqrt(sum / (record.time[stages] - record.time[0])), motor.continuous_effort, "N m rms", stages,
            motor.name);
  }
  return use;
}

}  // namespace

void addForceRows(CheckContext& context) {
  const Model& model = context.model();
  const double least_load = std::max(kLeastLoad * model.mass() * model.gravity().norm(), 1e-9);
  ContactForces forces;
  for (int k = 0; k < context.motion.numStages(); ++k) {
    if (context.motion.isImpact(k)) continue;  // no time, no forces
    for (int c = 0; c < static_cast<int>(model.contacts().size()); ++c) {
      const ContactFrame& contact = model.contacts()[c];
      const Vector6d wrench = context.motion.record.contact_wrenches.block<1, 6>(k, 6 * c).transpose();
      if (context.motion.has_happened && !wrench.allFinite()) continue;  // not known
      if (context.motion.stands(c, k))
        addWrench(contact, turnToGround(context, c, k, wrench), context, least_load, k, forces);
      else
        forces.in_air.add(calcLargest(wrench), k, contact.name);
    }
  }
  const std::string nothing = "no foot stands";
  context.add(forces.normal, "contact: least normal force", "N", 0, nothing);
  context.add(forces.friction, "contact: tangential over normal", "1", context.motion.summary.ground.friction, nothing);
  context.add(forces.pressure, "contact: pressure beyond the sole", "m", context.bounds.pressure, "no sole stands");
  context.add(forces.cone, "contact: wrench cone of the sole", "m", context.bounds.wrench_cone, "no sole stands");
  context.add(forces.torsion, "contact: twisting over normal", "m", 0, "no sole stands");
  context.add(forces.point, "contact: moment on a point or about an edge", "N m", context.bounds.point_moment,
              "no point or edge stands");
  context.add(forces.in_air, "contact: force in the air", "N, N m", context.bounds.force_in_air, "no foot swings");
  addImpactRows(context);
}

void addLimitRows(CheckContext& context) {
  const Model& model = context.model();
  const MotionRecord& record = context.motion.record;
  Worst range;
  for (int k = 0; k <= context.motion.numStages(); ++k)
    for (int i = 1; i < model.numBodies(); ++i) {
      const Joint& joint = model.joints()[i];
      if (joint.nq != joint.nv) continue;
      for (int j = 0; j < joint.nv; ++j) {
        const double lower = model.lowerLimits()[joint.idx_v + j], upper = model.upperLimits()[joint.idx_v + j];
        if (!std::isfinite(lower) && !std::isfinite(upper)) continue;
        const double q = record.q(k, joint.idx_q + j);
        range.add(getLarger(lower - q, q - upper), k, record.q_names[joint.idx_q + j]);
      }
    }
  LimitUse effort, velocity;
  for (int k = 0; k <= context.motion.numStages(); ++k)
    for (int m = 0; m < model.nu(); ++m) {
      const Motor& motor = model.motors()[m];
      const bool slides = model.joints()[motor.joint].kind == JointKind::Prismatic;
      if (k < context.motion.numStages())
        effort.add(record.u(k, m), motor.effort_limit, slides ? "N" : "N m", k, motor.name);
      velocity.add(record.v(k, motor.dof), motor.velocity_limit, slides ? "m/s" : "rad/s", k, motor.name);
    }
  const LimitUse voltage = addVoltages(context), heat = addHeat(context);
  LimitUse speed;  // of joints without a motor
  for (int k = 0; k <= context.motion.numStages(); ++k)
    for (int i = 1; i < model.numBodies(); ++i)
      for (int j = 0; j < model.joints()[i].nv; ++j) {
        const int dof = model.joints()[i].idx_v + j;
        if (std::none_of(model.motors().begin(), model.motors().end(), [&](const Motor& m) { return m.dof == dof; }))
          speed.add(record.v(k, dof), model.velocityLimits()[dof], "", k, record.v_names[dof]);
      }
  context.add(range, "joints: beyond their range", "rad, m", context.bounds.range, "no limits given");
  context.add(speed.worst(), "joints: velocity over limit", "1", context.bounds.limit, "no limits given");
  context.add(effort.worst(), "motors: effort over limit", "1", context.bounds.limit, "no limits given");
  context.add(velocity.worst(), "motors: velocity over limit", "1", context.bounds.limit, "no limits given");
  context.add(voltage.worst(), "motors: voltage over supply", "1", context.bounds.limit, "no windings given");
  context.add(heat.worst(), "motors: rms torque over thermal", "1", 1, "no thermal limits given");
}

}  // namespace bielle::validation
