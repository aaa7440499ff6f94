#pragma once
// A plane drawing: lines, discs and texts, each put on the page by a projection; written as SVG.
#include <string>
#include <vector>

#include "bielle/math/types.h"
#include "formats/xml_document.h"

namespace bielle {

using Point2 = Eigen::Vector2d;
using Polyline = std::vector<Point2>;

// From what is drawn to the page, px, whose second coordinate points downwards. By default px are drawn.
struct Projection {
  Point2 scale = Point2::Ones(), origin = Point2::Zero();  // px per unit; where zero is on the page
  Point2 operator()(const Point2& p) const { return origin + scale.cwiseProduct(p); }
};

struct Pen {
  std::string color;
  double width = 1;  // px
  std::string fill = "none", dashes = {};
};

struct Lettering {
  double size;  // px
  std::string color, anchor = "start", weight = "normal";
  std::string halo = {};  // its colour
};

// px, of text in a sans-serif font: no less than a browser takes.
double estimateWidth(const std::string& text, double font);

// A title is shown where the pointer is over the shape.
class Drawing {
 public:
  // \param digits  of px, after the point
  explicit Drawing(int digits);

  Projection projection;  // of the shapes that follow

  void addLines(const std::vector<Polyline>& lines, const Pen& pen, bool closed = false, const std::string& title = {});
  // \param radius  px
  void addDisc(const Point2& at, double radius, const Pen& pen);
  void addText(const Point2& at, const std::string& text, const Lettering& lettering, const std::string& title = {});
  // A part of the page for the shapes that follow, which are cut at its edges. \param size  px
  void openWindow(double left, const Point2& size);

  // \param size  of the page, px   \param background  empty: none, and the drawing becomes as large as what holds it
  std::string write(const Point2& size, const std::string& background = {});

 private:
  XMLElement& add(const char* tag, const std::string& title = {});
  std::string format(double px) const;

  XMLDocument document_;
  XMLElement *page_, *window_;
  double unit_;  // px, to which numbers are rounded
};

}  // namespace bielle
