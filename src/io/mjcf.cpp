#include "io/mjcf.h"

#include <charconv>
#include <cmath>
#include <set>
#include <sstream>
#include <tuple>

#include "bielle/dynamics/assembly.h"
#include "bielle/io/robot_writer.h"
#include "io/format_warnings.h"
#include "io/mjcf_coordinates.h"
#include "io/xml_text.h"
#include "math/decompositions.h"
#include "math/so3.h"
#include "model/joint.h"
#include "model/reader_mjcf.h"

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

std::string attribute(const std::string& name, const std::string& value) {
  return " " + name + "=\"" + escapeXml(value) + "\"";
}

std::string formatPlacement(const SE3& X) {
  return attribute("pos", formatVector(X.p)) + attribute("quat", formatQuaternion(X.R));
}

class MjcfWriter {
 public:
  MjcfWriter(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options)
      : model_(model), q_ref_(q_ref), options_(options), children_(model.numBodies()) {
    for (int i = 1; i < model.numBodies(); ++i) children_[model.joints()[i].parent].push_back(i);
  }

  MjcfText write() {
    out_ << "<mujoco" << attribute("model", model_.name()) << ">\n";
    writeSettings();
    out_ << "  <worldbody>\n";
    if (!options_.ground.empty())
      out_ << options_.ground;
    else if (!model_.contacts().empty())
      out_ << "    <geom name=\"ground\" class=\"ground\" type=\"plane\" size=\"0 0 1\"/>\n";
    writeShapes(0, "    ");
    for (int child : children_[0]) writeBody(child, "    ");
    out_ << "  </worldbody>\n";
    writeTendons();
    writeClosures();
    writeMotors();
    writeMotorData();
    writeKeyframes();
    out_ << "</mujoco>\n";
    listOmissions();
    return {out_.str(), warnings_.get()};
  }

 private:
  std::string formatStiffness(const std::string& suffix, double time) const {
    return attribute("solref" + suffix, formatMjcf(time) + " 1") +
           attribute("solimp" + suffix,
                     formatMjcf(options_.impedance) + " " + formatMjcf(options_.impedance) + " 0.001 0.5 2");
  }

  void writeSettings() {
    out_
        << "  <compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n  <option"
        << attribute("timestep", formatMjcf(options_.time_step)) << attribute("gravity", formatVector(model_.gravity()))
        << " cone=\"elliptic\" solver=\"Newton\" jacobian=\"sparse\" tolerance=\"1e-10\"/>\n  <default>\n    <joint"
        << formatStiffness("limit", options_.contact_time) << "/>\n    <equality"
        << formatStiffness("", options_.closure_time)
        << "/>\n    <default class=\"drawn\">\n      <geom contype=\"0\" conaffinity=\"0\" group=\"1\"/>\n"
        << "    </default>\n    <default class=\"shape\">\n"  // for distances: no other geom has the bit that it asks for
        << "      <geom contype=\"2\" conaffinity=\"0\" group=\"3\"/>\n"
        << "    </default>\n    <default class=\"ground\">\n"
        << "      <geom contype=\"0\" conaffinity=\"1\" rgba=\"0.8 0.8 0.8 1\"/>\n    </default>\n"
        << "    <default class=\"sole\">\n      <geom type=\"sphere\" contype=\"1\" conaffinity=\"0\" condim=\"3\" "
        << "priority=\"1\"" << attribute("size", formatMjcf(options_.sole_radius))
        << attribute("friction", formatMjcf(options_.friction) + " 0 0") << formatStiffness("", options_.contact_time)
        << "/>\n    </default>\n  </default>\n";
  }

  void writeBody(int i, const std::string& indent) {
    const Joint& joint = model_.joints()[i];
    order_.push_back(i);
    const SE3 X_PB = joint.X_PJ * calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq));
    out_ << indent << "<body" << attribute("name", model_.bodies()[i].name) << formatPlacement(X_PB) << ">\n";
    const std::string inner = indent + "  ";
    writeInertia(i, inner);
    writeJoint(joint, inner);
    writeShapes(i, inner);
    for (int child : children_[i]) writeBody(child, inner);
    out_ << indent << "</body>\n";
  }

  void writeInertia(int i, const std::string& indent) {
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
    out_ << indent << "<inertial" << formatPlacement({R, inertia.com})
         << attribute("mass", formatMjcf(std::max(inertia.mass, kLeastInertia)))
         << attribute("diaginertia", formatVector(moments)) << "/>\n";
  }

  // One hinge or slide; `k` counts the coordinates of the joint, `axis` is in the frame of the body at q_ref.
  void writeAxis(const Joint& joint, int k, const char* type, const std::string& suffix, const Vector3d& axis,
                 const std::string& indent) {
    const int dof = joint.idx_v + k;
    double lower = model_.lowerLimits()[dof], upper = model_.upperLimits()[dof];
    out_ << indent << "<joint" << attribute("name", joint.name + suffix) << attribute("type", type)
         << attribute("axis", formatVector(axis)) << attribute("ref", formatMjcf(q_ref_[joint.idx_q + k]))
         << attribute("armature", formatMjcf(model_.armature()[dof]));
    for (const JointForce& force : model_.jointForces())
      if (force.dof == dof) writeJointForce(joint, force);
    if (std::isfinite(lower) || std::isfinite(upper)) {
      constexpr double kFar = 1e10;  // for limits on one side; and a range must not be empty
      lower = std::max(lower, -kFar), upper = std::max(std::min(upper, kFar), lower + 1e-9);
      out_ << " limited=\"true\"" << attribute("range", formatMjcf(lower) + " " + formatMjcf(upper));
    }
    out_ << "/>\n";
  }

  // A preload moves the rest of the spring.
  void writeJointForce(const Joint& joint, const JointForce& force) {
    if (force.stiffness != 0)
      out_ << attribute("stiffness", formatMjcf(force.stiffness))
           << attribute("springref", formatMjcf(force.rest + force.preload / force.stiffness));
    else if (force.preload != 0)
      warn("joint '" + joint.name + "'", "its preload without a spring is left out");
    if (force.damping != 0) out_ << attribute("damping", formatMjcf(force.damping));
    if (force.friction == 0) return;
    out_ << attribute("frictionloss", formatMjcf(force.friction));
    warn("joint '" + joint.name + "'", "its friction becomes MuJoCo's, which sticks");
  }

  void writeBall(const Joint& joint, int k, const std::string& indent) {
    out_ << indent << "<joint type=\"ball\"" << attribute("name", joint.name)
         << attribute("armature", formatMjcf(model_.armature()[joint.idx_v + k])) << "/>\n";
    reportLimits(joint, k);
  }

  void writeJoint(const Joint& joint, const std::string& indent) {
    const auto q = q_ref_.segment(joint.idx_q, joint.nq);
    switch (joint.kind) {
      case JointKind::Fixed:
        break;
      case JointKind::Revolute:
      case JointKind::Continuous:
        writeAxis(joint, 0, "hinge", "", joint.axis, indent);
        break;
      case JointKind::Prismatic:
        writeAxis(joint, 0, "slide", "", joint.axis, indent);
        break;
      case JointKind::Spherical:
        writeBall(joint, 0, indent);
        break;
      case JointKind::Universal:
        writeAxis(joint, 0, "hinge", ".angle1", makeAxisRotation(joint.axis2, -q[1]) * joint.axis, indent);
        writeAxis(joint, 1, "hinge", ".angle2", joint.axis2, indent);
        break;
      case JointKind::Planar: {
        const Matrix3d axes = makeAxisRotation(joint.axis, -q[2]) * makePlaneBasis(joint.axis);
        writeAxis(joint, 0, "slide", ".x", axes.col(0), indent);
        writeAxis(joint, 1, "slide", ".y", axes.col(1), indent);
        writeAxis(joint, 2, "hinge", ".angle", joint.axis, indent);
        break;
      }
      case JointKind::FreeFlyer:
        writeFreeFlyer(joint, indent);
        break;
    }
  }

  void writeFreeFlyer(const Joint& joint, const std::string& indent) {
    if (isMjcfFree(joint)) {
      out_ << indent << "<joint type=\"free\"" << attribute("name", joint.name)
           << attribute("armature", formatMjcf(model_.armature()[joint.idx_v])) << "/>\n";
      reportLimits(joint, 0);
      return;
    }
    const Matrix3d axes = calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq)).R.transpose();
    for (int k = 0; k < 3; ++k)
      writeAxis(joint, k, "slide", std::string(".") + static_cast<char>('x' + k), axes.col(k), indent);
    writeBall(joint, 3, indent);
  }

  void writeShapes(int body, const std::string& indent) {
    for (const Visual& visual : model_.visuals()) {
      if (visual.body != body) continue;
      if (visual.shape == Visual::Shape::Mesh) {
        meshes_.insert(visual.mesh);
        continue;
      }
      const Vector3d& size = visual.size;
      const bool is_box = visual.shape == Visual::Shape::Box, is_sphere = visual.shape == Visual::Shape::Sphere;
      out_ << indent << "<geom class=\"drawn\""
           << attribute("type", is_box      ? "box"
                                : is_sphere ? "sphere"
                                            : "cylinder")
           << attribute("size", is_box ? formatVector(size / 2) : formatVector(Vector3d(size[0], size[1] / 2, 0)))
           << formatPlacement(visual.X_BV) << attribute("rgba", formatVector(visual.rgba)) << "/>\n";
    }
    for (const Shape& shape : model_.shapes())
      if (shape.body == body && !shape.fitted) writeShape(shape, indent);
    for (const ContactFrame& contact : model_.contacts())
      if (contact.body == body) writeSole(contact, indent);
    for (const Frame& frame : model_.frames())
      if (frame.body == body && frame.name != model_.bodies()[body].name) writeFrame(frame, indent);
    writeSpringSites(body, indent);
  }

  // A box with rounded edges is written as the box around it.
  void writeShape(const Shape& shape, const std::string& indent) {
    const bool is_sphere = shape.half.isZero(), is_capsule = !is_sphere && shape.half.head<2>().isZero();
    const Vector3d size = is_sphere || is_capsule ? Vector3d(shape.radius, shape.half.z(), 0)
                                                  : Vector3d(shape.half + Vector3d::Constant(shape.radius));
    out_ << indent << "<geom class=\"shape\""
         << attribute("type", is_sphere    ? "sphere"
                              : is_capsule ? "capsule"
                                           : "box")
         << attribute("size", formatVector(size)) << formatPlacement(shape.X_BS) << "/>\n";
  }

  // Contacts are sites of their names, too.
  void writeFrame(const Frame& frame, const std::string& indent) {
    const int contact = model_.findContact(frame.name);
    if (contact < 0) {
      out_ << indent << "<site" << attribute("name", frame.name) << formatPlacement(frame.X_BF)
           << " size=\"0.001\" group=\"4\"/>\n";
      return;
    }
    const ContactFrame& other = model_.contacts()[contact];
    if (other.body != frame.body || other.X_BF.p != frame.X_BF.p || other.X_BF.R != frame.X_BF.R)
      warn("frame '" + frame.name + "'", "it is left out: another contact has this name");
  }

  void writeSole(const ContactFrame& contact, const std::string& indent) {
    const bool is_point = contact.kind == ContactKind::Point3D;
    for (int corner = 0; corner < (is_point ? 1 : 4); ++corner) {
      const Vector3d centre((corner < 2 ? 1 : -1) * contact.half_length,
                            (corner % 2 == 0 ? 1 : -1) * contact.half_width, options_.sole_radius);
      out_ << indent << "<geom class=\"sole\"" << attribute("name", contact.name + "." + std::to_string(corner + 1))
           << attribute("pos", formatVector(contact.X_BF.act(centre))) << "/>\n";
    }
    out_ << indent << "<site" << attribute("name", contact.name) << formatPlacement(contact.X_BF)
         << " size=\"0.001\"/>\n";
  }

  void writeClosures() {
    if (model_.closures().empty()) return;
    out_ << "  <equality>\n";
    for (const Closure& closure : model_.closures()) {
      if (closure.kp != 0 || closure.kd != 0)
        warn("closure '" + closure.name + "'", "its gains kp and kd are replaced by a time constant");
      if (closure.kind == ClosureKind::Coupler) {
        writeCoupler(closure);
        continue;
      }
      const std::string bodies = attribute("body1", model_.bodies()[closure.body1].name) +
                                 attribute("body2", model_.bodies()[closure.body2].name);
      const auto connect = [&](const std::string& suffix, const Vector3d& point) {
        out_ << "    <connect" << attribute("name", closure.name + suffix) << bodies
             << attribute("anchor", formatVector(closure.X_B1.act(point))) << "/>\n";
      };
      if (closure.kind == ClosureKind::Ball3D) {
        connect("", Vector3d::Zero());
      } else if (closure.kind == ClosureKind::Hinge5D) {
        connect(".1", options_.hinge_lever * closure.axis);
        connect(".2", -options_.hinge_lever * closure.axis);
      } else {
        out_ << "    <weld" << attribute("name", closure.name) << bodies
             << attribute("anchor", formatVector(closure.X_B2.p)) << "/>\n";
      }
    }
    out_ << "  </equality>\n";
  }

  // An equality of joints ties two of them; the sum over more joints is the length of a fixed tendon. A spring between
  // points is a spatial one.
  void writeTendons() {
    std::ostringstream tendons;
    for (const Closure& closure : model_.closures()) {
      if (closure.terms.size() <= 2) continue;
      tendons << "    <fixed" << attribute("name", closure.name) << ">\n";
      for (const CouplerTerm& term : closure.terms)
        tendons << "      <joint" << attribute("joint", model_.joints()[term.joint].name)
                << attribute("coef", formatMjcf(term.coefficient)) << "/>\n";
      tendons << "    </fixed>\n";
    }
    for (const PointSpring& spring : model_.pointSprings()) writePointSpring(spring, tendons);
    if (!tendons.str().empty()) out_ << "  <tendon>\n" << tendons.str() << "  </tendon>\n";
  }

  // A preload moves the rest of the spring, which MuJoCo wants to be 0 or more.
  void writePointSpring(const PointSpring& spring, std::ostream& out) {
    out << "    <spatial" << attribute("name", spring.name);
    if (spring.stiffness != 0) {
      const double rest = spring.rest - spring.preload / spring.stiffness;
      if (rest < 0)
        warn("point spring '" + spring.name + "'",
             "its length without tension would be negative: its preload is written as " +
                 formatMjcf(spring.stiffness * spring.rest) + " N");
      out << attribute("stiffness", formatMjcf(spring.stiffness))
          << attribute("springlength", formatMjcf(std::max(rest, 0.0)));
    } else if (spring.preload != 0) {
      warn("point spring '" + spring.name + "'", "its preload without a stiffness is left out");
    }
    if (spring.damping != 0) out << attribute("damping", formatMjcf(spring.damping));
    out << ">\n";
    for (const auto& [body, point, end] :
         {std::tuple{spring.body1, spring.point1, 1}, {spring.body2, spring.point2, 2}})
      out << "      <site" << attribute("site", findSite(spring, body, point, end)) << "/>\n";
    out << "    </spatial>\n";
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

  void writeSpringSites(int body, const std::string& indent) {
    for (const PointSpring& spring : model_.pointSprings())
      for (const auto& [owner, point, end] :
           {std::tuple{spring.body1, spring.point1, 1}, {spring.body2, spring.point2, 2}}) {
        const std::string name = findSite(spring, body, point, end);
        if (owner == body && model_.findFrame(name) < 0)
          out_ << indent << "<site" << attribute("name", name) << attribute("pos", formatVector(point))
               << " size=\"0.001\" group=\"4\"/>\n";
      }
  }

  // MuJoCo's equalities act on differences from q_ref: the length of the tendon, or y = p0 + p1 x for joints 1 and 2.
  void writeCoupler(const Closure& closure) {
    double rest = closure.offset;  // of the differences
    for (const CouplerTerm& term : closure.terms) rest -= term.coefficient * q_ref_[term.idx_q];
    if (closure.terms.size() > 2) {
      out_ << "    <tendon" << attribute("name", closure.name) << attribute("tendon1", closure.name)
           << attribute("polycoef", formatMjcf(rest) + " 0 0 0 0") << "/>\n";
      return;
    }
    const CouplerTerm &y = closure.terms[0], &x = closure.terms[1];
    out_ << "    <joint" << attribute("name", closure.name) << attribute("joint1", model_.joints()[y.joint].name)
         << attribute("joint2", model_.joints()[x.joint].name)
         << attribute("polycoef",
                      formatMjcf(rest / y.coefficient) + " " + formatMjcf(-x.coefficient / y.coefficient) + " 0 0 0")
         << "/>\n";
  }

  void writeMotors() {
    if (model_.motors().empty()) return;
    out_ << "  <actuator>\n";
    for (const Motor& motor : model_.motors()) {
      out_ << "    <motor" << attribute("name", motor.name) << attribute("joint", motor.name) << " gear=\"1\"";
      if (std::isfinite(motor.effort_limit))
        out_ << " ctrllimited=\"true\""
             << attribute("ctrlrange", formatMjcf(-motor.effort_limit) + " " + formatMjcf(motor.effort_limit));
      out_ << "/>\n";
    }
    out_ << "  </actuator>\n";
  }

  // Windings, gears, losses and limits of speed are what our YAML file says of them, as text that MuJoCo keeps and does not use.
  void writeMotorData() {
    std::string texts;
    for (const Motor& motor : model_.motors()) {
      std::string data = formatMotorData(motor);
      if (std::isfinite(model_.velocityLimits()[motor.dof]))
        data += ", velocity: " + formatMjcf(model_.velocityLimits()[motor.dof]);
      if (!data.empty())
        texts +=
            "    <text" + attribute("name", kMjcfMotorData + motor.name) + attribute("data", data.substr(2)) + "/>\n";
    }
    if (!texts.empty()) out_ << "  <custom>\n" << texts << "  </custom>\n";
  }

  void writeKeyframes() {
    if (model_.references().empty()) return;
    out_ << "  <keyframe>\n";
    for (const Reference& reference : model_.references()) {
      const AssemblyResult result = assembleReference(model_, reference.name);
      if (result.status == AssemblyStatus::Closed)
        out_ << "    <key" << attribute("name", reference.name) << attribute("qpos", formatKeyframe(result.q))
             << "/>\n";
      else
        warn("reference '" + reference.name + "'", "it does not close and is left out: " + result.message);
    }
    out_ << "  </keyframe>\n";
  }

  std::string formatKeyframe(const VectorXd& q) const {
    std::string text;
    for (int i : order_) {
      const Joint& joint = model_.joints()[i];
      VectorXd qpos(joint.nq);
      calcMjcfPosition(joint, q_ref_.segment(joint.idx_q, joint.nq), q.segment(joint.idx_q, joint.nq), qpos);
      text += (text.empty() ? "" : " ") + formatVector(qpos);
    }
    return text;
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
  std::vector<int> order_;  // bodies as written
  std::ostringstream out_;
  std::set<std::string> meshes_;
  FormatWarnings warnings_{model_};
};

}  // namespace

MjcfText formatMjcf(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options) {
  return MjcfWriter(model, q_ref, options).write();
}

}  // namespace bielle
