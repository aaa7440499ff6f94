// What SDF files draw and let collide, and the inertia that is to be computed from it.
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/mesh.h"
#include "formats/mesh_inertia.h"
#include "formats/reader_sdf.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kSdfDensity = 1000;  // kg/m^3, by the specification of SDF

// Volume and moments per mass, in its own frame; none for what has no volume here.
std::optional<Inertia> calcSolid(const sdf::Geometry& geometry) {
  if (const sdf::Box* box = geometry.BoxShape())
    return calcPrimitiveInertia("box", {box->Size().X() / 2, box->Size().Y() / 2, box->Size().Z() / 2});
  if (const sdf::Sphere* sphere = geometry.SphereShape())
    return calcPrimitiveInertia("sphere", {sphere->Radius(), 0, 0});
  if (const sdf::Cylinder* cylinder = geometry.CylinderShape())
    return calcPrimitiveInertia("cylinder", {cylinder->Radius(), cylinder->Length() / 2, 0});
  if (const sdf::Capsule* capsule = geometry.CapsuleShape())
    return calcPrimitiveInertia("capsule", {capsule->Radius(), capsule->Length() / 2, 0});
  if (const sdf::Ellipsoid* ellipsoid = geometry.EllipsoidShape())
    return calcPrimitiveInertia("ellipsoid", {ellipsoid->Radii().X(), ellipsoid->Radii().Y(), ellipsoid->Radii().Z()});
  return {};
}

}  // namespace

// None for what has no shape here.
std::optional<Visual> SdfReader::readGeometry(const sdf::Geometry& geometry, const std::string& element) {
  Visual out;
  if (const sdf::Box* box = geometry.BoxShape()) {
    out.shape = Visual::Shape::Box;
    out.size = {box->Size().X(), box->Size().Y(), box->Size().Z()};
  } else if (const sdf::Sphere* sphere = geometry.SphereShape()) {
    out.shape = Visual::Shape::Sphere;
    out.size = {sphere->Radius(), 0, 0};
  } else if (const sdf::Cylinder* cylinder = geometry.CylinderShape()) {
    out.shape = Visual::Shape::Cylinder;
    out.size = {cylinder->Radius(), cylinder->Length(), 0};
  } else if (const sdf::Capsule* capsule = geometry.CapsuleShape()) {
    out.shape = Visual::Shape::Cylinder;
    out.size = {capsule->Radius(), capsule->Length(), 0};
  } else if (const sdf::Mesh* mesh = geometry.MeshShape()) {
    out.shape = Visual::Shape::Mesh;
    out.size = {mesh->Scale().X(), mesh->Scale().Y(), mesh->Scale().Z()};
    out.mesh = mesh->Uri();
    out.bounds = fitMesh(out.mesh, std::filesystem::path(path_).parent_path().string(), out.size);
    if (!out.bounds)
      tree_.warnings.push_back(path_ + ": " + element + ": its mesh '" + out.mesh +
                               "' cannot be read, so distances ignore it");
  } else {
    tree_.warnings.push_back(path_ + ": " + element +
                             ": it is left out: only boxes, spheres, cylinders, capsules and meshes "
                             "have shapes here");
    return {};
  }
  return out;
}

void SdfReader::readShapes(const sdf::Link& link) {
  UrdfLink& out = tree_.links.at(link.Name());
  const auto describe = [&](const char* kind, const std::string& name) {
    return "link '" + link.Name() + "': " + kind + " '" + name + "'";
  };
  for (uint64_t i = 0; i < link.VisualCount(); ++i) {
    const sdf::Visual& visual = *link.VisualByIndex(i);
    std::optional<Visual> drawn = readGeometry(*visual.Geom(), describe("visual", visual.Name()));
    if (!drawn) continue;
    drawn->X_BV = getPlaceOn(visual, link.Name());
    if (const sdf::Material* material = visual.Material()) {
      const auto& color = material->Diffuse();
      drawn->rgba = {color.R(), color.G(), color.B(), color.A()};
    }
    out.visuals.push_back(*drawn);
  }
  for (uint64_t i = 0; i < link.CollisionCount(); ++i) {
    const sdf::Collision& collision = *link.CollisionByIndex(i);
    std::optional<Visual> geometry = readGeometry(*collision.Geom(), describe("collision", collision.Name()));
    if (!geometry) continue;
    geometry->X_BV = getPlaceOn(collision, link.Name());
    std::optional<Shape> shape = fitShape(*geometry);
    if (!shape) continue;
    if (collision.Geom()->CapsuleShape()) {
      shape->half = {0, 0, geometry->size[1] / 2};
      shape->radius = geometry->size[0];
    }
    shape->fitted = false;
    out.shapes.push_back(*shape);
  }
}

// <inertial auto="true"> of SDF 1.11, which libsdformat 12 does not know: from the collisions and their densities, scaled to the
// mass if there is one.
void SdfReader::computeInertia(const XMLElement& link, const XMLElement& inertial) {
  const std::string name = getAttribute(&link, "name");
  const auto get = [&](const XMLElement& e, const char* tag, double usual) {
    const XMLElement* given = e.FirstChildElement(tag);
    if (!given) return usual;
    std::vector<double> numbers;
    const char* text = given->GetText();
    if (!parseNumbers(text ? text : "", numbers) || numbers.size() != 1 || !(numbers[0] > 0))
      fail("link '" + name + "': <" + tag + "> (line " + std::to_string(given->GetLineNum()) + ")",
           "it is no positive number", "correct it");
    return numbers[0];
  };
  const double density = get(inertial, "density", kSdfDensity), mass = get(inertial, "mass", 0);
  const sdf::Link& own = *model_->LinkByName(name);
  Inertia sum;
  for (const XMLElement* e : getChildren(link, "collision")) {
    const sdf::Collision* collision = own.CollisionByName(getAttribute(e, "name"));
    std::optional<Inertia> solid = collision ? calcSolid(*collision->Geom()) : std::nullopt;
    if (!solid)
      fail("link '" + name + "': collision '" + getAttribute(e, "name") + "' (line " + std::to_string(e->GetLineNum()) +
               ")",
           "inertia is to be computed from it (<inertial auto>), but only boxes, spheres, cylinders, capsules and "
           "ellipsoids are solids here",
           "give <mass> and <inertia>; `gz sdf --print --expand-auto-inertials` writes them");
    solid->mass *= get(*e, "density", density);
    solid->I_com *= solid->mass;
    sum = sum + solid->transformed(getPlaceOn(*collision, name));
  }
  if (!(sum.mass > 0))
    fail("link '" + name + "' (line " + std::to_string(inertial.GetLineNum()) + ")",
         "its inertia is to be computed from its collisions (<inertial auto>), and it has none",
         "give it some, or <mass> and <inertia>");
  if (mass > 0) sum.I_com *= mass / sum.mass, sum.mass = mass;
  tree_.links.at(name).inertia = sum;
}

}  // namespace bielle
