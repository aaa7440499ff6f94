#pragma once
/// \file Plain structs as immutable Python values, from one list of their members: constructor, attributes, `replace`,
/// `repr`, `==`, `copy` and pickle follow from it.
#include <functional>

#include "convert.h"

namespace bielle::python {

/// One member of T.
template <typename T>
struct Field {
  std::string name;
  std::function<py::object(const T&, py::handle owner)> show;
  std::function<void(T&, py::handle value)> read;
  std::function<bool(const T&, const T&)> same;
};

template <typename T>
std::vector<Field<T>>& getFields() {
  static std::vector<Field<T>> fields;
  return fields;
}

template <typename M, typename Condition>
bool Convert<M, Condition>::same(const M& a, const M& b) {
  if constexpr (std::is_class_v<M> && !std::is_same_v<M, std::string>) {
    for (const Field<M>& field : getFields<M>())
      if (!field.same(a, b)) return false;
    return true;
  } else {
    return a == b;
  }
}

/// How a member of a value appears in its repr: long arrays and lists by their sizes.
std::string formatMember(const py::object& member);

/// Tells which of the names are meant. \throws TypeError listing them
[[noreturn]] void throwUnknownField(const std::string& type, const std::string& name, const std::string& names);

/// An option in Python: its type, a value like it, and its help with unit, values and default.
std::string getType(const OptionValue& value);
OptionValue readLike(const OptionValue& like, py::handle value, const std::string& what);
std::string describeField(const Option& option);

/// Value<T>(module, "Name", "what it is").field("name", &T::name, "what it is, unit")...
template <typename T>
class Value {
 public:
  Value(py::module_& module, const char* name, const std::string& doc) : name_(name), doc_(doc), type_(module, name) {
    getFields<T>().clear();
    type_.def(py::init([this_name = name_](const py::args& args, const py::kwargs& changes) {
      T value{};
      if (args.size() > getFields<T>().size())
        throw py::type_error(this_name + " has " + std::to_string(getFields<T>().size()) + " fields");
      for (size_t i = 0; i < args.size(); ++i) getFields<T>()[i].read(value, args[i]);
      change(this_name, value, changes);
      return value;
    }));
    type_.def(
        "replace",
        [this_name = name_](const T& self, const py::kwargs& changes) {
          T value = self;
          change(this_name, value, changes);
          return value;
        },
        "A copy with other values of the named fields.");
    type_.def("__eq__", [](const T& self, const py::object& other) -> py::object {
      if (!py::isinstance<T>(other)) return py::reinterpret_borrow<py::object>(Py_NotImplemented);
      return py::bool_(same(self, other.cast<const T&>()));
    });
    type_.def("__repr__", [this_name = name_](const py::object& self) {
      std::string text;
      for (const Field<T>& field : getFields<T>())
        text += (text.empty() ? "" : ", ") + field.name + "=" + formatMember(field.show(self.cast<const T&>(), self));
      return this_name + "(" + text + ")";
    });
    type_.def(py::pickle(
        [](const py::object& self) {
          py::dict state;
          for (const Field<T>& field : getFields<T>())
            state[field.name.c_str()] = field.show(self.cast<const T&>(), self);
          return state;
        },
        [this_name = name_](const py::dict& state) {
          T value{};
          change(this_name, value, state);
          return value;
        }));
  }
  ~Value() {
    type_.attr("_fields") = types_;  // what stubs are made of
    type_.doc() = doc_ + "\n\nImmutable; `replace` makes a changed copy.\n\nFields:\n" + fields_doc_;
  }

  template <typename M, typename Owner>
  Value& field(const char* name, M Owner::*member, const char* doc) {
    const std::string what = name_ + "." + name;
    return add({name, [member](const T& self, py::handle owner) { return show(self.*member, owner); },
                [member, what](T& self, py::handle value) { self.*member = read<M>(value, what); },
                [member](const T& a, const T& b) { return same(a.*member, b.*member); }},
               Convert<M>::type(), doc);
  }

  /// The numbers and truth values that describe() names; others have types of their own in Python.
  Value& described() {
    for (const Option& option : listOptions(T{})) {
      const std::string name = option.name;
      if (std::holds_alternative<std::string>(option.value)) continue;
      add({name,
           [name](const T& self, py::handle) {
             return Convert<OptionValue>::show(listOptions(self).get(name).value, {});
           },
           [name, owner = name_](T& self, py::handle value) {
             OptionSet options = listOptions(self, "field", owner);
             options.set(name, readLike(options.get(name).value, value, owner + "." + name));
             self = readOptions(options, self);
           },
           [name](const T& a, const T& b) { return listOptions(a).get(name).value == listOptions(b).get(name).value; }},
          getType(option.value), describeField(option).c_str());
    }
    return *this;
  }

  py::class_<T>& type() { return type_; }

 private:
  Value& add(const Field<T>& field, const std::string& kind, const char* doc) {
    getFields<T>().push_back(field);
    const auto get = [show = field.show](const py::object& self) { return show(self.cast<const T&>(), self); };
    type_.def_property_readonly(field.name.c_str(), get, doc);
    types_[field.name.c_str()] = kind;
    fields_doc_ += "    " + field.name + ": " + doc + "\n";
    return *this;
  }

  static void change(const std::string& type, T& value, const py::dict& changes) {
    for (const auto& [key, entry] : changes) {
      const std::string name = py::str(key);
      bool found = false;
      std::string names;
      for (const Field<T>& field : getFields<T>()) {
        names += (names.empty() ? "" : ", ") + field.name;
        if (field.name != name) continue;
        field.read(value, entry);
        found = true;
      }
      if (!found) throwUnknownField(type, name, names);
    }
  }

  std::string name_, doc_, fields_doc_;
  py::class_<T> type_;
  py::dict types_;
};

}  // namespace bielle::python
