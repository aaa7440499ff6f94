#pragma once
/// \file Residuals as Python sees them: those of the library know how they were made, those written in Python are called
/// with the interpreter's lock.
#include "bielle/ocp/cost.h"
#include "bielle/ocp/robot_problem.h"
#include "model_access.h"

namespace bielle::python {

/// A reference to a Python object that any thread may drop.
class SharedObject {
 public:
  explicit SharedObject(py::object object) : object_(std::move(object)) {}
  SharedObject(const SharedObject&) = delete;
  ~SharedObject() {
    const py::gil_scoped_acquire lock;
    object_ = {};
  }
  const py::object& get() const { return object_; }

 private:
  py::object object_;
};

/// A residual written in Python (bielle.Residual) for the solver. \throws TypeError when it is none
std::shared_ptr<const Residual> makePythonResidual(const py::object& residual);
/// The object written in Python; null for residuals of the library.
py::object getPythonResidual(const Residual& residual);

/// A residual of the library in Python.
struct LibraryResidual {
  std::shared_ptr<const Residual> residual;
};

/// Remembers how to make the residuals of these stages again, as far as they do not tell it themselves: those that the
/// library has put into a motion. Returns them in the order of the stages. As often as a motion is made of the recipe, a
/// bielle.residuals.Recipe, they are the same.
std::vector<LibraryResidual> rememberResiduals(const std::vector<StageSpec>& stages, const py::object& recipe);

template <>
struct Convert<std::shared_ptr<const Residual>> {
  static std::string type() { return "Union[LibraryResidual, Residual]"; }
  static py::object show(const std::shared_ptr<const Residual>& member, py::handle) {
    if (!member) return py::none();
    const py::object own = getPythonResidual(*member);
    return own ? own : py::cast(LibraryResidual{member});
  }
  static std::shared_ptr<const Residual> read(py::handle value, const std::string&) {
    if (value.is_none()) return nullptr;
    if (py::isinstance<LibraryResidual>(value)) return value.cast<LibraryResidual>().residual;
    return makePythonResidual(py::reinterpret_borrow<py::object>(value));
  }
  static bool same(const std::shared_ptr<const Residual>& a, const std::shared_ptr<const Residual>& b) {
    return a == b || (a && b && show(a, {}).equal(show(b, {})));
  }
};

}  // namespace bielle::python
