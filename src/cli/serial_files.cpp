#include "cli/serial_files.h"

#include "bielle/dynamics/assembly.h"
#include "bielle/model/error.h"
#include "model/number_text.h"
#include "motion/serial_tables.h"
#include "results/json_text.h"

namespace bielle::cli {
namespace {

// Row by row; infinite entries become null.
template <typename Matrix>
Json listByRows(const Matrix& matrix) {
  Json out = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) out.push_back(matrix(i, j));
  return out;
}

// A row a posture, of nulls where the linkage cannot follow.
template <typename Member>
Json listOver(const LinkageTable& table, Member member, int entries) {
  Json out = Json::array();
  for (const auto& posture : table.postures)
    out.push_back(posture ? listByRows((*posture).*member) : Json(std::vector<Json>(static_cast<size_t>(entries))));
  return out;
}

Json describeMotor(const Motor& motor) {
  const bool has_winding = motor.hasEnvelope() && motor.drive.resistance > 0;
  return {{"name", motor.name},
          {"armature", motor.armature},
          {"torque", motor.effort_limit},
          {"speed", motor.velocity_limit},
          {"torque_at_rest", has_winding ? Json(motor.drive.voltage / motor.voltsPerEffort()) : Json()},
          {"torque_per_speed", has_winding ? Json(motor.voltsPerSpeed() / motor.voltsPerEffort()) : Json()}};
}

Json describeTable(const Model& closed, const Model& serial, const LinkageTable& table) {
  const int m = static_cast<int>(table.joints.size());
  Json out = {{"joints", table.joints}, {"carried_by", table.carrier}, {"motors", Json::array()}};
  for (const std::string& name : table.motors)
    out["motors"].push_back(describeMotor(closed.motors()[static_cast<size_t>(closed.findMotor(name))]));
  for (const std::string& name : table.joints)
    out["armature_in_file"].push_back(serial.motors()[static_cast<size_t>(serial.findMotor(name))].armature);
  for (const auto& axis : table.axes) out["shape"].push_back(axis.size());
  out["axes"] = table.axes;
  out["interpolation_error"] = {{"ratio", table.ratio_error}, {"inertia", table.inertia_error}};
  out["motor_positions"] = listOver(table, &LinkagePosture::motors, m);
  out["ratio"] = listOver(table, &LinkagePosture::ratio, m * m);
  out["inertia"] = listOver(table, &LinkagePosture::inertia, m * m);
  out["weight"] = listOver(table, &LinkagePosture::weight, 3 * m);
  out["held"] = listOver(table, &LinkagePosture::held, m);
  out["damping"] = listOver(table, &LinkagePosture::damping, m * m);
  out["friction"] = listOver(table, &LinkagePosture::friction, m);
  out["torque_alone"] = listOver(table, &LinkagePosture::torque_alone, m);
  out["torque_most"] = listOver(table, &LinkagePosture::torque_most, m);
  out["speed_alone"] = listOver(table, &LinkagePosture::speed_alone, m);
  out["speed_most"] = listOver(table, &LinkagePosture::speed_most, m);
  return out;
}

}  // namespace

SerialFiles makeSerialFiles(const Model& closed, const std::string& file) {
  if (closed.closures().empty())
    throw InputError(closed.name(), "--serial", "the robot has no loops: it is a serial chain", "leave out --serial");
  const AssemblyResult posture = findClosedConfiguration(closed);
  if (posture.status != NumericalStatus::Ok) throw makeClosingError(closed, closed.name(), posture);
  const SerialTables tables = makeSerialTables(closed, posture.q);
  const Model& model = tables.serial.model;
  SerialFiles out;
  out.model = model;
  out.q = restrictConfiguration(closed, model, posture.q);
  Json json = {{"robot", closed.name()}, {"model", file}, {"linkages", Json::array()}};
  for (const LinkageTable& table : tables.linkages) json["linkages"].push_back(describeTable(closed, model, table));
  out.tables = formatJson(json) + "\n";
  out.warnings.push_back(
      "joints of linkages frozen: " + std::to_string(tables.serial.frozen_joints.size()) + ", with " +
      formatNumber(tables.frozen_mass, "%.3g") + " kg of their bodies; closures left out: " +
      std::to_string(tables.serial.dropped_closures.size()) + "; the tables have what the chain lacks");
  for (const std::string& target : tables.serial.dropped_targets)
    out.warnings.push_back("reference " + target + ": it is frozen");
  return out;
}

}  // namespace bielle::cli
