#include "bind.h"

namespace py = pybind11;

namespace {

// pybind11 lets two things pass where a function takes one of our objects: None, as a null pointer, and an object that
// __new__ alone has made, as memory that nobody has written to. All types refuse both here, whatever the functions are.
void refuseNothing(const py::module_& module) {
  for (const auto& [name, member] : module.attr("__dict__").cast<py::dict>()) {
    if (!py::isinstance<py::type>(member)) continue;
    py::detail::type_info* type = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(member.ptr()));
    if (!type) continue;
    // Conversions are tried before None becomes a null pointer. This error makes it the TypeError of wrong arguments.
    type->implicit_conversions.push_back([](PyObject* value, PyTypeObject*) -> PyObject* {
      if (value == Py_None) throw py::reference_cast_error();
      return nullptr;
    });
    // Called for the memory of objects that have none when they are used.
    type->operator_new = [](size_t) -> void* {
      throw py::type_error("this object is empty: __init__ was never called; make it by calling its class");
    };
  }
}

}  // namespace

PYBIND11_MODULE(_bielle, module) {
  module.doc() = "Bielle's C++ library; import bielle instead.";
  // Types are found, by pickle too, where users find them.
  const py::object name = module.attr("__name__");
  module.attr("__name__") = "bielle";
  using namespace bielle::python;
  for (const auto bind :
       {bindErrors,       bindGeometry,     bindModelValues, bindModel,     bindKinematics,      bindDynamics,
        bindRobots,       bindTransmission, bindOcpValues,   bindResiduals, bindPythonResiduals, bindSolverValues,
        bindMotionValues, bindMotions,      bindResults,     bindLift,      bindDesign,          bindControllers,
        bindEstimator,    bindWorlds})
    bind(module);
  refuseNothing(module);
  module.attr("__name__") = name;
}
