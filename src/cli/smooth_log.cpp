#include "cli/smooth_log.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/names.h"
#include "identify/torque_fit.h"

namespace bielle::cli {
namespace {

double getOffset(const std::map<std::string, double>& offsets, const std::string& name) {
  const auto at = offsets.find(name);
  return at == offsets.end() ? 0 : at->second;
}

}  // namespace

std::vector<Coordinate> listCoordinates(const Model& model) {
  const std::vector<std::string> positions = makePositionNames(model), speeds = makeVelocityNames(model);
  std::vector<Coordinate> out;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[static_cast<size_t>(i)];
    if (joint.nq != 1 && joint.kind != JointKind::Universal) continue;
    for (int k = 0; k < joint.nq; ++k)
      out.push_back({positions[static_cast<size_t>(joint.idx_q + k)],
                     "v." + speeds[static_cast<size_t>(joint.idx_v + k)], i, joint.idx_q + k, joint.idx_v + k});
  }
  return out;
}

SmoothLog::SmoothLog(const MotionLog& log, double window) : log_(log), window_(window) {
  centres_ = listCentres(log.time, window_);
}

int SmoothLog::leaveOutStops(const Model& model, const std::vector<Coordinate>& coordinates,
                             const std::map<std::string, double>& offsets) {
  std::vector<double> times;
  for (const Coordinate& coordinate : coordinates) {
    const int column = log_.find(coordinate.name);
    if (column < 0) continue;
    const double zero = getOffset(offsets, coordinate.name);
    for (Eigen::Index k = 0; k < log_.time.size(); ++k)
      if (const double q = log_.values(k, column) - zero;
          q <= model.lowerLimits()[coordinate.dof] || q >= model.upperLimits()[coordinate.dof])
        times.push_back(log_.time[k]);
  }
  std::sort(times.begin(), times.end());
  const auto is_at_stop = [&](double centre) {
    const auto next = std::lower_bound(times.begin(), times.end(), centre - 0.5 * window_);
    return next != times.end() && *next <= centre + 0.5 * window_;
  };
  const size_t before = centres_.size();
  centres_.erase(std::remove_if(centres_.begin(), centres_.end(), is_at_stop), centres_.end());
  return static_cast<int>(before - centres_.size());
}

Smoothed SmoothLog::getMotion(const std::string& position, const std::string& speed,
                              const std::map<std::string, double>& offsets) const {
  Smoothed motion = getColumn(log_.time, log_.find(position), log_.time.size());
  motion.value.array() -= getOffset(offsets, position);
  if (const int column = log_.find(speed); column >= 0) {
    Smoothed rate = getColumn(log_.time, column, log_.time.size());
    motion.rate = std::move(rate.value), motion.acceleration = std::move(rate.rate);
  }
  return motion;
}

Smoothed SmoothLog::getMotions(const std::vector<Coordinate>& coordinates, const std::vector<LinkageSensor>& sensors,
                               const std::map<std::string, double>& offsets) const {
  Smoothed all;
  const auto count = static_cast<Eigen::Index>(sensors.size());
  for (MatrixXd* x : {&all.value, &all.rate, &all.acceleration}) x->resize(size(), count);
  for (Eigen::Index s = 0; s < count; ++s) {
    const std::string& name = sensors[static_cast<size_t>(s)].name;
    const auto own = std::find_if(coordinates.begin(), coordinates.end(),
                                  [&name](const Coordinate& one) { return one.name == name; });
    const Smoothed motion = getMotion(own->name, own->speed, offsets);
    all.value.col(s) = motion.value;
    all.rate.col(s) = motion.rate;
    all.acceleration.col(s) = motion.acceleration;
  }
  return all;
}

MatrixXd SmoothLog::getTorques(const Model& model) const {
  MatrixXd torques = MatrixXd::Zero(size(), model.nu());
  const Eigen::Index K = log_.time.size();
  for (int m = 0; m < model.nu(); ++m) {
    const int column = log_.find("u." + model.motors()[static_cast<size_t>(m)].name);
    if (column < 0) continue;
    // A torque that is held belongs to the middle of its time.
    const bool is_held = log_.isHeld(column);
    const VectorXd held = 0.5 * (log_.time.head(K - 1) + log_.time.tail(K - 1));
    torques.col(m) = getColumn(is_held ? held : log_.time, column, is_held ? K - 1 : K).value;
  }
  return torques;
}

VectorXd SmoothLog::getTorqueNoise(const Model& model) const {
  VectorXd noise = VectorXd::Zero(model.nu());
  for (int m = 0; m < model.nu(); ++m) {
    const int column = log_.find("u." + model.motors()[static_cast<size_t>(m)].name);
    if (column < 0) continue;
    const Eigen::Index K = log_.time.size() - (log_.isHeld(column) ? 1 : 0);
    if (K < 3) continue;
    const auto u = log_.values.col(column);
    // Of a line nothing is left, of independent noise 6 times its variance.
    const VectorXd bends = u.head(K - 2) - 2 * u.segment(1, K - 2) + u.segment(2, K - 2);
    noise[m] = std::sqrt(bends.squaredNorm() / (6 * static_cast<double>(K - 2)));
  }
  return noise;
}

MatrixXd SmoothLog::getSigns(const Model& model, const std::vector<Coordinate>& coordinates) const {
  MatrixXd speeds(log_.time.size(), model.nu());
  const std::vector<double> rows(log_.time.begin(), log_.time.end());
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[static_cast<size_t>(m)];
    const auto own = std::find_if(coordinates.begin(), coordinates.end(),
                                  [&motor](const Coordinate& one) { return one.dof == motor.dof; });
    const int position = log_.find(own->name), speed = log_.find(own->speed);
    if (position < 0 && speed < 0) return {};
    speeds.col(m) = speed >= 0 ? VectorXd(log_.values.col(speed))
                               : VectorXd(smooth(log_.time, log_.values.col(position), rows, window_).rate);
    for (double& value : speeds.col(m)) value = calcFrictionSign(model, motor, value);
  }
  return smooth(log_.time, speeds, centres_, window_).value;
}

Smoothed SmoothLog::getColumn(const VectorXd& time, int column, Eigen::Index rows) const {
  return smooth(time, log_.values.col(column).head(rows), centres_, window_);
}

}  // namespace bielle::cli
