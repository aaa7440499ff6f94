// A host program may have set locales with a decimal comma and dots between thousands, in C and in C++: what the library writes
// and reads is the same. Oracle: the same calls before.
#include <catch2/catch.hpp>
#include <clocale>
#include <cstdlib>
#include <locale>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/sdf.h"
#include "get_error.h"
#include "model/number_text.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

// Of the whole program, while it lives.
class CommaLocales {
 public:
  CommaLocales() : former_(std::locale::global(std::locale(std::locale::classic(), new Comma))) {
    has_c_ = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
  }
  ~CommaLocales() {
    std::setlocale(LC_ALL, "C");
    std::locale::global(former_);
  }
  bool hasC() const { return has_c_; }

 private:
  std::locale former_;
  bool has_c_;
};

// Everything that the robot is written as, and read from again.
std::string writeAndRead(const Model& model) {
  const RobotText text = formatRobot(model, "");
  const VectorXd q = findClosedConfiguration(model).q;
  const RobotDirectory directory;
  const Model again = loadRobot(directory.writeRobot(text.urdf, text.yaml)).model;
  std::string all =
      text.urdf + text.yaml + formatMjcf(model, q).xml + formatSdf(model, q).xml + formatDrake(model).urdf;
  all += formatRobot(again, "").urdf + formatRobot(again, "").yaml;
  const RobotDirectory others;
  all += formatRobot(loadRobot(others.write("robot.mjcf.xml", formatMjcf(model, q).xml)).model, "").urdf;
  return all;
}

}  // namespace

TEST_CASE("robots are written and read with a point in every locale") {
  const Model model = loadRobot("bipetto").model;
  const std::string before = writeAndRead(model);
  const CommaLocales locales;
  std::ostringstream text;
  text << 1234.5;
  REQUIRE(text.str() == "1.234,5");  // the locale does what it is for
  if (const char* path = std::getenv("LOCPATH"); path && *path) {
    REQUIRE(locales.hasC());
    REQUIRE(std::to_string(0.5) == "0,500000");
  }
  CHECK(writeAndRead(model) == before);
}

TEST_CASE("numbers in messages and in files of YAML have a point in every locale") {
  const RobotDirectory wrong;
  const std::string path = wrong.writeRobot(kToyUrdf, std::string(kToyYaml) + "gravity: [0, 0, -9.75, 1000.5]\n");
  const auto read = [&path] { return getError([&path] { loadRobot(path); }); };
  const std::string before = read();
  const CommaLocales locales;
  CHECK(read() == before);
  CHECK(formatNumber(1234.5, "%.2f") == "1234.50");
  CHECK(formatText("%d %.1e", 1000, 0.5) == "1000 5.0e-01");
  TextStream stream;
  stream << 1234567 << " " << 0.5;
  CHECK(stream.str() == "1234567 0.5");
}

TEST_CASE("a number is a whole text of digits, a point and an exponent, or one of YAML's words") {
  const double infinity = HUGE_VAL;
  for (const auto& [text, value] : {std::pair("0.5", 0.5),
                                    {"-.5", -0.5},
                                    {"+1e3", 1e3},
                                    {"010", 10.0},
                                    {"3.", 3.0},
                                    {"1e-400", 0.0},
                                    {".inf", infinity},
                                    {"-.INF", -infinity},
                                    {"1E2", 100.0}}) {
    CAPTURE(text);
    REQUIRE(parseNumber(text));
    CHECK(*parseNumber(text) == value);
  }
  CHECK(std::isnan(parseNumber(".nan").value_or(0)));
  for (const char* text :
       {"", "-", "1,5", "1.5x", " 1", "1 ", "inf", "nan", "0x10", "1e", "1e400", "--1", "1_000", "+-1", "."}) {
    CAPTURE(text);
    CHECK_FALSE(parseNumber(text));
  }
}

TEST_CASE("a number is written by as few digits as read back to the same bits") {
  for (const auto& [value, text] : {std::pair(0.1, "0.1"),
                                    {100000.0, "100000"},
                                    {-0.0, "0"},
                                    {0.1 + 0.2, "0.30000000000000004"},
                                    {1e-5, "1e-05"},
                                    {1 / 3.0, "0.3333333333333333"}}) {
    CHECK(formatExact(value) == text);
    CHECK(parseNumber(formatExact(value)) == value);
  }
  CHECK(formatExact(HUGE_VAL).empty());
}
