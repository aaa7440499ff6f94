#pragma once
/// \file Closures that differ from those of the model, as rods of other lengths do, from robot to robot of a register.
#include "bielle/dynamics/closure.h"

namespace bielle {

/// Of one closure. Where nothing differs, its rows are those of the model to the last bit.
template <typename T>
struct ClosureChangeOf {
  Vector3<T> shift1 = Vector3<T>::Zero(), shift2 = Vector3<T>::Zero();  ///< of frames 1 and 2, each in itself, m
  T length = 0, square = 0;                                             ///< of a distance, m, and its square
};

/// As those of closure.h. \param change  null: that of the model
template <typename T>
VectorUpTo6<T> calcClosureResidual(const WorkspaceOf<T>& ws, const Closure& closure, const ClosureChangeOf<T>* change);
template <typename T>
VectorUpTo6<T> calcClosureAcceleration(const WorkspaceOf<T>& ws, const Closure& closure,
                                       const ClosureChangeOf<T>* change);
template <typename T>
void calcClosureJacobian(const WorkspaceOf<T>& ws, const Closure& closure, const ClosureChangeOf<T>* change,
                         typename ArgumentsOf<T>::Matrix J);

}  // namespace bielle
