#pragma once
/// \file The immutable model of a robot: a spanning tree of bodies and joints, closed by closures.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/math/se3.h"

namespace bielle {

enum class JointKind { Fixed, Revolute, Continuous, Prismatic, Spherical, Universal, Planar, FreeFlyer };

/// Name as used in messages and files ("revolute", "free-flyer", ...).
const char* getName(JointKind kind);
/// Sizes of q and v of a joint kind.
int getNq(JointKind kind);
int getNv(JointKind kind);

/// A joint between a parent body and the body of the same index as the joint.
struct Joint {
  std::string name;
  JointKind kind = JointKind::Fixed;
  int parent = 0;                      ///< body index of the parent
  SE3 X_PJ;                            ///< placement of the joint frame (child frame at neutral q) in the parent body
  Vector3d axis = Vector3d::UnitZ();   ///< unit axis; normal of a planar joint; first axis of a universal joint
  Vector3d axis2 = Vector3d::UnitY();  ///< second axis of a universal joint
  int idx_q = 0, nq = 0, idx_v = 0, nv = 0;
  double position_importance = 1, velocity_importance = 1;  ///< relative to other joints, in the costs of a posture
};

/// A rigid body; body i > 0 is carried by joint i, body 0 is the world.
struct Body {
  std::string name;
  Inertia inertia;  ///< in the body frame (the child frame of its joint), links merged through fixed joints included
};

/// A named frame fixed in a body.
struct Frame {
  std::string name;
  int body = 0;
  SE3 X_BF;
};

enum class ClosureKind { Weld6D, Ball3D, Hinge5D, Coupler, Distance, Slider };
const char* getName(ClosureKind kind);
/// Number of scalar constraints: 6, 3, 5, 1, 1, 5.
int getRows(ClosureKind kind);
/// Of these, the number of the first ones that are lengths, in m; the others are angles, and that of a coupler counts as one.
int getLengthRows(ClosureKind kind);
/// Whether its free motion has an axis: a hinge turns about it, a slider slides along it.
bool hasAxis(ClosureKind kind);

/// One summand p(q) = c_1 q + c_2 q^2 + .. of a coupler, q being the coordinate of a joint with one.
struct CouplerTerm {
  int joint = 0;                 ///< body/joint index
  double coefficient = 0;        ///< c_1: dimensionless, or m/rad, .. between coordinates of different units
  int idx_q = 0, dof = 0;        ///< indices into q and v
  std::vector<double> higher{};  ///< c_2, c_3, ..; none of a belt or gear

  bool isLinear() const { return higher.empty(); }
  /// The n-th derivative of p at q, p itself for n = 0. T: double or a register of lanes.
  template <typename T>
  T calcDerivative(int n, const T& q) const;
};

template <typename T>
T CouplerTerm::calcDerivative(int n, const T& q) const {
  if (isLinear()) return n == 0 ? T(coefficient * q) : T(n == 1 ? coefficient : 0);
  T sum = 0;
  for (int k = static_cast<int>(higher.size()) + 1; k >= std::max(n, 1); --k) {  // Horner
    double c = k == 1 ? coefficient : higher[static_cast<size_t>(k) - 2];
    for (int i = 0; i < n; ++i) c *= k - i;
    sum = sum * q + c;
  }
  return n == 0 ? T(sum * q) : sum;
}

/// Ties frame 1 on body 1 to frame 2 on body 2, or, as a coupler, coordinates of joints: sum of p_i(q_i) = offset. With
/// p_i = c_i q_i it does as belts, gears and differentials do, with polynomials as cams or fitted linkages. A distance keeps
/// the origins of the frames as far apart as `length`, as a massless rod with a ball at either end does; a slider lets
/// frame 2 slide along an axis. notation.h defines residual, velocity, acceleration and force.
struct Closure {
  std::string name;
  ClosureKind kind = ClosureKind::Weld6D;
  int body1 = 0, body2 = 0;           ///< of a coupler both are the body that carries all its joints
  SE3 X_B1, X_B2;                     ///< placements of the frames in their bodies
  Vector3d axis = Vector3d::UnitZ();  ///< free axis of a hinge or slider, in frame 1 (and in frame 2)
  double kp = 0, kd = 0;              ///< stabilisation gains, 1/s^2 and 1/s; zero as in the paper
  std::vector<CouplerTerm> terms;     ///< of a coupler, by increasing dof
  double offset = 0;                  ///< of a coupler
  double length = 0;                  ///< of a distance, m
  /// Dofs that move one frame but not the other, in increasing order; sign +1 if they move frame 1, -1 for frame 2.
  /// The relative placement of the frames depends only on them. Of a coupler, all dofs from the body that carries its
  /// joints to these joints, with sign +1. Filled by the builder.
  std::vector<int> dofs, signs;
};

/// Spring, damper and friction on the coordinate of a joint with one: the generalized force
///     tau = preload - stiffness (q - rest) - damping v - friction v / sqrt(v^2 + friction_speed^2)
/// in N m for an angle, in N for a length. The last term is Coulomb friction made smooth: it reaches 0.995 of `friction`
/// at ten times the friction_speed; below it, it acts like a damper, so that nothing sticks.
struct JointForce {
  int joint = 0;                                ///< body/joint index, filled by the builder as the next two
  int idx_q = 0, dof = 0;                       ///< indices into q and v
  double stiffness = 0, rest = 0, preload = 0;  ///< N m/rad, rad, N m; or N/m, m, N
  double damping = 0;                           ///< N m s/rad or N s/m
  double friction = 0, friction_speed = 0.01;   ///< N m, rad/s; or N, m/s
};

/// Spring and damper between a point of body 1 and a point of body 2. With l their distance and l' its rate, the tension
///     f = preload + stiffness (l - rest) + damping l'
/// pulls both points towards each other along their line; a negative one, as that of a compressed spring, pushes them
/// apart. The preload is the tension at the rest length. To stay defined where the points meet, the distance is
/// l = sqrt(|r|^2 + kShortestLine^2), r being the vector between the points, and the direction of the force r / l.
struct PointSpring {
  std::string name;
  int body1 = 0, body2 = 0;                                       ///< filled by the builder
  Vector3d point1 = Vector3d::Zero(), point2 = Vector3d::Zero();  ///< in the frames of the bodies, m
  double stiffness = 0, rest = 0, preload = 0, damping = 0;       ///< N/m, m, N, N s/m
  /// Dofs that move one point but not the other, in increasing order; sign +1 if they move point 1, -1 for point 2. Filled
  /// by the builder.
  std::vector<int> dofs, signs;
};

/// m, below any length that matters: a line of 1 mm is longer by 5e-16 m.
inline constexpr double kShortestLine = 1e-9;

/// Closures that share dofs, directly or through other closures: the unit in which loops are eliminated.
struct LoopCluster {
  std::vector<int> closures;  ///< indices of closures
  std::vector<int> dofs;      ///< union of their dofs, increasing
  int rows = 0;               ///< sum of their scalar constraints
};

/// Winding and gear of a motor, as far as they are known. With the ratio n of the gear, the torque constant k_t, which is that
/// of the induced voltage as well, and the resistance R, a joint that turns at w under the torque u takes the current and
/// the voltage
///     i = c u / (n k_t),    U = R i + n k_t w,    c = 1/e where u w > 0,  c = e_b where u w < 0                       (1)
/// e and e_b being the efficiencies of the gear while it drives the joint and while the joint drives it. A winding of
/// three phases counts as one of direct current: R between two terminals.
struct MotorDrive {
  std::string type;            ///< name in a catalogue, or empty
  double ratio = 1;            ///< n, turns of the rotor per turn of the joint; rad/m of a prismatic joint
  double rotor_inertia = 0;    ///< of rotor and fast gear, kg m^2; n^2 times that is the armature
  double torque_constant = 0;  ///< k_t, N m/A = V s/rad; 0: the winding is not known
  double resistance = 0;       ///< R, ohm
  double voltage = std::numeric_limits<double>::infinity();             ///< most |U|, that of the supply, V
  double current = std::numeric_limits<double>::infinity();             ///< most |i|, A
  double continuous_current = std::numeric_limits<double>::infinity();  ///< thermal limit of the winding, A
  double efficiency = 1, back_efficiency = 1;                           ///< e and e_b, above 0 and up to 1
  double mass = 0;  ///< kg, already included in the robot's links; 0: not known

  bool hasWinding() const { return torque_constant > 0; }
  bool isGiven() const;  ///< whether anything differs from an ideal motor
};

/// An actuator on one dof.
struct Motor {
  std::string name;     ///< that of its joint
  int joint = 0;        ///< body/joint index
  int dof = 0;          ///< index into v
  double armature = 0;  ///< rotor inertia seen at the joint, kg m^2 (kg for a prismatic joint)
  double effort_limit = std::numeric_limits<double>::infinity();    ///< N m or N
  double velocity_limit = std::numeric_limits<double>::infinity();  ///< rad/s or m/s
  /// Heat per torque squared, W/(N m)^2 or W/N^2: R / (n k_t)^2 of a winding of resistance R and torque constant k_t behind
  /// a gear of ratio n. Empty: not known, kDefaultTorqueLoss is assumed.
  std::optional<double> torque_loss{};
  /// Most that the root mean square of c u may be over a long time, c of MotorDrive Eq. (1), N m or N.
  double continuous_effort = std::numeric_limits<double>::infinity();
  MotorDrive drive{};

  double torqueLoss() const;
  /// c of MotorDrive Eq. (1). \param power  u w, W; c is 1/e at 0
  double getEffortFactor(double power) const { return power >= 0 ? 1 / drive.efficiency : drive.back_efficiency; }
  /// Whether torque and speed limit each other.
  bool hasEnvelope() const { return drive.hasWinding() && std::isfinite(drive.voltage); }
  /// Factors of u and w in the voltage of MotorDrive Eq. (1) with c = 1/e. That is exact while the motor drives. While it is
  /// driven, the true one is within the supply if this one and n k_t w alone are, which the limit of speed ensures.
  double voltsPerEffort() const { return drive.resistance / (drive.efficiency * drive.ratio * drive.torque_constant); }
  double voltsPerSpeed() const { return drive.ratio * drive.torque_constant; }
  /// The torque next to u that the motor can give at the speed w: within its limit and the row above.
  double clampEffort(double u, double w) const;
};

/// Assumed value, typical of geared motors of 0.8 kg that hold about 15 N m with 50 W of heat, W/(N m)^2.
inline constexpr double kDefaultTorqueLoss = 0.25;
inline double Motor::torqueLoss() const { return torque_loss.value_or(kDefaultTorqueLoss); }

/// A point; a blade, which stands on an edge along x and may roll about it; a rectangular sole.
enum class ContactKind { Point3D, Edge5D, Surface6D };
/// "3d", "5d", "6d", as in files.
const char* getName(ContactKind kind);

/// A frame of a body that may touch the ground; z is the outward normal of the ground when in contact.
struct ContactFrame {
  std::string name;
  int body = 0;
  SE3 X_BF;
  ContactKind kind = ContactKind::Surface6D;
  double half_length = 0, half_width = 0;  ///< of the sole, along x and y, m; an edge has no width, a point no size
};

/// One target of a reference configuration, by name, as read from a robot file.
struct Reference {
  std::string name;
  std::map<std::string, std::vector<double>> joints;  ///< joint name -> its q
  /// Height of a frame over the lowest of the feet, with feet flat on the ground; empty frame: joints and feet alone.
  std::string height_frame;
  double height = 0;                     ///< m
  std::map<std::string, Vector3d> feet;  ///< contact frame -> position of its origin, m (world)
  std::map<std::string, double> yaws;    ///< of those whose heading is given: of its x about the vertical, rad (world)
};

/// The shape of a body, for distances: a box with rounded edges, all points within `radius` of those with |x_i| <=
/// half_i in the frame of the shape. A sphere has half = 0, a capsule half = (0, 0, l), a box radius = 0.
struct Shape {
  int body = 0;
  SE3 X_BS;
  Vector3d half = Vector3d::Zero();  ///< m
  double radius = 0;                 ///< m
  bool fitted = false;               ///< fitted to a visual, because the robot's files give its body no shape
};
/// A shape drawn for a body, from the visuals of the URDF.
struct Visual {
  enum class Shape { Box, Cylinder, Sphere, Mesh } shape = Shape::Box;
  int body = 0;
  SE3 X_BV;
  Vector3d size = Vector3d::Zero();  ///< box: edges; cylinder: radius, length, 0; sphere: radius, 0, 0; mesh: scale
  std::string mesh;                  ///< file name as written in the URDF
  Eigen::Vector4d rgba = {0.7, 0.7, 0.7, 1};
  /// Around a mesh whose file was read, with its scale, in the frame of the visual; its body is without meaning.
  std::optional<bielle::Shape> bounds;
};

/// All points within `radius` of a segment between two points of a body, m.
Shape makeCapsule(int body, const Vector3d& from, const Vector3d& to, double radius);
/// The shape around a visual: a box and a sphere are their own; around a cylinder it is a box or a capsule with the segment
/// of its length, whichever is less; around a mesh it is `bounds`, if there are any.
std::optional<Shape> fitShape(const Visual& visual);

/// One scalar velocity coordinate.
struct Dof {
  int joint = 0;    ///< joint/body that carries it
  int parent = -1;  ///< dof just before it on the path to the root, -1 at the root
  /// Whether this is the first or second axis of a universal joint: the first axis does not move with the second one.
  /// All axes of other joints move with the whole joint (child-frame coordinates).
  bool first_of_universal = false;
  bool second_of_universal = false;
};

/// Immutable description of a robot, made by ModelBuilder::build or loadRobot. Copies share it, so that a problem, a
/// controller or a world keeps one of its own, as cheap as a pointer.
class Model {
 public:
  Model();
  /// Whether both are copies of one model.
  bool isCopyOf(const Model& other) const { return data_ == other.data_; }

  const std::string& name() const { return data_->name; }
  int nq() const { return data_->nq; }
  int nv() const { return data_->nv; }
  int nu() const { return static_cast<int>(data_->motors.size()); }
  int numBodies() const { return static_cast<int>(data_->bodies.size()); }  ///< including the world
  const std::vector<Body>& bodies() const { return data_->bodies; }
  const std::vector<Joint>& joints() const { return data_->joints; }  ///< joints()[0] is a placeholder for the world
  const std::vector<Dof>& dofs() const { return data_->dofs; }
  const std::vector<Frame>& frames() const { return data_->frames; }
  const std::vector<Closure>& closures() const { return data_->closures; }
  const std::vector<LoopCluster>& clusters() const { return data_->clusters; }
  const std::vector<Motor>& motors() const { return data_->motors; }
  const std::vector<JointForce>& jointForces() const { return data_->joint_forces; }  ///< one a joint, or two
  const std::vector<PointSpring>& pointSprings() const { return data_->point_springs; }
  const std::vector<ContactFrame>& contacts() const { return data_->contacts; }
  const std::vector<Reference>& references() const { return data_->references; }
  const std::vector<Visual>& visuals() const { return data_->visuals; }
  /// Shapes from the files, then shapes fitted to the visuals of bodies without any.
  const std::vector<Shape>& shapes() const { return data_->shapes; }
  /// Indices of the joints of the equivalent serial chain (hips, knee, ankles).
  const std::vector<int>& serialJoints() const { return data_->serial_joints; }
  const VectorXd& lowerLimits() const { return data_->lower; }  ///< per dof, -inf if there is none
  const VectorXd& upperLimits() const { return data_->upper; }
  const VectorXd& velocityLimits() const { return data_->velocity_limit; }
  const VectorXd& armature() const { return data_->armature; }  ///< per dof, added to the diagonal of M
  double mass() const { return data_->mass; }                   ///< kg, without the world
  const Vector3d& gravity() const { return data_->gravity; }
  bool hasFreeFlyer() const { return numBodies() > 1 && data_->joints[1].kind == JointKind::FreeFlyer; }
  int numClosureRows() const { return data_->closure_rows; }

  /// Dofs that move a body, from the root to the body, in increasing order.
  const std::vector<int>& supportDofs(int body) const { return data_->support[body]; }
  /// Whether body a is body b or one of its ancestors.
  bool isAncestorOrSelf(int a, int b) const { return data_->ancestry[a * data_->bodies.size() + b] != 0; }

  /// Index by name, -1 when absent.
  int findJoint(const std::string& name) const;
  int findFrame(const std::string& name) const;
  int findMotor(const std::string& name) const;
  int findContact(const std::string& name) const;
  int findClosure(const std::string& name) const;

  /// Neutral configuration (nq).
  VectorXd makeNeutral() const;
  /// q (+) dv, dv of size nv.
  void integrate(ConstVectorRef q, ConstVectorRef dv, VectorRef q_out) const;
  VectorXd integrate(ConstVectorRef q, ConstVectorRef dv) const;
  /// dv with q0 (+) dv = q1.
  void difference(ConstVectorRef q0, ConstVectorRef q1, VectorRef dv) const;
  VectorXd difference(ConstVectorRef q0, ConstVectorRef q1) const;
  /// Quaternions scaled to unit length.
  void normalize(VectorRef q) const;

 private:
  friend class ModelBuilder;
  struct Data {
    std::string name;
    int nq = 0, nv = 0, closure_rows = 0;
    double mass = 0;
    Vector3d gravity{0, 0, -9.81};
    std::vector<Body> bodies;
    std::vector<Joint> joints;
    std::vector<Dof> dofs;
    std::vector<Frame> frames;
    std::vector<Closure> closures;
    std::vector<LoopCluster> clusters;
    std::vector<Motor> motors;
    std::vector<JointForce> joint_forces;
    std::vector<PointSpring> point_springs;
    std::vector<ContactFrame> contacts;
    std::vector<Reference> references;
    std::vector<Visual> visuals;
    std::vector<Shape> shapes;
    std::vector<int> serial_joints;
    std::vector<std::vector<int>> support;
    std::vector<char> ancestry;  // numBodies() x numBodies(), row: the ancestor
    VectorXd lower, upper, velocity_limit, armature;
  };
  // Only the builder writes to it, before it gives the model away.
  std::shared_ptr<Data> data_;
};

}  // namespace bielle
