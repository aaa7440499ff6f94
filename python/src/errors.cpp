#include "bielle/model/error.h"
#include "bind.h"

namespace bielle::python {
namespace {

PyObject* model_error = nullptr;  // for the life of the interpreter

}  // namespace

void bindErrors(py::module_&) {
  model_error = py::module_::import("bielle.errors").attr("InputError").cast<py::object>().release().ptr();
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const InputError& e) {
      const py::object error = py::handle(model_error)(e.what(), e.source(), e.element(), e.problem(), e.remedy());
      PyErr_SetObject(model_error, error.ptr());
    }
  });
}

}  // namespace bielle::python
