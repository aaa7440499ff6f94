#include "results/skeleton.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "formats/fastenings.h"
#include "math/direction.h"

namespace bielle {
namespace {

double calcExtent(const Model& model) {
  Workspace ws(model);
  updatePlacements(model, ws, model.makeNeutral());
  Eigen::AlignedBox3d box;
  for (int i = 1; i < model.numBodies(); ++i) box.extend(ws.X_WB[i].p);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

void addRods(int body, const std::vector<Vector3d>& points, double radius, std::vector<Visual>& visuals) {
  static const Eigen::Vector4d kRod(0.45, 0.53, 0.62, 1), kJoint(0.22, 0.26, 0.32, 1);
  visuals.push_back({Visual::Shape::Sphere, body, SE3::Identity(), {1.6 * radius, 0, 0}, "", kJoint, {}});
  for (const Vector3d& point : points) {
    if (point.norm() < radius) continue;
    visuals.push_back(
        {Visual::Shape::Cylinder, body, {calcRotationOfZ(point), point / 2}, {radius, point.norm(), 0}, "", kRod, {}});
  }
}

}  // namespace

std::vector<Visual> listSkeleton(const Model& model, const std::vector<bool>& is_drawn) {
  std::vector<Visual> visuals;
  const std::vector<std::vector<Vector3d>> fastenings = listFastenings(model);
  const double extent = calcExtent(model), radius = extent > 0 ? 0.012 * extent : 0.01;
  for (int i = 1; i < model.numBodies(); ++i) {
    if (is_drawn[i]) continue;
    std::vector<Vector3d> points = fastenings[i];
    const bool is_end = std::all_of(points.begin(), points.end(), [=](const Vector3d& p) { return p.norm() < radius; });
    if (is_end && model.bodies()[i].inertia.mass > 0) points.push_back(model.bodies()[i].inertia.com);
    addRods(i, points, radius, visuals);
  }
  return visuals;
}

}  // namespace bielle
