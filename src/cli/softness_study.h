#pragma once
// How soft the loops of a mechanism are over their ranges.
#include <optional>
#include <string>
#include <vector>

#include "dynamics/soft_loops.h"
#include "results/json_text.h"

namespace bielle::cli {

struct SoftnessOptions {
  int postures = 9;              // of each coordinate's range
  std::optional<double> torque;  // of the motors, N m or N, instead of their limits
};

// What a loop does at a posture, the worst last; `diverges` depends on the time step.
constexpr const char* kSoftnessStates[] = {"holds", "falls", "gives way", "diverges"};

// A motion at one time.
struct SoftnessInstant {
  double time = 0;  // s
  VectorXd q, v, a;
  VectorXd force;  // of the loops, by coordinate (nv)
};
// Of a result of the mechanism, by the names of its coordinates; impacts are left out.
// \param file  for which the model stands   \throws InputError if it is of another mechanism
std::vector<SoftnessInstant> readInstants(const std::string& directory, const Model& model, const std::string& file);

// One linkage at one posture, while all else stands, or at one time, while motors and all else move as they did.
struct SoftnessTask {
  int cluster = 0;
  std::string joint;    // that is swept; empty for loops that do not move
  double position = 0;  // rad or m
  VectorXd q;
  const SoftnessInstant* instant = nullptr;
};

class SoftnessStudy {
 public:
  // \param q  closed (nq): sweeps begin there   \param motion  to follow instead
  SoftnessStudy(const Model& model, const SoftLoops& loops, const VectorXd& q, const SoftnessOptions& options,
                const std::vector<SoftnessInstant>& motion = {});

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
  std::vector<int> listPassive(int cluster) const;
  struct Worst;
  Worst calcMotors(const SoftnessTask& task) const;
  std::vector<Json> studyInstant(const SoftnessTask& task) const;

  const Model model_;
  const SoftLoops& loops_;
  const SoftnessOptions options_;
  std::vector<std::vector<int>> driven_;  // dofs, by cluster
  std::vector<SoftnessTask> tasks_;
};

}  // namespace bielle::cli
