#include "design/gradient.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "bielle/dynamics/distance.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr int kStretches = 12;  // of a motion, for peaks

int countNodes(const MotorSlopes& motion) { return static_cast<int>(motion.dt.size()); }

MeasurePieces makePieces(size_t pieces, size_t variables) {
  const auto rows = static_cast<Eigen::Index>(pieces), columns = static_cast<Eigen::Index>(variables);
  return {VectorXd::Zero(rows), MatrixXd::Zero(rows, columns)};
}

// Eq. (1)
void addRms(const MotorSlopes& motion, int m, Eigen::Index piece, MeasurePieces& out) {
  double duration = 0, squares = 0;
  for (int k = 0; k < countNodes(motion); ++k) {
    duration += motion.dt[k];
    squares += motion.dt[k] * motion.u(m, k) * motion.u(m, k);
  }
  const double value = duration > 0 ? std::sqrt(squares / duration) : 0;
  if (value == 0) return;
  out.values[piece] = value;
  for (size_t i = 0; i < motion.du.size(); ++i)
    for (int k = 0; k < countNodes(motion); ++k)
      out.gradients(piece, i) += motion.dt[k] * motion.u(m, k) * motion.du[i](m, k) / (duration * value);
}

// Eq. (2)
void addEnergy(const MotorSlopes& motion, int m, MeasurePieces& out) {
  for (int k = 0; k < countNodes(motion); ++k) {
    const double u = motion.u(m, k), v = motion.v(m, k);
    out.values[0] += motion.dt[k] * std::abs(u * v);
    for (size_t i = 0; i < motion.du.size(); ++i)
      out.gradients(0, i) += motion.dt[k] * (u * v < 0 ? -1 : 1) * (motion.du[i](m, k) * v + u * motion.dv[i](m, k));
  }
}

// Eq. (2) with the power at the terminals.
void addElectricalEnergy(const MotorSlopes& motion, int m, const RobotSlopes& robot, MeasurePieces& out) {
  const MotorConversion drive = robot.drives.empty() ? MotorConversion() : robot.drives[static_cast<size_t>(m)];
  const double heat = 1 / (drive.motor_constant * drive.motor_constant);
  const auto getChange = [&](size_t i, MotorFactor factor) {
    return robot.dfactors.empty() ? 0 : robot.dfactors[i](factor, m);
  };
  for (int k = 0; k < countNodes(motion); ++k) {
    const double v = motion.v(m, k), c = drive.getEffortFactor(motion.u(m, k) * v), u = c * motion.u(m, k);
    const MotorFactor gear = motion.u(m, k) * v >= 0 ? kDriving : kDriven;
    const double P = u * v + heat * u * u, weight = motion.dt[k] * (P < 0 ? drive.regeneration : 1);
    out.values[0] += weight * P;
    for (size_t i = 0; i < motion.du.size(); ++i)
      out.gradients(0, i) +=
          weight * ((v + 2 * heat * u) * (c * motion.du[i](m, k) + getChange(i, gear) * motion.u(m, k)) +
                    u * motion.dv[i](m, k) + u * u * getChange(i, kLoss));
  }
}

// Eq. (1) of c u over the continuous torque.
void addHeat(const MotorSlopes& motion, int m, const RobotSlopes& robot, Eigen::Index piece, MeasurePieces& out) {
  const Motor& motor = robot.motors[static_cast<size_t>(m)];
  MotorSlopes scaled;
  scaled.dt = motion.dt;
  VectorXd c(countNodes(motion));
  for (int k = 0; k < countNodes(motion); ++k) c[k] = motor.getEffortFactor(motion.u(m, k) * motion.v(m, k));
  scaled.u = motion.u.row(m) * c.asDiagonal();
  for (size_t i = 0; i < motion.du.size(); ++i) {
    scaled.du.emplace_back(motion.du[i].row(m) * c.asDiagonal());
    for (int k = 0; k < countNodes(motion); ++k)
      scaled.du.back()(0, k) +=
          robot.dfactors[i](motion.u(m, k) * motion.v(m, k) >= 0 ? kDriving : kDriven, m) * motion.u(m, k);
  }
  addRms(scaled, 0, piece, out);
  const double rms = out.values[piece], per_effort = robot.factors(kPerContinuous, m);
  out.values[piece] *= per_effort;
  out.gradients.row(piece) *= per_effort;
  for (size_t i = 0; i < motion.du.size(); ++i) out.gradients(piece, i) += rms * robot.dfactors[i](kPerContinuous, m);
}

// Nodes of a stretch: begin, end.
std::pair<int, int> getStretch(int nodes, int stretch) {
  return {stretch * nodes / kStretches, (stretch + 1) * nodes / kStretches};
}

// The largest share of a limit in a stretch. Without duration there is no voltage: that of an impact is not known.
void addEnvelope(const MotorSlopes& motion, int m, int stretch, const RobotSlopes& robot, Eigen::Index piece,
                 MeasurePieces& out) {
  const auto [begin, end] = getStretch(countNodes(motion), stretch);
  const std::pair<MotorFactor, MotorFactor> kinds[] = {
      {kPerEffort, kMotorFactors}, {kMotorFactors, kPerSpeed}, {kVoltsPerEffort, kVoltsPerSpeed}};
  const auto get = [m](const MotorFactors& factors, MotorFactor factor) {
    return factor == kMotorFactors ? 0.0 : factors(factor, m);
  };
  for (int k = begin; k < end; ++k)
    for (const auto& [of_u, of_v] : kinds) {
      if (of_u == kVoltsPerEffort && !(motion.dt[k] > 0)) continue;
      const double u = motion.u(m, k), v = motion.v(m, k), by_u = get(robot.factors, of_u),
                   by_v = get(robot.factors, of_v), share = by_u * u + by_v * v;
      if (!(std::abs(share) > out.values[piece])) continue;
      out.values[piece] = std::abs(share);
      for (size_t i = 0; i < motion.du.size(); ++i) {
        const double change = by_u * motion.du[i](m, k) + get(robot.dfactors[i], of_u) * u + by_v * motion.dv[i](m, k) +
                              get(robot.dfactors[i], of_v) * v;
        out.gradients(piece, i) = share < 0 ? -change : change;
      }
    }
}

// Eq. (3)
void addPeak(const MotorSlopes& motion, int m, int stretch, Eigen::Index piece, MeasurePieces& out) {
  const auto [begin, end] = getStretch(countNodes(motion), stretch);
  for (int k = begin; k < end; ++k) {
    if (!(std::abs(motion.u(m, k)) > out.values[piece])) continue;
    out.values[piece] = std::abs(motion.u(m, k));
    for (size_t i = 0; i < motion.du.size(); ++i)
      out.gradients(piece, i) = motion.u(m, k) < 0 ? -motion.du[i](m, k) : motion.du[i](m, k);
  }
}

// Positions among the kept dofs of those of each loop cluster.
std::vector<std::vector<int>> groupByCluster(const Model& model, const std::vector<int>& kept) {
  std::vector<std::vector<int>> out;
  for (const LoopCluster& cluster : model.clusters()) {
    out.emplace_back();
    for (size_t i = 0; i < kept.size(); ++i)
      if (std::binary_search(cluster.dofs.begin(), cluster.dofs.end(), kept[i]))
        out.back().push_back(static_cast<int>(i));
  }
  return out;
}

// w of Eq. (4), as speeds of all kept dofs.
VectorXd findFastest(const MatrixXd& T, const std::vector<int>& columns) {
  MatrixXd T_c(T.rows(), columns.size());
  for (size_t i = 0; i < columns.size(); ++i) T_c.col(static_cast<Eigen::Index>(i)) = T.col(columns[i]);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(T_c.transpose() * T_c);
  VectorXd w = VectorXd::Zero(T.cols());
  for (size_t i = 0; i < columns.size(); ++i) w[columns[i]] = solver.eigenvectors()(i, T_c.cols() - 1);
  return w;
}

}  // namespace

bool hasGradient(Measure measure) {
  switch (measure) {
    case Measure::PeakTorque:
    case Measure::RmsTorque:
    case Measure::Energy:
    case Measure::ElectricalEnergy:
    case Measure::Cost:
    case Measure::Mass:
    case Measure::Envelope:
    case Measure::Heat:
    case Measure::Margin:
    case Measure::Distance:
      return true;
    default:
      return false;
  }
}

namespace {

// Distances of the nearest shapes along a kept motion.
class DistanceRecorder {
 public:
  DistanceRecorder(const Model& model, const BodyPairs& left_out, const std::vector<VectorXd>& xs,
                   const std::vector<ModelVariation>& variations)
      : model_(model), variations_(variations), pairs_(listPairsBut(left_out, model)), ws_(model), workspace_(model) {
    if (pairs_.empty()) return;
    distance_.resize(static_cast<Eigen::Index>(xs.size()));
    for (Eigen::Index k = 0; k < distance_.size(); ++k)
      distance_[k] = find(xs[static_cast<size_t>(k)]).distance.distance;
    for (const auto& [row, node] : listLeast(distance_)) nodes_.insert(node);
    slopes_.assign(variations.size(), Eigen::RowVectorXd::Zero(distance_.size()));
  }

  bool isAsked(Eigen::Index k) const { return nodes_.count(k) > 0; }
  // At node k, by variation i, with the change of q that goes with it.
  void record(Eigen::Index k, const VectorXd& x, size_t i, const VectorXd& dq) {
    const NearestPair nearest = find(x);
    const ShapePair& pair = pairs_[static_cast<size_t>(nearest.pair)];
    const VectorXd still = VectorXd::Zero(model_.nv());
    updateVelocities(model_, ws_, still);
    updateAccelerations(model_, ws_, still);
    MotionVariation motion(model_);
    motion.q = dq;
    updateVariation(model_, ws_, variations_[i], motion, workspace_);
    slopes_[i][k] = calcDistanceVariation(model_, ws_, pair.a, pair.b, nearest.distance, variations_[i], workspace_);
  }
  void take(MotorSlopes& out) {
    out.distance = std::move(distance_);
    out.ddistance = std::move(slopes_);
  }

 private:
  NearestPair find(const VectorXd& x) {
    updatePositions(model_, ws_, x.head(model_.nq()));
    return findNearestPair(model_, ws_.X_WB, pairs_);
  }

  const Model& model_;
  const std::vector<ModelVariation>& variations_;
  std::vector<ShapePair> pairs_;
  Workspace ws_;
  VariationWorkspace workspace_;
  Eigen::RowVectorXd distance_;
  std::vector<Eigen::RowVectorXd> slopes_;
  std::set<Eigen::Index> nodes_;
};

class SlopeRecorder {
 public:
  SlopeRecorder(const Model& model, const std::vector<int>& kept, const std::vector<double>& dt,
                const std::vector<ModelVariation>& variations)
      : model_(model),
        variations_(variations),
        clusters_(groupByCluster(model, kept)),
        motion_(model, kept),
        variation_(model) {
    const Eigen::Index N = static_cast<Eigen::Index>(dt.size()), c = static_cast<Eigen::Index>(clusters_.size());
    const MatrixXd of_motors = MatrixXd::Zero(model.nu(), N), of_clusters = MatrixXd::Zero(c, N);
    out_.dt = dt, out_.u = out_.v = of_motors, out_.margin = of_clusters;
    out_.du.assign(variations.size(), of_motors), out_.dv = out_.du;
    out_.dmargin.assign(variations.size(), of_clusters);
  }

  NumericalStatus record(int k, const SerialTrajectory& trajectory, const LiftResult& lifted) {
    const NumericalStatus status = motion_.update(lifted.constraints[k], lifted.trajectory.xs[k].head(model_.nq()),
                                                  trajectory.v[k], trajectory.a[k], trajectory.forces[k]);
    if (status != NumericalStatus::Ok) return status;
    write(k, motion_.u(), motion_.v(), out_.u, out_.v);
    std::vector<VectorXd> fastest;
    for (size_t c = 0; c < clusters_.size(); ++c) {
      fastest.push_back(findFastest(motion_.tangent(), clusters_[c]));
      out_.margin(c, k) = 1 / (motion_.tangent() * fastest[c]).squaredNorm();
    }
    for (size_t i = 0; i < variations_.size(); ++i) {
      const NumericalStatus varied = motion_.calcVariation(variations_[i], variation_);
      if (varied != NumericalStatus::Ok) return varied;
      write(k, variation_.u, variation_.motion.v, out_.du[i], out_.dv[i]);
      if (distances_ && distances_->isAsked(k))
        distances_->record(k, lifted.trajectory.xs[static_cast<size_t>(k)], i, variation_.motion.q);
      for (size_t c = 0; c < clusters_.size(); ++c) {
        const double slope = (motion_.tangent() * fastest[c])
                                 .dot(motion_.calcTangentVariation(variations_[i], variation_.motion, fastest[c]));
        out_.dmargin[i](c, k) = -2 * slope * out_.margin(c, k) * out_.margin(c, k);  // Eq. (4)
      }
    }
    return status;
  }

  void setDistances(DistanceRecorder* distances) { distances_ = distances; }
  MotorSlopes take() { return std::move(out_); }

 private:
  void write(int k, const VectorXd& u, const VectorXd& v, MatrixXd& to_u, MatrixXd& to_v) const {
    if (out_.dt[k] > 0) to_u.col(k) = u;
    for (int m = 0; m < model_.nu(); ++m) to_v(m, k) = v[model_.motors()[m].dof];
  }

  const Model& model_;
  const std::vector<ModelVariation>& variations_;
  std::vector<std::vector<int>> clusters_;
  KeptMotion motion_;
  KeptMotion::Variation variation_;
  MotorSlopes out_;
  DistanceRecorder* distances_ = nullptr;
};

}  // namespace

MotorSlopes calcMotorSlopes(const Model& model, const std::vector<int>& kept_dofs, const SerialTrajectory& trajectory,
                            const LiftResult& lifted, const std::vector<ModelVariation>& variations,
                            const BodyPairs* left_out) {
  SlopeRecorder recorder(model, kept_dofs, lifted.dt, variations);
  std::optional<DistanceRecorder> least;
  if (left_out) {
    const std::vector<VectorXd>& xs = lifted.trajectory.xs;
    least.emplace(model, *left_out,
                  std::vector<VectorXd>(xs.begin(), xs.begin() + static_cast<std::ptrdiff_t>(lifted.dt.size())),
                  variations);
    recorder.setDistances(&*least);
  }
  for (int k = 0; k < static_cast<int>(lifted.dt.size()); ++k) {
    const NumericalStatus status = recorder.record(k, trajectory, lifted);
    if (status == NumericalStatus::Ok) continue;
    MotorSlopes out;
    out.failure = "no gradient at node " + std::to_string(k) + ": " + getMessage(status);
    return out;
  }
  MotorSlopes out = recorder.take();
  if (least) least->take(out);
  return out;
}

void append(const MeasurePieces& pieces, MeasurePieces& all) {
  const Eigen::Index old = all.values.size(), size = pieces.values.size();
  if (size == 0) return;
  all.values.conservativeResize(old + size);
  all.values.tail(size) = pieces.values;
  all.gradients.conservativeResize(old + size, pieces.gradients.cols());
  all.gradients.bottomRows(size) = pieces.gradients;
}

namespace {

// Of one motion.
MeasurePieces calcMotionPieces(Measure measure, const std::vector<int>& motors, const MotorSlopes& motion,
                               const RobotSlopes& robot) {
  if (measure == Measure::Cost) return {VectorXd::Constant(1, motion.cost), motion.dcost.transpose()};
  const bool peaks = measure == Measure::PeakTorque || measure == Measure::Envelope;
  const int stretches = peaks ? kStretches : 1;
  MeasurePieces out = makePieces(isSum(measure) ? 1 : motors.size() * static_cast<size_t>(stretches), motion.du.size());
  Eigen::Index piece = 0;
  for (int m : motors) {
    if (measure == Measure::Energy) addEnergy(motion, m, out);
    if (measure == Measure::ElectricalEnergy) addElectricalEnergy(motion, m, robot, out);
    if (measure == Measure::RmsTorque) addRms(motion, m, piece, out);
    if (measure == Measure::Heat) addHeat(motion, m, robot, piece, out);
    for (int s = 0; s < stretches; ++s, ++piece) {
      if (measure == Measure::PeakTorque) addPeak(motion, m, s, piece, out);
      if (measure == Measure::Envelope) addEnvelope(motion, m, s, robot, piece, out);
    }
  }
  return out;
}

}  // namespace

MeasurePieces calcMeasurePieces(Measure measure, const std::vector<int>& motors,
                                const std::vector<MotorSlopes>& motions, const std::vector<double>& weights,
                                const RobotSlopes& robot) {
  if (measure == Measure::Mass) return {VectorXd::Constant(1, robot.mass), robot.dmass.transpose()};
  MeasurePieces out;
  if (isSum(measure)) out = makePieces(1, motions.front().du.size());
  for (size_t i = 0; i < motions.size(); ++i) {
    MeasurePieces pieces = calcMotionPieces(measure, motors, motions[i], robot);
    const double weight = weights.empty() ? 1 : weights[i];
    pieces.values *= weight;
    pieces.gradients *= weight;
    if (!isSum(measure)) {
      append(pieces, out);
      continue;
    }
    out.values += pieces.values;
    out.gradients += pieces.gradients;
  }
  return out;
}

std::vector<std::pair<Eigen::Index, Eigen::Index>> listLeast(const MatrixXd& values) {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> out;
  for (Eigen::Index row = 0; row < values.rows(); ++row)
    for (int s = 0; s < kStretches; ++s) {
      const auto [begin, end] = getStretch(static_cast<int>(values.cols()), s);
      Eigen::Index least = 0;
      if (begin == end) continue;
      values.row(row).segment(begin, end - begin).minCoeff(&least);
      out.emplace_back(row, begin + least);
    }
  return out;
}

namespace {

// One entry of a matrix and of its derivatives.
template <typename Matrix>
MeasurePieces getPiece(const Matrix& value, const std::vector<Matrix>& derivatives, Eigen::Index row,
                       Eigen::Index column) {
  MeasurePieces out = makePieces(1, derivatives.size());
  out.values[0] = value(row, column);
  for (size_t i = 0; i < derivatives.size(); ++i)
    out.gradients(0, static_cast<Eigen::Index>(i)) = derivatives[i](row, column);
  return out;
}

}  // namespace

MeasurePieces calcMarginPieces(double least, const std::vector<MotorSlopes>& motions) {
  MeasurePieces out;
  for (const MotorSlopes& motion : motions)
    for (const auto& [cluster, node] : listLeast(motion.margin))
      append(getPiece(motion.margin, motion.dmargin, cluster, node), out);
  out.values = least * least - out.values.array();
  out.gradients *= -1;
  return out;
}

MeasurePieces calcDistancePieces(const std::vector<MotorSlopes>& motions) {
  MeasurePieces out;
  for (const MotorSlopes& motion : motions)
    for (const auto& [row, node] : listLeast(motion.distance))
      append(getPiece(motion.distance, motion.ddistance, row, node), out);
  return out;
}

}  // namespace bielle
