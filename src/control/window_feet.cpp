// Feet that land early or late: with which stage the window then begins.
#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "control/window_planner.h"
#include "motion/foot_tasks.h"

namespace bielle {
namespace {

constexpr int kEarly = 2;  // stages before its landing at which a foot counts as early
// Of the reference robot (motion/robot_size.h).
constexpr double kLandingWay = 0.01;    // that it may then be farther off than where it may land, m
constexpr double kLoweringSpeed = 0.3;  // m/s
constexpr double kDepth = 0.05;         // to which it is lowered, m

}  // namespace

bool WindowPlanner::stands(int stage, int contact) const {
  const std::vector<int>& standing = getSpec(stage).constraints.contacts;
  return std::find(standing.begin(), standing.end(), contact) != standing.end();
}

// Where a foot is to stand with a stage.
const SE3& WindowPlanner::getFoothold(int stage, int contact) const {
  const ConstraintSet& set = getSpec(stage).constraints;
  int c = set.num_loops;
  while (set.getContact(c) != contact) ++c;
  return set.closures[c].X_B2;
}

// Near enough to where it should land.
bool WindowPlanner::isOverFoothold(int landing, int contact, ConstVectorRef q) {
  const SE3& X_WT = getFoothold(landing, contact);
  const ContactFrame& foot = model_.contacts()[contact];
  updatePlacements<double>(model_, feet_, q);
  const Vector3d off = X_WT.R.transpose() * (getPlacement(feet_, foot.body, foot.X_BF).p - X_WT.p);
  const double room = getLandingRoom(contact, getSpec(landing)) + kLandingWay * size_.length;
  return off.head<2>().cwiseAbs().maxCoeff() <= room;
}

// The stage with which a foot stands that swings in this one but is on the ground early, or this stage.
int WindowPlanner::findLanding(int stage, const Measurement& measurement) {
  const std::vector<char>& contacts = measurement.contacts;
  const int contacts_of_model = static_cast<int>(contacts.size());
  for (int contact = 0; contact < contacts_of_model; ++contact) {
    if (!contacts[contact] || stands(stage, contact)) continue;
    int begin = stage, end = stage;  // of the swing
    while (begin > horizon_->begin() && !stands(begin - 1, contact)) --begin;
    while (end < horizon_->end() && !stands(end, contact)) ++end;
    if (end < horizon_->end() && stage - begin > (end - begin) / 2 && end - stage >= kEarly &&
        isOverFoothold(end, contact, measurement.q))
      return end;
  }
  return stage;
}

// The foot that should stand with a stage and has not found the ground, while another one carries; or -1.
int WindowPlanner::findLateFoot(int landing, const std::vector<char>& contacts) const {
  const int begin = landing - kLowering;
  if (begin < horizon_->begin() || isImpact(landing)) return -1;
  const int contacts_of_model = static_cast<int>(contacts.size());
  for (int contact = 0; contact < contacts_of_model; ++contact) {
    if (contacts[contact] || !stands(landing, contact)) continue;
    bool swings = true, carried = false;
    for (int k = begin; k < landing; ++k) swings = swings && !stands(k, contact);
    for (int other = 0; other < contacts_of_model; ++other)
      carried = carried || (other != contact && stands(begin, other) && stands(landing, other));
    if (swings && carried) return contact;
  }
  return -1;
}

void WindowPlanner::lower(int foot, int landing) {
  late_ = {foot, landing, 0};
  for (int k = landing - kLowering; k <= landing; ++k) {
    StageSpec spec = getSpec(k);
    lowerFoot(model_, foot, kLoweringSpeed * size_.velocity(), spec);
    problem_.replaceStage(horizon_->getNode(k), std::move(spec));
  }
  lowered_ = true;
}

// The stage that follows, by the feet that stand: the next one; that with which an early foot stands; or, while a foot is late,
// that from which on it is foreseen to land, over and over again.
int WindowPlanner::chooseNext(const Request& request, Solution& solution) {
  const std::vector<char>& contacts = request.measurement.contacts;
  const int next = request.stage + 1;
  if (contacts.empty()) return next;
  if (late_.foot < 0) {
    const int landing = findLanding(next, request.measurement);
    solution.early = landing != next;
    if (solution.early) return landing;
    while (late_.foot < 0 && checked_ < request.stage - kLate)
      if (const int foot = findLateFoot(++checked_, contacts); foot >= 0) lower(foot, checked_);
    if (late_.foot < 0) return next;
    solution.late = true;
  }
  const int begin = late_.landing - kLowering;
  if (!request.again) late_.waited += horizon_->getStart(begin + 1) - horizon_->getStart(begin);
  if (!contacts[late_.foot] && kLoweringSpeed * late_.waited < kDepth * size_.time) return begin;
  late_.foot = -1;
  return late_.landing;
}

// Where feet that are in the air at some stage of the window, which begins with this one, first stand after it.
void WindowPlanner::predictFootholds(int stage, Solution& solution) {
  solution.footholds.clear();
  const int contacts = static_cast<int>(model_.contacts().size()), shift = stage - grid_.begin();
  const std::vector<WindowGrid::Node>& nodes = grid_.nodes();
  for (int contact = 0; contact < contacts; ++contact) {
    size_t k = 1;
    const auto standsAt = [&](size_t node) { return stands(nodes[node].begin + shift, contact); };
    while (k < nodes.size() && (standsAt(k - 1) || !standsAt(k))) ++k;
    if (k == nodes.size()) continue;
    const ContactFrame& foot = model_.contacts()[contact];
    updatePlacements<double>(model_, feet_, trajectory_.xs[k].head(model_.nq()));
    solution.footholds.push_back(
        {contact, horizon_->getStart(nodes[k].begin + shift) - advance_, getPlacement(feet_, foot.body, foot.X_BF)});
  }
}

}  // namespace bielle
