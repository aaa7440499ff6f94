#include "worlds/terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "bielle/model/error.h"
#include "bielle/motion/footsteps.h"
#include "bielle/motion/motion.h"
#include "math/so3.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

constexpr int kLargestGrid = 200000;  // cells
constexpr double kBeyond = 1e-6;      // a side of a box is free if the ground is lower this far beyond it, m
constexpr double kInside =
    1e-4;  // what rests on the side of a box lies so far inside it, more than a sole slips in a step, m
constexpr double kRounding = 1e-9;  // of a point on a top, m

// What of a convex polygon lies on a rectangle, by Sutherland and Hodgman ("Reentrant polygon clipping", 1974).
class Clipped {
 public:
  explicit Clipped(const Terrain::Corners& corners) : count_(corners.size()) {
    std::copy(corners.begin(), corners.end(), points_.begin());
  }
  void clip(const Eigen::Vector2d& axis, double most) {
    std::array<Eigen::Vector2d, 8> out;
    size_t count = 0;
    for (size_t i = 0; i < count_; ++i) {
      const Eigen::Vector2d &a = points_[i], &b = points_[(i + 1) % count_];
      const double over_a = axis.dot(a) - most, over_b = axis.dot(b) - most;
      if (over_a <= 0) out[count++] = a;
      if ((over_a <= 0) != (over_b <= 0)) out[count++] = a + over_a / (over_a - over_b) * (b - a);
    }
    points_ = out;
    count_ = count;
  }
  size_t size() const { return count_; }
  const Eigen::Vector2d& operator[](size_t i) const { return points_[i]; }
  Eigen::Vector2d findNearest(const Eigen::Vector2d& point) const {
    Eigen::Vector2d best = points_[0];
    for (size_t i = 0; i < count_; ++i) {
      const Eigen::Vector2d &a = points_[i], side = points_[(i + 1) % count_] - a;
      const double square = side.squaredNorm();
      const double share = square > 0 ? std::clamp(side.dot(point - a) / square, 0.0, 1.0) : 0;
      const Eigen::Vector2d near = a + share * side;
      if ((near - point).squaredNorm() < (best - point).squaredNorm()) best = near;
    }
    return best;
  }

 private:
  std::array<Eigen::Vector2d, 8> points_;
  size_t count_;
};

void require(bool ok, const char* what, const char* remedy) {
  if (!ok) throw InputError("terrain", what, "it is out of range", remedy);
}

}  // namespace

bool Terrain::Top::covers(double px, double py, double margin) const {
  const double dx = px - x, dy = py - y;
  return std::abs(cos * dx + sin * dy) <= half_length - margin && std::abs(cos * dy - sin * dx) <= half_width - margin;
}

Terrain::Terrain(const Ground& ground) : ground_(ground) {
  for (const GroundStep& step : ground.steps) {
    Top top;
    top.cos = std::cos(step.yaw);
    top.sin = std::sin(step.yaw);
    top.x = step.top.x();
    top.y = step.top.y();
    top.half_length = step.length / 2;
    top.half_width = step.width / 2;
    const double along = -std::tan(step.pitch), across = std::tan(step.roll) / std::cos(step.pitch);
    top.slope = {along * top.cos - across * top.sin, along * top.sin + across * top.cos};
    top.height = step.top.z() - top.slope.dot(step.top.head<2>());
    top.normal = Vector3d(-top.slope.x(), -top.slope.y(), 1).normalized();
    tops_.push_back(top);
  }
  fillGrid();
}

void Terrain::fillGrid() {
  if (tops_.empty()) return;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  double edges = 0;
  std::vector<Eigen::Vector2d> halves;  // of the boxes that enclose the tops
  for (const Top& top : tops_) {
    const double c = std::abs(top.cos), s = std::abs(top.sin);
    const Eigen::Vector2d half(c * top.half_length + s * top.half_width, s * top.half_length + c * top.half_width);
    const Eigen::Vector2d middle(top.x, top.y);
    low = low.cwiseMin(middle - half);
    high = high.cwiseMax(middle + half);
    edges += half.sum();
    halves.push_back(half);
  }
  const Eigen::Vector2d size = high - low;
  cell_ = std::max({edges / double(tops_.size()), size.maxCoeff() / 400, 1e-3});
  columns_ = static_cast<int>(size.x() / cell_) + 1;
  rows_ = static_cast<int>(size.y() / cell_) + 1;
  require(columns_ * rows_ <= kLargestGrid, "the boxes of the ground", "give fewer or larger boxes");
  corner_ = low;
  std::vector<std::vector<int>> cells(columns_ * rows_);
  const auto clampTo = [](double at, int count) { return std::clamp(static_cast<int>(std::floor(at)), 0, count - 1); };
  for (size_t i = 0; i < tops_.size(); ++i) {
    const Eigen::Vector2d middle(tops_[i].x, tops_[i].y);
    const Eigen::Vector2d from = (middle - halves[i] - low) / cell_, to = (middle + halves[i] - low) / cell_;
    // One cell of margin spares the lookup any thought about rounding at the edges.
    for (int row = clampTo(from.y() - 1, rows_); row <= clampTo(to.y() + 1, rows_); ++row)
      for (int column = clampTo(from.x() - 1, columns_); column <= clampTo(to.x() + 1, columns_); ++column)
        cells[row * columns_ + column].push_back(static_cast<int>(i));
  }
  starts_.push_back(0);
  for (const std::vector<int>& cell : cells) {
    entries_.insert(entries_.end(), cell.begin(), cell.end());
    starts_.push_back(static_cast<int>(entries_.size()));
  }
}

int Terrain::findColumn(double x) const {
  return std::clamp(static_cast<int>(std::floor((x - corner_.x()) / cell_)), 0, columns_ - 1);
}

int Terrain::findRow(double y) const {
  return std::clamp(static_cast<int>(std::floor((y - corner_.y()) / cell_)), 0, rows_ - 1);
}

const Terrain::Top* Terrain::findTop(double x, double y) const {
  const double column = (x - corner_.x()) / cell_, row = (y - corner_.y()) / cell_;
  if (tops_.empty() || !(column > -1 && row > -1 && column < columns_ + 1 && row < rows_ + 1)) return nullptr;
  const int cell = findRow(y) * columns_ + findColumn(x);
  const Top* highest = nullptr;
  double height = ground_.height;
  for (int k = starts_[cell]; k < starts_[cell + 1]; ++k) {
    const Top& top = tops_[entries_[k]];
    if (!top.covers(x, y) || top.calcHeight(x, y) <= height) continue;
    height = top.calcHeight(x, y);
    highest = &top;
  }
  return highest;
}

Terrain::Surface Terrain::find(double x, double y) const {
  const Top* top = findTop(x, y);
  return top ? Surface{top->calcHeight(x, y), top->normal} : Surface{ground_.height, Vector3d::UnitZ()};
}

Terrain::Touch Terrain::touch(const Vector3d& point) const {
  const Top* top = findTop(point.x(), point.y());
  if (!top) return {ground_.height - point.z(), Vector3d::UnitZ()};
  Touch touch = touchTop(*top, point);
  const Eigen::Vector2d at = point.head<2>() - Eigen::Vector2d(top->x, top->y);
  const Eigen::Vector2d axes[] = {{top->cos, top->sin}, {-top->sin, top->cos}};
  const double halves[] = {top->half_length, top->half_width};
  for (int axis = 0; axis < 2; ++axis) {
    const double along = axes[axis].dot(at), sign = along < 0 ? -1 : 1, depth = halves[axis] - sign * along;
    if (depth >= touch.depth) continue;
    const Eigen::Vector2d out = sign * axes[axis], beyond = point.head<2>() + (depth + kBeyond) * out;
    if (find(beyond.x(), beyond.y()).height < point.z()) touch = {depth, {out.x(), out.y(), 0}};
  }
  return touch;
}

Terrain::Touch Terrain::touch(const Vector3d& point, const Vector3d& from) const {
  const Top* top = findTop(point.x(), point.y());
  return top && top->calcHeight(from.x(), from.y()) <= from.z() + kRounding ? touchTop(*top, point) : touch(point);
}

template <typename Top>
static Clipped clip(const Top& top, const Terrain::Corners& corners) {
  const Eigen::Vector2d centre(top.x, top.y), axes[] = {{top.cos, top.sin}, {-top.sin, top.cos}};
  const double halves[] = {top.half_length - kInside, top.half_width - kInside};
  Clipped part(corners);
  for (int axis = 0; axis < 2; ++axis)
    for (const double sign : {1.0, -1.0}) part.clip(sign * axes[axis], halves[axis] + sign * axes[axis].dot(centre));
  return part;
}

void Terrain::findSupports(const Corners& corners, const Vector3d& plane, double over, double under,
                           std::vector<Place>& places) const {
  Eigen::Vector2d low = corners[0], high = corners[0];
  for (const Eigen::Vector2d& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const auto calcHeight = [&](const Eigen::Vector2d& at) { return plane[0] + plane.tail<2>().dot(at); };
  for (Place& place : places) {
    place.support = place.home;
    place.top = nullptr;
    place.distance = calcHeight(place.home) - ground_.height > over ? std::numeric_limits<double>::infinity() : 0;
  }
  const auto visit = [&](const auto& take) {
    if (tops_.empty()) return;
    for (int row = findRow(low.y()); row <= findRow(high.y()); ++row)
      for (int column = findColumn(low.x()); column <= findColumn(high.x()); ++column)
        for (int k = starts_[row * columns_ + column]; k < starts_[row * columns_ + column + 1]; ++k)
          take(tops_[entries_[k]]);
  };
  const auto bears = [&](const Top& top, const Eigen::Vector2d& at) {
    const double gap = calcHeight(at) - top.calcHeight(at.x(), at.y());
    return gap <= over && gap >= -under && findTop(at.x(), at.y()) == &top;
  };
  visit([&](const Top& top) {
    for (Place& place : places)
      if (top.covers(place.home.x(), place.home.y(), kInside) &&
          calcHeight(place.home) - top.calcHeight(place.home.x(), place.home.y()) <= over)
        place.distance = 0;
  });
  const auto isOff = [](const Place& place) { return place.distance > 0; };
  if (std::none_of(places.begin(), places.end(), isOff)) return;
  visit([&](const Top& top) {
    const Clipped part = clip(top, corners);
    if (part.size() == 0) return;
    for (Place& place : places) {
      if (!isOff(place) || top.covers(place.home.x(), place.home.y(), kInside)) continue;
      const Eigen::Vector2d near = part.findNearest(place.home);
      const double distance = (near - place.home).squaredNorm();
      if (distance >= place.distance || !bears(top, near)) continue;
      place.support = near;
      place.top = &top;
      place.distance = distance;
    }
  });
  // A top that lies in several cells is visited again: corners that have a place are left.
  visit([&](const Top& top) {
    const auto isFree = [&](const Place& place) { return place.top == &top; };
    if (std::none_of(places.begin(), places.end(), isFree)) return;
    const Clipped part = clip(top, corners);
    for (size_t i = 0; i < part.size(); ++i) {
      const auto isHere = [&](const Eigen::Vector2d& at) { return (at - part[i]).squaredNorm() < kInside * kInside; };
      const auto isTaken = [&](const Place& place) { return isHere(place.support); };
      if (std::any_of(corners.begin(), corners.end(), isHere) || std::any_of(places.begin(), places.end(), isTaken) ||
          !bears(top, part[i]))
        continue;
      Place* nearest = nullptr;
      for (Place& place : places)
        if (isFree(place) &&
            (!nearest || (place.home - part[i]).squaredNorm() < (nearest->home - part[i]).squaredNorm()))
          nearest = &place;
      if (!nearest) return;
      nearest->support = part[i];
      nearest->top = nullptr;
    }
  });
}

namespace {

// In the order of a path around it; one of a point.
std::vector<Vector3d> listCorners(const ContactFrame& sole, const SE3& X_WF) {
  std::vector<Vector3d> corners;
  for (const auto& [x, y] : {std::pair(1, 1), {-1, 1}, {-1, -1}, {1, -1}})
    corners.push_back(X_WF.act(Vector3d(x * sole.half_length, y * sole.half_width, 0)));
  return corners;
}

double dropRounding(double x) { return std::abs(x) < 1e-9 ? 0 : x; }

}  // namespace

StandingPlace findPlace(const Model& model, const std::vector<ContactTarget>& soles) {
  StandingPlace place;
  if (soles.empty()) return place;
  Vector3d middle = Vector3d::Zero(), across = Vector3d::Zero();
  for (const ContactTarget& sole : soles) {
    middle += sole.X_WT.p / static_cast<double>(soles.size());
    across += sole.X_WT.R.col(1);  // level while legs bend
  }
  const bool is_level = across.head<2>().norm() > 0.5 * across.norm();
  const double heading = is_level ? dropRounding(std::atan2(-across.x(), across.y())) : 0;
  middle.z() = makeGroundUnder(model, soles).height;
  place.X_WP = {makeAxisRotation(Vector3d::UnitZ(), heading), middle.unaryExpr(&dropRounding)};
  for (const ContactTarget& sole : soles)
    for (const Vector3d& corner : listCorners(model.contacts()[sole.contact], sole.X_WT))
      place.reach = std::max(place.reach, (place.X_WP.inverse().act(corner)).x());
  return place;
}

Ground carryGround(Ground ground, const SE3& X_WP) {
  ground.height += X_WP.p.z();
  for (GroundStep& step : ground.steps) {
    step.top = X_WP.act(step.top);
    step.yaw += calcHeading(X_WP);
  }
  return ground;
}

std::vector<std::string> describeSoles(const Model& model, const Ground& ground,
                                       const std::vector<ContactTarget>& soles) {
  constexpr double kTold = 1e-3;  // m
  std::vector<std::string> told;
  for (const ContactTarget& sole : soles) {
    const ContactFrame& frame = model.contacts()[sole.contact];
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vector3d& corner : listCorners(frame, sole.X_WT))
      lowest = std::min(lowest, corner.z() - ground.calcHeight(corner.x(), corner.y()));
    if (std::abs(lowest) > kTold)
      told.push_back("'" + frame.name + "' starts " + formatNumber(std::abs(lowest)) + " m " +
                     (lowest > 0 ? "over the ground" : "in the ground"));
  }
  return told;
}

bool reachesBoxes(const Model& model, const Ground& ground, const std::vector<ContactTarget>& soles, const SE3& X_WP,
                  double start) {
  const auto isOnBox = [&](const Vector3d& p) {
    return (X_WP.inverse().act(p)).x() > start &&
           std::any_of(ground.steps.begin(), ground.steps.end(),
                       [&](const GroundStep& box) { return box.covers(p.x(), p.y()); });
  };
  return std::any_of(soles.begin(), soles.end(), [&](const ContactTarget& sole) {
    const std::vector<Vector3d> corners = listCorners(model.contacts()[sole.contact], sole.X_WT);
    return std::any_of(corners.begin(), corners.end(), isOnBox);
  });
}

Ground makeRamp(const RampOptions& o) {
  require(std::isfinite(o.slope) && std::abs(o.slope) < 1, "slope", "give height over length, e.g. 0.05");
  require(std::isfinite(o.start), "start", "give metres, e.g. 0.3");
  require(o.length > 0 && o.length <= 1000, "length", "give metres, e.g. 20");
  require(o.width > 0 && o.width <= 1000, "width", "give metres, e.g. 4");
  Ground ground;
  // Down: the robot starts on a level box at height 0, from whose edge the ramp goes down to the plane.
  const double rise = o.slope * o.length;
  ground.height = std::min(0.0, rise);
  if (rise < 0) ground.steps.push_back({{o.start - o.length / 2, 0, 0}, o.length, o.width, 0, 0, 0});
  ground.steps.push_back({{o.start + o.length / 2, 0, rise / 2}, o.length, o.width, 0, -std::atan(o.slope), 0});
  return ground;
}

Ground makeTiles(const TileOptions& o) {
  require(o.height >= 0 && o.height <= 1, "height", "give metres, e.g. 0.01");
  require(o.lowest <= 0 && o.lowest >= -1, "lowest", "give metres, e.g. -0.01");
  require(std::isfinite(o.start), "start", "give metres, e.g. 0.2");
  require(o.size > 0, "size", "give metres, e.g. 0.25");
  require(o.length > 0 && o.width > 0 && o.length / o.size * o.width / o.size <= kLargestGrid / 20, "length",
          "give a smaller field or larger tiles");
  const int columns = static_cast<int>(std::ceil(o.length / o.size)),
            rows = static_cast<int>(std::ceil(o.width / o.size));
  std::mt19937 generator(o.seed);
  Ground ground;
  ground.height = o.lowest;
  if (o.lowest < 0) ground.steps.push_back({{o.start - o.length / 2, 0, 0}, o.length, o.width, 0, 0, 0});
  for (int column = 0; column < columns; ++column)
    for (int row = 0; row < rows; ++row) {
      // The generator is the same everywhere; the standard's distributions are not.
      const double height = o.lowest + (o.height - o.lowest) * (generator() / 4294967295.0);
      ground.steps.push_back(
          {{o.start + (column + 0.5) * o.size, (row + 0.5 - 0.5 * rows) * o.size, height}, o.size, o.size, 0, 0, 0});
    }
  return ground;
}

}  // namespace bielle::worlds
