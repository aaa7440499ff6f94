#pragma once
// The tables of a record, in the order of the files, shared by the CSV and NumPy formats.
#include "bielle/motion/record.h"

namespace bielle {

struct RecordTable {
  enum class Per { Node, Stage };
  std::string array;   // name in the NumPy archive
  std::string prefix;  // of the columns of the CSV
  Per per;
  std::vector<std::string> columns;
  RowMatrixXd MotionRecord::*data;
  int entries;  // number of columns that form the last axis of a three-dimensional array, 0: none
};
inline constexpr int kCycleEntries = 4;  // of MotionRecord::cycle, where there is one

std::vector<RecordTable> listTables(const MotionRecord& record);

// Sets the names of the model's columns and the size of every table; `has_midpoints` must be set.
void startRecord(const Model& model, int stages, MotionRecord& record);

// Throws InputError unless every table has as many rows and columns as times and names ask for.
void requireWhole(const MotionRecord& record);

}  // namespace bielle
