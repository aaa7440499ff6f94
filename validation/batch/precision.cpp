#include "precision.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <utility>

#include "bench/batch_speed.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/model/builder.h"
#include "bielle/worlds/batch.h"
#include "worlds/mujoco_model.h"
#include "worlds/posture_hold.h"

namespace bielle {
namespace {

using worlds::PostureHold;

constexpr double kSample = 0.01, kPushed = 0.05;  // s

// Joints at each sample, a column per world and sample; and the time that the steps took.
struct JointMotion {
  MatrixXd joints;
  double processor = 0, gap = 0;
};

// The robot with its springs, whose forces balance its weight in the posture.
Model makeSprung(const Model& model, ConstVectorRef posture, ConstVectorRef torques) {
  ModelParts parts = takeParts(model);
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[m];
    JointForce force;
    force.joint = motor.joint;
    force.idx_q = model.joints()[motor.joint].idx_q;
    force.dof = motor.dof;
    force.stiffness = PostureHold::kStiffness;
    force.rest = posture[force.idx_q];
    force.preload = torques[m];
    force.damping = PostureHold::kDamping;
    parts.joint_forces.push_back(force);
  }
  return ModelBuilder::restore(std::move(parts));
}

class Task {
 public:
  Task(const Model& model, const PrecisionOptions& options) : Task(model, options, PostureHold(model)) {}
  const Model& model() const { return model_; }
  const VectorXd& posture() const { return posture_; }
  int numSamples() const { return static_cast<int>(std::lround(options_.seconds / kSample)); }
  double calcPush(int sample, int world) const {
    return sample * kSample < kPushed ? options_.push * (1 - world / (2.0 * options_.worlds)) : 0;
  }
  JointMotion makeMotion(int worlds) const {
    return {MatrixXd::Zero(static_cast<Eigen::Index>(coordinates_.size()), worlds * numSamples()), 0, 0};
  }
  void record(ConstVectorRef q, int sample, int world, int worlds, JointMotion& out) const {
    for (size_t i = 0; i < coordinates_.size(); ++i)
      out.joints(static_cast<Eigen::Index>(i), sample * worlds + world) = q[coordinates_[i]];
    out.gap = std::max(out.gap, calcLargestGap(model_, q));
  }

 private:
  Task(const Model& model, const PrecisionOptions& options, const PostureHold& hold)
      : options_(options),
        posture_(hold.posture()),
        model_(makeSprung(model, posture_, hold.calcTorques(posture_, VectorXd::Zero(model.nv())))) {
    for (const Joint& joint : model_.joints())
      if (joint.nv == 1) coordinates_.push_back(joint.idx_q);
  }

  const PrecisionOptions& options_;
  const VectorXd posture_;
  const Model model_;
  std::vector<int> coordinates_;
};

JointMotion runBatch(const Task& task, int count, double h) {
  const Model& model = task.model();
  worlds::WorldBatchOptions options;
  options.world.world.time_step = h;
  options.threads = 1;
  worlds::WorldBatch batch(model, count, options);
  MatrixXd push = MatrixXd::Zero(3, count);
  batch.reset(task.posture().replicate(1, count), MatrixXd::Zero(model.nv(), count));
  JointMotion out = task.makeMotion(count);
  for (int t = 0; t < task.numSamples(); ++t) {
    for (int i = 0; i < count; ++i) push(0, i) = task.calcPush(t, i);
    const double start = readProcessorClock();
    batch.step(MatrixXd::Zero(model.nu(), count), push, kSample);
    out.processor += readProcessorClock() - start;
    for (int i = 0; i < count; ++i) task.record(batch.configurations().col(i), t, i, count, out);
  }
  return out;
}

JointMotion runMujoco(const Task& task, int count, double h, int integrator) {
  const Model& model = task.model();
  MjcfOptions options;
  options.time_step = h;
  MujocoModel mujoco(model, findClosedConfiguration(model).q, options);
  mujoco.get()->opt.integrator = integrator;
  const auto data = mujoco.makeData();
  const int steps = static_cast<int>(std::lround(kSample / h));
  JointMotion out = task.makeMotion(count);
  for (int i = 0; i < count; ++i) {
    VectorXd q = task.posture(), v = VectorXd::Zero(model.nv());
    mj_resetData(mujoco.get(), data.get());
    mujoco.setState(q, v, *data);
    for (int t = 0; t < task.numSamples(); ++t) {
      data->xfrc_applied[6 * mujoco.getBody(1)] = task.calcPush(t, i);
      const double start = readProcessorClock();
      for (int k = 0; k < steps; ++k) mj_step(mujoco.get(), data.get());
      out.processor += readProcessorClock() - start;
      mujoco.getState(*data, q, v);
      task.record(q, t, i, count, out);
    }
  }
  return out;
}

// The largest deviation of a joint from where it is at the first sample.
double calcMove(const JointMotion& motion, int count) {
  const auto samples = motion.joints.cols() / count;
  return (motion.joints - motion.joints.leftCols(count).replicate(1, samples)).cwiseAbs().maxCoeff();
}

// The first worlds alone.
JointMotion selectWorlds(const JointMotion& motion, int count, int first) {
  const auto samples = motion.joints.cols() / count;
  JointMotion out{MatrixXd(motion.joints.rows(), samples * first), 0, 0};
  for (Eigen::Index t = 0; t < samples; ++t)
    out.joints.middleCols(t * first, first) = motion.joints.middleCols(t * count, first);
  return out;
}

// Infinite where one of the two is no number.
double calcError(const JointMotion& motion, const JointMotion& converged) {
  const MatrixXd difference = motion.joints - converged.joints;
  return difference.allFinite() ? difference.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<Precision> measurePrecision(const Model& model, const PrecisionOptions& options) {
  const Task task(model, options);
  std::vector<Precision> out;
  const auto add = [&](const std::string& name, int count, const JointMotion& reference, const auto& run) {
    const JointMotion converged = run(options.finest);
    for (const double h : options.time_steps) {
      Precision row{name, h};
      row.error = row.gap = std::numeric_limits<double>::infinity();
      row.moves = calcMove(converged, count);
      row.apart = reference.joints.size() > 0 ? calcError(converged, reference) : 0;
      try {
        const JointMotion motion = run(h);
        row.error = calcError(motion, converged);
        row.gap = motion.gap;
        row.rate = count * options.seconds / motion.processor;
      } catch (const std::runtime_error& error) {  // MuJoCo, of a motion that diverges
        std::cerr << name << " with steps of " << h << " s: " << error.what() << "\n";
      }
      out.push_back(row);
    }
    return converged;
  };
  const JointMotion many = add("many", options.worlds, {}, [&](double h) { return runBatch(task, options.worlds, h); });
  const JointMotion same = selectWorlds(many, options.worlds, options.mujoco_worlds);
  for (const auto& [name, integrator] :
       {std::pair{"mujoco, Euler", mjINT_EULER}, {"mujoco, implicit", mjINT_IMPLICIT}, {"mujoco, RK4", mjINT_RK4}})
    add(name, options.mujoco_worlds, same,
        [&, i = integrator](double h) { return runMujoco(task, options.mujoco_worlds, h, i); });
  return out;
}

}  // namespace bielle
