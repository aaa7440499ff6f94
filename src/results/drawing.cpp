#include "results/drawing.h"

#include <algorithm>
#include <cmath>

#include "model/number_text.h"

namespace bielle {

double estimateWidth(const std::string& text, double font) {
  const auto is_first_byte = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; };
  return 0.58 * font * static_cast<double>(std::count_if(text.begin(), text.end(), is_first_byte));
}

Drawing::Drawing(int digits)
    : page_(&addElement(document_, "svg", {{"xmlns", "http://www.w3.org/2000/svg"}})),
      window_(page_),
      unit_(std::pow(10, -digits)) {}

void Drawing::addLines(const std::vector<Polyline>& lines, const Pen& pen, bool closed, const std::string& title) {
  if (lines.empty()) return;
  std::string path;
  for (const Polyline& line : lines) {
    for (size_t i = 0; i < line.size(); ++i) {
      const Point2 p = projection(line[i]);
      path += (i ? "L" : "M") + format(p.x()) + " " + format(p.y());
    }
    if (closed) path += "Z";
  }
  XMLElement& element = add("path", title);
  setAttributes(element, {{"fill", pen.fill}, {"stroke", pen.color}, {"stroke-width", formatNumber(pen.width)}});
  // Round ends would make dashes longer.
  if (!pen.dashes.empty()) setAttributes(element, {{"stroke-dasharray", pen.dashes}, {"stroke-linecap", "butt"}});
  setAttributes(element, {{"d", path}});
}

void Drawing::addDisc(const Point2& at, double radius, const Pen& pen) {
  const Point2 p = projection(at);
  setAttributes(add("circle"), {{"cx", format(p.x())},
                                {"cy", format(p.y())},
                                {"r", formatNumber(radius)},
                                {"fill", pen.fill},
                                {"stroke", pen.color},
                                {"stroke-width", formatNumber(pen.width)}});
}

void Drawing::addText(const Point2& at, const std::string& text, const Lettering& lettering, const std::string& title) {
  const Point2 p = projection(at);
  XMLElement& element = add("text", title);
  setAttributes(element, {{"x", format(p.x())},
                          {"y", format(p.y())},
                          {"font-size", formatNumber(lettering.size)},
                          {"fill", lettering.color},
                          {"text-anchor", lettering.anchor},
                          {"font-weight", lettering.weight}});
  if (!lettering.halo.empty())
    setAttributes(element, {{"stroke", lettering.halo}, {"stroke-width", "3"}, {"paint-order", "stroke"}});
  element.SetText(text.c_str());
}

void Drawing::openWindow(double left, const Point2& size) {
  window_ = page_;
  window_ = &add("svg");
  setAttributes(*window_, {{"x", format(left)}, {"width", format(size.x())}, {"height", format(size.y())}});
}

std::string Drawing::write(const Point2& size, const std::string& background) {
  const std::string width = format(size.x()), height = format(size.y());
  setAttributes(*page_, {{"viewBox", "0 0 " + width + " " + height},
                         {"font-family", "Helvetica, Arial, sans-serif"},
                         {"stroke-linecap", "round"},
                         {"stroke-linejoin", "round"}});
  if (!background.empty()) {
    XMLElement& sheet = *document_.NewElement("rect");
    page_->InsertFirstChild(&sheet);
    for (XMLElement* element : {page_, &sheet}) setAttributes(*element, {{"width", width}, {"height", height}});
    setAttributes(sheet, {{"fill", background}});
  }
  return formatXml(document_);
}

XMLElement& Drawing::add(const char* tag, const std::string& title) {
  if (title.empty()) return addElement(*window_, tag);
  XMLElement& group = addElement(*window_, "g");
  bielle::addText(group, "title", title);
  return addElement(group, tag);
}

std::string Drawing::format(double px) const { return formatNumber(std::round(px / unit_) * unit_, "%.8g"); }

}  // namespace bielle
