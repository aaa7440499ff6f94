#include "cli/identify_motion.h"

#include <filesystem>
#include <iostream>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "cli/commands.h"
#include "formats/text_file.h"
#include "model/number_text.h"
#include "results/interrupt.h"
#include "results/json_text.h"
#include "results/output_place.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

constexpr double kRowPeriod = 1e-3;  // s

std::string formatMotion(const Model& model, const Excitation& motion) {
  const std::vector<std::string> positions = makePositionNames(model), speeds = makeVelocityNames(model);
  std::string text = "time";
  for (const std::string& name : positions) text += "," + name;
  for (const std::string& name : speeds) text += ",v." + name;
  for (const Motor& motor : model.motors()) text += ",u." + motor.name;
  for (size_t k = 0; k < motion.states.size(); ++k) {
    const LoadedState& state = motion.states[k];
    text += "\n" + formatNumber(motion.time[static_cast<Eigen::Index>(k)], "%.6f");
    for (const VectorXd* values : {&state.q, &state.v, &state.u})
      for (const double value : *values) text += "," + formatNumber(value, "%.9g");
  }
  return text + "\n";
}

// Each torque is the mean of those at the ends of the time that it holds.
std::string formatTorques(const Model& model, const Excitation& motion) {
  std::string text = "torques:\n";
  for (size_t k = 0; k + 1 < motion.states.size(); ++k) {
    const VectorXd u = 0.5 * (motion.states[k].u + motion.states[k + 1].u);
    text += "  - {time: " + formatNumber(motion.time[static_cast<Eigen::Index>(k)], "%.6f");
    for (int m = 0; m < model.nu(); ++m)
      text += ", " + model.motors()[static_cast<size_t>(m)].name + ": " + formatNumber(u[m], "%.9g");
    text += "}\n";
  }
  return text;
}

std::string formatStart(const Model& model, const LoadedState& state) {
  Json joints = Json::object();
  for (const Joint& joint : model.joints())
    if (joint.nq == 1) joints[joint.name] = {{"q", state.q[joint.idx_q]}, {"v", state.v[joint.idx_v]}};
  return formatJson(Json{{"joints", joints}}) + "\n";
}

}  // namespace

int findMotion(const Model& model, ConstVectorRef q, const IdentifyChoice& choice,
               const std::vector<LoadNumber>& numbers, double duration, double window, int iterations,
               const std::string& robot, const std::string& directory) {
  std::vector<MeasuredLinkage> linkages;
  IdentifyChoice all = choice;
  all.joints.clear();
  if (!model.closures().empty())
    for (const LinkageTask& task : listTasks(model, q, all)) {
      MeasuredLinkage linkage{task.cluster, {}, task.q, {}};
      for (const LinkageSensor& sensor : task.sensors)
        if (model.findMotor(sensor.name) >= 0) linkage.sensors.push_back(sensor);
      linkages.push_back(std::move(linkage));
    }
  watchInterrupts();
  ExcitationOptions options;
  options.duration = duration;
  options.window = window, options.evaluations = iterations;
  options.progress = [](double gain) {
    std::cerr << "bielle: information " << formatNumber(gain, "%.5g") << std::endl;
    return !isInterrupted();
  };
  const Excitation motion = findExcitation(model, q, numbers, linkages, kRowPeriod, options);
  makeOutputDirectory(directory);
  const auto write = [&](const char* name, const std::string& text) {
    writeTextFile((fs::path(directory) / name).string(), text);
  };
  write("motion.csv", formatMotion(model, motion));
  write("torques.yaml", formatTorques(model, motion));
  write("start.json", formatStart(model, motion.states.front()));
  std::cout
      << "information " << formatNumber(motion.gain_before, "%.4g") << " of small motions, "
      << formatNumber(motion.gain, "%.4g") << " of this one, which takes "
      << formatNumber(motion.share_of_limits, "%.2g") << " of the limits\n  " << directory
      << "/motion.csv, for a controller that tracks it; without one, where the motion is stable:\n  bielle simulate "
      << robot << " --state " << directory << "/start.json --torques " << directory << "/torques.yaml --duration "
      << formatNumber(duration, "%g") << " --record-period 0.001 -o OUTPUT\n";
  if (isInterrupted())
    std::cerr << "bielle: error: interrupted; what is written is the best motion so far" << std::endl;
  return isInterrupted() ? kFailed : kOk;
}

}  // namespace bielle::cli
