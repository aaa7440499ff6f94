// Residuals written in Python.
#include <cmath>
#include <mutex>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bind.h"
#include "residual.h"

namespace bielle::python {
namespace {

// A node as Python sees it. Its memory belongs to the solver: it is valid during one call only.
class Node {
 public:
  explicit Node(const NodeView& view) : view_(&view) {}
  void expire() { view_ = nullptr; }
  const NodeView& get() const {
    if (!view_) throw std::runtime_error("a node is valid only during the call that it was given to: copy its arrays");
    return *view_;
  }

 private:
  const NodeView* view_;
};

py::array getSpeeds(const Node& node) {
  if (!node.get().speeds)
    throw std::runtime_error("speeds are available only on steps, to residuals that depend on 'speeds'");
  return makeArray(*node.get().speeds);
}

// From the placements of the bodies alone, which every call has.
Vector3d calcNodeCom(const NodeView& node) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 1; i < node.model.numBodies(); ++i) {
    const Inertia& inertia = node.model.bodies()[i].inertia;
    sum += inertia.mass * node.ws.X_WB[i].act(inertia.com);
  }
  return sum / node.model.mass();
}

// The blocks of the derivatives by the names that Python uses for them.
enum Block { kQ, kV, kForces, kControls, kSpeeds, kTimeScale, kBlocks };
constexpr const char* kBlockNames[kBlocks] = {"q", "v", "forces", "controls", "speeds", "time_scale"};

class PythonResidual : public Residual {
 public:
  explicit PythonResidual(const py::object& self) : self_(self), size_(self.attr("size").cast<int>()) {
    if (size_ < 1) throw py::value_error("size: a residual needs at least one row");
    for (const py::handle name : self.attr("depends_on")) {
      const auto* found = std::find(kBlockNames, kBlockNames + kBlocks, read<std::string>(name, "depends_on"));
      if (found == kBlockNames + kBlocks)
        throw py::value_error("depends_on: expected 'q', 'v', 'forces', 'controls', 'speeds' or 'time_scale', got '" +
                              std::string(py::str(name)) + "'");
      depends_[found - kBlockNames] = true;
    }
    const py::object base = py::module_::import("bielle.residuals").attr("Residual");
    differences_ = py::type::of(self).attr("calc_jacobian").is(base.attr("calc_jacobian"));
    if (differences_ && (depends_[kSpeeds] || depends_[kTimeScale]))
      throw py::type_error("a residual that depends on 'speeds' or 'time_scale' needs calc_jacobian");
  }

  int size() const override { return size_; }
  bool needsForces() const override { return depends_[kForces]; }
  bool needsControls() const override { return depends_[kControls]; }
  bool needsSpeeds() const override { return depends_[kSpeeds]; }
  bool needsMotion() const override { return depends_[kQ] || depends_[kV]; }

  void calc(const NodeView& node, VectorRef r) const override {
    const py::gil_scoped_acquire lock;
    call(node, r);
  }

  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const py::gil_scoped_acquire lock;
    if (differences_)
      calcDifferences(node, rows);
    else
      readJacobian(node, rows);
  }

  const py::object& get() const { return self_.get(); }

 private:
  std::string describe() const { return std::string(py::str(py::type::of(get()).attr("__name__"))); }

  // With the lock.
  py::object call(const NodeView& node, const char* function) const {
    const py::object seen = py::cast(Node(node));
    struct Expire {
      Node& node;
      ~Expire() { node.expire(); }
    } expire{seen.cast<Node&>()};
    return get().attr(function)(seen);
  }
  void call(const NodeView& node, VectorRef r) const {
    r = readVector(call(node, "calc"), size_, describe() + ".calc");
  }

  void readJacobian(const NodeView& node, ResidualRows rows) const {
    const py::object result = call(node, "calc_jacobian");
    if (!py::isinstance<py::dict>(result)) throw py::type_error(describe() + ".calc_jacobian: expected a dictionary");
    const auto jacobian = py::reinterpret_borrow<py::dict>(result);
    for (const auto& [key, value] : jacobian) {
      const auto* found = std::find(kBlockNames, kBlockNames + kBlocks, std::string(py::str(key)));
      if (found == kBlockNames + kBlocks || !depends_[found - kBlockNames])
        throw py::key_error(describe() + ".calc_jacobian: '" + std::string(py::str(key)) + "' is not in depends_on");
    }
    MatrixRef* blocks[] = {&rows.q, &rows.v, &rows.lambda, &rows.u, &rows.speeds};
    for (int i = 0; i < kTimeScale; ++i)
      if (depends_[i]) readBlock(jacobian, kBlockNames[i], *blocks[i]);
    if (depends_[kTimeScale])
      rows.s = readVector(jacobian["time_scale"], size_, describe() + ".calc_jacobian, time_scale");
  }
  void readBlock(const py::dict& jacobian, const char* name, MatrixRef block) const {
    const std::string what = describe() + ".calc_jacobian, " + name;
    if (!jacobian.contains(name)) throw py::key_error(what + ": missing, although it is in depends_on");
    const Array array = readArray(jacobian[name], what);
    requireShape(array, {block.rows(), block.cols()}, what);
    block = Eigen::Map<const RowMatrixXd>(array.data(), block.rows(), block.cols());
  }

  // Central differences: an error of the order of step^2 and of rounding over step.
  void calcDifferences(const NodeView& node, ResidualRows rows) const {
    constexpr double kStep = 1e-6;
    const Model& model = node.model;
    Workspace ws(model);
    VectorXd q = node.ws.q, v = node.ws.v, u = node.u, lambda = node.lambda, ahead(size_), behind(size_);
    const NodeView moved{model, ws, node.constraints, u, lambda, node.time_scale, node.speeds};
    const auto evaluate = [&](VectorXd& r) {
      updatePositions(model, ws, q);
      updateVelocities<double>(model, ws, v);
      call(moved, r);
    };
    // Moves one coordinate after the other by what `set` does.
    const auto differentiate = [&](MatrixRef block, const auto& set) {
      for (Eigen::Index k = 0; k < block.cols(); ++k) {
        const double step = set(k, kStep);
        evaluate(ahead);
        set(k, -kStep);
        evaluate(behind);
        set(k, 0);
        block.col(k) = (ahead - behind) / (2 * step);
      }
    };
    // Steps of forces and velocities are in proportion to them.
    const auto entry = [](const VectorXd& x0, VectorXd& x) {
      return [&x0, &x](Eigen::Index k, double step) {
        step *= std::max(1.0, std::abs(x0[k]));
        x[k] = x0[k] + step;
        return step;
      };
    };
    const VectorXd v0 = v, u0 = u, lambda0 = lambda;
    if (depends_[kQ]) {
      differentiate(rows.q, [&](Eigen::Index k, double step) {
        q = model.integrate(node.ws.q, step * VectorXd::Unit(model.nv(), k));
        return step;
      });
      q = node.ws.q;
    }
    if (depends_[kV]) differentiate(rows.v, entry(v0, v));
    if (depends_[kForces]) differentiate(rows.lambda, entry(lambda0, lambda));
    if (depends_[kControls]) differentiate(rows.u, entry(u0, u));
  }

  SharedObject self_;
  int size_;
  bool depends_[kBlocks] = {};
  bool differences_ = false;
};

}  // namespace

std::shared_ptr<const Residual> makePythonResidual(const py::object& residual) {
  if (!py::isinstance(residual, py::module_::import("bielle.residuals").attr("Residual")))
    throw py::type_error(
        "residual: expected one of bielle.residuals, or an object of a class derived from bielle.Residual");
  return std::make_shared<PythonResidual>(residual);
}

py::object getPythonResidual(const Residual& residual) {
  const auto* own = dynamic_cast<const PythonResidual*>(&residual);
  return own ? own->get() : py::object();
}

void bindPythonResiduals(py::module_& module) {
  py::class_<Node>(module, "Node", "Data that a residual can read; valid during one call. Its arrays are copies.")
      .def_property_readonly(
          "q", [](const Node& n) { return makeArray(n.get().ws.q); }, "configuration (nq,)")
      .def_property_readonly(
          "v", [](const Node& n) { return makeArray(n.get().ws.v); }, "velocity (nv,)")
      .def_property_readonly(
          "u", [](const Node& n) { return makeArray(n.get().u); },
          "motor torques (nu,), N m or N; empty at the terminal node")
      .def_property_readonly(
          "forces", [](const Node& n) { return makeArray(n.get().lambda); },
          "forces of closures and contacts (rows,), N and N m; empty at the terminal node")
      .def_property_readonly("speeds", &getSpeeds, "motor speeds when the torques act (nu,), rad/s or m/s")
      .def_property_readonly(
          "time_scale", [](const Node& n) { return n.get().time_scale; }, "time scale of a free duration")
      .def_property_readonly(
          "constraints", [](const Node& n) { return n.get().constraints; }, "ConstraintSet in force")
      .def_property_readonly(
          "com", [](const Node& n) { return makeArray(calcNodeCom(n.get())); }, "centre of mass in the world (3,), m")
      .def_property_readonly(
          "com_jacobian",
          [](const Node& n) {
            Eigen::Matrix3Xd J(3, n.get().model.nv());
            calcComJacobian(n.get().model, n.get().ws, J);
            return makeArray(J);
          },
          "Jacobian of the centre of mass by the tangent of q (3, nv); only in calc_jacobian")
      .def(
          "placement",
          [](const Node& n, const std::string& name) {
            const Frame frame = findFrame(n.get().model, name);
            return getPlacement(n.get().ws, frame.body, frame.X_BF);
          },
          py::arg("frame"), "SE3 of a link, frame or contact in the world.")
      .def(
          "frame_velocity",
          [](const Node& n, const std::string& name) {
            const Frame frame = findFrame(n.get().model, name);
            return makeArray(calcFrameVelocity(n.get().ws, frame.body, frame.X_BF));
          },
          py::arg("frame"), "Twist of a frame in its own coordinates (6,), m/s and rad/s.")
      .def(
          "frame_jacobian",
          [](const Node& n, const std::string& name) {
            const Frame frame = findFrame(n.get().model, name);
            return makeArray(calcFrameJacobian(n.get().model, n.get().ws, frame.body, frame.X_BF));
          },
          py::arg("frame"), "Jacobian of that twist (6, nv); only in calc_jacobian.");
}

}  // namespace bielle::python
