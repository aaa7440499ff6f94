#include "engines.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "worlds/make_world.h"

namespace py = pybind11;

namespace {

std::unique_ptr<bielle::worlds::World> makeWorld(const std::string& name, const bielle::Model& model,
                                                 const bielle::worlds::WorldOptions& options) {
  return bielle::worlds::makeWorld(name, model, options);
}

constexpr bielle::python::MakeWorld kMakeWorld = &makeWorld;  // of the type that the capsule promises

}  // namespace

PYBIND11_MODULE(_engines, module) {
  module.doc() = "The worlds of Simbody and MuJoCo; bielle.World(engine=...) uses them.";
  module.attr("make_world") = py::capsule(reinterpret_cast<void*>(kMakeWorld), bielle::python::kEnginesCapsule);
  module.attr("names") = py::cast(bielle::worlds::listWorlds());
}
