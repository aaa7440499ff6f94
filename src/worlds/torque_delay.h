#pragma once
/// \file The time between a measurement and the torques that were computed from it.
#include <random>
#include <vector>

#include "bielle/math/types.h"

namespace bielle::worlds {

struct DelayOptions {
  double delay = 0;   ///< from a measurement until its torques act, s
  double jitter = 0;  ///< each delay differs from it by at most this, evenly distributed, s; not above `delay`
  unsigned seed = 1;
};

/// Torques under way. Those sent last win: torques that are overtaken never act. No function allocates but the
/// constructor.
class TorqueDelay {
 public:
  /// \param nu  size of the torques   \param period  between calls of send(), s
  TorqueDelay(int nu, double period, const DelayOptions& options = {});

  /// Torques (nu) computed from what was measured at `time`. The first ones act at once: the robot has stood under them.
  void send(double time, ConstVectorRef u);
  /// Those that act at `time`, which must not fall from call to call.
  const VectorXd& getTorques(double time);
  const VectorXd& acting() const { return get(0).u; }  ///< as of the last call of torques()
  /// When other torques act next, s; infinity if none are under way.
  double nextChange() const;

 private:
  struct Torques {
    double time = 0;  // when they act
    VectorXd u;
  };
  const Torques& get(size_t age) const { return ring_[(acting_ + age) % ring_.size()]; }

  const DelayOptions options_;
  std::mt19937 generator_;
  std::vector<Torques> ring_;  // from the acting ones to those sent last
  size_t acting_ = 0, under_way_ = 0;
  bool started_ = false;
};

}  // namespace bielle::worlds
