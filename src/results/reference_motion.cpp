#include "results/reference_motion.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "formats/mjcf_coordinates.h"
#include "model/number_text.h"
#include "results/npz.h"

namespace bielle {
namespace {

constexpr double kSameTime = 1e-9;  // s

// The last stage that has begun at a time, and takes time itself.
Eigen::Index findStage(const VectorXd& time, double at) {
  Eigen::Index stage = 0;
  for (Eigen::Index k = 0; k + 1 < time.size() && time[k] <= at + kSameTime; ++k)
    if (time[k + 1] > time[k]) stage = k;
  return stage;
}

struct FrameState {
  VectorXd q, v;
};

// On the loops.
FrameState interpolateState(const Model& model, Workspace& ws, const ConstraintSet& loops, const MotionRecord& record,
                            Eigen::Index stage, double time) {
  const double h = record.time[stage + 1] - record.time[stage],
               s = std::clamp((time - record.time[stage]) / h, 0.0, 1.0);
  const VectorXd q0 = record.q.row(stage).transpose(), q1 = record.q.row(stage + 1).transpose(),
                 v0 = record.v.row(stage).transpose(), v1 = record.v.row(stage + 1).transpose();
  const VectorXd way = s * s * (3 - 2 * s) * model.difference(q0, q1) + h * s * (1 - s) * ((1 - s) * v0 - s * v1);
  const AssemblyResult closed = closeConfiguration(model, model.integrate(q0, way));
  if (closed.status != NumericalStatus::Ok)
    throw InputError("", "time " + formatNumber(time) + " s",
                     "the loops do not close between the nodes: " + closed.message, "solve with shorter time steps");
  return {closed.q, projectVelocity(model, ws, loops, closed.q, (1 - s) * v0 + s * v1)};
}

// All but a free joint of the first body. \throws InputError for more free joints, which have no names for their coordinates
std::vector<std::string> listMotionJoints(const Model& model) {
  std::vector<std::string> names = listMjcfJoints(model, MjcfRotations::Hinges);
  for (int i = 1; i < model.numBodies(); ++i) {
    if (!isMjcfFree(model.joints()[i])) continue;
    if (model.joints()[i].name != names.front())
      throw InputError(model.name(), "joint '" + model.joints()[i].name + "'",
                       "another body than the first one is free", "give a robot with one base");
    names.erase(names.begin());
  }
  return names;
}

// Angles of hinges in place of balls are known up to whole turns: they go on from those of the frame before.
void continueAngles(const std::vector<bool>& is_of_ball, Eigen::Index k, RowMatrixXd& joint_pos) {
  constexpr double kTurn = 2 * EIGEN_PI;
  for (size_t i = 0; k > 0 && i < is_of_ball.size(); ++i) {
    if (!is_of_ball[i]) continue;
    double& angle = joint_pos(k, static_cast<Eigen::Index>(i));
    angle += kTurn * std::round((joint_pos(k - 1, static_cast<Eigen::Index>(i)) - angle) / kTurn);
  }
}

// Those that are there with hinges alone.
std::vector<bool> findHingesOfBalls(const Model& model, const std::vector<std::string>& names) {
  const std::vector<std::string> with_balls = listMjcfJoints(model, MjcfRotations::Balls);
  const std::set<std::string> others(with_balls.begin(), with_balls.end());
  std::vector<bool> is_of_ball;
  for (const std::string& name : names) is_of_ball.push_back(others.count(name) == 0);
  return is_of_ball;
}

// Of two quaternions for one rotation, it takes the one next to that of the frame before.
void setBodies(const Model& model, const Workspace& ws, const std::vector<int>& bodies, Eigen::Index k,
               ReferenceMotion& motion) {
  for (size_t b = 0; b < bodies.size(); ++b) {
    const Eigen::Index at = static_cast<Eigen::Index>(b);
    const SE3& X_WB = ws.X_WB[bodies[b]];
    const Vector6d twist = calcFrameVelocity(ws, bodies[b], SE3::Identity());  // in its own axes
    const Eigen::Quaterniond quaternion(X_WB.R);
    Eigen::Vector4d wxyz(quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z());
    if (k > 0 && motion.body_quat.row(k - 1).segment<4>(4 * at).dot(wxyz.transpose()) < 0) wxyz = -wxyz;
    motion.body_pos.row(k).segment<3>(3 * at) = X_WB.p.transpose();
    motion.body_quat.row(k).segment<4>(4 * at) = wxyz.transpose();
    motion.body_lin_vel.row(k).segment<3>(3 * at) = (X_WB.R * linear(twist)).transpose();
    const Vector3d& com = model.bodies()[bodies[b]].inertia.com;
    motion.body_com_vel.row(k).segment<3>(3 * at) = (X_WB.R * (linear(twist) + angular(twist).cross(com))).transpose();
    motion.body_ang_vel.row(k).segment<3>(3 * at) = (X_WB.R * angular(twist)).transpose();
  }
}

// frames x columns, or frames x columns / entries x entries.
NpyArray makeArray(const RowMatrixXd& table, size_t entries = 0) {
  const size_t rows = static_cast<size_t>(table.rows()), columns = static_cast<size_t>(table.cols());
  NpyArray array;
  array.shape =
      entries > 0 ? std::vector<size_t>{rows, columns / entries, entries} : std::vector<size_t>{rows, columns};
  array.numbers.assign(table.data(), table.data() + table.size());
  return array;
}

// x, y, z, w from w, x, y, z.
RowMatrixXd moveScalarLast(const RowMatrixXd& quaternions) {
  RowMatrixXd out(quaternions.rows(), quaternions.cols());
  for (Eigen::Index at = 0; at < out.cols(); at += 4) {
    out.middleCols<3>(at) = quaternions.middleCols<3>(at + 1);
    out.col(at + 3) = quaternions.col(at);
  }
  return out;
}

NpyArray makeTexts(const std::vector<std::string>& texts) { return {{texts.size()}, {}, texts, true}; }

}  // namespace

ReferenceMotion makeReferenceMotion(const Model& model, ConstVectorRef q_ref, const MotionRecord& record, double rate) {
  const double duration = record.time[record.time.size() - 1] - record.time[0];
  if (!(duration > 0))
    throw InputError("", "motion", "it takes no time", "give the result of a motion with more than one node");
  ReferenceMotion motion;
  if (record.cycle.size() > 0) {
    const double whole = std::max(1.0, std::round(duration * rate));
    if (std::abs(whole - duration * rate) > 1e-6)
      motion.warnings.push_back("the motion is written at " + formatNumber(whole / duration, "%.6g") +
                                " frames per second, of which its period is " + formatNumber(whole));
    rate = whole / duration;
    motion.cycle = record.cycle;
  }
  const Eigen::Index frames = static_cast<Eigen::Index>(std::floor(duration * rate + 1e-6)) + 1;
  const std::vector<int> bodies = listMjcfBodies(model);
  const Eigen::Index num_bodies = static_cast<Eigen::Index>(bodies.size());
  motion.rate = rate;
  motion.joint_names = listMotionJoints(model);
  for (int body : bodies) motion.body_names.push_back(model.bodies()[body].name);
  motion.motor_names = getNames(model.motors());
  const std::vector<bool> is_of_ball = findHingesOfBalls(model, motion.joint_names);
  const Eigen::Index num_joints = static_cast<Eigen::Index>(motion.joint_names.size());
  for (RowMatrixXd* table : {&motion.joint_pos, &motion.joint_vel}) table->resize(frames, num_joints);
  for (RowMatrixXd* table : {&motion.body_pos, &motion.body_lin_vel, &motion.body_ang_vel, &motion.body_com_vel})
    table->resize(frames, 3 * num_bodies);
  motion.body_quat.resize(frames, 4 * num_bodies);
  motion.motor_torque.resize(frames, model.nu());
  Workspace ws(model);
  const ConstraintSet loops = makeConstraintSet(model);
  VectorXd margins = VectorXd::Ones(model.numBodies());
  for (Eigen::Index k = 0; k < frames; ++k) {
    const double time = record.time[0] + static_cast<double>(k) / rate;
    const Eigen::Index stage = findStage(record.time, time);
    const FrameState state = interpolateState(model, ws, loops, record, stage, time);
    motion.joint_pos.row(k) = calcMjcfQpos(model, q_ref, state.q, MjcfRotations::Hinges).tail(num_joints).transpose();
    motion.joint_vel.row(k) =
        calcMjcfQvel(model, q_ref, state.q, state.v, MjcfRotations::Hinges).tail(num_joints).transpose();
    continueAngles(is_of_ball, k, motion.joint_pos);
    updatePositions(model, ws, state.q);
    updateVelocities<double>(model, ws, state.v);
    setBodies(model, ws, bodies, k, motion);
    motion.motor_torque.row(k) = record.u.row(stage);
    margins = margins.cwiseMin(calcHingeMargins(model, q_ref, state.q));
  }
  for (int i = 1; i < model.numBodies(); ++i)
    if (margins[i] < kLeastHingeMargin)
      motion.warnings.push_back("joint '" + model.joints()[i].name + "': its hinges nearly lock during the motion");
  return motion;
}

std::string formatReferenceMotion(const ReferenceMotion& motion, ReferenceFormat format, int isaac_lab) {
  const bool is_amp = format == ReferenceFormat::Amp, is_isaac = isOfIsaacLab(format);
  NpyArrays arrays;
  if (is_isaac) arrays["isaac_lab"] = {{}, {static_cast<double>(isaac_lab)}, {}, false};
  NpyArray rate;
  rate.numbers = {motion.rate};
  if (!is_amp) rate.shape = {1};  // Isaac Lab wants a number, mjlab writes a list of one
  arrays["fps"] = rate;
  arrays[is_amp ? "dof_names" : "joint_names"] = makeTexts(motion.joint_names);
  arrays["body_names"] = makeTexts(motion.body_names);
  arrays["motor_names"] = makeTexts(motion.motor_names);
  arrays[is_amp ? "dof_positions" : "joint_pos"] = makeArray(motion.joint_pos);
  arrays[is_amp ? "dof_velocities" : "joint_vel"] = makeArray(motion.joint_vel);
  arrays[is_amp ? "body_positions" : "body_pos_w"] = makeArray(motion.body_pos, 3);
  arrays[is_amp ? "body_rotations" : "body_quat_w"] =
      makeArray(is_isaac && isaac_lab >= 3 ? moveScalarLast(motion.body_quat) : motion.body_quat, 4);
  arrays[is_amp ? "body_linear_velocities" : "body_lin_vel_w"] =
      makeArray(is_isaac ? motion.body_com_vel : motion.body_lin_vel, 3);
  arrays[is_amp ? "body_angular_velocities" : "body_ang_vel_w"] = makeArray(motion.body_ang_vel, 3);
  arrays["motor_torque"] = makeArray(motion.motor_torque);
  if (motion.cycle.size() > 0) {
    const Eigen::Vector3d offset = motion.cycle.tail<3>();
    arrays["loop_mode"] = makeTexts({"wrap"});
    arrays["period"].numbers = {motion.cycle[0]};
    arrays["cycle_offset"] = {{3}, {offset.data(), offset.data() + 3}, {}, false};
  }
  return formatArchive(arrays);
}

}  // namespace bielle
