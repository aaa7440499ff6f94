// An STL, OBJ or COLLADA file: a shape of finite size and a finite mass, or none.
#include "formats/mesh.h"
#include "formats/mesh_inertia.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  const std::string content = fuzz::toText(data, size);
  for (const char* mesh : {"mesh.stl", "mesh.obj", "mesh.dae"}) {
    scratch.write(mesh, content);
    for (MeshSolid solid : {MeshSolid::Enclosed, MeshSolid::Overlapping, MeshSolid::Surface})
      if (const auto inertia = calcMeshInertia(readTriangles(mesh, scratch.path()), solid))
        if (!(inertia->mass > 0) || !inertia->com.allFinite() || !inertia->I_com.allFinite())
          fuzz::fail(std::string(mesh) + ": its mass is none");
    const std::optional<Shape> shape = fitMesh(mesh, scratch.path(), Vector3d(1, 2, -3));
    if (!shape) continue;
    if (!shape->X_BS.p.allFinite() || !shape->half.allFinite() || !(shape->half.minCoeff() >= 0) ||
        !(shape->radius >= 0) || !std::isfinite(shape->radius) ||
        !((shape->X_BS.R.transpose() * shape->X_BS.R).isIdentity(1e-9)))
      fuzz::fail(std::string(mesh) + ": its shape is none");
  }
  return 0;
}
