#pragma once
/// \file A world: physics with contact in which the motors of a robot carry out what a controller asks of them.
///
/// A motion that was solved is a plan: its feet stand because constraints hold them. In a world they stand because the
/// ground pushes, or they slip. Worlds differ in how they integrate; robot, ground and numbers that they report are the
/// same. The robot's rotors weigh their armature, joints have stops at their limits, loops are closed.
#include <atomic>
#include <string>
#include <vector>

#include "bielle/dynamics/ground.h"
#include "bielle/dynamics/workspace.h"
#include "bielle/model/wear.h"

namespace bielle::worlds {

struct WorldOptions {
  Ground ground;         ///< with its coefficient of friction
  double time_step = 0;  ///< of worlds with fixed steps, s; 0: the world's own. The longest step of the others; 0: any
  /// Polled after every step, so that a signal handler can set it: ends an advance(), however short the steps.
  const std::atomic<bool>* interrupt = nullptr;
  /// Error allowed per step of worlds that control it (makeManifoldWorld(), Simbody's); 0: the world's own.
  double tolerance = 0;
  int pushed_body = 1;  ///< at whose centre of mass World::setPush() acts; 1: the trunk, the body of the first joint
  Wear wear = {};       ///< play in makeOwnWorld() and makeWorld() alone; others throw std::logic_error
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

/// What each kind of force does on the robot, J (or W).
struct Works {
  double motor = 0, push = 0, contact = 0, stop = 0, joint = 0;
};

/// How a world integrates, and the steps that it has taken since reset(). The end of advance() ends a step as well.
struct Integration {
  std::string integrator;
  double tolerance = 0;          ///< error allowed per step, as the world measures it; 0: its steps are fixed
  double closure_tolerance = 0;  ///< most that a row of a closure may open, m or rad; 0: closed to rounding, or soft
  double shortest_step = 0, longest_step = 0;  ///< s; 0: none yet
};

/// What the ground does to a contact of the model.
struct FootReport {
  Vector6d wrench = Vector6d::Zero();  ///< of the ground on the foot, in its contact frame (notation.h), N and N m
  double slip = 0;  ///< distance of the sole's centre along the ground from where it touched down, m; 0 in the air
  bool touches = false;
  SE3 X_WF;  ///< placement of its contact frame in the world
};

/// One robot in one world. Not thread-safe; different worlds are independent. An engine derives from it (below).
class World {
 public:
  virtual ~World() = default;

  /// Sets a closed configuration q (nq) and a velocity v (nv) that keeps it closed; time, work and slip start from zero,
  /// torques and push are zero. \throws std::invalid_argument when a number is not finite; nothing has changed then
  void reset(ConstVectorRef q, ConstVectorRef v);
  /// Torques of the motors in their order (nu, N m or N), cut at their limits and held until the next call.
  void setTorques(ConstVectorRef u);
  /// A force at the centre of mass of the pushed body (WorldOptions), N (world), held until the next call.
  void setPush(const Vector3d& force);
  /// Advances by a duration, s.
  /// \returns false if the integration broke off; the state is then the last one that is finite, and message() says
  ///   why. Exceptions of an engine do not pass. Also false if it was interrupted, without a message; it can go on.
  bool advance(double duration);
  const std::string& message() const { return message_; }  ///< empty unless the integration broke off

  const Model& model() const { return model_; }         ///< of the robot
  const Ground& ground() const { return ground_; }      ///< with its coefficient of friction
  double time() const { return time_; }                 ///< since reset(), s
  const VectorXd& configuration() const { return q_; }  ///< nq, coordinates of the model
  const VectorXd& velocity() const { return v_; }       ///< nv
  /// nq: the configuration as encoders of motors read it, with joints that have play where their motors are.
  virtual const VectorXd& motorConfiguration() const { return q_; }
  const VectorXd& torques() const { return u_; }                 ///< nu, as they were cut
  const std::vector<FootReport>& feet() const { return feet_; }  ///< per contact of the model
  /// What the world leaves out of the model or takes otherwise, a sentence each, with its size; empty: nothing.
  const std::vector<std::string>& warnings() const { return warnings_; }
  const Integration& integration() const { return integration_; }
  virtual Books books() const;
  /// How many steps of this length, or a little shorter, make up a duration; maybe more than an integer holds.
  static double countSteps(double duration, double time_step);
  virtual double gap() const;  ///< opening of the closures at present: the largest distance of their points, m

 protected:
  World(const Model& model, const WorldOptions& options);

  /// Takes q_ and v_, which are finite, for the start of the engine; all else is reset. May set message_.
  virtual void start() = 0;
  /// Integrates for a duration, s, above zero: moves time_, q_ and v_, books works and reports the feet.
  /// \returns as advance() does
  virtual bool step(double duration) = 0;
  /// Torques or push have changed.
  virtual void noteForces() {}

  bool fail(const std::string& why);  ///< sets message_; false
  void noteStep(double h);            ///< for integration()
  bool isInterrupted() const { return interrupt_ && *interrupt_; }
  /// Wrenches of the ground on the feet are sums of forces at x (world).
  void clearFootForces();
  void addFootForce(int contact, const Vector3d& x, const Vector3d& force);
  void setFootWrench(int contact, const Vector6d& wrench);  ///< about the origin of the world
  /// Their wrenches and slips for the present placements. \param getPlacement  body -> SE3
  template <typename GetPlacement>
  void reportFeet(const GetPlacement& getPlacement) {
    for (size_t c = 0; c < feet_.size(); ++c)
      reportFoot(c, getPlacement(model_.contacts()[c].body) * model_.contacts()[c].X_BF);
  }

  const Model model_;
  const Ground ground_;
  const int pushed_body_;
  double time_ = 0;
  VectorXd q_, v_, u_;  // nq, nv, nu
  Vector3d push_ = Vector3d::Zero();
  Works work_;  // since reset()
  std::string message_;
  std::vector<std::string> warnings_;
  Integration integration_;
  mutable Workspace ws_;

 private:
  void reportFoot(size_t contact, const SE3& X_WF);

  const std::atomic<bool>* const interrupt_;
  std::vector<FootReport> feet_;
  std::vector<Vector6d> wrenches_;    // about the origin of the world
  std::vector<Vector3d> touchdowns_;  // of the centres of the soles, m (world)
};

}  // namespace bielle::worlds
