// bielle-mesh FILE: writes the triangles of a mesh of any kind that assimp reads to the standard output, as binary STL in the
// coordinates and units of the file. Exit status: 0, or 2 with a message if it cannot be read, or assimp would read
// it as another mesh.
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
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

// The JSON of a glTF: the file, or the first chunk of a binary one after a header of 12 bytes, its size and its kind.
std::string readGltfText(const std::string& path) {
  constexpr size_t kChunk = 20;
  std::ifstream in(path, std::ios::binary);
  std::string start(kChunk, '\0');
  in.read(start.data(), kChunk);
  if (in && start.compare(0, 4, "glTF") == 0) {
    std::uint32_t size = 0;
    std::memcpy(&size, start.data() + 12, sizeof size);
    if (size > std::filesystem::file_size(path)) return {};
    std::string text(size, '\0');
    return in.read(text.data(), size) ? text : std::string();
  }
  if (std::filesystem::path(path).extension() != ".gltf") return {};
  in.clear(), in.seekg(0);
  return {std::istreambuf_iterator<char>(in), {}};
}

// An extension without which the file cannot be understood, unless it concerns materials or lights; empty if there is none. assimp
// (5.2.5) ignores that files require extensions, and takes the whole numbers of KHR_mesh_quantization for floats.
std::string findRequiredExtension(const std::string& path) {
  const nlohmann::json gltf = nlohmann::json::parse(readGltfText(path), nullptr, false);
  if (!gltf.is_object() || !gltf.contains("extensionsRequired") || !gltf["extensionsRequired"].is_array()) return {};
  for (const nlohmann::json& extension : gltf["extensionsRequired"]) {
    const std::string name = extension.is_string() ? extension.get<std::string>() : "?";
    bool is_drawn = false;
    for (const char* drawn : {"KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_"})
      is_drawn |= name.rfind(drawn, 0) == 0;
    if (!is_drawn) return name;
  }
  return {};
}

// Whether a PLY begins with other elements than vertices, which it may. assimp (5.2.5) takes the first ones for vertices.
bool beginsWithOthers(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  if (!std::getline(in, line) || line.rfind("ply", 0) != 0) return false;
  while (std::getline(in, line) && line.rfind("end_header", 0) != 0)
    if (line.rfind("element ", 0) == 0) return line.rfind("element vertex ", 0) != 0;
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || std::string(argv[1]).rfind('-', 0) == 0) {
    std::cerr << "usage: bielle-mesh FILE    (its triangles as binary STL to the standard output)\n";
    return kBadInput;
  }
  if (const std::string extension = findRequiredExtension(argv[1]); !extension.empty())
    return fail(std::string(argv[1]) + " requires the extension " + extension + ", which is not supported");
  if (beginsWithOthers(argv[1]))
    return fail(std::string(argv[1]) + " has other elements before its vertices, which is not supported");
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
