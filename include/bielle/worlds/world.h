#pragma once
/// \file A world: physics with contact in which the motors of a robot carry out what a controller asks of them.
///
/// A motion that was solved is a plan: its feet stand because constraints hold them. In a world they stand because the
/// ground pushes, or they slip. Worlds differ in how they integrate; robot, ground and numbers that they report are the
/// same. The robot's rotors weigh their armature, joints have stops at their limits, loops are closed.
#include <atomic>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "bielle/dynamics/ground.h"
#include "bielle/model/model.h"

namespace bielle::worlds {

struct WorldOptions {
  Ground ground;         ///< with its coefficient of friction
  double time_step = 0;  ///< of worlds with fixed steps, s; 0: the world's own
  /// Polled after every step, so that a signal handler can set it: ends an advance(), however short the steps.
  const std::atomic<bool>* interrupt = nullptr;
  /// Error allowed per step of worlds that control it (makeManifoldWorld()); 0: the world's own.
  double tolerance = 0;
  int pushed_body = 1;  ///< at whose centre of mass World::setPush() acts; 1: the trunk, the body of the first joint
};

/// Energies at present and work since reset(), J. With E = kinetic + potential + elastic,
///     E - E(0) = motor_work + push_work - contact_loss - stop_loss - other_loss.                                  (1)
/// Every term is measured by itself: none is what remains of the others. A world that cannot tell two losses apart
/// books both as other_loss and says so.
struct Books {
  double kinetic = 0;    ///< of bodies and rotors
  double potential = 0;  ///< of gravity, zero for a centre of mass at the origin, and of springs of joints
  double elastic = 0;    ///< of the springs of contacts and stops
  double motor_work = 0, push_work = 0;
  double contact_loss = 0, stop_loss = 0;  ///< dissipated by friction and damping; not negative
  double other_loss = 0;                   ///< dampers and friction of joints, damping of closures

  double energy() const { return kinetic + potential + elastic; }
};

/// What the ground does to a contact of the model.
struct FootReport {
  Vector6d wrench = Vector6d::Zero();  ///< of the ground on the foot, in its contact frame (notation.h), N and N m
  double slip = 0;  ///< distance of the sole's centre along the ground from where it touched down, m; 0 in the air
  bool touches = false;
};

/// One robot in one world. Not thread-safe; different worlds are independent.
class World {
 public:
  virtual ~World() = default;

  /// Sets a closed configuration q (nq) and a velocity v (nv) that keeps it closed; time, work and slip start from zero,
  /// torques and push are zero. \throws std::invalid_argument when a number is not finite; nothing has changed then
  virtual void reset(ConstVectorRef q, ConstVectorRef v) = 0;
  /// Torques of the motors in their order (nu, N m or N), cut at their limits and held until the next call.
  virtual void setTorques(ConstVectorRef u) = 0;
  /// A force at the centre of mass of the pushed body (WorldOptions), N (world), held until the next call.
  virtual void setPush(const Vector3d& force) = 0;
  /// Advances by a duration, s.
  /// \returns false if the integration broke off; the state is then the last one that is finite, and message() says
  ///   why. Exceptions of an engine do not pass. Also false if it was interrupted, without a message; it can go on.
  virtual bool advance(double duration) = 0;
  virtual const std::string& message() const = 0;  ///< empty unless the integration broke off

  virtual double time() const = 0;                          ///< since reset(), s
  virtual const VectorXd& configuration() const = 0;        ///< nq, coordinates of the model
  virtual const VectorXd& velocity() const = 0;             ///< nv
  virtual const VectorXd& torques() const = 0;              ///< nu, as they were cut
  virtual const std::vector<FootReport>& feet() const = 0;  ///< per contact of the model
  virtual Books books() const = 0;
  virtual double gap() const = 0;  ///< opening of the closures at present: the largest distance of their points, m

 protected:
  static void requireFinite(ConstVectorRef q, ConstVectorRef v) {
    if (!q.allFinite() || !v.allFinite())
      throw std::invalid_argument(
          "world: the state has a number that is not finite; give a closed configuration and a velocity");
  }
};

}  // namespace bielle::worlds
