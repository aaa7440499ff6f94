#include "worlds/terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "bielle/model/error.h"

namespace bielle::worlds {
namespace {

constexpr int kLargestGrid = 200000;  // cells
constexpr double kBeyond = 1e-6;      // a side of a box is free if the ground is lower this far beyond it, m

void require(bool ok, const char* what, const char* remedy) {
  if (!ok) throw InputError("terrain", what, "it is out of range", remedy);
}

}  // namespace

bool Terrain::Top::covers(double px, double py) const {
  const double dx = px - x, dy = py - y;
  return std::abs(cos * dx + sin * dy) <= half_length && std::abs(cos * dy - sin * dx) <= half_width;
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

const Terrain::Top* Terrain::findTop(double x, double y) const {
  const double column = (x - corner_.x()) / cell_, row = (y - corner_.y()) / cell_;
  if (tops_.empty() || !(column > -1 && row > -1 && column < columns_ + 1 && row < rows_ + 1)) return nullptr;
  const int cell = std::clamp(static_cast<int>(std::floor(row)), 0, rows_ - 1) * columns_ +
                   std::clamp(static_cast<int>(std::floor(column)), 0, columns_ - 1);
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
  Touch touch{(top->calcHeight(point.x(), point.y()) - point.z()) * top->normal.z(), top->normal};
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
