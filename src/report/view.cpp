#include <algorithm>
#include <cmath>
#include <deque>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/report/report.h"
#include "bielle/results/result.h"
#include "dynamics/loop_conflict.h"
#include "formats/text_file.h"
#include "report/pack.h"
#include "report/page.h"
#include "report/readouts.h"
#include "report/run.h"

namespace bielle {
namespace {

constexpr int kCounts[] = {0, 41, 13, 7};  // values of each motor, by the number of motors of the group
constexpr double kReach = 1.5;             // on both sides of the start if there is no limit, rad or m

// Motors that form one grid, and the bodies that they move relative to their parents.
struct Group {
  std::vector<int> motors, bodies;
};

std::vector<Group> listGroups(const Model& model) {
  std::vector<Group> groups;
  std::vector<bool> is_taken(model.nu(), false);
  for (const LoopCluster& cluster : model.clusters()) {
    Group group;
    for (int m = 0; m < model.nu(); ++m)
      if (std::binary_search(cluster.dofs.begin(), cluster.dofs.end(), model.motors()[m].dof)) {
        group.motors.push_back(m);
        is_taken[m] = true;
      }
    for (int dof : cluster.dofs)
      if (group.bodies.empty() || group.bodies.back() != model.dofs()[dof].joint)
        group.bodies.push_back(model.dofs()[dof].joint);
    if (!group.motors.empty() && group.motors.size() < std::size(kCounts)) groups.push_back(group);
  }
  for (int m = 0; m < model.nu(); ++m)
    if (!is_taken[m]) groups.push_back({{m}, {model.motors()[m].joint}});
  return groups;
}

VectorXd makeStart(const LoadedRobot& robot) {
  const Model& model = robot.model;
  const AssemblyResult start = findClosedConfiguration(model);
  if (start.status != NumericalStatus::Ok) throw makeClosingError(model, robot.path(), start);
  return start.q;
}

// Closed configurations on the grid of one group, found from neighbour to neighbour.
class GroupGrid {
 public:
  GroupGrid(const Model& model, const Group& group, const VectorXd& start)
      : model_(model),
        group_(group),
        count_(kCounts[group.motors.size()]),
        readouts_(model, group.motors, group.bodies, start),
        weights_(VectorXd::Constant(model.nv(), 1e-4)) {
    size_ = 1;
    int first = 0;
    for (int m : group.motors) {
      const Motor& motor = model.motors()[m];
      const double value = start[model.joints()[motor.joint].idx_q];
      low_.push_back(std::max(model.lowerLimits()[motor.dof], value - kReach));
      high_.push_back(std::max(low_.back() + 1e-6, std::min(model.upperLimits()[motor.dof], value + kReach)));
      start_.push_back(value);
      const double place = (value - low_.back()) / (high_.back() - low_.back()) * (count_ - 1);
      first += size_ * std::clamp(static_cast<int>(std::lround(place)), 0, count_ - 1);
      size_ *= count_;
      weights_[motor.dof] = 1;
    }
    spread(first, start);
  }

  Json describe() const {
    Json motors = Json::array(), closed = Json::array();
    for (size_t i = 0; i < group_.motors.size(); ++i)
      motors.push_back({{"motor", group_.motors[i]}, {"low", low_[i]}, {"high", high_[i]}, {"start", start_[i]}});
    Workspace ws(model_);
    RowMatrixXd poses = RowMatrixXd::Zero(size_, 7 * group_.bodies.size());
    const Json shown = readouts_.describe();
    RowMatrixXd values = RowMatrixXd::Zero(size_, static_cast<Eigen::Index>(shown.size()));
    for (int node = 0; node < size_; ++node) {
      closed.push_back(nodes_[node].size() > 0);
      if (!closed.back().get<bool>()) continue;
      updatePlacements(model_, ws, nodes_[node]);
      values.row(node) = readouts_.calc(nodes_[node]);
      for (size_t b = 0; b < group_.bodies.size(); ++b) {
        const int body = group_.bodies[b];
        const SE3& X_WP = ws.X_WB[model_.joints()[body].parent];
        poses.row(node).segment<7>(7 * b) = makePoseRow(X_WP.inverseTimes(ws.X_WB[body]));
      }
    }
    return {{"motors", motors},          {"count", count_},   {"bodies", group_.bodies},    {"closed", closed},
            {"poses", packTable(poses)}, {"readouts", shown}, {"values", packTable(values)}};
  }

 private:
  void spread(int first, const VectorXd& start) {
    nodes_.assign(size_, VectorXd());
    std::vector<bool> is_seen(size_, false);
    std::deque<std::pair<int, VectorXd>> queue = {{first, start}};
    is_seen[first] = true;
    while (!queue.empty()) {
      const auto [node, from] = queue.front();
      queue.pop_front();
      nodes_[node] = solve(node, from);
      if (nodes_[node].size() == 0) continue;
      for (int stride = 1; stride < size_; stride *= count_)
        for (int step : {-1, 1}) {
          const int place = node / stride % count_ + step;
          const int next = node + step * stride;
          if (place < 0 || place >= count_ || is_seen[next]) continue;
          is_seen[next] = true;
          queue.emplace_back(next, nodes_[node]);
        }
    }
  }

  // The closed configuration near `from` with the motors at the values of the node; empty if there is none.
  VectorXd solve(int node, const VectorXd& from) const {
    AssemblyProblem problem;
    problem.q_ref = from;
    problem.weights = weights_;
    VectorXd wished(group_.motors.size());
    for (size_t i = 0, rest = node; i < group_.motors.size(); ++i, rest /= count_) {
      wished[i] = low_[i] + (high_[i] - low_[i]) * static_cast<double>(rest % count_) / (count_ - 1);
      problem.q_ref[getIndex(i)] = wished[i];
    }
    AssemblyOptions options;
    options.max_iterations = 30;
    options.continuation_steps = 0;
    const AssemblyResult result = assemble(model_, problem, options);
    if (result.status != NumericalStatus::Ok) return {};
    for (size_t i = 0; i < group_.motors.size(); ++i)
      if (std::abs(result.q[getIndex(i)] - wished[i]) > 1e-4) return {};
    return result.q;
  }

  int getIndex(size_t i) const { return model_.joints()[model_.motors()[group_.motors[i]].joint].idx_q; }

  const Model& model_;
  const Group& group_;
  int count_;
  Readouts readouts_;
  int size_ = 0;
  std::vector<double> low_, high_, start_;
  VectorXd weights_;
  std::vector<VectorXd> nodes_;  // configurations; empty where it does not close
};

// A robot as a run of the page, and its grids.
struct StillView {
  Json run, view;
};

StillView makeStillView(const LoadedRobot& robot, const std::string& label) {
  const Model& model = robot.model;
  const VectorXd start = makeStart(robot);
  const ReportRun still = makeStillRun(robot, start, "view");
  const std::vector<Group> groups = listGroups(model);
  Json grids = Json::array(), parents = Json::array();
  for (const Group& group : groups) grids.push_back(GroupGrid(model, group, start).describe());
  for (const Joint& joint : model.joints()) parents.push_back(joint.parent);
  return {{{"label", label},
           {"summary", still.summary},
           {"check", Json()},
           {"robot", describeRobot(robot)},
           {"motion", describeMotion(still)}},
          {{"parents", parents}, {"groups", grids}}};
}

std::optional<StillView> findStillView(const LoadedRobot& robot, const std::string& label) {
  try {
    return makeStillView(robot, label);
  } catch (const InputError&) {  // its loops do not close
    return {};
  }
}

}  // namespace

std::string makeView(const LoadedRobot& robot, const std::vector<ViewParameter>& parameters) {
  const StillView base = makeStillView(robot, robot.model.name());
  Json runs = {base.run}, views = {base.view}, sliders = Json::array();
  for (const ViewParameter& parameter : parameters) {
    Json indices = Json::array();  // of runs, null where the robot does not close
    for (size_t i = 0; i < parameter.values.size(); ++i) {
      std::optional<StillView> other;
      if (i != parameter.start && parameter.robots[i]) other = findStillView(*parameter.robots[i], parameter.name);
      indices.push_back(i == parameter.start ? Json(0) : other ? Json(runs.size()) : Json());
      if (other) runs.push_back(other->run), views.push_back(other->view);
    }
    sliders.push_back({{"name", parameter.name},
                       {"unit", parameter.unit},
                       {"values", parameter.values},
                       {"start", parameter.start},
                       {"runs", indices}});
  }
  return makePage({{"bielle", getBuildInfo().bielle}, {"runs", runs}, {"views", views}, {"parameters", sliders}});
}

void writeView(const std::string& path, const LoadedRobot& robot, const std::vector<ViewParameter>& parameters) {
  writeTextFile(path, makeView(robot, parameters));
}

}  // namespace bielle
