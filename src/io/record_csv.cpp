// Trajectories as comma-separated values.
#include <charconv>

#include "bielle/model/error.h"
#include "io/record_tables.h"
#include "model/text_file.h"

namespace bielle {
namespace {

constexpr const char* kRemedy = "give a trajectory that Bielle wrote";

[[noreturn]] void failCsv(const std::string& path, const std::string& element, const std::string& problem) {
  throw ModelError(path, element, problem, kRemedy);
}

constexpr size_t kMostColumns = 1 << 20;

std::string nameLine(int node) { return "line " + std::to_string(node + 2); }

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

// The cells of the line that begins at `at`, which advances to the next line; at most `most` + 1 cells are read.
std::vector<std::string> readLine(const std::string& text, size_t& at, size_t most) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (; at < text.size() && cells.size() <= most; ++at) {
    const char c = text[at];
    if (c == '"' && quoted && at + 1 < text.size() && text[at + 1] == '"')
      cells.back() += text[++at];
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else if (c == '\n' && !quoted)
      break;
    else if (c != '\r' || quoted)
      cells.back() += c;
  }
  ++at;
  return cells;
}

// Names from the columns of one prefix; of a wrench, the first of its six entries gives the name.
void addName(const std::string& column, MotionRecord& record) {
  const size_t dot = column.find('.');
  if (dot == std::string::npos) return;
  const std::string prefix = column.substr(0, dot), name = column.substr(dot + 1);
  if (prefix == "q") record.q_names.push_back(name);
  if (prefix == "v") record.v_names.push_back(name);
  if (prefix == "q_mid") record.has_midpoints = true;
  if (prefix == "u") record.u_names.push_back(name);
  const bool first_entry = name.size() > 3 && name.compare(name.size() - 3, 3, ".fx") == 0;
  if (prefix == "closure" && first_entry) record.closure_names.push_back(name.substr(0, name.size() - 3));
  if (prefix == "contact" && first_entry) record.contact_names.push_back(name.substr(0, name.size() - 3));
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

MotionRecord readCsv(const std::string& path) {
  const std::string text = readTextFile(path, kRemedy);
  size_t at = 0;
  MotionRecord record;
  const std::vector<std::string> header = readLine(text, at, kMostColumns);
  for (const std::string& column : header) addName(column, record);
  if (makeHeader(record) != header) failCsv(path, "header", "it does not have the columns of a trajectory");
  // Counted before memory is allocated for them.
  const size_t first_row = at;
  int nodes = 0;
  for (; at < text.size(); ++nodes)
    if (readLine(text, at, header.size()).size() != header.size())
      failCsv(path, nameLine(nodes), "expected " + std::to_string(header.size()) + " cells as in the header");
  if (nodes == 0) failCsv(path, "file", "it has no nodes");

  resizeRecord(nodes - 1, record);
  const std::vector<RecordTable> tables = listTables(record);
  at = first_row;
  for (int k = 0; k < nodes; ++k) {
    const std::string line = nameLine(k);
    const std::vector<std::string> row = readLine(text, at, header.size());
    size_t column = 0;
    const auto read = [&](double& value) {
      const std::string& cell = row[column];
      const char* end = cell.data() + cell.size();
      const auto [stop, error] = std::from_chars(cell.data(), end, value);
      if (error != std::errc() || stop != end)
        failCsv(path, line + ", column '" + header[column] + "'", "'" + cell + "' is not a number");
      ++column;
    };
    read(record.time[k]);
    for (const RecordTable& table : tables) {
      RowMatrixXd& data = record.*table.data;
      for (int i = 0; i < data.cols(); ++i) {
        if (k < data.rows())
          read(data(k, i));
        else if (!row[column++].empty())
          failCsv(path, line, "the last node holds values of a stage");
      }
    }
  }
  return record;
}

}  // namespace bielle
