#include "results/motion_strip.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/ground_step.h"
#include "model/number_text.h"
#include "results/drawing.h"
#include "results/skeleton.h"

namespace bielle {
namespace {

constexpr double kHeight = 1000;                      // of a picture, units of the drawing
constexpr double kMargin = 0.06;                      // around the robot, over its height
constexpr double kFloorPitch = 0.2, kFloorReach = 3;  // m; lines per direction to each side
constexpr double kStepReach = 1.5;                    // m, of steps that are drawn

// Rows: the right and the upward direction of the picture in the world.
Eigen::Matrix<double, 2, 3> makeView() {
  const Vector3d to_eye = Vector3d(0.5, -1, 0.35).normalized(), right = Vector3d::UnitZ().cross(to_eye).normalized();
  Eigen::Matrix<double, 2, 3> view;
  view << right.transpose(), to_eye.cross(right).transpose();
  return view;
}

struct Picture {
  double time = 0;
  Point2 com = Point2::Zero();
  std::vector<Polyline> front, behind, soles, steps, floor;
};

class StripWriter {
 public:
  StripWriter(const Model& model, const MotionRecord& record, const Ground& ground, int pictures)
      : model_(model), record_(record), ground_(ground), ws_(model), view_(makeView()) {
    for (const Visual& visual : listSkeleton(model, std::vector<bool>(model.numBodies(), false)))
      if (visual.shape == Visual::Shape::Cylinder) rods_.push_back(visual);
    const double start = record.time[0], end = record.time[record.time.size() - 1];
    for (int i = 0; i < pictures; ++i) addPicture(start + (end - start) * i / std::max(1, pictures - 1));
    measure();
  }

  std::string write() const {
    Drawing drawing(0);
    for (size_t i = 0; i < pictures_.size(); ++i) draw(pictures_[i], static_cast<double>(i) * size_.x(), drawing);
    return drawing.write({size_.x() * static_cast<double>(pictures_.size()), size_.y()});
  }

 private:
  void addPicture(double time) {
    Eigen::Index k;
    (record_.time.array() - time).abs().minCoeff(&k);
    updatePlacements(model_, ws_, record_.q.row(k).transpose());
    const Vector3d com = record_.com.row(k).transpose();
    focus_ = Vector3d(com.x(), com.y(), ground_.height);
    Picture picture;
    picture.time = record_.time[k];
    picture.com = look(com);
    const Vector3d to_eye = view_.row(0).cross(view_.row(1)).transpose();
    for (const Visual& rod : rods_) {
      const SE3 X = ws_.X_WB[rod.body] * rod.X_BV;
      const Vector3d half = rod.size[1] / 2 * X.R.col(2);
      (to_eye.dot(X.p - com) < 0 ? picture.behind : picture.front).push_back({look(X.p - half), look(X.p + half)});
    }
    for (const ContactFrame& contact : model_.contacts()) {
      const SE3 X = ws_.X_WB[contact.body] * contact.X_BF;
      Eigen::Matrix<double, 3, 2> half_edges;
      half_edges << contact.half_length * X.R.col(0), contact.half_width * X.R.col(1);
      picture.soles.push_back(makeParallelogram(X.p, half_edges));
    }
    for (const GroundStep& step : ground_.steps)
      if (step.calcDistance(com.x(), com.y()) < kStepReach)
        picture.steps.push_back(makeParallelogram(step.top, calcHalfEdges(step)));
    addFloor(picture);
    pictures_.push_back(std::move(picture));
  }

  // Lines that stay where they are while the eye goes along.
  void addFloor(Picture& picture) const {
    const Eigen::Vector2d middle = (focus_.head<2>() / kFloorPitch).array().round();
    const auto at = [&](double i, double j) {
      return look({kFloorPitch * (middle.x() + i), kFloorPitch * (middle.y() + j), ground_.height});
    };
    for (double i = -kFloorReach; i <= kFloorReach; ++i) {
      picture.floor.push_back({at(i, -kFloorReach), at(i, kFloorReach)});
      picture.floor.push_back({at(-kFloorReach, i), at(kFloorReach, i)});
    }
  }

  Point2 look(const Vector3d& p) const { return view_ * (p - focus_); }

  Polyline makeParallelogram(const Vector3d& centre, const Eigen::Matrix<double, 3, 2>& half_edges) const {
    Polyline corners;
    for (const auto& [x, y] : {std::pair(1, 1), {-1, 1}, {-1, -1}, {1, -1}})
      corners.push_back(look(centre + half_edges * Eigen::Vector2d(x, y)));
    return corners;
  }

  // What all pictures have to hold.
  void measure() {
    Eigen::AlignedBox2d box(pictures_.front().com);
    for (const Picture& picture : pictures_)
      for (const std::vector<Polyline>* lines : {&picture.front, &picture.behind, &picture.soles})
        for (const Polyline& line : *lines)
          for (const Point2& p : line) box.extend(p);
    const double margin = kMargin * std::max(1e-3, box.sizes().y());
    box.extend(box.min() - Point2(margin, margin));
    box.extend(box.max() + Point2(margin, 2.5 * margin));  // a line of text on top
    const double scale = kHeight / box.sizes().y();
    size_ = {std::round(scale * box.sizes().x()), kHeight};
    metres_ = {{scale, -scale}, {-scale * box.min().x(), scale * box.max().y()}};
  }

  void draw(const Picture& picture, double left, Drawing& drawing) const {
    drawing.openWindow(left, size_);
    drawing.projection = metres_;
    drawing.addLines(picture.floor, {"#ced5de", 4});
    drawing.addLines(picture.steps, {"#8d99a8", 4, "#cfd6df"}, true);
    drawing.addLines(picture.behind, {"#b3bcc8", 14});
    drawing.addLines(picture.soles, {"#1f5fbf", 8, "#1f5fbf"}, true);
    drawing.addLines(picture.front, {"#3a4554", 14});
    drawing.addDisc(picture.com, 18, {"none", 0, "#e8590c"});
    drawing.projection = {};
    drawing.addText({12, 70}, formatNumber(picture.time, "%.2f") + " s", {70, "#66707f"});
  }

  const Model& model_;
  const MotionRecord& record_;
  const Ground& ground_;
  Workspace ws_;
  Eigen::Matrix<double, 2, 3> view_;
  std::vector<Visual> rods_;
  Vector3d focus_ = Vector3d::Zero();  // on the ground
  std::vector<Picture> pictures_;
  Projection metres_;
  Point2 size_ = Point2::Zero();  // of a picture
};

}  // namespace

std::string drawMotionStrip(const Model& model, const MotionRecord& record, const Ground& ground, int pictures) {
  return StripWriter(model, record, ground, pictures).write();
}

}  // namespace bielle
