#pragma once
/// \file The parts of the module, each in its own file, in the order in which their types need each other.
#include <pybind11/pybind11.h>

namespace bielle::python {

namespace py = pybind11;

void bindErrors(py::module_& module);
void bindGeometry(py::module_& module);
void bindModelValues(py::module_& module);
void bindModel(py::module_& module);
void bindKinematics(py::module_& module);
void bindDynamics(py::module_& module);
void bindRobots(py::module_& module);
void bindTransmission(py::module_& module);
void bindResiduals(py::module_& module);
void bindPythonResiduals(py::module_& module);
void bindOcpValues(py::module_& module);
void bindSolverValues(py::module_& module);
void bindMotionValues(py::module_& module);
void bindMotions(py::module_& module);
void bindResults(py::module_& module);
void bindLift(py::module_& module);
void bindDesign(py::module_& module);
void bindControllers(py::module_& module);
void bindEstimator(py::module_& module);
void bindWorlds(py::module_& module);

}  // namespace bielle::python
