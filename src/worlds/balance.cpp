#include "worlds/balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

constexpr double kTimeConstants = 3;    // for which a robot that stands was at rest or over its support
constexpr double kCarriedShare = 0.25;  // of the weight, of a sole that carries
constexpr double kTurnedOver = 0.2;     // of such a sole, rad: what lets go turns by less (describeFeet())
constexpr double kLate = 0.1;           // of a time constant, by which a foot may land late
constexpr double kRest = 1e-6;          // kinetic energy of a robot at rest, of m |g| z
constexpr double kSinking = 0.3;        // of z in a time constant: its legs give way, which soles do not tell

}  // namespace

Balance::Balance(const World& world, const ContactSchedule& planned)
    : world_(world),
      planned_(planned),
      terrain_(world.ground()),
      is_free_(world.model().hasFreeFlyer() && !world.model().contacts().empty()),
      ws_(world.model()),
      up_(-world.model().gravity()) {
  if (up_.norm() > 0) up_.normalize();
  const Vector3d along = (Vector3d::UnitX() - up_.x() * up_).norm() > 0.5 ? Vector3d::UnitX() : Vector3d::UnitY();
  across_.row(0) = (along - up_.dot(along) * up_).normalized();
  across_.row(1) = up_.cross(along).normalized();
  awaited_.resize(world.model().contacts().size());
  support_.reserve(8 * world.model().contacts().size());
}

void Balance::update(double plan_time, const std::vector<PredictedFoothold>& foreseen, bool is_pushed) {
  if (!is_free_) return;
  const Model& model = world_.model();
  updatePositions(model, ws_, world_.configuration());
  updateVelocities(model, ws_, world_.velocity());
  findSupport(plan_time, foreseen);
  const Vector3d com = calcCom(model, ws_), velocity = calcComVelocity(model, ws_);
  speed_ = velocity.norm();
  const double g = model.gravity().norm(), kinetic = calcKineticEnergy(model, ws_);
  excess_ = std::numeric_limits<double>::infinity();
  bool is_at_rest = kinetic == 0;
  is_sinking_ = false;
  if (g > 0 && !support_.empty()) {
    const double height = std::max(0.0, up_.dot(com) - ground_);
    tau_ = std::sqrt(height / g);
    excess_ = calcExcess(across_ * (com + tau_ * velocity));
    is_at_rest = kinetic <= kRest * model.mass() * g * height;
    is_sinking_ = -tau_ * up_.dot(velocity) > kSinking * height;
  }
  is_calm_ = (touches_ && is_at_rest) || (excess_ <= 0 && !is_turned_over_);
  if (is_pushed || (touches_ && (!is_calm_ || is_sinking_))) disturbed_ = world_.time();
}

bool Balance::stands() const {
  if (!is_free_) return true;
  return touches_ && is_calm_ && (!disturbed_ || world_.time() - *disturbed_ >= kTimeConstants * tau_);
}

std::string Balance::describe() const {
  const std::string moves = "its centre of mass moves at " + formatNumber(speed_, "%.2f m/s");
  if (!touches_) return "no sole touches the ground, " + moves;
  if (is_turned_over_) return "a sole that carries it is turned over an edge, " + moves;
  if (is_sinking_) return "its legs give way, " + moves;
  if (!(excess_ > 0)) return "its capture point is over its soles again, " + moves;
  return "its capture point is " + formatNumber(excess_, "%.3f m") + " beyond its soles, " + moves;
}

bool Balance::isTurnedOver(int contact) const {
  const ContactFrame& sole = world_.model().contacts()[static_cast<size_t>(contact)];
  if (sole.kind != ContactKind::Surface6D) return false;
  const SE3 X_WF = getPlacement(ws_, sole.body, sole.X_BF);
  const Vector3d force = X_WF.R * world_.feet()[static_cast<size_t>(contact)].wrench.head<3>();
  if (up_.dot(force) < kCarriedShare * world_.model().mass() * world_.model().gravity().norm()) return false;
  return terrain_.find(X_WF.p.x(), X_WF.p.y()).normal.dot(X_WF.R.col(2)) < std::cos(kTurnedOver);
}

void Balance::addSole(int contact, const SE3& X_WF) {
  const ContactFrame& sole = world_.model().contacts()[static_cast<size_t>(contact)];
  for (const double x : {-sole.half_length, sole.half_length})
    for (const double y : {-sole.half_width, sole.half_width}) {
      const Vector3d corner = X_WF.act(Vector3d(x, y, 0));
      support_.emplace_back(across_ * corner);
      ground_ += up_.dot(corner);
    }
}

void Balance::findSupport(double plan_time, const std::vector<PredictedFoothold>& foreseen) {
  support_.clear();
  ground_ = 0;
  touches_ = is_turned_over_ = false;
  is_flight_planned_ = isFlightPlanned(plan_time);
  const auto& contacts = world_.model().contacts();
  for (size_t c = 0; c < contacts.size(); ++c) {
    const int contact = static_cast<int>(c);
    if (world_.feet()[c].touches) {
      touches_ = true;
      is_turned_over_ = is_turned_over_ || isTurnedOver(contact);
      addSole(contact, getPlacement(ws_, contacts[c].body, contacts[c].X_BF));
    }
    const auto next = std::find_if(foreseen.begin(), foreseen.end(),
                                   [&](const PredictedFoothold& foothold) { return foothold.contact == contact; });
    std::optional<SE3>& awaited = awaited_[c];
    if (next != foreseen.end())
      awaited = next->X_WF;
    else if (world_.feet()[c].touches)
      awaited.reset();
    if (awaited) {
      addSole(contact, *awaited);
    } else if (!foreseen.empty()) {
      for (const PredictedFoothold& other : foreseen) addStepAfter(contact, other);
    } else if (const ContactTarget* landing =
                   findLanding(contact, world_.feet()[c].touches ? plan_time : plan_time - kLate * tau_)) {
      addSole(contact, landing->X_WT);
    }
  }
  if (!support_.empty()) ground_ /= static_cast<double>(support_.size());
}

// Where a foot, which a controller does not yet see land, goes from the foothold of another: as far along it as that is from here.
void Balance::addStepAfter(int contact, const PredictedFoothold& other) {
  const ContactFrame& sole = world_.model().contacts()[static_cast<size_t>(contact)];
  SE3 X_WF = getPlacement(ws_, sole.body, sole.X_BF);
  const Vector3d along = other.X_WF.R.col(0);
  X_WF.p += 2 * along.dot(other.X_WF.p - X_WF.p) * along;
  addSole(contact, X_WF);
}

bool Balance::isFlightPlanned(double plan_time) const {
  double end = 0;
  for (const ContactPhase& phase : planned_.phases) {
    end += phase.nodes * phase.dt;
    if (end > plan_time) return phase.contacts.empty();
  }
  return false;
}

// Where a foot lands next by the plan: that is in the air, or will be.
const ContactTarget* Balance::findLanding(int contact, double plan_time) const {
  double end = 0;
  bool stood = true;
  for (const ContactPhase& phase : planned_.phases) {
    end += phase.nodes * phase.dt;
    if (end <= plan_time) continue;
    const auto target = std::find_if(phase.contacts.begin(), phase.contacts.end(),
                                     [contact](const ContactTarget& each) { return each.contact == contact; });
    if (target != phase.contacts.end() && !stood) return &*target;
    stood = target != phase.contacts.end();
  }
  return nullptr;
}

// How far a point is beyond the convex hull of the support, m, by the directions that separate them: away from a corner, or
// normal to an edge. Not above zero inside.
double Balance::calcExcess(const Eigen::Vector2d& x) const {
  const auto separate = [&](const Eigen::Vector2d& direction) {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& corner : support_) farthest = std::max(farthest, direction.dot(corner));
    return direction.dot(x) - farthest;
  };
  double excess = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < support_.size(); ++i) {
    const Eigen::Vector2d away = x - support_[i];
    if (away.norm() > 0) excess = std::max(excess, separate(away.normalized()));
    for (size_t j = 0; j < i; ++j) {
      const Eigen::Vector2d edge = support_[i] - support_[j], normal(-edge.y(), edge.x());
      if (normal.norm() == 0) continue;
      for (const double sign : {-1.0, 1.0}) excess = std::max(excess, separate(sign * normal.normalized()));
    }
  }
  return excess;
}

}  // namespace bielle::worlds
