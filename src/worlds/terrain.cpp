#include "worlds/terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "bielle/model/error.h"

namespace bielle::worlds {
namespace {

constexpr int kLargestGrid = 200000;  // cells
constexpr double kBeyond = 1e-6;      // a side of a box is free if the ground is lower this far beyond it, m
constexpr double kInside =
    1e-4;  // what rests on the side of a box lies so far inside it, more than a sole slips in a step, m
constexpr double kMargin = 1e-6;    // of a cell: sides that lie in it by rounding
constexpr double kRounding = 1e-9;  // of a point on a top, m

// What of a convex polygon lies on a rectangle, by Sutherland and Hodgman ("Reentrant polygon clipping", 1974).
class Clipped {
 public:
  static constexpr size_t kMost = 8;  // corners
  explicit Clipped(const Terrain::Corners& corners) : count_(corners.size()) {
    std::copy(corners.begin(), corners.end(), points_.begin());
  }
  void clip(const Eigen::Vector2d& axis, double most) {
    std::array<Eigen::Vector2d, kMost> out;
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
  std::array<Eigen::Vector2d, kMost> points_;
  size_t count_;
};

}  // namespace

// Lowest and highest place of a top. \param half  of the box around it, seen from above
template <typename Top>
static std::pair<double, double> calcSpan(const Top& top, const Eigen::Vector2d& half) {
  const double middle = top.calcHeight(top.x, top.y), rise = top.slope.cwiseAbs().dot(half);
  return {middle - rise, middle + rise};
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
  const double cell = std::max({edges / double(tops_.size()), size.maxCoeff() / 400, 1e-3});
  columns_ = static_cast<int>(size.x() / cell) + 2;
  rows_ = static_cast<int>(size.y() / cell) + 2;
  per_cell_ = 1 / cell;
  if (columns_ * rows_ > kLargestGrid)
    throw InputError("terrain", "the boxes of the ground", "it is out of range", "give fewer or larger boxes");
  // Sides of tiles lie in the middle of cells, so that few tiles share one.
  corner_ = low - Eigen::Vector2d::Constant(0.5 * cell);
  std::vector<std::vector<int>> cells(columns_ * rows_);
  const auto clampTo = [](double at, int count) { return std::clamp(static_cast<int>(std::floor(at)), 0, count - 1); };
  for (size_t i = 0; i < tops_.size(); ++i) {
    const Eigen::Vector2d middle(tops_[i].x, tops_[i].y);
    const Eigen::Vector2d from = (middle - halves[i] - corner_) / cell, to = (middle + halves[i] - corner_) / cell;
    for (int row = clampTo(from.y() - kMargin, rows_); row <= clampTo(to.y() + kMargin, rows_); ++row)
      for (int column = clampTo(from.x() - kMargin, columns_); column <= clampTo(to.x() + kMargin, columns_); ++column)
        cells[row * columns_ + column].push_back(static_cast<int>(i));
  }
  starts_.push_back(0);
  for (const std::vector<int>& cell : cells) {
    entries_.insert(entries_.end(), cell.begin(), cell.end());
    starts_.push_back(static_cast<int>(entries_.size()));
    peaks_.push_back(ground_.height);
    for (int i : cell) peaks_.back() = std::max(peaks_.back(), calcSpan(tops_[i], halves[i]).second);
  }
  findHighest(halves);
}

void Terrain::findHighest(const std::vector<Eigen::Vector2d>& halves) {
  for (size_t i = 0; i < tops_.size(); ++i) {
    Top& top = tops_[i];
    const Eigen::Vector2d middle(top.x, top.y);
    top.is_highest = true;
    visit(middle - halves[i], middle + halves[i], [&](const Top& other) {
      const size_t j = static_cast<size_t>(&other - tops_.data());
      const Eigen::Vector2d apart = (middle - Eigen::Vector2d(other.x, other.y)).cwiseAbs() - halves[i] - halves[j];
      if (j != i && apart.maxCoeff() < -kInside && calcSpan(other, halves[j]).second > calcSpan(top, halves[i]).first)
        top.is_highest = false;
    });
  }
}

// All tops that may be there, some several times.
template <typename Take>
void Terrain::visit(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Take& take) const {
  if (tops_.empty()) return;
  for (int row = findRow(low.y()); row <= findRow(high.y()); ++row)
    for (int column = findColumn(low.x()); column <= findColumn(high.x()); ++column)
      for (int k = starts_[row * columns_ + column]; k < starts_[row * columns_ + column + 1]; ++k)
        take(tops_[entries_[k]]);
}

const Terrain::Top* Terrain::findTop(double x, double y) const {
  const double column = (x - corner_.x()) * per_cell_, row = (y - corner_.y()) * per_cell_;
  if (tops_.empty() || !(column > -1 && row > -1 && column < columns_ + 1 && row < rows_ + 1)) return nullptr;
  const int cell = findCell(row, rows_) * columns_ + findCell(column, columns_);
  const Top* highest = nullptr;
  double height = ground_.height;
  for (int k = starts_[cell]; k < starts_[cell + 1]; ++k) {
    const Top& top = tops_[entries_[k]];
    if (!top.covers(x, y)) continue;
    const double own = top.calcHeight(x, y);
    if (own <= height) continue;
    height = own;
    highest = &top;
    if (top.is_highest && top.covers(x, y, kInside)) break;
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
    const Surface next = find(beyond.x(), beyond.y());
    const double rest = (next.height - point.z()) * next.normal.z();
    const Vector3d way = depth * Vector3d(out.x(), out.y(), 0) + rest * next.normal;
    if (rest <= 0)
      touch = {depth, {out.x(), out.y(), 0}};
    else if (way.norm() < touch.depth)
      touch = {way.norm(), way.normalized()};
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

// Corners of what lies on a step are taken by the nearest places that are free, those of the sole first; each time the corner that is
// farthest from all that are held.
template <typename Bears>
static void giveCorners(const void* top, const Clipped& part, const Terrain::Corners& corners, const Bears& bears,
                        std::vector<Terrain::Place>& places) {
  using Place = Terrain::Place;
  const auto isFree = [&](const Place& place) { return place.top == top; };
  std::array<Eigen::Vector2d, Clipped::kMost + 1> held, left;  // or the middle of all
  size_t num_held = 0, num_left = 0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (size_t i = 0; i < part.size(); ++i) {
    const auto isHere = [&](const Eigen::Vector2d& at) { return (at - part[i]).squaredNorm() < kInside * kInside; };
    bool is_held = std::any_of(corners.begin(), corners.end(), isHere);
    for (Place& place : places) {
      if (!(place.is_corner || place.takes_corner) || !isHere(place.support))
        continue;  // tops are visited cell by cell
      if (isFree(place) && place.distance > 4 * kInside * kInside) continue;
      place.top = nullptr;
      is_held = true;
    }
    middle += part[i] / double(part.size());
    if (is_held)
      held[num_held++] = part[i];
    else if (bears(part[i]))
      left[num_left++] = part[i];
  }
  if (num_held == 0) held[num_held++] = middle;
  const auto calcRoom = [&](const Eigen::Vector2d& at) {
    double room = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < num_held; ++i) room = std::min(room, (at - held[i]).squaredNorm());
    return room;
  };
  for (; num_left > 0; --num_left) {
    size_t farthest = 0;
    for (size_t i = 1; i < num_left; ++i)
      if (calcRoom(left[i]) > calcRoom(left[farthest])) farthest = i;
    const Eigen::Vector2d corner = left[farthest];
    if (calcRoom(corner) < kInside * kInside) return;
    const auto calcWay = [&](const Place& place) { return (place.home - corner).squaredNorm(); };
    Place* taker = nullptr;
    for (Place& place : places)
      if (isFree(place) && (!taker || place.is_corner > taker->is_corner ||
                            (place.is_corner == taker->is_corner && calcWay(place) < calcWay(*taker))))
        taker = &place;
    if (!taker) return;
    taker->support = corner;
    taker->top = nullptr;
    taker->takes_corner = true;
    left[farthest] = left[num_left - 1];
    held[num_held++] = corner;
  }
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
    place.takes_corner = false;
  }
  // Most soles are in the air, or within the sides of one step.
  double lowest = std::numeric_limits<double>::infinity(), peak = ground_.height;
  for (const Eigen::Vector2d& corner : corners) lowest = std::min(lowest, calcHeight(corner));
  for (int row = findRow(low.y()); row <= findRow(high.y()); ++row)
    for (int column = findColumn(low.x()); column <= findColumn(high.x()); ++column)
      peak = std::max(peak, tops_.empty() ? peak : peaks_[row * columns_ + column]);
  const Top* alone = findTop(corners[0].x(), corners[0].y());
  const auto isInside = [&](const Eigen::Vector2d& corner) { return alone->covers(corner.x(), corner.y(), kInside); };
  if (lowest > peak + over || (alone && alone->is_highest && std::all_of(corners.begin(), corners.end(), isInside)))
    return;
  for (Place& place : places) {
    place.top = nullptr;
    place.distance = calcHeight(place.home) - ground_.height > over ? std::numeric_limits<double>::infinity() : 0;
  }
  const auto bears = [&](const Top& top, const Eigen::Vector2d& at) {
    const double gap = calcHeight(at) - top.calcHeight(at.x(), at.y());
    return gap <= over && gap >= -under && findTop(at.x(), at.y()) == &top;
  };
  visit(low, high, [&](const Top& top) {
    for (Place& place : places) {
      const double gap = calcHeight(place.home) - top.calcHeight(place.home.x(), place.home.y());
      const double margin = gap < -under ? 0 : kInside;  // a side of a higher step pushes as soon as it is touched
      if (gap <= over && top.covers(place.home.x(), place.home.y(), margin)) place.distance = 0;
    }
  });
  const auto isOff = [](const Place& place) { return place.distance > 0; };
  if (std::none_of(places.begin(), places.end(), isOff)) return;
  visit(low, high, [&](const Top& top) {
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
  // A top that lies in several cells is visited again: what has its place is left.
  visit(low, high, [&](const Top& top) {
    const auto isFree = [&](const Place& place) { return place.top == &top; };
    if (std::none_of(places.begin(), places.end(), isFree)) return;
    giveCorners(
        &top, clip(top, corners), corners, [&](const Eigen::Vector2d& at) { return bears(top, at); }, places);
  });
}

}  // namespace bielle::worlds
