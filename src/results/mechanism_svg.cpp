#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "model/number_text.h"
#include "results/drawing.h"
#include "results/mechanism_figure.h"

namespace bielle {
namespace {

constexpr const char *kBar = "#1f5fbf", *kChain = "#6b7686", *kMotor = "#e8710a", *kInk = "#1c2430", *kSoft = "#66707f",
                     *kBehind = "#b9c0ca", *kPaper = "white";
constexpr double kNames = 0.32;  // share of the page for the names on each side
constexpr double kLeader = 26;   // px, between the figure and its names

using TextBox = Eigen::AlignedBox2d;  // px

struct PivotLabel {
  std::string text, all;  // `all`: every name
  Point2 pivot;           // m
  double y = 0;           // px
};

std::string listNames(const std::vector<std::string>& names, size_t count) {
  std::string text;
  for (size_t i = 0; i < count; ++i) text += (i ? ", " : "") + names[i];
  return text;
}

class MechanismWriter {
 public:
  MechanismWriter(const MechanismFigure& figure, const MechanismPicture& picture)
      : figure_(figure), picture_(picture), font_(picture.font) {
    makeColumns();
    measure();
    for (std::vector<PivotLabel>* column : {&left_, &right_}) spread(*column);
  }

  std::string write() {
    drawing_.projection = metres_;
    if (picture_.behind) drawBehind(*picture_.behind);
    for (const FigureLink& link : figure_.links) {
      const bool is_plate = link.outline.size() > 2;
      const std::string color = link.in_loop ? kBar : kChain;
      drawing_.addLines({link.outline}, {color, is_plate ? 2.0 : 4.0, is_plate ? color + "22" : "none"}, is_plate,
                        link.name);
    }
    for (const FigureLine& belt : figure_.belts) drawLine(belt, {kMotor, 2, "none", "6 4"});
    for (const FigureLine& spring : figure_.springs) drawLine(spring, {"#1e7d3c", 2, "none", "2 3"});
    for (const FigureLine& sole : figure_.soles) drawLine(sole, {kInk, 4});
    drawing_.projection = {};
    for (const PivotLabel& label : left_) drawLabel(label, left_edge_ - kLeader, -1);
    for (const PivotLabel& label : right_) drawLabel(label, size_.x() - right_edge_ + kLeader, 1);
    for (const FigurePivot& pivot : figure_.pivots) drawPivot(pivot);
    if (picture_.has_dimensions)
      for (const FigureDistance& distance : figure_.distances) drawDistance(distance);
    drawScale();
    return drawing_.write(size_, kPaper);
  }

 private:
  // The left half of the pivots has its names to the left.
  void makeColumns() {
    std::vector<PivotLabel> labels;
    for (const FigurePivot& pivot : figure_.pivots)
      labels.push_back({shorten(pivot.names), listNames(pivot.names, pivot.names.size()), pivot.at});
    std::stable_sort(labels.begin(), labels.end(),
                     [](const PivotLabel& a, const PivotLabel& b) { return a.pivot.x() < b.pivot.x(); });
    const auto middle = labels.begin() + static_cast<std::ptrdiff_t>((labels.size() + 1) / 2);
    left_.assign(labels.begin(), middle), right_.assign(middle, labels.end());
    left_edge_ = right_edge_ = font_;
    for (const auto& [column, edge] : {std::pair{&left_, &left_edge_}, std::pair{&right_, &right_edge_}})
      for (const PivotLabel& label : *column)
        *edge = std::max(*edge, estimateWidth(label.text, font_) + kLeader + font_);
  }

  // As many names as fit into a share of the page; of one that does not, its beginning.
  std::string shorten(const std::vector<std::string>& names) const {
    const double most = kNames * picture_.width;
    for (size_t count = names.size(); count > 0; --count) {
      std::string text = listNames(names, count);
      if (names.size() > count) text += " + " + std::to_string(names.size() - count);
      if (estimateWidth(text, font_) <= most) return text;
    }
    const size_t letters = static_cast<size_t>(most / estimateWidth("x", font_));
    return names.empty() ? "" : names[0].substr(0, std::max<size_t>(letters, 4) - 1) + "…";
  }

  // The scale at which figure, names and captions fit.
  void measure() {
    Eigen::AlignedBox2d box;
    for (const MechanismFigure* figure : {&figure_, picture_.behind}) {
      if (!figure) continue;
      for (const FigureLink& link : figure->links)
        for (const Point2& p : link.outline) box.extend(p);
      for (const FigurePivot& pivot : figure->pivots) box.extend(pivot.at);
      for (const FigureLine& sole : figure->soles) box.extend(sole[0]), box.extend(sole[1]);
    }
    if (box.isEmpty()) box.extend(Point2::Zero());
    top_ = font_ * (picture_.title.empty() ? 1.5 : 3);
    const Point2 edges(left_edge_ + right_edge_, top_ + 4 * font_), size = box.sizes().cwiseMax(Point2(1e-3, 1e-3));
    const double fitting = (Point2(picture_.width, picture_.height) - edges).cwiseQuotient(size).minCoeff(),
                 scale = std::max(fitting, 40 / size.maxCoeff());
    const double captions =
        std::max(estimateWidth(figure_.caption, 0.85 * font_), estimateWidth(picture_.title, font_)) + 2 * font_;
    const double lines = std::ceil(static_cast<double>(figure_.pivots.size()) / 2);
    body_ = std::max(scale * size.y(), lines * 1.35 * font_);
    size_ = {std::max(scale * size.x() + edges.x(), captions), body_ + edges.y()};
    metres_.scale = {scale, -scale};
    metres_.origin =
        Point2((size_.x() + left_edge_ - right_edge_) / 2, top_ + body_ / 2) - metres_.scale.cwiseProduct(box.center());
  }

  // As high as their pivots, as far as there is room.
  void spread(std::vector<PivotLabel>& column) const {
    std::stable_sort(column.begin(), column.end(),
                     [](const PivotLabel& a, const PivotLabel& b) { return a.pivot.y() > b.pivot.y(); });
    const double step = 1.35 * font_;
    double y = top_ - step / 2;
    for (PivotLabel& label : column) label.y = y = std::max(y + step, metres_(label.pivot).y());
    y = top_ + body_ + step / 2;
    for (auto label = column.rbegin(); label != column.rend(); ++label) label->y = y = std::min(y - step, label->y);
  }

  void drawBehind(const MechanismFigure& figure) {
    for (const FigureLink& link : figure.links)
      drawing_.addLines({link.outline}, {kBehind, 2.5}, link.outline.size() > 2);
    for (const FigureLine& sole : figure.soles) drawLine(sole, {kBehind, 4});
    for (const FigurePivot& pivot : figure.pivots) drawing_.addDisc(pivot.at, 2.5, {kBehind, 1.5, kPaper});
  }

  void drawLine(const FigureLine& line, const Pen& pen) {
    if ((line[1] - line[0]).norm() * metres_.scale.x() < 1)
      drawing_.addDisc(line[0], 4, {pen.color, 1.5, pen.color});
    else
      drawing_.addLines({{line[0], line[1]}}, pen);
  }

  void drawPivot(const FigurePivot& pivot) {
    const Point2 at = metres_(pivot.at), reach = Point2::Constant(pivot.has_motor ? 7 : 4);
    if (pivot.has_motor) drawing_.addDisc(at, 7, {kPaper, 1.5, kMotor});
    drawing_.addDisc(at, 3.2, {kInk, 1.5, kPaper});
    taken_.emplace_back(at - reach, at + reach);
  }

  // \param side  -1 to the left of `edge`, 1 to the right
  void drawLabel(const PivotLabel& label, double edge, int side) {
    const Point2 begin(edge - 2 * side, label.y), bend(edge - 8 * side, label.y);
    drawing_.addLines({{begin, bend, metres_(label.pivot)}}, {kBehind, 0.8});
    drawing_.addText({edge, label.y + 0.35 * font_}, label.text, {font_, kInk, side < 0 ? "end" : "start"}, label.all);
  }

  // Beside its line where there is room; left out where there is none.
  void drawDistance(const FigureDistance& distance) {
    const Point2 a = metres_(distance.a), b = metres_(distance.b);
    if ((b - a).norm() < 1) return;
    const double font = 0.92 * font_;
    const std::string text = formatNumber(std::round(1e4 * distance.length) / 10, "%.6g");
    const Point2 half(estimateWidth(text, font) / 2, font / 2), corner = a.cwiseMin(b);
    // Limbs side by side look like one.
    if (!drawn_.insert({text, std::lround(corner.x()), std::lround(corner.y()), std::lround((b - a).norm())}).second)
      return;
    const Point2 along = (b - a).normalized(), across(-along.y(), along.x());
    const TextBox room(Point2(left_edge_ - kLeader + 4, 2),
                       Point2(size_.x() - right_edge_ + kLeader - 4, top_ + body_ + 1.5 * font));
    for (const double out : {1.0, 1.6, 2.4})
      for (const double t : {0.5, 0.35, 0.65, 0.2, 0.8})
        for (const double side : {1.0, -1.0}) {
          const double reach = 4 + out * across.cwiseAbs().dot(half);
          const Point2 c = a + t * (b - a) + side * reach * across;
          const TextBox box(c - half, c + half);
          const auto is_hit = [&box](const TextBox& other) { return box.intersects(other); };
          if (!room.contains(box) || std::any_of(taken_.begin(), taken_.end(), is_hit)) continue;
          taken_.push_back(box);
          drawing_.addText({c.x(), c.y() + 0.36 * font}, text, {font, "#9c1c6b", "middle", "normal", kPaper},
                           distance.link + ": " + distance.from + " to " + distance.to);
          return;
        }
  }

  // A line of a round length, and what is seen.
  void drawScale() {
    const double small = 0.85 * font_, scale = metres_.scale.x(), y = size_.y() - 2.6 * font_;
    double length = 1;
    for (const double round : {0.5, 0.2, 0.1, 0.05, 0.02, 0.01})
      if (length * scale > 0.25 * size_.x()) length = round;
    const Point2 begin(font_, y), end(font_ + length * scale, y);
    drawing_.addLines({{begin, end}}, {kSoft, 2});
    const std::string note = picture_.has_dimensions ? " mm; distances of pivots in mm" : " mm";
    drawing_.addText({end.x() + 6, y + 0.35 * small}, formatNumber(1000 * length) + note, {small, kSoft});
    drawing_.addText({font_, size_.y() - 0.9 * font_}, figure_.caption, {small, kSoft});
    if (!picture_.title.empty()) drawing_.addText({font_, 1.5 * font_}, picture_.title, {font_, kInk, "start", "bold"});
  }

  const MechanismFigure& figure_;
  const MechanismPicture& picture_;
  const double font_;
  Drawing drawing_{2};
  Projection metres_;
  Point2 size_ = Point2::Zero();                                // px, of the page
  double body_ = 0, top_ = 0, left_edge_ = 0, right_edge_ = 0;  // px; edges are for the names
  std::vector<PivotLabel> left_, right_;
  std::vector<TextBox> taken_;
  std::set<std::tuple<std::string, long, long, long>> drawn_;  // distances
};

}  // namespace

std::string formatMechanism(const MechanismFigure& figure, const MechanismPicture& picture) {
  return MechanismWriter(figure, picture).write();
}

}  // namespace bielle
