#pragma once
/// \file The ground of a world: quick heights and normals, and what of a sole it bears.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bielle/dynamics/ground.h"

namespace bielle::worlds {

/// Height and normal of a Ground. Its boxes are found by a grid of square cells, so that the time of a lookup does not
/// depend on their number.
class Terrain {
 public:
  explicit Terrain(const Ground& ground = {});

  struct Surface {
    double height = 0;                    ///< m
    Vector3d normal = Vector3d::UnitZ();  ///< unit, upwards
  };
  /// The surface under (x, y); its height is Ground::calcHeight.
  Surface find(double x, double y) const;

  struct Touch {
    double depth = 0;                     ///< m, negative above the ground
    Vector3d normal = Vector3d::UnitZ();  ///< unit, out of the ground
  };
  /// How deep a point is in the ground, along the shortest way out: through the top of a box, or through one of its sides and
  /// then, where the ground beyond is higher than the point, out of that. In the corner of a step and the side of the next one a
  /// spring of this depth thus pushes like one of each.
  Touch touch(const Vector3d& point) const;
  /// The same for a point that came from another one: out of a top above which it was, however near its sides are.
  Touch touch(const Vector3d& point, const Vector3d& from) const;

  /// A place of a sole, seen from above.
  struct Place {
    Eigen::Vector2d home,
        support;  ///< where it is; the nearest place of the sole that is at the ground, else home; m (world)
    const void* top = nullptr;  ///< whose edge bears it
    double distance = 0;        ///< squared, m^2
    bool is_corner = false;     ///< of the sole: before others, it takes a corner of what lies on the step
    bool takes_corner = false;  ///< set by findSupports(): it lies on such a corner
  };
  using Corners = std::array<Eigen::Vector2d, 4>;
  /// Moves places of a sole that overhang a step onto its edge, to the corners of what lies on the step first. The ground is at a
  /// place where it is at most `over` below it and `under` above it.
  /// \param corners  of the sole, in order, m (world)
  /// \param plane    heights of the sole: z = plane[0] + plane[1] x + plane[2] y
  void findSupports(const Corners& corners, const Vector3d& plane, double over, double under,
                    std::vector<Place>& places) const;
  const Ground& ground() const { return ground_; }

 private:
  // A box seen from above, with the plane of its top: z = height + slope . (x, y).
  struct Top {
    double cos = 1, sin = 0, x = 0, y = 0, half_length = 0, half_width = 0;
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    double height = 0;
    Vector3d normal = Vector3d::UnitZ();
    bool is_highest = false;                                      // of all tops that overlap it, everywhere
    bool covers(double px, double py, double margin = 0) const {  // margin: from its sides
      const double dx = px - x, dy = py - y;
      return std::abs(cos * dx + sin * dy) <= half_length - margin &&
             std::abs(cos * dy - sin * dx) <= half_width - margin;
    }
    double calcHeight(double px, double py) const { return height + slope.x() * px + slope.y() * py; }
  };
  void fillGrid();
  void findHighest(const std::vector<Eigen::Vector2d>& halves);
  template <typename Take>
  void visit(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Take& take) const;
  Touch touchTop(const Top& top, const Vector3d& point) const {
    return {(top.calcHeight(point.x(), point.y()) - point.z()) * top.normal.z(), top.normal};
  }
  int findColumn(double x) const { return findCell((x - corner_.x()) * per_cell_, columns_); }
  int findRow(double y) const { return findCell((y - corner_.y()) * per_cell_, rows_); }
  static int findCell(double at, int count) { return at > 0 ? static_cast<int>(std::min(at, count - 1.0)) : 0; }
  // The highest top under a point, above the plane; null if there is none.
  const Top* findTop(double x, double y) const;

  Ground ground_;
  std::vector<Top> tops_;
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();  // of the grid
  double per_cell_ = 1;                               // over the edge of a cell, 1/m
  int columns_ = 0, rows_ = 0;
  std::vector<double> peaks_;          // highest of the tops of each cell, m
  std::vector<int> starts_, entries_;  // tops that may cover a cell: entries_[starts_[cell] .. starts_[cell + 1])
};

}  // namespace bielle::worlds
