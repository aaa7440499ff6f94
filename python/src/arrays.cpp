#include "arrays.h"

namespace bielle::python {

std::string formatShape(const Shape& shape) {
  std::string text = "(";
  for (size_t i = 0; i < shape.size(); ++i)
    text += (i == 0 ? "" : ", ") + (shape[i] < 0 ? std::string("n") : std::to_string(shape[i]));
  return text + (shape.size() == 1 ? ",)" : ")");
}

py::array makeView(const double* data, const Shape& shape, const Shape& strides, py::handle owner) {
  Shape bytes;
  for (const py::ssize_t stride : strides) bytes.push_back(stride * static_cast<py::ssize_t>(sizeof(double)));
  py::array view(py::dtype::of<double>(), shape, bytes, data, owner);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

Array readArray(py::handle value, const std::string& what) {
  const py::array given = py::array::ensure(value);
  if (!given) throw py::type_error(what + ": expected numbers, got " + std::string(py::str(py::type::of(value))));
  if (std::string("biuf").find(given.dtype().kind()) == std::string::npos)
    throw py::type_error(what + ": expected numbers, got an array of " + std::string(py::str(given.dtype())));
  return Array(given);
}

void requireShape(const Array& array, const Shape& shape, const std::string& what) {
  bool same = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (size_t i = 0; same && i < shape.size(); ++i) same = shape[i] < 0 || array.shape(i) == shape[i];
  if (same) return;
  throw py::value_error(what + ": expected shape " + formatShape(shape) + ", got " +
                        formatShape(Shape(array.shape(), array.shape() + array.ndim())));
}

VectorXd readVector(py::handle value, Eigen::Index size, const std::string& what) {
  const Array array = readArray(value, what);
  requireShape(array, {size}, what);
  return Eigen::Map<const VectorXd>(array.data(), array.size());
}

}  // namespace bielle::python
