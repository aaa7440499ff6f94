#include "states.h"

#include <exception>
#include <mutex>

namespace bielle::python {
namespace {

struct Rows {
  Array array;  // keeps the numbers
  const double* data;
  Eigen::Index size, step;  // from state to state; 0: the same for all
};

Rows readRows(const StateInput& input, py::ssize_t& count) {
  Array array = readArray(input.value, input.name);
  const bool many = array.ndim() == 2;
  const bool fits = (many || array.ndim() == 1) && array.shape(array.ndim() - 1) == input.size;
  if (!fits)
    throw py::value_error(std::string(input.name) + ": expected shape " + formatShape({input.size}) + " or (N, " +
                          std::to_string(input.size) + "), got " +
                          formatShape(Shape(array.shape(), array.shape() + array.ndim())));
  if (many && count >= 0 && array.shape(0) != count)
    throw py::value_error(std::string(input.name) + ": expected " + std::to_string(count) +
                          " states like the arguments before it, got " + std::to_string(array.shape(0)));
  if (many) count = array.shape(0);
  const double* data = array.data();
  return {std::move(array), data, input.size, many ? input.size : 0};
}

}  // namespace

std::vector<py::array> mapStates(const std::vector<StateInput>& inputs, const std::vector<Shape>& outputs,
                                 const std::function<std::function<void(State&)>()>& makeWorker) {
  py::ssize_t count = -1;  // one state, without an axis
  std::vector<Rows> rows;
  for (const StateInput& input : inputs) rows.push_back(readRows(input, count));
  const py::ssize_t states = count < 0 ? 1 : count;

  std::vector<py::array> results;
  std::vector<std::pair<double*, Eigen::Index>> memory;  // of the first state
  for (Shape shape : outputs) {
    Eigen::Index size = 1;
    for (const py::ssize_t extent : shape) size *= extent;
    if (count >= 0) shape.insert(shape.begin(), count);
    Array result(shape);
    memory.emplace_back(result.mutable_data(), size);
    results.push_back(std::move(result));
  }

  std::exception_ptr error;
  py::ssize_t error_state = states;
  std::mutex mutex;
  {
    const py::gil_scoped_release release;
#pragma omp parallel if (states > 1)
    {
      const std::function<void(State&)> work = makeWorker();
#pragma omp for schedule(static)
      for (py::ssize_t i = 0; i < states; ++i) {
        try {
          State state;
          for (const Rows& r : rows) state.in.emplace_back(r.data + i * r.step, r.size);
          for (const auto& [first, size] : memory) state.out.emplace_back(first + i * size, size);
          work(state);
        } catch (...) {
          const std::lock_guard<std::mutex> lock(mutex);
          if (i < error_state) error = std::current_exception(), error_state = i;
        }
      }
    }
  }
  if (error) std::rethrow_exception(error);
  return results;
}

}  // namespace bielle::python
