#pragma once
/// \file What the soles of a robot do on the ground, from the forces on their points.
#include "bielle/worlds/world.h"
#include "worlds/contact_law.h"

namespace bielle::worlds {

/// Fills FootReports; one per robot.
class SoleTrack {
 public:
  explicit SoleTrack(const Model& model);

  void reset();
  void clearForces();
  /// Adds a force at x (world) on a contact of the model.
  void addForce(int contact, const Vector3d& x, const Vector3d& force);
  /// Wrenches and slips for the present placements. \param getPlacement  body -> SE3
  template <typename GetPlacement>
  void update(const GetPlacement& getPlacement) {
    for (size_t c = 0; c < reports_.size(); ++c)
      updateFoot(c, getPlacement(model_.contacts()[c].body) * model_.contacts()[c].X_BF);
  }
  const std::vector<FootReport>& reports() const { return reports_; }

 private:
  void updateFoot(size_t contact, const SE3& X_WF);

  Model model_;
  std::vector<FootReport> reports_;
  std::vector<Vector6d> wrenches_;    // about the origin of the world
  std::vector<Vector3d> touchdowns_;  // of the centres of the soles, m (world)
};

}  // namespace bielle::worlds
