#pragma once
/// \file
/// Robots from files: a URDF and, optionally, a YAML file with the same stem beside it for data that URDF cannot
/// express; or one MuJoCo, SDF or USD file.
///
/// ## The URDF
/// Links and joints of one tree. Bodies are added depth first, the children of a link in the order of their joints in
/// the file. A link without <inertial> has no mass. A root named "world" is the ground; any other root is carried by a
/// free-flyer named "root_joint", or merged into the ground when the base is fixed.
/// - <limit>: `effort` and `velocity` apply to the motor and to the joint (published files often have placeholders
///   there: override them by `motors`). 0 means none, as does a `lower` and `upper` of 0, or a number from 1e15 on. Joints
///   whose number of coordinates is changed by the YAML have no limits.
/// - <mimic> becomes a coupler named as the joint, after the closures of the YAML; <dynamics> its damping and friction, unless
///   `joint_forces` names it; meshes need not exist. Files for Drake (formats/drake.h) can also define loops,
///   springs, motors and joints; others add loops, couplers and motors (formats/reader_dialects.h, formats/reader_loops.h).
/// - Attributes are finite numbers; masses and moments of inertia are not negative, up to 1e-6 of rounding. Moments that no body
///   can have (triangle inequality), and those without mass, which get 1e-9 kg, are warnings.
///
/// ## The YAML, published keys (example-parallel-robots)
/// - `closed_loop: [[A, B], ...]` frames 1 and 2 of each closure: links, or joints, which stand for the frame of their
///   child (a link wins); `type: [6d, ...]`, one per pair, 6d | 5d | 3d in any case. `closure_name: [...]` (ours)
///   names them; otherwise `knee_A`, `knee_B` make `knee`, and other pairs `A--B`.
/// - `name_mot: [joint, ...]` lists the motors, in the order of u.
/// - `joint_name: [...]`, `joint_type: [...]` replace kinds of joints of the URDF, in any case: SPHERICAL, UJOINT_ and
///   two different axes of the joint's own frame in their order (UJOINT_XY), FIXED, REVOLUTE, CONTINUOUS, PRISMATIC,
///   PLANAR, FLOATING. An absent joint gives a warning.
///
/// ## The YAML, our keys (all optional; an unknown key is an error)
/// - `base: free | fixed`; `play: {joint or closure: rad or m, ...}` of the robot in worlds (docs/execution.md)
/// - `frames: {name: {link, place: [x, y, z], rpy: [roll, pitch, yaw]}, ...}` further frames, placed in a link of the tree, m and
///   rad (default 0); a robot that is completed keeps its own
/// - `closures: [{name, frames: [A, B], type, axis, length, kp, kd}, ...]` after those of `closed_loop`; `axis` of a 5d hinge or
///   a slider, in frame 1 (default z); `length` of a distance, m (default: where all coordinates are neutral); kp in 1/s^2, kd
///   in 1/s (default 0). A coupler: `{name, type: coupler, joints: {joint: coefficient, ...}, offset, kp, kd}`, sum of
///   coefficient times coordinate = offset (default 0); a list of coefficients makes the polynomial c_1 q + c_2 q^2 + .. of a
///   coordinate
/// - `motors: {joint: {armature, effort, velocity, torque_loss}, ...}` instead of `name_mot`; its limits (.inf for none)
///   replace those of the URDF; `torque_loss` in W/(N m)^2 (model.h). Winding and gear, as in MotorDrive (model.h): `ratio`,
///   `rotor_inertia`, `torque_constant`, `resistance`, `voltage`, `current`, `continuous_current`, `efficiency`,
///   `back_efficiency`, `mass`; quantities that are not given follow from them, and the smaller of two limits applies.
///   `continuous_effort` is the thermal limit, N m. `type: NAME` takes all of this from a catalogue, and keys next to it
///   replace its entries; with another `ratio`, effort and velocity are converted to that gear
/// - `motor_catalogue: FILE`, or a list of them, relative to this file; then comes the file motors.yaml in each directory of
///   robots. A catalogue is `motors: {NAME: {source: where its figures are from, ...}, ...}` with the keys of winding and gear, and
///   `effort` and `velocity` at the shaft of its gear
/// - `armature: {joint: kg m^2, ...}`, or one number for all motors without one in `motors`
/// - `joint_forces: {joint: {stiffness, rest, preload, damping, friction, friction_speed, stiction, stribeck_speed}, ...}`; `{}`: none
/// - `rod_friction: {closure: {coefficient, radius, friction_speed, stiction, stribeck_speed, joints}, ...}` of a ball, hinge or weld,
///   in worlds (RodFriction, docs/execution.md); `stiction` is a coefficient, too
/// - `point_springs: {name: {frames: [A, B], points: [[x, y, z], [x, y, z]], stiffness, rest, preload, damping}, ...}`
///   between a point of A and one of B (m, default their origins), links or joints as in `closed_loop`; PointSpring in
///   model.h
/// - `contacts: {name: {frame, type: 6d | 3d, sole: [length, width]}, ...}`; the sole is centred on its frame, length
///   along x, m
/// - `references: {name: {joints: {joint: number or list}, height: {frame, value}, feet: {contact: [x, y, z], contact: {place:
///   [x, y, z], yaw: rad}}}, ...}`; the height is over the lowest foot. Without a yaw a foot turns freely about the vertical if an
///   angle but 0 of a joint of its leg about the vertical is given, and else faces as the robot does (makeReferenceProblem)
/// - `cross_inertia: kg m^2` splits every universal joint into two revolute ones, named after it and their axes (`_Z`,
///   `_Y`), with a cross of this inertia about any axis between them
/// - `importance: {joint: [position, velocity], ...}` weighs joints in the state regularization of motions (default 1,
///   1)
/// - `serial_joints: [joint, ...]`, `gravity: [x, y, z]` (m/s^2), `rounding: rad and m` that placements may be off by (docs/modelling.md)
/// - `model: NAME or path relative to this file`, or a list of them: this file, with no URDF beside it, completes the
///   first of these published robots that exists; names are looked up in the directories of robots. Its keys take
///   precedence over those of that robot's YAML file. It may be one in MuJoCo's format, or a generated one.
/// - `generator: NAME, set: {parameter: number or name of a choice, ...}`: this file, with no URDF beside it, is the robot that
///   `bielle generate NAME` writes with these parameters, the others at their defaults. Further keys complete it likewise.
///
/// ## MuJoCo files (MJCF, .xml), of version 2.2.2 and later
/// The reader supports <include> (beside the main file, or beside the one that includes it); bodies and <frame>; inertias, or
/// those of shapes and meshes (STL, OBJ) without <inertial>, and what <compiler> makes of them; joints of all kinds with
/// range, ref, armature, stiffness, springref, damping and frictionloss; the equalities connect, weld, joint and tendon
/// (of fixed tendons) with their polynomials, or of the length of a spatial tendon between two sites; springs and dampers of such
/// tendons; motors with gear and limits (servos become motors) on joints and fixed tendons; classes of defaults; gravity;
/// keyframes as references; sites as frames;
/// geoms as shapes. Ranges hold unless `limited` is false.
/// - The frame of a body has its origin on its joint; a body with several joints becomes a chain of links BODY/JOINT
///   without mass. Quaternions of balls count from the pose in the file. Motors are named after their joints and give the
///   force of the joint. Without keyframes, the reference `qpos0` is the posture of the file, where MuJoCo closes loops.
/// - A body on the world that moves by three slides across each other and a ball, or three hinges across each other, has a free joint
///   `root_joint`, unless one of them has a spring, damping, friction or an armature of its own, or is named by an actuator, an
///   equality or a tendon. Keyframes count as in the file.
/// - A fixed tendon of several joints with a motor is a coordinate of its own, next to without inertia, with the tendon's range,
///   springs and dampers, coupled with its joints; of one joint, the motor is on the joint. One without a motor or an equality, but
///   with a range of at most 0.1 rad (0.01 m with slides) to either side, is a coupler, and its play is told.
/// - Two connects of the same two bodies are a hinge through both points, told unless formats/mjcf.h wrote it (NAME.1 and NAME.2).
/// - What formats/mjcf.h writes is put together again: the elements of a universal, planar
///   or free joint, the spheres of a sole at their site.
/// - Elements that are left out are listed in `warnings` with their lines. Elements without which the mechanism
///   would be another one are errors:
///   <attach>, <replicate>, <composite> and <flexcomp>, other equalities, polynomials of a sum of joints, masses of convex hulls and
///   of meshes that cannot be read. At most 16 MB and 3000 bodies and sites.
///
/// ## SDF files (.sdf), by libsdformat
/// One model, whose bodies stand where all joints are at zero. Of several joints onto a link, the first carries it (one that cannot
/// close a loop before any other); revolute, prismatic, ball and fixed ones close loops at this posture, which is the reference `initial`.
/// Links that nothing holds are free, those of a static model are not. The frame of a body keeps its directions (on a universal
/// joint, x and y are its axes) and has its origin on its joint. Frames, ranges, springs, damping and friction of joints, visuals
/// and collisions are read; motors come from a YAML file with `model`. <drake:linear_bushing_rpy> and <drake:ball_constraint> are
/// loops; joints with <drake:parent_frame> and <drake:child_frame> join these frames.
///
/// ## USD files (.usda), by the schema UsdPhysics
/// One layer in text form, which refers to no other file. Joints have their own places, with coordinates in degrees or units of the
/// file; joints of six coordinates of which several are free are chains. Where the bodies stand is the reference `initial`. Joints with
/// excludeFromArticulation close loops; where loops remain,
/// first balls, then hinges without a range close them. Bodies that nothing ties to the world are free, kinematic ones stand. The
/// frame of a body keeps its directions and has its origin on its joint, where that turns. Drives are motors without their servos.
#include <optional>
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/model/wear.h"

namespace bielle {

enum class BaseKind { Free, Fixed };

struct LoadOptions {
  std::optional<BaseKind> base;  ///< overrides the file's `base` key; without both: free
};

/// Loops that are locked by what is more than rounding (docs/modelling.md), though in single postures their rows may say the same.
struct LockedLoops {
  std::vector<int> closures;  ///< those of one cluster
  int mobility = 0;           ///< what is left of it
};

struct LoadedRobot {
  Model model;
  std::vector<std::string> warnings;  ///< "file: element: problem", valid but suspicious
  std::string directory;              ///< where the files were found
  std::string file;                   ///< absolute path of the .urdf or .xml, or of the .yaml without a URDF beside it
  std::vector<LockedLoops> locked;
  Wear wear;                 ///< the key `play`, by the names of what has it, in the order of the model
  std::string path() const;  ///< of the same file in `directory`, as messages name it
};

/// Loads a robot by name (`bipetto`: DIR/bipetto/bipetto.urdf, robot.urdf, bipetto.yaml or .xml in the directories of
/// getRobotDirectories()), by directory (its robot.urdf, else the .urdf named as the directory, else its only .urdf,
/// else the .yaml or .xml named as the directory), by .urdf file, by .xml file of MuJoCo or by .yaml file with the key
/// `generator` or `model`.
/// \throws InputError naming the file, the element and the remedy, and no other exception, whatever the files contain
LoadedRobot loadRobot(const std::string& name_or_path, const LoadOptions& options = {});

/// The file of a robot by name or path, as loadRobot() finds it. \throws InputError listing the places searched
std::string findRobotFile(const std::string& name_or_path);

/// Directories searched for robots by name, in this order: those of $BIELLE_ROBOTS (separated by colons),
/// share/bielle/robots of the installation that the running program belongs to, robots/ beside the module that this library is
/// part of (the Python package), robots/ of the source tree, and the configured installation.
std::vector<std::string> getRobotDirectories();

/// Names of the robots found there, sorted.
std::vector<std::string> listRobots();

}  // namespace bielle
