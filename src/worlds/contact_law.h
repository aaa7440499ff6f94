#pragma once
/// \file Compliant contact with friction that sticks, for worlds that have no contact of their own.
///
/// A sole touches with the corners of its rectangle or, where the ground has steps, whose edges may lie anywhere under it, with a
/// grid of points; a point contact with its origin. Points that overhang a step lie on its edge, so that the sole rests on all of it
/// that the ground bears. A point at x with velocity x' is by
/// d deep in the ground, whose normal there is n (Terrain::touch); T = 1 - n n^T. With the stiffness k of the point,
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
#include <vector>

#include "bielle/worlds/bielle_world.h"
#include "worlds/terrain.h"

namespace bielle::worlds {

/// One point of a contact, with its coefficients.
struct ContactPoint {
  int contact = 0;                                ///< index into Model::contacts()
  int body = 0;                                   ///< that carries it
  Vector3d p = Vector3d::Zero();                  ///< in the frame of the body, m
  double stiffness = 0, damping = 0;              ///< k, N/m; c, s/m
  double shear_stiffness = 0, shear_damping = 0;  ///< k_t, N/m; c_t, N s/m
  Vector3d anchor = Vector3d::Zero();             ///< a, m (world)
  bool touches = false;                           ///< as of the last update of the anchor
  Vector3d from = Vector3d::Zero();  ///< outside of the ground: through which of its surfaces the point came, m (world)
};

/// The points of a sole or an edge, and where they lie on it while the ground is under them.
struct ContactArea {
  int body = 0;
  SE3 X_BF;
  double half_length = 0, half_width = 0;  ///< m
  size_t first = 0;                        ///< of its points
  std::vector<Eigen::Vector2d> homes;      ///< in the frame of the contact, m
  std::vector<Terrain::Place> places;      ///< as settle() found them
};

/// The points of all contacts of a model on a ground, contact by contact; those of a sole share its stiffness.
std::vector<ContactPoint> makeContactPoints(const Model& model, const Ground& ground,
                                            const ContactOptions& options = {});

/// Of those points. Contacts of a single point have none.
std::vector<ContactArea> makeContactAreas(const Model& model, const std::vector<ContactPoint>& points);

struct ContactForce {
  Vector3d force = Vector3d::Zero();   ///< on the point, N (world)
  Vector3d spring = Vector3d::Zero();  ///< s, N (world)
  Vector3d shift = Vector3d::Zero();   ///< from x to where the spring is taken, in a step, m (world)
  double elastic = 0;                  ///< e, J
  Matrix3d damping = Matrix3d::
      Zero();  ///< -df/dx', in a step with what springs add by then, N s/m; not symmetric where the point slides: (1) sets the cone
  bool slides = false;  ///< whether s or f_t is at the cone
};
/// A step of length h, whose first half has the velocity `before` and whose second half another one; the mean of both is that of
/// the force, which is (5) then. Without one, (1) and (2) hold at an instant.
struct ContactStep {
  double h = 0;                        ///< s
  Vector3d before = Vector3d::Zero();  ///< m/s (world)
};
/// Eqs. (1), (2) and (4) at a position and a velocity (world).
/// \param with_damping  whether to fill the derivative
ContactForce calcContactForce(const Terrain& terrain, const ContactPoint& point, const Vector3d& x,
                              const Vector3d& velocity, bool with_damping = false, const ContactStep& step = {});
/// \param touch     Terrain::touch(x, point.from), which does not depend on the velocity   \param mu  friction of the ground
ContactForce calcContactForce(const Terrain::Touch& touch, double mu, const ContactPoint& point, const Vector3d& x,
                              const Vector3d& velocity, bool with_damping, const ContactStep& step);
/// Eq. (3), for the force at x, and where the point came from.
void updateAnchor(const Terrain& terrain, const Vector3d& x, const ContactForce& force, ContactPoint& point);

/// Moves points of an area that overhang a step onto its edge, where they are nearest, and back. Their bristles stay as they are bent.
void settle(const Terrain& terrain, const SE3& X_WF, ContactArea& area, std::vector<ContactPoint>& points);

/// A stop of a joint: (1) in one coordinate.
struct JointStop {
  int dof = 0, coordinate = 0;        ///< indices into v and q
  double lower = 0, upper = 0;        ///< rad or m
  double stiffness = 0, damping = 0;  ///< N m/rad or N/m; s/rad or s/m
};
/// Whether limits of such a joint are stops: its coordinates are angles or lengths, and change at its velocities.
bool hasStops(JointKind kind);
/// Of all limits of these joints. Without gravity they are as hard as on Earth.
std::vector<JointStop> makeJointStops(const Model& model);

struct StopForce {
  double force = 0;    ///< on the coordinate, N m or N
  double elastic = 0;  ///< J
  double damping = 0;  ///< -d force/dv, not negative
};
/// As ContactStep, of a coordinate.
struct StopStep {
  double h = 0;       ///< s
  double before = 0;  ///< rad/s or m/s
};
StopForce calcStopForce(const JointStop& stop, double q, double v, const StopStep& step = {});

/// All points and stops of a robot on its ground, with the energy that their springs held at the start.
/// Places are those of points in the world: body, point of it -> m. Coordinates are those of joints with stops: stop -> rad or m.
class ContactSet {
 public:
  ContactSet(const Model& model, const Ground& ground, const ContactOptions& options)
      : terrain(ground), points(makeContactPoints(model, ground, options)), stops(makeJointStops(model)) {
    if (!ground.steps.empty()) areas_ = makeContactAreas(model, points);
  }

  const Terrain terrain;
  std::vector<ContactPoint> points;
  const std::vector<JointStop> stops;

  /// Points that have not touched before. \param getPlacement  body -> X_WB
  template <typename GetPlacement>
  void reset(const GetPlacement& getPlacement) {
    for (ContactPoint& point : points) {
      point.touches = false;
      point.from = getPlacement(point.body).act(point.p) + kLift * Vector3d::UnitZ();
    }
    settle(getPlacement);
    for (ContactPoint& point : points)
      updateAnchor(terrain, getPlacement(point.body).act(point.p), ContactForce(), point);
  }
  /// Of all soles and edges; once per step, after the anchors.
  template <typename GetPlacement>
  void settle(const GetPlacement& getPlacement) {
    for (ContactArea& area : areas_) worlds::settle(terrain, getPlacement(area.body) * area.X_BF, area, points);
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
  std::vector<ContactArea> areas_;       // on ground with steps
  struct Elastic {
    double all = 0, stops = 0;  // J; the latter a part of the former
  };
  template <typename GetPlace, typename GetCoordinate>
  Elastic calcElastic(const GetPlace& getPlace, const GetCoordinate& getCoordinate) const {
    double contacts = 0, stop = 0;
    for (const ContactPoint& point : points)
      contacts += calcContactForce(terrain, point, getPlace(point.body, point.p), Vector3d::Zero()).elastic;
    for (const JointStop& each : stops) stop += calcStopForce(each, getCoordinate(each), 0).elastic;
    return {contacts + stop, stop};
  }
  Elastic start_;
};

}  // namespace bielle::worlds
