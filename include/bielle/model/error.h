#pragma once
/// \file The exception for invalid input.
#include <memory>
#include <stdexcept>
#include <string>

namespace bielle {

/// Invalid input at the boundary. what() reads "file: element: what is wrong; remedy", on one line, without control
/// characters and with long parts truncated. The separate parts are unchanged.
class InputError : public std::runtime_error {
 public:
  /// \param source file (or "" for a model built in code)   \param element e.g. `joint 'knee'`
  InputError(const std::string& source, const std::string& element, const std::string& problem,
             const std::string& remedy = "");

  const std::string& source() const { return parts_->source; }
  const std::string& element() const { return parts_->element; }
  const std::string& problem() const { return parts_->problem; }
  const std::string& remedy() const { return parts_->remedy; }

 private:
  struct Parts {
    std::string source, element, problem, remedy;
  };
  std::shared_ptr<const Parts> parts_;  // so that copies do not throw
};

}  // namespace bielle
