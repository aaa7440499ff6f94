#include "worlds/simbody_world.h"

#include <algorithm>
#include <cmath>

#include "dynamics/joint_force.h"
#include "math/largest.h"
#include "worlds/left_out.h"
#include "worlds/simbody_tree.h"

namespace bielle::worlds {
namespace {

using SimTK::MobilizedBody;
using SimTK::SpatialVec;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vec3;

constexpr double kStartGap = 1e-9;  // to which closures are closed at the start, as the tolerance of those under way

// Contacts, stops, motors and push: everything but gravity and the forces of joints.
class WorldForces : public SimTK::Force::Custom::Implementation {
 public:
  // \param torques, force  of the motors and of the push, as they are at any time; must outlive it, as the others
  WorldForces(const SimbodyTree& tree, const ContactSet& contacts, int pushed_body, const VectorXd& torques,
              const Vector3d& force)
      : tree_(tree), contacts_(contacts), pushed_body_(pushed_body), u_(torques), push_(force) {}

  void calcForce(const State& state, SimTK::Vector_<SpatialVec>& body_forces, SimTK::Vector_<Vec3>&,
                 SimTK::Vector& mobility_forces) const override {
    for (const ContactPoint& point : contacts_.points) {
      const MobilizedBody& body = tree_.bodies[point.body];
      const ContactForce force = calcForce(state, point);
      if (force.elastic > 0) body.applyForceToBodyPoint(state, toSimTK(point.p), toSimTK(force.force), body_forces);
    }
    for (const JointStop& stop : contacts_.stops) {
      const double force = calcForce(state, stop).force;
      if (force != 0) mobility_forces[tree_.u_index[stop.dof]] += force;
    }
    for (int m = 0; m < tree_.model.nu(); ++m) mobility_forces[tree_.u_index[tree_.model.motors()[m].dof]] += u_[m];
    tree_.bodies[pushed_body_].applyForceToBodyPoint(state, toSimTK(pushPoint()), toSimTK(push_), body_forces);
  }
  double calcPotentialEnergy(const State&) const override { return 0; }  // Books keeps it apart

  ContactForce calcForce(const State& state, const ContactPoint& point) const {
    return calcContactForce(contacts_.terrain, point, findPlace(state, point.body, point.p),
                            findVelocity(state, point.body, point.p));
  }
  double findCoordinate(const State& state, const JointStop& stop) const {
    const Joint& joint = tree_.model.joints()[tree_.model.dofs()[stop.dof].joint];
    const int body = tree_.model.dofs()[stop.dof].joint, k = stop.dof - joint.idx_v;
    if (tree_.first_pins[body].isEmptyHandle()) return tree_.bodies[body].getOneQ(state, k);
    return (k == 0 ? tree_.first_pins[body] : tree_.bodies[body]).getOneQ(state, 0);
  }
  StopForce calcForce(const State& state, const JointStop& stop) const {
    return calcStopForce(stop, findCoordinate(state, stop), getRate(state, stop.dof));
  }
  SE3 findPlacement(const State& state, int body) const {
    const SimTK::Transform& X = tree_.bodies[body].getBodyTransform(state);
    return SE3(toEigen(X.R()), toEigen(X.p()));
  }
  Vector3d findPlace(const State& state, int body, const Vector3d& p) const {
    return toEigen(tree_.bodies[body].findStationLocationInGround(state, toSimTK(p)));
  }
  Vector3d findVelocity(const State& state, int body, const Vector3d& p) const {
    return toEigen(tree_.bodies[body].findStationVelocityInGround(state, toSimTK(p)));
  }
  Works calcPowers(const State& state) const {
    Works powers;
    for (const ContactPoint& point : contacts_.points)
      powers.contact += calcForce(state, point).force.dot(findVelocity(state, point.body, point.p));
    for (const JointStop& stop : contacts_.stops)
      powers.stop += calcForce(state, stop).force * getRate(state, stop.dof);
    for (int m = 0; m < tree_.model.nu(); ++m) powers.motor += u_[m] * getRate(state, tree_.model.motors()[m].dof);
    for (const JointForce& force : tree_.model.jointForces()) {
      const double rate = getRate(state, force.dof);
      powers.joint += calcDissipativeForce(force, rate) * rate;
    }
    for (const PointSpring& spring : tree_.model.pointSprings()) {
      const Vector3d direction =
          findPlace(state, spring.body2, spring.point2) - findPlace(state, spring.body1, spring.point1);
      const double rate = direction.normalized().dot(findVelocity(state, spring.body2, spring.point2) -
                                                     findVelocity(state, spring.body1, spring.point1));
      powers.joint -= spring.damping * rate * rate;
    }
    powers.push = push_.dot(findVelocity(state, pushed_body_, pushPoint()));
    return powers;
  }

 private:
  double getRate(const State& state, int dof) const { return state.getU()[tree_.u_index[dof]]; }
  Vector3d pushPoint() const { return tree_.model.bodies()[pushed_body_].inertia.com; }

  const SimbodyTree& tree_;
  const ContactSet& contacts_;
  const int pushed_body_;
  const VectorXd& u_;
  const Vector3d& push_;
};

// The speeds of rotors are those of their joints: one constraint for all, much quicker than Simbody's SpeedCouplers.
class RotorCoupling : public SimTK::Constraint::Custom::Implementation {
 public:
  explicit RotorCoupling(SimTK::SimbodyMatterSubsystem& matter, int rotors)
      : SimTK::Constraint::Custom::Implementation(matter, 0, rotors, 0) {}

  // One after the other those of a joint. \param speed  among those of its mobilizer   \param speeds  how many that one has
  void add(const MobilizedBody& joint, int speed, int speeds, const MobilizedBody& rotor) {
    if (const int index = joint.getMobilizedBodyIndex(); index != last_) {
      addConstrainedMobilizer(joint);
      last_ = index;
      first_ = next_;
      next_ += speeds;
    }
    addConstrainedMobilizer(rotor);
    joints_.push_back(SimTK::ConstrainedUIndex(first_ + speed));
    rotors_.push_back(SimTK::ConstrainedUIndex(next_++));
  }

 private:
  using Speeds = SimTK::Array_<SimTK::Real, SimTK::ConstrainedUIndex>;
  using Twists = SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>;

  Implementation* clone() const override { return new RotorCoupling(*this); }
  void calcVelocityErrors(const State&, const Twists&, const Speeds& u,
                          SimTK::Array_<SimTK::Real>& errors) const override {
    for (size_t i = 0; i < joints_.size(); ++i) errors[int(i)] = u[joints_[i]] - u[rotors_[i]];
  }
  void calcVelocityDotErrors(const State&, const Twists&, const Speeds& udot,
                             SimTK::Array_<SimTK::Real>& errors) const override {
    for (size_t i = 0; i < joints_.size(); ++i) errors[int(i)] = udot[joints_[i]] - udot[rotors_[i]];
  }
  void addInVelocityConstraintForces(const State&, const SimTK::Array_<SimTK::Real>& multipliers, Twists&,
                                     Speeds& forces) const override {
    for (size_t i = 0; i < joints_.size(); ++i) {
      forces[joints_[i]] += multipliers[int(i)];
      forces[rotors_[i]] -= multipliers[int(i)];
    }
  }

  std::vector<SimTK::ConstrainedUIndex> joints_, rotors_;
  int last_ = -1;             // the last joint
  int first_ = 0, next_ = 0;  // where its speeds begin, and those of the next mobilizer
};

// A ball that has an armature keeps its mobilizer, whose speeds that of a rotor are.
LoopCut chooseCut(const Model& model, bool as_modelled) {
  for (const Joint& joint : model.joints())
    as_modelled |= joint.kind == JointKind::Spherical && model.armature()[joint.idx_v] > 0;
  return as_modelled ? LoopCut::AsModelled : LoopCut::FewestRows;
}

std::unique_ptr<SimTK::Integrator> makeIntegrator(SimbodyIntegrator integrator, const SimTK::System& system) {
  if (integrator == SimbodyIntegrator::RungeKuttaMerson)
    return std::make_unique<SimTK::RungeKuttaMersonIntegrator>(system);
  return std::make_unique<SimTK::RungeKutta3Integrator>(system);
}

class SimbodyWorld : public World {
 public:
  SimbodyWorld(const Model& model, const SimbodyWorldOptions& options);

  Books books() const override;
  double gap() const override;

 private:
  void start() override;
  bool step(double duration) override;
  void noteForces() override { changed_ = true; }
  void addRotors();
  SimTK::State& placeState();
  void finishStep(double duration);
  void readState();
  void realizeForces();
  void breakOff(const std::exception& error);

  SimbodyTree tree_;
  ContactSet contacts_;
  WorldForces* forces_;                                // owned by the tree's system
  std::vector<std::pair<MobilizedBody, int>> rotors_;  // with the dof of their joint
  std::unique_ptr<SimTK::Integrator> integrator_;
  Works last_;            // powers at the end of the last step, W
  bool changed_ = false;  // torques or push since the last step
};

SimbodyWorld::SimbodyWorld(const Model& model, const SimbodyWorldOptions& options)
    : World(model, options.world),
      tree_(model_, model_.closures(), chooseCut(model_, options.as_modelled)),
      contacts_(model, ground_, options.contact),
      forces_(new WorldForces(tree_, contacts_, pushed_body_, u_, push_)),
      integrator_(makeIntegrator(options.integrator, tree_.system)) {
  SimTK::Force::Custom(tree_.forces, forces_);
  addRotors();
  tree_.finish();
  integrator_->setAccuracy(options.accuracy);
  integrator_->setConstraintTolerance(options.gap);
  integrator_->setUseInfinityNorm(true);
  if (options.world.time_step > 0) integrator_->setMaximumStepSize(options.world.time_step);
  integrator_->setReturnEveryInternalStep(true);
  integrator_->setAllowInterpolation(false);
  integration_.integrator = integrator_->getMethodName();
  integration_.tolerance = options.accuracy;
  integration_.closure_tolerance = options.gap;
  warnings_ = listMissingStops(model);
  for (const std::string& warning : listTurnedArmatures(model)) warnings_.push_back(warning);
  for (const std::string& warning : listRodFrictions(options.world.wear)) warnings_.push_back(warning);
}

void SimbodyWorld::addRotors() {
  const VectorXd& armature = model_.armature();
  const auto count = (armature.array() > 0).count();
  if (count == 0) return;
  auto* coupling = new RotorCoupling(tree_.matter, static_cast<int>(count));
  const Vector3d level = model_.gravity().isZero() ? Vector3d::UnitX() : model_.gravity().unitOrthogonal();
  const SimTK::Transform X(SimTK::Rotation(SimTK::UnitVec3(toSimTK(level)), SimTK::XAxis));
  for (int dof = 0; dof < model_.nv(); ++dof) {
    if (!(armature[dof] > 0)) continue;
    // The mass of a rotor that turns stays at the origin; one that slides does so where gravity does not pull it.
    const SimTK::MassProperties mass(armature[dof], Vec3(0), SimTK::Inertia(armature[dof]));
    const int i = model_.dofs()[dof].joint;
    const Joint& joint = model_.joints()[i];
    MobilizedBody rotor;
    if (joint.kind == JointKind::Prismatic)
      rotor = MobilizedBody::Slider(tree_.matter.updGround(), X, SimTK::Body::Rigid(mass), X);
    else
      rotor = MobilizedBody::Pin(tree_.matter.updGround(), SimTK::Body::Rigid(mass));
    rotors_.emplace_back(rotor, dof);
    const int k = dof - joint.idx_v;
    const bool is_chain = !tree_.first_pins[i].isEmptyHandle();
    coupling->add(is_chain && k == 0 ? tree_.first_pins[i] : tree_.bodies[i], is_chain ? 0 : getSimbodySpeed(joint, k),
                  is_chain ? 1 : joint.nv, rotor);
  }
  SimTK::Constraint::Custom constraint(coupling);
}

// The tree's state at time_, q_ and v_.
SimTK::State& SimbodyWorld::placeState() {
  SimTK::State& state = tree_.state;
  state.setTime(time_);
  tree_.setCoordinates(q_);
  tree_.updateVelocityMap(q_, v_);
  SimTK::Vector& u = state.updU();
  u = 0;
  tree_.scatter(tree_.T * v_, u);
  for (const auto& [rotor, dof] : rotors_) u[int(rotor.getFirstUIndex(state))] = u[tree_.u_index[dof]];
  tree_.system.realize(state, Stage::Velocity);
  return state;
}

void SimbodyWorld::start() {
  SimTK::State& state = placeState();
  const auto place = [&](int body, const Vector3d& point) { return forces_->findPlace(state, body, point); };
  contacts_.reset([&](int body) { return forces_->findPlacement(state, body); });
  contacts_.setStart(place, [&](const JointStop& stop) { return forces_->findCoordinate(state, stop); });
  try {
    const SimTK::ProjectOptions within =
        SimTK::ProjectOptions(kStartGap).setOption(SimTK::ProjectOptions::UseInfinityNorm);
    SimTK::ProjectResults results;
    SimTK::Vector no_estimate;
    tree_.system.realize(state, Stage::Position);
    tree_.system.projectQ(state, no_estimate, within, results);
    tree_.system.realize(state, Stage::Velocity);
    tree_.system.projectU(state, no_estimate, within, results);
    integrator_->initialize(state);
    tree_.system.realize(integrator_->updAdvancedState(), Stage::Velocity);
    last_ = forces_->calcPowers(integrator_->getAdvancedState());
    readState();
  } catch (const std::exception& error) {
    breakOff(error);
  }
}

// The engine stopped within a step or at a start, whose state is of no stage: back to the last one that was read.
void SimbodyWorld::breakOff(const std::exception& error) {
  message_ = error.what();
  std::replace(message_.begin(), message_.end(), '\n', ' ');
  integrator_->updAdvancedState() = placeState();
  tree_.system.realize(integrator_->updAdvancedState(), Stage::Velocity);
}

// Forces that do not depend on the state alone have changed: what was computed of them is stale.
void SimbodyWorld::realizeForces() {
  if (!changed_) return;
  integrator_->updAdvancedState().invalidateAllCacheAtOrAbove(Stage::Dynamics);
  integrator_->reinitialize(Stage::Dynamics, false);
  tree_.system.realize(integrator_->updAdvancedState(), Stage::Velocity);
  last_ = forces_->calcPowers(integrator_->getAdvancedState());
  changed_ = false;
}

bool SimbodyWorld::step(double duration) {
  const double start = integrator_->getTime(), end = time_ + duration;
  const Works work = work_;
  try {
    realizeForces();
    for (double before = integrator_->getTime(); before < end - 1e-12; before = integrator_->getTime()) {
      integrator_->stepTo(end, end);
      finishStep(integrator_->getTime() - before);
      if (integrator_->getTime() > start && isInterrupted()) break;  // the first return may be before any step
    }
  } catch (const std::exception& error) {
    breakOff(error);
    work_ = work;
    return false;
  }
  const bool is_done = integrator_->getTime() >= end - 1e-12;
  time_ = is_done ? end : integrator_->getTime();
  readState();
  return is_done;
}

void SimbodyWorld::finishStep(double duration) {
  const SimTK::State& state = integrator_->getState();
  tree_.system.realize(state, Stage::Velocity);
  const Works now = forces_->calcPowers(state);
  if (duration > 0) noteStep(duration);
  work_.motor += 0.5 * duration * (last_.motor + now.motor);
  work_.push += 0.5 * duration * (last_.push + now.push);
  work_.contact += 0.5 * duration * (last_.contact + now.contact);
  work_.stop += 0.5 * duration * (last_.stop + now.stop);
  work_.joint += 0.5 * duration * (last_.joint + now.joint);
  last_ = now;
  clearFootForces();
  for (ContactPoint& point : contacts_.points) {
    const Vector3d x = forces_->findPlace(state, point.body, point.p);
    const ContactForce force = forces_->calcForce(state, point);
    if (force.elastic > 0) addFootForce(point.contact, x, force.force);
    updateAnchor(contacts_.terrain, x, force, point);
  }
  contacts_.settle([&](int body) { return forces_->findPlacement(state, body); });
}

void SimbodyWorld::readState() {
  const SimTK::State& state = integrator_->getState();
  tree_.system.realize(state, Stage::Velocity);
  tree_.readState(state, q_, v_);
  reportFeet([&](int body) { return forces_->findPlacement(state, body); });
}

Books SimbodyWorld::books() const {
  const SimTK::State& state = integrator_->getState();
  tree_.system.realize(state, Stage::Dynamics);
  Books books = World::books();
  books.kinetic = tree_.system.calcKineticEnergy(state);
  books.potential = tree_.system.calcPotentialEnergy(state);
  contacts_.addTo(
      books, [&](int body, const Vector3d& point) { return forces_->findPlace(state, body, point); },
      [&](const JointStop& stop) { return forces_->findCoordinate(state, stop); });
  return books;
}

double SimbodyWorld::gap() const {
  const SimTK::State& state = integrator_->getState();
  double gap = 0;
  const auto locate = [&](int body, const Vector3d& point) {
    return tree_.bodies[body].findStationLocationInGround(state, toSimTK(point));
  };
  for (size_t i = 0; i < model_.closures().size(); ++i) {
    const Closure& closure = model_.closures()[i];
    const int joint = tree_.cut_joints[i];
    const SimTK::Vec3 opening =
        joint < 0 ? locate(closure.body1, closure.X_B1.p) - locate(closure.body2, closure.X_B2.p)
                  : locate(model_.joints()[joint].parent, model_.joints()[joint].X_PJ.p) - locate(joint, {0, 0, 0});
    gap = getLarger(gap, opening.norm());
  }
  return gap;
}

}  // namespace

std::unique_ptr<World> makeSimbodyWorld(const Model& model, const SimbodyWorldOptions& options) {
  return std::make_unique<SimbodyWorld>(model, options);
}

}  // namespace bielle::worlds
