#include <algorithm>
#include <cstdio>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/impact.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/motion/motion.h"
#include "bind.h"
#include "model_access.h"

namespace bielle::python {
namespace {

// What one thread needs for constrained dynamics.
struct ConstrainedMemory {
  explicit ConstrainedMemory(const Model& model) : ws(model) {}
  Workspace ws;
  ConstrainedWorkspace cws;
};

// The status, as a number, goes with the result of a state; results of a state without one are NaN.
bool record(NumericalStatus status, State& s) {
  s.out.back()[0] = static_cast<double>(status);
  const bool valid = status == NumericalStatus::Ok || status == NumericalStatus::Contradictory;
  if (!valid)
    for (size_t i = 0; i + 1 < s.out.size(); ++i) s.out[i].setConstant(std::numeric_limits<double>::quiet_NaN());
  return valid;
}

// Dynamics of a state that the robot cannot be in, or of velocities that it cannot have, are those of no motion.
// \param v  none: it rests
void warnOfOpenLoops(const Model& m, const py::object& q, const py::object& v = py::none()) {
  constexpr double kTold = 1e-6;  // m or rad; of velocities, over the largest
  if (m.closures().empty()) return;
  const ConstraintSet loops = makeConstraintSet(m);
  std::vector<StateInput> inputs = {{"q", q, m.nq()}};
  if (!v.is_none()) inputs.push_back({"v", v, m.nv()});
  const std::vector<py::array> open = mapStates(inputs, {{}, {}}, [&] {
    return [&, ws = std::make_shared<Workspace>(m)](State& s) {
      updatePositions(m, *ws, s.in[0]);
      s.out[0][0] = calcLargestGap(*ws, loops);
      double& opening = s.out[1][0] = 0;
      if (s.in.size() == 1) return;
      updateVelocities<double>(m, *ws, s.in[1]);
      for (const Closure& closure : m.closures())
        opening = std::max(opening, calcClosureVelocity(*ws, closure).cwiseAbs().maxCoeff());
      opening /= 1 + s.in[1].lpNorm<Eigen::Infinity>();
    };
  });
  const auto findLargest = [&open](size_t i) {
    const double* const begin = static_cast<const double*>(open[i].data());
    return open[i].size() > 0 ? *std::max_element(begin, begin + open[i].size()) : 0;
  };
  // Numbers have one digit: Python tells the same text once a line.
  char text[200] = "";
  if (const double gap = findLargest(0); gap > kTold)
    std::snprintf(
        text, sizeof text,
        "loops are open by up to %.0e (m or rad): the robot cannot be in this state; close(q) gives one near it", gap);
  else if (const double opening = findLargest(1); opening > kTold)
    std::snprintf(
        text, sizeof text,
        "velocities open loops by up to %.0e of the largest: the robot cannot move so; project_velocity(q, v) "
        "gives some that keep them closed",
        opening);
  if (*text && PyErr_WarnEx(PyExc_RuntimeWarning, text, 1) < 0) throw py::error_already_set();
}

void solveForward(const Model& m, const ConstraintSet& set, ConstrainedMemory& memory, State& s) {
  if (!record(updateConstrainedDynamics(m, memory.ws, memory.cws, set, s.in[0], s.in[1], calcMotorForces(m, s.in[2])),
              s))
    return;
  s.out[0] = memory.cws.a;
  s.out[1] = memory.cws.lambda;
}

void solveForwardDerivatives(const Model& m, const ConstraintSet& set, ConstrainedMemory& memory, State& s) {
  const ConstrainedWorkspace& cws = memory.cws;
  if (!record(updateConstrainedDynamics(m, memory.ws, memory.cws, set, s.in[0], s.in[1], calcMotorForces(m, s.in[2])),
              s) ||
      !record(updateConstrainedDerivatives(m, memory.ws, memory.cws, set), s))
    return;
  const MatrixXd* results[] = {&cws.da_dq, &cws.da_dv, &cws.da_du, &cws.dlambda_dq, &cws.dlambda_dv, &cws.dlambda_du};
  for (size_t i = 0; i < 6; ++i) s.matrix(i, results[i]->cols()) = *results[i];
}

void addForward(ModelType& type) {
  using Solve = void (*)(const Model&, const ConstraintSet&, ConstrainedMemory&, State&);
  const auto def = [&type](const char* name, const char* result, auto getShapes, Solve solve, const char* doc) {
    type.def(
        name,
        [result, getShapes, solve](const Model& m, const py::object& q, const py::object& v, const py::object& u,
                                   const py::object& contacts) {
          const ConstraintSet set = readConstraints(m, contacts);
          warnOfOpenLoops(m, q, v);
          return makeNamed(
              result, mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}, {"u", u, m.nu()}}, getShapes(m, set), [&] {
                return [&, memory = std::make_shared<ConstrainedMemory>(m)](State& s) { solve(m, set, *memory, s); };
              }));
        },
        py::arg("q"), py::arg("v"), py::arg("u"), py::arg("contacts") = py::tuple(), doc);
  };
  def(
      "forward_dynamics", "Dynamics",
      [](const Model& m, const ConstraintSet& set) {
        return std::vector<Shape>{{m.nv()}, {set.rows}, {}};
      },
      solveForward,
      "Accelerations a (nv,) and forces of closures and contacts (rows,) under motor torques u (nu,).\n\n"
      "contacts: names, ContactTargets, or a ConstraintSet. Forces are those on body 1, in frame 1 of each closure.");
  def(
      "forward_dynamics_derivatives", "DynamicsDerivatives",
      [](const Model& m, const ConstraintSet& set) {
        return std::vector<Shape>{{m.nv(), m.nv()},
                                  {m.nv(), m.nv()},
                                  {m.nv(), m.nu()},
                                  {set.rows, m.nv()},
                                  {set.rows, m.nv()},
                                  {set.rows, m.nu()},
                                  {}};
      },
      solveForwardDerivatives,
      "Derivatives of forward_dynamics by the tangent of q, by v and by u: of a (nv, ..) and of the forces (rows, "
      "..).");
}

void addInverse(ModelType& type) {
  type.def(
      "inverse_dynamics",
      [](const Model& m, const py::object& q, const py::object& v, const py::object& a) {
        return mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}, {"a", a, m.nv()}}, {{m.nv()}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            s.out[0] = calcInverseDynamics(m, *ws, s.in[0], s.in[1], s.in[2]);
          };
        })[0];
      },
      py::arg("q"), py::arg("v"), py::arg("a"),
      "Generalized forces M a + b of the tree (nv,), closures and contacts apart, N m or N.");
  type.def(
      "inverse_dynamics_derivatives",
      [](const Model& m, const py::object& q, const py::object& v, const py::object& a) {
        const Shape square = {m.nv(), m.nv()};
        const auto work = [&m](Workspace& ws, State& s) {
          calcInverseDynamics(m, ws, s.in[0], s.in[1], s.in[2]);
          updateInverseDynamicsDerivatives(m, ws, {});
          updateMassMatrix(m, ws);
          const MatrixXd* results[] = {&ws.dID_dq, &ws.dID_dv, &ws.M};
          for (size_t i = 0; i < 3; ++i) s.matrix(i, m.nv()) = *results[i];
        };
        return makeNamed(
            "InverseDynamicsDerivatives",
            mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}, {"a", a, m.nv()}}, {square, square, square},
                      [&] { return [work, ws = std::make_shared<Workspace>(m)](State& s) { work(*ws, s); }; }));
      },
      py::arg("q"), py::arg("v"), py::arg("a"),
      "Derivatives of inverse_dynamics by the tangent of q, by v and by a (nv, nv).");
  type.def(
      "static_torques",
      [](const Model& m, const py::object& q, const py::object& contacts) {
        const ConstraintSet set = readConstraints(m, contacts);
        warnOfOpenLoops(m, q);
        return mapStates({{"q", q, m.nq()}}, {{m.nu()}},
                         [&] { return [&](State& s) { s.out[0] = calcStaticTorques(m, set, s.in[0]).u; }; })[0];
      },
      py::arg("q"), py::arg("contacts") = py::tuple(),
      "The smallest motor torques that hold the robot still under closures and contacts (nu,), as far as possible.");
}

void addImpact(ModelType& type) {
  type.def(
      "impact",
      [](const Model& m, const py::object& q, const py::object& v, const py::object& contacts) {
        const ConstraintSet set = readConstraints(m, contacts);
        warnOfOpenLoops(m, q, v);
        return makeNamed("Impact", mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}}, {{m.nv()}, {set.rows}, {}}, [&] {
                           return [&, iws = std::make_shared<ImpactWorkspace>(m)](State& s) {
                             if (!record(updateImpact(m, *iws, set, s.in[0], s.in[1]), s)) return;
                             s.out[0] = iws->v_plus;
                             s.out[1] = iws->impulse;
                           };
                         }));
      },
      py::arg("q"), py::arg("v"), py::arg("contacts"),
      "Rigid impact: the velocity after it (nv,) and the impulses (rows,), N s and N m s.");
  type.def(
      "impact_derivatives",
      [](const Model& m, const py::object& q, const py::object& v, const py::object& contacts) {
        const ConstraintSet set = readConstraints(m, contacts);
        const Shape square = {m.nv(), m.nv()}, rows = {set.rows, m.nv()};
        warnOfOpenLoops(m, q, v);
        return makeNamed(
            "ImpactDerivatives", mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}}, {square, square, rows, rows, {}}, [&] {
              return [&, iws = std::make_shared<ImpactWorkspace>(m)](State& s) {
                if (!record(updateImpact(m, *iws, set, s.in[0], s.in[1]), s) ||
                    !record(updateImpactDerivatives(m, *iws, set), s))
                  return;
                const MatrixXd* results[] = {&iws->dv_dq, &iws->dv_dv, &iws->dimpulse_dq, &iws->dimpulse_dv};
                for (size_t i = 0; i < 4; ++i) s.matrix(i, m.nv()) = *results[i];
              };
            }));
      },
      py::arg("q"), py::arg("v"), py::arg("contacts"), "Derivatives of impact by the tangent of q and by v.");
}

void bindStatus(py::module_& module) {
  py::enum_<NumericalStatus> type(module, "NumericalStatus", "How a computation ended.");
  const std::pair<const char*, NumericalStatus> values[] = {{"OK", NumericalStatus::Ok},
                                                            {"NOT_FINITE", NumericalStatus::NotFinite},
                                                            {"SINGULAR", NumericalStatus::Singular},
                                                            {"INDEFINITE", NumericalStatus::Indefinite},
                                                            {"CONTRADICTORY", NumericalStatus::Contradictory},
                                                            {"NOT_CLOSED", NumericalStatus::NotClosed},
                                                            {"NEAR_DEAD_POINT", NumericalStatus::NearDeadPoint},
                                                            {"UNBALANCED", NumericalStatus::Unbalanced},
                                                            {"INACCURATE", NumericalStatus::Inaccurate},
                                                            {"NOT_CONVERGED", NumericalStatus::NotConverged},
                                                            {"FAILED", NumericalStatus::Failed}};
  for (const auto& [name, value] : values) type.value(name, value, getMessage(value));
}

}  // namespace

void bindDynamics(py::module_& module) {
  bindStatus(module);
  ModelType type = getModelType(module);
  addForward(type);
  addInverse(type);
  addImpact(type);
}

}  // namespace bielle::python
