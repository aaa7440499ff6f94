#include "formats/dxf.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <set>

#include "bielle/model/error.h"

namespace bielle {
namespace {

using Eigen::Vector2d;

constexpr double kSameHole = 1e-7, kPlane = 1e-6;     // m
constexpr double kOutline = 1.25;                     // over the diameter of the holes
constexpr double kGapOfPlates = 15, kTextHeight = 3;  // mm
constexpr const char* kNotes = "NOTES";

// The direction along which a link is flat; false if there is none.
bool findNormal(const std::vector<Pivot>& pivots, Vector3d& normal) {
  normal.setZero();
  for (const Pivot& pivot : pivots) {
    if (pivot.axis.isZero()) continue;
    if (!normal.isZero() && normal.cross(pivot.axis).norm() > 1e-9) return false;
    if (normal.isZero()) normal = pivot.axis;
  }
  if (!normal.isZero()) return true;
  // Balls alone: a rod, or what lies in a plane.
  Vector3d along = Vector3d::Zero();
  for (const Pivot& pivot : pivots)
    if ((pivot.p - pivots[0].p).norm() > along.norm()) along = pivot.p - pivots[0].p;
  for (const Pivot& pivot : pivots)
    if (const Vector3d n = along.cross(pivot.p - pivots[0].p); n.norm() > kPlane * along.norm())
      normal = n.normalized();
  if (normal.isZero()) normal = along.unitOrthogonal();
  return std::all_of(pivots.begin(), pivots.end(),
                     [&](const Pivot& pivot) { return std::abs(normal.dot(pivot.p - pivots[0].p)) < kPlane; });
}

Plate flatten(const RigidLink& link, const Vector3d& normal) {
  Plate plate{link.name, {}};
  std::vector<Vector3d> centers;
  for (const Pivot& pivot : link.pivots) {
    const Vector3d d = pivot.p - link.pivots[0].p, flat = d - normal * normal.dot(d);
    const auto is_here = [&flat](const Vector3d& other) { return (other - flat).norm() < kSameHole; };
    if (const auto at = std::find_if(centers.begin(), centers.end(), is_here); at != centers.end()) {
      std::string& name = plate.holes[static_cast<size_t>(at - centers.begin())].first;
      if (name != pivot.name) name += "+" + pivot.name;
      continue;
    }
    centers.push_back(flat);
    plate.holes.push_back({pivot.name, Vector2d::Zero()});
  }
  const Vector3d far = *std::max_element(centers.begin(), centers.end(),
                                         [](const Vector3d& a, const Vector3d& b) { return a.norm() < b.norm(); });
  if (far.isZero()) return plate;
  const Vector3d x = far.normalized(), y = normal.cross(x);
  for (size_t i = 0; i < centers.size(); ++i) plate.holes[i].second = {x.dot(centers[i]), y.dot(centers[i])};
  return plate;
}

// Corners of the convex hull, counter-clockwise; both ends of what lies on a line.
std::vector<Vector2d> calcCorners(const Plate& plate) {
  std::vector<Vector2d> points;
  for (const auto& hole : plate.holes) points.push_back(hole.second);
  std::sort(points.begin(), points.end(),
            [](const Vector2d& a, const Vector2d& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::vector<Vector2d> corners;
  for (const bool back : {false, true}) {
    const size_t first = corners.size();
    for (const Vector2d& p : points) {
      while (corners.size() > first + 1) {
        const Vector2d u = corners.back() - corners[corners.size() - 2], w = p - corners.back();
        if (u.x() * w.y() - u.y() * w.x() > 1e-12) break;
        corners.pop_back();
      }
      corners.push_back(p);
    }
    corners.pop_back();
    if (!back) std::reverse(points.begin(), points.end());
  }
  return corners;
}

class DxfWriter {
 public:
  explicit DxfWriter(double hole) : hole_(1000 * hole) {}

  std::string write(const std::vector<Plate>& plates) {
    std::vector<std::string> layers;
    std::set<std::string> used = {kNotes};
    for (const Plate& plate : plates) layers.push_back(nameLayer(plate.name, used));
    writeHead(layers);
    pair(0, "SECTION"), pair(2, "ENTITIES");
    double y = 0;
    for (size_t i = 0; i < plates.size(); ++i) y = writePlate(plates[i], layers[i], y);
    pair(0, "ENDSEC"), pair(0, "EOF");
    return out_;
  }

 private:
  void pair(int code, const std::string& value) { out_ += std::to_string(code) + "\n" + value + "\n"; }
  void pair(int code, double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9f", value);
    pair(code, std::string(text));
  }

  // R12 allows 31 letters, digits and some signs.
  static std::string nameLayer(const std::string& name, std::set<std::string>& used) {
    std::string base;
    for (const char c : name.substr(0, 26))
      base += std::isalnum(static_cast<unsigned char>(c))
                  ? static_cast<char>(std::toupper(static_cast<unsigned char>(c)))
                  : '_';
    std::string layer = base;
    for (int i = 2; !used.insert(layer).second; ++i) layer = base + "_" + std::to_string(i);
    return layer;
  }

  void writeHead(const std::vector<std::string>& layers) {
    pair(999, "millimetres"), pair(0, "SECTION"), pair(2, "HEADER");
    pair(9, "$ACADVER"), pair(1, "AC1009"), pair(0, "ENDSEC");
    pair(0, "SECTION"), pair(2, "TABLES"), pair(0, "TABLE"), pair(2, "LAYER");
    pair(70, std::to_string(layers.size() + 1));
    std::vector<std::string> all = layers;
    all.push_back(kNotes);
    for (const std::string& layer : all) {
      pair(0, "LAYER"), pair(2, layer), pair(70, "0");
      pair(62, layer == kNotes ? "8" : "7"), pair(6, "CONTINUOUS");
    }
    pair(0, "ENDTAB"), pair(0, "ENDSEC");
  }

  void writeText(const Vector2d& at, double height, const std::string& text) {
    pair(0, "TEXT"), pair(8, kNotes), pair(10, at.x()), pair(20, at.y()), pair(30, 0.0), pair(40, height),
        pair(1, text);
  }

  // Below `top`, mm; returns where the next one may begin.
  double writePlate(const Plate& plate, const std::string& layer, double top) {
    const std::vector<Vector2d> corners = calcCorners(plate);
    double low = 0, high = 0;
    for (const Vector2d& c : corners) low = std::min(low, 1000 * c.y()), high = std::max(high, 1000 * c.y());
    const double reach = kOutline * hole_;
    const Vector2d origin(0, top - 3 * kTextHeight - reach - high);
    writeText({-reach, top - kTextHeight}, kTextHeight, plate.name);
    writeOutline(corners, origin, reach, layer);
    for (const auto& [name, at] : plate.holes) {
      const Vector2d center = origin + 1000 * at;
      pair(0, "CIRCLE"), pair(8, layer), pair(10, center.x()), pair(20, center.y()), pair(30, 0.0), pair(40, hole_ / 2);
      writeText(center + Vector2d(0.6 * hole_, 0.6 * hole_), 0.6 * kTextHeight, name);
    }
    for (size_t i = 0; i + 1 < plate.holes.size(); ++i)
      for (size_t k = i + 1; k < plate.holes.size(); ++k) writeDistance(plate, i, k, origin);
    return origin.y() + low - reach - kGapOfPlates;
  }

  // Of all pairs of up to three holes; of more, from the first one and from the one before.
  void writeDistance(const Plate& plate, size_t i, size_t k, const Vector2d& origin) {
    if (plate.holes.size() > 3 && i > 0 && k != i + 1) return;
    const Vector2d a = 1000 * plate.holes[i].second, b = 1000 * plate.holes[k].second;
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", (b - a).norm());
    writeText(origin + (a + b) / 2 - Vector2d(1.5 * kTextHeight, 1.5 * kTextHeight), kTextHeight, text);
  }

  // Parallel to the hull, with arcs about its corners.
  void writeOutline(const std::vector<Vector2d>& corners, const Vector2d& origin, double reach,
                    const std::string& layer) {
    pair(0, "POLYLINE"), pair(8, layer), pair(66, "1"), pair(70, "1"), pair(10, 0.0), pair(20, 0.0), pair(30, 0.0);
    const size_t n = corners.size();
    for (size_t i = 0; i < n; ++i) {
      const Vector2d in = (corners[i] - corners[(i + n - 1) % n]).normalized(),
                     out = (corners[(i + 1) % n] - corners[i]).normalized();
      double turn = std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out));
      if (turn < 0) turn += 2 * M_PI;  // half a turn at the ends of a rod
      const Vector2d c = origin + 1000 * corners[i];
      writeVertex(c + reach * Vector2d(in.y(), -in.x()), std::tan(turn / 4), layer);
      writeVertex(c + reach * Vector2d(out.y(), -out.x()), 0, layer);
    }
    pair(0, "SEQEND"), pair(8, layer);
  }

  void writeVertex(const Vector2d& at, double bulge, const std::string& layer) {
    pair(0, "VERTEX"), pair(8, layer), pair(10, at.x()), pair(20, at.y()), pair(30, 0.0), pair(42, bulge);
  }

  double hole_;  // mm
  std::string out_;
};

}  // namespace

std::vector<Plate> listPlates(const Model& model, std::vector<std::string>* left_out) {
  std::vector<Plate> plates;
  for (const RigidLink& link : listRigidLinks(model)) {
    Vector3d normal;
    if (link.pivots.size() < 2) continue;
    if (!findNormal(link.pivots, normal)) {
      if (left_out) left_out->push_back(link.name);
      continue;
    }
    Plate plate = flatten(link, normal);
    if (plate.holes.size() > 1) plates.push_back(std::move(plate));
  }
  return plates;
}

DxfText formatDxf(const Model& model, double hole) {
  std::vector<std::string> left_out;
  const std::vector<Plate> plates = listPlates(model, &left_out);
  if (plates.empty())
    throw InputError(model.name(), "links", "none of them is plane: their hinges are not parallel",
                     "draw them from `bielle convert --to sheet`");
  DxfText out{DxfWriter(hole).write(plates), {}};
  for (const std::string& link : left_out)
    out.warnings.push_back("link '" + link +
                           "' is left out: its hinges are not parallel, or its pivots not in a plane");
  return out;
}

}  // namespace bielle
