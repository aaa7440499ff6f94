#include "bielle/dynamics/closure.h"
#include "bielle/model/builder.h"
#include "bind.h"
#include "value.h"

namespace bielle::python {
namespace {

void bindEnums(py::module_& module) {
  py::enum_<JointKind>(module, "JointKind")
      .value("FIXED", JointKind::Fixed)
      .value("REVOLUTE", JointKind::Revolute)
      .value("CONTINUOUS", JointKind::Continuous)
      .value("PRISMATIC", JointKind::Prismatic)
      .value("SPHERICAL", JointKind::Spherical)
      .value("UNIVERSAL", JointKind::Universal)
      .value("PLANAR", JointKind::Planar)
      .value("FREE_FLYER", JointKind::FreeFlyer);
  py::enum_<ClosureKind>(module, "ClosureKind")
      .value("WELD_6D", ClosureKind::Weld6D)
      .value("BALL_3D", ClosureKind::Ball3D)
      .value("HINGE_5D", ClosureKind::Hinge5D)
      .value("COUPLER", ClosureKind::Coupler)
      .value("DISTANCE", ClosureKind::Distance)
      .value("SLIDER", ClosureKind::Slider);
  py::enum_<ContactKind>(module, "ContactKind")
      .value("POINT_3D", ContactKind::Point3D)
      .value("EDGE_5D", ContactKind::Edge5D)
      .value("SURFACE_6D", ContactKind::Surface6D);
  py::enum_<Visual::Shape>(module, "VisualShape")
      .value("BOX", Visual::Shape::Box)
      .value("CYLINDER", Visual::Shape::Cylinder)
      .value("SPHERE", Visual::Shape::Sphere)
      .value("MESH", Visual::Shape::Mesh);
}

void bindTree(py::module_& module) {
  Value<Joint>(module, "Joint", "A joint between a parent body and the body of the same index as the joint.")
      .field("name", &Joint::name, "unique")
      .field("kind", &Joint::kind, "JointKind")
      .field("X_PJ", &Joint::X_PJ, "placement of the joint frame in the parent body")
      .field("axis", &Joint::axis, "unit axis (3,); normal of a planar joint; first axis of a universal joint")
      .field("axis2", &Joint::axis2, "second axis of a universal joint (3,)")
      .field("parent", &Joint::parent, "index of the parent body; filled by the builder, like the next four")
      .field("idx_q", &Joint::idx_q, "first entry in q")
      .field("nq", &Joint::nq, "entries in q")
      .field("idx_v", &Joint::idx_v, "first entry in v")
      .field("nv", &Joint::nv, "entries in v")
      .field("position_importance", &Joint::position_importance, "in the costs of a posture, relative to other joints")
      .field("velocity_importance", &Joint::velocity_importance, "likewise for its velocity");
  Value<Body>(module, "Body", "A rigid body; body i > 0 is carried by joint i, body 0 is the world.")
      .field("name", &Body::name, "that of its link")
      .field("inertia", &Body::inertia, "in the body frame");
  Value<Frame>(module, "Frame", "A named frame fixed in a body.")
      .field("name", &Frame::name, "unique among links and frames")
      .field("body", &Frame::body, "index")
      .field("X_BF", &Frame::X_BF, "placement in the body");
  Value<bielle::Shape>(module, "Shape", "A shape of a body: all points within a radius of a box fixed in it.")
      .field("body", &bielle::Shape::body, "index; filled by the builder")
      .field("X_BS", &bielle::Shape::X_BS, "placement in the body (for the builder: in the link)")
      .field("half", &bielle::Shape::half,
             "half of the edges of the box (3,), m: zero of a sphere, (0, 0, l) of a capsule")
      .field("radius", &bielle::Shape::radius, "m; zero of a box")
      .field("fitted", &bielle::Shape::fitted, "fitted to a visual, because the robot's files give its body no shape");
  Value<Visual>(module, "Visual", "A shape drawn for a body.")
      .field("shape", &Visual::shape, "VisualShape")
      .field("body", &Visual::body, "index; filled by the builder")
      .field("X_BV", &Visual::X_BV, "placement in the body (for the builder: in the link)")
      .field("size", &Visual::size,
             "(3,) box: edges; cylinder: radius, length, 0; sphere: radius, 0, 0, m; mesh: scale")
      .field("mesh", &Visual::mesh, "file name as written in the URDF")
      .field("rgba", &Visual::rgba, "colour (4,), 0 to 1")
      .field("bounds", &Visual::bounds, "shape around a mesh that was read, in the frame of the visual, or None");
  Value<JointLimits>(module, "JointLimits", "Limits of a joint, per dof, or empty for none.")
      .field("lower", &JointLimits::lower, "(nv,), rad or m")
      .field("upper", &JointLimits::upper, "(nv,), rad or m")
      .field("velocity", &JointLimits::velocity, "(nv,), rad/s or m/s");
}

void bindConstraints(py::module_& module) {
  Value<CouplerTerm>(module, "CouplerTerm",
                     "One summand of a coupler: a coefficient times a coordinate, or a polynomial.")
      .field("joint", &CouplerTerm::joint, "index")
      .field("coefficient", &CouplerTerm::coefficient, "dimensionless, or m/rad, .. between units")
      .field("idx_q", &CouplerTerm::idx_q, "index into q")
      .field("dof", &CouplerTerm::dof, "index into v")
      .field("higher", &CouplerTerm::higher, "coefficients of q^2, q^3, ..");
  Value<JointForce>(module, "JointForce", "Spring, damper and friction on a joint of one coordinate.")
      .field("joint", &JointForce::joint, "index")
      .field("idx_q", &JointForce::idx_q, "index into q")
      .field("dof", &JointForce::dof, "index into v")
      .field("stiffness", &JointForce::stiffness, "N m/rad or N/m")
      .field("rest", &JointForce::rest, "rad or m")
      .field("preload", &JointForce::preload, "N m or N")
      .field("damping", &JointForce::damping, "N m s/rad or N s/m")
      .field("friction", &JointForce::friction, "N m or N")
      .field("friction_speed", &JointForce::friction_speed, "rad/s or m/s");
  Value<PointSpring>(module, "PointSpring", "Spring and damper between two points of two bodies.")
      .field("name", &PointSpring::name, "unique")
      .field("body1", &PointSpring::body1, "index; filled by the builder, like the next")
      .field("body2", &PointSpring::body2, "index")
      .field("point1", &PointSpring::point1, "(3,) in body 1 (for the builder: in frame 1), m")
      .field("point2", &PointSpring::point2, "(3,) in body 2, m")
      .field("stiffness", &PointSpring::stiffness, "N/m")
      .field("rest", &PointSpring::rest, "length, m")
      .field("preload", &PointSpring::preload, "tension at the rest length, N")
      .field("damping", &PointSpring::damping, "N s/m")
      .field("dofs", &PointSpring::dofs, "that move one point but not the other, increasing")
      .field("signs", &PointSpring::signs, "+1 where the dof moves point 1, -1 for point 2");
  Value<Closure>(module, "Closure", "Ties frame 1 on body 1 to frame 2 on body 2, or couples coordinates.")
      .field("name", &Closure::name, "unique")
      .field("kind", &Closure::kind, "ClosureKind")
      .field("body1", &Closure::body1, "index")
      .field("body2", &Closure::body2, "index")
      .field("X_B1", &Closure::X_B1, "placement of frame 1 in body 1")
      .field("X_B2", &Closure::X_B2, "placement of frame 2 in body 2")
      .field("axis", &Closure::axis, "free axis of a hinge or slider in both frames (3,)")
      .field("length", &Closure::length, "of a distance, m")
      .field("kp", &Closure::kp, "stabilisation, 1/s^2")
      .field("kd", &Closure::kd, "1/s")
      .field("terms", &Closure::terms, "terms of a coupler")
      .field("offset", &Closure::offset, "offset of a coupler")
      .field("dofs", &Closure::dofs, "that move one frame but not the other, increasing")
      .field("signs", &Closure::signs, "+1 where the dof moves frame 1, -1 for frame 2");
  Value<LoopCluster>(module, "LoopCluster", "Closures that share dofs, directly or through other closures.")
      .field("closures", &LoopCluster::closures, "indices")
      .field("dofs", &LoopCluster::dofs, "union of their dofs, increasing")
      .field("rows", &LoopCluster::rows, "sum of their scalar constraints");
  Value<MotorDrive>(module, "MotorDrive",
                    "Winding and gear of a motor; without torque_constant the winding is not known.")
      .field("type", &MotorDrive::type, "name in a catalogue, or empty")
      .field("ratio", &MotorDrive::ratio, "turns of the rotor per turn of the joint; rad/m of a prismatic joint")
      .field("rotor_inertia", &MotorDrive::rotor_inertia, "kg m^2")
      .field("torque_constant", &MotorDrive::torque_constant, "N m/A")
      .field("resistance", &MotorDrive::resistance, "between two terminals, ohm")
      .field("voltage", &MotorDrive::voltage, "voltage of the supply, V")
      .field("current", &MotorDrive::current, "most, A")
      .field("continuous_current", &MotorDrive::continuous_current,
             "current that the winding can sustain indefinitely, A")
      .field("efficiency", &MotorDrive::efficiency, "efficiency of the gear while the motor drives")
      .field("back_efficiency", &MotorDrive::back_efficiency, "efficiency of the gear while the joint drives the motor")
      .field("mass", &MotorDrive::mass, "kg; 0: not known");
  Value<Motor>(module, "Motor", "An actuator on one dof.")
      .field("name", &Motor::name, "that of its joint")
      .field("joint", &Motor::joint, "index")
      .field("dof", &Motor::dof, "index into v")
      .field("armature", &Motor::armature, "rotor inertia seen at the joint, kg m^2 (kg for a prismatic joint)")
      .field("effort_limit", &Motor::effort_limit, "N m or N")
      .field("velocity_limit", &Motor::velocity_limit, "rad/s or m/s")
      .field("torque_loss", &Motor::torque_loss, "heat per torque squared, W/(N m)^2 or W/N^2; None: not known")
      .field("continuous_effort", &Motor::continuous_effort,
             "root mean square that it can sustain indefinitely, N m or N")
      .field("drive", &Motor::drive, "winding and gear");
  Value<ContactFrame>(module, "ContactFrame",
                      "A frame of a body that may touch the ground, z along its outward normal.")
      .field("name", &ContactFrame::name, "unique")
      .field("body", &ContactFrame::body, "index")
      .field("X_BF", &ContactFrame::X_BF, "placement in the body")
      .field("kind", &ContactFrame::kind, "ContactKind")
      .field("half_length", &ContactFrame::half_length, "half the length of the sole, along x, m")
      .field("half_width", &ContactFrame::half_width, "half the width of the sole, along y, m");
  Value<Reference>(module, "Reference", "Targets of a reference configuration.")
      .field("name", &Reference::name, "unique")
      .field("joints", &Reference::joints, "q of joints, by name")
      .field("height_frame", &Reference::height_frame, "frame whose height is given; empty: only joints are given")
      .field("height", &Reference::height, "over the soles, m")
      .field("feet", &Reference::feet, "positions of the origins of contact frames (3,), by name, m")
      .field("yaws", &Reference::yaws, "headings of those that have one, of x about the vertical, by name, rad");
  Value<ContactTarget>(module, "ContactTarget", "A foot on the ground at a given place.")
      .field("contact", &ContactTarget::contact, "index into Model.contacts")
      .field("X_WT", &ContactTarget::X_WT, "where the contact frame belongs; matters only with kp > 0")
      .field("kp", &ContactTarget::kp, "1/s^2")
      .field("kd", &ContactTarget::kd, "1/s");
  Value<ConstraintSet>(module, "ConstraintSet", "The closures in force: those of the model, then contacts.")
      .field("closures", &ConstraintSet::closures, "closures of the model, then contacts as closures to the world")
      .field("contacts", &ConstraintSet::contacts, "indices into Model.contacts, in their order")
      .field("offsets", &ConstraintSet::offsets, "first row of each closure")
      .field("rows", &ConstraintSet::rows, "scalar constraints")
      .field("num_loops", &ConstraintSet::num_loops, "the first closures, which are the model's");
}

}  // namespace

void bindModelValues(py::module_& module) {
  bindEnums(module);
  bindTree(module);
  bindConstraints(module);
}

}  // namespace bielle::python
