#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <tuple>

#include "model/number_text.h"
#include "results/mechanism_figure.h"
#include "results/svg_text.h"

namespace bielle {
namespace {

constexpr const char *kBar = "#1f5fbf", *kChain = "#6b7686", *kMotor = "#e8710a", *kInk = "#1c2430", *kSoft = "#66707f",
                     *kBehind = "#b9c0ca";
constexpr double kNames = 0.32;  // share of the page for the names on each side
constexpr double kLeader = 26;   // px, between the figure and its names

struct TextBox {
  double left, top, right, bottom;
  bool overlaps(const TextBox& o) const { return left < o.right && o.left < right && top < o.bottom && o.top < bottom; }
};

struct PivotLabel {
  std::string text, all;  // `all`: every name
  Point2 pivot;           // px, m before there is a scale
  double y = 0;
};

std::string formatPx(double value) { return formatNumber(std::round(value * 100) / 100, "%.8g"); }

class MechanismWriter {
 public:
  MechanismWriter(const MechanismFigure& figure, const MechanismPicture& picture) : figure_(figure), picture_(picture) {
    measure();
    labelPivots();
  }

  std::string write() {
    drawBehind();
    for (const FigureLink& link : figure_.links) drawLink(link);
    for (const FigureLine& belt : figure_.belts) drawLine(belt, kMotor, 2, "stroke-dasharray=\"6 4\"");
    for (const FigureLine& spring : figure_.springs) drawLine(spring, "#1e7d3c", 2, "stroke-dasharray=\"2 3\"");
    for (const FigureLine& sole : figure_.soles) drawLine(sole, kInk, 4, "");
    for (const PivotLabel& label : left_) drawLabel(label, true);
    for (const PivotLabel& label : right_) drawLabel(label, false);
    for (const FigurePivot& pivot : figure_.pivots) drawPivot(pivot);
    if (picture_.has_dimensions)
      for (const FigureDistance& distance : figure_.distances) drawDistance(distance);
    drawScale();
    std::ostringstream svg;
    svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << formatPx(width_) << "\" height=\""
        << formatPx(height_) << "\" viewBox=\"0 0 " << formatPx(width_) << " " << formatPx(height_)
        << "\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"" << formatPx(picture_.font) << "\" fill=\""
        << kInk << "\">\n"
        << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        << out_.str() << "</svg>\n";
    return svg.str();
  }

 private:
  // The scale at which figure, names and captions fit.
  void measure() {
    std::vector<Point2> points;
    for (const MechanismFigure* figure : {&figure_, picture_.behind}) {
      if (!figure) continue;
      for (const FigureLink& link : figure->links)
        points.insert(points.end(), link.outline.begin(), link.outline.end());
      for (const FigurePivot& pivot : figure->pivots) points.push_back(pivot.at);
      for (const FigureLine& sole : figure->soles) points.insert(points.end(), sole.begin(), sole.end());
    }
    if (points.empty()) points.push_back(Point2::Zero());
    low_ = high_ = points.front();
    for (const Point2& p : points) low_ = low_.cwiseMin(p), high_ = high_.cwiseMax(p);
    makeColumns();
    top_ = picture_.font * (picture_.title.empty() ? 1.5 : 3), bottom_ = 4 * picture_.font;
    const Point2 size = (high_ - low_).cwiseMax(Point2(1e-3, 1e-3));
    scale_ =
        std::min((picture_.width - left_edge_ - right_edge_) / size.x(), (picture_.height - top_ - bottom_) / size.y());
    scale_ = std::max(scale_, 40 / size.maxCoeff());
    const double captions =
        std::max(estimateWidth(figure_.caption, 0.85 * picture_.font), estimateWidth(picture_.title, picture_.font)) +
        2 * picture_.font;
    width_ = std::max(scale_ * size.x() + left_edge_ + right_edge_, captions);
    const double lines = std::ceil(static_cast<double>(figure_.pivots.size()) / 2);
    body_ = std::max(scale_ * size.y(), lines * 1.35 * picture_.font);
    height_ = body_ + top_ + bottom_;
  }

  Point2 toPx(const Point2& p) const {
    const Point2 middle = (low_ + high_) / 2;
    return {(width_ + left_edge_ - right_edge_) / 2 + scale_ * (p.x() - middle.x()),
            top_ + body_ / 2 - scale_ * (p.y() - middle.y())};
  }

  // As many names as fit into a share of the page; of one that does not, its beginning.
  std::string shorten(const std::vector<std::string>& names) const {
    const double most = kNames * picture_.width;
    for (size_t count = names.size(); count > 0; --count) {
      std::string text;
      for (size_t i = 0; i < count; ++i) text += (i ? ", " : "") + names[i];
      if (names.size() > count) text += " + " + std::to_string(names.size() - count);
      if (estimateWidth(text, picture_.font) <= most) return text;
    }
    const size_t letters = static_cast<size_t>(most / estimateWidth("x", picture_.font));
    return names.empty() ? "" : names[0].substr(0, std::max<size_t>(letters, 4) - 1) + "…";
  }

  // The left half of the pivots has its names to the left.
  void makeColumns() {
    std::vector<PivotLabel> labels;
    for (const FigurePivot& pivot : figure_.pivots) {
      std::string all;
      for (const std::string& name : pivot.names) all += (all.empty() ? "" : ", ") + name;
      labels.push_back({shorten(pivot.names), all, pivot.at});
    }
    std::stable_sort(labels.begin(), labels.end(),
                     [](const PivotLabel& a, const PivotLabel& b) { return a.pivot.x() < b.pivot.x(); });
    const auto middle = labels.begin() + static_cast<std::ptrdiff_t>((labels.size() + 1) / 2);
    left_.assign(labels.begin(), middle), right_.assign(middle, labels.end());
    left_edge_ = right_edge_ = picture_.font;
    for (const auto& [column, edge] : {std::pair{&left_, &left_edge_}, std::pair{&right_, &right_edge_}})
      for (const PivotLabel& label : *column)
        *edge = std::max(*edge, estimateWidth(label.text, picture_.font) + kLeader + picture_.font);
  }

  // In each column as high as their pivots, as far as there is room.
  void labelPivots() {
    for (std::vector<PivotLabel>* column : {&left_, &right_})
      for (PivotLabel& label : *column) label.pivot = toPx(label.pivot);
    const double step = 1.35 * picture_.font, low = top_ + body_;
    for (std::vector<PivotLabel>* column : {&left_, &right_}) {
      std::stable_sort(column->begin(), column->end(),
                       [](const PivotLabel& a, const PivotLabel& b) { return a.pivot.y() < b.pivot.y(); });
      double y = top_ - step / 2;
      for (PivotLabel& label : *column) label.y = y = std::max(y + step, label.pivot.y());
      y = low + step / 2;
      for (auto label = column->rbegin(); label != column->rend(); ++label) label->y = y = std::min(y - step, label->y);
    }
  }

  void drawBehind() {
    if (!picture_.behind) return;
    for (const FigureLink& link : picture_.behind->links) writePath(link.outline, kBehind, "none", 2.5);
    for (const FigureLine& sole : picture_.behind->soles) drawLine(sole, kBehind, 4, "");
    for (const FigurePivot& pivot : picture_.behind->pivots) writeCircle(toPx(pivot.at), 2.5, "white", kBehind);
  }

  void drawLink(const FigureLink& link) {
    const char* color = link.in_loop ? kBar : kChain;
    out_ << "<g><title>" << escapeXml(link.name) << "</title>";
    writePath(link.outline, color, link.outline.size() > 2 ? std::string(color) + "22" : "none",
              link.outline.size() > 2 ? 2 : 4);
    out_ << "</g>\n";
  }

  void writePath(const std::vector<Point2>& points, const char* color, const std::string& fill, double width) {
    out_ << "<path d=\"";
    for (size_t i = 0; i < points.size(); ++i) {
      const Point2 p = toPx(points[i]);
      out_ << (i ? " L" : "M") << formatPx(p.x()) << " " << formatPx(p.y());
    }
    out_ << (points.size() > 2 ? " Z" : "") << "\" fill=\"" << fill << "\" stroke=\"" << color << "\" stroke-width=\""
         << width << "\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/>\n";
  }

  void drawLine(const FigureLine& line, const char* color, double width, const char* more) {
    const Point2 a = toPx(line[0]), b = toPx(line[1]);
    if ((b - a).norm() < 1) {
      writeCircle(a, 4, color, color);
      return;
    }
    writeLine(a, b, color, width, more);
  }

  void writeLine(const Point2& a, const Point2& b, const char* color, double width, const char* more) {
    out_ << "<line x1=\"" << formatPx(a.x()) << "\" y1=\"" << formatPx(a.y()) << "\" x2=\"" << formatPx(b.x())
         << "\" y2=\"" << formatPx(b.y()) << "\" stroke=\"" << color << "\" stroke-width=\"" << width << "\" " << more
         << "/>\n";
  }

  void writeCircle(const Point2& at, double radius, const char* fill, const char* stroke) {
    out_ << "<circle cx=\"" << formatPx(at.x()) << "\" cy=\"" << formatPx(at.y()) << "\" r=\"" << radius << "\" fill=\""
         << fill << "\" stroke=\"" << stroke << "\" stroke-width=\"1.5\"/>\n";
  }

  void drawPivot(const FigurePivot& pivot) {
    const Point2 at = toPx(pivot.at);
    if (pivot.has_motor) writeCircle(at, 7, kMotor, "white");
    writeCircle(at, 3.2, "white", kInk);
    const double reach = pivot.has_motor ? 7 : 4;
    taken_.push_back({at.x() - reach, at.y() - reach, at.x() + reach, at.y() + reach});
  }

  void writeText(const Point2& at, const char* anchor, const std::string& text, const std::string& more) {
    out_ << "<text x=\"" << formatPx(at.x()) << "\" y=\"" << formatPx(at.y()) << "\" text-anchor=\"" << anchor << "\""
         << more << ">" << escapeXml(text) << "</text>\n";
  }

  void drawLabel(const PivotLabel& label, bool left) {
    const double edge = left ? left_edge_ - kLeader : width_ - right_edge_ + kLeader, font = picture_.font;
    const double bend = edge + (left ? 8 : -8);
    out_ << "<path d=\"M" << formatPx(edge + (left ? 2 : -2)) << " " << formatPx(label.y) << " L" << formatPx(bend)
         << " " << formatPx(label.y) << " L" << formatPx(label.pivot.x()) << " " << formatPx(label.pivot.y())
         << "\" fill=\"none\" stroke=\"" << kBehind << "\" stroke-width=\"0.8\"/>\n<g><title>" << escapeXml(label.all)
         << "</title>";
    writeText({edge, label.y + 0.35 * font}, left ? "end" : "start", label.text, "");
    out_ << "</g>\n";
  }

  // Beside its line where there is room; left out where there is none.
  void drawDistance(const FigureDistance& distance) {
    const Point2 a = toPx(distance.a), b = toPx(distance.b);
    if ((b - a).norm() < 1) return;
    const double font = 0.92 * picture_.font;
    const std::string text = formatNumber(std::round(1e4 * distance.length) / 10, "%.6g");
    const double half = estimateWidth(text, font) / 2;
    // Limbs side by side look like one.
    if (!drawn_
             .insert({text, std::lround(std::min(a.x(), b.x())), std::lround(std::min(a.y(), b.y())),
                      std::lround((b - a).norm())})
             .second)
      return;
    const Point2 along = (b - a).normalized(), across(-along.y(), along.x());
    for (const double out : {1.0, 1.6, 2.4})
      for (const double t : {0.5, 0.35, 0.65, 0.2, 0.8})
        for (const double side : {1.0, -1.0}) {
          const double reach = 4 + out * (std::abs(across.x()) * half + std::abs(across.y()) * font / 2);
          const Point2 c = a + t * (b - a) + side * reach * across;
          const TextBox box{c.x() - half, c.y() - font / 2, c.x() + half, c.y() + font / 2};
          const auto is_hit = [&box](const TextBox& other) { return box.overlaps(other); };
          if (box.left < left_edge_ - kLeader + 4 || box.right > width_ - right_edge_ + kLeader - 4 || box.top < 2 ||
              box.bottom > top_ + body_ + 1.5 * font || std::any_of(taken_.begin(), taken_.end(), is_hit))
            continue;
          taken_.push_back(box);
          out_ << "<g><title>" << escapeXml(distance.link + ": " + distance.from + " to " + distance.to) << "</title>";
          writeText({c.x(), c.y() + 0.36 * font}, "middle", text,
                    " font-size=\"" + formatPx(font) +
                        "\" fill=\"#9c1c6b\" stroke=\"white\" stroke-width=\"3\" "
                        "paint-order=\"stroke\"");
          out_ << "</g>\n";
          return;
        }
  }

  // A line of a round length, and what is seen.
  void drawScale() {
    const double font = picture_.font, small = 0.85 * font;
    double length = 1;
    for (const double round : {0.5, 0.2, 0.1, 0.05, 0.02, 0.01})
      if (length * scale_ > 0.25 * width_) length = round;
    const double y = height_ - 2.6 * font;
    writeLine({font, y}, {font + length * scale_, y}, kSoft, 2, "");
    const std::string more = " font-size=\"" + formatPx(small) + "\" fill=\"" + kSoft + "\"";
    writeText({font + length * scale_ + 6, y + 0.35 * small}, "start",
              formatNumber(1000 * length) + " mm" + (picture_.has_dimensions ? "; distances of pivots in mm" : ""),
              more);
    writeText({font, height_ - 0.9 * font}, "start", figure_.caption, more);
    if (!picture_.title.empty()) writeText({font, 1.5 * font}, "start", picture_.title, " font-weight=\"bold\"");
  }

  const MechanismFigure& figure_;
  const MechanismPicture& picture_;
  Point2 low_, high_;                                                            // of the figure, m
  double scale_ = 1, width_ = 0, height_ = 0, body_ = 0, top_ = 0, bottom_ = 0;  // px/m, px
  double left_edge_ = 0, right_edge_ = 0;                                        // px, of the names
  std::vector<PivotLabel> left_, right_;
  std::vector<TextBox> taken_;
  std::set<std::tuple<std::string, long, long, long>> drawn_;  // distances
  std::ostringstream out_;
};

}  // namespace

std::string escapeXml(const std::string& text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  return out;
}

double estimateWidth(const std::string& text, double font) {
  const auto is_first_byte = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; };
  return 0.58 * font * static_cast<double>(std::count_if(text.begin(), text.end(), is_first_byte));
}

std::string formatMechanism(const MechanismFigure& figure, const MechanismPicture& picture) {
  return MechanismWriter(figure, picture).write();
}

}  // namespace bielle
