// Trajectories as NumPy archives.
#include "bielle/model/error.h"
#include "io/npz.h"
#include "io/record_tables.h"

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
    throw ModelError(path, "array '" + name + "'", "it is missing, or of another type",
                     "give a trajectory that Bielle wrote");
  return it->second;
}

std::vector<size_t> makeShape(const RecordTable& table, size_t rows) {
  const size_t columns = table.columns.size();
  if (table.entries == 0) return {rows, columns};
  return {rows, columns / table.entries, static_cast<size_t>(table.entries)};
}

}  // namespace

std::string formatNpz(const MotionRecord& record) {
  NpyArrays arrays;
  const size_t nodes = record.time.size();
  arrays["time"] = {{nodes}, {record.time.data(), record.time.data() + nodes}, {}, false};
  for (const auto& [name, member] : kNames) arrays[name] = {{(record.*member).size()}, {}, record.*member, true};
  for (const RecordTable& table : listTables(record)) {
    const RowMatrixXd& data = record.*table.data;
    arrays[table.array] = {makeShape(table, data.rows()), {data.data(), data.data() + data.size()}, {}, false};
  }
  return formatArchive(arrays);
}

MotionRecord readNpz(const std::string& path) {
  NpyArrays arrays = readArchive(path);
  MotionRecord record;
  for (const auto& [name, member] : kNames) record.*member = takeArray(path, name, true, arrays).texts;
  record.has_midpoints = arrays.count("q_mid") > 0;
  const NpyArray time = takeArray(path, "time", false, arrays);
  if (time.shape.size() != 1 || time.numbers.empty())
    throw ModelError(path, "array 'time'", "it is not a list of nodes", "give a trajectory that Bielle wrote");
  const size_t nodes = time.numbers.size();
  record.time = VectorXd::Map(time.numbers.data(), nodes);
  for (const RecordTable& table : listTables(record)) {
    const size_t rows = table.per == RecordTable::Per::Node ? nodes : nodes - 1;
    const NpyArray array = takeArray(path, table.array, false, arrays);
    if (array.shape != makeShape(table, rows))
      throw ModelError(path, "array '" + table.array + "'", "its shape does not fit the names and the nodes",
                       "give a trajectory that Bielle wrote");
    record.*table.data = RowMatrixXd::Map(array.numbers.data(), rows, table.columns.size());
  }
  return record;
}

}  // namespace bielle
