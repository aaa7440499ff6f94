#include "formats/reader_sdf.h"

#include <algorithm>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/decimals.h"
#include "formats/log_capture.h"
#include "formats/reader_dialects.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

constexpr size_t kMostSdfJoints = 3000, kMostSdfBytes = 16'000'000;

bool canClose(sdf::JointType type) {
  return type == sdf::JointType::REVOLUTE || type == sdf::JointType::CONTINUOUS || type == sdf::JointType::BALL ||
         type == sdf::JointType::FIXED || type == sdf::JointType::PRISMATIC;
}

// Up to the end of what begins at `at`: a comment, or a tag with its brackets.
size_t findEndOfTag(const std::string& xml, size_t at) {
  const auto behind = [&](const char* mark) {
    const size_t end = xml.find(mark, at);
    return end == std::string::npos ? xml.size() : end + std::char_traits<char>::length(mark);
  };
  return behind(xml.compare(at, 4, "<!--") == 0 ? "-->" : xml.compare(at, 9, "<![CDATA[") == 0 ? "]]>" : ">");
}

// Without what takes no part in a mechanism, lines kept: libsdformat refuses whole files for a colour or a friction that it does not
// like. \param xml  well-formed
std::string blankForMechanism(std::string xml) {
  static const std::set<std::string> left_out = {"surface", "script", "sensor", "plugin"};
  size_t begin = 0;
  std::string open;  // the element that is being left out
  int depth = 0;     // of elements of its name in each other
  for (size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at)) {
    const size_t end = findEndOfTag(xml, at);
    const bool closes = xml.compare(at, 2, "</") == 0;
    const size_t name_at = at + (closes ? 2 : 1);
    const std::string name = xml.substr(name_at, xml.find_first_of(" \t\r\n/>", name_at) - name_at);
    if (open.empty() && !closes && left_out.count(name)) open = name, begin = at, depth = 0;
    if (!open.empty() && name == open) depth += closes ? -1 : xml[end - 2] == '/' ? 0 : 1;
    if (!open.empty() && depth == 0) {
      std::replace_if(
          xml.begin() + static_cast<long>(begin), xml.begin() + static_cast<long>(end),
          [](char c) { return c != '\n'; }, ' ');
      open.clear();
    }
    at = end;
  }
  return xml;
}

// Files that it includes: beside the file, or below a directory of that name.
std::string findIncluded(const fs::path& directory, const std::string& uri) {
  const size_t scheme = uri.find("://");
  const fs::path name = scheme == std::string::npos ? uri : uri.substr(scheme + 3);
  std::error_code error;
  for (const fs::path& base : {directory, directory.parent_path()})
    if (fs::exists(base / name, error)) return (base / name).string();
  return "";
}

}  // namespace

SdfReader::SdfReader(const std::string& path) : path_(path) {
  tree_.path = yaml_.path = path;
  tree_.root = "world";
  tree_.links["world"].name = "world";
  tree_.has_own_base = true;
  X_WL_["world"] = {};
  names_ = {"world"};
}

RobotFiles SdfReader::read() {
  const std::string xml = readRobotText(path_);
  if (xml.size() > kMostSdfBytes)
    fail("file", "it exceeds the largest size of an SDF file (16 MB)", "give one without embedded data");
  parseXml(xml, path_, "sdf", document_);
  checkVersion(*document_.RootElement());
  checkModels(*document_.RootElement());
  load(xml);
  model_ = &findModel();
  tree_.name = model_->Name();
  if (model_->ModelCount() > 0 || model_->InterfaceModelCount() > 0)
    fail("model '" + model_->Name() + "'", "it contains other models",
         "put their links and joints into the model itself, as <include merge=\"true\"> does");
  if (model_->LinkCount() + model_->JointCount() + model_->FrameCount() > kMostSdfJoints)
    fail("model '" + model_->Name() + "'", "it has more than " + std::to_string(kMostSdfJoints) + " elements",
         "no robot needs so many");
  for (uint64_t i = 0; i < model_->LinkCount(); ++i) names_.insert(model_->LinkByIndex(i)->Name());
  for (uint64_t i = 0; i < model_->JointCount(); ++i) names_.insert(model_->JointByIndex(i)->Name());
  for (uint64_t i = 0; i < model_->FrameCount(); ++i) names_.insert(model_->FrameByIndex(i)->Name());
  chooseCarriers();
  if (element_) readJointFrames(*element_);
  if (!joint_frames_.empty()) {
    moveLinks("world");
    for (uint64_t i = 0; i < model_->LinkCount(); ++i)
      if (const std::string& link = model_->LinkByIndex(i)->Name(); !carriers_.count(link)) moveLinks(link);
  }
  for (uint64_t i = 0; i < model_->LinkCount(); ++i) readLink(*model_->LinkByIndex(i));
  addBelow("world");
  for (uint64_t i = 0; i < model_->LinkCount(); ++i)
    if (const std::string& link = model_->LinkByIndex(i)->Name(); !carriers_.count(link)) addRoot(link);
  for (uint64_t i = 0; i < model_->FrameCount(); ++i) readFrame(*model_->FrameByIndex(i));
  for (const sdf::Joint* joint : closing_) addClosure(*joint);
  if (element_) {
    readDrake(*element_);
    for (const XMLElement* e : getChildren(*element_)) {
      if (getTag(*e) == "link") checkInertia(*e);
      if (getTag(*e) == "joint") readMimic(*e);
      if (getTag(*e) == "plugin") readMimicPlugin(*e, tree_);
    }
    noteElements(*element_);
  }
  addStart();
  notes_.addTo(tree_);
  GeometryDecimals decimals;
  decimals.add(*document_.RootElement());
  tree_.rounding = decimals.calcTolerance();
  return {std::move(tree_), std::move(yaml_)};
}

void SdfReader::fail(const std::string& element, const std::string& problem, const std::string& remedy) const {
  throw InputError(path_, element, problem, remedy);
}

void SdfReader::check(const sdf::Errors& errors) const {
  for (const sdf::Error& error : errors) {
    // Frames may be links without mass.
    if (error.Code() == sdf::ErrorCode::LINK_INERTIA_INVALID) continue;
    const std::string line = error.LineNumber() ? "line " + std::to_string(*error.LineNumber()) : "document";
    fail(line, "libsdformat says: " + error.Message(), "correct the element");
  }
}

void SdfReader::load(const std::string& xml) {
  sdf::Console::Instance()->SetQuiet(true);
  sdf::ParserConfig config;
  config.SetWarningsPolicy(sdf::EnforcementPolicy::LOG);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::LOG);
  const fs::path directory = fs::absolute(path_).parent_path();
  config.SetFindCallback([directory](const std::string& uri) { return findIncluded(directory, uri); });
  sdf::Errors errors;
  bool is_read = true;
  const LogCapture capture;  // libsdformat tries whether what is no SDF is a URDF
  try {
    errors = root_.LoadSdfString(blankForMechanism(xml), config);
  } catch (const sdf::Exception&) {
    is_read = false;
  } catch (const std::exception&) {
    is_read = false;
  }
  if (!is_read) fail("document", "libsdformat cannot read it", "correct it; `ign sdf --check` may say where");
  check(errors);
}

void SdfReader::failForSeveral(const std::string& names) const {
  fail("document", "it has several models: " + names, "keep one of them, in a file of its own");
}

// libsdformat reads the first one alone.
void SdfReader::checkModels(const XMLElement& root) const {
  std::string names;
  const auto models = getChildren(root, "model");
  for (const XMLElement* model : models) names += (names.empty() ? "'" : ", '") + getAttribute(model, "name") + "'";
  if (models.size() > 1) failForSeveral(names);
}

// The only one of the file.
const sdf::Model& SdfReader::findModel() {
  const XMLElement& root = *document_.RootElement();
  element_ = root.FirstChildElement("model");
  if (root_.Model()) {
    X_WM_ = toSE3(root_.Model()->RawPose());
    return *root_.Model();
  }
  std::vector<const sdf::Model*> moving;
  std::string names;
  for (uint64_t w = 0; w < root_.WorldCount(); ++w)
    for (uint64_t i = 0; i < root_.WorldByIndex(w)->ModelCount(); ++i) {
      const sdf::Model& model = *root_.WorldByIndex(w)->ModelByIndex(i);
      if (model.JointCount() == 0) {
        tree_.warnings.push_back(path_ + ": model '" + model.Name() + "': it is left out, because it has no joints");
        continue;
      }
      moving.push_back(&model);
      names += (names.empty() ? "'" : ", '") + model.Name() + "'";
    }
  if (moving.empty()) fail("document", "it has no model with joints", "give a file with one");
  if (moving.size() > 1) failForSeveral(names);
  const sdf::World& world = *root_.WorldByIndex(0);
  const auto& g = world.Gravity();
  yaml_.gravity = Vector3d(g.X(), g.Y(), g.Z());
  ignition::math::Pose3d pose;
  check(moving[0]->SemanticPose().Resolve(pose));
  X_WM_ = toSE3(pose);
  const XMLElement* place = root.FirstChildElement("world");
  for (element_ = place ? place->FirstChildElement("model") : nullptr;
       element_ && getAttribute(element_, "name") != moving[0]->Name();)
    element_ = element_->NextSiblingElement("model");
  return *moving[0];
}

SE3 SdfReader::toSE3(const ignition::math::Pose3d& pose) {
  const auto& q = pose.Rot();
  return {Eigen::Quaterniond(q.W(), q.X(), q.Y(), q.Z()).normalized().toRotationMatrix(),
          {pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z()}};
}

SE3 SdfReader::getPlace(const sdf::SemanticPose& semantic) const {
  ignition::math::Pose3d pose;
  check(semantic.Resolve(pose, "__model__"));
  return X_WM_ * toSE3(pose);
}

SE3 SdfReader::getPlace(const sdf::SemanticPose& semantic, const std::string& link) const {
  const auto moved = moves_.find(link);
  return moved == moves_.end() ? getPlace(semantic) : moved->second * getPlace(semantic);
}

std::string SdfReader::getParent(const sdf::Joint& joint) const {
  std::string link;
  check(joint.ResolveParentLink(link));
  return link;
}

std::string SdfReader::getChild(const sdf::Joint& joint) const {
  std::string link;
  check(joint.ResolveChildLink(link));
  return link;
}

// Which joint carries a link: the first that leads to it, but one that cannot close a loop before any other, then one that slides,
// whose coordinate and motor a loop would lose, and a ball after all others if there is a hinge that would lose something as a closure.
void SdfReader::chooseCarriers() {
  std::set<std::string> hinged;
  for (uint64_t i = 0; i < model_->JointCount(); ++i)
    if (const sdf::Joint& joint = *model_->JointByIndex(i); canClose(joint.Type()) && losesByCut(joint))
      hinged.insert(getChild(joint));
  const auto rank = [&](const sdf::Joint& joint) {
    if (!canClose(joint.Type())) return 0;
    if (joint.Type() == sdf::JointType::PRISMATIC) return 1;
    return joint.Type() == sdf::JointType::BALL && hinged.count(getChild(joint)) ? 3 : 2;
  };
  for (const int now : {0, 1, 2, 3})
    for (uint64_t i = 0; i < model_->JointCount(); ++i) {
      const sdf::Joint& joint = *model_->JointByIndex(i);
      if (rank(joint) != now) continue;
      const std::string parent = getParent(joint), child = getChild(joint);
      bool is_free = !carriers_.count(child);
      for (std::string above = parent; is_free && parents_.count(above); above = parents_[above])
        is_free = parents_[above] != child;
      if (is_free && parent != child) {
        carriers_[child] = &joint;
        parents_[child] = parent;
      } else if (now > 0) {
        closing_.push_back(&joint);
      } else {
        fail("joint '" + joint.Name() + "'",
             "its child '" + child + "' hangs on another joint too, and it cannot close a loop",
             "cut the loop at a revolute, prismatic, ball or fixed joint");
      }
    }
  for (uint64_t i = 0; i < model_->JointCount(); ++i) {
    const sdf::Joint& joint = *model_->JointByIndex(i);
    const auto carrier = carriers_.find(getChild(joint));
    if (carrier != carriers_.end() && carrier->second == &joint)
      carried_[parents_.at(carrier->first)].push_back(&joint);
  }
}

// The links on `link`, depth first in the order of the file.
void SdfReader::addBelow(const std::string& link) {
  for (const sdf::Joint* joint : carried_[link]) {
    addCarried(*joint);
    addBelow(getChild(*joint));
  }
}

void SdfReader::addRoot(const std::string& link) {
  UrdfJoint root;
  root.parent = "world";
  root.child = link;
  root.joint.kind = model_->Static() ? JointKind::Fixed : JointKind::FreeFlyer;
  root.joint.name = "root_joint";
  while (!names_.insert(root.joint.name).second) root.joint.name = link + "_" + root.joint.name;
  if (model_->Static()) root.joint.X_PJ = X_WL_.at(link);
  tree_.joints.push_back(root);
  addBelow(link);
}

SE3 SdfReader::getLinkPlace(const std::string& link) const { return X_WL_.at(link); }

void SdfReader::readLink(const sdf::Link& link) {
  const bool is_given = link.PoseRelativeTo().empty() && moves_.empty();
  const SE3 X_WS = is_given ? X_WM_ * toSE3(link.RawPose()) : getPlace(link.SemanticPose(), link.Name());
  SE3 X_WL = X_WS;
  const auto carrier = carriers_.find(link.Name());
  if (carrier != carriers_.end() && carrier->second->Type() != sdf::JointType::FIXED &&
      carrier->second->Type() != sdf::JointType::PRISMATIC && !standsOnChild(*carrier->second)) {
    const auto frames = joint_frames_.find(carrier->second->Name());
    X_WL.p = frames == joint_frames_.end() ? getPlace(carrier->second->SemanticPose(), link.Name()).p
                                           : (moves_.at(link.Name()) * frames->second.X_WC).p;
  }
  if (carrier != carriers_.end() && carrier->second->Type() == sdf::JointType::UNIVERSAL)
    if (const auto axes = findUniversalAxes(*carrier->second)) X_WL.R = X_WS.R * *axes;
  X_WL_[link.Name()] = X_WL;
  const SE3 X_LS = X_WL.p == X_WS.p && X_WL.R == X_WS.R ? SE3() : X_WL.inverse() * X_WS;
  X_LS_[link.Name()] = X_LS;
  UrdfLink& out = tree_.links[link.Name()];
  out.name = link.Name();
  const auto& moments = link.Inertial().MassMatrix();
  Matrix3d I;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) I(i, j) = moments.Moi()(i, j);
  out.inertia = Inertia{moments.Mass(), Vector3d::Zero(), I}.transformed(X_LS * toSE3(link.Inertial().Pose()));
  readShapes(link);
}

// Where the file gives the numbers themselves, so that they do not go through the world and come back rounded.
SE3 SdfReader::calcPlaceIn(const std::string& parent, const std::string& link) const {
  const sdf::Link& own = *model_->LinkByName(link);
  if (parent != "world" && own.PoseRelativeTo() == parent && moves_.empty())
    return X_LS_.at(parent) * toSE3(own.RawPose()) * X_LS_.at(link).inverse();
  return getLinkPlace(parent).inverse() * getLinkPlace(link);
}

template <typename Element>
SE3 SdfReader::getPlaceOn(const Element& element, const std::string& link) const {
  ignition::math::Pose3d pose = element.RawPose();
  if (!element.PoseRelativeTo().empty() && element.PoseRelativeTo() != link)
    check(element.SemanticPose().Resolve(pose, link));
  return X_LS_.at(link) * toSE3(pose);
}
template SE3 SdfReader::getPlaceOn(const sdf::Visual&, const std::string&) const;
template SE3 SdfReader::getPlaceOn(const sdf::Collision&, const std::string&) const;

bool SdfReader::standsOnChild(const sdf::Joint& joint) const {
  const SE3 X = toSE3(joint.RawPose());
  return joint.PoseRelativeTo().empty() && !joint_frames_.count(joint.Name()) && X.p.isZero(0) && X.R.isIdentity(0);
}

// A frame of the tree.
std::string SdfReader::addFrame(const std::string& name, const std::string& link, const SE3& X_LF) {
  UrdfJoint joint;
  joint.parent = link;
  joint.child = joint.joint.name = name;
  joint.joint.name += "_frame";
  while (!names_.insert(joint.joint.name).second) joint.joint.name += "_";
  joint.joint.kind = JointKind::Fixed;
  joint.joint.X_PJ = X_LF;
  tree_.links[name].name = name;
  tree_.joints.push_back(joint);
  return name;
}

void SdfReader::readFrame(const sdf::Frame& frame) {
  std::string link;
  check(frame.ResolveAttachedToBody(link));
  if (!X_WL_.count(link)) fail("frame '" + frame.Name() + "'", "it is not attached to a link", "attach it to one");
  const bool is_own = frame.AttachedTo() == link && frame.PoseRelativeTo().empty();
  addFrame(frame.Name(), link,
           is_own ? getPlaceOn(frame, link) : SE3(getLinkPlace(link).inverse() * getPlace(frame.SemanticPose(), link)));
}

// The bodies of the file stand where its loops are closed.
void SdfReader::addStart() {
  if (yaml_.closures.empty()) return;
  Reference reference;
  reference.name = "initial";
  for (const UrdfJoint& joint : tree_.joints) {
    std::vector<double>& q = reference.joints[joint.joint.name];
    q.assign(getNq(joint.joint.kind), 0);
    if (joint.joint.kind == JointKind::Spherical) q.back() = 1;
    if (joint.joint.kind == JointKind::FreeFlyer) {
      const SE3 X = getLinkPlace(joint.child);
      Eigen::Map<Vector3d>(q.data()) = X.p;
      Eigen::Map<Eigen::Vector4d>(q.data() + 3) = Eigen::Quaterniond(X.R).coeffs();
    }
    if (q.empty()) reference.joints.erase(joint.joint.name);
  }
  yaml_.references.push_back(reference);
}

RobotFiles readSdf(const std::string& path) { return SdfReader(path).read(); }

}  // namespace bielle
