#include "formats/mjcf.h"

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <cmath>
#include <set>
#include <tuple>

#include "bielle/dynamics/assembly.h"
#include "bielle/formats/robot_writer.h"
#include "formats/format_warnings.h"
#include "formats/mjcf_coordinates.h"
#include "formats/reader_mjcf.h"
#include "formats/xml_document.h"
#include "math/decompositions.h"
#include "math/so3.h"
#include "model/joint.h"

namespace bielle {
namespace {

// MuJoCo refuses masses and moments of inertia of moving bodies up to 1e-15.
constexpr double kLeastInertia = 1e-14;

std::string formatMjcf(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value + 0.0).ptr};  // + 0.0: no negative zero
}

template <typename Vector>
std::string formatVector(const Vector& v) {
  std::string text;
  for (Eigen::Index i = 0; i < v.size(); ++i) text += (i ? " " : "") + formatMjcf(v[i]);
  return text;
}

std::string formatQuaternion(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return formatVector(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
}

XMLElement& addPlaced(XMLElement& parent, const char* tag, const SE3& X, XmlAttributes attributes) {
  XMLElement& element = addElement(parent, tag, attributes);
  setAttributes(element, {{"pos", formatVector(X.p)}, {"quat", formatQuaternion(X.R)}});
  return element;
}

class MjcfWriter {
 public:
  MjcfWriter(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options)
      : model_(model), q_ref_(q_ref), options_(options), children_(model.numBodies()) {
    for (int i = 1; i < model.numBodies(); ++i) children_[model.joints()[i].parent].push_back(i);
  }

  MjcfText write() {
    XMLDocument document;
    XMLElement& root = addElement(document, "mujoco", {{"model", model_.name()}});
    writeSettings(root);
    XMLElement& world = addElement(root, "worldbody");
    writeGround(world);
    writeShapes(0, world);
    for (int child : children_[0]) writeBody(child, world);
    writeTendons(addElement(root, "tendon"));
    writeClosures(addElement(root, "equality"));
    writeMotors(addElement(root, "actuator"));
    writeMotorData(addElement(root, "custom"));
    writeKeyframes(addElement(root, "keyframe"));
    for (const char* section : {"tendon", "equality", "actuator", "custom", "keyframe"})
      if (XMLElement* e = root.FirstChildElement(section); e->NoChildren()) root.DeleteChild(e);
    listOmissions();
    return {formatXml(document), warnings_.get()};
  }

 private:
  void setStiffness(XMLElement& e, const std::string& suffix, double time) const {
    const std::string impedance = formatMjcf(options_.impedance);
    setAttributes(e, {{("solref" + suffix).c_str(), formatMjcf(time) + " 1"},
                      {("solimp" + suffix).c_str(), impedance + " " + impedance + " 0.001 0.5 2"}});
  }

  void writeSettings(XMLElement& root) {
    addElement(root, "compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}});
    addElement(root, "option",
               {{"timestep", formatMjcf(options_.time_step)},
                {"gravity", formatVector(model_.gravity())},
                {"cone", "elliptic"},
                {"solver", "Newton"},
                {"jacobian", "sparse"},
                {"tolerance", "1e-10"}});
    XMLElement& defaults = addElement(root, "default");
    setStiffness(addElement(defaults, "joint"), "limit", options_.contact_time);
    setStiffness(addElement(defaults, "equality"), "", options_.closure_time);
    const auto addGeom = [&](const char* name, XmlAttributes attributes) -> XMLElement& {
      return addElement(addElement(defaults, "default", {{"class", name}}), "geom", attributes);
    };
    addGeom("drawn", {{"contype", "0"}, {"conaffinity", "0"}, {"group", "1"}});
    // For distances: no other geom has the bit that it asks for.
    addGeom("shape", {{"contype", "2"}, {"conaffinity", "0"}, {"group", "3"}});
    addGeom("ground", {{"contype", "0"}, {"conaffinity", "1"}, {"rgba", "0.8 0.8 0.8 1"}});
    XMLElement& sole = addGeom("sole", {{"type", "sphere"},
                                        {"contype", "1"},
                                        {"conaffinity", "0"},
                                        {"condim", "3"},
                                        {"priority", "1"},
                                        {"size", formatMjcf(options_.sole_radius)},
                                        {"friction", formatMjcf(options_.friction) + " 0 0"}});
    setStiffness(sole, "", options_.contact_time);
  }

  void writeGround(XMLElement& world) {
    if (model_.contacts().empty()) return;
    XMLElement& plane =
        addElement(world, "geom", {{"name", "ground"}, {"class", "ground"}, {"type", "plane"}, {"size", "0 0 1"}});
    if (options_.ground_height != 0) setAttributes(plane, {{"pos", "0 0 " + formatMjcf(options_.ground_height)}});
    for (int i = 0; i < options_.num_boxes; ++i)
      addElement(world, "geom",
                 {{"name", "box." + std::to_string(i + 1)}, {"class", "ground"}, {"type", "box"}, {"size", "1 1 1"}});
  }

  void writeBody(int i, XMLElement& parent) {
    const Joint& joint = model_.joints()[i];
    const SE3 X_PB = joint.X_PJ * calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq));
    XMLElement& body = addPlaced(parent, "body", X_PB, {{"name", model_.bodies()[i].name}});
    writeInertia(i, body);
    writeJoint(joint, body);
    writeShapes(i, body);
    for (int child : children_[i]) writeBody(child, body);
  }

  void writeInertia(int i, XMLElement& body) {
    const Inertia& inertia = model_.bodies()[i].inertia;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(inertia.I_com);
    Matrix3d R = principal.eigenvectors();
    if (R.determinant() < 0) R.col(0) = -R.col(0);
    Vector3d moments = principal.eigenvalues().cwiseMax(kLeastInertia);
    // MuJoCo allows no rounding in the triangle inequality.
    moments[0] = std::max(moments[0], moments[2] - moments[1]);
    while (moments[0] + moments[1] < moments[2]) moments[0] = std::nextafter(moments[0], 1e300);
    if (inertia.mass < kLeastInertia || moments[0] > principal.eigenvalues()[0] + 1e-9 * moments[2])
      warn("body '" + model_.bodies()[i].name + "'",
           "its inertia is not that of a body with mass; the smallest inertia that MuJoCo accepts is written");
    setAttributes(
        addPlaced(body, "inertial", {R, inertia.com}, {}),
        {{"mass", formatMjcf(std::max(inertia.mass, kLeastInertia))}, {"diaginertia", formatVector(moments)}});
  }

  // One hinge or slide; `k` counts the coordinates of the joint, `axis` is in the frame of the body at q_ref.
  void writeAxis(const Joint& joint, int k, const char* type, const std::string& suffix, const Vector3d& axis,
                 XMLElement& body) {
    const int dof = joint.idx_v + k;
    double lower = model_.lowerLimits()[dof], upper = model_.upperLimits()[dof];
    XMLElement& e = addElement(body, "joint",
                               {{"name", joint.name + suffix},
                                {"type", type},
                                {"axis", formatVector(axis)},
                                {"ref", formatMjcf(q_ref_[joint.idx_q + k])},
                                {"armature", formatMjcf(model_.armature()[dof])}});
    for (const JointForce& force : model_.jointForces())
      if (force.dof == dof) writeJointForce(joint, force, e);
    if (std::isfinite(lower) || std::isfinite(upper)) {
      constexpr double kFar = 1e10;  // for limits on one side; and a range must not be empty
      lower = std::max(lower, -kFar), upper = std::max(std::min(upper, kFar), lower + 1e-9);
      setAttributes(e, {{"limited", "true"}, {"range", formatMjcf(lower) + " " + formatMjcf(upper)}});
    }
  }

  // A preload moves the rest of the spring.
  void writeJointForce(const Joint& joint, const JointForce& force, XMLElement& e) {
    if (force.stiffness != 0)
      setAttributes(e, {{"stiffness", formatMjcf(force.stiffness)},
                        {"springref", formatMjcf(force.rest + force.preload / force.stiffness)}});
    else if (force.preload != 0)
      warn("joint '" + joint.name + "'", "its preload without a spring is left out");
    if (force.damping != 0) setAttributes(e, {{"damping", formatMjcf(force.damping)}});
    if (force.friction == 0) return;
    setAttributes(e, {{"frictionloss", formatMjcf(force.friction)}});
    warn("joint '" + joint.name + "'", "its friction becomes MuJoCo's, which sticks");
  }

  // All three rotations, from coordinate `k` of v on.
  void writeRotation(const Joint& joint, int k, XMLElement& body) {
    if (options_.rotations == MjcfRotations::Balls) return writeBall(joint, k, "ball", body);
    const double armature = model_.armature()[joint.idx_v + k];
    for (const auto& [suffix, axis] : {std::pair(".rx", "1 0 0"), {".ry", "0 1 0"}, {".rz", "0 0 1"}})
      addElement(
          body, "joint",
          {{"name", joint.name + suffix}, {"type", "hinge"}, {"axis", axis}, {"armature", formatMjcf(armature)}});
    if (armature != 0) warn("joint '" + joint.name + "'", "its armature acts on the rates of three hinges");
    reportLimits(joint, k);
  }

  void writeBall(const Joint& joint, int k, const char* type, XMLElement& body) {
    addElement(body, "joint",
               {{"type", type}, {"name", joint.name}, {"armature", formatMjcf(model_.armature()[joint.idx_v + k])}});
    reportLimits(joint, k);
  }

  void writeJoint(const Joint& joint, XMLElement& body) {
    const auto q = q_ref_.segment(joint.idx_q, joint.nq);
    switch (joint.kind) {
      case JointKind::Fixed:
        break;
      case JointKind::Revolute:
      case JointKind::Continuous:
        writeAxis(joint, 0, "hinge", "", joint.axis, body);
        break;
      case JointKind::Prismatic:
        writeAxis(joint, 0, "slide", "", joint.axis, body);
        break;
      case JointKind::Spherical:
        writeRotation(joint, 0, body);
        break;
      case JointKind::Universal:
        writeAxis(joint, 0, "hinge", ".angle1", makeAxisRotation(joint.axis2, -q[1]) * joint.axis, body);
        writeAxis(joint, 1, "hinge", ".angle2", joint.axis2, body);
        break;
      case JointKind::Planar: {
        const Matrix3d axes = makeAxisRotation(joint.axis, -q[2]) * makePlaneBasis(joint.axis);
        writeAxis(joint, 0, "slide", ".x", axes.col(0), body);
        writeAxis(joint, 1, "slide", ".y", axes.col(1), body);
        writeAxis(joint, 2, "hinge", ".angle", joint.axis, body);
        break;
      }
      case JointKind::FreeFlyer:
        writeFreeFlyer(joint, body);
        break;
    }
  }

  void writeFreeFlyer(const Joint& joint, XMLElement& body) {
    if (isMjcfFree(joint)) return writeBall(joint, 0, "free", body);
    const Matrix3d axes = calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq)).R.transpose();
    for (int k = 0; k < 3; ++k)
      writeAxis(joint, k, "slide", std::string(".") + static_cast<char>('x' + k), axes.col(k), body);
    writeRotation(joint, 3, body);
  }

  void writeShapes(int body, XMLElement& e) {
    for (const Visual& visual : model_.visuals()) {
      if (visual.body != body) continue;
      if (visual.shape == Visual::Shape::Mesh) {
        meshes_.insert(visual.mesh);
        continue;
      }
      const Vector3d& size = visual.size;
      const bool is_box = visual.shape == Visual::Shape::Box, is_sphere = visual.shape == Visual::Shape::Sphere;
      XMLElement& geom =
          addPlaced(e, "geom", visual.X_BV,
                    {{"class", "drawn"},
                     {"type", is_box      ? "box"
                              : is_sphere ? "sphere"
                                          : "cylinder"},
                     {"size", is_box ? formatVector(size / 2) : formatVector(Vector3d(size[0], size[1] / 2, 0))}});
      setAttributes(geom, {{"rgba", formatVector(visual.rgba)}});
    }
    for (const Shape& shape : model_.shapes())
      if (shape.body == body && !shape.fitted) writeShape(shape, e);
    for (const ContactFrame& contact : model_.contacts())
      if (contact.body == body) writeSole(contact, e);
    for (const Frame& frame : model_.frames())
      if (frame.body == body && frame.name != model_.bodies()[body].name) writeFrame(frame, e);
    writeSpringSites(body, e);
  }

  // A box with rounded edges is written as the box around it.
  void writeShape(const Shape& shape, XMLElement& e) {
    const bool is_sphere = shape.half.isZero(), is_capsule = !is_sphere && shape.half.head<2>().isZero();
    const Vector3d size = is_sphere || is_capsule ? Vector3d(shape.radius, shape.half.z(), 0)
                                                  : Vector3d(shape.half + Vector3d::Constant(shape.radius));
    addPlaced(e, "geom", shape.X_BS,
              {{"class", "shape"},
               {"type", is_sphere    ? "sphere"
                        : is_capsule ? "capsule"
                                     : "box"},
               {"size", formatVector(size)}});
  }

  // Contacts are sites of their names, too.
  void writeFrame(const Frame& frame, XMLElement& e) {
    const int contact = model_.findContact(frame.name);
    if (contact < 0) {
      setAttributes(addPlaced(e, "site", frame.X_BF, {{"name", frame.name}}), {{"size", "0.001"}, {"group", "4"}});
      return;
    }
    const ContactFrame& other = model_.contacts()[contact];
    if (other.body != frame.body || other.X_BF.p != frame.X_BF.p || other.X_BF.R != frame.X_BF.R)
      warn("frame '" + frame.name + "'", "it is left out: another contact has this name");
  }

  void writeSole(const ContactFrame& contact, XMLElement& e) {
    const int corners = contact.kind == ContactKind::Point3D ? 1 : contact.kind == ContactKind::Edge5D ? 2 : 4;
    for (int corner = 0; corner < corners; ++corner) {
      const Vector3d centre((corner < corners / 2 || corners == 1 ? 1 : -1) * contact.half_length,
                            (corner % 2 == 0 ? 1 : -1) * contact.half_width, options_.sole_radius);
      addElement(e, "geom",
                 {{"class", "sole"},
                  {"name", contact.name + "." + std::to_string(corner + 1)},
                  {"pos", formatVector(contact.X_BF.act(centre))}});
    }
    setAttributes(addPlaced(e, "site", contact.X_BF, {{"name", contact.name}}), {{"size", "0.001"}});
  }

  void writeClosures(XMLElement& section) {
    for (const Closure& closure : model_.closures()) {
      if (closure.kp != 0 || closure.kd != 0)
        warn("closure '" + closure.name + "'", "its gains kp and kd are replaced by a time constant");
      if (closure.kind == ClosureKind::Coupler) {
        writeCoupler(closure, section);
        continue;
      }
      const auto tie = [&](const char* tag, const std::string& suffix, const Vector3d& anchor) {
        addElement(section, tag,
                   {{"name", closure.name + suffix},
                    {"body1", model_.bodies()[closure.body1].name},
                    {"body2", model_.bodies()[closure.body2].name},
                    {"anchor", formatVector(anchor)}});
      };
      if (closure.kind == ClosureKind::Ball3D) {
        tie("connect", "", closure.X_B1.p);
      } else if (closure.kind == ClosureKind::Hinge5D) {
        tie("connect", ".1", closure.X_B1.act(options_.hinge_lever * closure.axis));
        tie("connect", ".2", closure.X_B1.act(-options_.hinge_lever * closure.axis));
      } else {
        tie("weld", "", closure.X_B2.p);
      }
    }
  }

  // An equality of joints ties two of them; the sum over more joints is the length of a fixed tendon. A spring between
  // points is a spatial one.
  void writeTendons(XMLElement& section) {
    for (const Closure& closure : model_.closures()) {
      if (closure.terms.size() <= 2) continue;
      XMLElement& tendon = addElement(section, "fixed", {{"name", closure.name}});
      for (const CouplerTerm& term : closure.terms)
        addElement(tendon, "joint",
                   {{"joint", model_.joints()[term.joint].name}, {"coef", formatMjcf(term.coefficient)}});
    }
    for (const PointSpring& spring : model_.pointSprings()) writePointSpring(spring, section);
  }

  // A preload moves the rest of the spring, which MuJoCo wants to be 0 or more.
  void writePointSpring(const PointSpring& spring, XMLElement& section) {
    XMLElement& tendon = addElement(section, "spatial", {{"name", spring.name}});
    if (spring.stiffness != 0) {
      const double rest = spring.rest - spring.preload / spring.stiffness;
      if (rest < 0)
        warn("point spring '" + spring.name + "'",
             "its length without tension would be negative: its preload is written as " +
                 formatMjcf(spring.stiffness * spring.rest) + " N");
      setAttributes(tendon,
                    {{"stiffness", formatMjcf(spring.stiffness)}, {"springlength", formatMjcf(std::max(rest, 0.0))}});
    } else if (spring.preload != 0) {
      warn("point spring '" + spring.name + "'", "its preload without a stiffness is left out");
    }
    if (spring.damping != 0) setAttributes(tendon, {{"damping", formatMjcf(spring.damping)}});
    for (const auto& [body, point, end] :
         {std::tuple{spring.body1, spring.point1, 1}, {spring.body2, spring.point2, 2}})
      addElement(tendon, "site", {{"site", findSite(spring, body, point, end)}});
  }

  // A frame of the model there, or one made for this end of the spring.
  std::string findSite(const PointSpring& spring, int body, const Vector3d& point, int end) const {
    for (const Frame& frame : model_.frames())
      if (frame.body == body && frame.X_BF.p == point && frame.name != model_.bodies()[body].name &&
          model_.findContact(frame.name) < 0)
        return frame.name;
    std::string name = spring.name + "." + std::to_string(end);
    while (model_.findFrame(name) >= 0 || model_.findContact(name) >= 0) name += "'";
    return name;
  }

  void writeSpringSites(int body, XMLElement& e) {
    for (const PointSpring& spring : model_.pointSprings())
      for (const auto& [owner, point, end] :
           {std::tuple{spring.body1, spring.point1, 1}, {spring.body2, spring.point2, 2}}) {
        const std::string name = findSite(spring, body, point, end);
        if (owner == body && model_.findFrame(name) < 0)
          addElement(e, "site", {{"name", name}, {"pos", formatVector(point)}, {"size", "0.001"}, {"group", "4"}});
      }
  }

  // MuJoCo's equalities act on differences from q_ref: the length of the tendon, or y = p0 + p1 x for joints 1 and 2.
  void writeCoupler(const Closure& closure, XMLElement& section) {
    double rest = closure.offset;  // of the differences
    for (const CouplerTerm& term : closure.terms) rest -= term.coefficient * q_ref_[term.idx_q];
    if (closure.terms.size() > 2) {
      addElement(section, "tendon",
                 {{"name", closure.name}, {"tendon1", closure.name}, {"polycoef", formatMjcf(rest) + " 0 0 0 0"}});
      return;
    }
    const CouplerTerm &y = closure.terms[0], &x = closure.terms[1];
    addElement(
        section, "joint",
        {{"name", closure.name},
         {"joint1", model_.joints()[y.joint].name},
         {"joint2", model_.joints()[x.joint].name},
         {"polycoef", formatMjcf(rest / y.coefficient) + " " + formatMjcf(-x.coefficient / y.coefficient) + " 0 0 0"}});
  }

  void writeMotors(XMLElement& section) {
    for (const Motor& motor : model_.motors()) {
      XMLElement& e = addElement(section, "motor", {{"name", motor.name}, {"joint", motor.name}, {"gear", "1"}});
      if (std::isfinite(motor.effort_limit))
        setAttributes(e, {{"ctrllimited", "true"},
                          {"ctrlrange", formatMjcf(-motor.effort_limit) + " " + formatMjcf(motor.effort_limit)}});
    }
  }

  // Windings, gears, losses and limits of speed are what our YAML file says of them, as text that MuJoCo keeps and does not use.
  void writeMotorData(XMLElement& section) {
    for (const Motor& motor : model_.motors()) {
      YAML::Emitter data;
      data << YAML::Flow << YAML::BeginMap;
      for (const auto& [key, value] : getMotorData(motor)) data << YAML::Key << key << YAML::Value << value;
      if (std::isfinite(model_.velocityLimits()[motor.dof]))
        data << YAML::Key << "velocity" << YAML::Value << formatMjcf(model_.velocityLimits()[motor.dof]);
      data << YAML::EndMap;
      const std::string map = data.c_str();
      if (map != "{}")
        addElement(section, "text", {{"name", kMjcfMotorData + motor.name}, {"data", map.substr(1, map.size() - 2)}});
    }
  }

  // Where hinges in place of a ball come near to locking in a reference.
  void reportLocks(const Reference& reference, const VectorXd& q) {
    if (options_.rotations == MjcfRotations::Balls) return;
    const VectorXd margins = calcHingeMargins(model_, q_ref_, q);
    for (int i = 1; i < model_.numBodies(); ++i)
      if (margins[i] < kLeastHingeMargin)
        warn("joint '" + model_.joints()[i].name + "'", "its hinges nearly lock in reference '" + reference.name + "'");
  }

  void writeKeyframes(XMLElement& section) {
    for (const Reference& reference : model_.references()) {
      const AssemblyResult result = assembleReference(model_, reference.name);
      if (result.status != NumericalStatus::Ok) {
        warn("reference '" + reference.name + "'", "it does not close and is left out: " + result.message);
        continue;
      }
      reportLocks(reference, result.q);
      addElement(section, "key",
                 {{"name", reference.name},
                  {"qpos", formatVector(calcMjcfQpos(model_, q_ref_, result.q, options_.rotations))}});
    }
  }

  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

  void reportLimits(const Joint& joint, int first) {
    for (int k = joint.idx_v + first; k < joint.idx_v + joint.nv; ++k)
      if (std::isfinite(model_.lowerLimits()[k]) || std::isfinite(model_.upperLimits()[k])) {
        warn("joint '" + joint.name + "'", "the limits of its coordinates are left out");
        return;
      }
  }

  void listOmissions() {
    std::string speeds, meshes;
    for (const Joint& joint : model_.joints()) {
      const auto limits = model_.velocityLimits().segment(joint.idx_v, joint.nv);
      if ((limits.array() < std::numeric_limits<double>::infinity()).any() && model_.findMotor(joint.name) < 0)
        speeds += (speeds.empty() ? "'" : ", '") + joint.name + "'";
      if ((joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer) &&
          model_.armature()[joint.idx_v] != 0)
        warn("joint '" + joint.name + "'", "its armature acts on accelerations in the frame of its parent");
    }
    for (const Reference& reference : model_.references())
      if (!reference.height_frame.empty() || !reference.feet.empty())
        warn("reference '" + reference.name + "'", "only its assembled posture is written, as a keyframe");
    warnings_.addYamlOnly(MotorData::All);
    if (!speeds.empty()) warn("joints " + speeds, "their speed limits are left out");
    for (const std::string& mesh : meshes_) meshes += (meshes.empty() ? "'" : ", '") + mesh + "'";
    if (!meshes.empty()) warn("meshes " + meshes, "they are left out");
  }

  const Model& model_;
  const VectorXd q_ref_;
  const MjcfOptions& options_;
  std::vector<std::vector<int>> children_;
  std::set<std::string> meshes_;
  FormatWarnings warnings_{model_};
};

}  // namespace

MjcfText formatMjcf(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options) {
  return MjcfWriter(model, q_ref, options).write();
}

}  // namespace bielle
