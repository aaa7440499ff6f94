#pragma once
// The nonlinear rollout of one trial step (fddp.h, Eqs. 2, 3, 7 and 8).
#include "bielle/solve/fddp.h"

namespace bielle {

/// What a rollout reads: the linearized trajectory, its models, the sweep over them and the step it foresees.
struct RolloutInput {
  ShootingProblem& problem;
  const ShootingTrajectory& nodes;
  const std::vector<StageModel>& models;
  const LqSweep& sweep;
  const std::vector<VectorXd>& dx;        ///< N + 1, of the full step
  const std::vector<ControlBox>& bounds;  ///< of u, N or none
  bool feasible;                          ///< the gaps count as closed
};

/// Length of the step, segments of the horizon, and the threads they are shared by.
struct RolloutOptions {
  double alpha = 1;
  int segments = 1;
  int threads = 1;
};

/// A trial trajectory, kept between rollouts.
class Rollout {
 public:
  void resize(const ShootingProblem& problem, int max_segments);

  /// Returns whether a trial of finite numbers came out.
  bool update(const RolloutInput& input, const RolloutOptions& options);
  /// The same once more, from where the gaps of the last update(), full steps in segments, are closed to first order (fddp.h,
  /// Eq. 9).
  bool close(const RolloutInput& input, const RolloutOptions& options);

  ShootingTrajectory& getTrial() { return trial_; }
  double getCost() const { return cost_; }
  /// c of the trial, and its largest entry.
  double getGapSum() const { return gap_sum_; }
  double getGapMax() const { return gap_max_; }
  /// Eq. (8).
  double getClosingCost() const { return closing_cost_; }
  /// Of all rollouts since resize(), summed over the threads.
  double getSeconds() const { return seconds_; }

 private:
  struct Segment {
    int begin = 0, end = 0;  // its stages
    VectorXd start;          // deviation at its first node
    VectorXd end_state;      // f of its last stage, if another segment follows
    double cost = 0;
  };
  // Segments that go together, one stage of each at a time.
  struct Group {
    int begin = 0, end = 0;  // its segments
    std::vector<StepTask> tasks;
    std::vector<IntegrateTask> starts;
    double seconds = 0;
    bool ok = false;
  };
  bool rollOut(const RolloutInput& input, const RolloutOptions& options);
  bool rollOut(const RolloutInput& input, double alpha, Group& group);
  bool startSegments(const RolloutInput& input, Group& group);
  void prepareTask(const RolloutInput& input, double alpha, int k, Segment& segment, StepTask& task);
  bool finishTask(const RolloutInput& input, double alpha, const StepTask& task, Segment& segment);
  // Whether gaps are left to be contracted at every node.
  static bool contracts(const RolloutInput& input, double alpha) { return alpha < 1 && !input.feasible; }
  // Whether another segment starts at a node, this one having come there.
  bool isJoint(const Segment& segment, int node) const {
    return node == segment.end && node + 1 < static_cast<int>(trial_.xs.size());
  }
  bool updateGaps(const RolloutInput& input, const RolloutOptions& options);

  ShootingTrajectory trial_;
  std::vector<VectorXd> deviations_;  // N + 1: dx of Eq. (3), at a joint the one its segment starts from
  std::vector<Segment> segments_;
  std::vector<Group> groups_;
  VectorXd joint_gap_, joint_slope_, shift_, control_;
  double cost_ = 0, gap_sum_ = 0, gap_max_ = 0, closing_cost_ = 0, seconds_ = 0;
};

}  // namespace bielle
