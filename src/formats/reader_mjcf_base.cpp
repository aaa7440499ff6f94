// A free base that a file makes of slides with a ball or hinges; and postures.
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "formats/reader_mjcf.h"
#include "math/so3.h"

namespace bielle {
namespace {

// w x y z. Its norm is that of a rotation, or zero or not finite.
double readQuaternion(const double* wxyz, Eigen::Quaterniond& rotation) {
  const Eigen::Vector4d xyzw(wxyz[1], wxyz[2], wxyz[3], wxyz[0]);
  const double norm = xyzw.stableNorm();
  if (norm > 1e-12 && std::isfinite(norm)) rotation = Eigen::Quaterniond(Eigen::Vector4d(xyzw / norm));
  return norm;
}

}  // namespace

// The free joint that three slides across each other and a ball, or three hinges across each other, make of a body on the
// world. Its placement is that of the body in the world.
bool MjcfReader::addBase(const MjcfElement& body, const std::vector<Element>& elements, const std::string& link,
                         const BodyPlace& parent, const SE3& X_WB) {
  constexpr double kAcross = 1e-6;  // cosine of the angle between axes
  std::string types;
  for (const Element& element : elements) {
    if (element.has_force || element.is_named || element.armature != elements.front().armature) return false;
    types += element.type + " ";
  }
  const bool has_ball = types == "slide slide slide ball ";
  if (!parent.is_static || (!has_ball && types != "slide slide slide hinge hinge hinge ")) return false;
  if (!has_ball && elements.front().armature != 0) return false;  // the axes of hinges turn against each other
  const auto isAcross = [&](size_t i, size_t j) { return std::abs(elements[i].axis.dot(elements[j].axis)) < kAcross; };
  if (!isAcross(0, 1) || !isAcross(1, 2) || !isAcross(0, 2)) return false;
  if (!has_ball && (!isAcross(3, 4) || !isAcross(4, 5))) return false;

  std::string name = "root_joint";
  for (int i = 2; !joint_names_.insert(name).second; ++i) name = "root_joint_" + std::to_string(i);
  body.note("its slides and " + std::string(has_ball ? "ball" : "hinges") + " are read as one free joint, '" + name +
            "'");
  for (const Element& element : elements)
    if (element.lower.size() > 0)
      settings_.notes.add(body.path(), "<joint>", element.line, "its range is left out, because the base is free");
  addLink(link, "world", JointKind::FreeFlyer, name, {});
  Slot slot;
  slot.joint = name;
  slot.kind = JointKind::FreeFlyer;
  slot.q_ref.resize(7);
  slot.q_ref << X_WB.p, Eigen::Quaterniond(X_WB.R).coeffs();
  slot.elements = elements;
  slot.X_WB = X_WB;
  slots_.push_back(slot);
  if (elements.front().armature != 0) yaml_.armature[name] = elements.front().armature;
  return true;
}

Eigen::Index MjcfReader::getSize(const Slot& slot) {
  if (slot.elements.empty()) return slot.q_ref.size();
  return slot.elements.size() == 4 ? 7 : 6;
}

// The coordinates of a joint at its numbers in qpos.
std::vector<double> MjcfReader::calcPosition(const Slot& slot, const MjcfElement& key, const double* qpos) {
  std::vector<double> q(qpos, qpos + getSize(slot));
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  const bool has_quaternion = slot.elements.empty() ? q.size() >= 4 : q.size() == 7;
  if (has_quaternion) {
    const double norm = readQuaternion(qpos + q.size() - 4, rotation);
    if (!(norm > 1e-12) || !std::isfinite(norm))
      key.fail("the quaternion of joint '" + slot.joint + "' has zero length", "correct it");
  }
  if (!slot.elements.empty()) {
    SE3 X = slot.X_WB;
    for (const Element& element : slot.elements) {
      const double moved = *qpos++ - element.ref;
      if (element.type == "slide")
        X = X * translate(moved * element.axis);
      else
        X = X * translate(element.pos) *
            SE3(element.type == "ball" ? rotation.toRotationMatrix() : makeAxisRotation(element.axis, moved),
                Vector3d::Zero()) *
            translate(-element.pos);
    }
    q.assign(7, 0);
    Eigen::Map<Vector3d>(q.data()) = X.p;
    rotation = Eigen::Quaterniond(X.R);
  } else if (has_quaternion) {
    rotation = Eigen::Quaterniond(slot.R_ref) * rotation;
  }
  if (has_quaternion || !slot.elements.empty())
    Eigen::Map<Eigen::Vector4d>(q.data() + q.size() - 4) = rotation.normalized().coeffs();
  return q;
}

void MjcfReader::readKey(const XMLElement& element) {
  if (getTag(element) != "key") return noteElement(element);
  MjcfElement e(element, "", settings_);
  std::string name = getAttribute(&element, "name");
  if (name.empty()) name = "key_" + std::to_string(yaml_.references.size() + 1);
  Eigen::Index nq = 0;
  for (const Slot& slot : slots_) nq += getSize(slot);
  if (!e.find("qpos")) return e.leaveOut("a key without qpos is left out");
  const std::vector<double> qpos = e.getNumbers("qpos", nq, nq);
  Reference reference;
  reference.name = name;
  const double* at = qpos.data();
  for (const Slot& slot : slots_) {
    reference.joints[slot.joint] = calcPosition(slot, e, at);
    at += getSize(slot);
  }
  yaml_.references.push_back(reference);
}

// MuJoCo closes loops where the bodies stand in the file: without a keyframe, this is the posture to start from.
void MjcfReader::addStart() {
  if (!yaml_.references.empty() || yaml_.closures.empty()) return;
  Reference reference;
  reference.name = "qpos0";
  for (const Slot& slot : slots_)
    reference.joints[slot.joint] = std::vector<double>(slot.q_ref.data(), slot.q_ref.data() + slot.q_ref.size());
  yaml_.references.push_back(reference);
}

}  // namespace bielle
