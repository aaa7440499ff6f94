#include "formats/usd.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bielle/model/error.h"
#include "formats/exact_moments.h"
#include "formats/format_warnings.h"
#include "formats/reader_usd.h"
#include "formats/usd_lines.h"
#include "math/constants.h"
#include "math/decompositions.h"
#include "math/so3.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// Of bodies without any: UsdPhysics takes 0 for "not given". kg, kg m^2
constexpr double kLeastUsdMass = 1e-10, kLeastUsdMoment = 1e-13;

std::string formatList(const VectorXd& values) {
  std::vector<std::string> items;
  for (const double value : values) items.push_back(formatExact(value));
  return listItems(items);
}

// A number in another unit that is read as this one to the bit, if there is one: of those next to `guess`.
template <typename Read>
double invert(double value, double guess, const Read& read) {
  for (const double near : {guess, std::nextafter(guess, HUGE_VAL), std::nextafter(guess, -HUGE_VAL)})
    if (read(near) == value) return near;
  return guess;
}

double toUnit(double value, double unit) {
  return invert(value, value / unit, [unit](double x) { return x * unit; });
}

const char* getTieType(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Ball3D:
      return "PhysicsSphericalJoint";
    case ClosureKind::Hinge5D:
      return "PhysicsRevoluteJoint";
    case ClosureKind::Slider:
      return "PhysicsPrismaticJoint";
    case ClosureKind::Distance:
      return "PhysicsDistanceJoint";
    case ClosureKind::Weld6D:
    case ClosureKind::Coupler:
      break;
  }
  return "PhysicsFixedJoint";
}

// What ties two bodies in the file, by their paths; none is the world.
struct UsdTie {
  std::string name, type;
  std::string path0, path1;
  SE3 X_0J, X_1J;
  char axis = 0;  // 0: none
  bool closes = false;
};

class UsdWriter {
 public:
  UsdWriter(const Model& model, ConstVectorRef q_ref)
      : model_(model), q_ref_(q_ref), places_(static_cast<size_t>(model.numBodies())), paths_(places_.size()) {}

  UsdText write() {
    root_ = makeUsdName(model_.name());
    joints_ = names_.add("joints");
    findCouplers();
    nameJoints();
    out_.add("#usda 1.0");
    out_.add("(");
    for (const std::string& entry : {"    defaultPrim = \"" + root_ + "\"", std::string("    kilogramsPerUnit = 1"),
                                     std::string("    metersPerUnit = 1"), std::string("    upAxis = \"Z\"")})
      out_.add(entry);
    out_.add(")");
    if (model_.gravity() != Vector3d(0, 0, -9.81)) writeGravity();
    out_.open("Xform", root_, model_.name(), {"PhysicsArticulationRootAPI"});
    if (hasGround()) writeBody(0, "ground", SE3());
    for (int i = 1; i < model_.numBodies(); ++i) writeBodyOfJoint(i);
    out_.open("Scope", joints_, joints_);
    if (!paths_[0].empty()) writeTie({"ground_joint", "PhysicsFixedJoint", "", paths_[0], {}, {}}, {}, {});
    // Motors in their order, which a reader keeps.
    for (const Motor& motor : model_.motors()) writeJoint(motor.joint);
    for (int i = 1; i < model_.numBodies(); ++i)
      if (model_.findMotor(model_.joints()[i].name) < 0) writeJoint(i);
    for (const Closure& closure : model_.closures()) writeClosure(closure);
    out_.close();
    out_.close();
    listOmissions();
    return {out_.get(), warnings_.get()};
  }

 private:
  using Properties = std::vector<std::pair<std::string, std::string>>;

  [[noreturn]] void refuse(const Joint& joint, const std::string& problem) const {
    throw InputError(model_.name(), "joint '" + joint.name + "'", problem + ", which UsdPhysics cannot express",
                     "write another format, or change the model");
  }
  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

  bool hasGround() const {
    const auto is_ground = [](const auto& part) { return part.body == 0; };
    for (int i = 1; i < model_.numBodies(); ++i)
      if (model_.joints()[i].parent == 0 && model_.joints()[i].kind != JointKind::FreeFlyer) return true;
    for (const Closure& closure : model_.closures())
      if (closure.kind != ClosureKind::Coupler && (closure.body1 == 0 || closure.body2 == 0)) return true;
    for (const Frame& frame : model_.frames())
      if (frame.body == 0 && frame.name != "world") return true;
    const auto& visuals = model_.visuals();
    return std::any_of(visuals.begin(), visuals.end(), is_ground);
  }

  void writeGravity() {
    const double g = model_.gravity().norm();
    out_.open("PhysicsScene", "PhysicsScene", "PhysicsScene");
    out_.set("vector3f physics:gravityDirection",
             formatTuple(g > 0 ? Vector3d(model_.gravity() / g) : Vector3d(0, 0, -1)));
    out_.set("float physics:gravityMagnitude", formatExact(g));
    out_.close();
  }

  // With the cross of a universal joint before it.
  void writeBodyOfJoint(int i) {
    const Joint& joint = model_.joints()[i];
    const SE3 X_WJ = places_[static_cast<size_t>(joint.parent)] * joint.X_PJ;
    if (joint.kind == JointKind::Planar) refuse(joint, "it is planar");
    if (joint.kind == JointKind::FreeFlyer && joint.parent != 0) refuse(joint, "it is a free-flyer over a body");
    if (joint.kind == JointKind::Universal) {
      const std::string cross = joint.name + "_cross", name = names_.add(cross);
      crosses_[i] = "/" + root_ + "/" + name;
      out_.open("Xform", name, cross, {"PhysicsRigidBodyAPI", "PhysicsMassAPI"});
      writeInertia({});
      out_.place({X_WJ.R * makeAxisRotation(joint.axis, q_ref_[joint.idx_q]), X_WJ.p});
      out_.close();
      warn("joint '" + joint.name + "'", "it becomes two revolute joints with a body '" + cross + "' of 1e-10 kg");
    }
    writeBody(i, model_.bodies()[i].name, X_WJ * calcJointPlacement(joint, q_ref_.segment(joint.idx_q, joint.nq)));
  }

  void writeBody(int i, const std::string& shown, const SE3& X_WB) {
    places_[static_cast<size_t>(i)] = {settleRotation(X_WB.R), X_WB.p};  // as it is written
    const std::string name = names_.add(shown);
    paths_[static_cast<size_t>(i)] = "/" + root_ + "/" + name;
    out_.open("Xform", name, shown, {"PhysicsRigidBodyAPI", "PhysicsMassAPI"});
    const Inertia& inertia = model_.bodies()[i].inertia;
    if (i > 0 && (!(inertia.mass > 0) || inertia.I_com.isZero(0)))
      warn("link '" + shown + "'",
           "it has no mass or no moments of inertia, of which UsdPhysics wants 1e-10 kg and 1e-13 kg m²");
    writeInertia(i == 0 && !(inertia.mass > 0) ? makeGroundInertia() : inertia);
    out_.place(X_WB);
    UsdNames own;
    for (const Frame* frame : frames_[i])
      if (frame->name != shown && frame->name != "world") {
        out_.open("Xform", own.add(frame->name), frame->name, {"NewtonSiteAPI"});
        out_.place(frame->X_BF);
        out_.close();
      }
    for (const Visual* visual : visuals_[i]) writeVisual(*visual, own.add("visual"));
    for (const Shape* shape : shapes_[i])
      if (!shape->fitted) writeShape(*shape, own.add("collision"));
    out_.close();
  }

  // The ground, which a joint fixes, has some.
  static Inertia makeGroundInertia() { return {1, Vector3d::Zero(), Matrix3d::Identity()}; }

  void writeInertia(const Inertia& inertia) {
    Vector3d moments = inertia.I_com.diagonal();
    Matrix3d R = Matrix3d::Identity();
    if (!inertia.I_com.isDiagonal(0)) {
      const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(inertia.I_com);
      R = principal.eigenvectors();
      if (R.determinant() < 0) R.col(0) = -R.col(0);
      moments = principal.eigenvalues();
    }
    if (moments.isZero(0)) moments.setConstant(kLeastUsdMoment);
    out_.set("float physics:mass", formatExact(inertia.mass > 0 ? inertia.mass : kLeastUsdMass));
    out_.set("point3f physics:centerOfMass", formatTuple(inertia.com));
    out_.set("float3 physics:diagonalInertia", formatTuple(moments.cwiseMax(0)));
    out_.set("quatf physics:principalAxes", formatQuaternion(R));
    // Principal axes are found anew from what a reader makes of them, and are anything where two moments are nearly equal.
    if (!inertia.I_com.isDiagonal(0))
      out_.set("custom double[] " + kUsdInertia, "[" + formatList(listMoments(inertia.I_com)) + "]");
  }

  void writeVisual(const Visual& visual, const std::string& name) {
    const char* types[] = {"Cube", "Cylinder", "Sphere"};
    if (visual.shape == Visual::Shape::Mesh) {
      meshes_.insert(visual.mesh);
      return;
    }
    out_.open(types[static_cast<int>(visual.shape)], name, name);
    if (visual.shape == Visual::Shape::Cylinder) {
      out_.set("uniform token axis", "\"Z\"");
      out_.set("double height", formatExact(visual.size[1]));
    }
    const bool is_box = visual.shape == Visual::Shape::Box;
    out_.set(is_box ? "double size" : "double radius", is_box ? "1" : formatExact(visual.size[0]));
    out_.set("color3f[] primvars:displayColor", "[" + formatTuple(visual.rgba.head<3>()) + "]");
    out_.set("float[] primvars:displayOpacity", "[" + formatExact(visual.rgba[3]) + "]");
    out_.place(visual.X_BV, is_box ? formatTuple(visual.size) : "");
    out_.close();
  }

  // A box with rounded edges is written as the box around it.
  void writeShape(const Shape& shape, const std::string& name) {
    const bool is_sphere = shape.half.isZero(), is_capsule = shape.half.head<2>().isZero() && shape.radius > 0;
    out_.open(is_sphere ? "Sphere" : is_capsule ? "Capsule" : "Cube", name, name, {"PhysicsCollisionAPI"});
    out_.set("uniform token purpose", "\"guide\"");
    if (is_sphere || is_capsule) {
      if (!is_sphere) {
        out_.set("uniform token axis", "\"Z\"");
        out_.set("double height", formatExact(2 * shape.half.z()));
      }
      out_.set("double radius", formatExact(shape.radius));
      out_.place(shape.X_BS);
    } else {
      out_.set("double size", "1");
      out_.place(shape.X_BS, formatTuple(2 * (shape.half + Vector3d::Constant(shape.radius))));
    }
    out_.close();
  }

  void writeTie(const UsdTie& tie, std::vector<std::string> schemas, const Properties& properties) {
    const auto named = joint_prims_.find(tie.name);
    const std::string name = tie.closes || named == joint_prims_.end() ? joint_names_.add(tie.name) : named->second;
    out_.open(tie.type, name, tie.name, schemas);
    if (tie.axis) out_.set("uniform token physics:axis", std::string("\"") + tie.axis + "\"");
    if (!tie.path0.empty()) out_.set("rel physics:body0", "<" + tie.path0 + ">");
    out_.set("rel physics:body1", "<" + tie.path1 + ">");
    if (tie.closes) out_.set("uniform bool physics:excludeFromArticulation", "1");
    out_.set("point3f physics:localPos0", formatTuple(tie.X_0J.p));
    out_.set("point3f physics:localPos1", formatTuple(tie.X_1J.p));
    out_.set("quatf physics:localRot0", formatQuaternion(tie.X_0J.R));
    out_.set("quatf physics:localRot1", formatQuaternion(tie.X_1J.R));
    for (const auto& [property, value] : properties) out_.set(property, value);
    out_.close();
  }

  void writeJoint(int i) {
    const Joint& joint = model_.joints()[i];
    const std::string parent = paths_[static_cast<size_t>(joint.parent)], child = paths_[static_cast<size_t>(i)];
    if (joint.kind == JointKind::FreeFlyer) {
      if (joint.name != "root_joint")
        warn("joint '" + joint.name + "'", "it has no name in USD, and is read as 'root_joint'");
      return;
    }
    if (joint.kind == JointKind::Universal) {
      const auto name = [&](const Vector3d& axis) {
        Eigen::Index largest = 0;
        axis.cwiseAbs().maxCoeff(&largest);
        return joint.name + "_" + "XYZ"[largest];
      };
      writeAxis(joint, 0, name(joint.axis), joint.axis, parent, joint.X_PJ, crosses_.at(i));
      writeAxis(joint, 1, name(joint.axis2), joint.axis2, crosses_.at(i), SE3(), child);
    } else if (joint.nv == 1) {
      writeAxis(joint, 0, joint.name, joint.axis, parent, joint.X_PJ, child);
    } else {
      const auto lower = model_.lowerLimits().segment(joint.idx_v, joint.nv),
                 upper = model_.upperLimits().segment(joint.idx_v, joint.nv);
      if (lower.array().isFinite().any() || upper.array().isFinite().any())
        warn("joint '" + joint.name + "'", "the limits of its coordinates are left out");
      Properties properties;
      std::vector<std::string> schemas;
      addArmature(joint.idx_v, schemas, properties);
      writeTie({joint.name, "PhysicsSphericalJoint", parent, child, joint.X_PJ, SE3()}, schemas, properties);
    }
  }

  void addArmature(int dof, std::vector<std::string>& schemas, Properties& properties) const {
    if (model_.armature()[dof] == 0) return;
    schemas.push_back("PhysxJointAPI");
    properties.push_back({"float physxJoint:armature", formatExact(model_.armature()[dof])});
  }

  // A joint of one coordinate, or one of the two of a universal joint.
  void writeAxis(const Joint& joint, int k, const std::string& name, const Vector3d& direction,
                 const std::string& parent, const SE3& X_PJ, const std::string& child) {
    const bool turns = joint.kind != JointKind::Prismatic;
    const int dof = joint.idx_v + k, motor = model_.findMotor(joint.name);
    const double unit = turns ? kDegree : 1;
    const UsdAxis axis = makeUsdAxis(direction);
    std::vector<std::string> schemas;
    Properties properties;
    // Without limits, the schema has infinite ones, a word that some readers do not know.
    const auto addLimit = [&properties](const std::string& property, double value) {
      if (std::isfinite(value)) properties.push_back({"float " + property, formatExact(value)});
    };
    addLimit("physics:lowerLimit", toUnit(model_.lowerLimits()[dof], unit));
    addLimit("physics:upperLimit", toUnit(model_.upperLimits()[dof], unit));
    if (motor >= 0) {
      const std::string drive = turns ? "angular" : "linear", prefix = "drive:" + drive + ":physics:";
      schemas.push_back("PhysicsDriveAPI:" + drive);
      properties.push_back({"uniform token " + prefix + "type", "\"force\""});
      addLimit(prefix + "maxForce", model_.motors()[motor].effort_limit);
      properties.push_back({"float " + prefix + "stiffness", "0"});
      properties.push_back({"float " + prefix + "damping", "0"});
    }
    addArmature(dof, schemas, properties);
    // Where it stands: places of bodies alone give it back rounded.
    const std::string state = turns ? "angular" : "linear";
    schemas.push_back("PhysicsJointStateAPI:" + state);
    properties.push_back(
        {"float state:" + state + ":physics:position", formatExact(toUnit(q_ref_[joint.idx_q + k], unit))});
    if (const double velocity = model_.velocityLimits()[dof]; std::isfinite(velocity)) {
      if (!contains(schemas, "PhysxJointAPI")) schemas.push_back("PhysxJointAPI");
      properties.push_back({"float physxJoint:maxJointVelocity", formatExact(toUnit(velocity, unit))});
    }
    for (const WholeJointForce& whole : joinJointForces(model_))
      if (whole.force.dof == dof) addForce(joint, whole, unit, schemas, properties);
    if (const auto coupler = couplers_.find(dof); coupler != couplers_.end())
      addMimic(*coupler->second, dof, axis.token, schemas, properties);
    writeTie({name, turns ? "PhysicsRevoluteJoint" : "PhysicsPrismaticJoint", parent, child,
              X_PJ * SE3(axis.R, Vector3d::Zero()), SE3(axis.R, Vector3d::Zero()), axis.token},
             schemas, properties);
  }

  void addForce(const Joint& joint, const WholeJointForce& whole, double unit, std::vector<std::string>& schemas,
                Properties& properties) {
    const JointForce& force = whole.force;
    if (whole.sticks()) warn("joint '" + joint.name + "'", kStictionLost);
    if (force.stiffness != 0 || force.preload != 0)
      warn("joint '" + joint.name + "'", "its spring is left out: a drive with a stiffness would be read as a servo");
    if (force.damping == 0 && force.friction == 0) return;
    schemas.push_back("NewtonJointAPI");
    if (force.damping != 0)
      properties.push_back({"float newton:damping", formatExact(invert(force.damping, force.damping * unit,
                                                                       [unit](double x) { return x / unit; }))});
    if (force.friction != 0) properties.push_back({"float newton:friction", formatExact(force.friction)});
    warn("joint '" + joint.name + "'",
         "its damping and friction are Newton's (newton:damping); PhysX does not read them");
  }

  // Beforehand, since one may follow another that comes later.
  void nameJoints() {
    joint_prims_["ground_joint"] = joint_names_.add("ground_joint");
    for (int i = 1; i < model_.numBodies(); ++i)
      if (const Joint& joint = model_.joints()[i]; joint.nv == 1)
        joint_prims_[joint.name] = joint_names_.add(joint.name);
  }

  // Which joint follows which: one without a motor, if there is one, that does not follow another.
  void findCouplers() {
    for (const Closure& closure : model_.closures()) {
      if (closure.kind != ClosureKind::Coupler) continue;
      const CouplerTerm* follower = nullptr;
      for (const CouplerTerm& term : closure.terms) {
        const bool is_driven = model_.findMotor(model_.joints()[term.joint].name) >= 0;
        if (!couplers_.count(term.dof) && (!follower || !is_driven)) follower = &term;
        if (follower == &term && !is_driven) break;
      }
      const bool is_linear = std::all_of(closure.terms.begin(), closure.terms.end(),
                                         [](const CouplerTerm& term) { return term.isLinear(); });
      if (closure.terms.size() != 2 || !follower || !is_linear) {
        warn("closure '" + closure.name + "'", "it is left out: in USD, a joint follows one other joint, by a factor");
        continue;
      }
      couplers_[follower->dof] = &closure;
    }
  }

  void addMimic(const Closure& closure, int dof, char axis, std::vector<std::string>& schemas, Properties& properties) {
    const bool is_first = closure.terms[0].dof == dof;
    const CouplerTerm &own = closure.terms[is_first ? 0 : 1], &other = closure.terms[is_first ? 1 : 0];
    const Joint &follower = model_.joints()[own.joint], &leader = model_.joints()[other.joint];
    const bool turn = follower.kind != JointKind::Prismatic && leader.kind != JointKind::Prismatic;
    const double ratio = -other.coefficient / own.coefficient,
                 offset = toUnit(closure.offset / own.coefficient, follower.kind == JointKind::Prismatic ? 1 : kDegree);
    const std::string path = "</" + root_ + "/" + joints_ + "/" + joint_prims_.at(leader.name) + ">";
    schemas.push_back("NewtonMimicAPI");
    properties.push_back({"rel newton:mimicJoint", path});
    properties.push_back({"float newton:mimicCoef0", formatExact(offset)});
    properties.push_back({"float newton:mimicCoef1", formatExact(ratio)});
    if (!turn) return warn("closure '" + closure.name + "'", "only Newton reads it: PhysX couples joints that turn");
    const std::string instance = std::string("rot") + axis, prefix = "physxMimicJoint:" + instance + ":";
    schemas.push_back("PhysxMimicJointAPI:" + instance);
    properties.push_back({"rel " + prefix + "referenceJoint", path});
    properties.push_back({"uniform token " + prefix + "referenceJointAxis",
                          std::string("\"rot") + makeUsdAxis(leader.axis).token + "\""});
    properties.push_back({"float " + prefix + "gearing", formatExact(-ratio)});
    properties.push_back({"float " + prefix + "offset", formatExact(-offset)});
  }

  void writeClosure(const Closure& closure) {
    const std::string element = "closure '" + closure.name + "'";
    if (closure.kp != 0 || closure.kd != 0) warn(element, "its gains kp and kd are left out");
    if (closure.kind == ClosureKind::Coupler) return;
    UsdTie tie = {closure.name,
                  getTieType(closure.kind),
                  paths_[static_cast<size_t>(closure.body1)],
                  paths_[static_cast<size_t>(closure.body2)],
                  closure.X_B1,
                  closure.X_B2};
    tie.closes = true;
    if (hasAxis(closure.kind)) {
      const UsdAxis axis = makeUsdAxis(closure.axis);
      const SE3 turn(axis.R, Vector3d::Zero());
      tie.axis = axis.token;
      tie.X_0J = tie.X_0J * turn, tie.X_1J = tie.X_1J * turn;
    }
    Properties properties;
    if (closure.kind == ClosureKind::Distance)
      for (const char* bound : {"float physics:minDistance", "float physics:maxDistance"})
        properties.push_back({bound, formatExact(closure.length)});
    writeTie(tie, {}, properties);
  }

  void listOmissions() {
    std::string meshes;
    for (const std::string& mesh : meshes_) meshes += (meshes.empty() ? "'" : ", '") + mesh + "'";
    if (!meshes.empty()) warn("meshes " + meshes, "they are left out");
    for (int i = 1; i < model_.numBodies(); ++i)
      if (const Joint& joint = model_.joints()[i];
          joint.kind == JointKind::FreeFlyer && model_.armature().segment(joint.idx_v, joint.nv).any())
        warn("joint '" + joint.name + "'", "its armature is left out");
    for (const PointSpring& spring : model_.pointSprings())
      warn("point spring '" + spring.name + "'", "it is left out");
    for (const ContactFrame& contact : model_.contacts()) warn("contact '" + contact.name + "'", "it is left out");
    for (const Reference& reference : model_.references()) warn("reference '" + reference.name + "'", "it is left out");
    warnings_.addYamlOnly();
  }

  const Model& model_;
  const std::vector<std::vector<const Visual*>> visuals_ = sortByBody(model_, model_.visuals());
  const std::vector<std::vector<const Shape*>> shapes_ = sortByBody(model_, model_.shapes());
  const std::vector<std::vector<const Frame*>> frames_ = sortByBody(model_, model_.frames());
  const VectorXd q_ref_;
  std::string root_, joints_;                       // names of prims
  std::map<std::string, std::string> joint_prims_;  // by joint
  UsdNames names_, joint_names_;
  std::vector<SE3> places_;                 // of bodies in the world
  std::vector<std::string> paths_;          // of their prims; empty for a world without a ground
  std::map<int, std::string> crosses_;      // paths, by the body of their universal joint
  std::map<int, const Closure*> couplers_;  // by the dof that follows
  std::set<std::string> meshes_;
  UsdLines out_;
  FormatWarnings warnings_{model_};
};

}  // namespace

UsdText formatUsd(const Model& model, ConstVectorRef q_ref) { return UsdWriter(model, q_ref).write(); }

}  // namespace bielle
