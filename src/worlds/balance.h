#pragma once
/// \file Whether a robot keeps standing: its capture point against its soles.
#include <optional>
#include <string>
#include <vector>

#include "bielle/control/controller.h"
#include "bielle/ocp/contact_schedule.h"
#include "bielle/worlds/world.h"
#include "worlds/terrain.h"

namespace bielle::worlds {

/// With gravity g along -n, the centre of mass c at height z over the soles and its time constant tau = sqrt(z / |g|),
/// the capture point is
///     x = c + tau dc/dt                                                                                            (1)
/// seen along n: where a linear inverted pendulum has to place its foot to come to rest (Pratt, Carff, Drakunov, Goswami,
/// Humanoids 2006). As long as x is over the support, a centre of pressure beyond it exists that drives it back; outside,
/// it runs away with exp(t / tau). The support is the convex hull of the soles that touch the ground and, while the robot
/// walks on, of the next foothold of each: x is ahead of the foot that lands next by a part of the step after it (N-step
/// capturability: Koolen, de Boer, Rebula, Goswami, Pratt, IJRR 31, 2012).
///
/// At an instant this says little: a controller may let x drift out of the support. A robot stands that has been at rest,
/// or whose x has been over its support, for three time constants, in which a deviation that nothing held would have
/// grown twentyfold, in which nothing pushed it, no sole that carried it was turned over an edge, and z did not decrease by
/// more than three tenths of it in a time constant. Before its start it was at rest. While no sole touches the ground
/// nothing is decided.
class Balance {
 public:
  /// \param world  must outlive it   \param planned  contacts of the plan, whose footholds count where a controller foresees none
  Balance(const World& world, const ContactSchedule& planned);

  /// Looks at the present state. \param plan_time  the instant of the plan at which it should be, s
  /// \param is_pushed  what a push leads to shows only after it
  void update(double plan_time, const std::vector<PredictedFoothold>& foreseen, bool is_pushed);
  bool stands() const;  ///< a robot without a free base always does
  /// The capture point is out of the support, and the robot is not at rest. While no sole touches the ground: the plan has
  /// contacts there, and it is out of the next footholds.
  bool falls() const { return is_free_ && !is_calm_ && (touches_ || !is_flight_planned_); }
  std::string describe() const;  ///< where the capture point is, and how fast the centre of mass

 private:
  bool isTurnedOver(int contact) const;
  void addSole(int contact, const SE3& X_WF);
  void addStepAfter(int contact, const PredictedFoothold& other);
  void findSupport(double plan_time, const std::vector<PredictedFoothold>& foreseen);
  const ContactTarget* findLanding(int contact, double plan_time) const;
  bool isFlightPlanned(double plan_time) const;
  double calcExcess(const Eigen::Vector2d& x) const;

  const World& world_;
  const ContactSchedule planned_;
  const Terrain terrain_;
  const bool is_free_;
  Workspace ws_;
  Vector3d up_;                           // against gravity; zero without
  Eigen::Matrix<double, 2, 3> across_;    // axes normal to it
  std::vector<Eigen::Vector2d> support_;  // corners of soles, along these, m
  // Per contact, where it was last foreseen to land: a controller that looks ahead forgets that just before it happens.
  std::vector<std::optional<SE3>> awaited_;
  double ground_ = 0;  // their mean height against gravity, m
  double tau_ = 0, excess_ = 0,
         speed_ = 0;  // s; of the capture point beyond the support, m; of the centre of mass, m/s
  std::optional<double>
      disturbed_;  // the last instant at which it was pushed, sank, or was neither at rest nor over its support, s
  bool touches_ = true, is_turned_over_ = false, is_flight_planned_ = false, is_calm_ = true, is_sinking_ = false;
};

}  // namespace bielle::worlds
