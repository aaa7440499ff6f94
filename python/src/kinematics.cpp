#include "bielle/dynamics/kinematics.h"

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/distance.h"
#include "bielle/dynamics/rnea.h"
#include "bind.h"
#include "model_access.h"

namespace bielle::python {
namespace {

using Work = void (*)(const Model& model, Workspace& ws, State& state);

// A function of q alone, or of q and v, whose single result has a shape; positions (and velocities) are up to date.
void defKinematics(ModelType& type, const char* name, bool with_velocity, std::function<Shape(const Model&)> getShape,
                   Work work, const char* doc) {
  const auto run = [getShape, work](const Model& m, const std::vector<StateInput>& inputs) {
    return mapStates(inputs, {getShape(m)}, [&m, work] {
      return [&m, work, ws = std::make_shared<Workspace>(m)](State& s) {
        updatePositions(m, *ws, s.in[0]);
        if (s.in.size() > 1) updateVelocities<double>(m, *ws, s.in[1]);
        work(m, *ws, s);
      };
    })[0];
  };
  if (with_velocity)
    type.def(
        name,
        [run](const Model& m, const py::object& q, const py::object& v) {
          return run(m, {{"q", q, m.nq()}, {"v", v, m.nv()}});
        },
        py::arg("q"), py::arg("v"), doc);
  else
    type.def(
        name,
        [run](const Model& m, const py::object& q) {
          return run(m, {{"q", q, m.nq()}});
        },
        py::arg("q"), doc);
}

std::function<Shape(const Model&)> always(const Shape& shape) {
  return [shape](const Model&) { return shape; };
}

void addWholeBody(ModelType& type) {
  defKinematics(
      type, "mass_matrix", false,
      [](const Model& m) {
        return Shape{m.nv(), m.nv()};
      },
      [](const Model& m, Workspace& ws, State& s) {
        updateMassMatrix(m, ws);
        s.matrix(0, m.nv()) = ws.M;
      },
      "Mass matrix (nv, nv), armature included.");
  defKinematics(
      type, "bias", true, [](const Model& m) { return Shape{m.nv()}; },
      [](const Model& m, Workspace& ws, State& s) {
        updateBias(m, ws);
        s.out[0] = ws.b;
      },
      "Coriolis, centrifugal and gravity terms b(q, v) (nv,), N m or N.");
  defKinematics(
      type, "com", false, always({3}), [](const Model& m, Workspace& ws, State& s) { s.out[0] = calcCom(m, ws); },
      "Centre of mass in the world (3,), m.");
  defKinematics(
      type, "com_velocity", true, always({3}),
      [](const Model& m, Workspace& ws, State& s) { s.out[0] = calcComVelocity(m, ws); },
      "Velocity of the centre of mass (3,), m/s.");
  defKinematics(
      type, "com_jacobian", false,
      [](const Model& m) {
        return Shape{3, m.nv()};
      },
      [](const Model& m, Workspace& ws, State& s) {
        updateMassMatrix(m, ws);
        Eigen::Matrix3Xd J(3, m.nv());
        calcComJacobian(m, ws, J);
        s.matrix(0, m.nv()) = J;
      },
      "Derivative of the centre of mass by the tangent of q (3, nv).");
  defKinematics(
      type, "centroidal_momentum", true, always({6}),
      [](const Model& m, Workspace& ws, State& s) { s.out[0] = calcCentroidalMomentum(m, ws); },
      "Momentum about the centre of mass in world axes (6,), kg m/s and kg m^2/s.");
  defKinematics(
      type, "kinetic_energy", true, always({}),
      [](const Model& m, Workspace& ws, State& s) { s.out[0][0] = calcKineticEnergy(m, ws); },
      "Kinetic energy of bodies and rotors, J.");
  defKinematics(
      type, "potential_energy", false, always({}),
      [](const Model& m, Workspace& ws, State& s) { s.out[0][0] = calcPotentialEnergy(m, ws); },
      "Potential energy of gravity, zero for a centre of mass at the origin, J.");
}

void addClosures(ModelType& type) {
  defKinematics(
      type, "closure_residual", false, [](const Model& m) { return Shape{m.numClosureRows()}; },
      [](const Model& m, Workspace& ws, State& s) {
        Eigen::Index row = 0;
        for (const Closure& closure : m.closures()) {
          const RowVectorUpTo6 r = calcClosureResidual(ws, closure);
          s.out[0].segment(row, r.size()) = r;
          row += r.size();
        }
      },
      "Closing errors of all closures (num_closure_rows,), m and rad; zero if and only if closed.");
  defKinematics(
      type, "closure_jacobian", false,
      [](const Model& m) {
        return Shape{m.numClosureRows(), m.nv()};
      },
      [](const Model& m, Workspace& ws, State& s) {
        MatrixXd J = MatrixXd::Zero(m.numClosureRows(), m.nv());
        Eigen::Index row = 0;
        for (const Closure& closure : m.closures()) {
          const int rows = getRows(closure.kind);
          calcClosureJacobian(ws, closure, J.middleRows(row, rows));
          row += rows;
        }
        s.matrix(0, m.nv()) = J;
      },
      "Jacobian of the closures' velocities (num_closure_rows, nv), in their frames 1.");
  type.def(
      "project_velocity",
      [](const Model& m, const py::object& q, const py::object& v, const py::object& contacts) {
        const ConstraintSet set = readConstraints(m, contacts);
        return mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}}, {{m.nv()}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            s.out[0] = projectVelocity(m, *ws, set, s.in[0], s.in[1]);
          };
        })[0];
      },
      py::arg("q"), py::arg("v"), py::arg("contacts") = py::tuple(),
      "The velocity (nv,) nearest to v that keeps closures and contacts closed.");
}

// Placements as (.., 4, 4).
void setPlacement(const SE3& X, OutputMatrix out) {
  out.setIdentity();
  out.topLeftCorner<3, 3>() = X.R;
  out.topRightCorner<3, 1>() = X.p;
}

void addFrames(ModelType& type) {
  type.def(
      "placement",
      [](const Model& m, const py::object& q, const std::string& name) {
        const Frame frame = findFrame(m, name);
        return mapStates({{"q", q, m.nq()}}, {{4, 4}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            updatePlacements<double>(m, *ws, s.in[0]);
            setPlacement(getPlacement(*ws, frame.body, frame.X_BF), s.matrix(0, 4));
          };
        })[0];
      },
      py::arg("q"), py::arg("frame"), "Homogeneous placement (4, 4) of a link, frame or contact in the world.");
  type.def(
      "placements",
      [](const Model& m, const py::object& q) {
        return mapStates({{"q", q, m.nq()}}, {{m.numBodies(), 4, 4}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            updatePlacements<double>(m, *ws, s.in[0]);
            for (int i = 0; i < m.numBodies(); ++i) setPlacement(ws->X_WB[i], {s.out[0].data() + 16 * i, 4, 4});
          };
        })[0];
      },
      py::arg("q"), "Homogeneous placements of all bodies in the world (num bodies, 4, 4), the world first.");
  type.def(
      "frame_velocity",
      [](const Model& m, const py::object& q, const py::object& v, const std::string& name) {
        const Frame frame = findFrame(m, name);
        return mapStates({{"q", q, m.nq()}, {"v", v, m.nv()}}, {{6}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            updatePositions(m, *ws, s.in[0]);
            updateVelocities<double>(m, *ws, s.in[1]);
            s.out[0] = calcFrameVelocity(*ws, frame.body, frame.X_BF);
          };
        })[0];
      },
      py::arg("q"), py::arg("v"), py::arg("frame"), "Twist of a frame in its own coordinates (6,), m/s and rad/s.");
  type.def(
      "frame_jacobian",
      [](const Model& m, const py::object& q, const std::string& name) {
        const Frame frame = findFrame(m, name);
        return mapStates({{"q", q, m.nq()}}, {{6, m.nv()}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            updatePositions(m, *ws, s.in[0]);
            s.matrix(0, m.nv()) = calcFrameJacobian(m, *ws, frame.body, frame.X_BF);
          };
        })[0];
      },
      py::arg("q"), py::arg("frame"), "Jacobian of a frame's twist in its own coordinates (6, nv).");
}

const bielle::Shape& getShape(const Model& m, int index) {
  if (index < 0 || index >= static_cast<int>(m.shapes().size()))
    throw py::index_error("there is no shape " + std::to_string(index) + ", the robot has " +
                          std::to_string(m.shapes().size()));
  return m.shapes()[index];
}

void addDistances(ModelType& type) {
  type.def_property_readonly(
      "shape_pairs",
      [](const Model& m) {
        py::list pairs;
        for (const ShapePair& pair : listShapePairs(m)) pairs.append(py::make_tuple(pair.a, pair.b, pair.of_two_legs));
        return pairs;
      },
      "Pairs of shapes on bodies that are not neighbours: two indices into `shapes`, and whether they are of two "
      "legs.");
  type.def(
      "shape_distance",
      [](const Model& m, const py::object& q, int a, int b) {
        const bielle::Shape &first = getShape(m, a), &second = getShape(m, b);
        return mapStates({{"q", q, m.nq()}}, {{}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            updatePlacements<double>(m, *ws, s.in[0]);
            s.out[0][0] = calcDistance(first, ws->X_WB[first.body], second, ws->X_WB[second.body]).distance;
          };
        })[0];
      },
      py::arg("q"), py::arg("a"), py::arg("b"),
      "Distance of two shapes by their indices, m. Negative where they overlap.");
  type.def(
      "shape_distance_gradient",
      [](const Model& m, const py::object& q, int a, int b) {
        const bielle::Shape &first = getShape(m, a), &second = getShape(m, b);
        return mapStates({{"q", q, m.nq()}}, {{m.nv()}}, [&] {
          return [&, ws = std::make_shared<Workspace>(m)](State& s) {
            updatePositions(m, *ws, s.in[0]);
            MatrixXd gradient = MatrixXd::Zero(1, m.nv());
            addDistanceGradient(m, *ws, first, second,
                                calcDistance(first, ws->X_WB[first.body], second, ws->X_WB[second.body]), gradient);
            s.out[0] = gradient.row(0);
          };
        })[0];
      },
      py::arg("q"), py::arg("a"), py::arg("b"), "Derivative of the distance by the tangent of q (nv,), m/rad or 1.");
}

}  // namespace

void bindKinematics(py::module_& module) {
  ModelType type = getModelType(module);
  addWholeBody(type);
  addClosures(type);
  addFrames(type);
  addDistances(type);
}

}  // namespace bielle::python
