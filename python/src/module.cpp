#include "bind.h"

namespace py = pybind11;

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
  module.attr("__name__") = name;
}
