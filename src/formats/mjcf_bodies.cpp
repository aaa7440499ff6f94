#include "formats/mjcf_bodies.h"

#include <charconv>
#include <cmath>
#include <vector>

#include "formats/robot_text.h"
#include "math/decompositions.h"
#include "math/settled.h"
#include "math/so3.h"
#include "model/joint.h"

namespace bielle {

std::string formatMjcf(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value + 0.0).ptr};  // + 0.0: no negative zero
}

std::string formatMjcf(ConstVectorRef values) {
  std::string text;
  for (Eigen::Index i = 0; i < values.size(); ++i) text += (i ? " " : "") + formatMjcf(values[i]);
  return text;
}

namespace {

std::string findSite(const Model& model, const std::string& tendon, int end, int body, const Vector3d& point) {
  for (const Frame& frame : model.frames())
    if (frame.body == body && frame.X_BF.p == point && frame.name != model.bodies()[body].name &&
        model.findContact(frame.name) < 0)
      return frame.name;
  std::string name = tendon + "." + std::to_string(end);
  while (model.findFrame(name) >= 0 || model.findContact(name) >= 0) name += "'";
  return name;
}

template <typename Tendon>
std::array<TendonEnd, 2> makeEnds(const Model& model, const Tendon& tendon, const Vector3d& point1,
                                  const Vector3d& point2) {
  return {{{findSite(model, tendon.name, 1, tendon.body1, point1), tendon.body1, point1},
           {findSite(model, tendon.name, 2, tendon.body2, point2), tendon.body2, point2}}};
}

}  // namespace

std::array<TendonEnd, 2> findTendonEnds(const Model& model, const PointSpring& spring) {
  return makeEnds(model, spring, spring.point1, spring.point2);
}

std::array<TendonEnd, 2> findTendonEnds(const Model& model, const Closure& distance) {
  return makeEnds(model, distance, distance.X_B1.p, distance.X_B2.p);
}

namespace {

constexpr double kLeastHalf = 1e-4;  // of a sole: MuJoCo refuses boxes without length or width, m
// MuJoCo refuses masses and moments of inertia of moving bodies up to 1e-15.
constexpr double kLeastInertia = 1e-14;

XMLElement& addPlaced(XMLElement& parent, const char* tag, const SE3& X, XmlAttributes attributes) {
  XMLElement& element = addElement(parent, tag, attributes);
  const Eigen::Quaterniond q(settleRotation(X.R));
  setAttributes(element, {{"pos", formatMjcf(X.p)}, {"quat", formatMjcf(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()))}});
  return element;
}

class BodyWriter {
 public:
  BodyWriter(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options, FormatWarnings& warnings)
      : model_(model), q_ref_(q_ref), options_(options), warnings_(warnings), children_(model.numBodies()) {
    for (int i = 1; i < model.numBodies(); ++i) children_[model.joints()[i].parent].push_back(i);
  }

  std::set<std::string> write(XMLElement& world) {
    writeShapes(0, world);
    for (int child : children_[0]) writeBody(child, world);
    return meshes_;
  }

 private:
  void writeBody(int i, XMLElement& parent) {
    const Joint& joint = model_.joints()[i];
    SE3 X_PB = joint.X_PJ * calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq));
    if (X_PB.p != joint.X_PJ.p && !isMjcfFree(joint)) X_PB.p = settlePoint(X_PB.p, X_PB.p.norm() + joint.X_PJ.p.norm());
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
    setAttributes(addPlaced(body, "inertial", {R, inertia.com}, {}),
                  {{"mass", formatMjcf(std::max(inertia.mass, kLeastInertia))}, {"diaginertia", formatMjcf(moments)}});
  }

  // One hinge or slide; `k` counts the coordinates of the joint, `axis` is in the frame of the body at q_ref.
  void writeAxis(const Joint& joint, int k, const char* type, const std::string& suffix, const Vector3d& axis,
                 XMLElement& body) {
    const int dof = joint.idx_v + k;
    double lower = model_.lowerLimits()[dof], upper = model_.upperLimits()[dof];
    XMLElement& e = addElement(body, "joint",
                               {{"name", joint.name + suffix},
                                {"type", type},
                                {"axis", formatMjcf(axis)},
                                {"ref", formatMjcf(q_ref_[joint.idx_q + k])},
                                {"armature", formatMjcf(model_.armature()[dof])}});
    for (const WholeJointForce& whole : joinJointForces(model_))
      if (whole.force.dof == dof) writeJointForce(joint, whole, e);
    if (std::isfinite(lower) || std::isfinite(upper)) {
      constexpr double kFar = 1e10;  // for limits on one side; and a range must not be empty
      lower = std::max(lower, -kFar), upper = std::max(std::min(upper, kFar), lower + 1e-9);
      setAttributes(e, {{"limited", "true"}, {"range", formatMjcf(lower) + " " + formatMjcf(upper)}});
    }
  }

  // A preload moves the rest of the spring.
  void writeJointForce(const Joint& joint, const WholeJointForce& whole, XMLElement& e) {
    const JointForce& force = whole.force;
    if (whole.sticks()) warn("joint '" + joint.name + "'", kStictionLost);
    const double stiffness = force.stiffness == 0 && force.preload != 0 ? kMjcfPreloadStiffness : force.stiffness;
    if (stiffness != 0)
      setAttributes(
          e, {{"stiffness", formatMjcf(stiffness)}, {"springref", formatMjcf(force.rest + force.preload / stiffness)}});
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
        writeAxis(joint, 0, "hinge", ".angle1",
                  q[1] == 0 ? joint.axis : settleDirection(makeAxisRotation(joint.axis2, -q[1]) * joint.axis), body);
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
    const Matrix3d axes =
        settleRotation(calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq)).R).transpose();
    for (int k = 0; k < 3; ++k)
      writeAxis(joint, k, "slide", std::string(".") + static_cast<char>('x' + k), axes.col(k), body);
    writeRotation(joint, 3, body);
  }

  void writeShapes(int body, XMLElement& e) {
    for (const Visual* part : visuals_[body]) {
      const Visual& visual = *part;
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
                     {"size", is_box ? formatMjcf(size / 2) : formatMjcf(Vector3d(size[0], size[1] / 2, 0))}});
      setAttributes(geom, {{"rgba", formatMjcf(visual.rgba)}});
    }
    for (const Shape* shape : shapes_[body])
      if (!shape->fitted) writeShape(*shape, e);
    for (const ContactFrame& contact : model_.contacts())
      if (contact.body == body) writeSole(contact, e);
    for (const Frame* frame : frames_[body])
      if (frame->name != model_.bodies()[body].name) writeFrame(*frame, e);
    writeTendonSites(body, e);
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
               {"size", formatMjcf(size)}});
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

  // Where the ground ends under a box or a capsule, MuJoCo's contacts lie on its edge; spheres at the corners would fall past it.
  void writeSole(const ContactFrame& contact, XMLElement& e) {
    const double radius = options_.sole_radius, length = contact.half_length;
    const auto getCentre = [&](double x) { return contact.X_BF.act(Vector3d(x, 0, radius)); };
    XmlAttributes shape = {{"class", "sole"}, {"name", contact.name + ".1"}};
    if (contact.kind == ContactKind::Surface6D) {
      const Vector3d size(std::max(length, kLeastHalf), std::max(contact.half_width, kLeastHalf), radius);
      setAttributes(addPlaced(e, "geom", {contact.X_BF.R, getCentre(0)}, shape),
                    {{"type", "box"}, {"size", formatMjcf(size)}});
    } else if (contact.kind == ContactKind::Edge5D) {
      setAttributes(addElement(e, "geom", shape),
                    {{"type", "capsule"},
                     {"size", formatMjcf(radius)},
                     {"fromto", formatMjcf(getCentre(-length)) + " " + formatMjcf(getCentre(length))}});
    } else {
      setAttributes(addElement(e, "geom", shape),
                    {{"type", "sphere"}, {"size", formatMjcf(radius)}, {"pos", formatMjcf(getCentre(0))}});
    }
    setAttributes(addPlaced(e, "site", contact.X_BF, {{"name", contact.name}}), {{"size", "0.001"}});
  }

  void writeTendonSites(int body, XMLElement& e) {
    const auto write = [&](const std::array<TendonEnd, 2>& ends) {
      for (const TendonEnd& end : ends)
        if (end.body == body && model_.findFrame(end.site) < 0)
          addElement(e, "site",
                     {{"name", end.site}, {"pos", formatMjcf(end.point)}, {"size", "0.001"}, {"group", "4"}});
    };
    for (const Closure& closure : model_.closures())
      if (closure.kind == ClosureKind::Distance) write(findTendonEnds(model_, closure));
    for (const PointSpring& spring : model_.pointSprings()) write(findTendonEnds(model_, spring));
  }

  void reportLimits(const Joint& joint, int first) {
    for (int k = joint.idx_v + first; k < joint.idx_v + joint.nv; ++k)
      if (std::isfinite(model_.lowerLimits()[k]) || std::isfinite(model_.upperLimits()[k])) {
        warn("joint '" + joint.name + "'", "the limits of its coordinates are left out");
        return;
      }
  }

  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

  const Model& model_;
  const std::vector<std::vector<const Visual*>> visuals_ = sortByBody(model_, model_.visuals());
  const std::vector<std::vector<const Shape*>> shapes_ = sortByBody(model_, model_.shapes());
  const std::vector<std::vector<const Frame*>> frames_ = sortByBody(model_, model_.frames());
  const ConstVectorRef q_ref_;
  const MjcfOptions& options_;
  FormatWarnings& warnings_;
  std::vector<std::vector<int>> children_;
  std::set<std::string> meshes_;
};

}  // namespace

std::set<std::string> writeMjcfBodies(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options,
                                      FormatWarnings& warnings, XMLElement& world) {
  return BodyWriter(model, q_ref, options, warnings).write(world);
}

}  // namespace bielle
