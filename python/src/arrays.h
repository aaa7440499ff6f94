#pragma once
/// \file NumPy arrays: views of what Bielle owns, and arguments whose shape is checked.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "bielle/math/types.h"

namespace bielle::python {

namespace py = pybind11;
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape = std::vector<py::ssize_t>;

/// E.g. "(3,)" or "(N, 19)"; -1 stands for any size.
std::string formatShape(const Shape& shape);

/// A read-only array on memory of `owner`, which it keeps alive. Strides in numbers.
py::array makeView(const double* data, const Shape& shape, const Shape& strides, py::handle owner);

template <typename Derived>
py::array makeView(const Eigen::PlainObjectBase<Derived>& matrix, py::handle owner) {
  if constexpr (Derived::ColsAtCompileTime == 1) {
    return makeView(matrix.data(), {matrix.rows()}, {1}, owner);
  } else {
    const Shape strides = Derived::IsRowMajor ? Shape{matrix.cols(), 1} : Shape{1, matrix.rows()};
    return makeView(matrix.data(), {matrix.rows(), matrix.cols()}, strides, owner);
  }
}

/// The numbers of an argument. \throws TypeError unless they are numbers
Array readArray(py::handle value, const std::string& what);
/// \throws ValueError naming the wanted shape; -1 stands for any size
void requireShape(const Array& array, const Shape& shape, const std::string& what);

/// A vector or matrix of the wanted shape; sizes that are not fixed may be anything.
template <typename M>
M readMatrix(py::handle value, const std::string& what) {
  const Array array = readArray(value, what);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if constexpr (M::ColsAtCompileTime == 1) {
    requireShape(array, {M::RowsAtCompileTime}, what);
    return Eigen::Map<const VectorXd>(array.data(), array.size());
  } else {
    requireShape(array, {M::RowsAtCompileTime, M::ColsAtCompileTime}, what);
    return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
  }
}
/// A vector of a size known at run time only.
VectorXd readVector(py::handle value, Eigen::Index size, const std::string& what);

/// An array of its own with the numbers of a vector or matrix.
template <typename Derived>
py::array makeArray(const Eigen::MatrixBase<Derived>& matrix) {
  Array out(Derived::ColsAtCompileTime == 1 ? Shape{matrix.rows()} : Shape{matrix.rows(), matrix.cols()});
  Eigen::Map<RowMatrixXd>(out.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return std::move(out);
}

}  // namespace bielle::python
