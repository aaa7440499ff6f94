// The content of a report's page, read as text. (test_report_page.py opens it in a browser.)
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "bielle/model/error.h"
#include "bielle/motion/squat.h"
#include "bielle/report/report.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "results/motion_strip.h"
#include "robot_directory.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;
using nlohmann::json;

namespace {

json getData(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const size_t begin = page.find(open) + open.size();
  return json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

// An independent reading of the tables of the page.
RowMatrixXd readTable(const json& table) {
  const std::string text = table["data"];
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (char c : text) {
    if (c == '=') break;
    bits = (bits << 6 | static_cast<unsigned>(digits.find(c))) & 0xffffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  RowMatrixXd out(table["rows"].get<int>(), table["cols"].get<int>());
  REQUIRE(bytes.size() == 4 * static_cast<size_t>(out.size()));
  for (int i = 0; i < out.size(); ++i) {
    float value;
    std::memcpy(&value, bytes.data() + 4 * i, 4);
    out.data()[i] = value;
  }
  return out;
}

void writeShortSquat(const std::string& directory) {
  const LoadedRobot robot = loadRobot("bipetto");
  SquatOptions options;
  options.duration = 0.12;
  options.settle = 0;
  options.time_step = 0.03;
  const Motion motion = makeSquat(robot.model, options);
  FddpSummary summary;
  summary.log.resize(2);
  writeResult(directory, makeResult({"bipetto", "", {"bielle"}}, {motion, motion.guess, summary}));
}

// A record of two nodes that fits any robot with names of its own.
void writeStillResult(const std::string& directory, const std::string& robot, const MotionRecord& names,
                      const json& summary = json::object()) {
  MotionRecord record = names;
  const auto count = [](const auto& list) { return static_cast<Eigen::Index>(list.size()); };
  record.time = VectorXd::LinSpaced(2, 0, 1);
  record.q = RowMatrixXd::Zero(2, count(names.q_names));
  record.v = RowMatrixXd::Zero(2, count(names.v_names));
  record.a = RowMatrixXd::Zero(1, count(names.v_names));
  record.u = RowMatrixXd::Zero(1, count(names.u_names));
  record.closure_wrenches = RowMatrixXd::Zero(1, 6 * count(names.closure_names));
  record.contact_wrenches = RowMatrixXd::Zero(1, 6 * count(names.contact_names));
  record.com = RowMatrixXd::Zero(2, 3);
  record.gap = RowMatrixXd::Zero(2, 2);
  fs::create_directories(directory);
  writeNpz(directory + "/trajectory.npz", record);
  json whole = {{"robot", robot}, {"motion", "rest"}};
  whole.update(summary);
  std::ofstream(directory + "/summary.json") << whole.dump();
}

const char* const kArm = R"(<robot name="arm"><link name="world"/>
  <link name="a"><inertial><origin xyz="0.5 0 0"/><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="world"/><child link="a"/><axis xyz="0 1 0"/></joint></robot>)";

MotionRecord getArmNames() {
  MotionRecord names;
  names.q_names = names.v_names = {"shoulder"};
  return names;
}

}  // namespace

TEST_CASE("the page holds the placements of the bodies, seen by the centre of mass and the feet") {
  const RobotDirectory directory;
  const std::string place = directory.path() + "/squat";
  writeShortSquat(place);
  const MotionRecord record = readRecord(place + "/trajectory.npz");
  const Model model = loadRobot("bipetto").model;
  const json run = getData(makeReport({place}))["runs"][0];
  const RowMatrixXd placements = readTable(run["motion"]["placements"]);
  REQUIRE(placements.cols() == 7 * model.numBodies());
  const std::vector<DeadPointTrace> linkages = traceDeadPoints(model, record.q, 60);
  const RowMatrixXd distances = readTable(run["motion"]["dead_points"]);
  REQUIRE(run["motion"]["linkages"].size() == linkages.size());
  REQUIRE(distances.cols() == static_cast<Eigen::Index>(linkages.size()));
  REQUIRE(distances.rows() == record.q.rows());
  for (size_t i = 0; i < linkages.size(); ++i) {
    CHECK(run["motion"]["linkages"][i] == linkages[i].output);
    const double least = linkages[i].getNearest().distance,
                 shown = distances(linkages[i].getNearestNode(), static_cast<Eigen::Index>(i));
    CHECK((std::isfinite(least) ? shown == Approx(least) : std::isnan(shown)));
  }
  for (int k = 0; k < placements.rows(); ++k) {
    Vector3d moment = Vector3d::Zero();
    for (int i = 1; i < model.numBodies(); ++i) {
      const auto row = placements.row(k).segment<7>(7 * i);
      const Eigen::Quaterniond turn(row[6], row[3], row[4], row[5]);
      const Inertia& inertia = model.bodies()[i].inertia;
      moment += inertia.mass * (row.head<3>().transpose() + turn * inertia.com);
    }
    CHECK((moment / model.mass() - record.com.row(k).transpose()).norm() < 1e-6);
  }
  const RowMatrixXd feet = readTable(run["motion"]["feet"]);
  CHECK(std::abs(feet(0, 1) - 0.125) < 1e-6);  // where bipetto.yaml puts them
  CHECK(std::abs(feet(0, 4) + 0.125) < 1e-6);
  CHECK(run["motion"]["footprints"].size() == 2);
  CHECK((readTable(run["motion"]["u"]) - record.u).norm() < 1e-5);
  // The force of each foot acts at its centre of pressure: there it has no moment but about the vertical.
  const RowMatrixXd pressure = readTable(run["motion"]["pressure"]);
  for (int k = 0; k < record.u.rows(); ++k)
    for (int c = 0; c < 2; ++c) {
      const auto wrench = record.contact_wrenches.row(k).segment<6>(6 * c);
      const Vector3d force = wrench.head<3>(), moment = wrench.tail<3>();
      const Vector3d rest = moment - Vector3d(pressure(k, 2 * c), pressure(k, 2 * c + 1), 0).cross(force);
      CHECK(rest.head<2>().norm() < 1e-4);
    }
}

TEST_CASE("several results stand on one page, with labels that tell them apart") {
  const RobotDirectory directory;
  directory.write("arm.urdf", kArm);
  const std::string robot = directory.path() + "/arm.urdf";
  for (const char* place : {"/one/squat", "/two/squat", "/jump"})
    writeStillResult(directory.path() + place, robot, getArmNames());
  const json data = getData(
      makeReport({directory.path() + "/one/squat/", directory.path() + "/two/squat", directory.path() + "/jump"}));
  REQUIRE(data["runs"].size() == 3);
  CHECK(data["runs"][0]["label"] == "one/squat");
  CHECK(data["runs"][1]["label"] == "two/squat");
  CHECK(data["runs"][2]["label"] == "jump");
  CHECK(data["runs"][0]["check"].is_null());
  CHECK(getData(makeReport({directory.path() + "/jump", directory.path() + "/jump"}))["runs"].size() == 2);
}

TEST_CASE("no name can leave the data of the page") {
  const RobotDirectory directory;
  const std::string evil = "</script><script>alert(1)</script><!--{data}-->\xff";
  directory.write("arm.urdf", kArm);
  writeStillResult(directory.path() + "/r", directory.path() + "/arm.urdf", getArmNames());
  const auto countScripts = [&] {
    const std::string page = makeReport({directory.path() + "/r"});
    size_t count = 0;
    for (size_t at = 0; (at = page.find("</script", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  const size_t scripts = countScripts();
  CHECK(scripts > 5);
  writeStillResult(directory.path() + "/r", directory.path() + "/arm.urdf", getArmNames(),
                   {{"motion", evil.substr(0, evil.size() - 1)}, {evil.substr(0, 9), 1}});
  CHECK(countScripts() == scripts);
  const json run = getData(makeReport({directory.path() + "/r"}))["runs"][0];
  CHECK(run["summary"]["motion"] == evil.substr(0, evil.size() - 1));
  // Names that are no UTF-8 are shown as well as may be.
  fs::create_directories(directory.path() + "/" + evil.substr(evil.size() - 4));
  writeStillResult(directory.path() + "/" + evil.substr(evil.size() - 4), directory.path() + "/arm.urdf",
                   getArmNames());
  CHECK_NOTHROW(makeReport({directory.path() + "/" + evil.substr(evil.size() - 4)}));
}

TEST_CASE("bodies without shapes are drawn as rods, meshes as they are on the disk") {
  const RobotDirectory directory;
  directory.write("arm.urdf", kArm);
  writeStillResult(directory.path() + "/r", directory.path() + "/arm.urdf", getArmNames());
  const auto getRobot = [&] { return getData(makeReport({directory.path() + "/r"}))["runs"][0]["robot"]; };
  const json bare = getRobot();
  // A ball at the joint and a rod to the centre of mass.
  REQUIRE(bare["visuals"].size() == 2);
  CHECK(bare["visuals"][0]["shape"] == "sphere");
  CHECK(bare["visuals"][1]["shape"] == "cylinder");
  CHECK(bare["visuals"][1]["size"][1].get<double>() == Approx(0.5));
  CHECK(bare["visuals"][1]["pose"][0].get<double>() == Approx(0.25));

  for (const char* name : {"meshes/a.stl", "package://thing/meshes/a.STL", "package://meshes/a.stl"}) {
    CAPTURE(name);
    const std::string visual =
        std::string("<visual><geometry><mesh filename=\"") + name + "\"/></geometry></visual></link>";
    directory.write("arm.urdf", replaceOnce(kArm, "</inertial></link>", "</inertial>" + visual));
    fs::remove_all(directory.path() + "/meshes");
    fs::remove_all(directory.path() + "/thing");
    CHECK(getRobot()["meshes"].empty());
    CHECK(getRobot()["visuals"] == bare["visuals"]);
    directory.write("meshes/a.stl", "solid a");
    directory.write("thing/meshes/a.STL", "solid a");
    const json robot = getRobot();
    REQUIRE(robot["meshes"].size() == 1);
    CHECK(robot["meshes"][0] == "c29saWQgYQ==");
    CHECK(robot["visuals"].size() == 1);
    directory.write("meshes/a.stl", std::string(3'100'000, 'x'));
    directory.write("thing/meshes/a.STL", std::string(3'100'000, 'x'));
    CHECK(getRobot()["meshes"].empty());
  }
}

TEST_CASE("springs and dampers between points are on the page, with the bodies and points that they tie") {
  const RobotDirectory directory;
  directory.write("arm/arm.urdf", kArm);
  directory.write(
      "arm/arm.yaml",
      "point_springs:\n  coil: {frames: [world, a], points: [[1, 2, 3], [0.5, 0, 0]], stiffness: 9, rest: 1}\n"
      "  dashpot: {frames: [a, world], damping: 2}\n");
  writeStillResult(directory.path() + "/r", directory.path() + "/arm", getArmNames());
  const json springs = getData(makeReport({directory.path() + "/r"}))["runs"][0]["robot"]["springs"];
  REQUIRE(springs.size() == 2);
  CHECK(springs[0] == json({{"name", "coil"},
                            {"body1", 0},
                            {"point1", {1.0, 2.0, 3.0}},
                            {"body2", 1},
                            {"point2", {0.5, 0.0, 0.0}},
                            {"pulls", true},
                            {"damps", false}}));
  CHECK((springs[1]["body1"] == 1 && springs[1]["body2"] == 0));
  CHECK((!springs[1]["pulls"].get<bool>() && springs[1]["damps"].get<bool>()));
}

TEST_CASE("a directory that is none of ours is refused with the file and the remedy") {
  const RobotDirectory directory;
  directory.write("arm.urdf", kArm);
  const std::string place = directory.path() + "/r", robot = directory.path() + "/arm.urdf";
  const auto refuse = [&](const std::string& text) {
    CHECK_THROWS_AS(makeReport({place}), InputError);
    CHECK_THROWS_WITH(makeReport({place}), Catch::Contains(text));
  };
  refuse("summary.json: file: it cannot be read");
  writeStillResult(place, robot, getArmNames());
  directory.write("r/summary.json", "{");
  refuse("summary.json: JSON: ");
  directory.write("r/summary.json", "[]");
  refuse("it is not an object");
  directory.write("r/summary.json", "{}");
  refuse("key 'robot'");
  directory.write("r/summary.json", R"({"robot": 3})");
  refuse("key 'robot'");
  MotionRecord other = getArmNames();
  other.q_names = {"elbow"};
  writeStillResult(place, robot, other);
  refuse("differ from those of the robot");
  writeStillResult(place, "nobody", getArmNames());
  refuse("nobody");
  writeStillResult(place, "nobody", getArmNames(), {{"robot_file", robot}});
  CHECK_NOTHROW(makeReport({place}));
  fs::remove(place + "/trajectory.npz");
  refuse("trajectory.npz: file: it cannot be read");
  CHECK_THROWS_AS(makeReport({}), InputError);
  CHECK_THROWS_WITH(writeReport("/nonexistent/report.html", {place}), Catch::Contains("trajectory.npz"));
}

namespace {

// Numbers of the first element of each picture that the pattern finds: rows of its groups.
std::vector<std::vector<double>> findNumbers(const std::string& svg, const std::string& pattern) {
  std::vector<std::vector<double>> rows;
  const std::regex element(pattern);
  for (auto it = std::sregex_iterator(svg.begin(), svg.end(), element); it != std::sregex_iterator(); ++it) {
    rows.emplace_back();
    for (size_t i = 1; i < it->size(); ++i) rows.back().push_back(std::stod((*it)[i]));
  }
  return rows;
}

}  // namespace

TEST_CASE("in a strip links and steps have the direction and the length of their orthographic projection") {
  const RobotDirectory directory;
  const Model model = loadRobot(directory.write("arm.urdf", kArm)).model;
  MotionRecord record = getArmNames();
  record.time = VectorXd::LinSpaced(2, 0, 1);
  record.q = RowMatrixXd(2, 1);
  record.q << 0, M_PI / 2;  // along x, then hanging
  record.com = RowMatrixXd(2, 3);
  record.com << 0.5, 0, 0, 0, 0, -0.5;
  Ground ground;
  ground.height = -1;
  const double pitch = 0.3;
  ground.steps.push_back({Vector3d(0.5, 0.1, -0.5), 0.2, 0.1, 0, pitch, 0});
  ground.steps.push_back({Vector3d(50, 0, -0.5), 0.2, 0.1, 0, 0, 0});  // far away
  const std::string svg = drawMotionStrip(model, record, ground, 2);
  const auto rods = findNumbers(svg, "stroke-width=\"14\" d=\"M(-?\\d+) (-?\\d+)L(-?\\d+) (-?\\d+)\"");
  const auto coms = findNumbers(svg, "cx=\"(-?\\d+)\" cy=\"(-?\\d+)\"");
  const auto steps =
      findNumbers(svg, "fill=\"#cfd6df\"[^>]* d=\"M(-?\\d+) (-?\\d+)L(-?\\d+) (-?\\d+)L(-?\\d+) (-?\\d+)L");
  REQUIRE((rods.size() == 2 && coms.size() == 2 && steps.size() == 2));
  // The eye is at (0.5, -1, 0.35) from what it sees: by hand, what a unit vector becomes, downwards positive.
  const double n = std::sqrt(1.25), m = std::sqrt(1.3725);
  const Eigen::Vector2d x(1 / n, 0.175 / (n * m)), y(0.5 / n, -0.35 / (n * m)), z(0, -1.25 / (n * m));
  const auto subtract = [](const std::vector<double>& row, int i, int j) {
    return Eigen::Vector2d(row[2 * i] - row[2 * j], row[2 * i + 1] - row[2 * j + 1]);
  };
  const double scale = subtract(rods[1], 1, 0).norm() / (0.5 * z.norm());  // of the hanging link
  REQUIRE(scale > 500);
  CHECK((subtract(rods[1], 1, 0) + 0.5 * scale * z).norm() < 1.5);
  CHECK((subtract(rods[0], 1, 0) - 0.5 * scale * x).norm() < 1.5);
  for (size_t i = 0; i < 2; ++i) {
    CHECK(rods[i][2] == coms[i][0]);
    CHECK(rods[i][3] == coms[i][1]);
    CHECK((subtract(steps[i], 0, 1) - 0.2 * scale * (x - std::tan(pitch) * z)).norm() < 1.5);
    CHECK((subtract(steps[i], 1, 2) - 0.1 * scale * y).norm() < 1.5);
  }
  // The eye has gone along: the step is elsewhere in the second picture, by as much as the centre of mass has moved.
  CHECK((subtract(steps[1], 0, 1) - subtract(steps[0], 0, 1)).norm() < 1.5);
  const Eigen::Vector2d first(steps[0][0], steps[0][1]), second(steps[1][0], steps[1][1]);
  CHECK((second - first - 0.5 * scale * x).norm() < 1.5);
}
