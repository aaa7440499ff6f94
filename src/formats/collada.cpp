#include "formats/collada.h"

#include <Eigen/Geometry>
#include <map>

#include "bielle/model/error.h"
#include "formats/xml_document.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr int kMostNodes = 100'000;
constexpr size_t kMostNumbers = 30'000'000;

class ColladaReader {
 public:
  explicit ColladaReader(const XMLElement& root) : root_(root) { listIds(root); }

  Eigen::Matrix3Xd read() {
    const XMLElement* unit = findChild(&root_, {"asset", "unit"});
    const double metre = unit ? unit->DoubleAttribute("meter", 1) : 1;
    const XMLElement* scene = findChild(&root_, {"scene", "instance_visual_scene"});
    addNode(require(scene, "url"), Eigen::Affine3d(Eigen::Scaling(metre)));
    return Eigen::Map<const Eigen::Matrix3Xd>(points_.data(), 3, static_cast<Eigen::Index>(points_.size() / 3));
  }

 private:
  [[noreturn]] static void fail() { throw InputError("", "mesh", "it is damaged", "save it again"); }

  void listIds(const XMLElement& e) {
    if (const std::string id = getAttribute(&e, "id"); !id.empty()) ids_[id] = &e;
    for (const XMLElement* child : getChildren(e)) listIds(*child);
  }

  static const XMLElement* findChild(const XMLElement* e, std::initializer_list<const char*> path) {
    for (const char* tag : path) e = e ? e->FirstChildElement(tag) : nullptr;
    return e;
  }

  // What "#id" in an attribute refers to.
  const XMLElement& require(const XMLElement* e, const char* attribute) const {
    const std::string url = getAttribute(e, attribute);
    const auto it = ids_.find(url.substr(std::min<size_t>(url.size(), 1)));
    if (it == ids_.end()) fail();
    return *it->second;
  }

  static std::vector<double> getNumbers(const XMLElement* e) {
    std::vector<double> numbers;
    if (!e || !e->GetText() || !parseNumbers(e->GetText(), numbers)) fail();
    return numbers;
  }

  void addNode(const XMLElement& node, Eigen::Affine3d X) {
    if (++nodes_ > kMostNodes) fail();
    for (const XMLElement* e : getChildren(node)) {
      const std::string tag = getTag(*e);
      if (tag == "node")
        addNode(*e, X);
      else if (tag == "instance_node")
        addInstance(require(e, "url"), X);
      else if (tag == "instance_geometry")
        addGeometry(require(e, "url"), X);
      else if (tag == "matrix" || tag == "translate" || tag == "rotate" || tag == "scale")
        transform(tag, getNumbers(e), X);
      else if (tag == "lookat" || tag == "skew")
        fail();  // better no shape than one in another place
    }
  }

  // Nodes that are elsewhere in the file may contain this one.
  void addInstance(const XMLElement& node, const Eigen::Affine3d& X) {
    constexpr int kDeepest = 20;
    if (++depth_ > kDeepest) fail();
    addNode(node, X);
    --depth_;
  }

  static void transform(const std::string& tag, const std::vector<double>& n, Eigen::Affine3d& X) {
    if (n.size() != (tag == "matrix" ? 16 : tag == "rotate" ? 4 : 3)) fail();
    const Vector3d v(n[0], n[1], n[2]);
    if (tag == "matrix")
      X = X * Eigen::Affine3d(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data()));
    else if (tag == "translate")
      X.translate(v);
    else if (tag == "scale")
      X.scale(v);
    else
      X.rotate(Eigen::AngleAxisd(n[3] * EIGEN_PI / 180, v.normalized()));
  }

  void addGeometry(const XMLElement& geometry, const Eigen::Affine3d& X) {
    const XMLElement* vertices = findChild(&geometry, {"mesh", "vertices"});
    if (!vertices) return;  // a spline
    for (const XMLElement* input : getChildren(*vertices, "input")) {
      if (getAttribute(input, "semantic") != "POSITION") continue;
      const XMLElement& source = require(input, "source");
      const XMLElement* accessor = findChild(&source, {"technique_common", "accessor"});
      const size_t stride = accessor ? accessor->UnsignedAttribute("stride", 3) : 3;
      const std::vector<double> numbers = getNumbers(source.FirstChildElement("float_array"));
      if (stride < 3 || points_.size() + numbers.size() > kMostNumbers) fail();
      for (size_t i = 0; i + 2 < numbers.size(); i += stride) {
        const Vector3d p = X * Vector3d(numbers[i], numbers[i + 1], numbers[i + 2]);
        points_.insert(points_.end(), p.begin(), p.end());
      }
    }
  }

  const XMLElement& root_;
  std::map<std::string, const XMLElement*> ids_;
  std::vector<double> points_;
  int nodes_ = 0, depth_ = 0;
};

}  // namespace

Eigen::Matrix3Xd readCollada(const std::string& text) {
  XMLDocument document;
  try {
    return ColladaReader(parseXml(text, "", "COLLADA", document)).read();
  } catch (const InputError&) {
    return {};
  }
}

}  // namespace bielle
