#include "results/workshop_sheet.h"

#include <cmath>

#include "formats/pivots.h"
#include "model/number_text.h"
#include "results/mechanism_figure.h"

namespace bielle {
namespace {

// A field of CSV; quoted where it has to be.
std::string formatField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

}  // namespace

std::string formatSheet(const Model& model) {
  const MechanismFigure figure = makeMechanismFigure(model, makeDrawnPosture(model));
  MechanismPicture picture;
  picture.width = 1100, picture.height = 1000;
  picture.title = model.name() + ", " + formatNumber(model.mass(), "%.4g") + " kg";
  return formatMechanism(figure, picture);
}

std::string formatSheetTable(const Model& model) {
  TextStream out;
  const auto write = [&out](const char* kind, const std::string& of, const std::string& from, const std::string& to,
                            double value, const char* unit) {
    out << kind << "," << formatField(of) << "," << formatField(from) << "," << formatField(to) << ","
        << formatNumber(value, "%.9g") << "," << unit << "\n";
  };
  out << "kind,of,from,to,value,unit\n";
  const std::vector<RigidLink> links = listRigidLinks(model);
  for (const LinkDistance& d : listLinkDistances(links)) {
    const RigidLink& link = links[static_cast<size_t>(d.link)];
    write("length", link.name, link.pivots[static_cast<size_t>(d.from)].name,
          link.pivots[static_cast<size_t>(d.to)].name, 1000 * d.length, "mm");
  }
  for (const RigidLink& link : links) {
    double mass = 0;
    for (const int body : link.bodies) mass += body > 0 ? model.bodies()[static_cast<size_t>(body)].inertia.mass : 0;
    if (mass > 0) write("mass", link.name, "", "", mass, "kg");
  }
  for (const Motor& motor : model.motors()) {
    const std::string& type = motor.drive.type;
    const bool turns = model.joints()[static_cast<size_t>(motor.joint)].kind != JointKind::Prismatic;
    write("ratio", motor.name, type, "", motor.drive.ratio, turns ? "1" : "rad/m");
    if (motor.drive.mass > 0) write("motor mass", motor.name, type, "", motor.drive.mass, "kg");
    if (std::isfinite(motor.effort_limit))
      write("largest torque", motor.name, type, "", motor.effort_limit, turns ? "N m" : "N");
    if (std::isfinite(motor.velocity_limit))
      write("largest speed", motor.name, type, "", motor.velocity_limit, turns ? "rad/s" : "m/s");
  }
  return out.str();
}

}  // namespace bielle
