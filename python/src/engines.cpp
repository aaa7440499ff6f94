#include "engines.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "simulation/make_world.h"

namespace py = pybind11;

PYBIND11_MODULE(_engines, module) {
  module.doc() = "The worlds of Simbody and MuJoCo; bielle.World(engine=...) uses them.";
  module.attr("make_world") =
      py::capsule(reinterpret_cast<void*>(&bielle::simulation::makeWorld), bielle::python::kEnginesCapsule);
  module.attr("names") = py::cast(bielle::simulation::listWorlds());
}
