#include "worlds/rod_pivots.h"

#include <algorithm>

namespace bielle::worlds {

// The reduced coordinates of a pivot are those of its cluster, since it is in a loop: rows of one cluster have their
// entries in one order.
template <typename T>
RodPivotsOf<T>::RodPivotsOf(const Model& model, const ClosedTreeOf<T>& tree, const std::vector<RodFriction>& frictions)
    : bearings_(makeRodBearings(model, frictions)) {
  for (size_t b = 0; b < bearings_.size(); ++b) {
    closures_.push_back(bearings_[b].closure);
    for (const RodBearing::Pivot& dofs : bearings_[b].pivots) {
      Pivot& pivot = pivots_.emplace_back();
      pivot.bearing = static_cast<Eigen::Index>(b);
      pivot.dofs = &dofs;
      tree.visitRow(dofs.front().first, [&](int k, const T&) { pivot.outer.push_back(k); });
      pivot.turns.assign(pivot.outer.size(), Vector3<T>::Zero());
    }
  }
}

template <typename T>
void RodPivotsOf<T>::update(const ClosedTreeOf<T>& tree) {
  for (Pivot& pivot : pivots_) {
    for (Vector3<T>& turn : pivot.turns) turn.setZero();
    for (const auto& [dof, sign] : *pivot.dofs) {
      const Vector3<T> axis = T(sign) * tree.columns().col(dof).template tail<3>();
      size_t o = 0;
      tree.visitRow(dof, [&](int, const T& entry) { pivot.turns[o++] += entry * axis; });
    }
  }
}

template <typename T>
void RodPivotsOf<T>::add(const Vector& forces, const Vector& w, Vector& loads, MatrixX<T>* damping) {
  for (Pivot& pivot : pivots_) {
    Vector3<T> rate = Vector3<T>::Zero();
    for (size_t o = 0; o < pivot.outer.size(); ++o) rate += w[pivot.outer[o]] * pivot.turns[o];
    const RodFriction& law = bearings_[static_cast<size_t>(pivot.bearing)].law;
    const RodTorqueOf<T> friction = calcRodTorque<T>(law, forces[pivot.bearing], rate);
    pivot.torque = friction.torque;
    pivot.power = rate.dot(pivot.torque);
    for (size_t o = 0; o < pivot.outer.size(); ++o) {
      const Vector3<T>& turn = pivot.turns[o];
      loads[pivot.outer[o]] += turn.dot(pivot.torque);
      if (!damping) continue;
      const Vector3<T> resisted = friction.slope * turn - (friction.fall * rate.dot(turn)) * rate;
      for (size_t p = 0; p < pivot.outer.size(); ++p)
        (*damping)(pivot.outer[p], pivot.outer[o]) += pivot.turns[p].dot(resisted);
    }
  }
}

template <typename T>
T RodPivotsOf<T>::power() const {
  T sum = 0;
  for (const Pivot& pivot : pivots_) sum += pivot.power;
  return sum;
}

template <typename T>
void RodPivotsOf<T>::addToDofs(const ClosedTreeOf<T>& tree, Vector& forces) const {
  for (const Pivot& pivot : pivots_)
    for (const auto& [dof, sign] : *pivot.dofs)
      forces[dof] += T(sign) * tree.columns().col(dof).template tail<3>().dot(pivot.torque);
}

template class RodPivotsOf<double>;
template class RodPivotsOf<Lanes>;

}  // namespace bielle::worlds
