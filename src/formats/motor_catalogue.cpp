#include "formats/motor_catalogue.h"

#include <filesystem>
#include <set>

#include "bielle/model/error.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

// With what a catalogue and a robot may say of a motor alike.
std::vector<std::string> appendDriveKeys(std::vector<std::string> keys) {
  keys.insert(keys.end(), {"ratio", "rotor_inertia", "torque_constant", "resistance", "voltage", "current",
                           "continuous_current", "efficiency", "back_efficiency", "mass"});
  return keys;
}

const YamlKeys kCatalogueKeys("motor catalogue", "", {"motors"});
const YamlKeys kTypeKeys("motor catalogue", "motors.NAME", appendDriveKeys({"source", "effort", "velocity"}));
const YamlKeys kMotorKeys("robot, part", "motors.JOINT, roles.ROLE",
                          appendDriveKeys({"type", "catalogue_type", "armature", "effort", "velocity", "torque_loss",
                                           "continuous_effort"}));

void readNumber(const YamlFields& fields, const char* key, double& value, bool may_be_infinite = false) {
  if (const YamlEntry* found = find(fields, key)) value = found->getNumber(may_be_infinite);
}

void readNumber(const YamlFields& fields, const char* key, std::optional<double>& value, bool may_be_infinite = false) {
  if (const YamlEntry* found = find(fields, key)) value = found->getNumber(may_be_infinite);
}

void readDrive(const YamlFields& fields, MotorDrive& drive) {
  readNumber(fields, "ratio", drive.ratio);
  readNumber(fields, "rotor_inertia", drive.rotor_inertia);
  readNumber(fields, "torque_constant", drive.torque_constant);
  readNumber(fields, "resistance", drive.resistance);
  readNumber(fields, "voltage", drive.voltage, true);
  readNumber(fields, "current", drive.current, true);
  readNumber(fields, "continuous_current", drive.continuous_current, true);
  readNumber(fields, "efficiency", drive.efficiency);
  readNumber(fields, "back_efficiency", drive.back_efficiency);
  readNumber(fields, "mass", drive.mass);
}

using Catalogue = std::map<std::string, MotorSpec>;

Catalogue readCatalogue(const std::string& path) {
  Catalogue catalogue;
  readYamlDocument(path, readRobotText(path), [&](const YamlEntry& root) {
    for (const auto& [name, entry] : require(root.getFields(kCatalogueKeys), "motors", root).getMap()) {
      const YamlFields fields = entry.getFields(kTypeKeys);
      require(fields, "source", entry).getText();
      MotorSpec spec;
      spec.drive.type = name;
      readDrive(fields, spec.drive);
      readNumber(fields, "effort", spec.effort);
      readNumber(fields, "velocity", spec.velocity);
      if (!(spec.drive.ratio > 0))
        entry.fail("its ratio is not positive", "give turns of the rotor per turn of its shaft");
      catalogue[name] = spec;
    }
  });
  return catalogue;
}

class Catalogues {
 public:
  Catalogues(const std::string& path, const YamlEntry* own) {
    if (own)
      for (const YamlEntry& file : own->isList() ? own->getList() : std::vector<YamlEntry>{*own})
        if (!add(fs::path(path).parent_path() / file.getText()))
          file.fail("there is no file '" + file.getText() + "'", "give its path relative to this file");
    for (const std::string& directory : getRobotDirectories()) add(fs::path(directory) / "motors.yaml");
  }

  const MotorSpec& get(const YamlEntry& type) const {
    std::set<std::string> names;
    for (const Catalogue& catalogue : catalogues_) {
      if (const auto it = catalogue.find(type.getText()); it != catalogue.end()) return it->second;
      for (const auto& entry : catalogue) names.insert(entry.first);
    }
    std::string known;
    for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
    type.fail("there is no motor '" + type.getText() + "' in a catalogue",
              known.empty() ? "name a file of motors by the key motor_catalogue" : "choose one of: " + known);
  }

 private:
  bool add(const fs::path& place) {
    std::error_code error;
    if (!fs::is_regular_file(place, error)) return false;
    catalogues_.push_back(readCatalogue(place.string()));
    return true;
  }

  std::vector<Catalogue> catalogues_;  // in the order in which they are searched
};

}  // namespace

std::vector<MotorSpec> readMotorSpecs(const YamlEntry& motors, const std::string& path, const YamlEntry* catalogues) {
  std::optional<Catalogues> known;  // read when needed
  if (catalogues) known.emplace(path, catalogues);
  std::vector<MotorSpec> specs;
  for (const auto& [joint, entry] : motors.getMap()) {
    const YamlFields fields = entry.getFields(kMotorKeys);
    MotorSpec motor;
    if (const YamlEntry* type = find(fields, "type")) {
      if (!known) known.emplace(path, catalogues);
      motor = known->get(*type);
    }
    if (const YamlEntry* name = find(fields, "catalogue_type")) {
      if (find(fields, "type")) name->fail("the motor has a `type` already", "remove one of them");
      motor.drive.type = name->getText();
    }
    motor.joint = joint;
    const double own_ratio = motor.drive.ratio;
    readDrive(fields, motor.drive);
    // Limits of the catalogue are those of its gear; another ratio means a stage behind it.
    if (motor.effort) *motor.effort *= motor.drive.ratio / own_ratio;
    if (motor.velocity) *motor.velocity *= own_ratio / motor.drive.ratio;
    readNumber(fields, "armature", motor.armature);
    readNumber(fields, "effort", motor.effort, true);
    readNumber(fields, "velocity", motor.velocity, true);
    readNumber(fields, "torque_loss", motor.torque_loss);
    readNumber(fields, "continuous_effort", motor.continuous_effort, true);
    specs.push_back(std::move(motor));
  }
  return specs;
}

std::vector<Motor> readMotorTypes(const std::vector<YamlEntry>& names, const std::string& path,
                                  const YamlEntry* catalogues) {
  const Catalogues known(path, catalogues);
  std::vector<Motor> motors;
  for (const YamlEntry& name : names) {
    const MotorSpec& spec = known.get(name);
    Motor motor;
    motor.drive = spec.drive;
    if (spec.effort) motor.effort_limit = *spec.effort;
    if (spec.velocity) motor.velocity_limit = *spec.velocity;
    motors.push_back(motor);
  }
  return motors;
}

}  // namespace bielle
