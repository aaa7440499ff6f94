// Meshes of kinds that assimp reads, against the same body as STL.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <sstream>

#include "formats/mesh.h"
#include "formats/mesh_inertia.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A wedge.
const std::vector<std::array<double, 3>> kVertices = {{0, 0, 0},   {0.3, 0, 0}, {0.3, 0.2, 0},
                                                      {0, 0.2, 0}, {0, 0, 0.1}, {0, 0.2, 0.1}};
const std::vector<std::array<int, 3>> kFaces = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {3, 5, 2},
                                                {1, 2, 5}, {1, 5, 4}, {0, 4, 5}, {0, 5, 3}};

std::string write(const std::string& begin, const std::string& face_prefix) {
  std::ostringstream out;
  out << begin;
  for (const auto& [x, y, z] : kVertices) out << x << " " << y << " " << z << "\n";
  for (const auto& [a, b, c] : kFaces) out << face_prefix << a << " " << b << " " << c << "\n";
  return out.str();
}

std::string writeStl() {
  std::ostringstream out;
  out << "solid wedge\n";
  for (const auto& face : kFaces) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const int i : face)
      out << "vertex " << kVertices[i][0] << " " << kVertices[i][1] << " " << kVertices[i][2] << "\n";
    out << "endloop\nendfacet\n";
  }
  out << "endsolid\n";
  return out.str();
}

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 8\n"
    "property list uchar int vertex_indices\nend_header\n";

// COLLADA with a node that is moved, and an axis that counts for nothing. `more`: other nodes of the scene.
std::string writeCollada(const std::string& more = "") {
  std::ostringstream out;
  out << "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\"><asset><unit meter=\"1\"/>"
         "<up_axis>Y_UP</up_axis></asset><library_geometries><geometry id=\"g\"><mesh><source id=\"p\"><float_array "
         "id=\"a\" "
         "count=\"18\">";
  for (const auto& [x, y, z] : kVertices) out << x - 1 << " " << y << " " << z << " ";
  out << "</float_array><technique_common><accessor source=\"#a\" count=\"6\" stride=\"3\"><param name=\"X\" "
         "type=\"float\"/>"
         "<param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
         "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"8\">"
         "<input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>";
  for (const auto& [a, b, c] : kFaces) out << a << " " << b << " " << c << " ";
  out << "</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id=\"s\"><node "
         "id=\"n\">"
         "<matrix>1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url=\"#g\"/></node>"
      << more
      << "</visual_scene>"
         "</library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n";
  return out.str();
}

// Corners of the triangles, in an order of their own.
std::vector<std::array<double, 9>> sortTriangles(const Eigen::Matrix3Xd& corners) {
  std::vector<std::array<double, 9>> out(static_cast<size_t>(corners.cols() / 3));
  for (size_t i = 0; i < out.size(); ++i) {
    Eigen::Matrix3d t = corners.middleCols<3>(static_cast<Eigen::Index>(3 * i));
    int first = 0;
    for (int k = 1; k < 3; ++k)
      if (std::lexicographical_compare(t.col(k).begin(), t.col(k).end(), t.col(first).begin(), t.col(first).end()))
        first = k;
    for (int k = 0; k < 9; ++k) out[i][k] = t(k % 3, (first + k / 3) % 3);
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

TEST_CASE("meshes of further kinds have the triangles and the shape of the same body as STL") {
  const RobotDirectory files;
  files.write("wedge.stl", writeStl());
  const auto expected = sortTriangles(readTriangles("wedge.stl", files.path()));
  REQUIRE(expected.size() == kFaces.size());
  const Shape shape = fitMesh("wedge.stl", files.path(), Vector3d::Ones()).value();
  files.write("wedge.ply", write(kPly, "3 "));
  files.write("wedge.off", write("OFF\n6 8 0\n", "3 "));
  files.write("wedge.dae", writeCollada());
  for (const std::string name : {"wedge.ply", "wedge.off", "wedge.dae"}) {
    CAPTURE(name);
    const auto triangles = sortTriangles(readTriangles(name, files.path()));
    REQUIRE(triangles.size() == expected.size());
    for (size_t i = 0; i < expected.size(); ++i)
      for (int k = 0; k < 9; ++k) CHECK(triangles[i][k] == Approx(expected[i][k]).margin(1e-6));
    const std::optional<Shape> fitted = fitMesh(name, files.path(), Vector3d::Ones());
    REQUIRE(fitted);
    CHECK((fitted->half - shape.half).norm() < 1e-6);
    CHECK((fitted->X_BS.p - shape.X_BS.p).norm() < 1e-6);
    CHECK(fitted->radius == Approx(shape.radius).margin(1e-6));
  }
}

TEST_CASE("a mirrored instance in a mesh has the volume of the part") {
  const RobotDirectory files;
  const auto calcVolume = [&](const std::string& collada) {
    files.write("parts.dae", collada);
    return calcMeshInertia(readTriangles("parts.dae", files.path()), MeshSolid::Enclosed).value().mass;
  };
  const double wedge = 0.3 * 0.1 / 2 * 0.2;
  CHECK(calcVolume(writeCollada()) == Approx(wedge));
  const auto place = [](const char* matrix) {
    return std::string("<node id=\"m\"><matrix>") + matrix + "</matrix><instance_geometry url=\"#g\"/></node>";
  };
  CHECK(calcVolume(writeCollada(place("1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1"))) == Approx(2 * wedge));
  CHECK(calcVolume(writeCollada(place("1 0 0 5 0 -1 0 0 0 0 1 0 0 0 0 1"))) == Approx(2 * wedge));
  CHECK(calcVolume(writeCollada(place("-2 0 0 5 0 -1 0 0 0 0 -1 0 0 0 0 1"))) == Approx(3 * wedge));
}

TEST_CASE("meshes that are cut off, empty or of no known kind give nothing") {
  const RobotDirectory files;
  const std::string ply = write(kPly, "3 ");
  files.write("cut.ply", ply.substr(0, ply.size() / 2));
  files.write("empty.ply", "");
  files.write("header.ply", kPly);
  files.write("wedge.text", "no mesh at all\n");
  // Valid, but assimp takes the camera for a vertex.
  std::string camera = ply;
  camera.insert(camera.find("element vertex"), "element camera 1\nproperty float focus\n");
  camera.insert(camera.find("end_header\n") + 11, "7\n");
  files.write("camera.ply", camera);
  files.write("-option.ply", ply);
  CHECK(readTriangles("cut.ply", files.path()).cols() == 0);  // assimp never ends on it
  for (const std::string name : {"empty.ply", "header.ply", "camera.ply", "wedge.text", "missing.ply"}) {
    CAPTURE(name);
    CHECK(readTriangles(name, files.path()).cols() == 0);
    CHECK_FALSE(fitMesh(name, files.path(), Vector3d::Ones()));
  }
  CHECK(readTriangles("-option.ply", files.path()).cols() == 24);
}

namespace {

// A triangle with the corners (0, 0, 0), (0.1, 0, 0), (0, 0.2, 0) as glTF: floats, or whole numbers of 16 bits in units of 0.1 mm.
// Text, or binary with a chunk of JSON and one of numbers.
std::string writeGltf(bool is_quantized, const std::string& required, bool is_binary) {
  const std::array<float, 9> floats = {0, 0, 0, 0.1F, 0, 0, 0, 0.2F, 0};
  const std::array<std::int16_t, 12> shorts = {0, 0, 0, 0, 1000, 0, 0, 0, 0, 2000, 0, 0};
  const std::string base64 = is_quantized ? "AAAAAAAAAADoAwAAAAAAAAAA0AcAAAAA"
                                          : "AAAAAAAAAAAAAAAAzczMPQAAAAAAAAAAAAAAAM3MTD4AAAAA",
                    bytes = is_quantized ? std::string(reinterpret_cast<const char*>(shorts.data()), sizeof shorts)
                                         : std::string(reinterpret_cast<const char*>(floats.data()), sizeof floats),
                    size = std::to_string(bytes.size());
  std::string json =
      R"({"asset": {"version": "2.0"}, )" +
      (required.empty()
           ? ""
           : R"("extensionsUsed": [")" + required + R"("], "extensionsRequired": [")" + required + "\"], ") +
      R"("buffers": [{"byteLength": )" + size +
      (is_binary ? "" : R"(, "uri": "data:application/octet-stream;base64,)" + base64 + "\"") +
      R"(}], "bufferViews": [{"buffer": 0, "byteLength": )" + size + (is_quantized ? R"(, "byteStride": 8)" : "") +
      R"(}], "accessors": [{"bufferView": 0, "count": 3, "type": "VEC3", )" +
      (is_quantized ? R"("componentType": 5122, "min": [0, 0, 0], "max": [1000, 2000, 0])"
                    : R"("componentType": 5126, "min": [0, 0, 0], "max": [0.1, 0.2, 0])") +
      R"(}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0)" +
      (is_quantized ? R"(, "scale": [0.0001, 0.0001, 0.0001])" : "") + R"(}], "scenes": [{"nodes": [0]}], "scene": 0})";
  if (!is_binary) return json;
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto number = [](size_t n) {
    const auto word = static_cast<std::uint32_t>(n);
    return std::string(reinterpret_cast<const char*>(&word), sizeof word);
  };
  return "glTF" + number(2) + number(28 + json.size() + bytes.size()) + number(json.size()) + "JSON" + json +
         number(bytes.size()) + std::string("BIN\0", 4) + bytes;
}

}  // namespace

TEST_CASE("a glTF whose numbers need an extension gives nothing rather than a part that has collapsed") {
  const RobotDirectory files;
  const std::string quantization = "KHR_mesh_quantization";
  files.write("part.gltf", writeGltf(false, "", false));
  files.write("part.glb", writeGltf(false, "", true));
  files.write("shiny.gltf", writeGltf(false, "KHR_materials_unlit", false));
  files.write("small.gltf", writeGltf(true, quantization, false));
  files.write("small.glb", writeGltf(true, quantization, true));
  for (const std::string name : {"part.gltf", "part.glb", "shiny.gltf"}) {
    CAPTURE(name);
    const Eigen::Matrix3Xd corners = readTriangles(name, files.path());
    REQUIRE(corners.cols() == 3);
    CHECK((corners.rowwise().maxCoeff() - Vector3d(0.1, 0.2, 0)).norm() < 1e-7);
  }
  for (const std::string name : {"small.gltf", "small.glb"}) {
    CAPTURE(name);
    CHECK(readTriangles(name, files.path()).cols() == 0);
    CHECK_FALSE(fitMesh(name, files.path(), Vector3d::Ones()));
  }
}

namespace {

// The faces of a box, seen from outside.
Eigen::Matrix3Xd makeBox(const Vector3d& low, const Vector3d& high) {
  Eigen::Matrix3Xd corners(3, 36);
  Eigen::Index column = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 1}) {
      const auto place = [&](int u, int v) {
        Vector3d p;
        p[axis] = side ? high[axis] : low[axis];
        p[(axis + 1) % 3] = u ? high[(axis + 1) % 3] : low[(axis + 1) % 3];
        p[(axis + 2) % 3] = v ? high[(axis + 2) % 3] : low[(axis + 2) % 3];
        return p;
      };
      for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}})
        corners.col(column++) = side ? place(u, v) : place(v, u);
    }
  return corners;
}

Eigen::Matrix3Xd mirror(Eigen::Matrix3Xd corners) {
  corners.row(0) *= -1;
  return corners;
}

Eigen::Matrix3Xd join(const std::vector<Eigen::Matrix3Xd>& parts) {
  Eigen::Matrix3Xd all(3, 0);
  for (const Eigen::Matrix3Xd& part : parts) {
    all.conservativeResize(3, all.cols() + part.cols());
    all.rightCols(part.cols()) = part;
  }
  return all;
}

Eigen::Matrix3Xd turnInside(const Eigen::Matrix3Xd& corners) { return corners.rowwise().reverse(); }

}  // namespace

TEST_CASE("shells of one mesh: mirrored ones count as the part does, and cavities are taken off") {
  const Eigen::Matrix3Xd part = makeBox({0, 0, 0}, {0.3, 0.2, 0.1}), far = makeBox({1, 0, 0}, {1.3, 0.2, 0.1});
  const Eigen::Matrix3Xd inner = makeBox({0.1, 0.05, 0.02}, {0.2, 0.15, 0.08}),
                         hollow = join({turnInside(inner), part});
  const double V = 0.3 * 0.2 * 0.1, v = 0.1 * 0.1 * 0.06;
  const auto calc = [](const std::vector<Eigen::Matrix3Xd>& parts) {
    return calcMeshInertia(join(parts), MeshSolid::Enclosed).value();
  };
  CHECK(calc({part}).mass == Approx(V));
  CHECK(calc({turnInside(part)}).mass == Approx(V));
  for (const Eigen::Matrix3Xd& other : {mirror(far), mirror(part)})  // apart, and face to face
    for (const bool is_first : {false, true}) {
      const Inertia both = is_first ? calc({other, part}) : calc({part, other});
      CHECK(both.mass == Approx(2 * V));
      CHECK(both.com.x() == Approx((0.15 + other.row(0).mean()) / 2).margin(1e-12));
    }
  for (const bool is_mirrored : {false, true}) {
    const Eigen::Matrix3Xd one = is_mirrored ? mirror(hollow) : hollow;
    CHECK(calc({one}).mass == Approx(V - v));
    CHECK(calc({one, far}).mass == Approx(2 * V - v));
    CHECK(calc({one, mirror(far)}).mass == Approx(2 * V - v));
    const Inertia alone = calc({hollow}), turned = calc({one});
    CHECK(turned.com.x() == Approx(is_mirrored ? -alone.com.x() : alone.com.x()));
    CHECK((turned.I_com.diagonal() - alone.I_com.diagonal()).norm() < 1e-12 * alone.I_com.norm());
  }
  CHECK(calc({part, inner}).mass == Approx(V + v));  // of another material, not a cavity
  CHECK(calc({part, mirror(far), inner}).mass == Approx(2 * V + v));
  // In a file, whose numbers are float.
  const RobotDirectory files;
  std::ostringstream stl;
  stl << "solid two\n";
  const Eigen::Matrix3Xd two = join({part, mirror(far)});
  for (Eigen::Index i = 0; i < two.cols(); i += 3) {
    stl << "facet normal 0 0 0\nouter loop\n";
    for (int k = 0; k < 3; ++k) stl << "vertex " << two.col(i + k).transpose() << "\n";
    stl << "endloop\nendfacet\n";
  }
  files.write("two.stl", stl.str() + "endsolid\n");
  CHECK(calcMeshInertia(readTriangles("two.stl", files.path()), MeshSolid::Enclosed).value().mass == Approx(2 * V));
}
