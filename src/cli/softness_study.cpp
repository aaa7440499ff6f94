#include "cli/softness_study.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"

namespace bielle::cli {
namespace {

constexpr double kStride = 0.03;     // rad or m, between the postures that a sweep passes through
constexpr double kEndless = 3.1416;  // rad, to either side of a coordinate without limits
constexpr double kMoves = 0.05;      // of the largest: coordinates that move less would be bad to block
constexpr double kStands = 1e-6;     // of the largest: motors that move less stand
constexpr size_t kMostSigned = 6;    // motors whose signs are varied

// Postures from q on, in which one joint goes to its limit or as far as the loops close.
std::vector<VectorXd> follow(const Model& model, const VectorXd& q, const Joint& joint,
                             const std::vector<std::string>& held, double end) {
  std::vector<VectorXd> postures;
  LoopCloser closer(model, q, held);
  VectorXd at = q;
  const double start = q[joint.idx_q], way = end - start;
  const int count = static_cast<int>(std::ceil(std::abs(way) / kStride));
  for (int k = 1; k <= count; ++k) {
    at[joint.idx_q] = start + way * k / count;
    if (closer.close(at).status != NumericalStatus::Ok) break;
    bool within = true;
    for (const Joint& other : model.joints())
      if (other.nv == 1 && other.nq == 1)
        within &= at[other.idx_q] >= model.lowerLimits()[other.idx_v] - 1e-6 &&
                  at[other.idx_q] <= model.upperLimits()[other.idx_v] + 1e-6;
    if (!within) break;
    postures.push_back(at);
  }
  return postures;
}

double getLargest(const VectorXd& displacement, const std::vector<int>& dofs) {
  double largest = 0;
  for (const int k : dofs) largest = std::max(largest, std::abs(displacement[k]));
  return largest;
}

Json makeNumber(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

}  // namespace

// The worst of several loads.
struct SoftnessStudy::Worst {
  bool is_loaded = false, holds = true;
  std::vector<ClosureGap> gap;
  std::vector<double> pull;
  VectorXd displacement;
};

SoftnessStudy::SoftnessStudy(const Model& model, const SoftLoops& loops, const VectorXd& q,
                             const SoftnessOptions& options, const std::vector<SoftnessInstant>& motion)
    : model_(model), loops_(loops), options_(options) {
  for (size_t c = 0; c < model.clusters().size(); ++c) {
    driven_.push_back(findDriven(static_cast<int>(c), q));
    if (motion.empty() && !listLoops(static_cast<int>(c)).empty()) addTasks(static_cast<int>(c), q);
  }
  for (const SoftnessInstant& instant : motion)
    for (size_t c = 0; c < model.clusters().size(); ++c)
      if (!listLoops(static_cast<int>(c)).empty()) tasks_.push_back({static_cast<int>(c), "", 0, instant.q, &instant});
}

std::vector<std::string> SoftnessStudy::listLoops(int cluster) const {
  std::vector<std::string> names;
  for (const int c : model_.clusters()[cluster].closures)
    if (std::any_of(loops_.equalities().begin(), loops_.equalities().end(),
                    [&](const SoftEquality& equality) { return equality.closure.name == model_.closures()[c].name; }))
      names.push_back(model_.closures()[c].name);
  return names;
}

std::vector<std::string> SoftnessStudy::listDriven(int cluster) const {
  std::vector<std::string> names;
  for (const int k : driven_[cluster]) names.push_back(model_.joints()[model_.dofs()[k].joint].name);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::vector<int> SoftnessStudy::listMotors(int cluster) const {
  const std::vector<int>& dofs = model_.clusters()[cluster].dofs;
  std::vector<int> motors;
  for (int m = 0; m < model_.nu(); ++m)
    if (std::binary_search(dofs.begin(), dofs.end(), model_.motors()[m].dof)) motors.push_back(m);
  return motors;
}

// Motors, or without any the coordinate that moves most.
void SoftnessStudy::addTasks(int cluster, const VectorXd& q) {
  const std::vector<int>& dofs = model_.clusters()[cluster].dofs;
  const MatrixXd N = loops_.makeClosedMotions(q, loops_.makeDirections(q, dofs));
  std::vector<int> swept;
  for (const int motor : listMotors(cluster)) swept.push_back(model_.motors()[motor].joint);
  if (swept.empty() && N.cols() > 0) {
    const auto measure = [&](int k) { return model_.joints()[model_.dofs()[k].joint].nv == 1 ? N.row(k).norm() : 0; };
    const int best = *std::max_element(dofs.begin(), dofs.end(), [&](int a, int b) { return measure(a) < measure(b); });
    if (measure(best) > 0) swept = {model_.dofs()[best].joint};
  }
  if (N.cols() == 0 || swept.empty()) {
    tasks_.push_back({cluster, "", 0, q});
    return;
  }
  std::vector<std::string> held;
  for (const int joint : swept) held.push_back(model_.joints()[joint].name);
  for (const int index : swept) {
    const Joint& joint = model_.joints()[index];
    const double start = q[joint.idx_q];
    const auto limit = [&](double end, double side) { return std::isfinite(end) ? end : start + side * kEndless; };
    std::vector<VectorXd> postures = follow(model_, q, joint, held, limit(model_.lowerLimits()[joint.idx_v], -1));
    std::reverse(postures.begin(), postures.end());
    postures.push_back(q);
    for (VectorXd& posture : follow(model_, q, joint, held, limit(model_.upperLimits()[joint.idx_v], 1)))
      postures.push_back(std::move(posture));
    const size_t count = std::min<size_t>(postures.size(), options_.postures);
    for (size_t k = 0; k < count; ++k) {
      const VectorXd& posture = postures[count == 1 ? 0 : k * (postures.size() - 1) / (count - 1)];
      tasks_.push_back({cluster, joint.name, posture[joint.idx_q], posture});
    }
  }
}

// Serial joints first, then what carries most, until no motor moves.
std::vector<int> SoftnessStudy::findDriven(int cluster, const VectorXd& q) const {
  Workspace ws(model_);
  updatePositions(model_, ws, q);
  updateMassMatrix(model_, ws);
  std::vector<int> motors, candidates;
  for (const int motor : listMotors(cluster)) motors.push_back(model_.motors()[motor].dof);
  for (const int k : model_.clusters()[cluster].dofs)
    if (std::find(motors.begin(), motors.end(), k) == motors.end()) candidates.push_back(k);
  const auto rank = [&](int k) {
    const std::vector<int>& serial = model_.serialJoints();
    const bool is_serial = std::find(serial.begin(), serial.end(), model_.dofs()[k].joint) != serial.end();
    return std::make_pair(is_serial, ws.M(k, k));
  };
  std::stable_sort(candidates.begin(), candidates.end(), [&](int a, int b) { return rank(a) > rank(b); });
  MatrixXd N = loops_.makeClosedMotions(q, loops_.makeDirections(q, model_.clusters()[cluster].dofs));
  std::vector<int> driven;
  const auto moves = [&] {
    return N.cols() > 0 && std::any_of(motors.begin(), motors.end(),
                                       [&](int k) { return N.row(k).norm() > kStands * N.cwiseAbs().maxCoeff(); });
  };
  while (moves()) {
    const auto k = std::find_if(candidates.begin(), candidates.end(),
                                [&](int c) { return N.row(c).norm() > kMoves * N.cwiseAbs().maxCoeff(); });
    if (k == candidates.end()) break;
    const MatrixXd row = N.row(*k);
    Eigen::JacobiSVD<MatrixXd> svd(row, Eigen::ComputeFullV);
    N = (N * svd.matrixV().rightCols(N.cols() - 1)).eval();
    driven.push_back(*k);
    candidates.erase(k);
  }
  std::sort(driven.begin(), driven.end());
  return driven;
}

// All motors at once, with all signs.
SoftnessStudy::Worst SoftnessStudy::calcMotors(const SoftnessTask& task) const {
  Worst worst;
  std::vector<int> motors, dofs;
  for (const int motor : listMotors(task.cluster))
    if (options_.torque || std::isfinite(model_.motors()[motor].effort_limit)) motors.push_back(motor);
  if (motors.empty()) return worst;
  worst.is_loaded = true;
  for (const int k : model_.clusters()[task.cluster].dofs)
    if (std::find(driven_[task.cluster].begin(), driven_[task.cluster].end(), k) == driven_[task.cluster].end())
      dofs.push_back(k);
  const MatrixXd Z = loops_.makeDirections(task.q, dofs);
  const size_t patterns = size_t{1} << (std::min(motors.size(), kMostSigned) - 1);
  for (size_t pattern = 0; pattern < patterns; ++pattern) {
    VectorXd tau = VectorXd::Zero(model_.nv());
    for (size_t i = 0; i < motors.size(); ++i) {
      const Motor& motor = model_.motors()[motors[i]];
      const double sign = pattern >> i & 1 ? -1 : 1;
      tau[motor.dof] = sign * options_.torque.value_or(motor.effort_limit);
    }
    const SoftRest rest = loops_.findRest(task.q, Z, tau);
    worst.holds &= rest.status == NumericalStatus::Ok;
    if (pattern == 0) {
      worst.gap = rest.gap, worst.pull = rest.pull, worst.displacement = rest.displacement.cwiseAbs();
      continue;
    }
    worst.displacement = worst.displacement.cwiseMax(rest.displacement.cwiseAbs());
    for (size_t e = 0; e < rest.gap.size(); ++e) {
      worst.gap[e].position = std::max(worst.gap[e].position, rest.gap[e].position);
      worst.gap[e].angle = std::max(worst.gap[e].angle, rest.gap[e].angle);
      worst.pull[e] = std::max(worst.pull[e], rest.pull[e]);
    }
  }
  return worst;
}

std::vector<int> SoftnessStudy::listPassive(int cluster) const {
  std::vector<int> passive;
  for (const int k : model_.clusters()[cluster].dofs)
    if (std::none_of(model_.motors().begin(), model_.motors().end(),
                     [&](const Motor& motor) { return motor.dof == k; }))
      passive.push_back(k);
  return passive;
}

// The forces of the loops are those of the motion.
std::vector<Json> SoftnessStudy::studyInstant(const SoftnessTask& task) const {
  const SoftnessInstant& at = *task.instant;
  Workspace ws(model_);
  const VectorXd others = calcInverseDynamics(model_, ws, at.q, at.v, at.a) - at.force;
  const std::vector<int> passive = listPassive(task.cluster);
  const SoftRest rest = loops_.findRest(at.q, at.v, at.a, loops_.makeDirections(at.q, passive), others);
  const bool holds = rest.status == NumericalStatus::Ok;
  const auto ifHolds = [&](double x) { return holds ? makeNumber(x) : Json(nullptr); };
  double error = 0;
  for (const int motor : listMotors(task.cluster)) {
    const int k = model_.motors()[motor].dof;
    error = std::max(error, std::abs(rest.load[k] - rest.rigid_load[k]));
  }
  const std::vector<int>& driven = driven_[task.cluster];
  std::vector<Json> rows;
  for (const std::string& loop : listLoops(task.cluster)) {
    ClosureGap gap;
    double pull = 0, bias = 0;
    for (size_t e = 0; e < loops_.equalities().size(); ++e) {
      if (loops_.equalities()[e].closure.name != loop) continue;
      gap.position = std::max(gap.position, rest.gap[e].position);
      gap.angle = std::max(gap.angle, rest.gap[e].angle);
      pull = std::max(pull, rest.pull[e]);
      bias = std::max(bias, rest.bias[e]);
    }
    rows.push_back({{"loop", loop},
                    {"time", at.time},
                    {"gap", ifHolds(gap.position)},
                    {"angle", ifHolds(gap.angle)},
                    {"sag", ifHolds(getLargest(rest.displacement, driven.empty() ? passive : driven))},
                    {"torque_error", ifHolds(error)},
                    {"pull", makeNumber(pull)},
                    {"bias", makeNumber(bias)},
                    {"state", kSoftnessStates[holds ? 0 : 2]}});
  }
  return rows;
}

std::vector<Json> SoftnessStudy::study(const SoftnessTask& task) const {
  if (task.instant) return studyInstant(task);
  const std::vector<int>& dofs = model_.clusters()[task.cluster].dofs;
  const std::vector<int> passive = listPassive(task.cluster);
  std::vector<int> motors;
  for (const int motor : listMotors(task.cluster)) motors.push_back(model_.motors()[motor].dof);
  const SoftRest rest = loops_.findRest(task.q, loops_.makeDirections(task.q, passive), VectorXd::Zero(model_.nv()));
  const Worst pulled = calcMotors(task);
  const bool holds = rest.status == NumericalStatus::Ok && pulled.holds;
  SoftMotion motion;
  if (rest.status == NumericalStatus::Ok) motion = loops_.calcMotion(task.q, rest, loops_.makeDirections(task.q, dofs));
  double error = 0;
  for (const int k : motors) error = std::max(error, std::abs(rest.load[k] - rest.rigid_load[k]));
  const std::vector<int>& driven = driven_[task.cluster];
  const double sag = getLargest(rest.displacement, driven.empty() ? passive : driven);
  const double pulled_sag = pulled.is_loaded ? getLargest(pulled.displacement, motors) : 0;

  std::vector<Json> rows;
  for (const std::string& loop : listLoops(task.cluster)) {
    ClosureGap gap, pulled_gap;
    double pull = 0;
    for (size_t e = 0; e < loops_.equalities().size(); ++e) {
      if (loops_.equalities()[e].closure.name != loop) continue;
      gap.position = std::max(gap.position, rest.gap[e].position);
      gap.angle = std::max(gap.angle, rest.gap[e].angle);
      pull = std::max(pull, rest.pull[e]);
      if (!pulled.is_loaded) continue;
      pulled_gap.position = std::max(pulled_gap.position, pulled.gap[e].position);
      pulled_gap.angle = std::max(pulled_gap.angle, pulled.gap[e].angle);
      pull = std::max(pull, pulled.pull[e]);
    }
    const auto ifHolds = [](bool holds, double x) { return holds ? makeNumber(x) : Json(nullptr); };
    const bool rests = rest.status == NumericalStatus::Ok, bears = pulled.is_loaded && pulled.holds;
    rows.push_back({{"loop", loop},
                    {"joint", task.joint},
                    {"position", task.position},
                    {"gap", ifHolds(rests, gap.position)},
                    {"angle", ifHolds(rests, gap.angle)},
                    {"sag", ifHolds(rests, sag)},
                    {"torque_error", ifHolds(rests, error)},
                    {"gap_at_limit", ifHolds(bears, pulled_gap.position)},
                    {"angle_at_limit", ifHolds(bears, pulled_gap.angle)},
                    {"sag_at_limit", ifHolds(bears, pulled_sag)},
                    {"frequency", ifHolds(rests, motion.frequency)},
                    {"frequency_error", ifHolds(rests, motion.frequency_error)},
                    {"energy_loss", ifHolds(rests, motion.energy_loss)},
                    {"stable_step", ifHolds(rests, motion.stable_step)},
                    {"pull", makeNumber(pull)},
                    {"state", kSoftnessStates[motion.diverges ? 3
                                              : !holds        ? 2
                                              : motion.falls  ? 1
                                                              : 0]}});
  }
  return rows;
}

}  // namespace bielle::cli
