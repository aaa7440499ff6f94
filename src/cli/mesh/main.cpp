// bielle-mesh FILE: writes the triangles of a mesh of any kind that assimp reads to the standard output, as binary STL in the
// coordinates and units of the file. Exit status: 0, or 2 with a message if it cannot be read.
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

namespace {

constexpr int kBadInput = 2;
constexpr size_t kHeader = 80;

int fail(const std::string& why) {
  std::cerr << "bielle-mesh: error: " << why << "\n";
  return kBadInput;
}

template <typename T>
void append(const T& value, std::vector<char>& out) {
  const char* bytes = reinterpret_cast<const char*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

// An empty normal, the corners, and two bytes without meaning.
void appendTriangle(const aiMesh& mesh, const aiFace& face, const aiMatrix4x4& X, bool is_mirrored,
                    std::vector<char>& out) {
  append(std::int32_t(0), out), append(std::int32_t(0), out), append(std::int32_t(0), out);
  for (const unsigned corner : {0u, is_mirrored ? 2u : 1u, is_mirrored ? 1u : 2u}) {
    const aiVector3D p = X * mesh.mVertices[face.mIndices[corner]];
    for (const float x : {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}) append(x, out);
  }
  append(std::uint16_t(0), out);
}

// The meshes of a node and of those below it. Faces of mirrored instances are turned, so that they are seen from outside like the
// others: assimp's own step for this leaves them, and a part and its mirror image would cancel in volumes.
std::uint32_t appendNode(const aiScene& scene, const aiNode& node, const aiMatrix4x4& X_parent,
                         std::vector<char>& out) {
  const aiMatrix4x4 X = X_parent * node.mTransformation;
  std::uint32_t count = 0;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[i]];
    for (unsigned k = 0; k < mesh.mNumFaces; ++k)
      if (mesh.mFaces[k].mNumIndices == 3) appendTriangle(mesh, mesh.mFaces[k], X, X.Determinant() < 0, out), ++count;
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) count += appendNode(scene, *node.mChildren[i], X, out);
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || std::string(argv[1]).rfind('-', 0) == 0) {
    std::cerr << "usage: bielle-mesh FILE    (its triangles as binary STL to the standard output)\n";
    return kBadInput;
  }
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);  // as in ROS
  const aiScene* scene = importer.ReadFile(argv[1], aiProcess_Triangulate | aiProcess_SortByPType);
  if (!scene) return fail(importer.GetErrorString());
  std::vector<char> out(kHeader, ' ');
  std::uint32_t count = 0;
  append(count, out);
  count = appendNode(*scene, *scene->mRootNode, aiMatrix4x4(), out);
  if (count == 0) return fail(std::string(argv[1]) + " has no triangles");
  std::memcpy(out.data() + kHeader, &count, sizeof count);
  std::cout.write(out.data(), static_cast<std::streamsize>(out.size()));
  return std::cout.flush() ? 0 : fail("the standard output cannot be written");
}
