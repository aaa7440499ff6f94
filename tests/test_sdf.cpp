// Robots as SDF: libsdformat finds bodies, joints and loops where they are; and what is lost.
#include <algorithm>
#include <catch2/catch.hpp>
#include <sdf/sdf.hh>
#include <set>
#include <string>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/robots/robot_loader.h"
#include "formats/sdf.h"
#include "get_error.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

SE3 toSE3(const ignition::math::Pose3d& pose) {
  const auto& q = pose.Rot();
  return {Eigen::Quaterniond(q.W(), q.X(), q.Y(), q.Z()).toRotationMatrix(),
          {pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z()}};
}

// The place of a link or a joint in the world.
template <typename Element>
SE3 getPlacement(const Element& element) {
  ignition::math::Pose3d pose;
  REQUIRE(element.SemanticPose().Resolve(pose, "__model__").empty());
  return toSE3(pose);
}

// Of the places of bodies and of the frames of closures, and of masses.
double calcSdfError(const Model& model, ConstVectorRef q_ref, const std::string& xml) {
  sdf::Root root;
  const sdf::Errors errors = root.LoadSdfString(xml);
  CAPTURE(errors.empty() ? "" : errors[0].Message());
  REQUIRE(errors.empty());
  const sdf::Model& robot = *root.Model();
  Workspace ws(model);
  updatePositions(model, ws, q_ref);
  double worst = 0;
  const auto compare = [&worst](const SE3& a, const SE3& b) {
    worst = std::max({worst, (a.p - b.p).norm(), (a.R - b.R).norm()});
  };
  REQUIRE(static_cast<int>(robot.LinkCount()) == model.numBodies() - 1);
  for (int i = 1; i < model.numBodies(); ++i) {
    const sdf::Link& link = *robot.LinkByName(model.bodies()[i].name);
    compare(getPlacement(link), ws.X_WB[i]);
    worst = std::max(worst, std::abs(link.Inertial().MassMatrix().Mass() - model.bodies()[i].inertia.mass));
  }
  for (const Closure& closure : model.closures()) {
    if (closure.kind == ClosureKind::Coupler) continue;
    const sdf::Joint* joint = robot.JointByName(closure.name);
    if (!joint) joint = robot.JointByName(closure.name + "_closure");
    REQUIRE(joint);
    const bool first = joint->ChildLinkName() == model.bodies()[closure.body1].name;
    compare(getPlacement(*joint),
            first ? ws.X_WB[closure.body1] * closure.X_B1 : ws.X_WB[closure.body2] * closure.X_B2);
    const int parent = first ? closure.body2 : closure.body1;
    CHECK(joint->ParentLinkName() == (parent == 0 ? "world" : model.bodies()[parent].name));
    CHECK(joint->Type() == (closure.kind == ClosureKind::Weld6D   ? sdf::JointType::FIXED
                            : closure.kind == ClosureKind::Ball3D ? sdf::JointType::BALL
                            : closure.kind == ClosureKind::Slider ? sdf::JointType::PRISMATIC
                                                                  : sdf::JointType::CONTINUOUS));
  }
  return worst;
}

}  // namespace

TEST_CASE("SDF: bodies, joints and loops stand where they are, and what is lost is reported") {
  for (const char* name :
       {"bipetto", "cleobot", "delta", "fivebar", "rsu_biped", "belt_biped", "spring_leg", "spring_biped"}) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    const VectorXd q_ref = findClosedConfiguration(model).q;
    SdfText text = formatSdf(model, q_ref);
    CHECK(calcSdfError(model, q_ref, text.xml) < 1e-12);
    const auto tells = [&](const std::string& lost) {
      return std::any_of(text.warnings.begin(), text.warnings.end(),
                         [&](const std::string& w) { return w.find(lost) != std::string::npos; });
    };
    bool has_loops = false;
    for (const Closure& closure : model.closures()) {
      const bool is_coupler = closure.kind == ClosureKind::Coupler;
      CHECK(tells("closure '" + closure.name + "': it is left out") == is_coupler);
      has_loops |= !is_coupler;
    }
    CHECK(tells("they close loops; Gazebo with DART") == has_loops);
    // Engines that keep the first joint of a body alone keep the tree.
    std::set<std::string> held;
    const size_t closures_begin = text.xml.rfind("</link>");
    for (size_t at = 0; (at = text.xml.find("<child>", at + 1)) != std::string::npos;)
      CHECK(held.insert(text.xml.substr(at, text.xml.find('<', at + 1) - at)).second == (at < closures_begin));
    for (const ContactFrame& contact : model.contacts()) CHECK(tells("contact '" + contact.name + "'"));
    for (const Reference& reference : model.references()) CHECK(tells("reference '" + reference.name + "'"));
    // A wrong pose must show.
    const size_t at = text.xml.find("<pose", text.xml.rfind("<link "));
    text.xml.insert(text.xml.find('>', at) + 1, "1");
    CHECK(calcSdfError(model, q_ref, text.xml) > 0.1);
  }
}

TEST_CASE("SDF: limits, springs and names move or change as told, and planar joints are refused") {
  ModelBuilder builder("two");
  Joint joint;
  joint.name = "a", joint.kind = JointKind::Revolute;
  JointLimits limits;
  limits.lower = VectorXd::Constant(1, -1), limits.upper = VectorXd::Constant(1, 2);
  builder.addLink("a", "world", joint, {1, Vector3d::Zero(), Matrix3d::Identity()}, limits);
  JointForce force;
  force.stiffness = 4, force.rest = 0.25, force.preload = 1;
  builder.addJointForce("a", force);
  builder.addMotor("a", 0, 7, 3);
  const SdfText text = formatSdf(builder.build(), VectorXd::Constant(1, 0.5));
  for (const char* part :
       {"<joint name=\"a_joint\" type=\"revolute\">", "<lower>-1.5</lower>", "<upper>1.5</upper>", "<effort>7</effort>",
        "<velocity>3</velocity>", "<spring_reference>0</spring_reference>", "<spring_stiffness>4</spring_stiffness>"})
    CHECK_THAT(text.xml, Catch::Contains(part));
  REQUIRE(text.warnings.size() == 3);
  CHECK_THAT(text.warnings[0], Catch::Contains("joint 'a': it is renamed to 'a_joint'"));
  CHECK_THAT(text.warnings[1], Catch::Contains("joints 'a' 0.5: their coordinates are measured from these values"));
  CHECK_THAT(text.warnings[2], Catch::Contains("motors"));
  joint.name = "slide", joint.kind = JointKind::Planar;
  builder.addLink("plate", "a", joint, {1, Vector3d::Zero(), Matrix3d::Identity()});
  CHECK_THAT(getError([&] { formatSdf(builder.build(), builder.build().makeNeutral()); }),
             Catch::Contains("joint 'slide': it is planar"));
}

TEST_CASE("SDF and a URDF alone tell what only our files say of joints and motors") {
  ModelParts parts = takeParts(loadRobot("belt_biped").model);
  parts.joints[1].position_importance = 3;
  parts.motors[0].torque_loss = 0.2;
  parts.motors[1].drive.efficiency = 0.7;
  const Model model = ModelBuilder::restore(parts);
  const VectorXd q_ref = findClosedConfiguration(model).q;
  for (const std::vector<std::string>& warnings : {formatSdf(model, q_ref).warnings, formatUrdf(model).warnings}) {
    const auto tells = [&](const std::string& lost) {
      return std::any_of(warnings.begin(), warnings.end(),
                         [&](const std::string& w) { return w.find(lost) != std::string::npos; });
    };
    CHECK(tells("joint '" + model.joints()[1].name + "': its importance"));
    CHECK(tells("motor '" + model.motors()[0].name + "': its torque_loss"));
    CHECK(tells("motor '" + model.motors()[1].name + "': its winding and gear"));
    CHECK(tells("serial joints"));
  }
}

TEST_CASE("links next to massless survive in a URDF, with what hangs on them") {
  for (const double mass : {0.0, 1e-9, 1e-6, 0.5}) {
    CAPTURE(mass);
    ModelBuilder builder("leg");
    Joint x, y;
    x.kind = y.kind = JointKind::Revolute;
    x.name = "x", x.axis = Vector3d::UnitX();
    y.name = "y", y.axis = Vector3d::UnitY();
    Joint base;
    base.name = "root_joint", base.kind = JointKind::FreeFlyer;
    builder.addLink("shin", "world", base, {1, Vector3d::Zero(), 0.01 * Matrix3d::Identity()});
    builder.addLink("cross", "shin", x, {mass, Vector3d::Zero(), mass * Matrix3d::Identity()});
    builder.addLink("foot", "cross", y, {0.5, Vector3d::Zero(), 0.01 * Matrix3d::Identity()});
    const UrdfText urdf = formatUrdf(builder.build());
    sdf::Root root;
    const sdf::Errors errors = root.LoadSdfString(urdf.urdf);
    CAPTURE(errors.empty() ? "" : errors[0].Message());
    REQUIRE(errors.empty());
    CHECK(root.Model()->LinkCount() == 3);
    CHECK(root.Model()->JointCount() == 2);
    CHECK(root.Model()->LinkByName("cross")->Inertial().MassMatrix().Mass() == Approx(std::max(mass, 2e-6)));
    const auto names_cross = [](const std::string& warning) {
      return warning.find("link 'cross': its mass") != std::string::npos;
    };
    CHECK(std::any_of(urdf.warnings.begin(), urdf.warnings.end(), names_cross) == (mass < 2e-6));
  }
}
