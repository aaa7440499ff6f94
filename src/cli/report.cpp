// bielle report DIR...: the page of one or several results, and pictures and films of it.
#include "bielle/report/report.h"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "cli/film.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/option_flags.h"
#include "results/output_place.h"
#include "results/result_files.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

struct ReportArguments {
  std::vector<std::string> directories;
  std::string output, png, mp4;
  std::string size = "480x480";
  double rate = 30;
  bool ghosts = false;
  FilmOptions film;
};

// Duration of the longest motion, s.
double calcDuration(const std::vector<std::string>& directories) {
  double end = 0;
  for (const std::string& directory : directories) {
    const MotionRecord record = readResultRecord(directory);
    end = std::max(end, record.time[record.time.size() - 1]);
  }
  return end;
}

std::vector<double> makeTimes(double end, int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(count > 1 ? end * i / (count - 1) : 0);
  return times;
}

void readSize(const std::string& text, FilmOptions& film) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &film.width, &film.height, &rest) != 2 || film.width < 16 ||
      film.height < 16 || film.width > 8192 || film.height > 8192)
    throw InputError("", "--size '" + text + "'", "it is not of the form WIDTHxHEIGHT with 16 to 8192 pixels each",
                     "e.g. --size 640x480");
}

// Those of src/report/scene.js.
const std::vector<std::string> kLayers = {"locks",      "contactForces", "closureForces", "com", "traces",
                                          "footprints", "footholds",     "plan",          "push"};

void requireLayers(const std::string& option, const std::string& names) {
  std::istringstream text(names);
  for (std::string name; std::getline(text, name, ',');)
    if (!contains(kLayers, name))
      throw InputError("", option + " '" + name + "'", "there is no such layer",
                       "choose some of: " + listItems(kLayers) + "; separated by commas");
}

void requireWithin(const std::vector<double>& times, double end) {
  for (double time : times)
    if (time > end + 1e-3)  // as films round
      throw InputError("", "--times " + formatNumber(time), "the motion ends at " + formatNumber(end) + " s",
                       "give times up to it");
}

int writePages(const ReportArguments& arguments) {
  FilmOptions film = arguments.film;
  readSize(arguments.size, film);
  requireLayers("--show", film.show);
  requireLayers("--hide", film.hide);
  if (!film.times.empty()) requireWithin(film.times, calcDuration(arguments.directories));
  film.side_by_side = !arguments.ghosts;
  const auto first = fs::path(arguments.directories.front());
  const std::string page = arguments.output.empty() ? (first / "report.html").string() : arguments.output;
  for (const std::string& directory : arguments.directories)
    for (const std::string& output : {page, arguments.png, arguments.mp4})
      requireApart(output, listResultFiles(directory));
  for (const std::string& directory : arguments.directories) printWarnings(loadRobotOf(directory).warnings);
  bielle::writeReport(page, arguments.directories);
  std::cout << page << "\n";
  if (!arguments.png.empty()) {
    if (film.times.empty()) film.times = makeTimes(calcDuration(arguments.directories), 6);
    writeStrip(page, film, arguments.png);
    std::cout << arguments.png << "\n";
  }
  if (!arguments.mp4.empty()) {
    const double end = calcDuration(arguments.directories);
    film.times = makeTimes(end, 1 + static_cast<int>(std::lround(end * arguments.rate)));
    writeFilm(page, film, arguments.rate, arguments.mp4);
    std::cout << arguments.mp4 << "\n";
  }
  return kOk;
}

void describe(OptionFields& f, ReportArguments& a) {
  f.text("png", a.png, "also draw still pictures, side by side in this file; needs chromium");
  f.text("mp4", a.mp4, "also make a film in real time; needs chromium and ffmpeg");
  f.number("rate", a.rate, "1/s", {1, 240}, "frame rate of the film");
  f.text("size", a.size, "size of one picture [pixels]");
  f.text("view", a.film.view, "direction of view");
  f.flag("ghosts", a.ghosts, "show several robots in one place, not side by side");
  f.flag("see_through", a.film.see_through, "make bodies transparent");
  f.text("show", a.film.show, "layers to show (" + listItems(kLayers) + "; separated by commas)");
  f.text("hide", a.film.hide, "layers to hide");
}

void addFilmOptions(CLI::App& command, ReportArguments& arguments) {
  addFlags(arguments, command);
  command
      .add_option("--times", arguments.film.times,
                  "times of the pictures [s], separated by commas; default: six over the motion")
      ->delimiter(',')
      ->check(isNotNegative());
  command.add_option("--columns", arguments.film.columns, "pictures in a row; default: all, at most six")
      ->check(CLI::Range(1, 100));
  command.get_option("--view")->check(CLI::IsMember({"oblique", "front", "side", "top"}));
}

}  // namespace

void addReport(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<ReportArguments>();
  command.add_option("directories", arguments->directories, "results of `bielle solve`; several are compared")
      ->required();
  command.add_option("-o,--output", arguments->output, "the page; default: report.html in the first directory");
  addFilmOptions(command, *arguments);
  command.footer(
      "The page is self-contained: open it with any browser, without a network. Space plays and pauses.\n"
      "Examples:\n"
      "  bielle report squat\n"
      "  bielle report squat-closed squat-serial -o comparison.html\n"
      "  bielle report squat --png squat.png --times 0,0.5,1 --view side --show closureForces\n"
      "  bielle report squat --mp4 squat.mp4 --size 960x720");
  command.callback([&action, arguments] { action = [=] { return writePages(*arguments); }; });
}

}  // namespace bielle::cli
