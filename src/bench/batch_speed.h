#pragma once
/// \file Speed of many worlds at once (worlds/batch.h).
#include "worlds/posture_hold.h"

namespace bielle {

/// What a robot does: stand by springs about a posture while it is pushed for 50 ms, by up to 10 N in the first world, so that
/// worlds differ; or fall, limp, from 5 cm, with random velocities of its trunk of up to 1 m/s and rad/s.
class BatchTask {
 public:
  static constexpr double kTick = 1e-3;  ///< of control, s

  /// \param model  outlives it, has feet
  BatchTask(const Model& model, bool falls);
  const Model& model() const { return model_; }
  VectorXd makeConfiguration() const;
  VectorXd makeVelocity(int world) const;
  VectorXd calcTorques(ConstVectorRef q, ConstVectorRef v) const;
  double calcPush(int tick, int world) const;  ///< along x, N

 private:
  const Model& model_;
  const bool falls_;
  const worlds::PostureHold hold_;
};

/// Of the steps alone, without control.
struct BatchSpeed {
  double steps = 0;                ///< of all worlds
  double processor = 0, wall = 0;  ///< s
  int broken = 0;                  ///< worlds that broke off
  double rounds = 0;               ///< of Newton's method, of a register per step
  double least_height = 1;         ///< of the first body at the end, m
  double gap = 0;                  ///< largest opening of a closure at the end, m
};
/// \param seconds  simulated
BatchSpeed measureBatch(const BatchTask& task, int worlds, double seconds, double time_step, int threads);

double calcLargestGap(const Model& model, ConstVectorRef q);  ///< m
double readProcessorClock();                                  ///< of all threads of the program, s

}  // namespace bielle
