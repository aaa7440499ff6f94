#include "formats/mjcf.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "formats/exact_moments.h"
#include "formats/mjcf_bodies.h"
#include "formats/reader_mjcf.h"
#include "math/settled.h"

namespace bielle {
namespace {

constexpr int kMjcfDegree = 4;  // of the polynomials of equalities

// What is left of a difference of numbers of such a size; at a closed posture it is zero.
double dropRounding(double difference, double size) { return std::abs(difference) < 1e-12 * size ? 0 : difference; }

class MjcfWriter {
 public:
  MjcfWriter(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options)
      : model_(model), q_ref_(q_ref), options_(options) {}

  MjcfText write() {
    XMLDocument document;
    XMLElement& root = addElement(document, "mujoco", {{"model", model_.name()}});
    writeSettings(root);
    XMLElement& world = addElement(root, "worldbody");
    writeGround(world);
    meshes_ = writeMjcfBodies(model_, q_ref_, options_, warnings_, world);
    writeTendons(addElement(root, "tendon"));
    writeClosures(addElement(root, "equality"));
    writeMotors(addElement(root, "actuator"));
    XMLElement& custom = addElement(root, "custom");
    writeMotorData(custom);
    writeInertias(custom);
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
                {"gravity", formatMjcf(model_.gravity())},
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
    XMLElement& sole = addGeom("sole", {{"contype", "1"},
                                        {"conaffinity", "0"},
                                        {"condim", "3"},
                                        {"priority", "1"},
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

  void writeClosures(XMLElement& section) {
    for (const Closure& closure : model_.closures()) {
      if (closure.kp != 0 || closure.kd != 0)
        warn("closure '" + closure.name + "'", "its gains kp and kd are replaced by a time constant");
      if (closure.kind == ClosureKind::Coupler) {
        writeCoupler(closure, section);
        continue;
      }
      if (closure.kind == ClosureKind::Distance) {
        writeDistance(closure, section);
        continue;
      }
      if (closure.kind == ClosureKind::Slider)
        throw InputError(model_.name(), "closure '" + closure.name + "'", "MuJoCo has no equality for a slider",
                         "make it a prismatic joint of the tree, and cut the loop at another joint");
      const auto tie = [&](const char* tag, const std::string& suffix, const Vector3d& anchor) {
        addElement(section, tag,
                   {{"name", closure.name + suffix},
                    {"body1", model_.bodies()[closure.body1].name},
                    {"body2", model_.bodies()[closure.body2].name},
                    {"anchor", formatMjcf(anchor)}});
      };
      if (closure.kind == ClosureKind::Ball3D) {
        tie("connect", "", closure.X_B1.p);
      } else if (closure.kind == ClosureKind::Hinge5D) {
        constexpr int kBits = 44;  // of axes that two points make
        const Vector3d lever = options_.hinge_lever * settleDirection(closure.X_B1.R * closure.axis, kBits);
        tie("connect", ".1", closure.X_B1.p + lever);
        tie("connect", ".2", closure.X_B1.p - lever);
      } else {
        tie("weld", "", closure.X_B2.p);
      }
    }
  }

  // An equality of joints ties two of them; the sum over more joints is the length of a fixed tendon. A spring between
  // points, or a distance, is a spatial one.
  void writeTendons(XMLElement& section) {
    for (const Closure& closure : model_.closures()) {
      if (closure.terms.size() <= 2) continue;
      XMLElement& tendon = addElement(section, "fixed", {{"name", closure.name}});
      for (const CouplerTerm& term : closure.terms)
        addElement(tendon, "joint",
                   {{"joint", model_.joints()[term.joint].name}, {"coef", formatMjcf(term.coefficient)}});
    }
    for (const Closure& closure : model_.closures())
      if (closure.kind == ClosureKind::Distance)
        writeSites(findTendonEnds(model_, closure), addElement(section, "spatial", {{"name", closure.name}}));
    for (const PointSpring& spring : model_.pointSprings()) writePointSpring(spring, section);
  }

  static void writeSites(const std::array<TendonEnd, 2>& ends, XMLElement& tendon) {
    for (const TendonEnd& end : ends) addElement(tendon, "site", {{"site", end.site}});
  }

  // The equality acts on the difference from the length at q_ref.
  void writeDistance(const Closure& closure, XMLElement& section) const {
    Workspace ws(model_);
    updatePlacements(model_, ws, q_ref_);
    const double length =
        (getPlacement(ws, closure.body2, closure.X_B2).p - getPlacement(ws, closure.body1, closure.X_B1).p).norm();
    addElement(section, "tendon",
               {{"name", closure.name},
                {"tendon1", closure.name},
                {"polycoef", formatMjcf(dropRounding(closure.length - length, length)) + " 0 0 0 0"}});
  }

  // A preload moves the rest of the spring, which MuJoCo wants to be 0 or more.
  void writePointSpring(const PointSpring& spring, XMLElement& section) {
    XMLElement& tendon = addElement(section, "spatial", {{"name", spring.name}});
    const double stiffness = spring.stiffness == 0 && spring.preload < 0 ? kMjcfPreloadStiffness : spring.stiffness;
    if (stiffness != 0) {
      const double rest = spring.rest - spring.preload / stiffness;
      if (rest < 0)
        warn("point spring '" + spring.name + "'",
             "its length without tension would be negative: its preload is written as " +
                 formatMjcf(stiffness * spring.rest) + " N");
      setAttributes(tendon, {{"stiffness", formatMjcf(stiffness)}, {"springlength", formatMjcf(std::max(rest, 0.0))}});
    } else if (spring.preload > 0) {
      warn("point spring '" + spring.name + "'", "its preload without a stiffness pulls, and is left out");
    }
    if (spring.damping != 0) setAttributes(tendon, {{"damping", formatMjcf(spring.damping)}});
    writeSites(findTendonEnds(model_, spring), tendon);
  }

  // MuJoCo's equalities act on differences from q_ref: the length of the tendon, or y = p0 + p1 x + .. for joints 1 and 2.
  void writeCoupler(const Closure& closure, XMLElement& section) {
    double rest = closure.offset, size = std::abs(rest);  // of the differences
    for (const CouplerTerm& term : closure.terms) {
      const double value = term.calcDerivative(0, q_ref_[term.idx_q]);
      rest -= value;
      size += std::abs(value);
    }
    rest = dropRounding(rest, size);
    const auto is_linear = [](const CouplerTerm& term) { return term.isLinear(); };
    const auto linear = std::find_if(closure.terms.begin(), closure.terms.end(), is_linear);
    if (closure.terms.size() > 2) {
      if (!std::all_of(closure.terms.begin(), closure.terms.end(), is_linear)) refusePolynomial(closure);
      addElement(section, "tendon",
                 {{"name", closure.name}, {"tendon1", closure.name}, {"polycoef", formatMjcf(rest) + " 0 0 0 0"}});
      return;
    }
    if (linear == closure.terms.end()) refusePolynomial(closure);
    const CouplerTerm &y = *linear, &x = closure.terms[&y == &closure.terms[0] ? 1 : 0];
    if (x.higher.size() + 1 > kMjcfDegree) refusePolynomial(closure);
    std::vector<double> powers{0, x.coefficient};
    powers.insert(powers.end(), x.higher.begin(), x.higher.end());
    powers = shiftPolynomial(std::move(powers), q_ref_[x.idx_q]);
    powers.resize(kMjcfDegree + 1);
    std::string polynomial = formatMjcf(rest / y.coefficient);
    for (int k = 1; k <= kMjcfDegree; ++k)
      polynomial += " " + (powers[k] == 0 ? "0" : formatMjcf(-powers[k] / y.coefficient));
    addElement(section, "joint",
               {{"name", closure.name},
                {"joint1", model_.joints()[y.joint].name},
                {"joint2", model_.joints()[x.joint].name},
                {"polycoef", polynomial}});
  }

  [[noreturn]] void refusePolynomial(const Closure& closure) const {
    throw InputError(model_.name(), "closure '" + closure.name + "'",
                     "an equality of MuJoCo gives one joint by a polynomial of one other, of degree up to 4",
                     "add a light link whose joint takes the place of one polynomial, and couple it to both");
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

  // Principal axes are found anew from what a reader makes of them, and are anything where two moments are nearly equal.
  void writeInertias(XMLElement& section) const {
    for (int i = 1; i < model_.numBodies(); ++i)
      if (const Matrix3d& I = model_.bodies()[i].inertia.I_com; !I.isDiagonal(0))
        addElement(section, "numeric",
                   {{"name", kMjcfInertia + model_.bodies()[i].name}, {"data", formatMjcf(listMoments(I))}});
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
      addElement(
          section, "key",
          {{"name", reference.name}, {"qpos", formatMjcf(calcMjcfQpos(model_, q_ref_, result.q, options_.rotations))}});
    }
  }

  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

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
  std::set<std::string> meshes_;
  FormatWarnings warnings_{model_};
};

}  // namespace

std::vector<double> shiftPolynomial(std::vector<double> c, double x) {
  for (size_t i = 0; i + 1 < c.size(); ++i)
    for (size_t k = c.size() - 1; k-- > i;) c[k] += x * c[k + 1];
  return c;
}

MjcfText formatMjcf(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options) {
  return MjcfWriter(model, q_ref, options).write();
}

}  // namespace bielle
