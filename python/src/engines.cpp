#include "engines.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "worlds/make_world.h"

namespace py = pybind11;

PYBIND11_MODULE(_engines, module) {
  module.doc() = "The worlds of Simbody and MuJoCo; bielle.World(engine=...) uses them.";
  module.attr("make_world") =
      py::capsule(reinterpret_cast<void*>(&bielle::worlds::makeWorld), bielle::python::kEnginesCapsule);
  module.attr("names") = py::cast(bielle::worlds::listWorlds());
}
