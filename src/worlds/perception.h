#pragma once
/// \file What a controller knows of the robot: the truth, or what an estimator makes of sensors.
#include <optional>

#include "bielle/ocp/contact_schedule.h"
#include "bielle/worlds/sensors.h"

namespace bielle::worlds {

struct PerceptionOptions {
  std::optional<SensorOptions> sensors{};  ///< empty: the truth
  EstimatorOptions estimator{};            ///< `imu` is that of the sensors
};

/// Errors of an estimate over all instants. The truth goes nowhere else.
struct EstimationErrors {
  double position_rms = 0, position_max = 0;  ///< of the trunk, m
  double velocity_rms = 0, velocity_max = 0;  ///< of the trunk in the world, m/s
  double tilt_rms = 0, tilt_max = 0;          ///< of the trunk's vertical, rad
  double drift = 0;                           ///< of the trunk over the ground at the end, m
  double way = 0;                             ///< of the trunk over the ground from the start to the end, m
  double contact_errors = 0;                  ///< share of feet and time: standing without touching, or the reverse
};

class Perception {
 public:
  /// \param model  that the controller believes in   \param planned  tells the estimator where contacts are expected; empty: nothing
  Perception(const Model& model, const ContactSchedule& planned, const PerceptionOptions& options);

  /// From the state in which the world is. The estimator starts from q and v (nq, nv), where the plan does; the robot has stood
  /// there for two seconds, from which offsets of the IMU are known.
  void reset(const World& world, ConstVectorRef q, ConstVectorRef v);
  /// At the time of the world. No allocation. \param plan_time  at which the controller is in its plan, s
  const Measurement& update(const World& world, double plan_time);
  EstimationErrors errors() const;  ///< zero where the truth is known

 private:
  VectorXd calcRestTorques(ConstVectorRef q, const std::vector<int>& contacts) const;
  const std::vector<int>& getPlanned(double time) const;
  void addErrors(const World& world);

  Model model_;
  struct Period {
    double end = 0;  // s
    std::vector<int> contacts;
  };
  std::vector<Period> periods_;
  std::optional<Sensors> sensors_;
  std::optional<Estimator> estimator_;
  Measurement measurement_;
  Vector3d start_ = Vector3d::Zero();
  EstimationErrors errors_;  // sums until errors()
  long instants_ = 0;
};

}  // namespace bielle::worlds
