#include "design/gradient.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"

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
void addElectricalEnergy(const MotorSlopes& motion, int m, const MotorConversion& drive, MeasurePieces& out) {
  const double heat = 1 / (drive.motor_constant * drive.motor_constant);
  for (int k = 0; k < countNodes(motion); ++k) {
    const double u = motion.u(m, k), v = motion.v(m, k), P = u * v + heat * u * u;
    const double weight = motion.dt[k] * (P < 0 ? drive.regeneration : 1);
    out.values[0] += weight * P;
    for (size_t i = 0; i < motion.du.size(); ++i)
      out.gradients(0, i) += weight * ((v + 2 * heat * u) * motion.du[i](m, k) + u * motion.dv[i](m, k));
  }
}

// Nodes of a stretch: begin, end.
std::pair<int, int> getStretch(const MotorSlopes& motion, int stretch) {
  return {stretch * countNodes(motion) / kStretches, (stretch + 1) * countNodes(motion) / kStretches};
}

// Eq. (3)
void addPeak(const MotorSlopes& motion, int m, int stretch, Eigen::Index piece, MeasurePieces& out) {
  const auto [begin, end] = getStretch(motion, stretch);
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
      return true;
    default:
      return false;
  }
}

namespace {

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

  KeptMotionStatus record(int k, const SerialTrajectory& trajectory, const LiftResult& lifted) {
    const KeptMotionStatus status = motion_.update(lifted.constraints[k], lifted.trajectory.xs[k].head(model_.nq()),
                                                   trajectory.v[k], trajectory.a[k], trajectory.forces[k]);
    if (status != KeptMotionStatus::Ok) return status;
    write(k, motion_.u(), motion_.v(), out_.u, out_.v);
    std::vector<VectorXd> fastest;
    for (size_t c = 0; c < clusters_.size(); ++c) {
      fastest.push_back(findFastest(motion_.tangent(), clusters_[c]));
      out_.margin(c, k) = 1 / (motion_.tangent() * fastest[c]).squaredNorm();
    }
    for (size_t i = 0; i < variations_.size(); ++i) {
      const KeptMotionStatus varied = motion_.calcVariation(variations_[i], variation_);
      if (varied != KeptMotionStatus::Ok) return varied;
      write(k, variation_.u, variation_.motion.v, out_.du[i], out_.dv[i]);
      for (size_t c = 0; c < clusters_.size(); ++c) {
        const double slope = (motion_.tangent() * fastest[c])
                                 .dot(motion_.calcTangentVariation(variations_[i], variation_.motion, fastest[c]));
        out_.dmargin[i](c, k) = -2 * slope * out_.margin(c, k) * out_.margin(c, k);  // Eq. (4)
      }
    }
    return status;
  }

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
};

}  // namespace

MotorSlopes calcMotorSlopes(const Model& model, const std::vector<int>& kept_dofs, const SerialTrajectory& trajectory,
                            const LiftResult& lifted, const std::vector<ModelVariation>& variations) {
  SlopeRecorder recorder(model, kept_dofs, lifted.dt, variations);
  for (int k = 0; k < static_cast<int>(lifted.dt.size()); ++k) {
    const KeptMotionStatus status = recorder.record(k, trajectory, lifted);
    if (status == KeptMotionStatus::Ok) continue;
    MotorSlopes out;
    out.failure = "no gradient at node " + std::to_string(k) + ": " + getMessage(status);
    return out;
  }
  return recorder.take();
}

MeasurePieces calcMeasurePieces(Measure measure, const std::vector<int>& motors,
                                const std::vector<MotorSlopes>& motions, const std::vector<MotorConversion>& drives) {
  const size_t variables = motions.front().du.size(), pairs = motors.size() * motions.size();
  const int stretches = measure == Measure::PeakTorque ? kStretches : 1;
  const bool sum = measure == Measure::Energy || measure == Measure::ElectricalEnergy;
  MeasurePieces out = makePieces(sum ? 1 : pairs * stretches, variables);
  Eigen::Index piece = 0;
  for (const MotorSlopes& motion : motions)
    for (int m : motors) {
      if (measure == Measure::Energy) addEnergy(motion, m, out);
      if (measure == Measure::ElectricalEnergy)
        addElectricalEnergy(motion, m, drives.empty() ? MotorConversion() : drives[static_cast<size_t>(m)], out);
      if (measure == Measure::RmsTorque) addRms(motion, m, piece, out);
      for (int s = 0; s < stretches; ++s, ++piece)
        if (measure == Measure::PeakTorque) addPeak(motion, m, s, piece, out);
    }
  return out;
}

MeasurePieces calcCostPiece(const std::vector<MotorSlopes>& motions) {
  MeasurePieces out = makePieces(1, motions.front().du.size());
  for (const MotorSlopes& motion : motions) {
    out.values[0] += motion.cost;
    out.gradients.row(0) += motion.dcost.transpose();
  }
  return out;
}

MeasurePieces calcMarginPieces(double least, const std::vector<MotorSlopes>& motions) {
  const Eigen::Index clusters = motions.front().margin.rows();
  MeasurePieces out = makePieces(motions.size() * clusters * kStretches, motions.front().dmargin.size());
  Eigen::Index piece = 0;
  for (const MotorSlopes& motion : motions)
    for (Eigen::Index c = 0; c < clusters; ++c)
      for (int s = 0; s < kStretches; ++s, ++piece) {
        out.values[piece] = least * least - 1;  // no margin is larger than 1
        const auto [begin, end] = getStretch(motion, s);
        for (int k = begin; k < end; ++k) {
          if (!(least * least - motion.margin(c, k) > out.values[piece])) continue;
          out.values[piece] = least * least - motion.margin(c, k);
          for (size_t i = 0; i < motion.dmargin.size(); ++i) out.gradients(piece, i) = -motion.dmargin[i](c, k);
        }
      }
  return out;
}

}  // namespace bielle
