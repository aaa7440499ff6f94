#include "results/output_place.h"

#include <filesystem>

#include "bielle/model/error.h"

namespace bielle {

void requireApart(const std::string& output, const std::vector<std::string>& inputs) {
  std::error_code error;
  for (const std::string& input : inputs)
    if (std::filesystem::equivalent(output, input, error))
      throw InputError(output, "output", "it is also an input" + (input == output ? "" : ", '" + input + "'"),
                       "give another place with -o, so that nothing is lost");
}

}  // namespace bielle
