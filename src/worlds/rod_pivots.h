#pragma once
/// \file Friction of rod ends (dynamics/rod_friction.h) in reduced coordinates, for the steps of leapfrog.h.
///
/// Each pivot has the forces of its closure in the last step, and friction at the mean velocity of this one: the
/// torques depend on w alone, as those of dampers do.
#include <vector>

#include "bielle/model/wear.h"
#include "dynamics/rod_friction.h"
#include "worlds/closed_tree.h"

namespace bielle::worlds {

template <typename T>
class RodPivotsOf {
 public:
  using Vector = VectorX<T>;

  /// \throws InputError as makeRodBearings() does
  RodPivotsOf(const Model& model, const ClosedTreeOf<T>& tree, const std::vector<RodFriction>& frictions);
  RodPivotsOf(const RodPivotsOf&) = delete;  // it points into itself
  RodPivotsOf& operator=(const RodPivotsOf&) = delete;

  bool empty() const { return pivots_.empty(); }
  const std::vector<int>& closures() const { return closures_; }  ///< with friction, each once
  /// At the placements of the tree.
  void update(const ClosedTreeOf<T>& tree);
  /// Adds the friction at w (size) under the forces (one per closure, N) to loads (size) and, if it is given, to a
  /// matrix of damping, which stiction may make indefinite.
  void add(const Vector& forces, const Vector& w, Vector& loads, MatrixX<T>* damping);
  T power() const;                                                    ///< of the last add(), W
  void addToDofs(const ClosedTreeOf<T>& tree, Vector& forces) const;  ///< likewise, nv

 private:
  struct Pivot {
    Eigen::Index bearing = 0;
    const RodBearing::Pivot* dofs = nullptr;
    std::vector<int> outer;         // indices into w,
    std::vector<Vector3<T>> turns;  // and what they turn one side by against the other (world)
    Vector3<T> torque = Vector3<T>::Zero();
    T power = 0;
  };
  const std::vector<RodBearing> bearings_;
  std::vector<int> closures_;
  std::vector<Pivot> pivots_;
};

}  // namespace bielle::worlds
