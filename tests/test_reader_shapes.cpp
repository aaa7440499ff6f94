// Shapes of bodies match what files say of collisions, or draw; meshes too.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <sstream>

#include "bielle/model/builder.h"
#include "bielle/robots/robot_loader.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("shapes are those of <collision>, else fitted to visuals; meshes are named") {
  const auto load = [](const std::string& in_link) {
    const RobotDirectory directory;
    return loadRobot(directory.writeRobot("<robot name='r'><link name='base'/><link name='arm'>" + in_link +
                                              "</link><joint name='j' type='continuous'><parent link='base'/>"
                                              "<child link='arm'/></joint></robot>",
                                          "base: fixed"));
  };
  const auto collide = [](const std::string& geometry) {
    return "<collision><origin xyz='1 2 3'/><geometry>" + geometry + "</geometry></collision>";
  };
  const std::string drawn = "<visual><geometry><cylinder radius='0.01' length='0.2'/></geometry></visual>";
  const Model given =
      load(drawn + collide("<box size='0.2 0.4 0.6'/>") + collide("<sphere radius='0.3'/>") +
           collide("<cylinder radius='0.1' length='1'/>") + collide("<cylinder radius='0.1' length='0.2'/>"))
          .model;
  REQUIRE(given.shapes().size() == 4);
  const auto check = [](const Shape& shape, const Vector3d& half, double radius, const Vector3d& p, bool fitted) {
    CHECK(shape.body == 1);
    CHECK((shape.half - half).norm() < 1e-15);
    CHECK(shape.radius == radius);
    CHECK(shape.X_BS.p == p);
    CHECK(shape.fitted == fitted);
  };
  const Vector3d p(1, 2, 3), none = Vector3d::Zero();
  check(given.shapes()[0], {0.1, 0.2, 0.3}, 0, p, false);
  check(given.shapes()[1], none, 0.3, p, false);
  check(given.shapes()[2], {0, 0, 0.5}, 0.1, p, false);    // a long cylinder: a capsule around it
  check(given.shapes()[3], {0.1, 0.1, 0.1}, 0, p, false);  // a short one: a box around it

  const Model fitted = load(drawn).model;
  REQUIRE(fitted.shapes().size() == 1);
  check(fitted.shapes()[0], {0, 0, 0.1}, 0.01, none, true);
  CHECK(ModelBuilder::restore(takeParts(fitted)).shapes().size() == 1);

  const LoadedRobot meshed = load(drawn + collide("<mesh filename='arm.stl'/>"));
  REQUIRE(meshed.model.shapes().size() == 1);
  CHECK(meshed.model.shapes()[0].fitted);
  REQUIRE(meshed.warnings.size() == 1);
  CHECK_THAT(meshed.warnings[0], Catch::Contains("1 mesh(es) cannot be read, among them 'arm.stl'"));
}

namespace {

// The corners of a turned box with the given half edges, each one three times: eight triangles.
std::vector<Vector3d> listCorners(const Vector3d& half, const Matrix3d& R) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 24; ++i)
    corners.push_back(
        R * Vector3d(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(), i & 4 ? half.z() : -half.z()));
  return corners;
}

std::string makeBinaryStl(const std::vector<Vector3d>& corners) {
  std::string stl(80, ' ');
  const auto append = [&](const auto& value) { stl.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(static_cast<std::uint32_t>(corners.size() / 3));
  for (size_t i = 0; i < corners.size(); ++i) {
    if (i % 3 == 0)
      for (int k = 0; k < 3; ++k) append(0.0f);
    for (int k = 0; k < 3; ++k) append(static_cast<float>(corners[i][k]));
    if (i % 3 == 2) stl.append(2, '\0');
  }
  return stl;
}

std::string makeText(const std::vector<Vector3d>& corners, const std::string& keyword) {
  std::ostringstream out;
  out.precision(9);
  for (const Vector3d& p : corners) out << "  " << keyword << ' ' << p.transpose() << '\n';
  return out.str();
}

// In centimetres, and moved back by its node.
std::string makeCollada(const std::vector<Vector3d>& corners, const std::string& more = "") {
  std::ostringstream numbers, indices;
  numbers.precision(9);
  for (size_t i = 0; i < corners.size(); ++i) {
    numbers << (100 * corners[i] + Vector3d(1, 2, 3)).transpose() << ' ';
    indices << i << ' ';
  }
  const std::string count = std::to_string(corners.size());
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="a" count=")" +
         std::to_string(3 * corners.size()) + "\">" + numbers.str() + R"(</float_array><technique_common>
    <accessor source="#a" count=")" +
         count +
         R"(" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
    </accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count=")" +
         std::to_string(corners.size() / 3) + R"("><input semantic="VERTEX" source="#v" offset="0"/><p>)" +
         indices.str() +
         R"(</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><translate>-1 -2 -3</translate>
  <instance_geometry url="#g"/></node>)" +
         more + R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";
}

}  // namespace

TEST_CASE(
    "shapes are fitted to meshes of STL, OBJ and COLLADA files: boxes and capsules around all vertices, damaged files "
    "to none") {
  const RobotDirectory directory;
  const auto load = [&](const std::string& mesh, const std::string& content, const std::string& kind = "visual") {
    directory.write(mesh, content);
    return loadRobot(directory.writeRobot(
        "<robot name='r'><link name='base'/><link name='arm'><" + kind +
            "><origin xyz='1 2 3'/><geometry><mesh filename='" + mesh + "' scale='0.1 0.1 0.1'/></geometry></" + kind +
            "></link><joint name='j' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>",
        "base: fixed"));
  };
  // A box that lies askew, in every format.
  const Matrix3d R = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const std::vector<Vector3d> corners = listCorners({4, 2, 1}, R);
  for (const auto& [mesh, content] : {std::pair<std::string, std::string>("a.stl", makeBinaryStl(corners)),
                                      {"b.STL", "solid b\n" + makeText(corners, "vertex")},
                                      {"c.obj", makeText(corners, "v") + "vn 0 0 1\nf 1 2 3\n"},
                                      {"d.dae", makeCollada(corners)}}) {
    CAPTURE(mesh);
    for (const std::string kind : {"visual", "collision"}) {
      const LoadedRobot robot = load(mesh, content, kind);
      CHECK(robot.warnings.empty());
      REQUIRE(robot.model.shapes().size() == 1);
      const Shape& shape = robot.model.shapes()[0];
      CHECK(shape.fitted == (kind == "visual"));
      CHECK(shape.radius == 0);
      CHECK(shape.half.prod() == Approx(0.4 * 0.2 * 0.1).epsilon(1e-5));
      for (const Vector3d& p : corners) {
        const Vector3d local = shape.X_BS.inverse().act(0.1 * p + Vector3d(1, 2, 3));
        CHECK((local.cwiseAbs() - shape.half).maxCoeff() < 1e-7);
      }
      CHECK(ModelBuilder::restore(takeParts(robot.model)).shapes().size() == 1);
    }
  }
  // A long cylinder: a capsule holds it with least room.
  std::vector<Vector3d> rod;
  for (int i = 0; i < 72; ++i) {
    const double angle = EIGEN_PI / 18 * i;
    rod.push_back(R * Vector3d(std::cos(angle), std::sin(angle), i % 2 ? 10 : -10));
  }
  const Shape capsule = load("rod.obj", makeText(rod, "v")).model.shapes().at(0);
  CHECK(capsule.radius == Approx(0.1).epsilon(1e-6));
  CHECK(capsule.half.x() == 0);
  CHECK(capsule.half.z() == Approx(1).epsilon(1e-4));  // what is written is rounded
  CHECK(std::abs((capsule.X_BS.R.transpose() * R)(2, 2)) == Approx(1));

  const std::string binary = makeBinaryStl(corners);
  std::vector<Vector3d> infinite = corners;
  infinite[4].x() = std::numeric_limits<double>::infinity();
  for (const auto& [mesh, content] :
       {std::pair<std::string, std::string>("d.stl", binary.substr(0, 100)),
        {"d.stl", ""},
        {"d.stl", makeBinaryStl(infinite)},
        {"d.stl", "vertex 1 2"},
        {"d.obj", "v 1 2 x"},
        {"d.dae", binary},
        {"d.dae", makeCollada(corners).substr(0, 900)},
        {"d.dae", makeCollada(corners, "<node id='m'><instance_node url='#m'/></node>")},
        {"d.dae", makeCollada(corners, "<node><skew>45 0 1 0 1 0 0</skew></node>")},
        {"d.dae", makeCollada(corners, "<node><lookat>1 0 0 0 0 0 0 1 0</lookat></node>")},
        {"d.ply", binary}}) {
    CAPTURE(mesh, content);
    const LoadedRobot robot = load(mesh, content);
    CHECK(robot.model.shapes().empty());
    REQUIRE(robot.warnings.size() == 1);
    CHECK_THAT(robot.warnings[0], Catch::Contains("cannot be read, among them 'd."));
  }
}

TEST_CASE("mutated meshes give finite shapes or none") {
  const RobotDirectory directory;
  std::mt19937 rng(71);
  const std::vector<Vector3d> corners = listCorners({4, 2, 1}, Matrix3d::Identity());
  int fitted = 0, none = 0;
  for (const auto& [mesh, content] : {std::pair<std::string, std::string>("a.stl", makeBinaryStl(corners)),
                                      {"b.stl", makeText(corners, "vertex")},
                                      {"c.obj", makeText(corners, "v")},
                                      {"d.dae", makeCollada(corners)}})
    for (int i = 0; i < 300; ++i) {
      std::string mutated = content;
      for (int n = 0; n <= i % 4; ++n) mutated[rng() % mutated.size()] = static_cast<char>(rng());
      if (i % 10 == 9) mutated.resize(rng() % mutated.size());
      CAPTURE(mesh, i);
      directory.write(mesh, mutated);
      const Model model =
          loadRobot(directory.writeRobot("<robot name='r'><link name='base'><visual><geometry><mesh filename='" + mesh +
                                             "'/></geometry></visual></link></robot>",
                                         "base: free"))
              .model;
      (model.shapes().empty() ? none : fitted) += 1;
      for (const Shape& shape : model.shapes()) {
        CHECK(shape.X_BS.p.allFinite());
        CHECK((shape.X_BS.R.transpose() * shape.X_BS.R - Matrix3d::Identity()).norm() < 1e-9);
        CHECK(shape.half.allFinite());
        CHECK(shape.half.minCoeff() >= 0);
        CHECK(std::isfinite(shape.radius));
      }
    }
  CHECK(fitted > 100);
  CHECK(none > 50);
}
