#include "robots/part_solids.h"

#include <map>

#include "math/direction.h"
#include "model/listing.h"

namespace bielle {
namespace {

// Of motors, unless they are given as a cylinder, m.
constexpr double kMotorRadius = 0.038, kMotorLength = 0.042;

const YamlKeys kSolidKeys("part", "tree.LINK.solids[], solids.LINK[]",
                          {"box", "cylinder", "rod", "sphere", "motor", "at", "axis", "rpy", "radius", "mass",
                           "density", "material", "color", "when"});

// kg/m^3: carbon is a laminate, nylon a sintered part.
const std::map<std::string, double> kMaterials = {{"aluminium", 2700}, {"steel", 7850},     {"titanium", 4430},
                                                  {"carbon", 1600},    {"magnesium", 1800}, {"nylon", 1150}};

const std::map<std::string, Eigen::Vector4d> kColors = {
    {"shell", colors::kShell}, {"frame", colors::kFrame}, {"output", colors::kOutput}, {"motor", colors::kMotor},
    {"steel", colors::kSteel}, {"rod", colors::kRod},     {"sole", colors::kSole}};

template <typename Value>
Value findNamed(const std::map<std::string, Value>& table, const YamlEntry& entry) {
  const auto it = table.find(entry.getText());
  if (it != table.end()) return it->second;
  entry.fail("'" + entry.getText() + "' is unknown", "use one of " + listKeys(table));
}

std::vector<std::string> append(std::vector<std::string> names, const std::vector<std::string>& more) {
  names.insert(names.end(), more.begin(), more.end());
  return names;
}

double readPositive(const YamlEntry& entry) {
  const double value = entry.getNumber();
  if (!(value > 0)) entry.fail("it is not positive", "give a positive number");
  return value;
}

double calcVolume(const Solid& solid) {
  const Vector3d& s = solid.size;
  if (solid.shape == Visual::Shape::Box) return s.prod();
  if (solid.shape == Visual::Shape::Sphere) return 4.0 / 3 * M_PI * s.x() * s.x() * s.x();
  return M_PI * s.x() * s.x() * s.y();
}

// By its mass, by its mass per length (of what is long), or by its material.
double readMass(const YamlFields& fields, const Solid& solid, const YamlEntry& owner) {
  const YamlEntry *mass = find(fields, "mass"), *density = find(fields, "density"),
                  *material = find(fields, "material");
  if (!!mass + !!density + !!material != 1)
    owner.fail("its mass is not given once",
               "give `mass` [kg], `density` [kg/m] of what is long, or `material` (" + listKeys(kMaterials) + ")");
  if (mass) return readPositive(*mass);
  if (material) return findNamed(kMaterials, *material) * calcVolume(solid);
  if (solid.shape != Visual::Shape::Cylinder) density->fail("only rods and cylinders have a length", "give `mass`");
  return readPositive(*density) * solid.size.y();
}

Eigen::Vector4d readColor(const YamlFields& fields, const char* usual) {
  const YamlEntry* color = find(fields, "color");
  if (!color) return kColors.at(usual);
  if (!color->isList()) return findNamed(kColors, *color);
  const std::vector<double> rgba = color->getNumbers(4);
  return Eigen::Map<const Eigen::Vector4d>(rgba.data());
}

// Keys that have no meaning for a shape.
void requireUsed(const YamlFields& fields) {
  static const std::map<std::string, std::vector<std::string>> used = {{"box", {"at", "rpy"}},
                                                                       {"cylinder", {"at", "axis"}},
                                                                       {"rod", {"radius"}},
                                                                       {"sphere", {"at"}},
                                                                       {"motor", {"at", "axis"}}};
  for (const auto& [shape, keys] : used) {
    if (!find(fields, shape)) continue;
    std::vector<std::string> known = append({"color", "when", shape}, keys);
    if (shape != "motor") known = append(known, {"mass", "density", "material"});
    for (const auto& [key, entry] : fields)
      if (!contains(known, key)) entry.fail("a " + shape + " does not use it", "known keys are " + listItems(known));
  }
}

Solid readRod(const YamlEntry& ends, const YamlFields& fields, double side) {
  const std::vector<YamlEntry> list = ends.getList(2);
  const Vector3d a = readPlace(list[0], side), b = readPlace(list[1], side);
  if (!((b - a).norm() > 1e-9)) ends.fail("both ends are in one place", "move one of them");
  return makeRod(a, b, readPositive(require(fields, "radius", ends)), 1, readColor(fields, "rod"));
}

Solid readSolid(const YamlEntry& entry, const YamlFields& fields, double side) {
  const auto read_place = [&](const char* key) {
    const YamlEntry* place = find(fields, key);
    return place ? readPlace(*place, side) : Vector3d::Zero();
  };
  const YamlEntry *box = find(fields, "box"), *cylinder = find(fields, "cylinder"), *rod = find(fields, "rod"),
                  *sphere = find(fields, "sphere"), *motor = find(fields, "motor");
  if (!!box + !!cylinder + !!rod + !!sphere + !!motor != 1)
    entry.fail("it is not one solid", "give one of box, cylinder, rod, sphere and motor");
  requireUsed(fields);
  if (rod) return readRod(*rod, fields, side);
  const Vector3d at = read_place("at");
  if (sphere) return makeSphere(at, readPositive(*sphere), 0, readColor(fields, "steel"));
  if (box) {
    Solid solid = makeBox(at, box->getVector3(), 0, readColor(fields, "frame"));
    if (!(solid.size.minCoeff() > 0)) box->fail("an edge is not positive", "give three lengths in metres");
    if (const YamlEntry* rpy = find(fields, "rpy")) solid.X_LS.R = readAttitude(*rpy, side);
    return solid;
  }
  Vector3d axis = readAxis(require(fields, "axis", entry), 1);
  axis.y() *= side;
  if (motor)
    return makeCylinder(at, axis, kMotorRadius, kMotorLength, readPositive(*motor), readColor(fields, "motor"));
  const std::vector<YamlEntry> size = cylinder->getList(2);
  return makeCylinder(at, axis, readPositive(size[0]), readPositive(size[1]), 0, readColor(fields, "steel"));
}

}  // namespace

Vector3d readPlace(const YamlEntry& entry, double side) {
  Vector3d place = entry.getVector3();
  place.y() *= side;
  return place;
}

Matrix3d readAttitude(const YamlEntry& entry, double side) {
  return makeRotation(Vector3d(side, 1, side).cwiseProduct(entry.getVector3()));
}

Vector3d readAxis(const YamlEntry& entry, double side) {
  Vector3d axis = entry.getVector3();
  if (!(axis.norm() > 1e-9)) entry.fail("it is no direction", "give x, y, z or three numbers that are not all zero");
  axis.normalize();
  if (!isAcross(axis)) axis.y() *= side;
  return axis;
}

bool isAcross(const Vector3d& axis) { return std::abs(axis.y()) == 1; }

std::vector<Solid> readSolids(const YamlEntry& list, double side) {
  std::vector<Solid> solids;
  for (const YamlEntry& entry : list.getList()) {
    const YamlFields fields = entry.getFields(kSolidKeys);
    const YamlEntry* when = find(fields, "when");
    if (when && when->getNumber() == 0) continue;
    Solid solid = readSolid(entry, fields, side);
    if (!find(fields, "motor")) solid.mass = readMass(fields, solid, entry);
    solids.push_back(solid);
  }
  return solids;
}

}  // namespace bielle
