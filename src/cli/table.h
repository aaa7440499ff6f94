#pragma once
// Aligned tables of text.
#include <iosfwd>
#include <string>
#include <vector>

#include "model/number_text.h"
#include "results/json_text.h"

namespace bielle::cli {

using Row = std::vector<std::string>;

// Columns padded to their widest cell, two spaces apart, every line indented by `margin`.
void printTable(std::ostream& out, const std::vector<Row>& rows, const std::string& margin = "  ");

// A list of objects: one line each under a header, the given keys as columns.
void printTable(std::ostream& out, const Json& objects, const std::vector<std::string>& keys);

}  // namespace bielle::cli
