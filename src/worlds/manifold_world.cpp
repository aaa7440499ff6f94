#include <algorithm>
#include <array>
#include <cmath>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/worlds/bielle_world.h"
#include "dynamics/closed_field.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "dynamics/regular_mobility.h"
#include "dynamics/whole_turns.h"
#include "math/runge_kutta.h"
#include "model/number_text.h"
#include "worlds/contact_law.h"
#include "worlds/left_out.h"
#include "worlds/open_loops.h"
#include "worlds/play_world.h"
#include "worlds/rod_forces.h"

namespace bielle::worlds {
namespace {

constexpr double kFirstStep = 1e-4;        // s, before anything is known of the motion
constexpr double kShortestStep = 1e-11;    // s
constexpr double kLeastTolerance = 1e-12;  // what rounding permits
constexpr double kShorter = 0.61;   // of a step that met a singular posture: no simple fraction, to pass beside it
constexpr double kFutile = 0.02;    // share of the usual step: shorter ones gain nothing beside a singular posture
constexpr double kNear = 1e-3;      // share of the best independence of rows: beside a singular posture
constexpr double kNearest = 1e-9;   // share of it below which rows are not chosen anew: some would be missing
constexpr double kMostLoose = 1e4;  // error of a step that is taken there, over the tolerance
constexpr double kOpen = 1e-8;      // of dependent rows, m or rad: the rank has changed
constexpr double kLessIndependent = 1e-2;  // share of it below which rows are chosen anew

constexpr double kSettled = 1e-12;  // of forces of rods with friction, relative to 1 N and the largest
constexpr int kMostRounds = 30;     // for them to settle

enum Work { kMotors, kPush, kContacts, kStops, kJoints, kWorks };

class ManifoldWorld : public World {
 public:
  ManifoldWorld(const Model& model, const ManifoldWorldOptions& options);

  Books books() const override;
  double gap() const override { return gap_; }

 private:
  void start() override;
  bool step(double duration) override;
  void noteForces() override { calcMotorForces(model_, u_, tau_motors_); }
  void checkStart(int rank);
  bool evaluate(const VectorXd& x, VectorXd& rate);
  void calcForces(VectorXd& tau, std::array<double, kWorks>& power);
  void addForce(int body, const Vector3d& at, const Vector3d& force, VectorXd& tau) const;
  bool takeStep(double& h);
  bool settle(ConstVectorRef d, ConstVectorRef u);
  void takeOver();
  void updateFeet();
  std::string describeState() const;
  std::string describeStop() const;
  Vector3d getPlace(int body, const Vector3d& point) const { return field_.workspace().X_WB[body].act(point); }
  Vector3d calcVelocityAt(int body, const Vector3d& x) const {
    const Vector6d& V = field_.workspace().V[body];
    return V.head<3>() + V.tail<3>().cross(x);
  }

  const double tolerance_, longest_step_;
  ClosedField field_;
  RungeKutta method_;
  RungeKutta::Derivative derivative_;
  ContactSet contacts_;
  RodForces rods_;
  const std::vector<int> free_turns_;
  VectorXd near_, turns_;  // nq: the configuration without and its whole turns
  VectorXd tau_motors_, tau_, tau_all_, x_, rate_, scale_;
  double next_step_ = 0, usual_step_ = 0, gap_ = 0, best_independence_ = 1, least_independence_ = 1;
};

ManifoldWorld::ManifoldWorld(const Model& model, const ManifoldWorldOptions& options)
    : World(model, options.world),
      tolerance_(std::max(options.tolerance, kLeastTolerance)),
      longest_step_(options.world.time_step > 0 ? options.world.time_step : std::numeric_limits<double>::infinity()),
      field_(model_),
      method_(2 * model.nv() + kWorks),
      derivative_([this](const VectorXd& x, VectorXd& rate) { return evaluate(x, rate); }),
      contacts_(model, ground_, options.contact),
      rods_(model, options.world.wear.frictions),
      free_turns_(listFreeTurns(model)) {
  integration_.integrator = "Runge-Kutta of order 8";
  integration_.tolerance = tolerance_;
  warnings_ = listMissingStops(model);
  for (VectorXd* x : {&tau_motors_, &tau_}) x->setZero(model.nv());
  for (VectorXd* x : {&x_, &rate_}) x->setZero(2 * model.nv() + kWorks);
  scale_.setZero(2 * model.nv());
}

void ManifoldWorld::start() {
  message_ = describeOpenLoops(model_, ws_, q_);
  if (!message_.empty()) return;
  near_ = q_;
  turns_.setZero(model_.nq());
  leaveOutTurns(free_turns_, near_, turns_);
  next_step_ = usual_step_ = kFirstStep;
  tau_motors_.setZero();
  if (!model_.closures().empty()) {
    const int rank = field_.select(near_);
    if (rank <= ClosedField::kDenseRows) checkStart(rank);
    if (!message_.empty()) return;
  }
  if (!settle(VectorXd::Zero(model_.nv()), v_)) fail(field_.failure());
  best_independence_ = field_.independence();
  contacts_.reset([this](int body) { return field_.workspace().X_WB[body]; });
  updatePlacements(model_, ws_, q_);
  contacts_.setStart([this](int body, const Vector3d& point) { return ws_.X_WB[body].act(point); },
                     [this](const JointStop& stop) { return q_[stop.coordinate]; });
}

// A posture where rows are dependent that are independent all around it: the motion is not determined.
void ManifoldWorld::checkStart(int rank) {
  const int other = calcRegularMobility(model_, near_).rank;
  if (other > rank)
    fail("the loops are singular at the start: they have rank " + std::to_string(rank) + ", and " +
         std::to_string(other) + " beside it; start from another posture");
}

// The state at d, u of a chart that begins at q_, as the state of the world.
bool ManifoldWorld::settle(ConstVectorRef d, ConstVectorRef u) {
  field_.begin(near_);
  if (!field_.close(d, u)) return false;
  gap_ = field_.calcGap();
  if (gap_ > kOpen) return fail("the rank of its loops changes there: a posture where they lock");
  takeOver();
  return true;
}

void ManifoldWorld::takeOver() {
  near_ = field_.configuration();
  model_.normalize(near_);
  leaveOutTurns(free_turns_, near_, turns_);
  q_ = near_ + turns_;
  v_ = field_.velocity();
}

bool ManifoldWorld::step(double duration) {
  const double end = time_ + duration;
  bool is_first = true;
  while (time_ < end) {
    if (!is_first && isInterrupted()) break;
    is_first = false;
    const double left = end - time_, wanted = std::min(next_step_, longest_step_);
    // Two halves rather than a step and a splinter.
    double h = wanted >= left ? left : 2 * wanted > left ? 0.5 * left : wanted;
    const bool is_last = h == left;
    const double asked = h;
    if (!takeStep(h)) return false;
    noteStep(h);
    time_ = is_last && h == asked ? end : time_ + h;
  }
  updateFeet();
  return time_ >= end;
}

// Takes one step of h or, where it has to, of less.
bool ManifoldWorld::takeStep(double& h) {
  const int nv = model_.nv();
  field_.begin(near_);
  x_.setZero();
  x_.segment(nv, nv) = v_;
  if (!evaluate(x_, rate_)) return fail(describeState());
  const double independence = field_.independence();
  if (independence < kLessIndependent * best_independence_ && independence > kNearest * best_independence_) {
    field_.select(near_);
    field_.begin(near_);
    if (!evaluate(x_, rate_)) return fail(describeState());
  }
  best_independence_ = std::max(best_independence_, field_.independence());
  scale_.head(nv).setConstant(tolerance_);
  scale_.tail(nv) = tolerance_ * (1 + v_.array().abs());
  const double wanted = h;
  double best = std::numeric_limits<double>::infinity(), best_h = 0;
  bool takes_best = false;
  least_independence_ = 1;
  for (;;) {
    const double error = method_.step(derivative_, x_, rate_, h, scale_);
    const double factor = RungeKutta::calcFactor(error);
    if (error < best) best = error, best_h = h;
    if (error <= 1 || takes_best) {
      const VectorXd& end = method_.end();
      if (field_.close(end.head(nv), end.segment(nv, nv)) && (gap_ = field_.calcGap()) <= kOpen) {
        takeOver();
        const auto works = end.tail(kWorks);
        work_.motor += works[kMotors];
        work_.push += works[kPush];
        work_.contact += works[kContacts];
        work_.stop += works[kStops];
        work_.joint += works[kJoints];
        // A step that had to be short says nothing about the next one.
        next_step_ = std::max(h < next_step_ && h == wanted ? next_step_ : 0.0, h * factor);
        if (least_independence_ >= kNear * best_independence_)
          usual_step_ = h == wanted ? std::max(usual_step_, h) : h;
        else
          next_step_ = std::max(next_step_, 10 * kFutile * usual_step_);
        break;
      }
      h *= kShorter;
      best = std::numeric_limits<double>::infinity();
      takes_best = false;
    } else {
      h *= std::isfinite(error) ? std::min(factor, 0.9) : kShorter;
    }
    // Beside a singular posture rounding grows like the inverse square of the sine between rows: shorter steps gain nothing.
    if (h < kFutile * usual_step_ && least_independence_ < kNear * best_independence_ && best < kMostLoose &&
        !takes_best) {
      h = best_h;
      takes_best = true;
    }
    if (!(h > kShortestStep)) return fail(describeStop());
  }
  for (ContactPoint& point : contacts_.points) {
    const Vector3d x = getPlace(point.body, point.p);
    const ContactForce force = calcContactForce(contacts_.terrain, point, x, calcVelocityAt(point.body, x));
    updateAnchor(contacts_.terrain, x, force, point);
  }
  contacts_.settle([this](int body) { return field_.workspace().X_WB[body]; });
  return true;
}

bool ManifoldWorld::evaluate(const VectorXd& x, VectorXd& rate) {
  const int nv = model_.nv();
  if (!field_.close(x.head(nv), x.segment(nv, nv))) return false;
  least_independence_ = std::min(least_independence_, field_.independence());
  std::array<double, kWorks> power{};
  calcForces(tau_, power);
  if (!rods_.empty()) rods_.move(field_.workspace());
  for (int round = 0;; ++round) {
    tau_all_ = tau_;
    const double rubbed = rods_.empty() ? 0 : rods_.add(tau_all_);
    field_.accelerate(tau_all_, rate.head(nv), rate.segment(nv, nv));
    if (rods_.empty() || rods_.update(rate.segment(nv, nv), tau_all_) <= kSettled * (1 + rods_.largest())) {
      power[kJoints] += rubbed;
      break;
    }
    if (round == kMostRounds) return false;
  }
  for (int w = 0; w < kWorks; ++w) rate[2 * nv + w] = power[w];
  return rate.allFinite();
}

// J^T of a force at a point of a body (world).
void ManifoldWorld::addForce(int body, const Vector3d& at, const Vector3d& force, VectorXd& tau) const {
  Vector6d wrench;
  wrench << force, at.cross(force);
  for (int k : model_.supportDofs(body)) tau[k] += field_.workspace().J.col(k).dot(wrench);
}

void ManifoldWorld::calcForces(VectorXd& tau, std::array<double, kWorks>& power) {
  const Workspace& ws = field_.workspace();
  const VectorXd& v = field_.velocity();
  tau = tau_motors_;
  power[kMotors] = tau.dot(v);
  if (!push_.isZero(0)) {
    const Vector3d com = getPlace(pushed_body_, model_.bodies()[pushed_body_].inertia.com);
    addForce(pushed_body_, com, push_, tau);
    power[kPush] = push_.dot(calcVelocityAt(pushed_body_, com));
  }
  for (const ContactPoint& point : contacts_.points) {
    const Vector3d x = getPlace(point.body, point.p), velocity = calcVelocityAt(point.body, x);
    const ContactForce force = calcContactForce(contacts_.terrain, point, x, velocity);
    if (force.elastic == 0) continue;
    addForce(point.body, x, force.force, tau);
    power[kContacts] += force.force.dot(velocity);
  }
  for (const JointStop& stop : contacts_.stops) {
    const double q = ws.q[stop.coordinate];
    if (q <= stop.upper && q >= stop.lower) continue;
    const StopForce force = calcStopForce(stop, q, v[stop.dof]);
    tau[stop.dof] += force.force;
    power[kStops] += force.force * v[stop.dof];
  }
  for (const JointForce& force : model_.jointForces())
    power[kJoints] += calcDissipativeForce(force, v[force.dof]) * v[force.dof];
  for (const PointSpring& spring : model_.pointSprings()) {
    const PointSpringLine<double> line(ws, spring);
    power[kJoints] -= spring.damping * line.rate * line.rate;
  }
}

void ManifoldWorld::updateFeet() {
  clearFootForces();
  for (const ContactPoint& point : contacts_.points) {
    const Vector3d x = getPlace(point.body, point.p);
    const ContactForce force = calcContactForce(contacts_.terrain, point, x, calcVelocityAt(point.body, x));
    if (force.elastic > 0) addFootForce(point.contact, x, force.force);
  }
  reportFeet([this](int body) { return field_.workspace().X_WB[body]; });
}

Books ManifoldWorld::books() const {
  Books books = World::books();  // which also places the bodies
  contacts_.addTo(
      books, [this](int body, const Vector3d& point) { return ws_.X_WB[body].act(point); },
      [this](const JointStop& stop) { return q_[stop.coordinate]; });
  return books;
}

// Why a state has no accelerations.
std::string ManifoldWorld::describeState() const {
  return field_.failure().empty() ? "its accelerations are not finite after " + formatNumber(time_) + " s"
                                  : field_.failure();
}

std::string ManifoldWorld::describeStop() const {
  Eigen::Index fastest = 0;
  v_.cwiseAbs().maxCoeff(&fastest);
  std::string text = "the motion cannot go on after " + formatNumber(time_) + " s: its steps become shorter than " +
                     formatNumber(kShortestStep) + " s. ";
  if (!field_.failure().empty()) text += "Last reason: " + field_.failure() + ". ";
  return text + "Fastest is joint '" + model_.joints()[model_.dofs()[fastest].joint].name + "', at " +
         formatNumber(v_[fastest]);
}

}  // namespace

std::unique_ptr<World> makeManifoldWorld(const Model& model, const ManifoldWorldOptions& options) {
  return std::make_unique<ManifoldWorld>(model, options);
}

std::unique_ptr<World> makeOwnWorld(const Model& model, const WorldOptions& options) {
  return makePlayWorld(model, options, [](const Model& robot, const WorldOptions& o) {
    return o.tolerance > 0 ? makeManifoldWorld(robot, {o, {}, o.tolerance}) : makeBielleWorld(robot, {o, {}});
  });
}

}  // namespace bielle::worlds
