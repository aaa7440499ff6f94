#include "bielle/firmware/firmware.h"

#include "bielle/model/error.h"
#include "firmware/languages.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

using namespace firmware;

std::string writeReadme(const std::vector<Maps>& all, const FirmwareOptions& options) {
  const bool is_torch = options.language == FirmwareLanguage::Torch,
             is_python = is_torch || options.language == FirmwareLanguage::NumPy,
             is_cpp = options.language == FirmwareLanguage::Cpp || options.language == FirmwareLanguage::Ros2Control;
  const std::string name = all.front().name, prefix = is_cpp ? name + "::" : name + "_";
  const std::string type = is_cpp ? "Posture" : "posture", ratio = is_cpp ? "Ratio" : "ratio",
                    real = options.is_single ? "float" : "double", size = std::to_string(all.front().size());
  std::string out = "# Linkages of " + all.front().robot + "\n\nWritten by `bielle convert`. ";
  if (is_python) {
    out += "One module a linkage, which needs " +
           std::string(
               is_torch ? "PyTorch alone; all functions take tensors of postures, are differentiable, and compute in "
                          "float64, on the device given to `to()`"
                        : "NumPy alone; all functions take arrays of postures") +
           ".\n\n```python\nimport " + name +
           " as linkage\nmotors, reached = linkage.joint_to_motor(joints)             # (N, " + size +
           ")\ntorques = linkage.motor_torque(joints, joint_torques)        # by virtual work\n```\n";
  } else {
    const std::string compile = is_cpp ? "c++ -std=c++11" : "cc -std=c99", end = is_cpp ? ".cpp" : ".c";
    out += "Each linkage is a header and a source of " + std::string(is_cpp ? "C++11" : "C99") + " in `" + real +
           "`, which need `math.h` alone: no allocation, no recursion, no state, loops of fixed length. Functions may "
           "be called from "
           "several threads and interrupts at once.\n\n```c\n#include \"" +
           name + (is_cpp ? ".hpp" : ".h") + "\"\n\n" + prefix + type + " at;\n" + prefix +
           "reference(&at); /* once: the guess of the first call */\n\n/* every millisecond */\n" + prefix + ratio +
           " ratio;\n" + real + " joint_velocity[" + size + "], motor_torque[" + size + "];\nif (" + prefix +
           "motor_to_joint(measured, &at, &at) == " + prefix + "NOT_REACHED) stop();\n" + prefix +
           "update_ratio(&at, &ratio);\n" + prefix + "joint_velocity(&ratio, motor_velocity, joint_velocity);\n" +
           prefix + "motor_torque(&ratio, wanted_joint_torque, NULL, motor_torque);\n```\n\n`" + compile + " -O2 " +
           name + end + " " + name + "_test" + end +
           " -lm && ./a.out` compares it with postures of the mechanism with all its bodies and closures." +
           (options.is_single
                ? " All processors get the same bits, since a pragma keeps compilers from fusing multiplications and "
                  "additions; `-ffast-math` and Clang's `-ffp-contract=fast` overrule it."
                : "") +
           "\n\nPositions "
           "are rad (m of "
           "slides), counted as in the robot's file. What is out of range is clamped, and the status says so; a value "
           "that is no "
           "number is taken for the lower end of the range. A status `NOT_REACHED` leaves a posture of the range, "
           "never a NaN.\n";
  }
  for (const Maps& maps : all) {
    out += "\n## " + maps.name + "\n\n";
    for (const std::string& line : describe(maps, options.is_single)) out += "- " + line + "\n";
  }
  return out;
}

}  // namespace

FirmwareText formatFirmware(const Model& model, ConstVectorRef q, const FirmwareOptions& options) {
  FirmwareText out;
  for (const LinkageLeftOut& left : listLinkagesLeftOut(model, q))
    if (left.has_motors) out.warnings.push_back("linkage of '" + left.name + "': " + left.why + "; it is left out");
  std::vector<Maps> all;
  std::vector<std::string> names;
  for (const Linkage& linkage : listLinkages(model, q)) {
    if (static_cast<int>(linkage.joints.size()) != linkage.size()) {
      out.warnings.push_back("linkage of '" + linkage.output + "': it has " + std::to_string(linkage.size()) +
                             " motor(s) and " + std::to_string(linkage.joints.size()) +
                             " of the `serial_joints`; it is left out");
      continue;
    }
    const std::optional<Maps> maps = makeMaps(model, linkage, q, options);
    if (!maps) {
      out.warnings.push_back("linkage of '" + linkage.output +
                             "': its springs let it move while motors and joints stand; it is left out");
      continue;
    }
    all.push_back(*maps);
    names.insert(names.end(), linkage.joint_names.begin(), linkage.joint_names.end());
  }
  if (all.empty())
    throw InputError(
        model.name(), "linkages",
        "none has motors that move as many serial joints" +
            (out.warnings.empty() ? std::string() : " (" + out.warnings.front() + ")"),
        "list as many of its joints with one coordinate under `serial_joints` as it has motors, in the robot's YAML "
        "file; a file of MuJoCo gets one, with the key `model: FILE`");
  for (const auto& [joint, range] : options.ranges)
    if (!contains(names, joint))
      throw InputError(model.name(), "--range " + joint, "it is no serial joint of a linkage",
                       "name one of: " + listItems(names));
  for (const Maps& maps : all) {
    const bool is_torch = options.language == FirmwareLanguage::Torch;
    const auto files = is_torch || options.language == FirmwareLanguage::NumPy
                           ? writePython(maps, is_torch)
                           : writeC(maps, options.is_single, options.language != FirmwareLanguage::C);
    out.files.insert(files.begin(), files.end());
    out.linkages.push_back({maps.name, maps.joint_names, maps.motor_names});
  }
  std::string readme = writeReadme(all, options);
  if (options.language == FirmwareLanguage::Ros2Control) out.files.merge(writeRos2(all, readme));
  out.files.emplace("README.md", readme);
  return out;
}

}  // namespace bielle
