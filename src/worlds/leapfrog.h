#pragma once
/// \file The steps of Bielle's own world (bielle_world.h), for one robot or, with Lanes, for as many as a register holds.
///
/// Lanes never mix. Each robot halves its own steps, and is masked once its forces are found, so that what becomes of it is the same
/// to the last bit whatever the others do.
#include <array>
#include <atomic>
#include <string>
#include <vector>

#include "bielle/worlds/bielle_world.h"
#include "math/decompositions.h"
#include "worlds/closed_tree.h"
#include "worlds/contact_law.h"
#include "worlds/rod_pivots.h"

namespace bielle::worlds {

/// Works, J.
template <typename T>
struct WorksOf {
  T motor = 0, push = 0, contact = 0, stop = 0, joint = 0;
  T sum() const { return motor + push + contact + stop + joint; }
};

/// How far a robot goes and has come in an advance(), and how long its steps were.
struct Course {
  double time = 0;                             ///< s, at its start
  double steps = 0;                            ///< to take
  double taken = 0;                            ///< steps up to which it has come
  double shortest_step = 0, longest_step = 0;  ///< s; 0: none
  std::string message;                         ///< why it broke off at `taken`, or empty
};

template <typename T>
class LeapfrogOf {
 public:
  using Vector = VectorX<T>;
  using Mask = MaskOf<T>;
  using Courses = std::array<Course, kLanesOf<T>>;

  /// \throws InputError when the robot has no closed standing posture
  LeapfrogOf(const Model& model, const WorldOptions& options, const ContactOptions& contact);

  /// What a step changes beside the tree.
  struct Moment {
    T owed = 0;                        ///< s, the drift that completes the last step
    T length = 0;                      ///< s, of the last step
    T energy = 0;                      ///< at its middle, less the works up to there, J
    Vector half_last;                  ///< size, half of its dw
    WorksOf<T> works;                  ///< since start()
    std::vector<Vector6<T>> wrenches;  ///< of the ground in the last step, per contact of the model (world)
    Vector rod_forces;                 ///< likewise, of the closures whose rods have friction, N
  };
  using Points = std::vector<ContactPointOf<T>>;
  struct State {
    typename ClosedTreeOf<T>::State tree;
    Moment moment;
    Points points;
    T friction, mass_ratio;  ///< of the ground; of the robot's mass to that of the model
    GroundsOf<T> grounds;
  };

  /// Closed configurations of the robots of the mask, velocities that keep them closed, no torques and no push.
  /// \returns false where tree().failure() says why
  Mask start(const Vector& q, const Vector& v, const Mask& which);
  /// Robots of the mask have masses, rotors (ClosedTreeOf::setInertias()) and a friction of the ground of their own, from now on.
  void vary(const Vector& mass_factors, const Vector& armature, const T& friction, const Mask& which);
  /// ClosedTreeOf::setClosures()
  void setClosures(const std::vector<ClosureChangeOf<T>>& changes, const Mask& which) {
    tree_.setClosures(changes, which);
  }
  /// Torques of the motors (nu), and a force at the centre of mass of the pushed body, N (world).
  void command(const Vector& u, const Vector3<T>& push);
  /// Robots of the mask take `steps` of their courses, of length h, or shorter ones. Their first and last drifts are half as long.
  /// \param interrupt  ends it after a step, or null
  void advance(double h, const Mask& which, const std::atomic<bool>* interrupt, Courses& courses);
  /// Exchanges the robots for others.
  void swap(State& state);
  State copyState() const {
    return {tree_.state(), moment_, contacts_.points, friction_, mass_ratio_, contacts_.grounds};
  }

  const ClosedTreeOf<T>& tree() const { return tree_; }
  ContactSetOf<T>& contacts() { return contacts_; }
  const ContactSetOf<T>& contacts() const { return contacts_; }
  const Moment& moment() const { return moment_; }
  Vector3<T> getPlace(int body, const Vector3<T>& point) const { return tree_.getPlacement(body).act(point); }
  double rounds() const { return rounds_; }  ///< of Newton's method since the constructor

 private:
  enum class Trouble { Loops, Forces, Energy };
  struct Pace;

  // Forces at a velocity: their loads in reduced coordinates, and their damping if a matrix is given.
  void addForces(const Vector& w, Vector& loads, MatrixX<T>* damping);
  void addContacts(const Vector& w, Vector& loads, MatrixX<T>* damping);
  void addStops(const Vector& w, Vector& loads, MatrixX<T>* damping);
  void addJoints(const Vector& w, Vector& loads, MatrixX<T>* damping);
  void updateRodForces(const T& h);
  T calcRate(int dof, const Vector& w) const;
  void addRow(int dof, const T& force, const T& resistance, Vector& loads, MatrixX<T>* damping);
  Vector6<T> calcTwist(int tip, const Vector& w) const;
  void addWrench(int tip, const Vector6<T>& wrench, Vector& loads) const;
  Mask takeStep(const T& h, const Mask& which);
  void keep(const Mask& which);
  void rewind(const Mask& which);
  Mask kick(const T& h, const Mask& which);
  Mask solve(const T& h, const Mask& which);
  T updateResidual(const T& h, MatrixX<T>* damping);
  void factorize(const T& h);
  void updateCorrection();
  void multiply(const Vector& w);
  void book(const T& h);
  Mask balance(const T& kinetic, const T& energy, const Mask& which);
  void note(Trouble trouble, const Mask& which);
  std::string describeTrouble(int lane, double time, double h) const;

  const Model model_;
  const int pushed_body_;
  T friction_, mass_ratio_ = 1;
  ClosedTreeOf<T> tree_;
  ContactSetOf<T> contacts_;
  std::vector<ContactForceOf<T>> forces_;    // of the last step, per point
  std::vector<ContactStepOf<T>> steps_;      // of the points
  std::vector<TouchOf<T>> touches_;          // at places_
  std::vector<Vector3<T>> places_;           // where they acted, m (world)
  std::vector<T> stop_forces_, stop_rates_;  // rates: in the first half of the step
  RodPivotsOf<T> rods_;
  std::vector<Vector6<T>> on_bodies_;
  Vector on_dofs_;                                                   // nv
  Vector u_, tau_;                                                   // nu, nv
  Vector3<T> push_ = Vector3<T>::Zero(), com_ = Vector3<T>::Zero();  // N; of the pushed body, m
  bool is_pushed_ = false;
  Vector w_mean_, dw_, correction_, residual_, start_, loads_, product_;  // size
  MatrixX<T> damping_, system_, swapped_;                                 // size x size
  bool slides_ = false;  // whether the system is not symmetric, or not positive
  Eigen::LLT<MatrixXd> factors_;
  std::vector<typename LogicOf<T>::Index> pivots_, swaps_;  // size; of system_ and swapped_
  Moment moment_, moment_kept_, moment_before_;
  Points points_kept_, points_before_;
  std::array<Trouble, kLanesOf<T>> trouble_{};
  T amount_ = 0;  // of it: what is left of the change of velocity, m/s or rad/s; J
  double rounds_ = 0;
};

}  // namespace bielle::worlds
