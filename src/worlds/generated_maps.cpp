#include "worlds/generated_maps.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "formats/process.h"
#include "formats/text_file.h"
#include "model/listing.h"

namespace bielle::worlds {
namespace {

namespace fs = std::filesystem;

constexpr int kPostures = 500;                      // at which the generator measures errors
constexpr size_t kMostJoints = 6;                   // of a linkage
constexpr double kBeyond = 0.2;                     // of what is planned, rad or m
constexpr int kMapClamped = 1, kMapNotReached = 3;  // statuses of the code

// What firmware does with the maps of a linkage every millisecond, as the README of the generated code shows it.
struct MapFunctions {
  size_t bytes;  // of what they keep
  void (*start)(void*);
  int (*measure)(void*, int takes_ratio, const double* motor, const double* motor_velocity, double* joint,
                 double* joint_velocity);
  int (*lead)(void*, int takes_ratio, const double* joint, const double* joint_velocity, double* motor,
              double* motor_velocity);
  void (*give)(const void*, const double* joint_torque, double* motor_torque);
};

constexpr const char* kUse = R"(
typedef struct {
  NAME_posture at;
  NAME_ratio taken;
} use_NAME;

static void start_NAME(void *memory) {
  use_NAME *use = memory;
  NAME_reference(&use->at);
  NAME_update_ratio(&use->at, &use->taken);
}

static int measure_NAME(void *memory, int takes_ratio, const double *motor, const double *motor_velocity, double *joint,
                        double *joint_velocity) {
  use_NAME *use = memory;
  NAME_ratio ratio;
  NAME_status status = NAME_motor_to_joint(motor, &use->at, &use->at);
  if (status == NAME_NOT_REACHED) status = NAME_motor_to_joint(motor, NULL, &use->at); /* the guess was far away */
  NAME_update_ratio(&use->at, &ratio);
  NAME_joint_velocity(&ratio, motor_velocity, joint_velocity);
  memcpy(joint, use->at.joint, sizeof use->at.joint);
  if (takes_ratio) use->taken = ratio;
  return (int)status;
}

static int lead_NAME(void *memory, int takes_ratio, const double *joint, const double *joint_velocity, double *motor,
                     double *motor_velocity) {
  use_NAME *use = memory;
  NAME_ratio ratio;
  NAME_status status = NAME_joint_to_motor(joint, &use->at, &use->at);
  if (status == NAME_NOT_REACHED) status = NAME_joint_to_motor(joint, NULL, &use->at);
  NAME_update_ratio(&use->at, &ratio);
  NAME_motor_velocity(&ratio, joint_velocity, motor_velocity);
  memcpy(motor, use->at.motor, sizeof use->at.motor);
  if (takes_ratio) use->taken = ratio;
  return (int)status;
}

static void give_NAME(const void *memory, const double *joint_torque, double *motor_torque) {
  const use_NAME *use = memory;
  NAME_motor_torque(&use->taken, joint_torque, NULL, motor_torque);
}
)";

constexpr const char* kTable = R"(
const struct {
  size_t bytes;
  void (*start)(void *);
  int (*measure)(void *, int, const double *, const double *, double *, double *);
  int (*lead)(void *, int, const double *, const double *, double *, double *);
  void (*give)(const void *, const double *, double *);
} bielle_maps[] = {
)";

std::string writeUse(const std::vector<FirmwareLinkage>& linkages) {
  std::string out = "#include <stddef.h>\n#include <string.h>\n", table = kTable;
  for (const FirmwareLinkage& linkage : linkages) {
    std::string text = kUse;
    for (size_t at = 0; (at = text.find("NAME", at)) != std::string::npos; at += linkage.name.size())
      text.replace(at, 4, linkage.name);
    out += "\n#include \"" + linkage.name + ".h\"\n" + text;
    const std::string end = "_" + linkage.name;
    table += "  {sizeof(use" + end + "), start" + end + ", measure" + end + ", lead" + end + ", give" + end + "},\n";
  }
  return out + table + "};\n";
}

struct TemporaryDirectory {
  TemporaryDirectory() {
    std::string pattern = (fs::temp_directory_path() / "bielle_maps_XXXXXX").string();
    if (!mkdtemp(pattern.data()))
      throw InputError(pattern, "--maps generated", "there can be no directory for them",
                       "make room there, or name another place by the environment variable TMPDIR");
    path = pattern;
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path path;
};

// $CC, which may have options, or cc.
std::vector<std::string> findCompiler() {
  const char* variable = std::getenv("CC");
  std::istringstream words(variable ? variable : "");
  std::vector<std::string> compiler;
  for (std::string word; words >> word;) compiler.push_back(word);
  if (compiler.empty()) compiler = {"cc"};
  const std::string& program = compiler.front();
  if (program.find('/') == std::string::npos ? !isOnPath(program) : !fs::exists(program))
    throw InputError("", "--maps generated", "the maps are C, and there is no compiler '" + program + "'",
                     "install one, or name it by the environment variable CC; or give --maps library");
  return compiler;
}

// Ranges that contain what is planned, and of each linkage so much more.
std::map<std::string, std::pair<double, double>> listRanges(const Model& closed, const SerialModel& serial,
                                                            const std::vector<VectorXd>& planned,
                                                            const std::vector<double>& beyond) {
  std::map<std::string, std::pair<double, double>> ranges;
  for (size_t i = 0; i < beyond.size(); ++i)
    for (const std::string& name : serial.replacements[i].joints) {
      const Joint& joint = closed.joints()[static_cast<size_t>(closed.findJoint(name))];
      const int entry = serial.model.joints()[static_cast<size_t>(serial.model.findJoint(name))].idx_q;
      double low = serial.q_reference[joint.idx_q], high = low;
      for (const VectorXd& q : planned) low = std::min(low, q[entry]), high = std::max(high, q[entry]);
      ranges[name] = {std::max(low - beyond[i], closed.lowerLimits()[joint.idx_v]),
                      std::min(high + beyond[i], closed.upperLimits()[joint.idx_v])};
    }
  return ranges;
}

// The linkage of the joint that an error is about.
size_t findLinkage(const SerialModel& serial, const InputError& error) {
  for (size_t i = 0; i < serial.replacements.size(); ++i)
    for (const std::string& joint : serial.replacements[i].joints)
      if (error.element() == "joint '" + joint + "'") return i;
  return serial.replacements.size();
}

void requireMaps(const Model& closed, const SerialModel& serial, const FirmwareText& text) {
  std::set<std::string> mapped;
  for (const FirmwareLinkage& linkage : text.linkages) mapped.insert(linkage.joints.begin(), linkage.joints.end());
  for (const SerialModel::Replacement& replacement : serial.replacements)
    for (const std::string& joint : replacement.joints)
      if (!mapped.count(joint))
        throw InputError(closed.name(), "joint '" + joint + "'",
                         "its linkage has no generated maps" +
                             (text.warnings.empty() ? std::string() : " (" + listItems(text.warnings) + ")"),
                         "give --maps library");
}

}  // namespace

void requireCompiler() { findCompiler(); }

FirmwareText formatMaps(const Model& closed, const SerialModel& serial, const std::vector<VectorXd>& planned) {
  FirmwareOptions options;
  options.postures = kPostures;
  std::vector<double> beyond(serial.replacements.size(), kBeyond);
  while (true) {
    options.ranges = listRanges(closed, serial, planned, beyond);
    try {
      return formatFirmware(closed, serial.q_reference, options);
    } catch (const InputError& error) {  // whose remedies are options of another command
      const size_t linkage = findLinkage(serial, error);
      if (linkage == beyond.size() || beyond[linkage] < kBeyond / 8)
        throw InputError(error.source(), error.element(), "there are no generated maps: " + error.problem(),
                         "plan a motion away from it, or change the robot's file; or give --maps library");
      beyond[linkage] /= 2;
    }
  }
}

// The shared object in memory.
class GeneratedMaps::Code {
 public:
  explicit Code(const FirmwareText& text) {
    const TemporaryDirectory directory;
    std::vector<std::string> command = findCompiler();
    const std::string object = (directory.path / "maps.so").string();
    for (const char* option : {"-std=c99", "-O2", "-shared", "-fPIC", "-o"}) command.emplace_back(option);
    command.push_back(object);
    for (const auto& [name, content] : text.files) writeTextFile((directory.path / name).string(), content);
    for (const FirmwareLinkage& linkage : text.linkages)
      command.push_back((directory.path / (linkage.name + ".c")).string());
    command.push_back((directory.path / "use.c").string());
    writeTextFile(command.back(), writeUse(text.linkages));
    command.emplace_back("-lm");
    if (const int status = waitForProcess(startProcess(command)); status != 0)
      throw InputError("", "--maps generated",
                       "the compiler '" + command.front() + "' failed, with status " + std::to_string(status),
                       "see its message above; the environment variable CC names another one");
    handle_ = dlopen(object.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle_)
      throw InputError(object, "--maps generated", std::string("it cannot be loaded: ") + dlerror(),
                       "name a place from which programs may run by the environment variable TMPDIR");
    functions_ = static_cast<const MapFunctions*>(dlsym(handle_, "bielle_maps"));
  }
  ~Code() { dlclose(handle_); }
  Code(const Code&) = delete;
  Code& operator=(const Code&) = delete;

  const MapFunctions& operator[](size_t i) const { return functions_[i]; }

 private:
  void* handle_ = nullptr;
  const MapFunctions* functions_ = nullptr;
};

GeneratedMaps::GeneratedMaps(const Model& closed, const SerialModel& serial, Belief belief, const FirmwareText& text)
    : takes_ratio_(belief == Belief::Serial) {
  requireMaps(closed, serial, text);
  code_ = std::make_shared<const Code>(text);
  std::set<int> mapped;
  for (const FirmwareLinkage& linkage : text.linkages) {
    Map map;
    map.function = maps_.size();
    if (std::max(linkage.motors.size(), linkage.joints.size()) > kMostJoints)
      throw InputError(closed.name(), "linkage '" + linkage.name + "'",
                       "it has more than " + std::to_string(kMostJoints) + " motors or joints", "give --maps library");
    for (const std::string& name : linkage.motors) {
      map.motors.push_back(closed.findMotor(name));
      const Motor& motor = closed.motors()[static_cast<size_t>(map.motors.back())];
      map.motor_positions.push_back(closed.joints()[static_cast<size_t>(motor.joint)].idx_q);
      map.motor_dofs.push_back(motor.dof);
      mapped.insert(map.motors.back());
    }
    for (const std::string& name : linkage.joints) {
      map.joints.push_back(serial.model.findMotor(name));
      const Motor& motor = serial.model.motors()[static_cast<size_t>(map.joints.back())];
      map.joint_positions.push_back(serial.model.joints()[static_cast<size_t>(motor.joint)].idx_q);
      map.joint_dofs.push_back(motor.dof);
    }
    const MapFunctions& code = (*code_)[map.function];
    map.state.resize((code.bytes + sizeof(double) - 1) / sizeof(double));
    code.start(map.state.data());
    maps_.push_back(std::move(map));
  }
  for (int m = 0; m < closed.nu(); ++m)
    if (!mapped.count(m)) direct_.emplace_back(m, serial.model.findMotor(closed.motors()[static_cast<size_t>(m)].name));
}

void GeneratedMaps::measure(ConstVectorRef q, ConstVectorRef v, VectorRef q_s, VectorRef v_s) {
  for (Map& map : maps_) {
    double motor[kMostJoints], motor_velocity[kMostJoints], joint[kMostJoints], joint_velocity[kMostJoints];
    for (size_t i = 0; i < map.motors.size(); ++i) {
      motor[i] = q[map.motor_positions[i]];
      motor_velocity[i] = v[map.motor_dofs[i]];
    }
    const int status =
        (*code_)[map.function].measure(map.state.data(), takes_ratio_, motor, motor_velocity, joint, joint_velocity);
    ++counts_.measured;
    counts_.clamped += status == kMapClamped;
    counts_.not_reached += status == kMapNotReached;
    for (size_t i = 0; i < map.joints.size(); ++i) {
      double& found = q_s[map.joint_positions[i]];
      counts_.largest_difference = std::max(counts_.largest_difference, std::abs(joint[i] - found));
      found = joint[i];
      v_s[map.joint_dofs[i]] = joint_velocity[i];
    }
  }
}

void GeneratedMaps::lead(ConstVectorRef q_s, ConstVectorRef v_s, VectorRef q, VectorRef v) {
  for (Map& map : maps_) {
    double motor[kMostJoints], motor_velocity[kMostJoints], joint[kMostJoints], joint_velocity[kMostJoints];
    for (size_t i = 0; i < map.joints.size(); ++i) {
      joint[i] = q_s[map.joint_positions[i]];
      joint_velocity[i] = v_s[map.joint_dofs[i]];
    }
    (*code_)[map.function].lead(map.state.data(), takes_ratio_, joint, joint_velocity, motor, motor_velocity);
    for (size_t i = 0; i < map.motors.size(); ++i) {
      q[map.motor_positions[i]] = motor[i];
      v[map.motor_dofs[i]] = motor_velocity[i];
    }
  }
}

void GeneratedMaps::calcTorques(ConstVectorRef tau, VectorRef u) const {
  for (const auto& [motor, serial] : direct_) u[motor] = tau[serial];
  for (const Map& map : maps_) {
    double joint[kMostJoints], motor[kMostJoints];
    for (size_t i = 0; i < map.joints.size(); ++i) joint[i] = tau[map.joints[i]];
    (*code_)[map.function].give(map.state.data(), joint, motor);
    for (size_t i = 0; i < map.motors.size(); ++i) u[map.motors[i]] = motor[i];
  }
}

}  // namespace bielle::worlds
