#include "formats/mesh_shells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>
#include <vector>

namespace bielle {
namespace {

using Corners = Eigen::Matrix3Xd;

struct Shell {
  std::vector<Eigen::Index> triangles;  // columns of their first corners
  double volume = 0;                    // negative if it is seen from inside
  Vector3d low, high;                   // of the box around it
};

// Corners at the same place have the same number.
std::vector<std::uint64_t> numberCorners(const Corners& corners) {
  std::vector<Eigen::Index> order(static_cast<size_t>(corners.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto isBefore = [&](Eigen::Index i, Eigen::Index j) {
    return std::lexicographical_compare(corners.col(i).data(), corners.col(i).data() + 3, corners.col(j).data(),
                                        corners.col(j).data() + 3);
  };
  std::sort(order.begin(), order.end(), isBefore);
  std::vector<std::uint64_t> numbers(order.size());
  for (size_t k = 1; k < order.size(); ++k)
    numbers[static_cast<size_t>(order[k])] =
        numbers[static_cast<size_t>(order[k - 1])] + (isBefore(order[k - 1], order[k]) ? 1 : 0);
  return numbers;
}

size_t findRoot(std::vector<size_t>& parents, size_t i) {
  while (parents[i] != i) i = parents[i] = parents[parents[i]];
  return i;
}

// Triangles belong together where one goes along an edge and the other back. Of more than two, those that follow each other in the
// file: shells that touch are one behind the other there.
std::vector<Shell> findShells(const Corners& corners) {
  const std::vector<std::uint64_t> numbers = numberCorners(corners);
  const size_t count = numbers.size() / 3;
  std::vector<size_t> parents(count);
  std::iota(parents.begin(), parents.end(), 0);
  std::unordered_map<std::uint64_t, std::vector<size_t>> open;  // triangles, by the ends of an edge
  const auto getEdge = [&numbers](std::uint64_t from, std::uint64_t to) { return from * (numbers.size() + 1) + to; };
  for (size_t t = 0; t < count; ++t)
    for (size_t k = 0; k < 3; ++k) {
      const std::uint64_t from = numbers[3 * t + k], to = numbers[3 * t + (k + 1) % 3];
      if (from == to) continue;  // of a triangle without an area
      const auto back = open.find(getEdge(to, from));
      if (back == open.end() || back->second.empty()) {
        open[getEdge(from, to)].push_back(t);
        continue;
      }
      parents[findRoot(parents, t)] = findRoot(parents, back->second.back());
      back->second.pop_back();
    }
  std::vector<bool> is_open(count);
  for (const auto& [edge, triangles] : open)
    for (const size_t t : triangles) is_open[findRoot(parents, t)] = true;
  std::unordered_map<size_t, size_t> index;
  std::vector<Shell> shells;
  for (size_t t = 0; t < count; ++t) {
    const size_t root = findRoot(parents, t);
    if (is_open[root]) continue;
    const auto [found, is_new] = index.emplace(root, shells.size());
    if (is_new) shells.emplace_back();
    shells[found->second].triangles.push_back(static_cast<Eigen::Index>(3 * t));
  }
  for (Shell& shell : shells) {
    const Vector3d origin = corners.col(shell.triangles[0]);
    shell.low = shell.high = origin;
    for (const Eigen::Index i : shell.triangles) {
      const Eigen::Matrix3d t = corners.middleCols<3>(i);
      shell.volume += (t.colwise() - origin).determinant() / 6;
      shell.low = shell.low.cwiseMin(t.rowwise().minCoeff());
      shell.high = shell.high.cwiseMax(t.rowwise().maxCoeff());
    }
  }
  return shells;
}

// Whether a shell goes once around a point: by the angles at which its triangles are seen there (van Oosterom and Strackee, "The
// solid angle of a plane triangle", 1983).
bool goesAround(const Shell& shell, const Corners& corners, const Vector3d& point) {
  double angle = 0;
  for (const Eigen::Index i : shell.triangles) {
    const Eigen::Matrix3d t = corners.middleCols<3>(i).colwise() - point;
    const Vector3d r = t.colwise().norm();
    angle += 2 * std::atan2(t.determinant(), r.prod() + t.col(0).dot(t.col(1)) * r[2] + t.col(1).dot(t.col(2)) * r[0] +
                                                 t.col(2).dot(t.col(0)) * r[1]);
  }
  return std::abs(angle) > 2 * EIGEN_PI;  // 4 pi inside, 0 outside
}

bool isInside(const Shell& inner, const Shell& outer, const Corners& corners) {
  if (&inner == &outer || !(std::abs(inner.volume) < std::abs(outer.volume))) return false;
  if ((inner.low.array() < outer.low.array()).any() || (inner.high.array() > outer.high.array()).any()) return false;
  return goesAround(outer, corners, corners.middleCols<3>(inner.triangles[0]).rowwise().mean());
}

}  // namespace

Eigen::Matrix3Xd turnShellsOutwards(Corners corners) {
  const std::vector<Shell> shells = findShells(corners);
  const auto isInward = [](const Shell& shell) { return shell.volume < 0; };
  if (std::none_of(shells.begin(), shells.end(), isInward)) return corners;
  std::vector<Eigen::Index> turned;
  for (const Shell& shell : shells) {
    const Shell* outermost = &shell;
    for (const Shell& other : shells)
      if (std::abs(other.volume) > std::abs(outermost->volume) && isInside(shell, other, corners)) outermost = &other;
    if (isInward(*outermost)) turned.insert(turned.end(), shell.triangles.begin(), shell.triangles.end());
  }
  for (const Eigen::Index i : turned) corners.col(i).swap(corners.col(i + 1));
  return corners;
}

}  // namespace bielle
