// Drake's own elements of SDF files that tie links together.
#include "bielle/model/error.h"
#include "formats/reader_drake.h"
#include "formats/reader_sdf.h"
#include "model/number_text.h"

namespace bielle {

void SdfReader::readDrake(const XMLElement& model) {
  for (const XMLElement* e : getChildren(model)) {
    const std::string& tag = getTag(*e);
    if (tag.rfind("drake:", 0) != 0) continue;
    if (tag == "drake:linear_bushing_rpy") {
      readBushing(*e);
    } else if (tag == "drake:ball_constraint") {
      readBall(*e);
    } else if (tag == "drake:tendon_constraint") {
      readDrakeTendon(*e, tree_, yaml_);
    } else if (tag == "drake:joint") {
      fail(describe(*e), "joints of Drake's own are not supported", "replace it by a joint of SDF");
    } else if (tag == "drake:collision_filter_group") {
      notes_.addHarmless(path_, "<" + tag + ">", e->GetLineNum());
    } else {
      notes_.add(path_, "<" + tag + ">", e->GetLineNum(), "left out");
    }
  }
}

const XMLElement& SdfReader::getEntry(const XMLElement& e, const std::string& tag) const {
  const XMLElement* child = e.FirstChildElement(tag.c_str());
  if (!child || !child->GetText()) fail(describe(e), "it has no <" + tag + ">", "give one");
  return *child;
}

Vector3d SdfReader::getVector(const XMLElement& e, const std::string& tag) const {
  const XMLElement& entry = getEntry(e, tag);
  std::vector<double> values;
  if (!parseNumbers(entry.GetText(), values) || values.size() != 3)
    fail(describe(entry), "it is not made of 3 finite numbers", "correct it");
  return {values[0], values[1], values[2]};
}

// A link or a frame: the link that holds it, and its place in the world.
std::pair<std::string, SE3> SdfReader::findDrakeFrame(const XMLElement& e, const std::string& tag) const {
  const XMLElement& entry = getEntry(e, tag);
  const std::string name = entry.GetText();
  if (const sdf::Link* link = model_->LinkByName(name)) return {name, getPlace(link->SemanticPose(), name)};
  if (name == "world") return {name, {}};
  const sdf::Frame* frame = model_->FrameByName(name);
  if (!frame) fail(describe(entry), "there is no link or frame '" + name + "'", "correct the name");
  std::string link;
  check(frame->ResolveAttachedToBody(link));
  if (link != "world" && !model_->LinkByName(link))
    fail(describe(entry), "the frame '" + name + "' is not attached to a link", "attach it to one");
  return {link, getPlace(frame->SemanticPose(), link)};
}

void SdfReader::readJointFrames(const XMLElement& model) {
  for (const XMLElement* e : getChildren(model, "joint")) {
    const sdf::Joint* joint = model_->JointByName(getAttribute(e, "name"));
    const bool has_parent = e->FirstChildElement("drake:parent_frame"),
               has_child = e->FirstChildElement("drake:child_frame");
    if (!joint || (!has_parent && !has_child)) continue;
    if (has_parent != has_child)
      fail(describe(*e), "it has a frame of Drake on one of its links alone",
           "give both <drake:parent_frame> and <drake:child_frame>");
    const auto find = [&](const std::string& tag, const std::string& link) {
      const auto [on, X] = findDrakeFrame(*e, tag);
      if (on != link)
        fail(describe(getEntry(*e, tag)), "it is not fixed to link '" + link + "'", "name a frame that is");
      return X;
    };
    joint_frames_[joint->Name()] = {find("drake:parent_frame", getParent(*joint)),
                                    find("drake:child_frame", getChild(*joint))};
  }
}

// Puts what hangs on a link where its joints are at zero.
void SdfReader::moveLinks(const std::string& link) {
  const SE3& moved = moves_[link];
  for (const sdf::Joint* joint : carried_[link]) {
    const auto frames = joint_frames_.find(joint->Name());
    const std::string child = getChild(*joint);
    moves_[child] = frames == joint_frames_.end() ? moved : moved * frames->second.X_WP * frames->second.X_WC.inverse();
    moveLinks(child);
  }
}

// Stiff springs between two frames, which stand for the joint that leaves free what has no stiffness.
void SdfReader::readBushing(const XMLElement& e) {
  const auto [link1, X_W1] = findDrakeFrame(e, "drake:bushing_frameA");
  const auto [link2, X_W2] = findDrakeFrame(e, "drake:bushing_frameC");
  const Vector3d torque = getVector(e, "drake:bushing_torque_stiffness"),
                 force = getVector(e, "drake:bushing_force_stiffness");
  const std::optional<ClosureSpec> closure = makeBushing(torque, force);
  if (!closure) fail(describe(e), "it is not as stiff as a ball, a hinge or a weld", kBushingRemedy);
  notes_.add(path_, "<" + getTag(e) + ">", e.GetLineNum(), describeBushing(*closure));
  addClosure("bushing_" + std::to_string(e.GetLineNum()), closure->kind, closure->axis, link1, X_W1, link2, X_W2);
}

void SdfReader::readBall(const XMLElement& e) {
  const std::string tag = getTag(e);
  const auto [link1, X_W1] = findDrakeFrame(e, tag + "_body_A");
  const auto [link2, X_W2] = findDrakeFrame(e, tag + "_body_B");
  addClosure("ball_" + std::to_string(e.GetLineNum()), ClosureKind::Ball3D, Vector3d::UnitZ(), link1,
             X_W1 * SE3(Matrix3d::Identity(), getVector(e, tag + "_p_AP")), link2,
             X_W2 * SE3(Matrix3d::Identity(), getVector(e, tag + "_p_BQ")));
}

}  // namespace bielle
