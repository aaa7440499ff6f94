// Options by name: types, bounds, and structs that are described once.
#include <catch2/catch.hpp>
#include <limits>

#include "bielle/model/error.h"
#include "bielle/model/options.h"

using namespace bielle;
using Catch::Contains;

namespace {

enum class Gear { Low, High };

struct Part {
  double length = 0.1;
  double mass = 2;
};

struct Machine {
  bool rigid = false;
  int teeth = 12;
  Gear gear = Gear::High;
  double speed = -1;
  Part part;
};

void describe(OptionFields& f, Part& p) {
  f.number("length", p.length, "m", kPositive, "length of the part");
  f.number("mass", p.mass, "kg", {0.5, 10}, "mass of the part");
}

void describe(OptionFields& f, Machine& m) {
  f.flag("rigid", m.rigid, "without springs");
  f.integer("teeth", m.teeth, {8, 100}, "teeth of the wheel");
  f.choice("gear", m.gear, {"low", "high"}, "gear at the start");
  f.number("speed", m.speed, "m/s", {}, "speed of the machine");
  f.omit({"mass"});
  describe(f, m.part);
  f.omit({});
}

}  // namespace

TEST_CASE("options: a struct is listed in order and read again") {
  const OptionSet list = listOptions(Machine());
  const OptionValues values = {
      {"rigid", false}, {"teeth", 12}, {"gear", std::string("high")}, {"speed", -1.0}, {"length", 0.1}};
  CHECK(list.listValues() == values);
  OptionSet changed = list;
  changed.set("rigid", true);
  changed.set("teeth", 20.0);
  changed.set("gear", "low");
  changed.set("speed", 3);
  changed.set("length", 0.3);
  CHECK(list.listValues() == values);  // a copy is another value
  Machine others;
  others.part.mass = 7;
  const Machine machine = readOptions(changed, others);
  CHECK(machine.rigid);
  CHECK(machine.teeth == 20);
  CHECK(machine.gear == Gear::Low);
  CHECK(machine.speed == 3);
  CHECK(machine.part.length == 0.3);
  CHECK(machine.part.mass == 7);  // passed over
  CHECK(listOptions(machine).listValues() == changed.listValues());
}

TEST_CASE("options: errors name the option, what is allowed, and the nearest name") {
  OptionSet list = listOptions(Machine(), "parameter", "machine");
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(list.set("spead", 1), Contains("machine: parameter 'spead'") && Contains("nearest is 'speed'") &&
                                              Contains("rigid, teeth, gear, speed, length"));
  CHECK_THROWS_WITH(list.set("mass", 1), Contains("no such parameter"));
  CHECK_THROWS_WITH(list.set("rigid", 1), Contains("parameter 'rigid'") && Contains("true or false"));
  CHECK_THROWS_WITH(list.set("teeth", 12.5), Contains("not a whole number") && Contains("8 .. 100"));
  CHECK_THROWS_WITH(list.set("teeth", 7), Contains("7 is outside 8 .. 100"));
  CHECK_THROWS_WITH(list.set("teeth", true), Contains("'true'") && Contains("a whole number"));
  CHECK_THROWS_WITH(list.set("gear", "middle"), Contains("'middle'") && Contains("low, high"));
  CHECK_THROWS_WITH(list.set("gear", 1), Contains("parameter 'gear'"));
  CHECK_THROWS_WITH(list.set("length", 0), Contains("0 m is not above 0"));
  CHECK_THROWS_WITH(list.set("length", -1.0), Contains("negative"));
  for (const double value : {infinity, -infinity, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(list.set("speed", value), Contains("'speed': it is not finite"));
  CHECK(list.listValues() == listOptions(Machine()).listValues());  // nothing was set
  Machine machine;
  machine.teeth = 3;
  CHECK_THROWS_WITH(listOptions(machine).check(), Contains("option 'teeth'"));
  CHECK_NOTHROW(list.check());
}

TEST_CASE("options: text reads as the value that it was written from") {
  const std::vector<OptionValue> values = {true, false, 0, -7, 0.1, 1.0 / 3, 1e-300, -2.5e17, std::string("left")};
  for (const OptionValue& value : values) CHECK(parseOption(formatOption(value)) == value);
  CHECK(formatOption(0.1) == "0.1");
  CHECK(parseOption("2") == OptionValue(2));
  CHECK(parseOption("2.5x") == OptionValue(std::string("2.5x")));
}
