// A motion in the formats of other programs, for `bielle export` and `bielle dataset`.
#include <filesystem>
#include <optional>
#include <utility>

#include "bielle/dynamics/assembly.h"
#include "bielle/results/result.h"
#include "cli/export.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/text_file.h"
#include "report/run.h"
#include "results/motion_mcap.h"
#include "results/opensim.h"
#include "results/output_place.h"
#include "results/problem_file.h"
#include "results/reference_motion.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr std::pair<const char*, ReferenceFormat> kReferences[] = {
    {"amp", ReferenceFormat::Amp}, {"beyondmimic", ReferenceFormat::BeyondMimic}, {"mjlab", ReferenceFormat::Mjlab}};

std::optional<ReferenceFormat> findReference(const std::string& format) {
  for (const auto& [name, reference] : kReferences)
    if (name == format) return reference;
  return {};
}

}  // namespace

bool isReference(const std::string& format) { return findReference(format).has_value(); }

bool isOfIsaacLab(const std::string& format) { return isReference(format) && isOfIsaacLab(*findReference(format)); }

std::string describeIsaacLab(const std::string& option) {
  return "quaternions are w, x, y, z, as Isaac Lab 2 has them; for Isaac Lab 3 (x, y, z, w) give '" + option + " 3'";
}

bool hasRobot(const std::string& format) { return isReference(format) || format == "problem"; }

namespace {

// The problem, its optimum, and the robot for Drake and MuJoCo. Returns what these lose.
std::vector<std::string> writeProblem(const ExportRequest& request, const ReportRun& run) {
  const Model& model = run.robot.model;
  const fs::path path = request.path, mjcf = request.robot;
  const fs::path urdf = fs::path(mjcf).replace_extension(".urdf"), npz = fs::path(path).replace_extension(".npz");
  requireApart(urdf.string(), {run.robot.file});
  const ProblemText text = formatProblem(model, readSummary(request.directory), run.record,
                                         {{"urdf", urdf.filename().string()}, {"mjcf", mjcf.filename().string()}});
  const UrdfText robot = formatDrake(model);
  writeTextFile(urdf.string(), robot.urdf);
  writeTextFile(mjcf.string(), formatMjcf(model, findClosedConfiguration(model).q, {}).xml);
  writeTextFile(npz.string(), text.npz);
  writeTextFile(path.string(), text.json);
  return robot.warnings;
}

// A reference for learning, and the robot.
std::vector<std::string> writeReference(const ExportRequest& request, const ReportRun& run) {
  const ReferenceFormat format = *findReference(request.format);
  const VectorXd q_ref = findClosedConfiguration(run.robot.model).q;
  MjcfOptions options;
  options.rotations = MjcfRotations::Hinges;
  const ReferenceMotion motion = makeReferenceMotion(run.robot.model, q_ref, run.record, request.rate);
  writeTextFile(request.path, formatReferenceMotion(motion, format, request.isaac_lab));
  writeTextFile(request.robot, formatMjcf(run.robot.model, q_ref, options).xml);
  return motion.warnings;
}

}  // namespace

std::vector<std::string> writeExport(const ExportRequest& request) {
  if (request.format == "mot" || request.format == "sto") {
    const MotionRecord record = readResultRecord(request.directory);
    const OpensimText table = request.format == "mot" ? formatMot(record) : formatSto(record);
    writeTextFile(request.path, table.text);
    return table.warnings;
  }
  const ReportRun run = readRun(request.directory);
  if (request.format == "mcap") {
    const MotionMcap text = formatMotionMcap(run.robot, run.record, run.plan, run.summary);
    writeTextFile(request.path, text.mcap);
    return text.warnings;
  }
  requireApart(request.robot, {run.robot.file});
  if (request.format == "problem") return writeProblem(request, run);
  return writeReference(request, run);
}

}  // namespace bielle::cli
