#include "report/run.h"

#include <filesystem>

#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/reader.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/motion.h"
#include "bielle/motion/serial_model.h"
#include "bielle/results/result.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

Json readJson(const fs::path& path) {
  Json out;
  readJsonFile(path.string(), "give a directory that `bielle solve` wrote", [&out](const Json& json) { out = json; });
  return out;
}

std::string getText(const Json& json, const char* key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
}

// \throws InputError when the record is not one of this robot
MotionRecord readRecordOf(const LoadedRobot& robot, const fs::path& path) {
  MotionRecord record = readRecord(path.string());
  const Model& model = robot.model;
  if (record.q_names != makePositionNames(model) || record.v_names != makeVelocityNames(model) ||
      record.u_names != getNames(model.motors()) || record.closure_names != getNames(model.closures()) ||
      record.contact_names != getNames(model.contacts()))
    throw InputError(path.string(), "columns", "they differ from those of the robot " + robot.path(),
                     "solve again, or restore the robot");
  return record;
}

}  // namespace

ReportRun readRun(const std::string& directory) {
  const fs::path place = directory;
  ReportRun run;
  run.directory = directory;
  run.summary = readJson(place / "summary.json");
  std::error_code error;
  if (fs::exists(place / "check.json", error)) run.check = readJson(place / "check.json");
  run.robot = loadRobotOf(directory);
  run.summary.erase("robot_file");  // pages are given away, and need no path of this machine
  const std::string model = getText(run.summary, "model");
  if (!model.empty() && parseBelief(model) == Belief::Serial)
    run.robot.model = makeSerialModel(run.robot.model, makeStandingPosture(run.robot.model)).model;
  const fs::path plan = place / "plan.npz";
  run.record = readRecordOf(run.robot, place / "trajectory.npz");
  if (run.summary.contains("outcome") && fs::exists(plan, error)) run.plan = readRecordOf(run.robot, plan);
  return run;
}

ReportRun makeStillRun(const LoadedRobot& robot, ConstVectorRef q, const std::string& motion) {
  const Model& model = robot.model;
  ReportRun run;
  run.robot = robot;
  run.summary = {{"robot", model.name()}, {"motion", motion}};
  run.record.time = VectorXd::Zero(1);
  run.record.q = q.transpose();
  run.record.v = RowMatrixXd::Zero(1, model.nv());
  run.record.u = RowMatrixXd(0, model.nu());
  run.record.closure_wrenches = RowMatrixXd(0, 6 * model.closures().size());
  run.record.contact_wrenches = RowMatrixXd(0, 6 * model.contacts().size());
  Workspace ws(model);
  updatePositions(model, ws, q);
  run.record.com = calcCom(model, ws).transpose();
  return run;
}

}  // namespace bielle
