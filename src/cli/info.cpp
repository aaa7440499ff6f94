// bielle info: the elements of a robot, and whether its loops close.
#include <iostream>

#include "bielle/results/robot_info.h"
#include "cli/commands.h"
#include "cli/table.h"

namespace bielle::cli {
namespace {

void printSection(const Json& robot, const char* key, const char* title, std::vector<std::string> columns) {
  if (robot[key].empty()) return;
  for (const auto& item : robot[key].front().items())  // one column per posture
    if (item.key().rfind("gap ", 0) == 0 || item.key().rfind("length ", 0) == 0) columns.push_back(item.key());
  std::cout << "\n" << title << "\n";
  printTable(std::cout, robot[key], columns);
}

// Of rods on two balls.
std::string describeSpins(int count) {
  return count == 0 ? "" : " of which " + std::to_string(count) + (count == 1 ? " idle spin" : " idle spins");
}

std::string describeLocked(int count) {
  return count == 0 ? "" : "; " + std::to_string(count) + " more if numbers of its linkages fitted, see the warnings";
}

void printInfo(const Json& robot) {
  const auto count = [&robot](const char* key) { return std::to_string(robot[key].get<int>()); };
  const Json& mobility = robot["mobility"];
  std::cout << robot["name"].get<std::string>() << " (" << robot["directory"].get<std::string>() << ")\n";
  printTable(std::cout,
             std::vector<Row>{{"mass", formatNumber(robot["mass"]) + " kg"},
                              {"base", robot["base"].get<std::string>()},
                              {"coordinates", "nq " + count("nq") + ", nv " + count("nv")},
                              {"motors", count("nu")},
                              {"closure rows", count("closure_rows") + ", rank " + mobility["rank"].dump() + " at " +
                                                   mobility["posture"].get<std::string>() +
                                                   (mobility["closed"].get<bool>() ? "" : ", where loops are open")},
                              {"mobility", mobility["mobility"].dump() + describeSpins(mobility["idle_spins"]) +
                                               describeLocked(mobility["locked"])}});
  printSection(robot, "joints", "joints", {"name", "kind", "parent", "child", "nq", "nv"});
  printSection(robot, "closures", "closures (gaps in m and rad)",
               {"name", "kind", "frame1", "frame2", "rows", "loop_dofs"});
  printSection(robot, "clusters", "clusters of closures", {"closures", "rows", "dofs"});
  printSection(robot, "lengths", "lengths from pivot to pivot of bodies in loops (m)",
               {"body", "from", "to", "length"});
  printSection(robot, "motors", "motors", {"name", "armature", "effort_limit", "velocity_limit"});
  printSection(
      robot, "drives", "windings and gears of motors (N m/A, ohm, V, A, N m; kg, part of the links)",
      {"name", "type", "ratio", "torque_constant", "resistance", "voltage", "current", "continuous_effort", "mass"});
  printSection(
      robot, "joint_forces", "springs, dampers and friction on joints (N m, rad, s; N, m, s where prismatic)",
      {"name", "stiffness", "rest", "preload", "damping", "friction", "friction_speed", "stiction", "stribeck_speed"});
  printSection(robot, "point_springs", "springs and dampers between points (N/m, m, N, N s/m)",
               {"name", "body1", "body2", "stiffness", "rest", "preload", "damping"});
  printSection(robot, "play", "play in worlds, from stop to stop (rad, m)", {"name", "size"});
  printSection(robot, "rod_friction", "friction of rod ends in worlds (over the force of the closure; m, rad/s)",
               {"name", "coefficient", "radius", "friction_speed", "stiction", "stribeck_speed", "joints"});
  printSection(robot, "contacts", "contacts (length and width in m)", {"name", "kind", "body", "sole"});
  const Json& shapes = robot["shapes"];
  const std::string title = "least distances between shapes (m), " + shapes["given"].dump() + " from the files, " +
                            shapes["fitted"].dump() + " fitted to visuals";
  printSection(robot, "distances", title.c_str(), {"between", "distance", "body1", "body2", "posture"});
  printSection(robot, "references", "references", {"name", "closed", "message"});
  printSection(robot, "dead_points", "distances of linkages from their nearest dead points (rad, m where prismatic)",
               {"reference", "linkage", "distance", "of"});
  printSection(robot, "reference_joints", "joints of references, as given and as assembled (rad, m)",
               {"reference", "joint", "given", "assembled"});
}

}  // namespace

void addInfo(CLI::App& command, Action& action) {
  const auto robot = std::make_shared<RobotArgument>();
  const auto as_json = std::make_shared<bool>(false);
  addRobot(command, *robot);
  addRobotFlags(command, *robot);
  command.add_flag("--json", *as_json, "print JSON");
  command.footer(
      "The gap of a closure is given at the neutral configuration and at each reference: the distance of its frames in "
      "m and\n"
      "the angle between them in rad. Warnings about the files are printed on the standard error.\n"
      "Examples:\n"
      "  bielle info bipetto\n"
      "  bielle info path/to/my_robot.urdf --fixed-base --json");
  command.callback([&action, robot, as_json] {
    action = [=] {
      const Json json = parseJson(makeRobotInfo(robot->load()));
      if (*as_json)
        std::cout << formatJson(json) << "\n";
      else
        printInfo(json);
      return kOk;
    };
  });
}

}  // namespace bielle::cli
