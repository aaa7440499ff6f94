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
    getFields<T>().push_back({name, [member](const T& self, py::handle owner) { return show(self.*member, owner); },
                              [member, what](T& self, py::handle value) { self.*member = read<M>(value, what); },
                              [member](const T& a, const T& b) { return same(a.*member, b.*member); }});
    type_.def_property_readonly(
        name, [member](const py::object& self) { return show(self.cast<const T&>().*member, self); }, doc);
    types_[name] = Convert<M>::type();
    fields_doc_ += std::string("    ") + name + ": " + doc + "\n";
    return *this;
  }

  py::class_<T>& type() { return type_; }

 private:
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
