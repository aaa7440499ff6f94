// The builder: what it derives from the tree (dofs, supports, closures' dofs, clusters) and what it refuses.
#include <catch2/catch.hpp>
#include <functional>

#include "bielle/model/builder.h"
#include "get_error.h"
#include "infinity.h"
#include "math/so3.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Joint makeJoint(const std::string& name, JointKind kind, const Vector3d& p = Vector3d::Zero()) {
  Joint joint;
  joint.name = name;
  joint.kind = kind;
  joint.X_PJ.p = p;
  return joint;
}

Inertia makeBall(double mass) { return {mass, Vector3d::Zero(), 0.01 * mass * Matrix3d::Identity()}; }

// base (free) with two legs: a: revolute a1, universal a2; b: revolute b1, spherical b2; and an arm c off the base.
ModelBuilder makeTree() {
  ModelBuilder builder("tree", "tree.urdf");
  builder.addLink("base", "world", makeJoint("root", JointKind::FreeFlyer), makeBall(2));
  builder.addLink("a1", "base", makeJoint("ja1", JointKind::Revolute, {0.1, 0, 0}), makeBall(1));
  builder.addLink("a2", "a1", makeJoint("ja2", JointKind::Universal, {0, 0, -0.3}), makeBall(1));
  builder.addLink("b1", "base", makeJoint("jb1", JointKind::Revolute, {-0.1, 0, 0}), makeBall(1));
  builder.addLink("b2", "b1", makeJoint("jb2", JointKind::Spherical, {0, 0, -0.3}), makeBall(1));
  builder.addLink("c", "base", makeJoint("jc", JointKind::Prismatic), makeBall(1));
  return builder;
}

std::string getErrorOf(const std::function<void(ModelBuilder&)>& mistake) {
  ModelBuilder builder = makeTree();
  return getError([&] {
    mistake(builder);
    builder.build();
  });
}

}  // namespace

TEST_CASE("sizes, indices, supports and dofs of a tree") {
  const Model model = makeTree().build();
  CHECK(model.nq() == 7 + 1 + 2 + 1 + 4 + 1);
  CHECK(model.nv() == 6 + 1 + 2 + 1 + 3 + 1);
  CHECK(model.numBodies() == 7);
  CHECK(model.mass() == Approx(7));
  CHECK(model.hasFreeFlyer());
  const int a2 = model.findJoint("ja2"), b2 = model.findJoint("jb2"), c = model.findJoint("jc");
  CHECK(model.supportDofs(0).empty());
  CHECK(model.supportDofs(a2) == std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(model.supportDofs(b2) == std::vector<int>{0, 1, 2, 3, 4, 5, 9, 10, 11, 12});
  CHECK(model.supportDofs(c) == std::vector<int>{0, 1, 2, 3, 4, 5, 13});
  CHECK(model.dofs()[0].parent == -1);
  CHECK(model.dofs()[7].parent == 6);
  CHECK(model.dofs()[9].parent == 5);
  CHECK(model.dofs()[7].first_of_universal);
  CHECK(model.dofs()[8].second_of_universal);
  CHECK(!model.dofs()[6].first_of_universal);
  CHECK(model.isAncestorOrSelf(1, a2));
  CHECK(model.isAncestorOrSelf(a2, a2));
  CHECK(!model.isAncestorOrSelf(a2, b2));
  CHECK(!model.isAncestorOrSelf(a2, 1));
  CHECK(model.findJoint("world") == -1);
  CHECK(model.makeNeutral()[6] == 1);
}

TEST_CASE("a closure depends on the dofs of one side only, and clusters are what shares dofs") {
  ModelBuilder builder = makeTree();
  builder.addClosure("ab", ClosureKind::Weld6D, "a2", "b2");
  builder.addClosure("cw", ClosureKind::Hinge5D, "c", "base", {0, 0, 3});
  const Model model = builder.build();
  const Closure& ab = model.closures()[0];
  CHECK(ab.dofs == std::vector<int>{6, 7, 8, 9, 10, 11, 12});
  CHECK(ab.signs == std::vector<int>{1, 1, 1, -1, -1, -1, -1});
  CHECK((model.closures()[1].axis - Vector3d::UnitZ()).norm() == 0);
  REQUIRE(model.clusters().size() == 2);
  CHECK(model.clusters()[0].rows == 6);
  CHECK(model.clusters()[1].rows == 5);
  CHECK(model.clusters()[1].dofs == std::vector<int>{13});
  CHECK(model.numClosureRows() == 11);

  builder.addClosure("bc", ClosureKind::Ball3D, "b1", "c");  // ties both clusters together
  const Model joined = builder.build();
  REQUIRE(joined.clusters().size() == 1);
  CHECK(joined.clusters()[0].rows == 14);
  CHECK(joined.clusters()[0].closures == std::vector<int>{0, 1, 2});
  CHECK(joined.clusters()[0].dofs.size() == 8);
}

TEST_CASE("a fixed joint merges its link: inertia by the parallel axes, frame by its placement") {
  ModelBuilder builder = makeTree();
  Joint weld = makeJoint("weld", JointKind::Fixed, {0, 0.2, 0});
  weld.X_PJ.R = exp3(Vector3d(0, 0, M_PI / 2));
  builder.addLink("tool", "c", weld, {3, Vector3d(0.1, 0, 0), Vector3d(0.01, 0.02, 0.03).asDiagonal()});
  builder.addFrame("tip", "tool", {Matrix3d::Identity(), Vector3d(1, 0, 0)});
  const Model model = builder.build();
  const int c = model.findJoint("jc");
  // Turned by a quarter, the tool's x is c's y: its centre stands at y = 0.2 + 0.1.
  const Inertia& inertia = model.bodies()[c].inertia;
  CHECK(inertia.mass == Approx(4));
  CHECK((inertia.com - Vector3d(0, 0.225, 0)).norm() < 1e-15);
  const double spread = 1 * 0.225 * 0.225 + 3 * 0.075 * 0.075;
  CHECK((inertia.I_com.diagonal() - Vector3d(0.01 + 0.02 + spread, 0.01 + 0.01, 0.01 + 0.03 + spread)).norm() < 1e-15);
  const Frame& tip = model.frames()[model.findFrame("tip")];
  CHECK(tip.body == c);
  CHECK((tip.X_BF.p - Vector3d(0, 1.2, 0)).norm() < 1e-15);
  CHECK(model.findJoint("weld") == -1);
  CHECK(model.mass() == Approx(10));
}

TEST_CASE("motors and limits by dof, with the tighter of two velocity limits") {
  ModelBuilder builder("arm");
  JointLimits limits;
  limits.lower = VectorXd::Constant(1, -1);
  limits.velocity = VectorXd::Constant(1, 5);
  builder.addLink("a", "world", makeJoint("ja", JointKind::Revolute), makeBall(1), limits);
  builder.addLink("b", "a", makeJoint("jb", JointKind::Universal), makeBall(1));
  builder.addMotor("ja", 0.1, 20, 3, 0.5);
  builder.setArmature("jb", 0.2);
  const Model model = builder.build();
  CHECK(model.lowerLimits()[0] == -1);
  CHECK(model.upperLimits()[0] == kInf);
  CHECK(model.velocityLimits()[0] == 3);
  CHECK((model.armature() - Vector3d(0.1, 0.2, 0.2)).norm() == 0);
  CHECK(model.motors()[0].effort_limit == 20);
  CHECK(model.motors()[0].torqueLoss() == 0.5);
}

TEST_CASE("axes are made unit vectors") {
  ModelBuilder builder("arm");
  Joint joint = makeJoint("ja", JointKind::Revolute);
  joint.axis = {0, 3, 4};
  builder.addLink("a", "world", joint, makeBall(1));
  CHECK((builder.build().joints()[1].axis - Vector3d(0, 0.6, 0.8)).norm() < 1e-15);
}

TEST_CASE("what cannot be a robot is refused by name") {
  using Catch::Contains;
  const auto named = [](const std::string& element) { return Contains("tree.urdf: " + element + ": "); };
  using B = ModelBuilder;
  const auto link = [](B& b, const std::string& name, const std::string& parent, const Joint& j,
                       const Inertia& i = makeBall(1)) { b.addLink(name, parent, j, i); };
  const Joint hinge = makeJoint("j", JointKind::Revolute);
  CHECK(getErrorOf([](B&) {}).empty());
  CHECK_THAT(getErrorOf([&](B& b) { link(b, "a1", "base", hinge); }), named("link 'a1'") && Contains("twice"));
  CHECK_THAT(getErrorOf([&](B& b) { link(b, "", "base", hinge); }), named("joint 'j'") && Contains("no name"));
  CHECK_THAT(getErrorOf([&](B& b) { link(b, "x", "nowhere", hinge); }), named("joint 'j'") && Contains("'nowhere'"));
  CHECK_THAT(getErrorOf([&](B& b) { link(b, "x", "c", makeJoint("jc", JointKind::Revolute)); }),
             named("joint 'jc'") && Contains("two joints"));
  CHECK_THAT(getErrorOf([&](B& b) {
               Joint j = makeJoint("u", JointKind::Universal);
               j.axis2 = -j.axis;
               link(b, "x", "c", j);
             }),
             named("joint 'u'") && Contains("parallel"));
  CHECK_THAT(getErrorOf([&](B& b) {
               JointLimits limits;
               limits.upper = VectorXd::Zero(2);
               b.addLink("x", "c", hinge, {}, limits);
             }),
             named("joint 'j'") && Contains("2 entries"));
  CHECK_THAT(getErrorOf([&](B& b) {
               link(b, "x", "c", hinge, {1, Vector3d::Constant(NAN), Matrix3d::Identity()});
             }),
             named("link 'x'") && Contains("finite"));
  CHECK_THAT(getErrorOf([&](B& b) {
               link(b, "x", "c", hinge, {-1, Vector3d::Zero(), Matrix3d::Identity()});
             }),
             named("link 'x'") && Contains("negative"));
  CHECK_THAT(getErrorOf([](B& b) { b.addFrame("a1", "c", {}); }), named("frame 'a1'") && Contains("twice"));
  CHECK_THAT(getErrorOf([](B& b) { b.addClosure("k", ClosureKind::Weld6D, "c", "c"); }),
             named("closure 'k'") && Contains("itself"));
  CHECK_THAT(getErrorOf([](B& b) { b.addClosure("k", ClosureKind::Weld6D, "c", "a1", Vector3d::UnitZ(), -1); }),
             named("closure 'k'") && Contains("gain"));
  CHECK_THAT(getErrorOf([](B& b) { b.addMotor("ja2"); }), named("motor 'ja2'") && Contains("universal"));
  CHECK_THAT(getErrorOf([](B& b) { b.addMotor("jc", NAN); }), named("motor 'jc'") && Contains("armature"));
  CHECK_THAT(getErrorOf([](B& b) { b.addMotor("jc", 0, NAN); }), named("motor 'jc'") && Contains("effort"));
  CHECK_THAT(getErrorOf([](B& b) { b.addMotor("jc", 0, 1, 0); }), named("motor 'jc'") && Contains("velocity"));
  CHECK_THAT(getErrorOf([](B& b) { b.addMotor("jc", 0, 1, 1, -1); }), named("motor 'jc'") && Contains("torque_loss"));
  CHECK_THAT(getErrorOf([](B& b) {
               b.addMotor("jc");
               b.setArmature("jc", 1);
             }),
             named("armature of 'jc'") && Contains("has a motor"));
  CHECK_THAT(getErrorOf([](B& b) { b.addContact("k", "c", ContactKind::Surface6D, 0.1, -0.1); }),
             named("contact 'k'") && Contains("sole"));
  CHECK_THAT(getErrorOf([](B& b) { b.setGravity(Vector3d::Constant(kInf)); }), named("gravity"));
  CHECK_THAT(getErrorOf([](B& b) {
               b.addReference({"r", {{"ja2", {0}}}, "", 0, {}, {}});
             }),
             named("reference 'r'") && Contains("1 value(s)"));
  CHECK_THAT(getErrorOf([](B& b) {
               b.addReference({"r", {{"jb2", {0, 0, 0, 0}}}, "", 0, {}, {}});
             }),
             named("reference 'r'") && Contains("unit length"));
  CHECK_THROWS_AS(ModelBuilder("empty").build(), InputError);
}

TEST_CASE("inertias with negative moments are refused, rounded ones and those that no body can have are not") {
  const auto build = [](const Vector3d& moments) {
    ModelBuilder builder("ball");
    builder.addLink("a", "world", makeJoint("j", JointKind::Revolute), {1, Vector3d::Zero(), moments.asDiagonal()});
    return builder.build().mass();
  };
  CHECK(build({0, 0.1, 0.1}) == 1);                 // a slender rod
  CHECK(build({0.1, 0.2, 0.3 * (1 + 1e-7)}) == 1);  // a plate, rounded up
  CHECK(build({0.1, 0.2, 0.301}) == 1);  // of no body, but told (test `reader_errors`)
  CHECK_THROWS_AS(build({-0.001, 0.2, 0.2}), InputError);
}
