#include "ocp/reduced/reduced_evaluation.h"

#include <algorithm>
#include <map>

namespace bielle {
namespace {

// Index of a value in a list, to which it is added if new.
int findOrAdd(std::vector<int>& list, int value) {
  const auto found = std::find(list.begin(), list.end(), value);
  const int index = static_cast<int>(found - list.begin());
  if (found == list.end()) list.push_back(value);
  return index;
}

Matrix3d makeTurn(const Closure& contact) {
  Matrix3d turn = Matrix3d::Zero();
  for (int c = 0; c < 3; ++c) {
    const Vector6d unit = Vector6d::Unit(3 + c);
    const auto rows = selectRows<double>(contact, unit);
    turn.col(c).head(rows.size() - 3) = rows.tail(rows.size() - 3);
  }
  return turn;
}

bool isSame(const StateCost& a, const StateCost& b) {
  return a.weight == b.weight && a.q_ref == b.q_ref && a.v_ref == b.v_ref && a.weights == b.weights;
}

}  // namespace

ReducedMidpoint::ReducedMidpoint(const Model& model, const Reduction& reduction) : X_WB(model.numBodies()) {
  for (const ReducedCluster& cluster : reduction.clusters) clusters.emplace_back(cluster);
  for (VectorXd* x : {&v, &a}) x->setZero(model.nv());
}

ReducedLayout::ReducedLayout(const Model& model, const Reduction& reduction, const std::vector<StageSpec>& specs) {
  std::vector<int> most;  // contacts of each tip at one node
  for (const StageSpec& spec : specs) {
    std::vector<int> count;
    for (size_t c = spec.constraints.num_loops; c < spec.constraints.closures.size(); ++c) {
      const size_t tip = findOrAdd(tips, spec.constraints.closures[c].body1);
      most.resize(tips.size());
      count.resize(tips.size());
      most[tip] = std::max(most[tip], ++count[tip]);
    }
  }
  std::vector<int> first_slots;  // of each tip
  for (size_t tip = 0; tip < tips.size(); ++tip) {
    first_slots.push_back(static_cast<int>(slots.size()));
    slots.insert(slots.end(), most[tip], static_cast<int>(tip));
    outers.push_back(makeTip(model, reduction, tips[tip]).outer);
  }
  std::vector<const StateCost*> different;
  for (const StageSpec& spec : specs) {
    const ConstraintSet& set = spec.constraints;
    std::vector<int> next = first_slots;
    ContactLayout layout;
    for (size_t c = 0; c < set.closures.size(); ++c) {
      const Closure& closure = set.closures[c];
      const int rows = getRows(closure.kind);
      if (static_cast<int>(c) < set.num_loops) {
        layout.closure_rows += rows;
        continue;
      }
      layout.contacts.push_back(
          {&closure, next[findOrAdd(tips, closure.body1)]++, layout.rows, rows, makeTurn(closure)});
      layout.rows += rows;
    }
    most_contact_rows = std::max(most_contact_rows, layout.rows);
    most_constraint_rows = std::max(most_constraint_rows, set.rows);
    contacts.push_back(std::move(layout));
    size_t cost = 0;
    while (cost < different.size() && !isSame(*different[cost], spec.state)) ++cost;
    if (spec.state.weight != 0 && cost == different.size()) different.push_back(&spec.state);
    state_costs.push_back(spec.state.weight != 0 ? static_cast<int>(cost) : -1);
  }
}

}  // namespace bielle
