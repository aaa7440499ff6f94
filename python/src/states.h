#pragma once
/// \file Functions of states, for one state or for many at once on all cores.
#include <functional>

#include "arrays.h"

namespace bielle::python {

/// An argument of shape (size,), or (N, size) for N states; arguments of one state go with all states of the others.
struct StateInput {
  const char* name;
  py::handle value;
  Eigen::Index size;
};

using InputVector = Eigen::Map<const VectorXd>;
using OutputVector = Eigen::Map<VectorXd>;
using OutputMatrix = Eigen::Map<RowMatrixXd>;

/// The arguments of one state, and where its results belong.
struct State {
  std::vector<InputVector> in;
  std::vector<OutputVector> out;  ///< each with as many entries as its shape has
  /// Result i as a matrix of so many columns.
  OutputMatrix matrix(size_t i, Eigen::Index columns) {
    return {out[i].data(), columns == 0 ? 0 : out[i].size() / columns, columns};
  }
};

/// Calls the functions that `makeWorker` makes, one per thread and with its own memory, for every state, without the
/// interpreter's lock. Results are arrays of the given shapes, after an axis of the states where an argument has one.
/// \throws ValueError on arguments of other shapes
std::vector<py::array> mapStates(const std::vector<StateInput>& inputs, const std::vector<Shape>& outputs,
                                 const std::function<std::function<void(State&)>()>& makeWorker);

}  // namespace bielle::python
