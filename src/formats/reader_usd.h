#pragma once
/// \file Robots from files of USD in text form (.usda), by the schema UsdPhysics.
///
/// The frame of a body keeps its directions and has its origin on the joint that carries it. Joints are placed by their own
/// frames; where the bodies of the file stand gives the reference `initial`. Lengths are in m, the vertical is z.
#include <map>
#include <set>
#include <string>
#include <vector>

#include "formats/exchange_readers.h"
#include "formats/mjcf_element.h"
#include "formats/usd_transform.h"

namespace bielle {

/// Of a body: six numbers, its moments of inertia with all their digits, beside its principal axes.
inline const std::string kUsdInertia = "bielle:inertia";

/// What a body gets its mass from where it does not say it: a shape with collisions.
struct UsdSolid {
  const UsdPrim* prim = nullptr;
  Inertia inertia;               // of density 1 kg/m^3, in the body of the file
  double density = 0, mass = 0;  // kg/m^3, kg; 0: not given
  bool is_known = false;         // not so for meshes
};

/// A named frame of a body.
struct UsdSite {
  std::string name;
  int body = 0;
  SE3 X_SF;
};

struct UsdBody {
  const UsdPrim* prim = nullptr;  // none of what is between two joints of a chain
  std::string name;
  UsdTransform M = UsdTransform::Identity();  // to the world
  SE3 X_WS, X_SL;                             // the body of the file in the world, and our frame of it there
  bool is_kinematic = false;
  std::vector<UsdSolid> solids;
  std::vector<Visual> visuals;  // in the body of the file
  std::vector<Shape> shapes;
};

struct UsdJoint {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  const UsdPrim* prim = nullptr;
  std::string name;
  std::string coordinate;  // as drives and limits call it: angular, linear, rotX, ...; empty without a single one
  std::vector<int> axes;   // of a joint of six coordinates, those that are free, but for balls
  std::vector<std::string> siblings;  // coordinates of all joints of its chain; empty without one
  JointKind kind = JointKind::Fixed;
  int body[2] = {0, 0};  // 0 is the world
  SE3 X_SJ[2];           // frames of the joint in the bodies of the file
  Vector3d axis = Vector3d::UnitX();
  double lower = -kNone, upper = kNone;  // rad or m
  bool is_excluded = false, is_driven = false, is_carrying = false;
  double effort = kNone, velocity = kNone;
  JointForce force;
  double armature = 0;
  double length = 0;  // of a rod between the places, m; 0: it is none
};

class UsdReader {
 public:
  explicit UsdReader(const std::string& path);
  RobotFiles read();

 private:
  // reader_usd.cpp
  void load();
  void readLayer();
  void collect(const UsdPrim& prim, UsdTransform M, UsdTransform B, int body);
  bool isOmitted(const UsdPrim& prim);
  int addBody(const UsdPrim& prim, const UsdTransform& M);
  void readScene(const UsdPrim& prim);
  /// Its own, with those of prims above it where it is taken.
  static std::string makeName(const UsdPrim& prim, std::set<std::string>& taken);
  void noteUnused(const UsdPrim& prim);
  double getNumber(const UsdPrim& prim, std::string_view property, double otherwise,
                   bool may_be_infinite = false) const;
  bool getFlag(const UsdPrim& prim, std::string_view property, bool otherwise) const;
  /// Null without a target. \throws InputError for one that is not there
  const UsdPrim* findTarget(const UsdPrim& prim, std::string_view relation) const;
  /// The prim of a path. Null for the layer itself. \throws InputError for one that is not there
  const UsdPrim* resolve(const UsdPrim& prim, const UsdProperty& relation, const std::string& path) const;
  void note(int line, const std::string& element, const std::string& problem = "left out");

  // reader_usd_bodies.cpp
  void addLink(const UsdBody& body);
  Inertia readInertia(const UsdBody& body);
  Inertia computeInertia(const UsdBody& body, double mass, double density) const;
  double findDensity(const UsdPrim& prim) const;
  void readShape(const UsdPrim& prim, const UsdTransform& M, const UsdTransform& B, int body);
  SE3 calcPlaceInBody(const SE3& X_WG, const UsdTransform& B, int body) const;
  std::optional<Visual> readGeometry(const UsdPrim& prim, const Vector3d& scale, SE3& X_GV);
  void addFrame(const std::string& name, const std::string& link, const SE3& X_LF);

  // reader_usd_joints.cpp
  void readJoint(const UsdPrim& prim);
  bool readKind(UsdJoint& joint);
  void readFrame(UsdJoint& joint, int end);
  void readRange(UsdJoint& joint, std::string_view lower, std::string_view upper) const;
  void readDrive(UsdJoint& joint);
  void readExtensions(UsdJoint& joint);
  void readMimic(const UsdJoint& joint);
  void readActuator(const UsdPrim& prim);
  void chainJoints();
  UsdJoint* findJoint(const UsdPrim* prim);
  /// Of a torque or a force, and of angles or lengths, in SI.
  double getForceUnit(const UsdJoint& joint) const;
  double getCoordinateUnit(const UsdJoint& joint) const;

  // reader_usd_six.cpp
  bool readSix(UsdJoint& joint);
  void readAxis(UsdJoint& joint, int axis) const;
  void addChain(const UsdJoint& whole);
  [[noreturn]] void failForSeveral(const UsdJoint& joint) const;

  // reader_usd_tree.cpp
  void chooseCarriers();
  int chooseRoot(const std::vector<int>& component) const;
  void addTree();
  void addRoot(int body);
  void addBelow(int body);
  void addCarried(const UsdJoint& joint, int parent_end);
  void addMotors();
  void addClosure(const UsdJoint& joint);
  void addStart();
  SE3 calcMotion(const UsdJoint& joint) const;
  std::string getLink(int body) const { return body == 0 ? "world" : bodies_[static_cast<size_t>(body)].name; }

  const std::string path_;
  std::unique_ptr<UsdLayer> layer_;
  std::vector<UsdBody> bodies_;  // the first is the world
  std::vector<UsdJoint> joints_;
  std::map<const UsdPrim*, int> body_of_;          // of bodies and all prims below them
  std::map<const UsdPrim*, UsdTransform> places_;  // of all prims, in the world
  std::vector<const UsdPrim*> joint_prims_, actuators_, scenes_;
  std::vector<UsdSite> sites_;
  std::set<std::string> link_names_ = {"world"}, joint_names_;
  std::vector<std::vector<std::pair<int, int>>>
      neighbours_;              // of each body: another one and the joint that carries one of both
  std::vector<bool> is_added_;  // by body
  double meter_ = 1, kilogram_ = 1;
  RoundingTolerance rounding_;
  Decimals lengths_, angles_;
  UrdfFile tree_;
  YamlFile yaml_;
  MjcfNotes notes_;
};

}  // namespace bielle
