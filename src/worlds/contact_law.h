#pragma once
/// \file Compliant contact with friction that sticks, for worlds that have no contact of their own.
///
/// A sole touches with the corners of its rectangle, an edge with its ends, a point contact with its origin. Corners that overhang a
/// step lie on its edge, so that the sole rests on all of it that the ground bears. Where the ground has steps, whose edges may lie
/// anywhere under it, there is a grid of points between the corners, too. It is a little higher, by what a corner sinks under the
/// robot's weight, and so bears only what comes up between them: the same sole turns about its normal under the same moment
/// whatever ground is elsewhere, and bears all that plans ask of it (cost.h, makeWrenchCone(): the sum of the cones of four corners;
/// a sole of even pressure would bear only about half of that).
///
/// A point at x with velocity x' is by d deep in the ground, whose normal there is n (Terrain::touch); T = 1 - n n^T. With the
/// stiffness k of the point,
///
///     f_n = k d max(0, 1 + c d'),   d' = -n . x'          while d > 0, else no force                              (1)
///
/// a linear spring with the damping of Hunt and Crossley ("Coefficient of restitution interpreted as damping in
/// vibroimpact", 1975): continuous at touchdown, and it never pulls. Friction is a spring between the point and its anchor a
/// (a bristle), with a damper; P_F shortens a vector to the length F = mu f_n:
///
///     s = P_F(-k_t T (x - a)),   f_t = P_F(s - c_t T x')                                                            (2)
///
/// Inside the cone nothing slides: the force is that of the spring, at rest without any creep. At the cone the anchor is
/// dragged along, once per step,
///
///     a <- x + s / k_t    (and a <- x, while the point is in the air)                                                (3)
///
/// which leaves (2) as it is. Forces between two updates of (3) are thus functions of the state. The springs hold
///
///     e = 1/2 k d^2 + |s|^2 / (2 k_t)                                                                              (4)
///
/// and what the ground takes, -f . x', less what the springs hold, is dissipated: with t = s - c_t T x', the damper and the
/// slider take |s - f_t|^2 / c_t + (s - f_t) . (f_t - t) / c_t >= 0 in (2), and (3) lowers e.
///
/// Over a step in which d goes from d_0 to d_1 and x has the mean x_m, worlds with fixed steps take
///
///     d = (e(d_1) - e(d_0)) / (k (d_1 - d_0)),   e(d) = 1/2 k max(0, d)^2,   x = x_m                               (5)
///
/// in (1) and (2), so that springs take, within the cone, exactly the work that they hold after it, however hard they are and
/// wherever in the step the point touches down (Gonzalez, "Time integration and discrete Hamiltonian systems", 1996).
///
/// T is double, or Lanes for the same point of as many robots.
#include <array>
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "bielle/worlds/bielle_world.h"
#include "math/lane_masks.h"
#include "worlds/terrain.h"

namespace bielle::worlds {

/// One point of a contact, with its coefficients.
template <typename T>
struct ContactPointOf {
  int contact = 0;                           ///< index into Model::contacts()
  int body = 0;                              ///< that carries it
  bool is_corner = true;                     ///< or an end of an edge, or alone; others lie between these
  Vector3<T> p = Vector3<T>::Zero();         ///< in the frame of the body, m
  T stiffness = 0;                           ///< k, N/m
  double damping = 0;                        ///< c, s/m
  T shear_stiffness = 0, shear_damping = 0;  ///< k_t, N/m; c_t, N s/m
  T share = 1;                               ///< of k, k_t and c_t: 1, or more where settle() says so
  Vector3<T> anchor = Vector3<T>::Zero();    ///< a, m (world)
  MaskOf<T> touches = makeMask<T>(false);    ///< as of the last update of the anchor
  Vector3<T> from =
      Vector3<T>::Zero();  ///< outside of the ground: through which of its surfaces the point came, m (world)
};
using ContactPoint = ContactPointOf<double>;

/// The points of a sole or an edge, and where they lie on it while the ground is under them.
struct ContactArea {
  int body = 0;
  SE3 X_BF;
  double half_length = 0, half_width = 0;  ///< m
  double corner_share = 1;                 ///< k of a corner over that of a point between them
  size_t first = 0;                        ///< of its points
  std::vector<Vector3d> homes;             ///< in the frame of the contact, m
  std::vector<Terrain::Place> places;      ///< as settle() found them
  std::vector<ContactPoint> lane{};        ///< up to its last point, of one of several robots
};

/// The points of all contacts of a model on a ground, contact by contact. The corners of a sole share its stiffness; each of the
/// grid between them has its share of the same.
std::vector<ContactPoint> makeContactPoints(const Model& model, const Ground& ground,
                                            const ContactOptions& options = {});

/// Height of the lowest corner of all soles at q, m (world).
double calcLeastHeight(const Model& model, Workspace& ws, ConstVectorRef q);

/// Of those points. Contacts of a single point have none.
std::vector<ContactArea> makeContactAreas(const Model& model, const std::vector<ContactPoint>& points);

template <typename T>
struct ContactForceOf {
  Vector3<T> force = Vector3<T>::Zero();   ///< on the point, N (world)
  Vector3<T> spring = Vector3<T>::Zero();  ///< s, N (world)
  Vector3<T> shift = Vector3<T>::Zero();   ///< from x to where the spring is taken, in a step, m (world)
  T elastic = 0;                           ///< e, J
  Matrix3<T> damping = Matrix3<T>::
      Zero();  ///< -df/dx', in a step with what springs add by then, N s/m; not symmetric where the point slides: (1) sets the cone
  MaskOf<T> slides = makeMask<T>(false);  ///< whether s or f_t is at the cone
};
using ContactForce = ContactForceOf<double>;
/// A step of length h, whose first half has the velocity `before` and whose second half another one; the mean of both is that of
/// the force, which is (5) then. Without one, (1) and (2) hold at an instant.
template <typename T>
struct ContactStepOf {
  T h = 0;                                 ///< s
  Vector3<T> before = Vector3<T>::Zero();  ///< m/s (world)
};
using ContactStep = ContactStepOf<double>;
/// What is under each robot: a ground for all, or one of its own. Either all have steps, or none.
template <typename T>
struct GroundsOf {
  GroundsOf(const Terrain& terrain) : height(terrain.ground().height) { terrains.fill(&terrain); }
  void set(int lane, const Terrain& terrain) {
    terrains[lane] = &terrain;
    setLaneOf(height, lane, terrain.ground().height);
  }
  bool hasSteps() const { return !terrains[0]->ground().steps.empty(); }

  std::array<const Terrain*, kLanesOf<T>> terrains;  ///< which outlive this
  T height;                                          ///< of the planes, m
};
/// Terrain::Touch.
template <typename T>
struct TouchOf {
  T depth = 0;
  Vector3<T> normal = Vector3<T>::UnitZ();
};
/// Terrain::touch(x, from)
template <typename T>
TouchOf<T> findTouch(const GroundsOf<T>& grounds, const Vector3<T>& x, const Vector3<T>& from);
/// Eqs. (1), (2) and (4) at a position and a velocity (world).
/// \param with_damping  whether to fill the derivative
ContactForce calcContactForce(const Terrain& terrain, const ContactPoint& point, const Vector3d& x,
                              const Vector3d& velocity, bool with_damping = false, const ContactStep& step = {});
/// \param touch     findTouch(grounds, x, point.from), which does not depend on the velocity   \param mu  friction of the ground
template <typename T>
ContactForceOf<T> calcContactForce(const TouchOf<T>& touch, const T& mu, const ContactPointOf<T>& point,
                                   const Vector3<T>& x, const Vector3<T>& velocity, bool with_damping,
                                   const ContactStepOf<T>& step);
/// Eq. (3), for the force at x, and where the point came from.
template <typename T>
void updateAnchor(const GroundsOf<T>& grounds, const Vector3<T>& x, const ContactForceOf<T>& force,
                  ContactPointOf<T>& point);
inline void updateAnchor(const Terrain& terrain, const Vector3d& x, const ContactForce& force, ContactPoint& point) {
  updateAnchor<double>(terrain, x, force, point);
}
/// The point of one of several robots.
ContactPoint takeLane(const ContactPointOf<Lanes>& point, int lane);

/// Moves points of an area that overhang a step onto its edge, where they are nearest, and back. Their bristles stay as they are bent.
/// What lies on a step may have more corners than the sole; points of the grid that take them bear like corners there.
template <typename T>
void settle(const GroundsOf<T>& grounds, const SE3Of<T>& X_WF, ContactArea& area,
            std::vector<ContactPointOf<T>>& points);

/// A stop of a joint: (1) in one coordinate.
struct JointStop {
  int dof = 0, coordinate = 0;        ///< indices into v and q
  double lower = 0, upper = 0;        ///< rad or m
  double stiffness = 0, damping = 0;  ///< N m/rad or N/m; s/rad or s/m
};
/// Whether limits of such a joint are stops: its coordinates are angles or lengths, and change at its velocities.
bool hasStops(JointKind kind);
/// Of all limits of these joints. Without gravity they are as hard as on Earth. A range of less than 0.05 rad or 5 mm is play: its
/// ends are harder, and nothing rebounds from them.
std::vector<JointStop> makeJointStops(const Model& model);

template <typename T>
struct StopForceOf {
  T force = 0;    ///< on the coordinate, N m or N
  T elastic = 0;  ///< J
  T damping = 0;  ///< -d force/dv, not negative
};
using StopForce = StopForceOf<double>;
/// As ContactStep, of a coordinate.
template <typename T>
struct StopStepOf {
  T h = 0;       ///< s
  T before = 0;  ///< rad/s or m/s
};
using StopStep = StopStepOf<double>;
template <typename T>
StopForceOf<T> calcStopForce(const JointStop& stop, const T& q, const T& v, const StopStepOf<T>& step);
inline StopForce calcStopForce(const JointStop& stop, double q, double v, const StopStep& step = {}) {
  return calcStopForce<double>(stop, q, v, step);
}

/// All points and stops of a robot on its ground, with the energy that their springs held at the start.
/// Places are those of points in the world: body, point of it -> m. Coordinates are those of joints with stops: stop -> rad or m.
template <typename T>
class ContactSetOf {
 public:
  ContactSetOf(const ContactSetOf&) = delete;
  ContactSetOf& operator=(const ContactSetOf&) = delete;
  ContactSetOf(const Model& model, const Ground& ground, const ContactOptions& options)
      : terrain(ground),
        grounds(terrain),
        stops(makeJointStops(model)),
        made_(makeContactPoints(model, ground, options)) {
    for (const ContactPoint& point : made_) {
      points.emplace_back();
      points.back().contact = point.contact;
      points.back().body = point.body;
      points.back().p = point.p.cast<T>();
      points.back().damping = point.damping;
    }
    setHardness(1);
    if (!ground.steps.empty()) areas_ = makeContactAreas(model, made_);
  }
  /// Robots whose weight is `ratio` times that of the model sink as deep. Their stops are as much harder, too.
  void setHardness(const T& ratio) {
    for (size_t i = 0; i < points.size(); ++i) {
      points[i].stiffness = ratio * made_[i].stiffness;
      points[i].shear_stiffness = ratio * made_[i].shear_stiffness;
      points[i].shear_damping = ratio * made_[i].shear_damping;
    }
  }

  const Terrain terrain;
  GroundsOf<T> grounds;  ///< the terrain, unless robots have others
  std::vector<ContactPointOf<T>> points;
  const std::vector<JointStop> stops;

  /// Points that have not touched before. \param getPlacement  body -> X_WB
  template <typename GetPlacement>
  void reset(const GetPlacement& getPlacement) {
    for (ContactPointOf<T>& point : points) {
      point.touches = makeMask<T>(false);
      point.from = getPlacement(point.body).act(point.p) + T(kLift) * Vector3<T>::UnitZ();
    }
    settle(getPlacement);
    for (ContactPointOf<T>& point : points)
      updateAnchor<T>(grounds, getPlacement(point.body).act(point.p), ContactForceOf<T>(), point);
  }
  /// Of all soles and edges; once per step, after the anchors.
  template <typename GetPlacement>
  void settle(const GetPlacement& getPlacement) {
    for (ContactArea& area : areas_) worlds::settle<T>(grounds, getPlacement(area.body) * area.X_BF, area, points);
  }
  template <typename GetPlace, typename GetCoordinate>
  void setStart(const GetPlace& getPlace, const GetCoordinate& getCoordinate) {
    start_ = calcElastic(getPlace, getCoordinate);
  }
  /// Sets the energy that springs hold, of which the losses so far are free.
  template <typename GetPlace, typename GetCoordinate>
  void addTo(Books& books, const GetPlace& getPlace, const GetCoordinate& getCoordinate) const {
    const Elastic now = calcElastic(getPlace, getCoordinate);
    books.elastic = now.all;
    books.contact_loss -= now.all - now.stops - (start_.all - start_.stops);
    books.stop_loss += start_.stops - now.stops;
  }

 private:
  static constexpr double kLift = 5e-3;  // soles that start so deep in a top stand on it, m
  std::vector<ContactPoint> made_;
  std::vector<ContactArea> areas_;  // on ground with steps
  struct Elastic {
    double all = 0, stops = 0;  // J; the latter a part of the former
  };
  template <typename GetPlace, typename GetCoordinate>
  Elastic calcElastic(const GetPlace& getPlace, const GetCoordinate& getCoordinate) const {
    double contacts = 0, stop = 0;
    for (const ContactPointOf<T>& point : points)
      contacts += calcContactForce(terrain, point, getPlace(point.body, point.p), Vector3d::Zero()).elastic;
    for (const JointStop& each : stops) stop += calcStopForce(each, getCoordinate(each), 0).elastic;
    return {contacts + stop, stop};
  }
  Elastic start_;
};
using ContactSet = ContactSetOf<double>;

}  // namespace bielle::worlds
