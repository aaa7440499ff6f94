// Trajectories as NumPy archives.
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/aside_file.h"
#include "motion/record_tables.h"
#include "results/npz.h"

namespace bielle {
namespace {

using Names = std::vector<std::string> MotionRecord::*;
const std::pair<const char*, Names> kNames[] = {{"q_names", &MotionRecord::q_names},
                                                {"v_names", &MotionRecord::v_names},
                                                {"u_names", &MotionRecord::u_names},
                                                {"closure_names", &MotionRecord::closure_names},
                                                {"contact_names", &MotionRecord::contact_names}};

NpyArray takeArray(const std::string& path, const std::string& name, bool is_text, NpyArrays& arrays) {
  const auto it = arrays.find(name);
  if (it == arrays.end() || it->second.is_text != is_text)
    throw InputError(path, "array '" + name + "'", "it is missing, or of another type",
                     "give a trajectory that Bielle wrote");
  return it->second;
}

std::vector<size_t> makeShape(const RecordTable& table, size_t rows) {
  const size_t columns = table.columns.size();
  if (table.entries == 0) return {rows, columns};
  return {rows, columns / table.entries, static_cast<size_t>(table.entries)};
}

void addMultipliers(const Multipliers& multipliers, NpyArrays& arrays) {
  if (!(multipliers.penalty > 0)) return;
  NpyArray values, rows;
  for (const VectorXd& node : multipliers.values) {
    values.numbers.insert(values.numbers.end(), node.begin(), node.end());
    rows.numbers.push_back(static_cast<double>(node.size()));
  }
  values.shape = {values.numbers.size()};
  rows.shape = {rows.numbers.size()};
  arrays["multipliers"] = std::move(values);
  arrays["multiplier_rows"] = std::move(rows);
  arrays["multiplier_penalty"] = {{1}, {multipliers.penalty}, {}, false};
}

Multipliers takeMultipliers(const std::string& path, size_t nodes, NpyArrays& arrays) {
  Multipliers out;
  if (arrays.count("multipliers") == 0) return out;
  const std::vector<double> values = takeArray(path, "multipliers", false, arrays).numbers,
                            rows = takeArray(path, "multiplier_rows", false, arrays).numbers,
                            penalty = takeArray(path, "multiplier_penalty", false, arrays).numbers;
  const auto refuse = [&path](const char* problem) {
    throw InputError(path, "array 'multipliers'", problem, "give a trajectory that Bielle wrote");
  };
  if (rows.size() != nodes) refuse("it does not give the number of multipliers of each node");
  if (penalty.size() != 1 || !(penalty[0] > 0) || !std::isfinite(penalty[0])) refuse("its penalty is not positive");
  size_t used = 0;
  for (double count : rows) {
    if (!(count >= 0 && count <= static_cast<double>(values.size() - used)) || count != std::floor(count))
      refuse("its length does not match the rows of the nodes");
    const size_t size = static_cast<size_t>(count);
    out.values.push_back(VectorXd::Map(values.data() + used, static_cast<Eigen::Index>(size)));
    if (!out.values.back().allFinite()) refuse("it contains numbers that are not finite");
    used += size;
  }
  if (used != values.size()) refuse("its length does not match the rows of the nodes");
  out.penalty = penalty[0];
  return out;
}

RowMatrixXd takeFootholds(const std::string& path, size_t nodes, size_t contacts, NpyArrays& arrays) {
  if (arrays.count("footholds") == 0) return {};
  const NpyArray array = takeArray(path, "footholds", false, arrays);
  if (array.shape != std::vector<size_t>{nodes, contacts, MotionRecord::kFootholdEntries})
    throw InputError(path, "array 'footholds'", "its shape does not match the contacts and nodes",
                     "give a trajectory that Bielle wrote");
  return RowMatrixXd::Map(array.numbers.data(), nodes, contacts * MotionRecord::kFootholdEntries);
}

VectorXd takeCycle(const std::string& path, NpyArrays& arrays) {
  if (arrays.count("cycle") == 0) return {};
  const NpyArray array = takeArray(path, "cycle", false, arrays);
  const VectorXd cycle = VectorXd::Map(array.numbers.data(), static_cast<Eigen::Index>(array.numbers.size()));
  if (array.shape != std::vector<size_t>{kCycleEntries} || !cycle.allFinite())
    throw InputError(path, "array 'cycle'", "it is not the period, x, y and yaw of a cycle",
                     "give a trajectory that Bielle wrote");
  return cycle;
}

}  // namespace

std::string formatNpz(const MotionRecord& record) {
  requireWhole(record);
  NpyArrays arrays;
  const size_t nodes = record.time.size();
  arrays["time"] = {{nodes}, {record.time.data(), record.time.data() + nodes}, {}, false};
  for (const auto& [name, member] : kNames) arrays[name] = {{(record.*member).size()}, {}, record.*member, true};
  for (const RecordTable& table : listTables(record)) {
    const RowMatrixXd& data = record.*table.data;
    arrays[table.array] = {makeShape(table, data.rows()), {data.data(), data.data() + data.size()}, {}, false};
  }
  if (record.footholds.size() > 0)
    arrays["footholds"] = {{nodes, record.contact_names.size(), MotionRecord::kFootholdEntries},
                           {record.footholds.data(), record.footholds.data() + record.footholds.size()},
                           {},
                           false};
  if (record.cycle.size() > 0)
    arrays["cycle"] = {{kCycleEntries}, {record.cycle.data(), record.cycle.data() + record.cycle.size()}, {}, false};
  addMultipliers(record.multipliers, arrays);
  return formatArchive(arrays);
}

void writeNpz(const std::string& path, const MotionRecord& record) {
  AsideFile file(path);
  file.write(formatNpz(record));
  file.commit();
}

MotionRecord readRecord(const std::string& path) {
  NpyArrays arrays = readArchive(path);
  MotionRecord record;
  for (const auto& [name, member] : kNames) record.*member = takeArray(path, name, true, arrays).texts;
  record.has_midpoints = arrays.count("q_mid") > 0;
  const NpyArray time = takeArray(path, "time", false, arrays);
  if (time.shape.size() != 1 || time.numbers.empty())
    throw InputError(path, "array 'time'", "it is not a list with one number per node",
                     "give a trajectory that Bielle wrote");
  const size_t nodes = time.numbers.size();
  record.time = VectorXd::Map(time.numbers.data(), nodes);
  for (const RecordTable& table : listTables(record)) {
    const size_t rows = table.per == RecordTable::Per::Node ? nodes : nodes - 1;
    const NpyArray array = takeArray(path, table.array, false, arrays);
    if (array.shape != makeShape(table, rows))
      throw InputError(path, "array '" + table.array + "'", "its shape does not match the names and nodes",
                       "give a trajectory that Bielle wrote");
    record.*table.data = RowMatrixXd::Map(array.numbers.data(), rows, table.columns.size());
  }
  record.footholds = takeFootholds(path, nodes, record.contact_names.size(), arrays);
  record.cycle = takeCycle(path, arrays);
  record.multipliers = takeMultipliers(path, nodes, arrays);
  return record;
}

MotionRecord readResultRecord(const std::string& directory) {
  return readRecord((std::filesystem::path(directory) / "trajectory.npz").string());
}

}  // namespace bielle
