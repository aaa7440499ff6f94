#include "report/drawing.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "bielle/dynamics/kinematics.h"
#include "formats/fastenings.h"
#include "formats/mesh.h"
#include "math/direction.h"
#include "report/pack.h"

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

Json describeShape(const char* shape, int body, const SE3& X_BV, const Vector3d& size, const Eigen::Vector4d& rgba) {
  return {{"body", body},
          {"shape", shape},
          {"pose", packPose(X_BV)},
          {"size", packVector(size)},
          {"rgba", packVector(rgba)}};
}

double calcExtent(const Model& model) {
  Workspace ws(model);
  updatePlacements(model, ws, model.makeNeutral());
  Eigen::AlignedBox3d box;
  for (int i = 1; i < model.numBodies(); ++i) box.extend(ws.X_WB[i].p);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

void addRods(int body, const std::vector<Vector3d>& points, double radius, Json& visuals) {
  static const Eigen::Vector4d kRod(0.45, 0.53, 0.62, 1), kJoint(0.22, 0.26, 0.32, 1);
  visuals.push_back(describeShape("sphere", body, SE3::Identity(), {1.6 * radius, 0, 0}, kJoint));
  for (const Vector3d& point : points) {
    if (point.norm() < radius) continue;
    SE3 X;
    X.R = calcRotationOfZ(point);
    X.p = point / 2;
    visuals.push_back(describeShape("cylinder", body, X, {radius, point.norm(), 0}, kRod));
  }
}

// Bodies 1, 2, ... without a drawing.
void addSkeleton(const Model& model, const std::vector<bool>& is_drawn, Json& visuals) {
  const std::vector<std::vector<Vector3d>> fastenings = listFastenings(model);
  const double extent = calcExtent(model), radius = extent > 0 ? 0.012 * extent : 0.01;
  for (int i = 1; i < model.numBodies(); ++i) {
    if (is_drawn[i]) continue;
    std::vector<Vector3d> points = fastenings[i];
    const bool is_end = std::all_of(points.begin(), points.end(), [=](const Vector3d& p) { return p.norm() < radius; });
    if (is_end && model.bodies()[i].inertia.mass > 0) points.push_back(model.bodies()[i].inertia.com);
    addRods(i, points, radius, visuals);
  }
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
    const char* const names[] = {"box", "cylinder", "sphere", "mesh"};
    visuals.push_back(
        describeShape(names[static_cast<int>(visual.shape)], visual.body, visual.X_BV, visual.size, visual.rgba));
    visuals.back()["mesh"] = mesh;
    is_drawn[visual.body] = true;
  }
  addSkeleton(model, is_drawn, visuals);
  return {{"visuals", visuals}, {"meshes", meshes.take()}};
}

}  // namespace bielle
