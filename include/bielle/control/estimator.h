#pragma once
/// \file The state of a robot from its own sensors: encoders of the motors and an inertial measurement unit in the trunk.
///
/// **Joints.** The passive joints follow from the motors by closing the loops; status and margin say when a linkage is near a
/// dead point, where they do not. Speeds of the motors are those of observers that follow the encoders,
///     e = y - x,    x' = w + 2 s e,    w' = s^2 e,    s = bandwidth                                                 (1)
/// which lag behind by 2/s and let pass s^(3/2) sqrt(h)/2 of the deviation of the readings, h apart.
///
/// **Trunk.** Its pose and velocity come from an invariant extended Kalman filter of the IMU and the standing feet, offsets of
/// the IMU included (src/control/contact_filter.h gives its equations and sources). Position and heading are known from the
/// start and drift from step to step.
///
/// **Contacts.** The forces on the feet follow from the torques of the motors, the motion of the robot and its dynamics, at
/// accelerations behind a low-pass filter. A foot stands when its normal force exceeds a share of the weight of the robot,
/// until it falls below half of it; where a contact is planned a smaller share suffices. So feet that land early or late are
/// noticed. A standing foot that moves by far more than the filter expects has slipped, and is put down anew.
#include <memory>
#include <string>
#include <vector>

#include "bielle/control/controller.h"

namespace bielle {

/// What is read at an instant of control. The IMU gives means since the instant before.
struct SensorReadings {
  double time = 0;                               ///< s
  VectorXd motor_positions;                      ///< nu, rad or m
  VectorXd motor_torques;                        ///< nu, that acted since the instant before, N m or N
  Vector3d angular_velocity = Vector3d::Zero();  ///< of the IMU in its frame, rad/s
  Vector3d specific_force = Vector3d::Zero();    ///< acceleration less gravity in its frame, m/s^2
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
  double gyro_walk = 1e-4;            ///< of the offsets in a second, rad/s
  double accelerometer_walk = 1e-3;   ///< m/s^2
  double tilt = 3e-3;                 ///< of the trunk at the start, rad
  double foot_position = 3e-4;        ///< of a foot seen by the encoders, m
  double foot_attitude = 1e-3;        ///< rad
  double foot_slide = 5e-4;           ///< of a foot that stands, in a second, m
  double foot_turn = 2e-3;            ///< rad

  double planned_contact = 0.08, surprising_contact = 0.25;  ///< normal forces of feet that stand, over the weight
  double slip = 60;  ///< a foot has slipped if y' S^-1 y of its deviation, 6 in the mean, exceeds this
};

enum class EstimatorStatus {
  Ok,
  NearDeadPoint,  ///< a linkage hardly follows its motors: getMessage() names it
  NotClosed,      ///< no closed configuration belongs to the motors: the last one is kept
  NotFinite       ///< readings were not finite and are ignored
};

/// No simulator in it: the same object would run on the robot. update() neither allocates nor throws.
class Estimator {
 public:
  /// \param model  must outlive it   \param q  closed configuration, e.g. a posture
  /// \throws ModelError when motors do not determine a joint other than the free-flyer of the trunk
  Estimator(const Model& model, ConstVectorRef q, const EstimatorOptions& options = {});
  ~Estimator();
  Estimator(Estimator&&) noexcept;

  /// Starts from a closed configuration (nq) and velocity (nv), standing on the given contacts of the model.
  void reset(double time, ConstVectorRef q, ConstVectorRef v, const std::vector<int>& contacts);
  /// \param planned  contacts that the plan has now; empty if there is no plan
  EstimatorStatus update(const SensorReadings& readings, const std::vector<int>& planned);

  const Measurement& getMeasurement() const;        ///< as of the last update()
  const std::vector<char>& getContacts() const;     ///< per contact of the model, whether it stands
  const Vector6d& getWrench(size_t contact) const;  ///< of the ground on a foot in its contact frame, N and N m
  /// The least that motors move in a unit motion of their linkage; 1 without linkages.
  double getMargin() const;
  std::string getMessage() const;  ///< of the last status; empty if it is Ok

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace bielle
