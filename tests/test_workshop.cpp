// Drawings for a workshop: pivots and their distances, plates in DXF, the sheet and its table.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "formats/dxf.h"
#include "formats/pivots.h"
#include "leg_biped.h"
#include "results/mechanism_figure.h"
#include "results/workshop_sheet.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

namespace {

// Centres of the circles by layer, mm; the vertices of outlines likewise; texts.
struct ReadDxf {
  std::map<std::string, std::vector<Eigen::Vector2d>> circles, vertices;
  std::vector<std::string> texts;
};

ReadDxf readDxf(const std::string& text) {
  ReadDxf out;
  std::istringstream lines(text);
  std::string kind, layer, code, value;
  Eigen::Vector2d at(0, 0);
  const auto finish = [&] {
    if (kind == "CIRCLE") out.circles[layer].push_back(at);
    if (kind == "VERTEX") out.vertices[layer].push_back(at);
  };
  while (std::getline(lines, code) && std::getline(lines, value)) {
    if (code == "0") finish(), kind = value;
    if (code == "8") layer = value;
    if (code == "10") at.x() = std::stod(value);
    if (code == "20") at.y() = std::stod(value);
    if (code == "1" && kind == "TEXT") out.texts.push_back(value);
  }
  REQUIRE(kind == "EOF");
  return out;
}

bool hasDistance(const std::vector<Eigen::Vector2d>& points, double length) {
  for (const auto& a : points)
    for (const auto& b : points)
      if (std::abs((a - b).norm() - length) < 1e-6) return true;
  return false;
}

// From placements of the model, independent of what lists pivots: distance in the plane across y, mm.
double measureDistance(const Model& model, const std::string& a, const std::string& b) {
  Workspace ws(model);
  updatePlacements(model, ws, makeDrawnPosture(model));
  REQUIRE(model.findJoint(a) > 0);
  REQUIRE(model.findJoint(b) > 0);
  Vector3d d = ws.X_WB[model.findJoint(a)].p - ws.X_WB[model.findJoint(b)].p;
  d.y() = 0;
  return 1000 * d.norm();
}

}  // namespace

TEST_CASE("workshop: welded halves of a coupler are one link of the drawn length") {
  const Model model = loadRobot("fourbar").model;
  const std::vector<RigidLink> links = listRigidLinks(model);
  std::map<std::string, double> lengths;
  for (const LinkDistance& d : listLinkDistances(links)) lengths[links[static_cast<size_t>(d.link)].name] = d.length;
  REQUIRE(lengths.size() == 4);  // two of the five bodies are halves of the coupler
  CHECK(lengths.at("crank") == Approx(0.15).epsilon(1e-12));
  CHECK(lengths.at("coupler") == Approx(0.35).epsilon(1e-12));
  CHECK(lengths.at("rocker") == Approx(0.3).epsilon(1e-12));
  CHECK(std::any_of(lengths.begin(), lengths.end(), [](const auto& d) { return std::abs(d.second - 0.4) < 1e-12; }));
}

TEST_CASE("workshop: plates have the distances of the model") {
  const Model model =
      makeLegBiped({{"knee", "four_bar"}, {"ankle", "rsu"}, {"knee_crank", 0.043}, {"knee_arm", 0.052}});
  const DxfText dxf = formatDxf(model, 0.006);
  const ReadDxf read = readDxf(dxf.text);
  std::map<std::string, std::string> layers;
  for (const char* link : {"shank_left", "crank_knee_left"}) {
    std::string layer = link;
    for (char& c : layer) c = static_cast<char>(std::toupper(c));
    CAPTURE(link);
    REQUIRE(read.circles.count(layer) == 1);
    layers[link] = layer;
  }
  const double shank = measureDistance(model, "knee_left", "ankley_left");
  CHECK(shank > 100);
  CHECK(hasDistance(read.circles.at(layers.at("shank_left")), shank));
  CHECK(hasDistance(read.circles.at(layers.at("shank_left")), 52));
  CHECK(hasDistance(read.circles.at(layers.at("crank_knee_left")), 43));
  CHECK_FALSE(hasDistance(read.circles.at(layers.at("crank_knee_left")), 43.00001));  // would the check see one?
  CHECK(std::count(read.texts.begin(), read.texts.end(), "43.000") >= 2);
  // Outlines stay 7.5 mm from the holes.
  for (const auto& [layer, vertices] : read.vertices) {
    CAPTURE(layer);
    for (const Eigen::Vector2d& v : vertices) {
      double nearest = 1e9;
      for (const Eigen::Vector2d& hole : read.circles.at(layer)) nearest = std::min(nearest, (v - hole).norm());
      CHECK(nearest == Approx(7.5).epsilon(1e-6));
    }
  }
  // Nothing of one plate lies on another: rows of their own.
  std::vector<std::pair<double, double>> rows;
  for (const auto& [layer, vertices] : read.vertices) {
    double low = 1e9, high = -1e9;
    for (const Eigen::Vector2d& v : vertices) low = std::min(low, v.y()), high = std::max(high, v.y());
    rows.emplace_back(low, high);
  }
  std::sort(rows.begin(), rows.end());
  for (size_t i = 1; i < rows.size(); ++i) CHECK(rows[i].first > rows[i - 1].second);
  REQUIRE(rows.size() > 6);
}

TEST_CASE("workshop: links that are not plane are named") {
  const Model model = loadRobot("bipetto").model;
  const DxfText dxf = formatDxf(model);
  REQUIRE_FALSE(dxf.warnings.empty());
  CHECK_THAT(dxf.warnings.front(), Contains("link '") && Contains("is left out"));
}

TEST_CASE("workshop: the table has lengths, masses and motors") {
  const Model model = makeLegBiped({{"knee", "four_bar"}, {"ankle", "rsu"}, {"knee_crank", 0.043}});
  const std::string table = formatSheetTable(model);
  CHECK_THAT(table, Contains("kind,of,from,to,value,unit\n"));
  double mass = 0;
  std::istringstream lines(table);
  int cranks = 0, ratios = 0;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> fields;
    std::istringstream row(line);
    for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
    REQUIRE(fields.size() == 6);
    if (fields[0] == "mass") mass += std::stod(fields[4]);
    if (fields[0] == "ratio") ++ratios;
    if (fields[0] == "length" && fields[1].rfind("crank_knee", 0) == 0) {
      CHECK(std::stod(fields[4]) == Approx(43).epsilon(1e-9));
      ++cranks;
    }
  }
  CHECK(cranks == 2);
  CHECK(ratios == model.nu());
  CHECK(mass == Approx(model.mass()).epsilon(1e-8));
}

namespace {

std::set<std::string> readTexts(const std::string& svg) {
  std::set<std::string> out;
  const std::regex pattern("<text [^>]*>([^<]*)</text>");
  for (auto it = std::sregex_iterator(svg.begin(), svg.end(), pattern); it != std::sregex_iterator(); ++it)
    out.insert((*it)[1]);
  return out;
}

}  // namespace

TEST_CASE("workshop: of limbs that look the same one is drawn, with names and distances") {
  const Model model = makeLegBiped({{"knee", "four_bar"}, {"ankle", "rsu"}, {"knee_crank", 0.043}});
  const MechanismFigure figure = makeMechanismFigure(model, makeDrawnPosture(model));
  CHECK_THAT(figure.caption, Contains("from the side") && Contains("one of 2 limbs"));
  int lefts = 0, rights = 0;
  for (const FigureLink& link : figure.links)
    lefts += link.name.find("_left") != std::string::npos, rights += link.name.find("_right") != std::string::npos;
  CHECK(lefts > 3);
  CHECK(rights == 0);
  CHECK(figure.soles.size() == 1);
  const auto is_crank = [](const FigureDistance& d) { return std::abs(d.length - 0.043) < 1e-12; };
  CHECK(std::any_of(figure.distances.begin(), figure.distances.end(), is_crank));
  const std::set<std::string> texts = readTexts(formatSheet(model));
  CHECK(texts.count("43") == 1);
  const auto names = [&](const char* name) {
    return std::any_of(texts.begin(), texts.end(),
                       [&](const std::string& t) { return t.find(name) != std::string::npos; });
  };
  CHECK(names("knee_left"));
  CHECK(names("motor_knee_left"));
}
