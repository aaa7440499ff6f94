#include "report/drawing.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "formats/mesh.h"
#include "report/pack.h"
#include "results/skeleton.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

constexpr std::uintmax_t kLargestMesh = 3'000'000, kAllMeshes = 12'000'000;  // bytes

// Reads each file once.
class MeshStore {
 public:
  explicit MeshStore(std::string directory) : directory_(std::move(directory)) {}

  // Index among the meshes of the page, -1 if it is omitted.
  int find(const std::string& mesh) {
    const auto [it, is_new] = known_.emplace(mesh, -1);
    if (is_new) it->second = load(mesh);
    return it->second;
  }
  Json take() { return std::move(meshes_); }

 private:
  int load(const std::string& mesh) {
    std::string extension = fs::path(mesh).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension != ".stl") return -1;
    const fs::path place = findMesh(mesh, directory_);
    std::error_code error;
    const std::uintmax_t size = place.empty() ? 0 : fs::file_size(place, error);
    if (place.empty() || error || size > kLargestMesh || total_ + size > kAllMeshes) return -1;
    std::ifstream file(place, std::ios::binary);
    total_ += size;
    meshes_.push_back(encodeBase64({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()}));
    return static_cast<int>(meshes_.size()) - 1;
  }

  std::string directory_;
  std::map<std::string, int> known_;
  std::uintmax_t total_ = 0;
  Json meshes_ = Json::array();
};

Json describeVisual(const Visual& visual) {
  const char* const names[] = {"box", "cylinder", "sphere", "mesh"};
  return {{"body", visual.body},
          {"shape", names[static_cast<int>(visual.shape)]},
          {"pose", packPose(visual.X_BV)},
          {"size", packVector(visual.size)},
          {"rgba", packVector(visual.rgba)}};
}

}  // namespace

Json describeDrawing(const LoadedRobot& robot) {
  const Model& model = robot.model;
  MeshStore meshes(robot.directory);
  Json visuals = Json::array();
  std::vector<bool> is_drawn(model.numBodies(), false);
  for (const Visual& visual : model.visuals()) {
    const bool is_mesh = visual.shape == Visual::Shape::Mesh;
    const int mesh = is_mesh ? meshes.find(visual.mesh) : -1;
    if (is_mesh && mesh < 0) continue;
    visuals.push_back(describeVisual(visual));
    visuals.back()["mesh"] = mesh;
    is_drawn[visual.body] = true;
  }
  for (const Visual& visual : listSkeleton(model, is_drawn)) visuals.push_back(describeVisual(visual));
  return {{"visuals", visuals}, {"meshes", meshes.take()}};
}

}  // namespace bielle
