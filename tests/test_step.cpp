// STEP files: what OpenCASCADE reads back is where and as large as the model's drawing.
#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <catch2/catch.hpp>
#include <map>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "robot_directory.h"
#include "run_command.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

namespace {

// Of all solids of a link: mm^3, and mm in the world.
struct Volume {
  double volume = 0;
  Vector3d center = Vector3d::Zero();

  void add(double more, const Vector3d& at) {
    center = (volume * center + more * at) / (volume + more);
    volume += more;
  }
};

std::string getName(const TDF_Label& label) {
  Handle(TDataStd_Name) name;
  REQUIRE(label.FindAttribute(TDataStd_Name::GetID(), name));
  return TCollection_AsciiString(name->Get()).ToCString();
}

struct ReadStep {
  std::string robot;
  std::map<std::string, Volume> links;
  int colors = 0;
};

ReadStep readStep(const std::string& path) {
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
  STEPCAFControl_Reader reader;
  REQUIRE(reader.ReadFile(path.c_str()) == IFSelect_RetDone);
  REQUIRE(reader.Transfer(document));
  const Handle(XCAFDoc_ShapeTool) shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  TDF_LabelSequence roots, components, colors;
  shapes->GetFreeShapes(roots);
  REQUIRE(roots.Length() == 1);
  shapes->GetComponents(roots.First(), components);
  ReadStep out;
  out.robot = getName(roots.First());
  for (const TDF_Label& component : components) {
    GProp_GProps properties;
    BRepGProp::VolumeProperties(shapes->GetShape(component), properties);
    const gp_Pnt center = properties.CentreOfMass();
    out.links[getName(component)].add(properties.Mass(), {center.X(), center.Y(), center.Z()});
  }
  XCAFDoc_DocumentTool::ColorTool(document->Main())->GetColors(colors);
  out.colors = colors.Length();
  return out;
}

std::map<std::string, Volume> measureDrawing(const Model& model) {
  Workspace ws(model);
  updatePlacements(model, ws, findClosedConfiguration(model).q);
  std::map<std::string, Volume> out;
  for (const Visual& visual : model.visuals()) {
    const Vector3d& size = visual.size;
    double volume = size.prod();
    if (visual.shape == Visual::Shape::Cylinder) volume = M_PI * size[0] * size[0] * size[1];
    if (visual.shape == Visual::Shape::Sphere) volume = 4 * M_PI / 3 * std::pow(size[0], 3);
    out[model.bodies()[static_cast<size_t>(visual.body)].name].add(1e9 * volume,
                                                                   1e3 * (ws.X_WB[visual.body] * visual.X_BV).p);
  }
  return out;
}

bool agree(const Volume& a, const Volume& b) {
  return std::abs(a.volume - b.volume) < 1e-6 * b.volume && (a.center - b.center).norm() < 1e-4;
}

}  // namespace

TEST_CASE("step: links come back by name, with their places and volumes") {
  const RobotDirectory directory;
  const std::string path = directory.path() + "/robot.step";
  for (const char* robot : {"leg_biped", "fourbar"}) {
    CAPTURE(robot);
    const CommandResult run = runCommand({BIELLE_COMMAND, "convert", robot, "--to", "step", "-o", path});
    INFO(run.err);
    REQUIRE(run.status == 0);
    const ReadStep read = readStep(path);
    CHECK(read.robot == robot);
    CHECK(read.colors > 1);
    const std::map<std::string, Volume> drawing = measureDrawing(loadRobot(robot).model);
    CHECK(read.links.size() == drawing.size());
    for (const auto& [name, expected] : drawing) {
      CAPTURE(name);
      REQUIRE(read.links.count(name) == 1);
      CHECK(agree(read.links.at(name), expected));
      Volume moved = expected;
      moved.center.x() += 1e-3;
      CHECK_FALSE(agree(read.links.at(name), moved));
    }
  }
  const CommandResult lost =
      runCommand({BIELLE_COMMAND, "convert", "fourbar", "--to", "step", "-o", "/nowhere/robot.step"});
  CHECK(lost.status == 2);
  CHECK_THAT(lost.err, Contains("/nowhere/robot.step"));
}
