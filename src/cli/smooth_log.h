#pragma once
// Columns of a log made smooth, with their derivatives.
#include <map>
#include <string>
#include <vector>

#include "identify/local_polynomial.h"
#include "identify/log.h"
#include "identify/log_fit.h"

namespace bielle::cli {

// A position that a log may have: of a joint with one coordinate, or of a universal joint.
struct Coordinate {
  std::string name, speed;  // columns
  int joint = 0, position = 0, dof = 0;
};
std::vector<Coordinate> listCoordinates(const Model& model);

// Speeds are derivatives of positions where they are not logged.
class SmoothLog {
 public:
  SmoothLog(const MotionLog& log, double window);  // s, of the polynomials
  double window() const { return window_; }
  const std::vector<double>& instants() const { return centres_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(centres_.size()); }
  // Without instants in whose windows a joint is at its limit, where a stop may bear it. \returns their number
  int leaveOutStops(const Model& model, const std::vector<Coordinate>& coordinates,
                    const std::map<std::string, double>& offsets);

  // \param offsets  of the columns of positions, by name   \param coordinates  of the model
  Smoothed getMotion(const std::string& position, const std::string& speed,
                     const std::map<std::string, double>& offsets) const;
  Smoothed getMotions(const std::vector<Coordinate>& coordinates, const std::vector<LinkageSensor>& sensors,
                      const std::map<std::string, double>& offsets) const;
  // Instants x nu; 0 for motors without a column.
  MatrixXd getTorques(const Model& model) const;
  // Standard deviations of one reading, from how it differs from those beside it (nu).
  VectorXd getTorqueNoise(const Model& model) const;
  // LoadedState::signs of motors whose positions are logged; empty if there is another one.
  MatrixXd getSigns(const Model& model, const std::vector<Coordinate>& coordinates) const;

 private:
  Smoothed getColumn(const VectorXd& time, int column, Eigen::Index rows) const;

  const MotionLog& log_;
  double window_;
  std::vector<double> centres_;
};

}  // namespace bielle::cli
