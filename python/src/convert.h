#pragma once
/// \file How members of structs appear in Python: `show` makes the Python object, a view where there is memory to view,
/// `read` takes one, `same` compares two members, `type` is what stubs call their type.
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "arrays.h"
#include "bielle/model/options.h"
#include "bielle/motion/serial_model.h"

namespace bielle::python {

/// Numbers, texts and enumerations; and values (value.h), of which Python sees the member itself.
template <typename M, typename = void>
struct Convert {
  static std::string type() {
    if constexpr (std::is_same_v<M, bool>)
      return "bool";
    else if constexpr (std::is_integral_v<M>)
      return "int";
    else if constexpr (std::is_floating_point_v<M>)
      return "float";
    else if constexpr (std::is_same_v<M, std::string>)
      return "str";
    else
      return py::str(py::type::of<M>().attr("__name__"));
  }
  static py::object show(const M& member, py::handle owner) {
    if constexpr (std::is_class_v<M> && !std::is_same_v<M, std::string>)
      return py::cast(&member, py::return_value_policy::reference_internal, owner);
    else
      return py::cast(member);
  }
  static M read(py::handle value, const std::string& what) {
    try {
      if (value.is_none()) throw py::cast_error();  // which pybind11 takes for False
      return value.cast<M>();
    } catch (const py::cast_error&) {
      throw py::type_error(what + ": expected " + std::string(py::type_id<M>()) + ", got " +
                           std::string(py::repr(py::type::of(value))));
    }
  }
  static bool same(const M& a, const M& b);
};

template <typename M>
py::object show(const M& member, py::handle owner) {
  return Convert<M>::show(member, owner);
}
template <typename M>
M read(py::handle value, const std::string& what) {
  return Convert<M>::read(value, what);
}
template <typename M>
bool same(const M& a, const M& b) {
  return Convert<M>::same(a, b);
}
/// Numbers are the same when they are equal or neither is a number.
inline bool same(double a, double b) { return a == b || (a != a && b != b); }

template <typename M>
struct Convert<M, std::enable_if_t<std::is_base_of_v<Eigen::EigenBase<M>, M>>> {
  static std::string type() { return "Array"; }
  static py::object show(const M& member, py::handle owner) { return makeView(member, owner); }
  static M read(py::handle value, const std::string& what) { return readMatrix<M>(value, what); }
  static bool same(const M& a, const M& b) {
    if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
    for (Eigen::Index i = 0; i < a.size(); ++i)
      if (!python::same(a.data()[i], b.data()[i])) return false;
    return true;
  }
};

/// A model of the robot is known by its name.
template <>
struct Convert<Belief> {
  static std::string type() { return "str"; }
  static py::object show(Belief member, py::handle) { return py::cast(getName(member)); }
  static Belief read(py::handle value, const std::string& what) {
    return parseBelief(Convert<std::string>::read(value, what));
  }
  static bool same(Belief a, Belief b) { return a == b; }
};

template <>
struct Convert<std::vector<double>> {
  static std::string type() { return "Array"; }
  static py::object show(const std::vector<double>& member, py::handle owner) {
    return makeView(member.data(), {static_cast<py::ssize_t>(member.size())}, {1}, owner);
  }
  static std::vector<double> read(py::handle value, const std::string& what) {
    const VectorXd numbers = readMatrix<VectorXd>(value, what);
    return {numbers.begin(), numbers.end()};
  }
  static bool same(const std::vector<double>& a, const std::vector<double>& b) {
    return Convert<VectorXd>::same(Eigen::Map<const VectorXd>(a.data(), a.size()),
                                   Eigen::Map<const VectorXd>(b.data(), b.size()));
  }
};

/// Lists appear as tuples: appending to one would be lost.
template <typename E>
struct Convert<std::vector<E>> {
  static std::string type() { return "Tuple[" + Convert<E>::type() + ", ...]"; }
  static py::object show(const std::vector<E>& member, py::handle owner) {
    py::tuple out(member.size());
    for (size_t i = 0; i < member.size(); ++i) out[i] = python::show(member[i], owner);
    return std::move(out);
  }
  static std::vector<E> read(py::handle value, const std::string& what) {
    if (py::isinstance<py::str>(value) || !py::isinstance<py::iterable>(value))
      throw py::type_error(what + ": expected a sequence, got " + std::string(py::repr(py::type::of(value))));
    std::vector<E> out;
    for (const py::handle entry : value)
      out.push_back(python::read<E>(entry, what + "[" + std::to_string(out.size()) + "]"));
    return out;
  }
  static bool same(const std::vector<E>& a, const std::vector<E>& b) {
    bool all = a.size() == b.size();
    for (size_t i = 0; all && i < a.size(); ++i) all = python::same(a[i], b[i]);
    return all;
  }
};

template <typename E, size_t N>
struct Convert<std::array<E, N>> {
  using List = Convert<std::vector<E>>;
  static std::string type() { return "Tuple[" + Convert<E>::type() + ", ...]"; }
  static py::object show(const std::array<E, N>& member, py::handle owner) {
    py::tuple out(N);
    for (size_t i = 0; i < N; ++i) out[i] = python::show(member[i], owner);
    return std::move(out);
  }
  static std::array<E, N> read(py::handle value, const std::string& what) {
    const std::vector<E> list = List::read(value, what);
    if (list.size() != N) throw py::value_error(what + ": expected " + std::to_string(N) + " entries");
    std::array<E, N> out;
    std::copy(list.begin(), list.end(), out.begin());
    return out;
  }
  static bool same(const std::array<E, N>& a, const std::array<E, N>& b) {
    return List::same({a.begin(), a.end()}, {b.begin(), b.end()});
  }
};

/// As Python has it: bool, int, float or str.
template <>
struct Convert<OptionValue> {
  static std::string type() { return "Union[bool, int, float, str]"; }
  static py::object show(const OptionValue& member, py::handle) {
    return std::visit([](const auto& value) -> py::object { return py::cast(value); }, member);
  }
  static OptionValue read(py::handle value, const std::string& what) {
    if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
    if (py::isinstance<py::str>(value)) return value.cast<std::string>();
    const double number = Convert<double>::read(value, what);
    if (PyIndex_Check(value.ptr()) && std::abs(number) <= std::numeric_limits<int>::max())
      return static_cast<int>(number);
    return number;
  }
  static bool same(const OptionValue& a, const OptionValue& b) { return a == b; }
};

/// An entry of `motions` and of `generators`.
inline py::dict describeOption(const Option& option) {
  py::dict out;
  out["default"] = Convert<OptionValue>::show(option.value, {});
  out["unit"] = option.unit;
  out["lower"] = option.bounds.lower;
  out["upper"] = option.bounds.upper;
  out["help"] = option.help;
  out["choices"] = Convert<std::vector<std::string>>::show(option.choices, {});
  return out;
}

/// Things by name, in order: a dictionary.
template <typename Named>
struct ConvertNamed {
  using Entry = std::decay_t<decltype(std::declval<Named>().begin()->second)>;
  static std::string type() { return "Dict[str, " + Convert<Entry>::type() + "]"; }
  static py::object show(const Named& member, py::handle owner) {
    py::dict out;
    for (const auto& [name, value] : member) out[py::str(name)] = python::show(value, owner);
    return std::move(out);
  }
  static Named read(py::handle value, const std::string& what) {
    if (!py::isinstance<py::dict>(value))
      throw py::type_error(what + ": expected a dictionary, got " + std::string(py::repr(py::type::of(value))));
    Named out;
    for (const auto& [name, entry] : py::reinterpret_borrow<py::dict>(value)) {
      const std::string key = python::read<std::string>(name, what + ", a name");
      out.insert(out.end(), {key, python::read<Entry>(entry, what + "['" + key + "']")});
    }
    return out;
  }
  static bool same(const Named& a, const Named& b) {
    bool all = a.size() == b.size();
    for (auto i = a.begin(), j = b.begin(); all && i != a.end(); ++i, ++j)
      all = i->first == j->first && python::same(i->second, j->second);
    return all;
  }
};
template <typename E>
struct Convert<std::map<std::string, E>> : ConvertNamed<std::map<std::string, E>> {};
template <typename E>
struct Convert<std::vector<std::pair<std::string, E>>> : ConvertNamed<std::vector<std::pair<std::string, E>>> {};

template <typename E>
struct Convert<std::optional<E>> {
  static std::string type() { return "Optional[" + Convert<E>::type() + "]"; }
  static py::object show(const std::optional<E>& member, py::handle owner) {
    return member ? python::show(*member, owner) : py::none();
  }
  static std::optional<E> read(py::handle value, const std::string& what) {
    return value.is_none() ? std::nullopt : std::optional<E>(python::read<E>(value, what));
  }
  static bool same(const std::optional<E>& a, const std::optional<E>& b) {
    return a.has_value() == b.has_value() && (!a || python::same(*a, *b));
  }
};

}  // namespace bielle::python
