#pragma once
// The nonlinear rollout of trial steps (docs/solver.md, Eqs. 2, 3, 7 and 8).
#include "solve/augmented_lagrangian.h"
#include "solve/lq_sweep.h"

namespace bielle {

/// Data that a rollout reads: the current iterate, its models, the sweep over them and the step they predict.
struct RolloutInput {
  const ShootingProblem& problem;
  const ShootingTrajectory& nodes;
  const NodeEvaluations& evaluations;  ///< it writes those of the trial, or the rolling ones
  const std::vector<StageModel>& models;
  const LqSweep& sweep;
  const AugmentedLagrangian& lagrangian;
  const std::vector<VectorXd>& dx;        ///< N + 1, of the full step
  const std::vector<ControlBox>& bounds;  ///< of u, N or none
  const std::vector<char>& open;          ///< N: whether the gap after a stage counts as open
  Team& team;
  int threads;
};

/// A trial trajectory.
struct Trial {
  double alpha = 1;
  ShootingTrajectory nodes;
  bool ok = false;                  ///< it consists of finite numbers
  double cost = 0;                  ///< J
  double merit = 0;                 ///< J with what constraints add, Eq. (10)
  double gap_sum = 0, gap_max = 0;  ///< c, and its largest entry
  double closing_cost = 0;          ///< Eq. (8)
  int failed_node = -1;             ///< where the problem failed, and why
  std::string failure;

  std::vector<VectorXd> deviations;  ///< N + 1: dx of Eq. (3); where a segment starts, its initial one
};

/// Trials, kept between rollouts.
class Rollout {
 public:
  /// num_trials: number of step lengths tried side by side.
  void resize(const ShootingProblem& problem, int max_segments, int num_trials);
  int numTrials() const { return static_cast<int>(trials_.size()); }

  /// Rolls out a step of length alpha in several segments: getTrial(0).
  void cut(const RolloutInput& input, double alpha, int segments);
  /// Repeats a full step from starts that close the gaps of the last cut() to first order (docs/solver.md, Eq. 9).
  void close(const RolloutInput& input);
  /// Rolls out steps of length alpha, alpha / 2, alpha / 4, ..., each in one piece, one per trial.
  void search(const RolloutInput& input, double alpha, int num);

  Trial& getTrial(int i) { return trials_[i]; }
  /// Whether the trial's evaluations are those of the input's NodeEvaluations: trials side by side do not keep theirs.
  bool hasEvaluations() const { return !rolling_; }
  /// Time of all rollouts since resize(), summed over the threads, and of those of search().
  double getSeconds() const { return seconds_; }
  double getSearchSeconds() const { return search_seconds_; }

 private:
  // Consecutive stages of a trial.
  struct Track {
    Trial* trial = nullptr;
    int begin = 0, end = 0;
    double cost = 0, merit = 0;
    int failed_node = -1;
    std::string failure;
    VectorXd start;    // deviation at its first node
    VectorXd arrival;  // deviation of f of its last stage, if another segment starts there
    VectorXd arrived;  // the state of that deviation
    int rolling = -1;  // the first of its two rolling evaluations; -1: it uses those of the trial
    void fail(int node, const std::string& reason) {
      failed_node = node;
      failure = reason;
    }
  };
  // Tracks processed together, one node of each at a time.
  struct Group {
    int begin = 0, end = 0;  // its tracks
    ProblemScratch* scratch = nullptr;
    std::vector<Track*> active;
    std::vector<EvaluateTask> evaluations;  // of the active ones
    std::vector<DifferenceTask> differences;
    std::vector<IntegrateTask> states;
    std::vector<Track*> moved;  // tracks of the differences or of the states
  };
  void rollOut(const RolloutInput& input, int num_tracks);
  void rollOut(const RolloutInput& input, Group& group);
  void startTracks(const RolloutInput& input, Group& group);
  void evaluateNodes(const RolloutInput& input, int step, Group& group);
  void findDeviations(const RolloutInput& input, Group& group);
  void contractGaps(const RolloutInput& input, Group& group);
  void integrate(const RolloutInput& input, Group& group);
  void updateControl(const RolloutInput& input, int k, Trial& trial) const;
  void updateGaps(const RolloutInput& input, int num_tracks, Trial& trial);
  void addJointGap(const RolloutInput& input, double rest, const Track& before, const Track& after, Trial& trial);
  // Rejects a trial in which the coordinates of what arrives at the end of a segment are those of another state.
  void checkArrivals(const RolloutInput& input, int num_tracks, Trial& trial);
  NodeEvaluation* getEvaluation(const RolloutInput& input, const Track& track, int node) const;

  int N_ = 0;
  std::vector<Trial> trials_;
  std::vector<Track> tracks_;
  std::vector<Group> groups_;
  int num_segments_ = 0;  // of the last cut()
  bool rolling_ = false;
  VectorXd joint_gap_, joint_slope_, shift_, control_;
  std::vector<IntegrateTask> arrivals_;
  double seconds_ = 0, search_seconds_ = 0;
};

}  // namespace bielle
