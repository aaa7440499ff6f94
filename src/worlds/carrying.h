#pragma once
/// \file A plan that is being carried out, period by period of control: carryOut(), where others advance the world as well.
#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "worlds/balance.h"
#include "worlds/execution.h"
#include "worlds/motion_recorder.h"

namespace bielle::worlds {

/// The clock beside a world.
class Pace {
 public:
  /// s since the start
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// Keeps the world from running ahead. \returns how far it is behind, s
  double await(double time) const {
    const Clock::time_point due =
        start_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time));
    std::this_thread::sleep_until(due);
    return std::chrono::duration<double>(Clock::now() - due).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// While it is not over: command(), then the world advances by a period of control, then note().
class Carrying {
 public:
  /// As carryOut(), whose arguments must outlive it. Sets the world to where the plan starts.
  Carrying(const Plan& plan, Controller& controller, World& world, const PerceptionOptions& sensors,
           const ExecutionOptions& options);
  Carrying(const Carrying&) = delete;
  Carrying& operator=(const Carrying&) = delete;

  bool isOver() const;
  /// Measures, asks the controller for torques, and pushes.
  void command();
  /// Advances the world by a period, through all changes of the torques that fall into it.
  bool advance();
  /// For a world that others advance: sets the torques of the whole period, where delays are of whole periods.
  void holdTorques();
  /// \param advances  what World::advance() returned
  void note(bool advances, const ExecutionObserver& observer = {});
  Execution finish();

 private:
  Execution describe(double since) const;

  const ExecutionOptions options_;
  const double duration_;  // s, unless it goes on
  Controller& controller_;
  World& world_;
  const int ticks_, most_ticks_, ticks_per_row_;  // of the period of control
  MotionRecorder recorder_;
  Perception perception_;
  TorqueDelay delay_;
  std::optional<FallDetector> detector_;
  std::optional<Balance> balance_;
  Measurement measurement_;
  VectorXd u_;  // nu
  Pace pace_;
  double controlled_ = 0;  // when command() ended, s
  long cut_ = 0;
  int tick_ = 0;
  bool has_broken_ = false, ends_ = false, advances_ = true, is_stopped_ = false, stands_ = false;
  std::string fall_;
};

}  // namespace bielle::worlds
