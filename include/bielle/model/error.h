#pragma once
/// \file The exception for invalid input.
#include <stdexcept>
#include <string>

namespace bielle {

/// Invalid input at the boundary. what() reads "file: element: what is wrong; remedy", on one line, without control
/// characters and with long parts truncated.
class ModelError : public std::runtime_error {
 public:
  /// \param source file (or "" for a model built in code)   \param element e.g. `joint 'knee'`
  ModelError(const std::string& source, const std::string& element, const std::string& problem,
             const std::string& remedy = "");
};

}  // namespace bielle
