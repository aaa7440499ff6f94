#include "ocp/reduced/reduced_evaluation.h"

#include <algorithm>
#include <map>
#include <stdexcept>

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
  return a.weight == b.weight && a.q_ref == b.q_ref && a.v_ref == b.v_ref && a.weights == b.weights && a.axes == b.axes;
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
  for (size_t tip = 0; tip < tips.size(); ++tip) {
    slots.insert(slots.end(), most[tip], static_cast<int>(tip));
    outers.push_back(makeTip(model, reduction, tips[tip]).outer);
  }
  for (size_t k = 0; k < specs.size(); ++k) {
    contacts.push_back(makeContacts(specs[k]));
    most_contact_rows = std::max(most_contact_rows, contacts.back().rows);
    most_constraint_rows = std::max(most_constraint_rows, specs[k].constraints.rows);
    state_costs.push_back(-1);
    updateStateCost(static_cast<int>(k), specs);
  }
}

ContactLayout ReducedLayout::makeContacts(const StageSpec& spec) const {
  const ConstraintSet& set = spec.constraints;
  std::vector<char> taken(slots.size(), false);
  ContactLayout layout;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const Closure& closure = set.closures[c];
    const int rows = getRows(closure.kind);
    if (static_cast<int>(c) < set.num_loops) {
      layout.closure_rows += rows;
      continue;
    }
    size_t slot = 0;
    while (slot < slots.size() && (taken[slot] || tips[slots[slot]] != closure.body1)) ++slot;
    if (slot == slots.size())
      throw std::invalid_argument("RobotProblem: a stage has contacts that no stage had at construction");
    taken[slot] = true;
    layout.contacts.push_back({&closure, static_cast<int>(slot), layout.rows, rows, makeTurn(closure)});
    layout.rows += rows;
  }
  return layout;
}

void ReducedLayout::updateStage(int node, const std::vector<StageSpec>& specs) {
  contacts[node] = makeContacts(specs[node]);
  updateStateCost(node, specs);
}

void ReducedLayout::updateStateCost(int node, const std::vector<StageSpec>& specs) {
  state_costs[node] = -1;
  const StateCost& cost = specs[node].state;
  if (cost.weight == 0) return;
  for (size_t k = 0; k < state_costs.size() && state_costs[node] < 0; ++k)
    if (state_costs[k] >= 0 && isSame(specs[k].state, cost)) state_costs[node] = state_costs[k];
  if (state_costs[node] < 0) state_costs[node] = next_state_cost_++;
}

}  // namespace bielle
