#pragma once
// Options with one of them changed.
#include <string>

#include "bielle/model/options.h"

namespace bielle {

// A number is set unchecked, as programs may set the member. \throws InputError for values that the member cannot hold
template <typename Options>
Options changeOption(const Options& options, const std::string& name, double value) {
  OptionSet list = listOptions(options), changed;
  const bool is_number = std::holds_alternative<double>(list.get(name).value);
  if (!is_number) list.set(name, value);
  for (Option option : list) {
    if (is_number && option.name == name) option.value = value;
    changed.add(option);
  }
  return readOptions(changed, options);
}

}  // namespace bielle
