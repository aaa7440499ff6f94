#include "cli/table.h"

#include <ostream>

namespace bielle::cli {
namespace {

std::string formatCell(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return formatNumber(value.get<double>());
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& item : value) text += (text.empty() ? "" : " ") + formatCell(item);
  return text.empty() ? "-" : text;
}

}  // namespace

void printTable(std::ostream& out, const std::vector<Row>& rows, const std::string& margin) {
  std::vector<size_t> widths;
  for (const Row& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const Row& row : rows) {
    std::string line = margin;
    for (size_t i = 0; i < row.size(); ++i)
      line += row[i] + (i + 1 < row.size() ? std::string(widths[i] - row[i].size() + 2, ' ') : "");
    out << line << "\n";
  }
}

void printTable(std::ostream& out, const Json& objects, const std::vector<std::string>& keys) {
  std::vector<Row> rows = {keys};
  for (const Json& object : objects) {
    rows.emplace_back();
    for (const std::string& key : keys) rows.back().push_back(formatCell(object.at(key)));
  }
  printTable(out, rows);
}

}  // namespace bielle::cli
