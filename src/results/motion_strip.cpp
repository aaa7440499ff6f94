#include "results/motion_strip.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/ground_step.h"
#include "model/number_text.h"
#include "results/skeleton.h"

namespace bielle {
namespace {

using Point = Eigen::Vector2d;
using Line = std::vector<Point>;

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
  Point com = Point::Zero();
  std::vector<Line> front, behind, soles, steps, floor;
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

  std::string write() {
    std::string body;
    for (size_t i = 0; i < pictures_.size(); ++i) body += writePicture(pictures_[i], static_cast<double>(i) * width_);
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " +
           format(width_ * static_cast<double>(pictures_.size())) + " " + format(kHeight) +
           "\" fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">" + body + "</svg>";
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

  Point look(const Vector3d& p) const { return view_ * (p - focus_); }

  Line makeParallelogram(const Vector3d& centre, const Eigen::Matrix<double, 3, 2>& half_edges) const {
    Line corners;
    for (const auto& [x, y] : {std::pair(1, 1), {-1, 1}, {-1, -1}, {1, -1}, {1, 1}})
      corners.push_back(look(centre + half_edges * Eigen::Vector2d(x, y)));
    return corners;
  }

  // What all pictures have to hold.
  void measure() {
    Eigen::AlignedBox2d box(pictures_.front().com);
    for (const Picture& picture : pictures_)
      for (const std::vector<Line>* lines : {&picture.front, &picture.behind, &picture.soles})
        for (const Line& line : *lines)
          for (const Point& p : line) box.extend(p);
    const double margin = kMargin * std::max(1e-3, box.sizes().y());
    low_ = box.min() - Point(margin, margin), high_ = box.max() + Point(margin, 2.5 * margin);  // a line of text on top
    scale_ = kHeight / (high_.y() - low_.y());
    width_ = std::round(scale_ * (high_.x() - low_.x()));
  }

  static std::string format(double value) { return formatNumber(std::round(value), "%.0f"); }

  std::string writePath(const std::vector<Line>& lines, const std::string& style) const {
    if (lines.empty()) return "";
    std::string path;
    for (const Line& line : lines) {
      const char* separator = "M";
      for (const Point& p : line) {
        path += separator + format(scale_ * (p.x() - low_.x())) + " " + format(scale_ * (high_.y() - p.y()));
        separator = "L";
      }
    }
    return "<path " + style + " d=\"" + path + "\"/>";
  }

  std::string writePicture(const Picture& picture, double left) const {
    const Point com = scale_ * Point(picture.com.x() - low_.x(), high_.y() - picture.com.y());
    return "<svg x=\"" + format(left) + "\" width=\"" + format(width_) + "\" height=\"" + format(kHeight) + "\">" +
           writePath(picture.floor, "stroke=\"#ced5de\" stroke-width=\"4\"") +
           writePath(picture.steps, "fill=\"#cfd6df\" stroke=\"#8d99a8\" stroke-width=\"4\"") +
           writePath(picture.behind, "stroke=\"#b3bcc8\" stroke-width=\"14\"") +
           writePath(picture.soles, "fill=\"#1f5fbf\" stroke=\"#1f5fbf\" stroke-width=\"8\"") +
           writePath(picture.front, "stroke=\"#3a4554\" stroke-width=\"14\"") + "<circle cx=\"" + format(com.x()) +
           "\" cy=\"" + format(com.y()) + "\" r=\"18\" fill=\"#e8590c\"/><text x=\"12\" y=\"70\" font-size=\"70\" " +
           "font-family=\"sans-serif\" fill=\"#66707f\">" + formatNumber(picture.time, "%.2f") + " s</text></svg>";
  }

  const Model& model_;
  const MotionRecord& record_;
  const Ground& ground_;
  Workspace ws_;
  Eigen::Matrix<double, 2, 3> view_;
  std::vector<Visual> rods_;
  Vector3d focus_ = Vector3d::Zero();  // on the ground
  std::vector<Picture> pictures_;
  Point low_, high_;  // of a picture, m
  double scale_ = 1, width_ = 0;
};

}  // namespace

std::string drawMotionStrip(const Model& model, const MotionRecord& record, const Ground& ground, int pictures) {
  return StripWriter(model, record, ground, pictures).write();
}

}  // namespace bielle
