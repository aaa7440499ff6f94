#pragma once
/// \file Robots from SDF files, by libsdformat, which checks them and resolves poses. Without it (package libsdformat-dev),
/// reader_no_sdf.cpp stands for it.
///
/// The bodies of a robot stand in the file where all joints are at zero. A body may be the child of several joints: one carries
/// it, a hinge with a range, a force or an effort rather than a ball, and the others close loops. The frame of a body keeps its
/// directions, unless it hangs on a universal joint, and has its origin on the joint that carries it. Joints with
/// <drake:parent_frame> and <drake:child_frame> join these frames, wherever the file draws their links.
#include <sdf/sdf.hh>
#include <set>

#include "formats/exchange_readers.h"
#include "formats/mjcf_element.h"
#include "formats/xml_document.h"

namespace bielle {

class SdfReader {
 public:
  explicit SdfReader(const std::string& path);
  RobotFiles read();

 private:
  // reader_sdf.cpp
  void load(const std::string& xml);
  [[noreturn]] void failForSeveral(const std::string& names) const;
  void checkModels(const XMLElement& root) const;
  const sdf::Model& findModel();
  void readLink(const sdf::Link& link);
  void chooseCarriers();
  void addBelow(const std::string& link);
  void addCarried(const sdf::Joint& joint);
  void addRoot(const std::string& link);
  void readFrame(const sdf::Frame& frame);
  void addStart();
  void noteElements(const XMLElement& element);
  void checkVersion(const XMLElement& root);
  void checkInertia(const XMLElement& link);
  void readMimic(const XMLElement& joint);
  [[noreturn]] void fail(const std::string& element, const std::string& problem, const std::string& remedy) const;
  void check(const sdf::Errors& errors) const;
  static SE3 toSE3(const ignition::math::Pose3d& pose);
  SE3 getPlace(const sdf::SemanticPose& pose) const;  // in the world, as the file draws it
  SE3 getPlace(const sdf::SemanticPose& pose,
               const std::string& link) const;  // with all joints at zero, fixed to a link
  std::string getParent(const sdf::Joint& joint) const;
  std::string getChild(const sdf::Joint& joint) const;
  SE3 getLinkPlace(const std::string& link) const;                            // of our frame of it, in the world
  SE3 calcPlaceIn(const std::string& parent, const std::string& link) const;  // of our frames, with all joints at zero
  template <typename Element>  // that the file gives in a link: in our frame of it
  SE3 getPlaceOn(const Element& element, const std::string& link) const;
  bool standsOnChild(const sdf::Joint& joint) const;  // in its frame, as far as the file says so by itself
  std::string addFrame(const std::string& name, const std::string& link, const SE3& X_LF);

  // reader_sdf_joints.cpp
  Vector3d resolveAxis(const sdf::Joint& joint, int k) const;
  Vector3d getAxis(const sdf::Joint& joint, int k) const;
  std::optional<Matrix3d> findUniversalAxes(const sdf::Joint& joint) const;
  static bool losesByCut(const sdf::Joint& joint);
  void readAxis(const sdf::Joint& joint, int k, UrdfJoint& out);
  void addClosure(const sdf::Joint& joint);
  void addClosure(const std::string& name, ClosureKind kind, const Vector3d& axis, const std::string& link1,
                  const SE3& X_W1, const std::string& link2, const SE3& X_W2);

  // reader_sdf_shapes.cpp
  void readShapes(const sdf::Link& link);
  std::optional<Visual> readGeometry(const sdf::Geometry& geometry, const std::string& element);
  void computeInertia(const XMLElement& link, const XMLElement& inertial);

  // reader_sdf_drake.cpp
  void readDrake(const XMLElement& model);
  void readBushing(const XMLElement& e);
  void readBall(const XMLElement& e);
  const XMLElement& getEntry(const XMLElement& e, const std::string& tag) const;
  Vector3d getVector(const XMLElement& e, const std::string& tag) const;
  std::pair<std::string, SE3> findDrakeFrame(const XMLElement& e, const std::string& tag) const;
  void readJointFrames(const XMLElement& model);
  void moveLinks(const std::string& link);

  const std::string path_;
  XMLDocument document_;
  const XMLElement* element_ = nullptr;  // <model>
  sdf::Root root_;
  const sdf::Model* model_ = nullptr;
  SE3 X_WM_;
  UrdfFile tree_;
  YamlFile yaml_;
  MjcfNotes notes_;
  std::map<std::string, const sdf::Joint*> carriers_;  // by link
  std::map<std::string, SE3> X_WL_, X_LS_;             // by link: our frame in the world, and that of the file in it
  std::map<std::string, std::string> parents_;         // of the links that are carried
  std::map<std::string, std::vector<const sdf::Joint*>>
      carried_;  // by the link that they are on, in the order of the file
  std::vector<const sdf::Joint*> closing_;
  std::set<std::string> names_;
  // Of joints of Drake that have a frame on either link, and where these frames stand in the file.
  struct JointFrames {
    SE3 X_WP, X_WC;
  };
  std::map<std::string, JointFrames> joint_frames_;  // by joint
  std::map<std::string, SE3> moves_;                 // by link: from where the file draws it to all joints at zero
};

}  // namespace bielle
