#include "value.h"

namespace bielle::python {

std::string formatMember(const py::object& member) {
  constexpr py::ssize_t kLongest = 12;
  if (py::isinstance<py::array>(member)) {
    const auto array = py::reinterpret_borrow<py::array>(member);
    if (array.size() > kLongest)
      return "<array " + formatShape(Shape(array.shape(), array.shape() + array.ndim())) + ">";
    return py::repr(array.attr("tolist")());
  }
  if (py::isinstance<py::tuple>(member) && py::len(member) > static_cast<size_t>(kLongest))
    return "<" + std::to_string(py::len(member)) + " entries>";
  return py::repr(member);
}

void throwUnknownField(const std::string& type, const std::string& name, const std::string& names) {
  throw py::type_error(type + " has no field '" + name + "'; it has: " + names);
}

std::string getType(const OptionValue& value) {
  return std::visit([](const auto& like) { return Convert<std::decay_t<decltype(like)>>::type(); }, value);
}

OptionValue readLike(const OptionValue& like, py::handle value, const std::string& what) {
  return std::visit([&](const auto& old) -> OptionValue { return read<std::decay_t<decltype(old)>>(value, what); },
                    like);
}

std::string describeField(const Option& option) {
  const std::string values = option.describeValues();
  return option.help + (option.unit.empty() ? "" : " [" + option.unit + "]") + (values.empty() ? "" : ", " + values) +
         ", default " + formatOption(option.value);
}

}  // namespace bielle::python
