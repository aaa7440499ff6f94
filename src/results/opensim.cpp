#include "results/opensim.h"

#include <charconv>

#include "motion/record_tables.h"

namespace bielle {
namespace {

// Names in one word: OpenSim does not support quotes.
std::string makeLabel(std::string name) {
  for (char& c : name)
    if (c == '\t' || c == '\n' || c == '\r' || c == ' ') c = '_';
  return name;
}

void appendCell(double value, std::string& text) {
  char digits[32];
  text += "\t";
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

// `tables` side by side, their columns with or without their prefixes.
OpensimText format(const MotionRecord& record, const std::vector<RecordTable>& tables, bool with_prefix) {
  std::string labels = "time", rows;
  size_t columns = 1;
  for (const RecordTable& table : tables)
    for (const std::string& column : table.columns) {
      labels += "\t" + makeLabel(with_prefix ? table.prefix + "." + column : column);
      ++columns;
    }
  Eigen::Index count = 0;
  for (Eigen::Index k = 0; k < record.time.size(); ++k) {
    if (k + 1 < record.time.size() && record.time[k + 1] <= record.time[k]) continue;
    ++count;
    std::string row;
    appendCell(record.time[k], row);
    for (const RecordTable& table : tables) {
      const RowMatrixXd& data = record.*table.data;
      for (Eigen::Index i = 0; i < data.cols() && data.rows() > 0; ++i)
        appendCell(data(std::min(k, data.rows() - 1), i), row);
    }
    rows += row.substr(1) + "\n";
  }
  OpensimText out;
  out.text = "bielle\nversion=1\nnRows=" + std::to_string(count) + "\nnColumns=" + std::to_string(columns) +
             "\ninDegrees=no\nendheader\n" + labels + "\n" + rows;
  if (const Eigen::Index left = record.time.size() - count; left > 0)
    out.warnings.push_back(std::to_string(left) +
                           " node(s) before impacts are left out: OpenSim wants times that increase, and an "
                           "impact takes none");
  return out;
}

}  // namespace

OpensimText formatMot(const MotionRecord& record) {
  std::vector<RecordTable> tables = listTables(record);
  tables.erase(tables.begin() + 1, tables.end());  // q comes first
  return format(record, tables, false);
}

OpensimText formatSto(const MotionRecord& record) { return format(record, listTables(record), true); }

}  // namespace bielle
