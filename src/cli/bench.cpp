// bielle bench: speed on this machine.
#include "bench/bench.h"

#include <cmath>
#include <iostream>

#include "cli/commands.h"
#include "cli/table.h"
#include "results/option_flags.h"
#include "solve/fddp_checks.h"

namespace bielle::cli {
namespace {

double round3(double value) {  // three significant digits, the precision of a measurement
  if (value == 0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10, 2 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

// A time per node, under two names: microseconds and units.
void addTime(Json& json, const std::string& name, double seconds, double unit) {
  json[name + " [us]"] = round3(1e6 * seconds);
  json[name + " [units]"] = round3(seconds / unit);
}

Json describeNodes(const BenchReport& report) {
  Json list = Json::array();
  for (const NodeTimes& t : report.nodes) {
    const auto add = [&](const char* work, double seconds) {
      Json json = {{"formulation", getName(t.formulation)}, {"tangent size", t.tangent_size}, {"work", work}};
      addTime(json, "time", seconds, report.unit);
      list.push_back(json);
    };
    add("dynamics (step)", t.dynamics);
    add("dynamics with derivatives", t.derivatives);
    add("linearize (with costs)", t.linearize);
    add("sweep", t.sweep);
    add("rollout", t.rollout);
  }
  return list;
}

Json describeIterations(const BenchReport& report) {
  Json list = Json::array();
  double single = 0;
  for (const IterationTimes& t : report.iterations) {
    if (t.threads == 1) single = t.seconds;
    Json json = {{"formulation", getName(t.formulation)}, {"threads", t.threads}};
    addTime(json, "time", t.seconds, report.unit);
    json["ratio to 1 thread"] = round3(single / t.seconds);
    json["rollouts"] = round3(t.rollouts);
    json["linearize [%]"] = round3(100 * t.linearize);
    json["sweep [%]"] = round3(100 * t.sweep);
    json["rollout [%]"] = round3(100 * t.rollout);
    list.push_back(json);
  }
  return list;
}

Json describeSolves(const BenchReport& report) {
  Json list = Json::array();
  for (const SolveTime& t : report.solves)
    list.push_back({{"motion", t.motion},
                    {"formulation", getName(t.formulation)},
                    {"threads", t.threads},
                    {"time [s]", round3(t.seconds)},
                    {"iterations", t.iterations},
                    {"converged", t.converged}});
  return list;
}

Json describeReceding(const BenchReport& report) {
  Json list = Json::array();
  for (const RecedingHorizon& t : report.receding)
    list.push_back({{"formulation", getName(t.formulation)},
                    {"wrench cones", t.cones},
                    {"threads", t.threads},
                    {"shifts", t.all.shifts},
                    {"median [ms]", round3(1e3 * t.all.median)},
                    {"99 % [ms]", round3(1e3 * t.all.percentile_99)},
                    {"worst [ms]", round3(1e3 * t.all.worst)},
                    {"undisturbed", t.undisturbed.shifts},
                    {"undisturbed 99 % [ms]", round3(1e3 * t.undisturbed.percentile_99)},
                    {"undisturbed worst [ms]", round3(1e3 * t.undisturbed.worst)},
                    {"rate [Hz]", round3(1 / t.all.median)},
                    {"violation", round3(t.violation)},
                    {"least height", round3(t.least_height)},
                    {"largest tilt [rad]", round3(t.largest_tilt)},
                    {"up", t.up}});
  return list;
}

Json describeSizes(const BenchReport& report, const std::vector<SizeTime>& times, const char* size, bool per_size) {
  Json list = Json::array();
  for (const SizeTime& t : times) {
    Json json = {{"formulation", getName(t.formulation)}, {size, t.size}};
    addTime(json, "time", t.seconds, report.unit);
    if (per_size) json["time / size [us]"] = round3(1e6 * t.seconds / t.size);
    list.push_back(json);
  }
  return list;
}

Json describeWorlds(const BenchReport& report) {
  Json list = Json::array();
  double single = 0;
  for (const BatchTime& t : report.batch) {
    if (t.threads == 1) single = t.rate;
    list.push_back({{"robots", getName(t.motion)},
                    {"step [ms]", 1e3 * t.time_step},
                    {"threads", t.threads},
                    {"steps [1/s]", round3(t.rate)},
                    {"ratio to 1 thread", round3(t.rate / single)},
                    {"real time", round3(t.rate * t.time_step)},
                    {"rounds of Newton", round3(t.rounds)},
                    {"broke off", t.broken},
                    {"deviation", round3(t.deviation)}});
  }
  return list;
}

Json describeBatch(const BenchReport& report) {
  return {{"robot", report.robot},
          {"processor", report.processor},
          {"compiler", report.compiler},
          {"flags", report.flags},
          {"unit [us]", round3(1e6 * report.unit)},
          {"worlds", kBatchWorlds},
          {"many worlds at once", describeWorlds(report)}};
}

Json describe(const BenchReport& report) {
  return {{"robot", report.robot},
          {"processor", report.processor},
          {"compiler", report.compiler},
          {"flags", report.flags},
          {"unit [us]", round3(1e6 * report.unit)},
          {"walk, per node", describeNodes(report)},
          {"walk, FDDP iteration per node", describeIterations(report)},
          {"cold start to converged", describeSolves(report)},
          {"receding horizon", describeReceding(report)},
          {"chains of four-bars, per node", describeSizes(report, report.chains, "four-bars", true)},
          {"horizons, per node", describeSizes(report, report.horizons, "nodes", false)}};
}

void printReport(const Json& json) {
  std::vector<Row> head;
  for (const auto& [key, item] : json.items())
    if (!item.is_array()) head.push_back({key, item.is_string() ? item.get<std::string>() : item.dump()});
  printTable(std::cout, head, "");
  for (const auto& [key, item] : json.items()) {
    if (!item.is_array()) continue;
    std::vector<std::string> columns;
    for (const auto& column : item.front().items()) columns.push_back(column.key());
    std::cout << "\n" << key << "\n";
    printTable(std::cout, item, columns);
  }
}

struct BenchArguments {
  RobotArgument robot;
  BenchOptions options;
  bool as_json = false, quick = false, batch = false;
};

void describe(OptionFields& f, BenchArguments& a) {
  f.integer("threads", a.options.threads, {1, kMostThreads}, "number of threads to compare with one");
  f.integer("shifts", a.options.shifts, {1, 10000000},
            "shifts of the receding horizon; the full formulation makes a thirtieth of them");
  f.flag("batch", a.batch,
         "instead of solving: steps of 64 robots in worlds of their own, on one thread and on --threads");
  f.flag("quick", a.quick, "small sizes, measured once, to see that everything works");
  f.flag("json", a.as_json, "print JSON");
}

}  // namespace

void addBench(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<BenchArguments>();
  arguments->robot.name = "bipetto";
  command.add_option("--robot", arguments->robot.name, std::string(kRobotHelp) + " of a robot with two feet")
      ->capture_default_str();
  addFlags(*arguments, command);
  addVerbose(command);
  command.footer(
      "A unit is one product of two 108 x 108 matrices by Eigen, on one thread, in the same run. Times are the\n"
      "least of several repetitions. Whole solves run once. The receding horizon reports the median, 99th percentile\n"
      "and worst of its shifts, and the same of the undisturbed shifts, during which no other program took the\n"
      "processor. --batch reports the fastest of five runs; rounds of Newton are those of a register of robots, per\n"
      "step, the deviation is that of the farthest coordinate from the plan, or from where it began, rad or m.\n"
      "Progress is reported on the standard error. Takes a few minutes.\n"
      "Examples:\n"
      "  bielle bench\n"
      "  bielle bench --threads 4 --json > bench.json");
  command.callback([&action, arguments] {
    action = [=] {
      const LoadedRobot robot = arguments->robot.load();
      BenchOptions& options = arguments->options;
      if (arguments->quick) options.extent = BenchExtent::Quick;
      options.progress = [](const std::string& what) { std::cerr << "bielle: measuring " << what << std::endl; };
      const Json json = arguments->batch ? describeBatch(runBatchBench(robot.model, options))
                                         : describe(runBench(robot.model, options));
      if (arguments->as_json)
        std::cout << formatJson(json) << "\n";
      else
        printReport(json);
      return kOk;
    };
  });
}

}  // namespace bielle::cli
