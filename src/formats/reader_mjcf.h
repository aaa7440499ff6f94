#pragma once
/// \file Files of MuJoCo (MJCF) as the contents of a robot's two files. Bodies with several joints become chains of links
/// without mass, except where the writer (formats/mjcf.h) split one joint of ours, which is put together again.
#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "formats/exchange_readers.h"
#include "formats/mjcf_element.h"
#include "formats/mjcf_softness.h"

namespace bielle {

/// Before the name of a motor: the name of a text of <custom> that says of it what our YAML file would.
inline const std::string kMjcfMotorData = "bielle:motor:";
/// Before the name of a body: the name of six numbers of <custom>, its moments of inertia with all their digits.
inline const std::string kMjcfInertia = "bielle:inertia:";

/// Attributes of geoms that are read at several places.
inline constexpr const char* kGeomAttributes[] = {"mass",        "density", "mesh",     "contype",
                                                  "conaffinity", "rgba",    "material", "shellinertia"};

constexpr double kSamePlace = 1e-9;  // of axes and places that the writer made equal

inline SE3 translate(const Vector3d& p) { return {Matrix3d::Identity(), p}; }

class MjcfReader {
 public:
  explicit MjcfReader(const std::string& path);
  RobotFiles read();
  /// What read() found of the loops' softness.
  const MjcfSoftness& softness() const { return softness_; }

 private:
  // A body of the file: the link that carries it, its frame there and, with all joints at `ref`, in the world.
  struct BodyPlace {
    std::string link;
    SE3 X_LB, X_WB;
    bool is_static = false;  // no joint carries it
    std::string parent{};    // its link
  };

  // A joint of the file.
  struct Element {
    std::string name, type;
    Vector3d pos = Vector3d::Zero(), axis = Vector3d::UnitZ();  // in the frame of the body
    double ref = 0, armature = 0;
    VectorXd lower, upper;  // empty for none
    JointForce force;
    bool has_force = false, is_named = false;  // by an actuator, an equality or a tendon
    int line = 0;
  };

  // Where the coordinates of a joint stand in qpos.
  struct Slot {
    std::string joint;
    JointKind kind = JointKind::Revolute;
    VectorXd q_ref;                         // its coordinates as the file stands
    Matrix3d R_ref = Matrix3d::Identity();  // that MuJoCo's quaternion is relative to
    std::vector<Element> elements;          // of a free base that is made of them,
    SE3 X_WB;                               // and its place with all of them at `ref`
  };

  struct FixedTendon {
    std::map<std::string, double> coefficients;
    const XMLElement* element = nullptr;
    bool is_used = false;
    std::string rotor;  // the joint that turns by its length, if there is one
  };

  // A spatial tendon; ends only if it runs straight between two sites.
  struct SpatialTendon {
    std::vector<BodyPlace> ends;
  };

  struct MeshAsset {
    Visual visual;                          // file and scale
    Vector3d p_ref = Vector3d::Zero();      // taken off its vertices, which
    Matrix3d R_ref = Matrix3d::Identity();  // are then turned back by this and scaled
    std::string inertia;                    // how it gives mass
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

  // An equality of two bodies, or a coupler.
  struct Tie {
    ClosureKind kind;
    std::string name, body1, body2;  // links
    SE3 X_L1, X_L2;
    Vector3d axis = Vector3d::UnitZ();
    double length = 0;    // of a distance
    double lever = 0;     // between the points that make a hinge
    std::string coupler;  // a coupler is a ClosureSpec already
    int line = 0;
    std::vector<size_t> equalities{};  // in softness_
  };

  template <typename F>
  void forEachSection(const char* tag, const F& f) {
    for (const XMLElement* e : getChildren(settings_.files.root(), tag)) f(*e);
  }
  template <typename F>
  void forEach(const char* tag, const F& f) {
    forEachSection(tag, [&](const XMLElement& section) {
      for (const XMLElement* e : getChildren(section)) f(*e);
    });
  }
  // With those of included files.
  std::vector<const XMLElement*> getChildren(const XMLElement& e, const char* tag = nullptr) {
    return settings_.files.getChildren(e, tag);
  }
  void noteElement(const XMLElement& e, const std::string& problem = "left out");
  [[noreturn]] void refuse(const XMLElement& e, const std::string& problem, const std::string& remedy) const;
  std::string makeName(const std::string& made);

  // the whole file: reader_mjcf.cpp
  void readModel();
  void readSettings();
  void readCompiler(const XMLElement& e);
  void noteSection(const XMLElement& e);

  // bodies: reader_mjcf.cpp
  void flatten(const XMLElement& body, const SE3& X_BF, const std::string& childclass, std::vector<Child>& out);
  void reserveNames(const XMLElement& element);
  void readContents(const XMLElement& e, const BodyPlace& place, const std::string& childclass);
  void readContents(const std::vector<Child>& children, const BodyPlace& place);
  void readBody(const Child& child, const BodyPlace& parent);
  UrdfJoint& addLink(const std::string& link, const std::string& parent, JointKind kind, const std::string& name,
                     const SE3& X_PJ);
  std::string findFrame(const std::string& link, const SE3& X, bool is_ball, const std::string& made);

  // joints: reader_mjcf_joints.cpp
  SE3 addJoints(const MjcfElement& body, const std::string& link, const std::vector<Child>& children,
                const BodyPlace& parent, const SE3& X_PB);
  void addSingle(const Element& element, const std::string& link, const std::string& parent, const SE3& X_PB);
  void addFree(const Element& element, const std::string& link, const SE3& X_WB);
  bool addCompound(const std::vector<Element>& elements, const std::string& link, const std::string& parent,
                   const SE3& X_PB);
  static void setLimits(const std::vector<Element>& elements, UrdfJoint& joint);
  Element readJoint(const Child& child, const std::string& body);
  void readRange(MjcfElement& e, bool has_one, double unit, Element& out);
  void readForce(MjcfElement& e, bool has_one, double unit, Element& out);
  void readJointClamp(MjcfElement& e, const Element& joint);

  // a free base of several elements, and postures: reader_mjcf_base.cpp
  bool addBase(const MjcfElement& body, const std::vector<Element>& elements, const std::string& link,
               const BodyPlace& parent, const SE3& X_WB);
  static Eigen::Index getSize(const Slot& slot);
  static std::vector<double> calcPosition(const Slot& slot, const MjcfElement& key, const double* qpos);
  void readKey(const XMLElement& element);
  void addStart();

  // inertia: reader_mjcf_inertia.cpp
  void readInertiaSettings(MjcfElement& compiler);
  void readMesh(const XMLElement& e);
  Inertia readInertia(const std::vector<Child>& children, MjcfBody& soft);
  Inertia readGivenInertia(MjcfElement& e) const;
  Inertia readSolid(const Child& child, std::vector<SE3>& frames);
  static Inertia calcPrimitive(const MjcfElement& e, const Shape& shape);
  Inertia readMeshSolid(MjcfElement& e, const std::string& mesh) const;
  Inertia keepBounds(const Inertia& inertia) const;
  void scaleMasses();

  // shapes: reader_mjcf_shapes.cpp
  static SE3 readPlace(MjcfElement& e, double* half_length);
  static Shape readShape(MjcfElement& e, const SE3& X_BF);
  void readShapes(const std::vector<Child>& children, const BodyPlace& place);
  void readSite(const Child& child, const BodyPlace& place, const std::map<std::string, Shape>& shapes,
                std::set<std::string>& soles);
  static bool placeMesh(const MeshAsset& mesh, Visual& visual);
  void readVisual(const Child& child, const BodyPlace& place);

  // loops, couplers, springs and motors: reader_mjcf_relations.cpp
  const BodyPlace& findBody(MjcfElement& e, const char* attribute);
  const BodyPlace& findSite(MjcfElement& e, const char* attribute);
  void readEquality(const XMLElement& element);
  void readSoftness(MjcfElement& e, const std::string& name);
  void noteSoftness(const MjcfElement& e, const SoftSettings& settings) const;
  void readTie(MjcfElement& e, const std::string& name);
  void joinHinges();
  void addClosures();
  void addCoupler(const std::string& name, ClosureSpec coupler, const MjcfElement& e);
  const Slot& findSlot(const MjcfElement& e, const std::string& joint) const;
  static std::vector<double> readPolynomial(MjcfElement& e);
  static void subtractPolynomial(const std::vector<double>& p, double c, const std::string& x, double x_ref,
                                 ClosureSpec& coupler);
  void readJointEquality(MjcfElement& e, const std::string& name);
  void readTendon(const XMLElement& element);
  void readSpatialTendon(const XMLElement& element);
  void readTendonEquality(MjcfElement& e, const std::string& name);
  void readRod(MjcfElement& e, const std::string& name, const SpatialTendon& tendon);
  bool isTied(const std::string& tendon);
  void addTendonLength(FixedTendon& tendon, double factor, ClosureSpec& coupler, const MjcfElement& e);
  void readTendonRanges();
  std::string nameCoupler(const std::string& made) const;
  std::string findCarrier(const std::map<std::string, double>& joints) const;
  std::string findDriven(MjcfElement& e, double& gear);
  void addRotor(FixedTendon& tendon, const std::string& name, MjcfElement& motor);
  void listNamed();
  void readActuator(const XMLElement& element);
  void readCustom(const XMLElement& element);
  void readExactInertia(const XMLElement& element, const std::string& body);

  MjcfSettings settings_;
  UrdfFile tree_;
  YamlFile yaml_;
  // <compiler>: whether geoms give mass and those of which groups, least mass and moment of a body, mass of all
  std::string inertia_from_geom_ = "auto", mesh_directory_;
  double first_group_ = 0, last_group_ = 5, least_mass_ = 0, least_moment_ = 0, total_mass_ = 0;
  bool has_gravity_ = true, has_equalities_ = true;  // flags of <option>
  MjcfSoftness softness_;
  bool balances_inertia_ = false, strips_path_ = false, is_exact_ = false, discards_visuals_ = false;
  std::set<std::string> taken_, joint_names_,
      named_;  // names of links; of joints; of joints named by an actuator and the like
  std::map<std::string, BodyPlace> places_, sites_;  // by name in the file
  std::map<std::string, MeshAsset> meshes_;
  std::vector<Slot> slots_;
  std::vector<Tie> ties_;
  std::map<std::string, ClosureSpec> couplers_;
  std::map<std::string, FixedTendon> tendons_;
  std::map<std::string, SpatialTendon> spatial_tendons_;
  std::map<std::string, double> clamps_;
};

}  // namespace bielle
