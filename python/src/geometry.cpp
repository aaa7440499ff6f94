#include "bielle/math/se3.h"
#include "bind.h"
#include "value.h"

namespace bielle::python {
namespace {

Eigen::Matrix4d toMatrix(const SE3& X) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  out.topLeftCorner<3, 3>() = X.R;
  out.topRightCorner<3, 1>() = X.p;
  return out;
}

}  // namespace

void bindGeometry(py::module_& module) {
  Value<SE3>(module, "SE3", "A placement X_AB of a frame B in a frame A: p_A = R p_B + p. `X @ Y` chains placements.")
      .field("R", &SE3::R, "rotation (3, 3)")
      .field("p", &SE3::p, "position (3,), m")
      .type()
      .def("__matmul__", [](const SE3& a, const SE3& b) { return a * b; })
      .def("inverse", &SE3::inverse, "X_BA of X_AB.")
      .def(
          "act", [](const SE3& X, py::handle point) { return makeArray(X.act(readMatrix<Vector3d>(point, "point"))); },
          py::arg("point"), "Coordinates in A (3,) of a point given in B (3,), m.")
      .def_property_readonly(
          "matrix", [](const SE3& X) { return makeArray(toMatrix(X)); }, "homogeneous (4, 4)")
      .def_property_readonly(
          "action", [](const SE3& X) { return makeArray(X.toActionMatrix()); },
          "Ad(X) (6, 6), which carries twists (linear part first) from B to A")
      .def(
          "log", [](const SE3& X) { return makeArray(log6(X)); }, "Logarithm, a twist (6,), m and rad.")
      .def_static(
          "exp", [](py::handle twist) { return exp6(readMatrix<Vector6d>(twist, "twist")); }, py::arg("twist"),
          "Exponential of a twist (6,), linear part first, m and rad.");

  Value<Inertia>(module, "Inertia", "Mass, centre of mass and rotational inertia of a body in a frame.")
      .field("mass", &Inertia::mass, "kg")
      .field("com", &Inertia::com, "centre of mass (3,), m")
      .field("I_com", &Inertia::I_com, "about the centre of mass (3, 3), kg m^2")
      .type()
      .def("transformed", &Inertia::transformed, py::arg("X_AB"), "The same inertia in frame A, this one being in B.")
      .def("__add__", &Inertia::operator+)
      .def_property_readonly(
          "matrix", [](const Inertia& Y) { return makeArray(Y.toMatrix()); }, "spatial inertia (6, 6)");
}

}  // namespace bielle::python
