// Robots from SDF files: what is written comes back, and what others write is read or refused with a remedy.
#include <algorithm>
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/robots/robot_loader.h"
#include "formats/sdf.h"
#include "get_error.h"
#include "math/constants.h"
#include "model/number_text.h"
#include "robot_difference.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

LoadedRobot loadSdf(const std::string& text) {
  const RobotDirectory directory;
  return loadRobot(directory.write("robot.sdf", text));
}

bool warnsOf(const LoadedRobot& robot, const std::string& text) {
  for (const std::string& warning : robot.warnings)
    if (warning.find(text) != std::string::npos) return true;
  return false;
}

const Joint& getSdfJoint(const Model& model, const std::string& name) {
  const int i = model.findJoint(name);
  return model.joints()[i >= 0 ? i : model.findJoint(name + "_joint")];
}

// In an SDF file all coordinates are zero at q_ref, but for those of free bases.
VectorXd mapToSdf(const Model& a, const Model& b, ConstVectorRef q_ref, ConstVectorRef q) {
  VectorXd out = b.makeNeutral();
  for (const Joint& joint : a.joints()) {
    if (joint.nq == 0) continue;
    const auto own = q.segment(joint.idx_q, joint.nq), ref = q_ref.segment(joint.idx_q, joint.nq);
    auto mapped = out.segment(getSdfJoint(b, joint.name).idx_q, joint.nq);
    if (joint.kind == JointKind::FreeFlyer)
      mapped = own;
    else if (joint.kind == JointKind::Spherical)
      mapped =
          (Eigen::Quaterniond(Eigen::Vector4d(ref)).conjugate() * Eigen::Quaterniond(Eigen::Vector4d(own))).coeffs();
    else
      mapped = own - ref;
  }
  return out;
}

// Four bars in a plane, of which two close the loop; the last one hangs on both.
std::string makeFourBar(const std::string& in_model, const std::string& closing = R"(
<joint name="close" type="revolute"><parent>b</parent><child>c</child><pose relative_to="c">0 0 1 0 0 0</pose>
<axis><xyz>0 1 0</xyz></axis></joint>)") {
  const auto link = [](const std::string& name, const std::string& pose) {
    return "<link name=\"" + name + "\"><pose>" + pose +
           "</pose><inertial><pose>0 0 0.5 0 0 0</pose><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>0.5</izz>"
           "</inertia></inertial></link>\n";
  };
  const auto joint = [](const std::string& name, const std::string& parent, const std::string& child) {
    return "<joint name=\"" + name + "\" type=\"revolute\"><parent>" + parent + "</parent><child>" + child +
           "</child><axis><xyz>0 1 0</xyz></axis></joint>\n";
  };
  return "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\"><model name=\"bars\">\n" + link("a", "0 0 0 0 0 0") +
         link("b", "0 0 1 0 1.5707963267948966 0") + link("c", "1 0 0 0 0 0") + joint("ja", "world", "a") +
         joint("jb", "a", "b") + joint("jc", "world", "c") + closing + in_model + "</model></sdf>\n";
}

}  // namespace

TEST_CASE("robots come back from SDF with their bodies, loops, ranges and springs") {
  for (const char* name : {"bipetto", "cleobot", "delta", "fivebar", "fourbar", "rsu_biped", "spring_leg"}) {
    CAPTURE(name);
    const Model a = loadRobot(name).model;
    const VectorXd q_ref = findClosedConfiguration(a).q;
    const Model b = loadSdf(formatSdf(a, q_ref).xml).model;
    REQUIRE(a.nq() == b.nq());
    REQUIRE(a.numBodies() == b.numBodies());
    REQUIRE(a.closures().size() == b.closures().size());
    std::mt19937 rng(4);
    Workspace wa(a), wb(b);
    double mass = 0, bias = 0, closures = 0;
    for (int i = 0; i < 3; ++i) {
      const VectorXd q = a.integrate(q_ref, randomVector(rng, a.nv(), 0.5)), v = randomVector(rng, a.nv());
      const VectorXd qb = mapToSdf(a, b, q_ref, q);
      MatrixXd order = MatrixXd::Zero(b.nv(), a.nv());
      for (const Joint& joint : a.joints())
        if (joint.nv) order.block(getSdfJoint(b, joint.name).idx_v, joint.idx_v, joint.nv, joint.nv).setIdentity();
      updatePositions(a, wa, q), updatePositions(b, wb, qb);
      updateVelocities(a, wa, v), updateVelocities(b, wb, order * v);
      updateMassMatrix(a, wa), updateMassMatrix(b, wb);
      updateBias(a, wa), updateBias(b, wb);
      const MatrixXd armature = a.armature().asDiagonal();  // SDF has none
      mass = std::max(mass, calcRelativeError(order.transpose() * wb.M * order + armature, wa.M));
      bias = std::max(bias, calcRelativeError(order.transpose() * wb.b, wa.b));
      for (const Closure& closure : a.closures()) {
        const int k = b.findClosure(closure.name);
        closures = std::max(closures,
                            compareClosure(wa, closure, wb,
                                           b.closures()[k >= 0 ? k : b.findClosure(closure.name + "_closure")], q, qb));
      }
    }
    CHECK(mass < kTolerance);
    if (a.pointSprings().empty()) CHECK(bias < kTolerance);
    CHECK(closures < 1e-9);  // the loops are closed to about this
    for (const Joint& joint : a.joints()) {
      if (joint.nv != 1) continue;
      const int k = joint.idx_v, kb = getSdfJoint(b, joint.name).idx_v;
      if (std::isfinite(a.lowerLimits()[k]))
        CHECK(b.lowerLimits()[kb] == Approx(a.lowerLimits()[k] - q_ref[joint.idx_q]).margin(1e-14));
      else
        CHECK_FALSE(std::isfinite(b.lowerLimits()[kb]));
    }
    for (const Frame& frame : a.frames())
      if (frame.body > 0) CHECK(b.findFrame(frame.name) >= 0);
    CHECK(findClosedConfiguration(b).status == NumericalStatus::Ok);
    CHECK_NOTHROW(formatRobot(b));
  }
}

TEST_CASE("a second prismatic joint onto a link of SDF is a slider, also where it is written") {
  const std::string rail =
      "<joint name=\"r1\" type=\"prismatic\"><pose>0 0.1 0 0 0 1</pose><parent>a</parent><child>d</child><axis><xyz "
      "expressed_in=\"__model__\">1 0 0</xyz></axis></joint>";
  const Model model = loadSdf(makeFourBar("<link name=\"d\"/>" + rail + replaceOnce(rail, "r1", "r2"))).model;
  REQUIRE(model.closures().size() == 2);
  const Closure& slider = model.closures()[model.findClosure("r2")];
  CHECK(slider.kind == ClosureKind::Slider);
  CHECK((slider.X_B2.R * slider.axis - Vector3d::UnitX()).norm() < 1e-14);
  CHECK(model.joints()[model.findJoint("r1")].kind == JointKind::Prismatic);
  const AssemblyResult closed = findClosedConfiguration(model);
  CHECK(closed.status == NumericalStatus::Ok);
  CHECK(calcMobility(model, closed.q).mobility == 2);  // of the four-bar and of the two rails
  const Model again = loadSdf(formatSdf(model, closed.q).xml).model;
  const Closure& written = again.closures()[again.findClosure("r2")];
  CHECK(written.kind == ClosureKind::Slider);
  CHECK((written.X_B2.R * written.axis - slider.X_B2.R * slider.axis).norm() < 1e-12);
}

TEST_CASE("joints of SDF: frames that poses are relative to, ranges, springs, and a second joint that closes a loop") {
  const LoadedRobot robot = loadSdf(makeFourBar(R"(
<frame name="knee" attached_to="a"><pose>0 0 1 0 0 0</pose></frame>
<link name="slider"><pose relative_to="knee">0 0.2 0 0 0 0</pose></link>
<joint name="slide" type="prismatic"><pose>0.5 0 0 0 0 1.5707963267948966</pose><parent>a</parent><child>slider</child><axis>
<xyz>2 0 0</xyz><limit><lower>-1</lower><upper>2</upper><effort>30</effort><velocity>4</velocity></limit>
<dynamics><damping>0.1</damping><friction>0.2</friction><spring_reference>0.3</spring_reference>
<spring_stiffness>5</spring_stiffness></dynamics></axis></joint>
<link name="plate"><pose>0 0 3 0 0 0</pose></link>
<joint name="cross" type="universal"><pose>0 0 -1 0 0 0</pose><parent>slider</parent><child>plate</child><axis><xyz>1 0 0</xyz>
<limit><lower>-0.5</lower><upper>0.5</upper></limit></axis><axis2><xyz>0 1 0</xyz></axis2></joint>
<link name="ball"/><joint name="socket" type="ball"><parent>plate</parent><child>ball</child></joint>
<plugin name="p" filename="f"/>)"));
  const Model& model = robot.model;
  CHECK_FALSE(model.hasFreeFlyer());
  REQUIRE(model.closures().size() == 1);
  CHECK(model.closures()[0].name == "close");
  CHECK(model.closures()[0].kind == ClosureKind::Hinge5D);
  CHECK(findClosedConfiguration(model).status == NumericalStatus::Ok);
  CHECK(model.references()[0].name == "initial");
  const Joint &slide = getSdfJoint(model, "slide"), &cross = getSdfJoint(model, "cross");
  CHECK(slide.kind == JointKind::Prismatic);
  CHECK((slide.axis - Vector3d::UnitY()).norm() < 1e-12);
  CHECK((slide.X_PJ.p - Vector3d(0, 0.2, 1)).norm() < 1e-12);
  CHECK(model.lowerLimits()[slide.idx_v] == -1);
  CHECK(model.velocityLimits()[slide.idx_v] == 4);
  REQUIRE(model.jointForces().size() == 1);
  CHECK(model.jointForces()[0].stiffness == 5);
  CHECK(model.jointForces()[0].rest == 0.3);
  CHECK(model.jointForces()[0].friction == 0.2);
  CHECK(cross.kind == JointKind::Universal);
  CHECK((cross.X_PJ.p - Vector3d(0, -0.2, 1)).norm() < 1e-12);
  CHECK(cross.axis == Vector3d::UnitX());
  CHECK(model.upperLimits()[cross.idx_v] == 0.5);
  CHECK(getSdfJoint(model, "socket").kind == JointKind::Spherical);
  CHECK(getSdfJoint(model, "ja").kind == JointKind::Continuous);
  CHECK(warnsOf(robot, "<model> <plugin> (line "));
}

TEST_CASE("an axis that is beside one of its frame by rounding turns this frame, so that no row is next to nothing") {
  const Model model = loadSdf(makeFourBar("", R"(
<joint name="close" type="revolute"><parent>b</parent><child>c</child><pose relative_to="c">0 0 1 0.000002 0 0.000001</pose>
<axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint>)"))
                          .model;
  const Closure& close = model.closures()[0];
  CHECK((close.axis - Vector3d::UnitY()).norm() == 0);
  Workspace ws(model);
  updatePositions(model, ws, model.makeNeutral());
  const int body = close.body1;
  CHECK((ws.X_WB[body].R * close.X_B1.R * close.axis - Vector3d::UnitY()).norm() < 1e-15);
  MatrixXd J = MatrixXd::Zero(5, model.nv());
  calcClosureJacobian(ws, close, J);
  for (Eigen::Index i = 0; i < J.rows(); ++i) CHECK((J.row(i).norm() < 1e-14 || J.row(i).norm() > 1e-3));
}

TEST_CASE("loops of SDF are cut at their balls, wherever these are in the file, and other joints keep their ranges") {
  // Two levers on a frame, and a rod between them.
  const auto link = [](const std::string& name, double x, double y) {
    return "<link name='" + name + "'><pose>" + formatNumber(x) + " " + formatNumber(y) +
           " 0.3 0 0 "
           "0</pose><inertial><mass>2</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></"
           "inertial></link>";
  };
  const auto lever = [](const std::string& name) {
    return "<joint name='pin_" + name + "' type='revolute'><parent>frame</parent><child>" + name +
           "</child><axis><xyz>0 0 1</xyz><limit><lower>-0.6</lower><upper>0.5</upper></limit>"
           "<dynamics><damping>0.2</damping></dynamics></axis></joint>";
  };
  const std::string ball =
      "<joint name='ball' type='ball'><pose>0 0.2 0 0 0 0</pose><parent>rod</parent><child>b</child></joint>";
  const std::string rest =
      link("frame", 0, 0) + link("a", 0, 0) + link("b", 0.8, 0) + link("rod", 0, 0.2) + lever("a") +
      "<joint name='fork' type='universal'><parent>a</parent><child>rod</child><axis><xyz>0 0 1</xyz></axis>"
      "<axis2><xyz>0 1 0</xyz></axis2></joint>";
  for (const std::string& joints : {ball + lever("b"), lever("b") + ball}) {
    const LoadedRobot robot = loadSdf("<sdf version='1.7'><model name='levers'>" + joints + rest + "</model></sdf>");
    const Model& model = robot.model;
    REQUIRE(model.closures().size() == 1);
    CHECK(model.closures()[0].name == "ball");
    CHECK(model.closures()[0].kind == ClosureKind::Ball3D);
    const Joint& pin = getSdfJoint(model, "pin_b");
    CHECK(pin.kind == JointKind::Revolute);
    CHECK(model.lowerLimits()[pin.idx_v] == -0.6);
    CHECK(model.upperLimits()[pin.idx_v] == 0.5);
    CHECK(model.jointForces().size() == 2);
    CHECK_FALSE(warnsOf(robot, "it closes a loop"));
    CHECK(calcMobility(model, findClosedConfiguration(model).q).mobility == 7);
  }
}

TEST_CASE("a model of SDF that nothing holds has a free base, one that is static has none") {
  const std::string body =
      "<sdf version=\"1.7\"><world name=\"w\"><gravity>0 0 -2</gravity><model name=\"ground\"><static>1</static><link "
      "name=\"l\"/>"
      "</model><model name=\"m\">STATIC<pose>1 2 3 0 0 0</pose><link name=\"trunk\"><pose>0 0 1 0 0 "
      "0</pose></link><link "
      "name=\"leg\"/><joint name=\"hip\" type=\"revolute\"><parent>trunk</parent><child>leg</child><axis><xyz>1 0 "
      "0</xyz></axis>"
      "</joint></model></world></sdf>";
  const Model free = loadSdf(replaceOnce(body, "STATIC", "")).model;
  CHECK(free.hasFreeFlyer());
  CHECK(free.name() == "m");
  CHECK(free.gravity().z() == -2);
  CHECK(free.mass() == 2);  // of links that do not tell theirs
  const Model held = loadSdf(replaceOnce(body, "STATIC", "<static>true</static>")).model;
  CHECK(held.nv() == 1);
  CHECK((held.joints()[1].X_PJ.p - Vector3d(1, 2, 3)).norm() < 1e-12);
}

TEST_CASE("of several models in SDF one is read, and which are not is told") {
  const auto model = [](const std::string& name, bool moves) {
    return "<model name='" + name + "'><link name='trunk'/><link name='leg'/>" +
           (moves ? "<joint name='hip' type='revolute'><parent>trunk</parent><child>leg</child><axis><xyz>1 0 0</xyz>"
                    "</axis></joint>"
                  : "") +
           "</model>";
  };
  const auto wrap = [](const std::string& models) {
    return "<sdf version='1.7'><world name='w'>" + models + "</world></sdf>";
  };
  const LoadedRobot robot = loadSdf(wrap(model("table", false) + model("robot", true)));
  CHECK(robot.model.name() == "robot");
  CHECK(warnsOf(robot, "model 'table': it is left out, because it has no joints"));
  CHECK_FALSE(warnsOf(robot, "model 'robot'"));
  const std::string several = "it has several models: 'one', 'two'; keep one of them, in a file of its own";
  const std::string two = model("one", true) + model("two", true);
  CHECK_THAT(getError([&] { loadSdf(wrap(two)); }), Catch::Contains(several) && Catch::Contains(".sdf: document: "));
  CHECK_THAT(getError([&] { loadSdf("<sdf version='1.7'>" + two + "</sdf>"); }), Catch::Contains(several));
  CHECK_THAT(getError([&] { loadSdf(wrap(model("one", false))); }), Catch::Contains("it has no model with joints"));
}

TEST_CASE("Drake's bushings in SDF are the joints that they stand for") {
  const auto bushing = [](const std::string& torque, const std::string& force = "30000 30000 30000") {
    return "<frame name=\"fb\" attached_to=\"b\"><pose>0 0 1 1.5707963267948966 0 0</pose></frame><frame name=\"fc\" "
           "attached_to=\"c\"><pose>0 0 1 1.5707963267948966 0 0</pose></frame>\n<drake:linear_bushing_rpy>"
           "<drake:bushing_frameA>fb</drake:bushing_frameA><drake:bushing_frameC>fc</drake:bushing_frameC>"
           "<drake:bushing_torque_stiffness>" +
           torque +
           "</drake:bushing_torque_stiffness><drake:bushing_torque_damping>1 1 0</drake:bushing_torque_damping>"
           "<drake:bushing_force_stiffness>" +
           force + "</drake:bushing_force_stiffness></drake:linear_bushing_rpy>";
  };
  const LoadedRobot hinge = loadSdf(makeFourBar(bushing("3000 3000 0"), ""));
  REQUIRE(hinge.model.closures().size() == 1);
  CHECK(hinge.model.closures()[0].kind == ClosureKind::Hinge5D);
  CHECK(findClosedConfiguration(hinge.model).status == NumericalStatus::Ok);
  CHECK(warnsOf(hinge, "<drake:linear_bushing_rpy> (line 10): its springs become a hinge that does not give"));
  CHECK(loadSdf(makeFourBar(bushing("0 0 0"), "")).model.closures()[0].kind == ClosureKind::Ball3D);
  const auto getSdfError = [&](const std::string& in_model) {
    return getError([&] { loadSdf(makeFourBar(in_model, "")); });
  };
  CHECK_THAT(getSdfError(bushing("3000 0 0")),
             Catch::Contains("it is not as stiff as a ball, a hinge or a weld; make"));
  CHECK_THAT(getSdfError(bushing("1 1 x")), Catch::Contains("it is not made of 3 finite numbers; correct it"));
  CHECK_THAT(getSdfError(bushing("1 1 nan")), Catch::Contains("<drake:bushing_torque_stiffness> (line 10)"));
  std::string elsewhere = bushing("1 1 0");
  CHECK_THAT(getSdfError(replaceOnce(elsewhere, "frameA>fb<", "frameA>none<")),
             Catch::Contains("<drake:bushing_frameA> (line 10): there is no link or frame 'none'; correct the name"));
}

TEST_CASE("<mimic> of SDF 1.11 is a coupler, though libsdformat leaves it out; a later version is told") {
  const auto swing = [](const std::string& mimic) {
    return replaceOnce(replaceOnce(makeFourBar("", ""), "version=\"1.9\"", "version=\"1.11\""),
                       "<child>c</child><axis><xyz>0 1 0</xyz></axis>",
                       "<child>c</child><axis><xyz>0 1 0</xyz>" + mimic + "</axis>");
  };
  const LoadedRobot robot =
      loadSdf(swing("<mimic joint=\"ja\"><multiplier> -2 </multiplier><offset>0.3</offset>"
                    "<reference>0.1</reference></mimic>"));
  CHECK(warnsOf(robot, "version 1.11 is later than 1.9"));
  CHECK_FALSE(warnsOf(robot, "<mimic>: "));
  REQUIRE(robot.model.closures().size() == 1);
  CHECK(robot.model.closures()[0].kind == ClosureKind::Coupler);
  const AssemblyResult closed = closeConfiguration(robot.model, VectorXd::Constant(robot.model.nq(), 0.2));
  REQUIRE(closed.status == NumericalStatus::Ok);
  const auto get = [&](const char* name) { return closed.q[robot.model.joints()[robot.model.findJoint(name)].idx_q]; };
  CHECK(get("jc") == Approx(-2 * (get("ja") - 0.1) + 0.3));
  CHECK_FALSE(warnsOf(loadSdf(makeFourBar("")), "is later than"));
  // As by Gazebo's plugin.
  const LoadedRobot plugged = loadSdf(replaceOnce(makeFourBar("", ""), "</model>",
                                                  "<plugin name=\"p\" filename=\"p.so\"><joint>ja</joint><mimicJoint>jc"
                                                  "</mimicJoint><multiplier>-2</multiplier></plugin></model>"));
  REQUIRE(plugged.model.closures().size() == 1);
  CHECK(plugged.model.closures()[0].kind == ClosureKind::Coupler);
  CHECK_FALSE(warnsOf(plugged, "plugin"));
  // As by Drake, whose tendons may be couplers, too.
  const LoadedRobot of_drake = loadSdf(replaceOnce(makeFourBar("", ""), "<child>c</child>",
                                                   "<child>c</child><drake:mimic joint=\"ja\" multiplier=\"-2\" "
                                                   "offset=\"0.5\"/>"));
  REQUIRE(of_drake.model.closures().size() == 1);
  CHECK(closeConfiguration(of_drake.model, closed.q).q.isApprox(closed.q, 1e-9));
  CHECK_FALSE(warnsOf(of_drake, "drake:mimic"));
  const LoadedRobot tendon = loadSdf(replaceOnce(
      makeFourBar("", ""), "</model>",
      "<drake:tendon_constraint><drake:tendon_constraint_joint name=\"ja\" a=\"2\"/><drake:tendon_constraint_joint "
      "name=\"jc\" a=\"1\"/><drake:tendon_constraint_lower_limit>0.4</drake:tendon_constraint_lower_limit>"
      "<drake:tendon_constraint_upper_limit>0.6</drake:tendon_constraint_upper_limit></drake:tendon_constraint></"
      "model>"));
  REQUIRE(tendon.model.closures().size() == 1);
  CHECK(closeConfiguration(tendon.model, closed.q).q.isApprox(closed.q, 1e-9));
  CHECK(warnsOf(tendon, "its play of 0.1 to either side is left out"));
  const auto getSdfError = [&](const std::string& mimic) { return getError([&] { loadSdf(swing(mimic)); }); };
  CHECK_THAT(getSdfError("<mimic joint=\"none\"/>"),
             Catch::Contains("joint 'jc': <mimic> (line") && Catch::Contains("'none' is no joint with one coordinate"));
  CHECK_THAT(getSdfError("<mimic joint=\"ja\"><multiplier>x</multiplier></mimic>"),
             Catch::Contains("<multiplier> is not a finite number"));
}

TEST_CASE("inertia that SDF makes up is told") {
  const std::string whole = makeFourBar(""), mass = "<mass>2</mass>";
  const auto change = [&whole](const std::string& from, const std::string& to) {
    std::string text = whole;
    return text.replace(text.find(from), from.size(), to);  // of link a
  };
  CHECK(warnsOf(loadSdf(change(mass, "")), "link 'a' (line 3): its <inertial> has no <mass>: it is 1 kg, by the spec"));
  const std::string moments = "<inertia><ixx>1</ixx><iyy>1</iyy><izz>0.5</izz></inertia>";
  CHECK(warnsOf(loadSdf(change(moments, "")), "its <inertial> has no <inertia>: its moments are 1 kg m²"));
  CHECK(warnsOf(loadSdf(makeFourBar("<link name=\"d\"/><joint name=\"j\" type=\"fixed\"><parent>a</parent><child>d"
                                    "</child></joint>")),
                "): it has no <inertial>: its mass is 1 kg"));
  CHECK_FALSE(warnsOf(loadSdf(whole), "1 kg"));
  CHECK(warnsOf(loadSdf(change("<inertial>", "<inertial><density>7800</density>")), "<inertial> <density> (line 3)"));
  CHECK(warnsOf(loadSdf(change("</inertial>", "<fluid_added_mass/></inertial>")),
                "<inertial> <fluid_added_mass> (line 3)"));
  CHECK(warnsOf(
      loadSdf(replaceOnce(whole, "<child>c</child><axis><xyz>0 1 0</xyz></axis>",
                          "<child>c</child><axis><xyz>0 1 0</xyz><limit><stiffness>9</stiffness></limit></axis>")),
      "<limit> <stiffness>"));
}

TEST_CASE("frames of SDF that look like the ends of an open loop are told") {
  const std::string tip = "\"><pose>0 0 1 0 0 0</pose></frame>";
  const std::string open = makeFourBar(
      "<frame name=\"closing_k_1\" attached_to=\"b" + tip + "<frame name=\"closing_k_2\" attached_to=\"c" + tip, "");
  const std::string remedy = "closures: [{name: k, type: 3d, frames: [closing_k_1, closing_k_2]}]";
  CHECK(warnsOf(loadSdf(open), remedy));
  const RobotDirectory directory;
  directory.write("robot.sdf", open);
  const LoadedRobot closed = loadRobot(directory.write("robot.yaml", "model: robot.sdf\n" + remedy + "\n"));
  CHECK_FALSE(warnsOf(closed, "look like the ends"));
  CHECK(closed.model.closures().size() == 1);
}

TEST_CASE("<inertial auto> of SDF 1.11 is that of the collisions") {
  // A bob of two densities: a box, and a ball a metre below its middle, drawn from a frame on the link.
  const auto make = [](const std::string& inertial, const std::string& more) {
    return "<sdf version=\"1.11\"><model name=\"m\"><link name=\"a\"><pose>0 0 3 0 0 0</pose>\n" + inertial +
           "<collision name=\"box\"><pose>0.1 0 0 0 0 1.5707963267948966</pose><geometry><box><size>0.1 0.2 0.3</size>"
           "</box></geometry></collision>\n<collision name=\"ball\"><density>2000</density><pose relative_to=\"f\"/>"
           "<geometry><sphere><radius>0.05</radius></sphere></geometry></collision>" +
           more +
           "</link><frame name=\"f\" attached_to=\"a\"><pose>0.1 0 -1 0 0 0</pose></frame><joint name=\"j\" "
           "type=\"revolute\"><parent>world</parent><child>a</child><axis><xyz>0 1 "
           "0</xyz></axis></joint></model></sdf>";
  };
  const auto check = [&](const std::string& inertial, double density, double scale) {
    CAPTURE(inertial);
    const LoadedRobot robot = loadSdf(make(inertial, ""));
    const Inertia& inertia = robot.model.bodies().back().inertia;
    const double box = scale * density * 0.006, ball = scale * 2000 * 4 / 3 * kPi * 1.25e-4, whole = box + ball;
    CHECK(inertia.mass == Approx(whole));
    CHECK(inertia.com.isApprox(Vector3d(0.1, 0, -ball / whole), 1e-12));
    const double apart = box * ball / whole, of_ball = 0.4 * ball * 0.0025;
    const Vector3d moments(box / 12 * 0.10 + of_ball + apart, box / 12 * 0.13 + of_ball + apart,
                           box / 12 * 0.05 + of_ball);
    CHECK(inertia.I_com.isApprox(Matrix3d(moments.asDiagonal()), 1e-9));
    CHECK_FALSE(warnsOf(robot, "1 kg"));
  };
  check("<inertial auto=\"true\"/>", 1000, 1);
  check("<inertial auto=\"1\"><density>500</density><pose>9 9 9 0 0 0</pose></inertial>", 500, 1);
  check("<inertial auto=\"true\"><mass>3</mass></inertial>", 1000, 3 / (6 + 2000 * 4 / 3. * kPi * 1.25e-4));
  const auto refuse = [&](const std::string& inertial, const std::string& more, const std::string& text) {
    CHECK_THAT(getError([&] { loadSdf(make(inertial, more)); }), Catch::Contains(text));
  };
  refuse("<inertial auto=\"true\"/>",
         "<collision name=\"floor\"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision>",
         "link 'a': collision 'floor' (line 3): inertia is to be computed from it");
  refuse("<inertial auto=\"true\"><density>-1</density></inertial>", "",
         "link 'a': <density> (line 2): it is no positive number; correct it");
  CHECK_THAT(getError([&] {
               loadSdf(
                   "<sdf version=\"1.11\"><model name=\"m\"><link name=\"a\"><inertial auto=\"true\"/></link>"
                   "<link name=\"b\"/><joint name=\"j\" type=\"revolute\"><parent>a</parent><child>b</child>"
                   "<axis><xyz>0 1 0</xyz></axis></joint></model></sdf>");
             }),
             Catch::Contains("link 'a' (line 1): its inertia is to be computed from its collisions"));
}

TEST_CASE("SDF files that are no robot are errors with a remedy") {
  const auto getSdfError = [](const std::string& text) { return getError([&] { loadSdf(text); }); };
  const std::string whole = makeFourBar("");
  CHECK_THAT(getSdfError("<robot/>"), Catch::Contains("its outermost element is not <sdf>; give an SDF file"));
  CHECK_THAT(
      getSdfError(replaceOnce(whole, " version=\"1.9\"", "")),
      Catch::Contains("<sdf> (line ") && Catch::Contains("it has no version; give the one that it was written for"));
  for (size_t length = 1; length + 20 < whole.size(); length += 53) {
    const std::string error = getSdfError(whole.substr(0, length));
    CAPTURE(error);
    CHECK(error.find("robot.sdf: line ") != std::string::npos);
  }
  CHECK_THAT(
      getSdfError(replaceOnce(whole, "<parent>b</parent>", "<parent>none</parent>")),
      Catch::Contains("libsdformat says: ") && Catch::Contains("none") && Catch::Contains("; correct the element"));
  CHECK_FALSE(getSdfError(replaceOnce(whole, "<pose>1 0 0 0 0 0</pose>", "<pose>nan 0 0 0 0 0</pose>")).empty());
  CHECK_FALSE(getSdfError(replaceOnce(whole, "<pose>1 0 0 0 0 0</pose>", "<pose>inf 0 0 0 0 0</pose>")).empty());
  CHECK_THAT(getSdfError(makeFourBar(
                 "<joint name=\"x\" type=\"gearbox\"><gearbox_ratio>2</gearbox_ratio><gearbox_reference_body>a"
                 "</gearbox_reference_body><parent>b</parent><child>d</child><axis><xyz>1 0 0</xyz></axis><axis2>"
                 "<xyz>1 0 0</xyz></axis2></joint><link name=\"d\"/>")),
             Catch::Contains("joint 'x': joints of type gearbox, revolute2 and screw are not supported; replace it"));
  const std::string universal =
      "<joint name=\"r1\" type=\"universal\"><parent>a</parent><child>d</child><axis><xyz>1 0 0</xyz></axis>"
      "<axis2><xyz>0 1 0</xyz></axis2></joint>";
  CHECK_THAT(getSdfError(makeFourBar("<link name=\"d\"/>" + universal + replaceOnce(universal, "r1", "r2"))),
             Catch::Contains(
                 "joint 'r2': its child 'd' hangs on another joint too, and it cannot close a loop; cut the loop"));
  CHECK_THAT(getSdfError(makeFourBar("<link name=\"d\"/><joint name=\"u\" type=\"universal\"><parent>a</parent><child>d"
                                     "</child></joint>")),
             Catch::Contains("joint 'u'") && Catch::Contains("it has no <axis>, or too few; give its direction"));
  CHECK_THAT(getSdfError(makeFourBar("<model name=\"n\"><link name=\"l\"/></model>")),
             Catch::Contains("it contains other models; put"));
}

TEST_CASE("colours, frictions, sensors and plugins that libsdformat refuses do not keep a mechanism from being read") {
  // In files of Gazebo Classic; whole files were refused for them.
  const std::string strange = R"(<visual name="v"><geometry><sphere><radius>0.1</radius></sphere></geometry>
<material><script><name>Gazebo/Red</name></script><diffuse>1 0.5 0 1</diffuse></material></visual>
<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry>
<surface><!-- </surface> > --><friction><ode><mu>-1</mu></ode></friction><surface/></surface></collision>
<sensor name="s" type="nonsense"/><sensor name="t" type="ray"><sensor>
</sensor></sensor></link>)";
  const std::string whole = makeFourBar("<plugin name=\"p\"><link/></plugin>");
  const size_t at = whole.find("</link>");
  const LoadedRobot robot = loadSdf(whole.substr(0, at) + strange + whole.substr(at + 7));
  CHECK(robot.model.mass() == 6);
  CHECK(robot.model.closures().size() == 1);
  REQUIRE(robot.model.visuals().size() == 1);
  CHECK(robot.model.visuals()[0].rgba == Eigen::Vector4d(1, 0.5, 0, 1));
  CHECK(robot.model.shapes().size() == 1);
  // Errors behind them keep their lines.
  const std::string wrong =
      replaceOnce(whole.substr(0, at) + strange + whole.substr(at + 7), "<pose>1 0 0 0 0 0</pose>", "<pose>1 x</pose>");
  const auto line = 1 + std::count(wrong.begin(), wrong.begin() + static_cast<long>(wrong.find("<pose>1 x")), '\n');
  CHECK_THAT(getError([&] { loadSdf(wrong); }),
             Catch::Contains("robot.sdf: line " + std::to_string(line) + ": libsdformat says: "));
}

TEST_CASE("joints of Drake that name a frame on either link join these frames, wherever their links are drawn") {
  const auto link = [](const std::string& name, const std::string& pose) {
    return "<link name=\"" + name + "\"><pose>" + pose +
           "</pose><inertial><pose>0.1 0.2 0.3 0 0 0</pose><mass>2</mass><inertia><ixx>1</ixx><iyy>0.8</iyy><izz>0.5"
           "</izz></inertia></inertial></link>\n";
  };
  const auto joint = [](const std::string& name, const std::string& links, const std::string& more) {
    return "<joint name=\"" + name + "\" type=\"revolute\">" + links + more + "</joint>\n";
  };
  const auto frame = [](const std::string& name, const std::string& on, const std::string& pose) {
    return "<frame name=\"" + name + "\" attached_to=\"" + on + "\"><pose>" + pose + "</pose></frame>\n";
  };
  const auto wrap = [](const std::string& model) {
    return "<sdf version=\"1.7\"><model name=\"m\">\n<link "
           "name=\"ground\"><inertial><mass>0</mass><inertia><ixx>0</ixx>"
           "<iyy>0</iyy><izz>0</izz></inertia></inertial></link><joint name=\"weld\" "
           "type=\"fixed\"><parent>world</parent>"
           "<child>ground</child></joint>\n" +
           model + "</model></sdf>";
  };
  const std::string to_a = "<parent>ground</parent><child>a</child>", to_b = "<parent>a</parent><child>b</child>";
  const std::string y = "<axis><xyz>0 1 0</xyz></axis>", x = "<axis><xyz>1 0 0</xyz></axis>";
  const LoadedRobot plain = loadSdf(wrap(link("a", "0 0 1 0 0 0") + link("b", "0.3 0 1.5 0 0 -0.4") +
                                         joint("one", to_a, y) + joint("two", to_b, "<pose>0 0 0 0 0 0.4</pose>" + x)));
  const auto makeFrames = [](const std::string& parent, const std::string& child) {
    return "<drake:parent_frame>" + parent + "</drake:parent_frame><drake:child_frame>" + child +
           "</drake:child_frame>";
  };
  const std::string drawn = link("a", "5 5 5 1 1 1") + link("b", "-3 2 1 0.1 0.2 0.3") +
                            frame("C", "b", "0 0 0 0 0 0.4") + frame("P", "a", "0.3 0 0.5 0 0 0") +
                            frame("W", "ground", "0 0 1 0 0 0");
  const LoadedRobot drake = loadSdf(
      wrap(drawn + joint("one", to_a, makeFrames("W", "a") + y) + joint("two", to_b, makeFrames("P", "C") + x)));
  CHECK(drake.warnings.empty());
  const Difference d = compare(plain.model, drake.model, plain.model.makeNeutral());
  CHECK(d.missing == "");
  CHECK(d.mass_matrix < 1e-12);
  CHECK(d.bias < 1e-12);

  // Not assembled in the file: rods of 1, 4.8 and 2 m on ground of 4 m.
  const LoadedRobot open = loadSdf(
      wrap(link("a", "0 0 0 0 0 0") + link("b", "0 0 1 0 0 0") + link("c", "9 0 0 0 0 0") +
           frame("A0", "ground", "-2 0 0 0 0 0") + frame("D0", "ground", "2 0 0 0 0 0") +
           frame("A1", "a", "0 0 1 0 0 0") + frame("B1", "b", "-2.4 0 0 0 0 0") + frame("B2", "b", "2.4 0 0 0 0 0") +
           frame("D1", "c", "0 0 2 0 0 0") + joint("crank", to_a, makeFrames("A0", "a") + y) +
           joint("rocker", "<parent>ground</parent><child>c</child>", makeFrames("D0", "c") + y) +
           joint("rod", to_b, makeFrames("A1", "B1") + y) +
           joint("pin", "<parent>b</parent><child>c</child>", makeFrames("B2", "D1") + y)));
  const Model& model = open.model;
  REQUIRE(model.closures().size() == 1);
  const Closure& pin = model.closures()[0];
  CHECK((pin.X_B1.p - Vector3d(4.8, 0, 0)).norm() < 1e-12);
  CHECK((pin.X_B2.p - Vector3d(0, 0, 2)).norm() < 1e-12);
  CHECK((model.joints()[model.findJoint("rod")].X_PJ.p - Vector3d(0, 0, 1)).norm() < 1e-12);
  CHECK((model.joints()[model.findJoint("rocker")].X_PJ.p - Vector3d(2, 0, 0)).norm() < 1e-12);
  const AssemblyResult closed = assembleReference(model, "initial");
  CHECK(closed.status == NumericalStatus::Ok);
  CHECK(calcMobility(model, closed.q).mobility == 1);

  CHECK_THAT(
      getError([&] { loadSdf(wrap(drawn + joint("one", to_a, "<drake:child_frame>a</drake:child_frame>" + y))); }),
      Catch::Contains("on one of its links alone") && Catch::Contains("give both"));
  CHECK_THAT(getError([&] { loadSdf(wrap(drawn + joint("one", to_a, makeFrames("P", "a") + y))); }),
             Catch::Contains("not fixed to link 'ground'"));
}
