#pragma once
/// \file Speed of many worlds at once (worlds/batch.h).
#include <optional>

#include "bielle/control/policy.h"
#include "worlds/posture_hold.h"

namespace bielle {

/// Stand: by springs about a posture. Walk: at 0.4 m/s, by the torques and the gains of a plan, each world from another of its
/// instants on, so that some stand on both feet while others swing one or land. Both are pushed for 50 ms, by up to 10 N in the first
/// world, so that worlds differ. Fall: limp, from 5 cm, with random velocities of the trunk of up to 1 m/s and rad/s.
enum class BatchMotion { Stand, Walk, Fall };
const char* getName(BatchMotion motion);

/// What a robot does.
class BatchTask {
 public:
  static constexpr double kTick = 1e-3;  ///< of control, s

  /// \param model  outlives it, has feet \throws InputError when its walk cannot be planned
  BatchTask(const Model& model, BatchMotion motion);
  const Model& model() const { return model_; }
  VectorXd makeConfiguration(int world) const;
  VectorXd makeVelocity(int world) const;
  VectorXd calcTorques(int tick, int world, ConstVectorRef q, ConstVectorRef v);
  double calcPush(int tick, int world) const;  ///< along x, N
  /// Of a configuration from that of the plan, or where it began to stand: the farthest coordinate, rad or m.
  double calcDeviation(int tick, int world, ConstVectorRef q) const;

 private:
  const Policy::Stage& getStart(int world) const;

  const Model& model_;
  const BatchMotion motion_;
  const worlds::PostureHold hold_;
  std::optional<Policy> policy_;  // of a walk
  Measurement measured_;
};

/// Of the steps alone, without control.
struct BatchSpeed {
  double steps = 0;                ///< of all worlds
  double processor = 0, wall = 0;  ///< s
  int broken = 0;                  ///< worlds that broke off
  double rounds = 0;               ///< of Newton's method, of a register per step
  double least_height = 1;         ///< of the first body at the end, m
  double gap = 0;                  ///< largest opening of a closure at the end, m
  double deviation = 0;            ///< BatchTask::calcDeviation() at the end, the largest
};
/// \param seconds  simulated
BatchSpeed measureBatch(BatchTask& task, int worlds, double seconds, double time_step, int threads);

double calcLargestGap(const Model& model, ConstVectorRef q);  ///< m
double readProcessorClock();                                  ///< of all threads of the program, s

}  // namespace bielle
