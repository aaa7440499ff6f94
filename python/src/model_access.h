#pragma once
/// \file What the functions of a model have in common: its type in Python, frames and contacts by name.
#include <memory>

#include "bielle/dynamics/closure.h"
#include "states.h"
#include "value.h"

namespace bielle::python {

/// Python shares models with everything that is made of them.
using ModelType = py::class_<Model, std::shared_ptr<Model>>;
inline ModelType getModelType(py::module_& module) { return py::reinterpret_borrow<ModelType>(module.attr("Model")); }

template <>
struct Convert<std::shared_ptr<Model>> {
  static std::string type() { return "Model"; }
  static py::object show(const std::shared_ptr<Model>& member, py::handle) { return py::cast(member); }
  static std::shared_ptr<Model> read(py::handle value, const std::string& what) {
    if (value.is_none()) return nullptr;  // of a value that was made without one
    if (!py::isinstance<Model>(value)) throw py::type_error(what + ": expected a Model");
    return value.cast<std::shared_ptr<Model>>();
  }
  static bool same(const std::shared_ptr<Model>& a, const std::shared_ptr<Model>& b);
};

/// The link, frame or contact of a name. \throws InputError when the robot has none
Frame findFrame(const Model& model, const std::string& name);

/// Index of a contact. \throws InputError when the robot has none of this name
int findContact(const Model& model, const std::string& name);

/// A set of the model: its closures and contacts, with places of the contacts and gains that may be any.
/// \throws ValueError when it is none
ConstraintSet requireFit(const Model& model, const ConstraintSet& set);

/// Closures and contacts in force, from a ConstraintSet, or from a sequence of names of contacts and ContactTargets.
ConstraintSet readConstraints(const Model& model, py::handle contacts);

/// An object of a class of named results (bielle/named.py).
py::object makeNamed(const char* type, const std::vector<py::array>& arrays);

}  // namespace bielle::python
