#include "identify/excitation.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/rnea.h"
#include "bielle/model/error.h"
#include "math/constants.h"
#include "math/decompositions.h"
#include "motion/slsqp.h"

namespace bielle {
namespace {

constexpr Eigen::Index kInstants = 120;  // of a period, where the gain is taken
constexpr double kPenalty = 1e3, kStep = 1e-5, kFirst = 0.1, kShrink = 0.9;
constexpr int kMostShrinks = 80;

class Search {
 public:
  Search(const Model& model, ConstVectorRef q, const std::vector<LoadNumber>& numbers,
         const std::vector<MeasuredLinkage>& linkages, const ExcitationOptions& options)
      : model_(model), q_(q), numbers_(numbers), linkages_(linkages), options_(options), ws_(model) {
    std::vector<bool> is_looped(static_cast<size_t>(model.nv()), false);
    for (const MeasuredLinkage& linkage : linkages)
      for (const int dof : linkage.cluster->dofs) is_looped[static_cast<size_t>(dof)] = true;
    for (const Motor& motor : model.motors()) {
      const bool slides = model.joints()[static_cast<size_t>(motor.joint)].kind == JointKind::Prismatic;
      if (slides && !std::isfinite(getSpeedLimit(motor)))
        throw InputError(model.name(), "motor '" + motor.name + "'", "its speed has no limit",
                         "give it one, `motors: {" + motor.name + ": {velocity: 0.2}}` [m/s]");
      if (!is_looped[static_cast<size_t>(motor.dof)])
        coordinates_.push_back({model.joints()[static_cast<size_t>(motor.joint)].idx_q, motor.dof, {}});
    }
  }

  Eigen::Index size() const { return 2 * kHarmonics * model_.nu(); }

  // Where all linkages follow; the least torques that move the robot so. \param x  a, then b, motor by motor
  LoadedMotion move(const VectorXd& x, const VectorXd& time) {
    const auto getMotion = [&](int position) { return calcSines(x, findMotor(position), time); };
    std::vector<MeasuredLinkage> linkages = linkages_;
    for (MeasuredLinkage& linkage : linkages) {
      for (MatrixXd* m : {&linkage.motion.value, &linkage.motion.rate, &linkage.motion.acceleration})
        m->resize(time.size(), static_cast<Eigen::Index>(linkage.sensors.size()));
      for (size_t s = 0; s < linkage.sensors.size(); ++s) {
        const int joint = model_.findJoint(linkage.sensors[s].name);
        const Smoothed motion = getMotion(model_.joints()[static_cast<size_t>(joint)].idx_q);
        const auto column = static_cast<Eigen::Index>(s);
        linkage.motion.value.col(column) = motion.value;
        linkage.motion.rate.col(column) = motion.rate;
        linkage.motion.acceleration.col(column) = motion.acceleration;
      }
    }
    for (MeasuredCoordinate& coordinate : coordinates_) coordinate.motion = getMotion(coordinate.position);
    const std::atomic<bool> never{false};
    LoadedMotion motion =
        findLoadedStates(model_, q_, linkages, coordinates_, MatrixXd::Zero(time.size(), model_.nu()), {}, never);
    for (LoadedState& state : motion.states) {
      MatrixXd N_M(state.N.cols(), model_.nu());
      for (int m = 0; m < model_.nu(); ++m) N_M.col(m) = state.N.row(model_.motors()[static_cast<size_t>(m)].dof);
      const VectorXd needed = state.N.transpose() * calcInverseDynamics(model_, ws_, state.q, state.v, state.a);
      state.u = Eigen::CompleteOrthogonalDecomposition<MatrixXd>(N_M).solve(needed);
    }
    return motion;
  }

  // Eq. (2). Scales and the noise of torques are those of the first motion.
  double calcGain(const LoadedMotion& motion) {
    const TorqueFit fit(model_, numbers_, motion.states, motion.groups, weights_);
    if (scales_.size() == 0) scales_ = fit.scales(), weights_ = fit.weights();
    VectorXd r;
    MatrixXd J;
    fit.evaluate(VectorXd::Zero(scales_.size()), r, &J);
    const MatrixXd scaled = J * scales_.asDiagonal();
    const MatrixXd information = MatrixXd::Identity(scaled.cols(), scaled.cols()) + scaled.transpose() * scaled;
    const Eigen::LLT<MatrixXd> factor(information);
    double sum = 0;
    for (Eigen::Index i = 0; i < scaled.cols(); ++i) sum += std::log(factor.matrixLLT()(i, i));
    return sum;
  }

  // The largest share of a limit at each instant of a motion, and the sum of squares of what is beyond kShareOfLimits.
  double calcShare(const LoadedMotion& motion, double* excess = nullptr) const {
    double largest = 0;
    const auto note = [&](double value, double limit) {
      if (!std::isfinite(limit) || limit <= 0) return;
      const double share = std::abs(value) / limit;
      largest = std::max(largest, share);
      if (excess && share > kShareOfLimits) *excess += std::pow(share - kShareOfLimits, 2);
    };
    for (const LoadedState& state : motion.states) {
      for (int m = 0; m < model_.nu(); ++m) {
        const Motor& motor = model_.motors()[static_cast<size_t>(m)];
        note(state.u[m], motor.effort_limit);
        note(state.v[motor.dof], getSpeedLimit(motor));
      }
      for (const Joint& joint : model_.joints()) {
        if (joint.nq != joint.nv) continue;
        for (int k = 0; k < joint.nv; ++k) {
          const double low = model_.lowerLimits()[joint.idx_v + k], high = model_.upperLimits()[joint.idx_v + k];
          note(state.q[joint.idx_q + k] - 0.5 * (low + high), 0.5 * (high - low));
          note(state.v[joint.idx_v + k], model_.velocityLimits()[joint.idx_v + k]);
          if (joint.kind != JointKind::Prismatic) note(state.v[joint.idx_v + k], kMostTurn / options_.window);
        }
      }
    }
    return largest;
  }

 private:
  double getSpeedLimit(const Motor& motor) const {
    return std::min(motor.velocity_limit, model_.velocityLimits()[motor.dof]);
  }
  int findMotor(int position) const {
    for (int m = 0; m < model_.nu(); ++m)
      if (model_.joints()[static_cast<size_t>(model_.motors()[static_cast<size_t>(m)].joint)].idx_q == position)
        return m;
    return -1;
  }
  // Eq. (1)
  Smoothed calcSines(const VectorXd& x, int motor, const VectorXd& time) const {
    const double start =
        q_[model_.joints()[static_cast<size_t>(model_.motors()[static_cast<size_t>(motor)].joint)].idx_q];
    Smoothed out{VectorXd::Constant(time.size(), start), VectorXd::Zero(time.size()), VectorXd::Zero(time.size())};
    for (int h = 1; h <= kHarmonics; ++h) {
      const double w = h * 2 * kPi / options_.duration;
      const Eigen::Index at = 2 * (kHarmonics * motor + h - 1);
      const double a = x[at], b = x[at + 1];
      for (Eigen::Index k = 0; k < time.size(); ++k) {
        const double s = std::sin(w * time[k]), c = std::cos(w * time[k]);
        out.value(k, 0) += a * s + b * (1 - c);
        out.rate(k, 0) += w * (a * c + b * s);
        out.acceleration(k, 0) += w * w * (b * c - a * s);
      }
    }
    return out;
  }

  const Model& model_;
  const VectorXd q_;
  const std::vector<LoadNumber>& numbers_;
  const std::vector<MeasuredLinkage>& linkages_;
  const ExcitationOptions& options_;
  std::vector<MeasuredCoordinate> coordinates_;
  Workspace ws_;
  VectorXd scales_, weights_;
};

}  // namespace

Excitation findExcitation(const Model& model, ConstVectorRef q, const std::vector<LoadNumber>& numbers,
                          const std::vector<MeasuredLinkage>& linkages, double period,
                          const ExcitationOptions& options) {
  Search search(model, q, numbers, linkages, options);
  const VectorXd few = VectorXd::LinSpaced(kInstants, 0, options.duration * (1 - 1.0 / kInstants));
  VectorXd x(search.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = kFirst * std::sin(2.4 * static_cast<double>(i + 1));
  Excitation out;
  bool goes_on = true;
  const auto calcCost = [&](const VectorXd& at) {
    if (!goes_on) return 0.0;
    const LoadedMotion motion = search.move(at, few);
    if (2 * motion.states.size() < static_cast<size_t>(kInstants)) return kPenalty * kInstants;
    double excess = kInstants - static_cast<double>(motion.states.size());
    search.calcShare(motion, &excess);
    return kPenalty * excess - search.calcGain(motion);
  };
  const LoadedMotion first = search.move(x, few);
  if (first.states.size() < static_cast<size_t>(kInstants))
    throw InputError(model.name(), "motors", "its linkages do not follow them by a tenth of a rad from where it begins",
                     "give it another first reference posture, away from dead points");
  out.gain_before = search.calcGain(first);
  double best = out.gain_before;
  SlsqpOptions steps;
  steps.tolerance = 1e-4, steps.max_evaluations = options.evaluations;
  x = minimizeBySlsqp(
          x,
          [&](const VectorXd& at, VectorXd* gradient) {
            const double cost = calcCost(at);
            if (gradient)
              for (Eigen::Index i = 0; i < at.size(); ++i)
                (*gradient)[i] = (calcCost(at + kStep * VectorXd::Unit(at.size(), i)) - cost) / kStep;
            best = std::max(best, -cost);
            if (options.progress) goes_on = goes_on && options.progress(best);
            return cost;
          },
          steps)
          .x;
  const auto rows = static_cast<Eigen::Index>(std::lround(options.duration / period)) + 1;
  out.time = VectorXd::LinSpaced(rows, 0, options.duration);
  for (int shrinks = 0;; x *= kShrink) {
    if (++shrinks > kMostShrinks)
      throw InputError(model.name(), "limits", "they are exceeded however little it moves from where it begins",
                       "raise the limits of its motors");
    LoadedMotion motion = search.move(x, out.time);
    out.share_of_limits = search.calcShare(motion);
    if (static_cast<Eigen::Index>(motion.states.size()) < rows || out.share_of_limits > 1) continue;
    out.states = std::move(motion.states);
    break;
  }
  out.gain = search.calcGain(search.move(x, few));
  return out;
}

}  // namespace bielle
