#pragma once
/// \file Files of MuJoCo (MJCF) as the contents of a robot's two files. Bodies with several joints become chains of links
/// without mass, except where the writer (formats/mjcf.h) split one joint of ours, which is put together again.
#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "formats/mjcf_element.h"
#include "formats/robot_files.h"

namespace bielle {

/// Before the name of a motor: the name of a text of <custom> that says of it what our YAML file would.
inline const std::string kMjcfMotorData = "bielle:motor:";

constexpr double kSamePlace = 1e-9;  // of axes and places that the writer made equal

inline SE3 translate(const Vector3d& p) { return {Matrix3d::Identity(), p}; }

class MjcfReader {
 public:
  MjcfReader(const std::string& path, const XMLElement& root);
  MjcfFile read();

 private:
  // A body of the file: the link that carries it, its frame there and, with all joints at `ref`, in the world.
  struct BodyPlace {
    std::string link;
    SE3 X_LB, X_WB;
  };

  // A joint of the file.
  struct Element {
    std::string name, type;
    Vector3d pos = Vector3d::Zero(), axis = Vector3d::UnitZ();  // in the frame of the body
    double ref = 0, armature = 0;
    VectorXd lower, upper;  // empty for none
    JointForce force;
    bool has_force = false, is_driven = false;
    int line = 0;
  };

  // Where the coordinates of a joint stand in qpos.
  struct Slot {
    std::string joint;
    JointKind kind = JointKind::Revolute;
    VectorXd q_ref;                         // its coordinates as the file stands
    Matrix3d R_ref = Matrix3d::Identity();  // that MuJoCo's quaternion is relative to
  };

  struct FixedTendon {
    std::map<std::string, double> coefficients;
    int line = 0;
    bool is_used = false;
  };

  // An element in a body, with the class whose defaults hold for it.
  struct Child {
    const XMLElement* element;
    SE3 X_BF;  // of the frames around it
    std::string childclass;
  };

  // Size (half edges; radius and half length; radius) and place of a geom; `fromto` gives both ends.
  struct Shape {
    std::string type;
    Vector3d size = Vector3d::Zero();
    SE3 X_BG;
  };

  struct Sphere {
    Vector3d centre;
    double radius;
  };

  // An equality of two bodies, or a coupler.
  struct Tie {
    ClosureKind kind;
    std::string name, body1, body2;  // links
    SE3 X_L1, X_L2;
    Vector3d axis = Vector3d::UnitZ();
    std::string coupler;  // a coupler is a ClosureSpec already
    int line = 0;
  };

  template <typename F>
  void forEachSection(const char* tag, const F& f) {
    for (const XMLElement* e : getChildren(root_, tag)) f(*e);
  }
  template <typename F>
  void forEach(const char* tag, const F& f) {
    forEachSection(tag, [&](const XMLElement& section) {
      for (const XMLElement* e : getChildren(section)) f(*e);
    });
  }
  void noteElement(const XMLElement& e, const std::string& problem = "left out");
  [[noreturn]] void refuse(const XMLElement& e, const std::string& problem, const std::string& remedy) const;
  std::string makeName(const std::string& made);

  // the whole file: reader_mjcf.cpp
  void readModel();
  void readSettings();
  void readCompiler(const XMLElement& e);
  void readAsset(const XMLElement& e);
  void noteSection(const XMLElement& e);

  // bodies and joints: reader_mjcf.cpp
  void flatten(const XMLElement& body, const SE3& X_BF, const std::string& childclass, std::vector<Child>& out);
  void readContents(const XMLElement& e, const BodyPlace& place, const std::string& childclass);
  void readContents(const std::vector<Child>& children, const BodyPlace& place);
  void readBody(const Child& child, const BodyPlace& parent);
  SE3 addJoints(const MjcfElement& body, const std::string& link, const std::vector<Child>& children,
                const BodyPlace& parent, const SE3& X_PB);
  UrdfJoint& addLink(const std::string& link, const std::string& parent, JointKind kind, const std::string& name,
                     const SE3& X_PJ);
  std::string findFrame(const std::string& link, const SE3& X, bool is_ball, const std::string& made);
  void addSingle(const Element& element, const std::string& link, const std::string& parent, const SE3& X_PB);
  void addFree(const Element& element, const std::string& link, const SE3& X_WB);
  bool addCompound(const std::vector<Element>& elements, const std::string& link, const std::string& parent,
                   const SE3& X_PB);
  static void setLimits(const std::vector<Element>& elements, UrdfJoint& joint);
  Element readJoint(const Child& child, const std::string& body);
  void readRange(MjcfElement& e, bool has_one, double unit, Element& out);
  void readForce(MjcfElement& e, bool has_one, double unit, Element& out);
  void readJointClamp(MjcfElement& e, const Element& joint);

  // inertia and shapes: reader_mjcf_shapes.cpp
  Inertia readInertia(const std::vector<Child>& children);
  Shape readShape(MjcfElement& e, const SE3& X_BF);
  Inertia readSolid(const Child& child);
  void readShapes(const std::vector<Child>& children, const BodyPlace& place);
  void readSite(const Child& child, const BodyPlace& place, const std::map<std::string, Sphere>& spheres,
                std::set<std::string>& soles);
  void readVisual(const Child& child, const BodyPlace& place);

  // loops, couplers, springs, motors and postures: reader_mjcf_relations.cpp
  const BodyPlace& findBody(MjcfElement& e, const char* attribute);
  const BodyPlace& findSite(MjcfElement& e, const char* attribute);
  void readEquality(const XMLElement& element);
  void readTie(MjcfElement& e, const std::string& name);
  void joinHinges();
  void addClosures();
  void addCoupler(const std::string& name, ClosureSpec coupler, const MjcfElement& e);
  const Slot& findSlot(const MjcfElement& e, const std::string& joint) const;
  std::array<double, 2> readLine(MjcfElement& e);
  void readJointEquality(MjcfElement& e, const std::string& name);
  void readTendon(const XMLElement& element);
  void readSpatialTendon(const XMLElement& element);
  void readTendonEquality(MjcfElement& e, const std::string& name);
  void listDriven(const XMLElement& section);
  void readActuator(const XMLElement& element);
  void readCustom(const XMLElement& element);
  void readKey(const XMLElement& element);
  void addStart();

  const XMLElement& root_;
  MjcfSettings settings_;
  UrdfFile tree_;
  YamlFile yaml_;
  std::string inertia_from_geom_ = "auto", mesh_directory_;
  std::set<std::string> taken_, joint_names_, driven_;  // names of links; of joints; of joints with an actuator
  std::map<std::string, BodyPlace> places_, sites_;     // by name in the file
  std::map<std::string, Visual> meshes_;
  std::vector<Slot> slots_;
  std::vector<Tie> ties_;
  std::map<std::string, ClosureSpec> couplers_;
  std::map<std::string, FixedTendon> tendons_;
  std::map<std::string, double> clamps_;
};

}  // namespace bielle
