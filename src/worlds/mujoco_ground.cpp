#include "worlds/mujoco_ground.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "dynamics/ground_step.h"

namespace bielle::worlds {
namespace {

constexpr size_t kMostBoxes = 32;  // of MuJoCo at once
constexpr double kDepth = 1;       // boxes reach this far below their tops, m
// Boxes are narrower than their steps by this, m: MuJoCo 2.2.2 tilts a box whose side is flush with that of the box under it to
// less than 1e-6 m and 1e-5 rad, which happens where both have round numbers.
constexpr double kInset = 1e-4;
constexpr double kTilt = 1e-9;  // rad

}  // namespace

MujocoGround::MujocoGround(const Model& model, const Ground& ground) : model_(model), height_(ground.height) {
  for (const GroundStep& step : ground.steps) {
    Box box{step, {}, {}, {}};
    box.attitude = calcRotation(step);
    box.centre = step.top - box.attitude * Vector3d(0, 0, kDepth / 2);
    box.half_size << (calcTopSize(step).array() / 2 - kInset).max(kInset), kDepth / 2;
    boxes_.push_back(box);
  }
}

void MujocoGround::addTo(MjcfOptions& robot) const {
  robot.ground_height = height_;
  robot.num_boxes = static_cast<int>(std::min(boxes_.size(), kMostBoxes));
}

void MujocoGround::bind(const mjModel& mj) {
  for (size_t i = 1; i <= std::min(boxes_.size(), kMostBoxes); ++i)
    if (const int geom = mj_name2id(&mj, mjOBJ_GEOM, ("box." + std::to_string(i)).c_str()); geom >= 0)
      geoms_.push_back(geom);
  for (const ContactFrame& contact : model_.contacts())
    soles_.push_back(
        {mj_name2id(&mj, mjOBJ_SITE, contact.name.c_str()), std::hypot(contact.half_length, contact.half_width)});
  shown_.reserve(geoms_.size());
}

bool MujocoGround::update(mjModel& mj, const mjData& data) {
  shown_.clear();
  for (const Box& box : boxes_) {
    const bool is_near = std::any_of(soles_.begin(), soles_.end(), [&](const Sole& sole) {
      const mjtNum* centre = data.site_xpos + 3 * sole.site;
      return box.step.calcDistance(centre[0], centre[1]) < sole.reach + kReach;
    });
    if (!is_near) continue;
    if (shown_.size() == geoms_.size()) return false;
    show(mj, geoms_[shown_.size()], box);
    shown_.push_back(&box);
  }
  for (size_t i = shown_.size(); i < geoms_.size(); ++i) mj.geom_conaffinity[geoms_[i]] = 0;
  return true;
}

void MujocoGround::tilt(mjModel& mj) {
  const double half = std::exchange(is_back_, !is_back_) ? -kTilt / 2 : kTilt / 2;
  for (size_t i = 0; i < shown_.size(); ++i) {
    const Eigen::Quaterniond q = shown_[i]->attitude * Eigen::Quaterniond(1, half, half, 0);
    Eigen::Map<Eigen::Vector4d>(mj.geom_quat + 4 * geoms_[i]) << q.w(), q.x(), q.y(), q.z();
  }
}

void MujocoGround::show(mjModel& mj, int geom, const Box& box) const {
  Eigen::Map<Vector3d>(mj.geom_pos + 3 * geom) = box.centre;
  Eigen::Map<Vector3d>(mj.geom_size + 3 * geom) = box.half_size;
  mj.geom_sameframe[geom] = 0;  // it was compiled at the origin, whose frame MuJoCo would take
  mj.geom_rbound[geom] = box.half_size.norm();
  mj.geom_conaffinity[geom] = 1;
}

}  // namespace bielle::worlds
