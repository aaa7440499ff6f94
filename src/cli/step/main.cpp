// bielle-step FILE: writes the solids that it reads from the standard input (results/workshop_solids.h) as a STEP file (AP214, mm): an
// assembly of links, each a product of its own with its name, its place, its solids and their colours.
#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Builder.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Compound.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <gp_Ax2.hxx>
#include <gp_Trsf.hxx>
#include <iostream>
#include <nlohmann/json.hpp>

namespace {

using nlohmann::json;

TopLoc_Location readPlacement(const json& at) {
  gp_Trsf place;
  const auto get = [&at](size_t i) { return at.at(i).get<double>(); };
  place.SetValues(get(0), get(1), get(2), get(3), get(4), get(5), get(6), get(7), get(8), get(9), get(10), get(11));
  return TopLoc_Location(place);
}

TopoDS_Shape makeSolid(const json& solid) {
  const std::string shape = solid.at("shape");
  const std::vector<double> size = solid.at("size");
  TopoDS_Shape out;
  if (shape == "box") {
    const gp_Pnt corner(-size.at(0) / 2, -size.at(1) / 2, -size.at(2) / 2);
    out = BRepPrimAPI_MakeBox(corner, size[0], size[1], size[2]).Solid();
  } else if (shape == "cylinder") {
    const gp_Ax2 axis(gp_Pnt(0, 0, -size.at(1) / 2), gp_Dir(0, 0, 1));
    out = BRepPrimAPI_MakeCylinder(axis, size[0], size[1]).Solid();
  } else {
    out = BRepPrimAPI_MakeSphere(size.at(0)).Solid();
  }
  return out.Moved(readPlacement(solid.at("at")));
}

void setName(const TDF_Label& label, const std::string& name) {
  TDataStd_Name::Set(label, TCollection_ExtendedString(name.c_str(), true));
}

bool write(const json& drawing, const char* path) {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
  const Handle(XCAFDoc_ShapeTool) shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  const Handle(XCAFDoc_ColorTool) colors = XCAFDoc_DocumentTool::ColorTool(document->Main());
  const TDF_Label robot = shapes->NewShape();
  setName(robot, drawing.at("robot"));
  for (const json& link : drawing.at("links")) {
    BRep_Builder builder;
    TopoDS_Compound compound;
    builder.MakeCompound(compound);
    std::vector<TopoDS_Shape> solids;
    for (const json& solid : link.at("solids")) {
      solids.push_back(makeSolid(solid));
      builder.Add(compound, solids.back());
    }
    const TDF_Label product = shapes->AddShape(compound, false);
    setName(product, link.at("name"));
    for (size_t i = 0; i < solids.size(); ++i) {
      const std::vector<double> rgb = link["solids"][i].at("color");
      colors->SetColor(shapes->AddSubShape(product, solids[i]),
                       Quantity_Color(rgb.at(0), rgb.at(1), rgb.at(2), Quantity_TOC_sRGB), XCAFDoc_ColorSurf);
    }
    setName(shapes->AddComponent(robot, product, readPlacement(link.at("at"))), link.at("name"));
  }
  shapes->UpdateAssemblies();
  Interface_Static::SetCVal("write.step.unit", "MM");  // which the writer reads when it is made
  STEPCAFControl_Writer writer;
  if (!writer.Transfer(document, STEPControl_AsIs)) return false;
  APIHeaderSection_MakeHeader header(writer.ChangeWriter().Model());
  header.SetName(new TCollection_HAsciiString(drawing.at("robot").get<std::string>().c_str()));
  header.SetAuthorValue(1, new TCollection_HAsciiString(""));
  header.SetOrganizationValue(1, new TCollection_HAsciiString(""));
  header.SetOriginatingSystem(new TCollection_HAsciiString("Bielle"));
  return writer.Write(path) == IFSelect_RetDone;
}

}  // namespace

int main(int argc, char** argv) {
  const auto fail = [](const std::string& why) {
    std::cerr << "bielle-step: error: " << why << "\n";
    return 2;
  };
  if (argc != 2) return fail("`bielle convert ROBOT --to step -o FILE` runs it");
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));  // statistics of every transfer
  try {
    if (!write(json::parse(std::cin), argv[1]))
      return fail(std::string(argv[1]) + ": it cannot be written; check the directory");
  } catch (const std::exception& error) {
    return fail(std::string("the solids on the standard input: ") + error.what());
  } catch (const Standard_Failure& error) {
    return fail(std::string("OpenCASCADE: ") + error.GetMessageString());
  }
  return 0;
}
