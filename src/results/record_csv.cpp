// Trajectories as comma-separated values.
#include <charconv>

#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "motion/record_tables.h"

namespace bielle {
namespace {

// A name with a comma, a quote or a line break is quoted, as usual in CSV.
std::string quoteCsv(const std::string& name) {
  if (name.find_first_of(",\"\n\r") == std::string::npos) return name;
  std::string text = "\"";
  for (char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + "\"";
}

void appendField(double value, std::string& text) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

std::vector<std::string> makeHeader(const MotionRecord& record) {
  std::vector<std::string> header = {"time"};
  for (const RecordTable& table : listTables(record))
    for (const std::string& column : table.columns) header.push_back(table.prefix + "." + column);
  return header;
}

}  // namespace

std::string formatCsv(const MotionRecord& record) {
  requireWhole(record);
  std::string text;
  for (const std::string& column : makeHeader(record)) text += (text.empty() ? "" : ",") + quoteCsv(column);
  const std::vector<RecordTable> tables = listTables(record);
  for (int k = 0; k < record.time.size(); ++k) {
    text += "\n";
    appendField(record.time[k], text);
    for (const RecordTable& table : tables) {
      const RowMatrixXd& data = record.*table.data;
      for (int i = 0; i < data.cols(); ++i) {
        text += ",";
        if (k < data.rows()) appendField(data(k, i), text);
      }
    }
  }
  return text + "\n";
}

void writeCsv(const std::string& path, const MotionRecord& record) { writeTextFile(path, formatCsv(record)); }

}  // namespace bielle
