// The residuals of the library, with what they were made of, so that they can be compared and pickled.
#include <pybind11/stl.h>

#include <unordered_map>

#include "bielle/ocp/contact_schedule.h"
#include "bind.h"
#include "residual.h"

namespace bielle::python {
namespace {

// Passes everything on to the residual that a function made of some arguments.
class MadeResidual : public Residual {
 public:
  MadeResidual(std::unique_ptr<Residual> made, const char* function, py::object arguments)
      : made_(std::move(made)), function_(function), arguments_(std::move(arguments)) {}

  int size() const override { return made_->size(); }
  bool needsForces() const override { return made_->needsForces(); }
  bool needsControls() const override { return made_->needsControls(); }
  bool needsSpeeds() const override { return made_->needsSpeeds(); }
  bool needsMotion() const override { return made_->needsMotion(); }
  void calc(const NodeView& node, VectorRef r) const override { made_->calc(node, r); }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override { made_->calcJacobian(node, rows); }

  py::tuple origin() const { return py::make_tuple(function_, arguments_.get()); }

 private:
  std::unique_ptr<Residual> made_;
  const char* function_;
  SharedObject arguments_;
};

// (function, arguments), or None for residuals inside a motion of the library.
py::object getOrigin(const LibraryResidual& residual) {
  const auto* made = dynamic_cast<const MadeResidual*>(residual.residual.get());
  return made ? py::object(made->origin()) : py::none();
}

// A residual that the library has put into a motion: the index-th of those that are made of a recipe.
struct PlannedResidual {
  std::weak_ptr<const Residual> residual;
  std::shared_ptr<SharedObject> recipe;
  size_t index;
};

// Under the interpreter's lock. Leaked, as the interpreter may be gone before static objects are.
using PlannedResiduals = std::unordered_map<const Residual*, PlannedResidual>;
PlannedResiduals& getPlannedResiduals() {
  static auto* planned = new PlannedResiduals;
  return *planned;
}

// (recipe, index), or None.
py::object getPlace(const std::shared_ptr<const Residual>& residual) {
  const auto found = getPlannedResiduals().find(residual.get());
  if (found == getPlannedResiduals().end() || found->second.residual.lock() != residual) return py::none();
  return py::make_tuple(found->second.recipe->get(), found->second.index);
}

// An argument as it is kept: arrays as lists, which compare and pickle.
template <typename T>
py::object keep(const T& argument) {
  if constexpr (std::is_same_v<T, py::object>)
    return py::isinstance<py::array>(argument) ? argument.attr("tolist")() : argument;
  else
    return py::cast(argument);
}

template <typename... Arguments, typename... Extra>
void def(py::module_& module, const char* name, std::unique_ptr<Residual> (*make)(Arguments...),
         const Extra&... extra) {
  module.def(
      name,
      [name, make](Arguments... arguments) {
        return LibraryResidual{std::make_shared<MadeResidual>(
            make(arguments...), name, py::make_tuple(keep<std::decay_t<Arguments>>(arguments)...))};
      },
      extra...);
}

using Made = std::unique_ptr<Residual>;
using Object = py::object;
using SharedModel = std::shared_ptr<Model>;

Vector3d readPoint(const Object& object, const char* what) { return readMatrix<Vector3d>(object, what); }

int requireContact(const ConstraintSet& set, int contact) {
  if (contact < 0 || contact >= static_cast<int>(set.contacts.size()))
    throw py::index_error("contact " + std::to_string(contact) + ": the constraints have " +
                          std::to_string(set.contacts.size()) + " contacts");
  return set.num_loops + contact;
}

std::vector<int> requireIndices(std::vector<int> indices, int size, const char* what) {
  for (int index : indices)
    if (index < 0 || index >= size)
      throw py::index_error(std::string(what) + " " + std::to_string(index) + ": there are " + std::to_string(size));
  return indices;
}

void bindFrameResiduals(py::module_& m) {
  def(
      m, "com_position", +[](Object reference) -> Made { return makeComPosition(readPoint(reference, "reference")); },
      py::arg("reference"), "Centre of mass minus a reference (3,), m.");
  def(
      m, "com_velocity", +[](Object reference) -> Made { return makeComVelocity(readPoint(reference, "reference")); },
      py::arg("reference"), "Velocity of the centre of mass minus a reference (3,), m/s.");
  def(
      m, "frame_placement",
      +[](SharedModel model, const std::string& frame, const SE3& X_WT) -> Made {
        return makeFramePlacement(getBodyFrame(*model, frame), X_WT);
      },
      py::arg("model"), py::arg("frame"), py::arg("X_WT"), "Log6 of the frame in a target (6,), m and rad.");
  def(
      m, "frame_translation",
      +[](SharedModel model, const std::string& frame, Object reference) -> Made {
        return makeFrameTranslation(getBodyFrame(*model, frame), readPoint(reference, "reference"));
      },
      py::arg("model"), py::arg("frame"), py::arg("reference"),
      "Position of the frame's origin minus a reference (3,), m.");
  def(
      m, "frame_rotation",
      +[](SharedModel model, const std::string& frame, Object R_WT) -> Made {
        return makeFrameRotation(getBodyFrame(*model, frame), readMatrix<Matrix3d>(R_WT, "R_WT"));
      },
      py::arg("model"), py::arg("frame"), py::arg("R_WT"), "Log3 of the frame's rotation in a target (3,), rad.");
  def(
      m, "frame_velocity",
      +[](SharedModel model, const std::string& frame, Object reference) -> Made {
        return makeFrameVelocity(getBodyFrame(*model, frame), readMatrix<Vector6d>(reference, "reference"));
      },
      py::arg("model"), py::arg("frame"), py::arg("reference") = py::make_tuple(0, 0, 0, 0, 0, 0),
      "Velocity of the frame's origin and angular velocity in world axes, minus a reference (6,), m/s and rad/s.");
  def(
      m, "sole_clearance",
      +[](SharedModel model, const std::string& sole, double half_length, double half_width, const Ground& ground,
          double ramp) -> Made {
        return makeSoleClearance(getBodyFrame(*model, sole), half_length, half_width, ground, ramp);
      },
      py::arg("model"), py::arg("sole"), py::arg("half_length"), py::arg("half_width"), py::arg("ground"),
      py::arg("ramp"),
      "Heights of the corners of a sole over the ground (4,), of its origin if it has no size (1,), m.");
}

void bindForceResiduals(py::module_& m) {
  def(
      m, "contact_force",
      +[](const ConstraintSet& set, int contact, Object reference, ForceAxes axes) -> Made {
        const int closure = requireContact(set, contact);
        return makeContactForce(set, closure, readVector(reference, countForces(set, closure), "reference"), axes);
      },
      py::arg("constraints"), py::arg("contact"), py::arg("reference"), py::arg("axes") = ForceAxes::Contact,
      "Force of a contact minus a reference, (3,) of a point and else (6,), N and N m. contact: its index among those "
      "in "
      "force.");
  def(
      m, "center_of_pressure",
      +[](const ConstraintSet& set, int contact, ForceAxes axes) -> Made {
        return makeCenterOfPressure(set, requireContact(set, contact), axes);
      },
      py::arg("constraints"), py::arg("contact"), py::arg("axes") = ForceAxes::Contact,
      "Centre of pressure of a sole or an edge about its origin (2,), m. Points have none: InputError.");
  def(
      m, "wrench_cone",
      +[](const ConstraintSet& set, int contact, double half_length, double half_width, double friction) -> Made {
        return makeWrenchCone(set, requireContact(set, contact), half_length, half_width, friction);
      },
      py::arg("constraints"), py::arg("contact"), py::arg("half_length"), py::arg("half_width"), py::arg("friction"),
      "Wrench cone of a rectangular sole (17,), an edge (11,) or a point (5,): inside when all rows are positive, N "
      "and N m.");
}

void bindJointResiduals(py::module_& m) {
  def(
      m, "joint_position",
      +[](SharedModel model, const std::vector<int>& dofs) -> Made {
        return makeJointPosition(*model, requireIndices(dofs, model->nv(), "dof"));
      },
      py::arg("model"), py::arg("dofs"),
      "Coordinates of joints with one dof (n,), rad or m; no dofs: all with limits.");
  def(
      m, "joint_velocity",
      +[](SharedModel model, const std::vector<int>& dofs) -> Made {
        return makeJointVelocity(requireIndices(dofs, model->nv(), "dof"));
      },
      py::arg("model"), py::arg("dofs"), "Velocity coordinates (n,), rad/s or m/s.");
  def(
      m, "motor_power",
      +[](SharedModel model, const std::vector<int>& motors) -> Made {
        return makeMotorPower(*model, requireIndices(motors, model->nu(), "motor"));
      },
      py::arg("model"), py::arg("motors"), "Mechanical power of motors (n,), W; on steps only.");
  def(
      m, "motor_voltage",
      +[](SharedModel model, const std::vector<int>& motors) -> Made {
        return makeMotorVoltage(*model, requireIndices(motors, model->nu(), "motor"));
      },
      py::arg("model"), py::arg("motors"), "Voltages of motors with a winding and a supply (n,), V; on steps only.");
  def(
      m, "electrical_power",
      +[](SharedModel model, Object losses) -> Made {
        return makeElectricalPower(readVector(losses, model->nu(), "losses"));
      },
      py::arg("model"), py::arg("losses"), "Electrical powers of all motors, then their torques (2 nu,), W and N m.");
}

}  // namespace

std::vector<LibraryResidual> rememberResiduals(const std::vector<StageSpec>& stages, const py::object& recipe) {
  PlannedResiduals& planned = getPlannedResiduals();
  for (auto it = planned.begin(); it != planned.end();)
    it = it->second.residual.expired() ? planned.erase(it) : std::next(it);
  const auto shared = std::make_shared<SharedObject>(recipe);
  std::vector<LibraryResidual> out;
  const auto remember = [&](const std::shared_ptr<const Residual>& residual) {
    if (!residual || getPythonResidual(*residual) || dynamic_cast<const MadeResidual*>(residual.get())) return;
    if (planned.try_emplace(residual.get(), PlannedResidual{residual, shared, out.size()}).second)
      out.push_back({residual});
  };
  for (const StageSpec& stage : stages) {
    for (const Cost& cost : stage.costs) remember(cost.residual);
    for (const PathConstraint& constraint : stage.path_constraints) remember(constraint.residual);
  }
  return out;
}

void bindResiduals(py::module_& module) {
  py::enum_<ForceAxes>(module, "ForceAxes")
      .value("CONTACT", ForceAxes::Contact)
      .value("WORLD", ForceAxes::World)
      .value("GROUND", ForceAxes::Ground);
  py::class_<LibraryResidual>(module, "LibraryResidual", "A residual of the library; `bielle.residuals` makes them.")
      .def_property_readonly(
          "size", [](const LibraryResidual& r) { return r.residual->size(); }, "number of rows")
      .def_property_readonly(
          "origin", &getOrigin,
          "(function of bielle.residuals, its arguments); None for residuals that the library put into a motion")
      .def("__eq__",
           [](const LibraryResidual& self, const Object& other) -> Object {
             if (!py::isinstance<LibraryResidual>(other)) return py::reinterpret_borrow<Object>(Py_NotImplemented);
             const auto& second = other.cast<const LibraryResidual&>();
             if (self.residual == second.residual) return py::bool_(true);
             const Object origin = getOrigin(self), place = getPlace(self.residual);
             return py::bool_((!origin.is_none() && origin.equal(getOrigin(second))) ||
                              (!place.is_none() && place.equal(getPlace(second.residual))));
           })
      .def("__copy__", [](const Object& self) { return self; })
      .def("__deepcopy__", [](const Object& self, const py::dict&) { return self; })
      .def("__reduce__",
           [](const LibraryResidual& self) {
             const Object origin = getOrigin(self), place = getPlace(self.residual);
             if (!origin.is_none()) return py::make_tuple(py::module_::import("bielle.residuals").attr("make"), origin);
             if (place.is_none()) throw py::type_error("the origin of this residual is unknown");
             // A pickled recipe comes back as the list of what is made of it.
             return py::make_tuple(py::module_::import("operator").attr("getitem"), place);
           })
      .def("__repr__", [](const LibraryResidual& self) {
        const Object origin = getOrigin(self);
        const std::string size = " of " + std::to_string(self.residual->size()) + " rows";
        return origin.is_none() ? "<residual" + size + ">"
                                : "<residual " + std::string(py::str(origin[py::int_(0)])) + size + ">";
      });
  py::module_ residuals = module.def_submodule("_residuals", "Residuals of the library.");
  bindFrameResiduals(residuals);
  bindForceResiduals(residuals);
  bindJointResiduals(residuals);
}

}  // namespace bielle::python
