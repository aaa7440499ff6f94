#include "identify/log.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bielle/model/error.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/npz.h"

namespace bielle {
namespace {

constexpr const char *kTime = "time", *kTorque = "u.";

// Columns by name, of which a few are read.
class LogTable {
 public:
  LogTable(const std::string& path, const std::vector<std::string>& wanted) : path_(path), wanted_(wanted) {}

  // The index of a wanted column, 0 of the time; -1 of others.
  int add(std::string name) {
    if (name.rfind("q.", 0) == 0) name.erase(0, 2);
    if (name != kTime && !contains(wanted_, name)) {
      others_.push_back(name);
      return -1;
    }
    if (contains(names_, name))
      throw InputError(path_, "column '" + name + "'", "it is there twice", "leave one of them out");
    names_.push_back(name);
    return static_cast<int>(names_.size()) - 1;
  }
  size_t size() const { return names_.size(); }
  void set(const std::string& row, size_t column, std::optional<double> value, const std::string& text) {
    const bool is_finite = value && std::isfinite(*value);
    const bool may_be_empty = text.empty() && names_[column].rfind(kTorque, 0) == 0;  // in the last row: endRow()
    if (!is_finite && !may_be_empty) refuse(row, column, text);
    if (!is_finite && empty_ < 0) empty_ = static_cast<int>(column);
    cells_.push_back(is_finite ? *value : std::nan(""));
  }
  void endRow(const std::string& row, bool is_last) {
    if (empty_ >= 0 && !is_last) refuse(row, static_cast<size_t>(empty_), "");
    rows_.push_back(row);
  }

  MotionLog finish() const {
    const auto time = std::find(names_.begin(), names_.end(), kTime);
    if (time == names_.end()) {
      const std::vector<std::string> there = listFirst();
      const bool is_split = there.size() != 1 || there[0].find_first_of("; \t") == std::string::npos;
      throw InputError(
          path_, "column 'time'", "it is missing; there are: " + listItems(there),
          is_split ? "add the time of each row, s" : "separate columns by commas, with decimal points in numbers");
    }
    MotionLog log;
    log.path = path_;
    log.rows = rows_;
    const auto K = static_cast<Eigen::Index>(rows_.size()), n = static_cast<Eigen::Index>(names_.size());
    if (K < 2) throw InputError(path_, "rows", K == 0 ? "there are none" : "there is one", "give the log of a motion");
    const MatrixXd all = RowMatrixXd::Map(cells_.data(), K, n);
    const Eigen::Index t = time - names_.begin();
    log.time = all.col(t);
    log.values.resize(K, n - 1);
    for (Eigen::Index c = 0; c < n; ++c) {
      if (c == t) continue;
      log.values.col(static_cast<Eigen::Index>(log.names.size())) = all.col(c);
      log.names.push_back(names_[static_cast<size_t>(c)]);
    }
    for (Eigen::Index k = 1; k < K; ++k)
      if (log.time[k] < log.time[k - 1])
        throw InputError(path_, rows_[static_cast<size_t>(k)],
                         "its time, " + formatNumber(log.time[k]) + ", is before that of the row above, " +
                             formatNumber(log.time[k - 1]),
                         "put the rows in order of time; give separate logs one by one");
    return log;
  }

 private:
  std::vector<std::string> listFirst() const {
    constexpr size_t kFirst = 8;
    std::vector<std::string> first = names_;
    first.insert(first.end(), others_.begin(), others_.end());
    if (first.size() > kFirst) first.resize(kFirst), first.emplace_back("...");
    return first;
  }

  [[noreturn]] void refuse(const std::string& row, size_t column, const std::string& text) const {
    throw InputError(path_, row + ", column '" + names_[column] + "'", "'" + text + "' is no finite number",
                     "correct it, or leave the row out");
  }

  const std::string& path_;
  const std::vector<std::string>& wanted_;
  std::vector<std::string> names_, others_, rows_;
  int empty_ = -1;             // the first column of torques that is empty in a row
  std::vector<double> cells_;  // row after row
};

std::string trim(const std::string& text) {
  const char* const kSpace = " \t\r\"";
  const size_t begin = text.find_first_not_of(kSpace);
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

// Calls cell(index, text) for every cell of a line and returns their number.
template <typename Cell>
size_t splitLine(const std::string& text, size_t begin, size_t end, Cell&& cell) {
  size_t count = 0;
  for (size_t at = begin;; ++count) {
    const size_t stop = std::min(text.find(',', at), end);
    cell(count, at, stop);
    if (stop == end) return count + 1;
    at = stop + 1;
  }
}

MotionLog readText(const std::string& path, const std::vector<std::string>& wanted) {
  const std::string text = readTextFile(path, "give a log: a header of names, then a line a row");
  requireUtf8(text, path);
  LogTable table(path, wanted);
  std::vector<int> columns;
  const size_t first = text.rfind("\xef\xbb\xbf", 0) == 0 ? 3 : 0;  // the mark of some editors
  size_t line = 0;
  for (size_t at = first; at < text.size(); ++line) {
    const size_t end = std::min(text.find('\n', at), text.size()), begin = at;
    at = end + 1;
    if (trim(text.substr(begin, end - begin)).empty()) continue;
    if (columns.empty()) {
      splitLine(text, begin, end,
                [&](size_t, size_t a, size_t b) { columns.push_back(table.add(trim(text.substr(a, b - a)))); });
      continue;
    }
    const std::string row = "line " + std::to_string(line + 1);
    std::vector<std::string> cells(table.size());
    const size_t count = splitLine(text, begin, end, [&](size_t i, size_t a, size_t b) {
      if (i < columns.size() && columns[i] >= 0) cells[static_cast<size_t>(columns[i])] = trim(text.substr(a, b - a));
    });
    if (count != columns.size())
      throw InputError(path, row,
                       "it has " + std::to_string(count) + " cells, and the header " + std::to_string(columns.size()),
                       "complete the line, or leave it out");
    for (size_t c = 0; c < cells.size(); ++c) table.set(row, c, parseNumber(cells[c]), cells[c]);
    table.endRow(row, text.find_first_not_of(" \t\r\n", at) == std::string::npos);
  }
  if (columns.empty())
    throw InputError(path, "file", "it is empty", "give a log: a header of names, then a line a row");
  return table.finish();
}

NpyArrays readLogArchive(const std::string& path) {
  try {
    return readArchive(path);
  } catch (const InputError& error) {
    throw InputError(path, error.element(), error.problem(),
                     "give arrays of float64 by name, as numpy.savez(FILE, time=TIMES, JOINT=POSITIONS) writes them");
  }
}

MotionLog readArrays(const std::string& path, const std::vector<std::string>& wanted) {
  const NpyArrays arrays = readLogArchive(path);
  struct Column {
    const NpyArray* array;
    size_t first, step;
  };
  std::vector<Column> columns;
  LogTable table(path, wanted);
  const auto time = arrays.find(kTime);
  const size_t K = time == arrays.end() || time->second.is_text ? 0 : time->second.numbers.size();
  for (const auto& [name, array] : arrays)
    if (!array.is_text && array.shape.size() == 1 && array.shape[0] == K && table.add(name) >= 0)
      columns.push_back({&array, 0, 1});
  for (const char* array : {"q", "v", "u"}) {
    const auto found = arrays.find(array), names = arrays.find(std::string(array) + "_names");
    if (found == arrays.end() || names == arrays.end()) continue;
    const size_t n = names->second.texts.size(), before = columns.size();
    for (size_t c = 0; c < n; ++c)
      if (table.add(std::string(array) + "." + names->second.texts[c]) >= 0) columns.push_back({&found->second, c, n});
    const std::vector<size_t>& shape = found->second.shape;
    const bool lacks_last = array[0] == 'u' && K > 0 && shape == std::vector<size_t>{K - 1, n};
    if (columns.size() > before && (found->second.is_text || (shape != std::vector<size_t>{K, n} && !lacks_last)))
      throw InputError(path, std::string("array '") + array + "'",
                       std::string("its shape does not match `time` and `") + array + "_names`",
                       "give K x n numbers for K times and n names");
  }
  for (size_t k = 0; k < K; ++k) {
    const std::string row = "row " + std::to_string(k);
    for (size_t c = 0; c < columns.size(); ++c) {
      const size_t at = columns[c].first + k * columns[c].step;
      const bool is_there = at < columns[c].array->numbers.size();
      const double value = is_there ? columns[c].array->numbers[at] : std::nan("");
      table.set(row, c, value, !is_there || std::isfinite(value) ? "" : std::isnan(value) ? "nan" : "inf");
    }
    table.endRow(row, k + 1 == K);
  }
  return table.finish();
}

}  // namespace

int MotionLog::find(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

bool MotionLog::isHeld(int column) const { return std::isnan(values(values.rows() - 1, column)); }

MotionLog readLog(const std::string& path, const std::vector<std::string>& wanted) {
  const bool is_archive = path.size() > 4 && path.compare(path.size() - 4, 4, ".npz") == 0;
  return is_archive ? readArrays(path, wanted) : readText(path, wanted);
}

}  // namespace bielle
