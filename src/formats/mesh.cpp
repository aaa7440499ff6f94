#include "formats/mesh.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <sstream>

#include "formats/collada.h"
#include "formats/companion.h"
#include "formats/process.h"
#include "math/decompositions.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

constexpr std::uintmax_t kLargest = 100'000'000;  // bytes
using Points = Eigen::Matrix3Xd;

// Binary STL: a header of 80 bytes, the number of triangles, and for each of them 12 floats, of which the first three are
// its normal, and two bytes.
constexpr size_t kHeader = 84, kTriangle = 50;

size_t countTriangles(const std::string& stl) {
  std::uint32_t count = 0;
  if (stl.size() >= kHeader) std::memcpy(&count, stl.data() + kHeader - sizeof count, sizeof count);
  return count;
}

bool isBinaryStl(const std::string& stl) {
  return stl.size() >= kHeader && stl.size() == kHeader + kTriangle * countTriangles(stl);
}

Points readBinaryStl(const std::string& stl) {
  const size_t count = countTriangles(stl);
  Points points(3, 3 * count);
  for (size_t i = 0; i < count; ++i) {
    float corners[9];
    std::memcpy(corners, stl.data() + kHeader + kTriangle * i + 3 * sizeof(float), sizeof corners);
    for (int k = 0; k < 9; ++k) points(k % 3, static_cast<Eigen::Index>(3 * i) + k / 3) = corners[k];
  }
  return points;
}

// The three numbers after each `keyword` that a line begins with.
Points readVertices(const std::string& text, const std::string& keyword) {
  std::vector<double> numbers;
  std::istringstream lines(text);
  for (std::string line, word; std::getline(lines, line);) {
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    Vector3d p;
    if (!(words >> word) || word != keyword) continue;
    if (!(words >> p[0] >> p[1] >> p[2])) return {};
    numbers.insert(numbers.end(), p.begin(), p.end());
  }
  return Eigen::Map<const Points>(numbers.data(), 3, static_cast<Eigen::Index>(numbers.size() / 3));
}

std::string getExtension(const std::string& mesh) {
  std::string extension = fs::path(mesh).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

struct MeshFile {
  std::string extension, content;
};

// A file of any kind and so many bytes as STL; "" if assimp cannot read it, or is not there. On some damaged files it never ends.
std::string convertToStl(const fs::path& file, std::uintmax_t size) {
  constexpr double kLeast = 4, kPerByte = 2e-6;  // s
  const double longest = kLeast + kPerByte * static_cast<double>(size);
  const ProcessOutput run = runProcess({obtainCompanion("bielle-mesh"), file.string()}, longest);
  return run.status == 0 ? run.out : "";
}

// The whole file, those that are not of these kinds as STL; without content if there is none, or it is too large.
MeshFile readMeshFile(const std::string& mesh, const std::string& directory, std::initializer_list<const char*> kinds) {
  const std::string extension = getExtension(mesh);
  const fs::path place = findMesh(mesh, directory);
  std::error_code error;
  const std::uintmax_t size = place.empty() ? 0 : fs::file_size(place, error);
  if (place.empty() || error || size > kLargest) return {};
  if (std::find(kinds.begin(), kinds.end(), extension) == kinds.end()) return {".stl", convertToStl(place, size)};
  std::ifstream file(place, std::ios::binary);
  return {extension, {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()}};
}

Points readMesh(const std::string& mesh, const std::string& directory) {
  const auto [extension, content] = readMeshFile(mesh, directory, {".stl", ".obj", ".dae"});
  if (extension == ".dae") return readCollada(content);
  if (extension == ".obj") return readVertices(content, "v");
  return isBinaryStl(content) ? readBinaryStl(content) : readVertices(content, "vertex");
}

// Corners of the faces of an OBJ file. They count vertices from 1, or backwards from the last one above by negative
// numbers; what follows a slash are normals and textures.
Points readObjFaces(const std::string& text) {
  const Points vertices = readVertices(text, "v");
  std::vector<double> corners;
  Eigen::Index above = 0;
  std::istringstream lines(text);
  for (std::string line, word; std::getline(lines, line);) {
    std::istringstream words(line);
    if (!(words >> word)) continue;
    above += word == "v";
    if (word != "f") continue;
    std::vector<Eigen::Index> face;
    while (words >> word) {
      const long number = std::strtol(word.c_str(), nullptr, 10);
      const Eigen::Index index = number < 0 ? above + number : number - 1;
      if (index < 0 || index >= vertices.cols()) return {};
      face.push_back(index);
    }
    for (size_t i = 2; i < face.size(); ++i)
      for (const Eigen::Index corner : {face[0], face[i - 1], face[i]})
        corners.insert(corners.end(), vertices.col(corner).begin(), vertices.col(corner).end());
  }
  return Eigen::Map<const Points>(corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
}

// The box around points p along the columns of R.
Shape fitBox(const Points& p, const Matrix3d& R) {
  const Points local = R.transpose() * p;
  const Vector3d low = local.rowwise().minCoeff(), high = local.rowwise().maxCoeff();
  Shape shape;
  shape.X_BS = {R, R * (low + high) / 2};
  shape.half = (high - low) / 2;
  return shape;
}

// The capsule around points p whose segment is in the middle of the box around them, along an axis of that.
Shape fitCapsule(const Points& p, const Shape& box, int axis) {
  Shape shape;
  const Matrix3d& R = box.X_BS.R;
  shape.X_BS.R << R.col((axis + 1) % 3), R.col((axis + 2) % 3), R.col(axis);
  const Points local = shape.X_BS.R.transpose() * (p.colwise() - box.X_BS.p);
  const Eigen::ArrayXd across = local.topRows<2>().colwise().norm();
  shape.radius = across.maxCoeff();
  // A point is inside if the segment reaches as far as the sphere around its end must.
  const Eigen::ArrayXd depth = (shape.radius * shape.radius - across.square()).max(0).sqrt();
  const Eigen::ArrayXd along = local.row(2).transpose();
  double low = (along + depth).minCoeff(), high = (along - depth).maxCoeff();
  if (low > high) low = high = (low + high) / 2;  // a sphere holds all
  shape.X_BS.p = box.X_BS.p + (low + high) / 2 * shape.X_BS.R.col(2);
  shape.half.z() = (high - low) / 2;
  return shape;
}

double calcVolume(const Shape& shape) {
  const double r = shape.radius;
  return r > 0 ? EIGEN_PI * r * r * (2 * shape.half.z() + 4. / 3 * r) : 8 * shape.half.prod();
}

}  // namespace

fs::path findMesh(const std::string& mesh, const std::string& directory) {
  const std::string package = mesh.rfind("model://", 0) == 0 ? "model://" : "package://", file = "file://";
  std::vector<fs::path> places;
  if (mesh.rfind(file, 0) == 0) {
    places.emplace_back(mesh.substr(file.size()));
  } else if (mesh.rfind(package, 0) != 0) {
    places.push_back(directory / fs::path(mesh));
  } else {
    const std::string named = mesh.substr(package.size());
    places.push_back(directory / fs::path(named.substr(std::min(named.size(), named.find('/') + 1))));
    std::error_code error;
    for (fs::path up = fs::absolute(directory, error); !up.empty(); up = up.parent_path()) {
      places.push_back(up / named);
      if (up == up.root_path()) break;
    }
    const char* variable = std::getenv("ROS_PACKAGE_PATH");
    std::istringstream packages(variable ? variable : "");
    for (std::string place; std::getline(packages, place, ':');) places.push_back(fs::path(place) / named);
  }
  for (const fs::path& place : places) {
    std::error_code error;
    if (fs::is_regular_file(place, error)) return place;
  }
  return {};
}

Eigen::Matrix3Xd readTriangles(const std::string& mesh, const std::string& directory) {
  const auto [extension, content] = readMeshFile(mesh, directory, {".stl", ".obj"});
  Points corners;
  if (extension == ".obj")
    corners = readObjFaces(content);
  else
    corners = isBinaryStl(content) ? readBinaryStl(content) : readVertices(content, "vertex");
  if (corners.cols() % 3 != 0 || !corners.allFinite()) return {};
  return corners;
}

std::optional<Shape> fitMesh(const std::string& mesh, const std::string& directory, const Vector3d& scale) {
  const Points points = scale.asDiagonal() * readMesh(mesh, directory);
  if (points.cols() == 0 || !points.allFinite()) return {};
  const Points from_mean = points.colwise() - points.rowwise().mean();
  const Matrix3d spread = from_mean * from_mean.transpose();
  Matrix3d principal = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors();
  principal.col(2) = principal.col(0).cross(principal.col(1));
  std::optional<Shape> best;
  const auto consider = [&](const Shape& shape) {
    if (!best || calcVolume(shape) < calcVolume(*best)) best = shape;
  };
  for (const Matrix3d& R : {Matrix3d(Matrix3d::Identity()), principal}) {
    const Shape box = fitBox(points, R);
    consider(box);
    for (int axis = 0; axis < 3; ++axis) consider(fitCapsule(points, box, axis));
  }
  if (!best->half.allFinite() || !best->X_BS.p.allFinite() || !best->X_BS.R.allFinite()) return {};
  return best;
}

}  // namespace bielle
