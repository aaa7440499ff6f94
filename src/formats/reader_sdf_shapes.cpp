// What SDF files draw and let collide.
#include <filesystem>

#include "formats/mesh.h"
#include "formats/reader_sdf.h"

namespace bielle {

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

}  // namespace bielle
