#include <pybind11/stl.h>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/report/report.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/generate.h"
#include "bind.h"
#include "robot.h"

namespace bielle::python {
namespace {

Robot load(const std::string& name, const std::optional<std::string>& base) {
  LoadOptions options;
  if (base && *base != "free" && *base != "fixed")
    throw py::value_error("base: 'free' or 'fixed', got '" + *base + "'");
  if (base) options.base = *base == "free" ? BaseKind::Free : BaseKind::Fixed;
  LoadedRobot loaded = loadRobot(name, options);
  const std::vector<std::string> moved = checkReferences(loaded);
  loaded.warnings.insert(loaded.warnings.end(), moved.begin(), moved.end());
  Robot robot;
  robot.name = name;
  for (const Play& play : loaded.wear.plays) robot.play.emplace_back(play.name, play.size);
  robot.rod_frictions = loaded.wear.frictions;
  robot.model = std::make_shared<Model>(std::move(loaded.model));
  robot.file = loaded.file;
  robot.directory = loaded.directory;
  robot.warnings = loaded.warnings;
  robot.locked = loaded.locked;
  return robot;
}

Robot generate(const std::string& name, const std::string& directory,
               const std::map<std::string, OptionValue>& parameters) {
  auto model = std::make_shared<Model>(generateRobot(name, {parameters.begin(), parameters.end()}));
  if (directory.empty()) return {name, std::move(model), "", "", {}};
  writeRobot(*model, directory);
  return load(directory, {});
}

py::dict describeGenerators() {
  py::dict out;
  for (const Generator& generator : listGenerators()) {
    py::dict parameters;
    for (const Option& p : generator.parameters) parameters[py::str(p.name)] = describeOption(p);
    out[py::str(generator.name)] = parameters;
  }
  return out;
}

py::object describe(const Robot& robot) {
  std::string text;
  {
    const py::gil_scoped_release release;
    text = makeRobotInfo(toLoaded(robot));
  }
  return py::module_::import("json").attr("loads")(text);
}

std::string makeViewPage(const Robot& robot) {
  const py::gil_scoped_release release;
  return makeView(toLoaded(robot));
}

}  // namespace

void bindRobots(py::module_& module) {
  Value<RodFriction>(module, "RodFriction", "Friction of the pivots at the ends of a rod, which grows with its force.")
      .field("closure", &RodFriction::closure, "name of a ball or a hinge, which is a pivot itself, or of a weld")
      .field("coefficient", &RodFriction::coefficient, "of friction, over the force of the closure")
      .field("radius", &RodFriction::radius, "of the ball or pin, m")
      .field("friction_speed", &RodFriction::friction_speed, "below which it acts like a damper, rad/s")
      .field("stiction", &RodFriction::stiction, "coefficient at rest; that of sliding where there is no more")
      .field("stribeck_speed", &RodFriction::stribeck_speed, "at which it has fallen to that of sliding, rad/s")
      .field("joints", &RodFriction::joints, "names of further pivots that bear the same force");
  Value<Robot>(module, "Robot",
               "A robot: its model, and where it came from. `load_robot` and `generate_robot` make them.")
      .field("name", &Robot::name, "as requested")
      .field("model", &Robot::model, "Model")
      .field("file", &Robot::file, "absolute path of the .urdf, or of the .yaml without a URDF beside it; or empty")
      .field("directory", &Robot::directory, "where the files are; or empty")
      .field("warnings", &Robot::warnings, "valid but suspicious: \"file: element: problem\"")
      .field("rod_frictions", &Robot::rod_frictions, "RodFrictions in a World")
      .field("play", &Robot::play, "of joints and rods in a World, by their names: from stop to stop, rad or m")
      .type()
      .def(
          "write",
          [](const Robot& robot, const std::string& directory) {
            writeRobot(robot.get(), directory, "", makeWear(robot.play, robot.rod_frictions));
          },
          py::arg("directory"), py::call_guard<py::gil_scoped_release>(),
          "Writes DIRECTORY/NAME.urdf and .yaml, where NAME is the last component of DIRECTORY.")
      .def("info", &describe,
           "What `bielle info --json` prints: sizes, mobility, joints, closures with their gaps, motors, contacts.");
  module.def("make_view", &makeViewPage, py::arg("robot"),
             "The page that shows a Robot with a slider for each motor; its loops close as they move. Offline. HTML.");
  module.def("load_robot", &load, py::arg("name"), py::arg("base") = py::none(),
             py::call_guard<py::gil_scoped_release>(),
             "Loads a robot by name, by directory, or by .urdf or .yaml file.\n\n"
             "base: 'free' or 'fixed' overrides the robot's own. Raises InputError, whatever the files contain.");
  module.def(
      "generate_robot",
      [](const std::string& name, const std::string& directory, const py::kwargs& parameters) {
        const auto values = read<std::map<std::string, OptionValue>>(parameters, "parameters");
        const py::gil_scoped_release release;
        return generate(name, directory, values);
      },
      py::arg("name"), py::arg("directory") = "",
      "Makes a robot from named lengths, angles and masses (see `generators`), with files if a directory is given.");
  module.def("generators", &describeGenerators,
             "Parameters of every generator by name: default, unit, bounds, help, choices.");
  module.def("list_robots", &listRobots, "Names of the robots that can be loaded by name.");
  module.def("robot_directories", &getRobotDirectories, "Where robots are looked up by name.");
}

}  // namespace bielle::python
