// In place of front_search.cpp where pagmo is not installed.
#include <stdexcept>

#include "design/front_search.h"

namespace bielle {

bool hasFrontSearch() { return false; }

void searchFront(const FrontProblem&, const FrontOptions&, unsigned) { throw std::logic_error("built without pagmo"); }

std::vector<size_t> selectFront(const std::vector<std::vector<double>>&, size_t) {
  throw std::logic_error("built without pagmo");
}

}  // namespace bielle
