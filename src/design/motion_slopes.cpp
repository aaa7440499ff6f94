#include "design/motion_slopes.h"

#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>

#include "bielle/design/cost_gradient.h"
#include "bielle/dynamics/distance.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "design/conditioning.h"
#include "design/motion_envelope.h"
#include "motion/neighbour_plans.h"

namespace bielle {
namespace {

// Half the step of the central difference of kept motions, relative to the bounds: their loops are closed to 1e-12 rad, and of sums
// that cancel, such as energies, a larger one leaves more than rounding.
constexpr double kKeptStep = 5e-6;

// Margins of linkages and distances of shapes at the states of a robot.
class StateMeasures {
 public:
  StateMeasures(const Model& model, const VectorXd& x, const std::set<Measure>& requested, const BodyPairs& left_out)
      : model_(model), ws_(model) {
    if (requested.count(Measure::Margin)) conditioning_.emplace(model, x.head(model.nq()), LinkageSide::Joints);
    if (requested.count(Measure::Distance)) pairs_ = listPairsBut(left_out, model);
  }

  bool hasMargins() const { return conditioning_.has_value(); }
  VectorXd calcMargins(const VectorXd& x) {  // mu^2 of Eq. (4) of gradient.h, of every cluster
    return conditioning_->calcInverses(x.head(model_.nq())).cwiseAbs2();
  }
  NearestPair findNearest(const VectorXd& x) {
    updatePlacements(model_, ws_, x.head(model_.nq()));
    return findNearestPair(model_, ws_.X_WB, pairs_);
  }
  bool hasPairs() const { return !pairs_.empty(); }
  double calcDistance(const VectorXd& x, int pair) {
    updatePlacements(model_, ws_, x.head(model_.nq()));
    const Shape &a = model_.shapes()[static_cast<size_t>(pairs_[static_cast<size_t>(pair)].a)],
                &b = model_.shapes()[static_cast<size_t>(pairs_[static_cast<size_t>(pair)].b)];
    return bielle::calcDistance(a, ws_.X_WB[a.body], b, ws_.X_WB[b.body]).distance;
  }

 private:
  const Model& model_;
  Workspace ws_;
  std::optional<LinkageConditioning> conditioning_;
  std::vector<ShapePair> pairs_;
};

// The slopes of one motion, and what is read of it and of those beside it for them.
class SlopeReader {
 public:
  // \param goals  of the motion, if their slopes are wanted   \param variables  their number
  SlopeReader(const Model& model, const MotionOutcome& outcome, const std::vector<VectorXd>& xs,
              const std::vector<GoalOutcome>& goals, Eigen::Index variables, const std::set<Measure>& requested,
              const BodyPairs& left_out)
      : requested_(requested), left_out_(left_out) {
    const MotorTrace& trace = outcome.measures.trace;
    const auto count = static_cast<size_t>(variables);
    out_.dt = trace.dt, out_.u = trace.torque, out_.v = trace.speed;
    out_.du.assign(count, MatrixXd::Zero(out_.u.rows(), out_.u.cols()));
    out_.dv = out_.du;
    out_.cost = outcome.measures.cost;
    out_.dcost.setZero(variables);
    out_.goals = goals;
    out_.dgoals.setZero(static_cast<Eigen::Index>(goals.size()), variables);
    addStates(makeMeasures(model, xs.front()), xs);
    out_.dmargin.assign(count, MatrixXd::Zero(out_.margin.rows(), out_.margin.cols()));
    out_.ddistance.assign(count, Eigen::RowVectorXd::Zero(out_.distance.size()));
  }

  // Of a robot beside, in a state x of the motion.
  StateMeasures makeMeasures(const Model& model, const VectorXd& x) const {
    return StateMeasures(model, x, requested_, left_out_);
  }

  // Torques, speeds, margins, distances, goals.
  VectorXd read(const Model& model, const ShootingTrajectory& trajectory, const std::vector<GoalOutcome>& goals,
                StateMeasures& at) const {
    const MotorTrace trace = makeMotorTrace(model, out_.dt, trajectory);
    if (goals.size() != out_.goals.size()) throw std::invalid_argument("a neighbour has other goals");
    const Eigen::Index size = trace.torque.size();
    VectorXd out(2 * size + static_cast<Eigen::Index>(margins_.size() + distances_.size() + goals.size()));
    out.head(size) = trace.torque.reshaped();
    out.segment(size, size) = trace.speed.reshaped();
    Eigen::Index next = 2 * size;
    for (const auto& [cluster, node] : margins_)
      out[next++] = at.calcMargins(trajectory.xs[static_cast<size_t>(node)])[cluster];
    for (const auto& [row, node] : distances_)
      out[next++] = at.calcDistance(trajectory.xs[static_cast<size_t>(node)], pairs_[static_cast<size_t>(node)]);
    for (const GoalOutcome& goal : goals) out[next++] = goal.achieved - goal.goal.requested;
    return out;
  }

  // The derivative of what is read, by a variable.
  void write(const VectorXd& derivative, Eigen::Index variable) {
    const auto i = static_cast<size_t>(variable);
    const Eigen::Index nu = out_.u.rows(), N = out_.u.cols(), size = nu * N;
    out_.du[i] = derivative.head(size).reshaped(nu, N);
    out_.dv[i] = derivative.segment(size, size).reshaped(nu, N);
    Eigen::Index next = 2 * size;
    for (const auto& [cluster, node] : margins_) out_.dmargin[i](cluster, node) = derivative[next++];
    for (const auto& [row, node] : distances_) out_.ddistance[i](row, node) = derivative[next++];
    out_.dgoals.col(variable) = derivative.tail(out_.dgoals.rows());
  }
  void writeCost(double derivative, Eigen::Index variable) { out_.dcost[variable] = derivative; }

  MotorSlopes take() { return std::move(out_); }

 private:
  void addStates(StateMeasures at, const std::vector<VectorXd>& xs) {
    const auto nodes = static_cast<Eigen::Index>(xs.size());
    if (at.hasMargins()) {
      out_.margin.resize(at.calcMargins(xs.front()).size(), nodes);
      for (Eigen::Index k = 0; k < nodes; ++k) out_.margin.col(k) = at.calcMargins(xs[static_cast<size_t>(k)]);
      margins_ = listLeast(out_.margin);
    }
    if (!at.hasPairs()) return;
    out_.distance.resize(nodes);
    for (Eigen::Index k = 0; k < nodes; ++k) {
      const NearestPair nearest = at.findNearest(xs[static_cast<size_t>(k)]);
      out_.distance[k] = nearest.distance.distance;
      pairs_.push_back(nearest.pair);
    }
    distances_ = listLeast(out_.distance);
  }

  const std::set<Measure>& requested_;
  const BodyPairs& left_out_;
  MotorSlopes out_;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> margins_, distances_;  // where they are read
  std::vector<int> pairs_;                                                  // the nearest at every node
};

// Of a motion that was optimized for the design.
class OptimumSlopes {
 public:
  // \param here  the motion of the outcome, made as those of robots beside it
  OptimumSlopes(const MotionOutcome& outcome, Motion here, Eigen::Index variables, const std::set<Measure>& requested,
                const BodyPairs& left_out)
      : optimum_(*outcome.solution),
        here_(std::move(here)),
        envelope_(optimum_),
        cost_(envelope_.calcLagrangian(here_)),
        reader_(optimum_.motion.problem->model(), outcome, optimum_.trajectory.xs, outcome.goals, variables, requested,
                left_out),
        followed_(optimum_, here_, makeOptimumReader(here_)) {}

  // The derivatives by variable i, from the motion of the robot at `step` from this one; false if there are none.
  bool add(const Motion& changed, double step, Eigen::Index i) {
    const double dcost = (envelope_.calcLagrangian(changed) - cost_) / step;
    const auto derivative = followed_.differentiate(changed, step, makeOptimumReader(changed));
    if (!std::isfinite(dcost) || !derivative) return false;
    reader_.writeCost(dcost, i);
    reader_.write(derivative->value, i);
    return true;
  }

  MotorSlopes take() { return reader_.take(); }

 private:
  OptimumReader makeOptimumReader(const Motion& motion) const {
    const auto at =
        std::make_shared<StateMeasures>(reader_.makeMeasures(motion.problem->model(), motion.problem->initialState()));
    return [this, at, &motion](const ShootingTrajectory& trajectory) {
      return reader_.read(motion.problem->model(), trajectory, measureGoals(motion, trajectory), *at);
    };
  }

  const Solution& optimum_;
  Motion here_;
  MotionEnvelope envelope_;
  double cost_;
  SlopeReader reader_;
  FollowedMotion followed_;
};

// Motions of robots a little beside one another.
class NeighbourMotions {
 public:
  // One of them, loaded as the motions ask for.
  struct Robot {
    explicit Robot(Model robot) : model(std::move(robot)) {}
    struct Loaded {
      Model model;
      VectorXd posture;
    };
    Model model;
    std::map<size_t, Loaded> loaded;  // by the first motion with that payload
  };

  explicit NeighbourMotions(const std::vector<DesignMotion>& motions)
      : motions_(motions), groups_(groupByPayload(motions)), plans_(motions.size()), postures_(motions.size()) {}

  // The robot with the payload of a motion, as it stands.
  const Robot::Loaded& load(size_t m, Robot& robot) {
    const size_t group = groups_[m];
    auto found = robot.loaded.find(group);
    if (found == robot.loaded.end()) {
      Model model = addPayload(robot.model, motions_[m].payload);
      VectorXd posture = makeStandingPosture(model, &postures_[group]);
      found = robot.loaded.emplace(group, Robot::Loaded{std::move(model), std::move(posture)}).first;
    }
    return found->second;
  }
  // It refers to the robot.
  Motion plan(size_t m, Robot& robot) {
    const auto& [model, posture] = load(m, robot);
    return makeDesignMotion(model, motions_[m], plans_[m].begin(model, posture));
  }

 private:
  const std::vector<DesignMotion>& motions_;
  std::vector<size_t> groups_;
  std::vector<NeighbourPlans> plans_, postures_;  // of each motion; of each group, by its first motion
};

using Slopes = std::vector<MotorSlopes>;

Slopes failSlopes(const std::string& reason) {
  Slopes out(1);
  out.back().failure = "no gradient" + reason;
  return out;
}

// Fails where robots beside x cannot be made, or make the motions otherwise.
Slopes tryToFollow(const std::function<Slopes()>& calc) {
  try {
    return calc();
  } catch (const std::invalid_argument& error) {  // an optimum that is none to second order, a plan with other stages
    return failSlopes(std::string(": ") + error.what());
  } catch (const InputError& error) {
    return failSlopes(std::string(": ") + error.what());
  }
}

Slopes failAlong(const Parametrization& robot, Eigen::Index i, const DesignMotion& motion) {
  return failSlopes(" along " + robot.variables()[static_cast<size_t>(i)].name + ": " + motion.name +
                    " cannot be followed");
}

}  // namespace

Slopes calcOptimumSlopes(const Parametrization& robot, const VectorXd& x, const std::vector<DesignMotion>& motions,
                         const std::vector<MotionOutcome>& outcomes, const std::set<Measure>& requested,
                         const BodyPairs& left_out) {
  return tryToFollow([&] {
    NeighbourMotions neighbours(motions);
    NeighbourMotions::Robot here(robot.make(x));
    std::vector<std::unique_ptr<OptimumSlopes>> slopes;
    for (size_t m = 0; m < motions.size(); ++m)
      slopes.push_back(
          std::make_unique<OptimumSlopes>(outcomes[m], neighbours.plan(m, here), x.size(), requested, left_out));
    for (Eigen::Index i : robot.listContinuous()) {
      const double h = kForwardStep * (robot.upper()[i] - robot.lower()[i]);
      NeighbourMotions::Robot changed(robot.make(x + h * VectorXd::Unit(x.size(), i)));
      for (size_t m = 0; m < motions.size(); ++m)
        if (!slopes[m]->add(neighbours.plan(m, changed), h, i)) return failAlong(robot, i, motions[m]);
    }
    Slopes out;
    for (const auto& of_motion : slopes) out.push_back(of_motion->take());
    return out;
  });
}

Slopes calcKeptSlopes(const Parametrization& robot, const VectorXd& x, const std::vector<DesignMotion>& motions,
                      const std::vector<std::optional<SolvedMotion>>& solved,
                      const std::vector<MotionOutcome>& outcomes, const std::set<Measure>& requested,
                      const BodyPairs& left_out) {
  return tryToFollow([&] {
    NeighbourMotions neighbours(motions);
    std::vector<SlopeReader> slopes;
    for (const MotionOutcome& outcome : outcomes)
      slopes.emplace_back(*outcome.loaded, outcome, outcome.lifted.trajectory.xs, std::vector<GoalOutcome>(), x.size(),
                          requested, left_out);
    for (Eigen::Index i : robot.listContinuous()) {
      const double h = kKeptStep * (robot.upper()[i] - robot.lower()[i]);
      NeighbourMotions::Robot ahead(robot.make(x + h * VectorXd::Unit(x.size(), i))),
          behind(robot.make(x - h * VectorXd::Unit(x.size(), i)));
      for (size_t m = 0; m < motions.size(); ++m) {
        const auto read = [&](NeighbourMotions::Robot& beside) {
          const auto& [model, posture] = neighbours.load(m, beside);
          const LiftResult lifted = liftMotion(model, posture, *solved[m]->serial);
          if (!lifted.lifted()) return VectorXd();
          StateMeasures at = slopes[m].makeMeasures(model, lifted.trajectory.xs.front());
          return slopes[m].read(model, lifted.trajectory, {}, at);
        };
        const VectorXd to = read(ahead), from = read(behind);
        if (to.size() == 0 || from.size() == 0) return failAlong(robot, i, motions[m]);
        slopes[m].write((to - from) / (2 * h), i);
      }
    }
    Slopes out;
    for (SlopeReader& of_motion : slopes) out.push_back(of_motion.take());
    return out;
  });
}

}  // namespace bielle
