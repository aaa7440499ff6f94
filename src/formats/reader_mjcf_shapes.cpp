// Geoms to be drawn, sites as frames, soles.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/mesh.h"
#include "formats/reader_mjcf.h"
#include "math/direction.h"

namespace bielle {
namespace {

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

// pos and orientation, or half way between both points of `fromto` with z along it; then also half the distance.
SE3 MjcfReader::readPlace(MjcfElement& e, double* half_length) {
  const std::vector<double> ends = e.getNumbers("fromto", 6, 6);
  SE3 X = e.getPose();
  if (ends.empty()) return X;
  const Vector3d from(ends[0], ends[1], ends[2]), to(ends[3], ends[4], ends[5]), along = from - to;
  const double length = along.stableNorm();
  if (!(length > 1e-12) || !std::isfinite(length)) e.fail("the two points of its fromto coincide", "move one");
  X.p = (from + to) / 2;
  X.R = calcRotationOfZ(along / length);
  *half_length = length / 2;
  return X;
}

MjcfReader::Shape MjcfReader::readShape(MjcfElement& e, const SE3& X_BF) {
  Shape out;
  out.type = e.getText("type", e.find("mesh") ? "mesh" : "sphere");
  const std::vector<double> size = e.getNumbers("size", 1, 3);
  for (size_t i = 0; i < size.size(); ++i) out.size[static_cast<Eigen::Index>(i)] = size[i];
  const bool is_round = out.type == "capsule" || out.type == "cylinder";
  SE3 X;
  if (is_round || out.type == "box" || out.type == "ellipsoid") {
    double half_length = -1;
    X = readPlace(e, &half_length);
    if (half_length > 0) {
      if (!is_round) out.size[1] = out.size[0];
      out.size[is_round ? 1 : 2] = half_length;
    }
  } else {
    e.find("fromto");  // it has no effect
    X = e.getPose();
  }
  if ((out.size.array() < 0).any()) e.fail("its size is negative", "give positive numbers");
  out.X_BG = X_BF * X;
  return out;
}

// Sites become frames. A box, capsule or sphere NAME.1 at a site NAME is the sole, edge or point that the writer writes, and
// spheres NAME.1 .. NAME.4 the sole that it once wrote; all other geoms are drawn.
void MjcfReader::readShapes(const std::vector<Child>& children, const BodyPlace& place) {
  std::map<std::string, Shape> shapes;
  std::set<std::string> soles;
  for (const Child& child : children) {
    const std::string name = getAttribute(child.element, "name");
    if (getTag(*child.element) != "geom" || name.empty()) continue;
    MjcfElement e(*child.element, child.childclass, settings_);
    for (const char* read : kGeomAttributes) e.find(read);
    shapes[name] = readShape(e, child.X_BF);
  }
  for (const Child& child : children)
    if (getTag(*child.element) == "site") readSite(child, place, shapes, soles);
  for (const Child& child : children)
    if (getTag(*child.element) == "geom" && !soles.count(getAttribute(child.element, "name"))) readVisual(child, place);
}

void MjcfReader::readSite(const Child& child, const BodyPlace& place, const std::map<std::string, Shape>& shapes,
                          std::set<std::string>& soles) {
  MjcfElement e(*child.element, child.childclass, settings_);
  for (const char* drawn : {"type", "size", "rgba", "material"}) e.find(drawn);
  double half_length = 0;
  const SE3 X_BS = child.X_BF * readPlace(e, &half_length);
  const std::string site = getAttribute(child.element, "name");
  const std::string name = makeName(site.empty() ? "site_" + std::to_string(e.line()) : site);
  if (!site.empty()) {
    if (sites_.count(site)) e.fail("two sites have this name", "rename one of them");
    sites_[site] = {place.link, place.X_LB * X_BS, place.X_WB * X_BS};
    if (name != site) e.note("its frame is named '" + name + "': another element is named '" + site + "'");
  }
  addLink(name, place.link, JointKind::Fixed, name + "_frame", place.X_LB * X_BS);
  std::vector<Vector3d> corners;
  SE3 X_SG;
  Shape sole;  // of the first number
  for (int i = 1; i <= 4; ++i)
    if (const auto it = shapes.find(site + "." + std::to_string(i)); it != shapes.end()) {
      if (i == 1) sole = it->second, X_SG = X_BS.inverse() * sole.X_BG;
      if (it->second.type == "sphere")
        corners.push_back(X_BS.inverse().act(it->second.X_BG.p) - Vector3d(0, 0, it->second.size[0]));
    }
  ContactSpec contact;
  contact.name = site;
  contact.frame = name;
  if (site.empty()) return;
  const auto standsOnSite = [&](double height) { return (X_SG.p - Vector3d(0, 0, height)).isZero(kSamePlace); };
  if (sole.type == "box" && standsOnSite(sole.size[2]) && X_SG.R.isIdentity(kSamePlace)) {
    contact.half_length = round(sole.size[0]);
    contact.half_width = round(sole.size[1]);
  } else if (sole.type == "capsule" && standsOnSite(sole.size[0]) && X_SG.R.col(2).tail<2>().isZero(kSamePlace)) {
    contact.kind = ContactKind::Edge5D;
    contact.half_length = round(sole.size[1]);
  } else if (corners.size() == 1 && corners[0].isZero(kSamePlace)) {
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

// Takes `refpos` and `refquat` of the mesh into account: its vertices are scale (R_ref^T (x - p_ref)).
bool MjcfReader::placeMesh(const MeshAsset& mesh, Visual& visual) {
  const bool is_turned = !mesh.R_ref.isIdentity(1e-12), is_even = (visual.size.array() == visual.size[0]).all();
  if (is_turned && !is_even) return false;
  const Vector3d moved = visual.size.asDiagonal() * mesh.R_ref.transpose() * mesh.p_ref;
  visual.X_BV = visual.X_BV * SE3(mesh.R_ref.transpose(), -moved);
  return true;
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
  if (shape.type != "mesh" && e.find("mesh")) {
    return e.leaveOut("a geom that is fitted to a mesh is left out");
  } else if (shape.type == "box") {
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
    visual.size = mesh->second.visual.size;
    visual.mesh = mesh->second.visual.mesh;
    if (!placeMesh(mesh->second, visual))
      return e.leaveOut("it is left out: its mesh is turned before it is stretched along its axes");
    visual.bounds = fitMesh(visual.mesh, std::filesystem::path(settings_.path).parent_path().string(), visual.size);
    if (!visual.bounds) e.note("its mesh cannot be read: it has no shape, so distances ignore it");
  } else {
    return e.leaveOut(shape.type == "plane" ? "left out" : "a geom of type '" + shape.type + "' is left out");
  }
  if (touches && addShape(shape.type == "capsule", size, visual, tree_.links[place.link]))
    e.note("its shape is used for distances only, not for contact (feet: the key contacts of a YAML file)");
  if (!is_drawn) return;
  if (shape.type == "capsule") e.noteHarmless("a capsule is drawn as a cylinder");
  tree_.links[place.link].visuals.push_back(visual);
}

}  // namespace bielle
