#pragma once
/// \file A Ground in MuJoCo: its plane, and as many boxes as can be under the soles at once.
///
/// MuJoCo's steps take longer with every shape of its model, touched or not. The model therefore has a few boxes only,
/// which are moved to those of the ground that are near the soles.
#include <mujoco/mujoco.h>

#include <vector>

#include "bielle/dynamics/ground.h"
#include "bielle/model/model.h"
#include "formats/mjcf.h"

namespace bielle::worlds {

class MujocoGround {
 public:
  explicit MujocoGround(const Model& model, const Ground& ground);

  /// Its plane and boxes.
  void addTo(MjcfOptions& robot) const;
  /// Finds them in the compiled model.
  void bind(const mjModel& mj);
  /// Moves boxes under the soles as they stand in `data`. To be called whenever these may have moved by kReach.
  /// \returns false if there are too many boxes under the soles
  bool update(mjModel& mj, const mjData& data);
  /// Tilts the boxes that are shown by 1e-9 rad, to the other side at every call. To be called before every step: MuJoCo
  /// 2.2.2 takes the normal of two boxes whose edges are parallel to within 1e-13 rad from rounding, and throws the one off
  /// the other.
  void tilt(mjModel& mj);
  void startTilts() { is_back_ = false; }  ///< so that what is simulated again is the same to the last bit

  static constexpr double kReach = 0.02;  ///< m

 private:
  struct Box {
    GroundStep step;
    Vector3d centre, half_size;
    Eigen::Quaterniond attitude;
  };
  struct Sole {
    int site;      // at its centre
    double reach;  // of the sole from there, m
  };
  void show(mjModel& mj, int geom, const Box& box) const;

  Model model_;
  bool is_back_ = false;  // the side of the next tilt
  double height_;
  std::vector<Box> boxes_;
  std::vector<int> geoms_;         // of the boxes that MuJoCo has
  std::vector<const Box*> shown_;  // as the first of these
  std::vector<Sole> soles_;
};

}  // namespace bielle::worlds
