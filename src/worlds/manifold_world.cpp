#include <algorithm>
#include <array>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/worlds/bielle_world.h"
#include "dynamics/closed_field.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "math/runge_kutta.h"
#include "model/number_text.h"
#include "worlds/sole_track.h"

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
constexpr double kBeside = 1e-3;  // rad or m, of the displacement that tells a singular posture from its neighbours

enum Work { kMotors, kPush, kContacts, kStops, kJoints, kWorks };

class ManifoldWorld : public World {
 public:
  ManifoldWorld(const Model& model, const ManifoldWorldOptions& options);

  void reset(ConstVectorRef q, ConstVectorRef v) override;
  void setTorques(ConstVectorRef u) override;
  void setPush(const Vector3d& force) override { push_ = force; }
  bool advance(double duration) override;
  const std::string& message() const override { return message_; }
  double time() const override { return time_; }
  const VectorXd& configuration() const override { return q_; }
  const VectorXd& velocity() const override { return v_; }
  const VectorXd& torques() const override { return u_; }
  const std::vector<FootReport>& feet() const override { return soles_.reports(); }
  Books books() const override;
  double gap() const override { return gap_; }

 private:
  void checkStart(int rank);
  bool evaluate(const VectorXd& x, VectorXd& rate);
  void calcForces(VectorXd& tau, std::array<double, kWorks>& power);
  void addForce(int body, const Vector3d& at, const Vector3d& force, VectorXd& tau) const;
  bool step(double& h);
  bool settle(ConstVectorRef d, ConstVectorRef u);
  void updateFeet();
  double calcElasticEnergy(double* of_stops = nullptr) const;
  bool fail(const std::string& why);
  std::string describeStop() const;

  Model model_;
  const std::atomic<bool>* const interrupt_;
  const int pushed_body_;
  const double tolerance_, longest_step_;
  const Terrain terrain_;
  ClosedField field_;
  RungeKutta method_;
  RungeKutta::Derivative derivative_;
  std::vector<ContactPoint> points_;
  std::vector<JointStop> stops_;
  SoleTrack soles_;
  VectorXd u_, q_, v_;  // nu, nq, nv
  Vector3d push_ = Vector3d::Zero();
  VectorXd tau_motors_, tau_, x_, rate_, scale_;
  std::array<double, kWorks> work_{};  // on the robot since reset(), J
  double time_ = 0, next_step_ = 0, usual_step_ = 0, gap_ = 0, best_independence_ = 1, least_independence_ = 1;
  double elastic_start_ = 0, stops_start_ = 0;
  std::string message_;
  mutable Workspace ws_;
};

ManifoldWorld::ManifoldWorld(const Model& model, const ManifoldWorldOptions& options)
    : model_(model),
      interrupt_(options.world.interrupt),
      pushed_body_(options.world.pushed_body),
      tolerance_(std::max(options.tolerance, kLeastTolerance)),
      longest_step_(options.world.time_step > 0 ? options.world.time_step : std::numeric_limits<double>::infinity()),
      terrain_(options.world.ground),
      field_(model),
      method_(2 * model.nv() + kWorks),
      derivative_([this](const VectorXd& x, VectorXd& rate) { return evaluate(x, rate); }),
      points_(makeContactPoints(model, options.world.ground, options.contact)),
      stops_(makeJointStops(model)),
      soles_(model),
      ws_(model) {
  u_.setZero(model.nu());
  q_ = model.makeNeutral();
  for (VectorXd* x : {&v_, &tau_motors_, &tau_}) x->setZero(model.nv());
  for (VectorXd* x : {&x_, &rate_}) x->setZero(2 * model.nv() + kWorks);
  scale_.setZero(2 * model.nv());
}

void ManifoldWorld::reset(ConstVectorRef q, ConstVectorRef v) {
  requireFinite(q, v);
  message_.clear();
  time_ = 0;
  work_.fill(0);
  next_step_ = usual_step_ = kFirstStep;
  u_.setZero();
  tau_motors_.setZero();
  push_.setZero();
  q_ = q;
  v_ = v;
  soles_.reset();
  if (!model_.closures().empty()) {
    const int rank = field_.select(q_);
    if (rank <= ClosedField::kDenseRows) checkStart(rank);
    if (!message_.empty()) return;
  }
  if (!settle(VectorXd::Zero(model_.nv()), v_)) fail(field_.failure());
  best_independence_ = field_.independence();
  for (ContactPoint& point : points_) {
    point.touches = false;
    updateAnchor(terrain_, field_.workspace().X_WB[point.body].act(point.p), ContactForce(), point);
  }
  elastic_start_ = calcElasticEnergy(&stops_start_);
}

// A posture where rows are dependent that are independent all around it: the motion is not determined.
void ManifoldWorld::checkStart(int rank) {
  const VectorXd aside = model_.integrate(q_, kBeside * VectorXd::LinSpaced(model_.nv(), -0.7, 1.1));
  const AssemblyResult beside = closeConfiguration(model_, aside);
  if (beside.status != NumericalStatus::Ok) return;
  const int other = calcMobility(model_, beside.q).rank;
  if (other > rank)
    fail("the loops are singular at the start: they have rank " + std::to_string(rank) + ", and " +
         std::to_string(other) + " beside it; start from another posture");
}

void ManifoldWorld::setTorques(ConstVectorRef u) {
  for (int m = 0; m < model_.nu(); ++m) {
    const Motor& motor = model_.motors()[m];
    u_[m] = motor.clampEffort(u[m], v_[motor.dof]);
  }
  calcMotorForces(model_, u_, tau_motors_);
}

bool ManifoldWorld::fail(const std::string& why) {
  message_ = why;
  return false;
}

// The state at d, u of a chart that begins at q_, as the state of the world.
bool ManifoldWorld::settle(ConstVectorRef d, ConstVectorRef u) {
  field_.begin(q_);
  if (!field_.close(d, u)) return false;
  gap_ = field_.calcGap();
  if (gap_ > kOpen) return fail("the rank of its loops changes there: a posture where they lock");
  q_ = field_.configuration();
  model_.normalize(q_);
  v_ = field_.velocity();
  return true;
}

bool ManifoldWorld::advance(double duration) {
  if (!message_.empty()) return false;
  if (!(duration > 0)) return true;
  const double end = time_ + duration;
  bool is_first = true;
  while (time_ < end) {
    if (!is_first && interrupt_ && *interrupt_) break;
    is_first = false;
    const double left = end - time_, wanted = std::min(next_step_, longest_step_);
    // Two halves rather than a step and a splinter.
    double h = wanted >= left ? left : 2 * wanted > left ? 0.5 * left : wanted;
    const bool is_last = h == left;
    const double asked = h;
    if (!step(h)) return false;
    time_ = is_last && h == asked ? end : time_ + h;
  }
  updateFeet();
  return time_ >= end;
}

// Takes one step of h or, where it has to, of less.
bool ManifoldWorld::step(double& h) {
  const int nv = model_.nv();
  field_.begin(q_);
  x_.setZero();
  x_.segment(nv, nv) = v_;
  if (!evaluate(x_, rate_)) return fail(field_.failure());
  const double independence = field_.independence();
  if (independence < kLessIndependent * best_independence_ && independence > kNearest * best_independence_) {
    field_.select(q_);
    field_.begin(q_);
    if (!evaluate(x_, rate_)) return fail(field_.failure());
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
        q_ = field_.configuration();
        model_.normalize(q_);
        v_ = field_.velocity();
        for (int w = 0; w < kWorks; ++w) work_[w] += end[2 * nv + w];
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
  for (ContactPoint& point : points_) {
    const Workspace& ws = field_.workspace();
    const Vector3d x = ws.X_WB[point.body].act(point.p);
    const Vector6d& V = ws.V[point.body];
    const Vector3d velocity = V.head<3>() + V.tail<3>().cross(x);
    updateAnchor(terrain_, x, calcContactForce(terrain_, point, x, velocity), point);
  }
  return true;
}

bool ManifoldWorld::evaluate(const VectorXd& x, VectorXd& rate) {
  const int nv = model_.nv();
  if (!field_.close(x.head(nv), x.segment(nv, nv))) return false;
  least_independence_ = std::min(least_independence_, field_.independence());
  std::array<double, kWorks> power{};
  calcForces(tau_, power);
  field_.accelerate(tau_, rate.head(nv), rate.segment(nv, nv));
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
  const auto calcVelocityAt = [&ws](int body, const Vector3d& x) -> Vector3d {
    return ws.V[body].head<3>() + ws.V[body].tail<3>().cross(x);
  };
  if (!push_.isZero(0)) {
    const Vector3d com = ws.X_WB[pushed_body_].act(model_.bodies()[pushed_body_].inertia.com);
    addForce(pushed_body_, com, push_, tau);
    power[kPush] = push_.dot(calcVelocityAt(pushed_body_, com));
  }
  for (const ContactPoint& point : points_) {
    const Vector3d x = ws.X_WB[point.body].act(point.p), velocity = calcVelocityAt(point.body, x);
    const ContactForce force = calcContactForce(terrain_, point, x, velocity);
    if (force.elastic == 0) continue;
    addForce(point.body, x, force.force, tau);
    power[kContacts] += force.force.dot(velocity);
  }
  for (const JointStop& stop : stops_) {
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
  const Workspace& ws = field_.workspace();
  soles_.clearForces();
  for (const ContactPoint& point : points_) {
    const Vector3d x = ws.X_WB[point.body].act(point.p);
    const Vector3d velocity = ws.V[point.body].head<3>() + ws.V[point.body].tail<3>().cross(x);
    const ContactForce force = calcContactForce(terrain_, point, x, velocity);
    if (force.elastic > 0) soles_.addForce(point.contact, x, force.force);
  }
  soles_.update([&ws](int body) { return ws.X_WB[body]; });
}

double ManifoldWorld::calcElasticEnergy(double* of_stops) const {
  updatePlacements<double>(model_, ws_, q_);
  double contacts = 0, stops = 0;
  for (const ContactPoint& point : points_)
    contacts += calcContactForce(terrain_, point, ws_.X_WB[point.body].act(point.p), Vector3d::Zero()).elastic;
  for (const JointStop& stop : stops_) stops += calcStopForce(stop, q_[stop.coordinate], 0).elastic;
  if (of_stops) *of_stops = stops;
  return contacts + stops;
}

Books ManifoldWorld::books() const {
  updatePositions(model_, ws_, q_);
  updateVelocities<double>(model_, ws_, v_);
  Books books;
  books.kinetic = calcKineticEnergy(model_, ws_);
  books.potential = calcPotentialEnergy(model_, ws_);
  double stops = 0;
  books.elastic = calcElasticEnergy(&stops);
  books.motor_work = work_[kMotors];
  books.push_work = work_[kPush];
  books.contact_loss = -work_[kContacts] - (books.elastic - stops - (elastic_start_ - stops_start_));
  books.stop_loss = stops_start_ - stops - work_[kStops];
  books.other_loss = -work_[kJoints];
  return books;
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

}  // namespace bielle::worlds
