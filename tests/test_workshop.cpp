// Drawings for a workshop: pivots and their distances, the sheet and its table.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "bielle/robots/robot_loader.h"
#include "formats/pivots.h"
#include "leg_biped.h"
#include "results/mechanism_figure.h"
#include "results/workshop_sheet.h"

using namespace bielle;
using namespace bielle::testing;
using Catch::Matchers::Contains;

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
