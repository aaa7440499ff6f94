#include "design/gradient.h"

#include <algorithm>
#include <cmath>

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
