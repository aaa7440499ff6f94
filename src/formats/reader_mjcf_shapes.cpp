// Inertias from geoms or as given; geoms to be drawn, sites as frames, soles.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/mesh.h"
#include "formats/reader_mjcf.h"
#include "math/direction.h"

namespace bielle {
namespace {

constexpr const char* kGeomAttributes[] = {"mass", "density", "mesh", "contype", "conaffinity", "rgba", "material"};

// The room that a geom takes up, if it is no mesh.
bool addShape(bool is_capsule, const Vector3d& size, const Visual& visual, UrdfLink& link) {
  std::optional<Shape> shape = fitShape(visual);
  if (!shape) return false;
  if (is_capsule) {
    shape->half = {0, 0, size[1]};
    shape->radius = size[0];
  }
  shape->fitted = false;
  link.shapes.push_back(*shape);
  return true;
}

// Sizes of soles are differences of places: their rounding is removed.
double round(double length) { return std::round(std::abs(length) * 1e12) / 1e12; }

}  // namespace

Inertia MjcfReader::readInertia(const std::vector<Child>& children) {
  const XMLElement* given = nullptr;
  SE3 X;
  for (const Child& child : children) {
    if (getTag(*child.element) != "inertial") continue;
    if (given) refuse(*child.element, "the body has two inertias", "keep one");
    given = child.element;
    X = child.X_BF;
  }
  Inertia sum;
  if (!given || inertia_from_geom_ == "true") {
    if (given) noteElement(*given, "left out, because inertiafromgeom is true");
    if (inertia_from_geom_ == "false") return {};
    for (const Child& child : children)
      if (getTag(*child.element) == "geom") sum = sum + readSolid(child);
    return sum;
  }
  MjcfElement e(*given, "", settings_);
  if (!e.find("mass")) e.fail("it has no mass", "give one");
  const double mass = e.getNumber("mass", 0);
  if (!(mass >= 0)) e.fail("its mass is negative", "give 0 or more");
  if (!e.find("pos")) e.fail("it has no pos", "give the centre of mass");
  Matrix3d I = Matrix3d::Zero();
  const std::vector<double> diagonal = e.getNumbers("diaginertia", 3, 3), full = e.getNumbers("fullinertia", 6, 6);
  const SE3 X_BI = e.getPose();
  if (diagonal.empty() == full.empty())
    e.fail(full.empty() ? "it has no diaginertia or fullinertia" : "it has both diaginertia and fullinertia",
           "give one of them");
  if (!diagonal.empty()) I.diagonal() << diagonal[0], diagonal[1], diagonal[2];
  if (!full.empty()) {
    if (e.find("quat") || e.find("euler") || e.find("axisangle") || e.find("xyaxes") || e.find("zaxis"))
      e.fail("it has a fullinertia and an orientation", "keep one: fullinertia is in the axes of the body");
    I << full[0], full[3], full[4], full[3], full[1], full[5], full[4], full[5], full[2];
  }
  return Inertia{mass, Vector3d::Zero(), I}.transformed(X * X_BI);
}

MjcfReader::Shape MjcfReader::readShape(MjcfElement& e, const SE3& X_BF) {
  Shape out;
  out.type = e.getText("type", e.find("mesh") ? "mesh" : "sphere");
  const std::vector<double> size = e.getNumbers("size", 1, 3), ends = e.getNumbers("fromto", 6, 6);
  for (size_t i = 0; i < size.size(); ++i) out.size[static_cast<Eigen::Index>(i)] = size[i];
  SE3 X = e.getPose();
  const bool is_long = out.type == "capsule" || out.type == "cylinder" || out.type == "box" || out.type == "ellipsoid";
  if (!ends.empty() && is_long) {
    const Vector3d from(ends[0], ends[1], ends[2]), to(ends[3], ends[4], ends[5]), along = from - to;
    const double length = along.stableNorm();
    if (!(length > 1e-12) || !std::isfinite(length)) e.fail("the two points of its fromto coincide", "move one");
    X.p = (from + to) / 2;
    X.R = calcRotationOfZ(along / length);
    const bool is_round = out.type == "capsule" || out.type == "cylinder";
    if (!is_round) out.size[1] = out.size[0];
    out.size[is_round ? 1 : 2] = length / 2;
  }
  if ((out.size.array() < 0).any()) e.fail("its size is negative", "give positive numbers");
  out.X_BG = X_BF * X;
  return out;
}

Inertia MjcfReader::readSolid(const Child& child) {
  MjcfElement e(*child.element, child.childclass, settings_);
  const Shape shape = readShape(e, child.X_BF);
  for (const char* read : kGeomAttributes) e.find(read);
  const double density = e.getNumber("density", 1000), *given = nullptr;
  const double mass_given = e.getNumber("mass", -1);
  if (e.find("mass")) given = &mass_given;
  if ((given && !(*given >= 0)) || !(density >= 0)) e.fail("its mass or density is negative", "give 0 or more");
  if ((given ? *given : density) == 0 || shape.type == "plane" || shape.type == "hfield") return {};
  if (shape.type == "mesh" || shape.type == "sdf")
    e.fail("the mass of the body comes from this " + shape.type + ", which is not supported",
           "give the body an <inertial>, as MuJoCo does when it saves the model");
  const double a = shape.size[0], b = shape.size[1], c = shape.size[2];
  double volume = 0;
  Vector3d moments = Vector3d::Zero();  // per mass
  const auto fromSquares = [](double xx, double yy, double zz) { return Vector3d(yy + zz, xx + zz, xx + yy); };
  if (shape.type == "sphere" || shape.type == "ellipsoid") {
    const double y = shape.type == "sphere" ? a : b, z = shape.type == "sphere" ? a : c;
    volume = 4 * EIGEN_PI / 3 * a * y * z;
    moments = fromSquares(a * a / 5, y * y / 5, z * z / 5);
  } else if (shape.type == "box") {
    volume = 8 * a * b * c;
    moments = fromSquares(a * a / 3, b * b / 3, c * c / 3);
  } else if (shape.type == "cylinder") {
    volume = 2 * EIGEN_PI * a * a * b;
    moments = fromSquares(a * a / 4, a * a / 4, b * b / 3);
  } else if (shape.type == "capsule") {
    // A cylinder and two half balls, whose centres of mass are 3/8 of the radius beyond its ends.
    const double tube = 2 * EIGEN_PI * a * a * b, ball = 4 * EIGEN_PI / 3 * a * a * a, far = b + 3 * a / 8;
    volume = tube + ball;
    if (!(volume > 0)) return {};
    const double xx = (tube * a * a / 4 + ball * a * a / 5) / volume,
                 zz = (tube * b * b / 3 + ball * (a * a / 5 - 9 * a * a / 64 + far * far)) / volume;
    moments = fromSquares(xx, xx, zz);
  } else {
    e.fail("its type '" + shape.type + "' is unknown", "use sphere, capsule, ellipsoid, cylinder, box, mesh or plane");
  }
  const double mass = given ? *given : density * volume;
  return Inertia{mass, Vector3d::Zero(), Matrix3d((mass * moments).asDiagonal())}.transformed(shape.X_BG);
}

// Sites become frames. Spheres NAME.1 .. NAME.4, or NAME.1 alone, at a site NAME are the soles that the writer writes;
// all other geoms are drawn.
void MjcfReader::readShapes(const std::vector<Child>& children, const BodyPlace& place) {
  std::map<std::string, Sphere> spheres;
  std::set<std::string> soles;
  for (const Child& child : children) {
    const std::string name = getAttribute(child.element, "name");
    if (getTag(*child.element) != "geom" || name.empty()) continue;
    MjcfElement e(*child.element, child.childclass, settings_);
    for (const char* read : kGeomAttributes) e.find(read);
    const Shape shape = readShape(e, child.X_BF);
    if (shape.type == "sphere") spheres[name] = {shape.X_BG.p, shape.size[0]};
  }
  for (const Child& child : children)
    if (getTag(*child.element) == "site") readSite(child, place, spheres, soles);
  for (const Child& child : children)
    if (getTag(*child.element) == "geom" && !soles.count(getAttribute(child.element, "name"))) readVisual(child, place);
}

void MjcfReader::readSite(const Child& child, const BodyPlace& place, const std::map<std::string, Sphere>& spheres,
                          std::set<std::string>& soles) {
  MjcfElement e(*child.element, child.childclass, settings_);
  for (const char* drawn : {"type", "size", "rgba", "material"}) e.find(drawn);
  if (e.find("fromto")) e.fail("sites with fromto are not supported", "give its pos and quat");
  const SE3 X_BS = child.X_BF * e.getPose();
  const std::string site = getAttribute(child.element, "name");
  const std::string name = makeName(site.empty() ? "site_" + std::to_string(e.line()) : site);
  if (!site.empty()) {
    if (sites_.count(site)) e.fail("two sites have this name", "rename one of them");
    sites_[site] = {place.link, place.X_LB * X_BS, place.X_WB * X_BS};
    if (name != site) e.note("its frame is named '" + name + "': another element is named '" + site + "'");
  }
  addLink(name, place.link, JointKind::Fixed, name + "_frame", place.X_LB * X_BS);
  std::vector<Vector3d> corners;
  for (int i = 1; i <= 4; ++i)
    if (const auto it = spheres.find(site + "." + std::to_string(i)); it != spheres.end())
      corners.push_back(X_BS.inverse().act(it->second.centre) - Vector3d(0, 0, it->second.radius));
  ContactSpec contact;
  contact.name = site;
  contact.frame = name;
  if (site.empty()) return;
  if (corners.size() == 1 && corners[0].isZero(kSamePlace)) {
    contact.kind = ContactKind::Point3D;
  } else if (corners.size() == 4) {
    const double length = corners[0].x(), width = corners[0].y();
    for (int i = 0; i < 4; ++i)
      if (!(corners[i] - Vector3d((i < 2 ? 1 : -1) * length, (i % 2 == 0 ? 1 : -1) * width, 0)).isZero(kSamePlace))
        return;
    contact.half_length = round(length);
    contact.half_width = round(width);
  } else {
    return;
  }
  yaml_.contacts.push_back(contact);
  for (int i = 1; i <= 4; ++i) soles.insert(site + "." + std::to_string(i));
}

void MjcfReader::readVisual(const Child& child, const BodyPlace& place) {
  MjcfElement e(*child.element, child.childclass, settings_);
  const Shape shape = readShape(e, child.X_BF);
  for (const char* read : kGeomAttributes) e.find(read);
  const bool is_drawn = e.getNumber("group", 0) < 3;  // of groups 0 to 5, those that MuJoCo's viewer shows at first
  const bool touches = e.getNumber("contype", 1) != 0 || e.getNumber("conaffinity", 1) != 0;
  Visual visual;
  visual.X_BV = place.X_LB * shape.X_BG;
  const std::vector<double> rgba = e.getNumbers("rgba", 4, 4);
  for (size_t i = 0; i < rgba.size(); ++i) visual.rgba[static_cast<Eigen::Index>(i)] = rgba[i];
  const Vector3d& size = shape.size;
  if (shape.type == "box") {
    visual.shape = Visual::Shape::Box;
    visual.size = 2 * size;
  } else if (shape.type == "sphere") {
    visual.shape = Visual::Shape::Sphere;
    visual.size = {size[0], 0, 0};
  } else if (shape.type == "cylinder" || shape.type == "capsule") {
    visual.shape = Visual::Shape::Cylinder;
    visual.size = {size[0], 2 * size[1], 0};
  } else if (const auto mesh = meshes_.find(e.getText("mesh")); shape.type == "mesh" && mesh != meshes_.end()) {
    visual.shape = Visual::Shape::Mesh;
    visual.size = mesh->second.size;
    visual.mesh = mesh->second.mesh;
    visual.bounds = fitMesh(visual.mesh, std::filesystem::path(settings_.path).parent_path().string(), visual.size);
    if (!visual.bounds) e.note("its mesh cannot be read: it has no shape, so distances ignore it");
  } else {
    return e.leaveOut("a geom of type '" + shape.type + "' is left out");
  }
  if (touches && addShape(shape.type == "capsule", size, visual, tree_.links[place.link]))
    e.note("its shape is used for distances only, not for contact (feet: the key contacts of a YAML file)");
  if (!is_drawn) return;
  if (shape.type == "capsule") e.note("a capsule is drawn as a cylinder");
  tree_.links[place.link].visuals.push_back(visual);
}

}  // namespace bielle
