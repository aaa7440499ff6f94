#pragma once
// How soft the loops of a mechanism are over their ranges.
#include <string>
#include <vector>

#include "dynamics/soft_loops.h"
#include "results/json_text.h"

namespace bielle::cli {

struct SoftnessOptions {
  int postures = 9;    // of each coordinate's range
  double torque = -1;  // of the motors, N m or N; negative: their limits
};

// What a loop does at a posture, the worst last; `diverges` depends on the time step.
constexpr const char* kSoftnessStates[] = {"holds", "falls", "gives way", "diverges"};

// One linkage at one posture: all else stands.
struct SoftnessTask {
  int cluster = 0;
  std::string joint;    // that is swept; empty for loops that do not move
  double position = 0;  // rad or m
  VectorXd q;
};

class SoftnessStudy {
 public:
  // \param q  closed (nq): sweeps begin there
  SoftnessStudy(const Model& model, const SoftLoops& loops, const VectorXd& q, const SoftnessOptions& options);

  const std::vector<SoftnessTask>& tasks() const { return tasks_; }
  // Names of the loops in the order of their rows.
  std::vector<std::string> listLoops(int cluster) const;
  // Joints that the motors move, which sag under gravity and are blocked while the motors pull.
  std::vector<std::string> listDriven(int cluster) const;
  // A row for each loop of the linkage.
  std::vector<Json> study(const SoftnessTask& task) const;

 private:
  void addTasks(int cluster, const VectorXd& q);
  std::vector<int> findDriven(int cluster, const VectorXd& q) const;
  std::vector<int> listMotors(int cluster) const;
  struct Worst;
  Worst calcMotors(const SoftnessTask& task) const;

  const Model model_;
  const SoftLoops& loops_;
  const SoftnessOptions options_;
  std::vector<std::vector<int>> driven_;  // dofs, by cluster
  std::vector<SoftnessTask> tasks_;
};

}  // namespace bielle::cli
