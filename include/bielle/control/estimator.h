#pragma once
/// \file The state of a robot from its own sensors: encoders of the motors and an inertial measurement unit in the trunk.
///
/// **Joints.** The passive joints follow from the motors by closing the loops; status and margin tell when a linkage is
/// near a dead point, where they do not. Motor speeds come from observers that follow the encoders,
///     e = y - x,    x' = w + 2 s e,    w' = s^2 e,    s = bandwidth                                                 (1)
/// which lag by 2/s and pass s^(3/2) sqrt(h)/2 of the noise of readings that are h apart.
///
/// **Trunk.** Its pose and velocity come from an invariant extended Kalman filter of the IMU and the standing feet, offsets of
/// the IMU included (src/control/contact_filter.h gives its equations and sources). Position and heading are known from the
/// start and drift from step to step.
///
/// **Contacts.** The forces on the feet follow from the torques of the motors, the motion of the robot and its dynamics, at
/// accelerations behind a low-pass filter. A foot stands when its normal force exceeds a share of the weight of the robot,
/// until it falls below half of it; where a contact is planned a smaller share suffices. Early and late landings are
/// thus detected. A standing foot that moves far more than the filter expects has slipped, and gets a new place.
#include <memory>
#include <string>
#include <vector>

#include "bielle/control/controller.h"
#include "bielle/model/options.h"

namespace bielle {

/// Sensor readings at one instant of control. IMU readings are means since the previous instant.
struct SensorReadings {
  double time = 0;                               ///< s
  VectorXd motor_positions;                      ///< nu, rad or m
  VectorXd motor_torques;                        ///< nu, torques that acted since the previous instant, N m or N
  Vector3d angular_velocity = Vector3d::Zero();  ///< of the IMU in its frame, rad/s
  Vector3d specific_force = Vector3d::Zero();    ///< acceleration minus gravity in its frame, m/s^2
};

struct EstimatorOptions {
  SE3 imu;                  ///< placement of the IMU in the trunk, the body of the free-flyer
  double bandwidth = 1000;  ///< s of Eq. (1), 1/s
  double smoothing = 3e-3;  ///< time constant of the accelerations, s

  // Noise, one standard deviation; densities as in data sheets.
  double gyro_noise = 3e-4;           ///< rad/s/sqrt(Hz)
  double accelerometer_noise = 3e-3;  ///< m/s^2/sqrt(Hz)
  double gyro_offset = 0.02;          ///< at the start, rad/s
  double accelerometer_offset = 0.2;  ///< at the start, m/s^2
  double gyro_walk = 1e-4;            ///< change of the offset in one second, rad/s
  double accelerometer_walk = 1e-3;   ///< m/s^2
  double tilt = 3e-3;                 ///< of the trunk at the start, rad
  double foot_position = 3e-4;        ///< position of a foot from the encoders, m
  double foot_attitude = 1e-3;        ///< rad
  double foot_slide = 5e-4;           ///< motion of a standing foot in one second, m
  double foot_turn = 2e-3;            ///< rad

  double planned_contact = 0.08, surprising_contact = 0.25;  ///< normal forces of standing feet relative to the weight
  double slip =
      60;  ///< a sole has slipped if y' S^-1 y of its deviation, 6 on average, exceeds this; others at half of it
};
/// Without the placement of the IMU.
void describe(OptionFields& fields, EstimatorOptions& options);

/// Independent of any simulator: the same object can run on a robot. update() neither allocates nor throws.
class Estimator {
 public:
  /// \param q  closed configuration, e.g. a posture
  /// \throws InputError when motors do not determine a joint other than the free-flyer of the trunk
  Estimator(const Model& model, ConstVectorRef q, const EstimatorOptions& options = {});
  ~Estimator();
  Estimator(Estimator&&) noexcept;

  /// Starts from a closed configuration (nq) and velocity (nv), standing on the given contacts of the model.
  void reset(double time, ConstVectorRef q, ConstVectorRef v, const std::vector<int>& contacts);
  /// \param planned  contacts in the plan at this time; empty if there is no plan
  /// \return NearDeadPoint: message() names the linkage; NotClosed: no closed configuration fits the motors, the last
  /// one is kept; NotFinite: the readings are ignored
  NumericalStatus update(const SensorReadings& readings, const std::vector<int>& planned);

  const Measurement& measurement() const;           ///< as of the last update()
  const std::vector<char>& contacts() const;        ///< per contact of the model, whether it stands
  const Vector6d& getWrench(size_t contact) const;  ///< of the ground on a foot in its contact frame, N and N m
  /// The least that motors move in a unit motion of their linkage; 1 without linkages.
  double margin() const;
  std::string message() const;  ///< of the last status; empty if it is Ok

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace bielle
