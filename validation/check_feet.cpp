// Rows of the feet: standing, swinging and landing.
#include <algorithm>
#include <array>
#include <optional>

#include "check_rows.h"
#include "math/largest.h"
#include "math/so3.h"

namespace bielle::validation {
namespace {

using Corners = std::array<Vector3d, 4>;

// Corners in the world, in order around the sole; four times the origin for a contact without a sole.
Corners calcCorners(const ContactFrame& contact, const SE3& X_WF) {
  const double l = contact.half_length, w = contact.half_width;
  Corners corners = {Vector3d(l, w, 0), Vector3d(-l, w, 0), Vector3d(-l, -w, 0), Vector3d(l, -w, 0)};
  for (Vector3d& corner : corners) corner = X_WF.act(corner);
  return corners;
}

// Calls visit(height over the ground under it, m) for points all over a sole: its middle may be over a gap or an edge that
// its corners do not see.
template <typename Visit>
void visitSole(const Ground& ground, const Corners& corners, const Visit& visit) {
  constexpr double kEvery = 5e-3;  // m
  const auto countPoints = [](double length) { return length < 1 ? 1 + static_cast<int>(length / kEvery) : 200; };
  const Vector3d along = corners[1] - corners[0], across = corners[3] - corners[0];
  const int n = countPoints(along.norm()), m = countPoints(across.norm());
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= m; ++j) {
      const Vector3d p = corners[0] + i * along / n + j * across / m;
      visit(p.z() - ground.calcHeight(p.x(), p.y()));
    }
}

// Least height of a point of the sole over the ground under it, m.
double calcClearance(const Ground& ground, const Corners& corners) {
  double least = corners[0].z() - ground.calcHeight(corners[0].x(), corners[0].y());
  visitSole(ground, corners, [&least](double height) { least = getSmaller(least, height); });
  return least;
}

// Largest distance of a point of the sole from the ground under it, m: a standing sole lies flat, and on the ground.
double calcGap(const Ground& ground, const Corners& corners) {
  double largest = 0;
  visitSole(ground, corners, [&largest](double height) { largest = getLarger(largest, std::abs(height)); });
  return largest;
}

// Largest speed of a corner, m/s; the twist in the contact's frame.
double calcCornerSpeed(const ContactFrame& contact, const Vector6d& twist) {
  double largest = 0;
  for (const Vector3d& corner : calcCorners(contact, SE3()))
    largest = getLarger(largest, (twist.head<3>() + twist.tail<3>().cross(corner)).norm());
  return largest;
}

// Seen from above, the widest gap between two soles across an edge of one of them; negative if they overlap.
double calcGapAcrossEdges(const Corners& a, const Corners& b) {
  double widest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d edge = (a[(i + 1) % 4] - a[i]).head<2>();
    if (edge.norm() < 1e-9) continue;  // NaN passes
    const Eigen::Vector2d normal = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    const auto along = [&normal](const Vector3d& corner) { return normal.dot(corner.head<2>()); };
    double end = along(a[0]), begin_b = along(b[0]), begin = end, end_b = begin_b;
    for (int j = 1; j < 4; ++j) {
      begin = getSmaller(begin, along(a[j])), end = getLarger(end, along(a[j]));
      begin_b = getSmaller(begin_b, along(b[j])), end_b = getLarger(end_b, along(b[j]));
    }
    widest = getLarger(widest, getLarger(begin_b - end, begin - end_b));
  }
  return widest;
}

bool hasSole(const ContactFrame& contact) { return contact.half_length > 0; }

// Nodes [begin, end) during which a contact is in the air.
struct Flight {
  int contact = 0, begin = 0, end = 0;
};

std::vector<Flight> listFlights(const CheckedMotion& motion) {
  std::vector<Flight> flights;
  for (int c = 0; c < static_cast<int>(motion.model.contacts().size()); ++c)
    for (int k = 0, begin = -1; k <= motion.numStages() + 1; ++k) {
      const bool flies = k <= motion.numStages() && !motion.stands(c, k);
      if (flies && begin < 0) begin = k;
      if (!flies && begin >= 0) {
        flights.push_back({c, begin, k});
        begin = -1;
      }
    }
  return flights;
}

}  // namespace

void addStanceRows(CheckContext& context) {
  const Model& model = context.model();
  const CheckBounds& bounds = context.bounds;
  Worst slip, angle, height, landing;
  for (int c = 0; c < static_cast<int>(model.contacts().size()); ++c) {
    const ContactFrame& contact = model.contacts()[c];
    std::optional<SE3> touch_down;
    for (int k = 0; k <= context.motion.numStages(); ++k) {
      if (!context.motion.stands(c, k)) {
        touch_down.reset();
        continue;
      }
      const NodeTrace& node = context.trace.nodes[k];
      if (!touch_down) {
        if (k > 0) landing.add(calcCornerSpeed(contact, node.foot_twists[c]), k, contact.name);
        touch_down = node.feet[c];
      }
      const SE3 moved = touch_down->inverseTimes(node.feet[c]);
      slip.add(moved.p.norm(), k, contact.name);
      if (contact.kind == ContactKind::Surface6D) angle.add(log3(moved.R).norm(), k, contact.name);
      if (contact.kind == ContactKind::Edge5D)  // its direction: it may roll
        angle.add(moved.R.col(0).tail<2>().norm(), k, contact.name);
      height.add(calcGap(context.motion.summary.ground, calcCorners(contact, node.feet[c])), k, contact.name);
    }
  }
  const std::string nothing = "no foot stands";
  context.add(slip, "standing feet: slip", "m", bounds.slip, nothing);
  context.add(angle, "standing feet: slip, angle", "rad", bounds.slip_angle, nothing);
  context.add(height, "standing feet: off the ground", "m", bounds.sole_height, nothing);
  context.add(landing, "landing velocity", "m/s", bounds.landing_velocity, "no foot lands");
}

void addSwingRows(CheckContext& context) {
  const Model& model = context.model();
  const CheckBounds& bounds = context.bounds;
  Worst clearance(CheckRow::Kind::AtLeast), below(CheckRow::Kind::AtLeast), distance(CheckRow::Kind::AtLeast);
  const auto getCorners = [&](int contact, int node) {
    return calcCorners(model.contacts()[contact], context.trace.nodes[node].feet[contact]);
  };
  for (const Flight& flight : listFlights(context.motion)) {
    const std::string& name = model.contacts()[flight.contact].name;
    const double quarter = 0.25 * (flight.end - flight.begin);
    const bool steps = flight.begin > 0 && flight.end <= context.motion.numStages();  // from the ground to the ground
    for (int k = flight.begin; k < flight.end; ++k) {
      const double height = calcClearance(context.motion.summary.ground, getCorners(flight.contact, k));
      below.add(height, k, name);
      if (steps && k >= flight.begin + quarter && k <= flight.end - quarter) clearance.add(height, k, name);
    }
  }
  const std::vector<ContactFrame>& contacts = model.contacts();
  for (int k = 0; k <= context.motion.numStages(); ++k)
    for (int a = 0; a < static_cast<int>(contacts.size()); ++a)
      for (int b = 0; b < a; ++b) {
        if (!hasSole(contacts[a]) || !hasSole(contacts[b]) || contacts[a].body == contacts[b].body) continue;
        const Corners first = getCorners(a, k), second = getCorners(b, k);
        distance.add(getLarger(calcGapAcrossEdges(first, second), calcGapAcrossEdges(second, first)), k,
                     contacts[b].name + " and " + contacts[a].name);
      }
  context.add(clearance, "swinging feet: clearance", "m", bounds.clearance, "no foot swings");
  context.add(below, "swinging feet: least height", "m", -bounds.below_ground, "no foot swings");
  Worst bodies(CheckRow::Kind::AtLeast);
  for (int k = 0; k <= context.motion.numStages(); ++k)
    for (int i = 1; i < model.numBodies(); ++i) {
      if (model.bodies()[i].inertia.mass == 0) continue;
      const Vector3d p = context.trace.nodes[k].bodies[i].act(model.bodies()[i].inertia.com);
      bodies.add(p.z() - context.motion.summary.ground.calcHeight(p.x(), p.y()), k, model.bodies()[i].name);
    }
  if (model.hasFreeFlyer()) context.add(bodies, "bodies: least height", "m", 0, "no body has mass");
  context.add(distance, "distance of the soles", "m", bounds.feet_distance, "there are no two soles");
}

}  // namespace bielle::validation
