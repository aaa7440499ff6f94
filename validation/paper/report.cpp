#include "paper/report.h"

#include <cmath>
#include <functional>
#include <sstream>

#include "formats/text_file.h"
#include "model/number_text.h"
#include "paper/figures.h"
#include "tasks/cells.h"

namespace bielle::paper {

using tasks::formatCell;
using tasks::quoteCsv;

namespace {

// Measures of a motion that ends early are in parentheses.
std::string formatUntil(const Performance& motion, double value, int digits) {
  const std::string cell = formatCell(value, digits);
  return std::isfinite(value) && !motion.success ? "(" + cell + ")" : cell;
}

std::string escapeMarkdown(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? "\\|" : std::string(1, c);
  return escaped;
}

// One line per value and model.
std::string formatCsv(const StudyResult& result) {
  std::ostringstream csv;
  csv << result.study.parameter
      << ",model,outcome,knee_peak_Nm,knee_mean_Nm,ankle_peak_Nm,ankle_mean_Nm,com_mean_m,com_speed_mps,com_lowest_m,"
         "com_highest_m,knee_least_rad,knee_most_rad,window_start_s,window_end_s,iterations,solver_s,lift_margin,"
         "lift_until_s,message\n";
  for (const Comparison& entry : result.comparisons)
    for (const auto& [model, motion] : {std::pair{kClosed, &entry.closed},
                                        {kSerial, &entry.serial},
                                        {kLifted, &entry.lifted},
                                        {kStepped, &entry.stepped}}) {
      const bool lifted = motion == &entry.lifted || motion == &entry.stepped;
      const auto& record = motion->record;
      csv << formatExact(entry.value) << "," << model << "," << quoteCsv(motion->outcome);
      for (const double number :
           {motion->knee.peak, motion->knee.mean, motion->ankle.peak, motion->ankle.mean, motion->com_mean,
            motion->com_speed, motion->com_lowest, motion->com_highest, motion->knee_least, motion->knee_most,
            record ? record->time[motion->first_node] : kMissing, record ? record->time[motion->last_node] : kMissing,
            record && !lifted ? motion->iterations : kMissing, lifted ? kMissing : motion->seconds,
            lifted ? motion->lift.margin : kMissing, lifted ? motion->lift.until : kMissing})
        csv << "," << formatExact(number);
      csv << "," << (lifted && !motion->lift.message.empty() ? quoteCsv(motion->lift.message) : "") << "\n";
    }
  return csv.str();
}

std::string formatRatioCsv(const StudyResult& result) {
  std::string csv = "joint,angle_rad,ratio\n";
  for (size_t i = 0; i < result.ratio.angle.size(); ++i)
    csv +=
        result.ratio.joint + "," + formatExact(result.ratio.angle[i]) + "," + formatExact(result.ratio.ratio[i]) + "\n";
  return csv;
}

void printClaims(std::ostream& page, const std::vector<Claim>& claims) {
  page << "| the paper | says | found | |\n|---|---|---|---|\n";
  for (const Claim& claim : claims)
    page << "| " << claim.section << " | " << escapeMarkdown(claim.text) << " | " << escapeMarkdown(claim.found)
         << " | " << getName(claim.verdict) << " |\n";
  page << "\n";
}

// Rows are values; columns define what is printed of each.
void printNumbers(std::ostream& page, const StudyResult& result) {
  struct Column {
    std::string header;
    std::function<std::string(const Comparison&)> format;
  };
  const auto torque = [](const char* header, const Performance Comparison::*model, const Load Performance::*load,
                         const double Load::*number) {
    return Column{header, [=](const Comparison& e) { return formatUntil(e.*model, (e.*model.*load).*number, 1); }};
  };
  const auto angles = [](const char* header, const Performance Comparison::*model) {
    return Column{header, [=](const Comparison& e) {
                    return formatCell((e.*model).knee_least, 3) + " to " + formatCell((e.*model).knee_most, 3);
                  }};
  };
  const std::vector<Column> columns = {
      {result.study.label, [](const Comparison& e) { return formatExact(e.value); }},
      {"closed", [](const Comparison& e) { return e.closed.outcome; }},
      {"serial", [](const Comparison& e) { return e.serial.outcome; }},
      {"lift", [](const Comparison& e) { return e.lifted.outcome; }},
      {"step by step", [](const Comparison& e) { return e.stepped.outcome; }},
      torque("knee peak [N m], closed", &Comparison::closed, &Performance::knee, &Load::peak),
      torque("lifted", &Comparison::lifted, &Performance::knee, &Load::peak),
      torque("knee mean [N m], closed", &Comparison::closed, &Performance::knee, &Load::mean),
      torque("lifted", &Comparison::lifted, &Performance::knee, &Load::mean),
      torque("ankle peak [N m], closed", &Comparison::closed, &Performance::ankle, &Load::peak),
      torque("lifted", &Comparison::lifted, &Performance::ankle, &Load::peak),
      {"CoM mean [m], closed", [](const Comparison& e) { return formatCell(e.closed.com_mean, 4); }},
      {"lifted", [](const Comparison& e) { return formatUntil(e.lifted, e.lifted.com_mean, 4); }},
      {"CoM speed [m/s], closed", [](const Comparison& e) { return formatUntil(e.closed, e.closed.com_speed, 3); }},
      {"lifted", [](const Comparison& e) { return formatUntil(e.lifted, e.lifted.com_speed, 3); }},
      {"CoM lowest to highest [m], closed",
       [](const Comparison& e) {
         return formatCell(e.closed.com_lowest, 3) + " to " + formatCell(e.closed.com_highest, 3);
       }},
      angles("knee angle [rad], closed", &Comparison::closed),
      angles("serial", &Comparison::serial),
      {"least margin of the lift", [](const Comparison& e) { return formatCell(e.lifted.lift.margin, 4); }},
      {"why it ended", [](const Comparison& e) {
         return e.lifted.lift.message.empty()
                    ? ""
                    : "at " + formatCell(e.lifted.lift.until, 2) + " s: " + e.lifted.lift.message;
       }}};
  std::string rule = "|";
  page << "|";
  for (const Column& column : columns) {
    page << " " << column.header << " |";
    rule += "---|";
  }
  page << "\n" << rule << "\n";
  for (const Comparison& entry : result.comparisons) {
    page << "|";
    for (const Column& column : columns) page << " " << escapeMarkdown(column.format(entry)) << " |";
    page << "\n";
  }
  page << "\n";
}

}  // namespace

StudyPage writeStudy(const std::string& directory, const StudyResult& result, const ComparedRobot& robot) {
  StudyPage page;
  const std::string base = directory + "/" + result.study.name;
  const bool comparison = !result.study.motion.empty();
  page.files.push_back(base + ".csv");
  writeTextFile(page.files.back(), comparison ? formatCsv(result) : formatRatioCsv(result));
  std::ostringstream text;
  text << "## " << result.study.title << " (" << result.study.section << ")\n\n";
  printClaims(text, judgeClaims(result, robot.robot.model));
  for (const Figure& figure : makeFigures(result, robot)) {
    const std::string file = figure.name + ".svg";
    if (drawPlots(directory + "/" + file, figure.plots)) {
      page.files.push_back(directory + "/" + file);
      text << "![" << figure.caption << "](" << file << ")\n\n" << figure.caption << ".\n\n";
    } else {
      page.notes.push_back(file + ": not drawn: gnuplot is not installed (package gnuplot-nox)");
      text << "(" << page.notes.back() << ")\n\n";
    }
  }
  if (comparison) printNumbers(text, result);
  page.text = text.str();
  page.files.push_back(base + ".md");
  writeTextFile(page.files.back(), page.text);
  return page;
}

std::string writeReport(const std::string& directory, const std::string& robot, const std::string& command,
                        const std::vector<StudyPage>& pages) {
  std::ostringstream text;
  text
      << "# The paper's comparison, reproduced\n\n"
      << "*Optimal Control of Walkers with Parallel Actuation* compares motions made with a closed-chain model against "
         "motions made with an approximate serial model and lifted back. Here both are made for "
      << robot << ", with the same costs for both models, and compared with the paper's statements.\n\n"
      << "    " << command << "\n\n"
      << "*Closed*: the closed model's own motion. *Serial*: the serial model's, its torques on the joints. *Lifted*: "
         "motor torques that make the closed model follow the serial motion. Torques are absolute values over both "
         "legs, of walks over the steady steps. `agrees`, `partly`, `differs` follow from the numbers by the rule in "
         "the row; `open`: no numbers. Numbers in parentheses belong to a motion that did not converge, or to the part "
         "lifted before the lift failed.\n\n";
  for (const StudyPage& page : pages) text << page.text;
  const std::string path = directory + "/report.md";
  writeTextFile(path, text.str());
  return path;
}

}  // namespace bielle::paper
