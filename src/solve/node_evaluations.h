#pragma once
// The evaluations of a problem's nodes that a solver keeps, and the scratch memory of the problem's functions.
#include <algorithm>

#include "solve/receding.h"
#include "solve/team.h"

namespace bielle {

using EvaluationList = std::vector<std::unique_ptr<NodeEvaluation>>;

class NodeEvaluations {
 public:
  /// Creates any missing memory: two sets of N + 1 evaluations, `num_rolling` single ones, scratch for each thread.
  /// That of another problem is dropped. The evaluations of the iterate become outdated, unless move() kept them.
  void resize(const ShootingProblem& problem, int num_rolling, int threads);

  /// Evaluates the outdated nodes of the current iterate from a first one on, in batches shared among the team. Returns the first
  /// of them whose status is not Ok, or -1.
  /// \throws std::invalid_argument when a node that is not outdated has another state or control
  int update(const ShootingProblem& problem, const ShootingTrajectory& nodes, int first, Team& team, int threads);
  /// Marks all evaluations of the iterate as outdated.
  void outdate() { std::fill(fresh_.begin(), fresh_.end(), false); }
  /// Nodes that are the same as others of the last window keep their evaluations, the others become outdated.
  /// \throws std::invalid_argument as Receding::move() does
  void move(const std::vector<NodeSource>& sources);

  /// Exchanges the evaluation of a node, which becomes outdated, for other memory.
  void exchange(size_t node, std::unique_ptr<NodeEvaluation>& other);

  /// N + 1 each: of the current iterate, and of a trial that may become it by swapTrial().
  const EvaluationList& getIterate() const { return iterate_; }
  /// Null if it is outdated.
  const NodeEvaluation* getFresh(size_t node) const {
    return node < fresh_.size() && fresh_[node] ? iterate_[node].get() : nullptr;
  }
  const EvaluationList& trial() const { return trial_; }
  void swapTrial();
  /// N + 1, that were the iterate after the last update().
  const EvaluationList& getUpdated() const { return swapped_ ? trial_ : iterate_; }
  /// For trials whose evaluations are not kept.
  const EvaluationList& rolling() const { return rolling_; }
  /// Scratch of a thread of the team.
  ProblemScratch* getScratch(int thread) const { return scratch_[thread].get(); }

  /// Time of all updates since resize(), summed over the threads.
  double getSeconds() const { return seconds_; }

 private:
  std::uint64_t problem_ = 0;  // id
  EvaluationList iterate_, trial_, rolling_, moved_;
  std::vector<std::unique_ptr<ProblemScratch>> scratch_;  // by thread
  std::vector<EvaluateTask> tasks_;
  std::vector<char> fresh_;  // N + 1: the evaluation is up to date with the iterate
  std::vector<char> moved_fresh_;
  bool swapped_ = false;   // since the last update()
  bool advanced_ = false;  // since the last resize()
  double seconds_ = 0;
};

}  // namespace bielle
