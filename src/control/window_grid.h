#pragma once
// Which stages of a horizon the nodes of a window stand for: near ones for one each, far ones for several.
#include <optional>

#include "control/horizon.h"
#include "solve/receding.h"

namespace bielle {

// A node that stands for several stages has the costs, the constraints and the place in the problem of the first of them, and
// a step as long as all of them. It joins stages that are alike: of one phase, with the same contacts, limits of torques and
// weights of state and control, the same references of both but for the heading, and costs and constraints of the same names,
// whose references may differ; those without a name must be the same.
// Nodes keep their place in time while the window moves, and are cut in two when they are too near. With R the power of two
// next to 15 ms (of the reference robot, motion/robot_size.h) over the length of a stage, between 1 and 16, they are at most
//     1 stage long within the first `fine` stages of the window, 2 R within the next 2 R fine, 4 R beyond,                (1)
// where they double every 8 stages until then: so a window is not much shorter in time where stages are, and at most one node of
// each length is cut when it moves on. Springs take longer steps implicitly (robot_problem.h Eq. 7).
class WindowGrid {
 public:
  // What a node was in the window before.
  enum class Origin {
    Kept,      // it began at the same stage
    Cut,       // a later part of a node
    Earlier,   // not part of it, the window has moved back
    Appended,  // not part of it
  };
  struct Node {
    int begin = 0, length = 1;  // stages
    Origin origin = Origin::Appended;
    int source = 0;    // Kept and Cut: this node of the window before
    int numbers = -1;  // its place among those that stages have without it; -1: the node is its stage
    int end() const { return begin + length; }
  };

  WindowGrid(Horizon& horizon, const PredictiveOptions& options);

  // Gives all stages their own place again.
  void clear();
  // The window begins at a stage for which the horizon is prepared.
  // \param changed, changed_end  stages in this range, each a node of its own, have been replaced
  void move(int first, int changed = 0, int changed_end = 0);

  const std::vector<Node>& nodes() const { return nodes_; }
  // Those before the last move().
  const std::vector<Node>& before() const { return before_; }
  int begin() const { return nodes_.front().begin; }
  int end() const { return nodes_.back().end(); }
  // The stages of the problem that the nodes are.
  const std::vector<int>& stages() const { return stages_; }
  // What the solver needs to move on, terminal node included.
  const std::vector<NodeSource>& sources() const { return sources_; }
  // What now follows the window if that ends earlier than before, else null.
  const Node* next() const { return next_ ? &*next_ : nullptr; }

 private:
  // What a stage has before it is made longer.
  struct Numbers {
    double dt = 0;
    VectorXd armature;
    std::vector<double> others;  // gains and scales of its constraints
  };
  void stretch(StageSpec& spec, int length, Numbers& before) const;
  void restore(StageSpec& spec, Numbers& before) const;

  int getStage(int stage) const;
  int getMost(const Node& node) const;
  bool areAlike(int stage, int next) const;
  void restore(Node& node);
  void add(Node node);
  void append();

  Horizon& horizon_;
  const PredictiveOptions& options_;
  const double time_;  // of the robot's size
  std::vector<Node> nodes_, before_;
  std::vector<Numbers> numbers_;
  std::vector<int> free_;  // of these
  int first_ = 0;
  std::vector<int> stages_;
  std::vector<NodeSource> sources_;
  std::optional<Node> next_;
};

// The most stages of h s of the reference robot that a window may stand for.
int countMostStages(const PredictiveOptions& options, double h);

}  // namespace bielle
