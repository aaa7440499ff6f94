#include <pybind11/stl.h>

#include "bielle/dynamics/ball_cuts.h"
#include "bielle/dynamics/closing.h"
#include "bielle/model/builder.h"
#include "bielle/model/names.h"
#include "bielle/motion/motion.h"
#include "bielle/ocp/cost.h"
#include "bind.h"
#include "model_access.h"

namespace bielle::python {

bool Convert<std::shared_ptr<Model>>::same(const std::shared_ptr<Model>& a, const std::shared_ptr<Model>& b) {
  return a == b || (a && b && python::same(takeParts(*a), takeParts(*b)));
}

Frame findFrame(const Model& model, const std::string& name) {
  const BodyFrame frame = getBodyFrame(model, name);
  return {name, frame.body, frame.X_BF};
}

ConstraintSet requireFit(const Model& model, const ConstraintSet& set) {
  bool fits = set.num_loops == static_cast<int>(model.closures().size()) &&
              set.closures.size() == model.closures().size() + set.contacts.size();
  std::vector<ContactTarget> targets;
  for (size_t c = 0; fits && c < set.contacts.size(); ++c) {
    fits = set.contacts[c] >= 0 && set.contacts[c] < static_cast<int>(model.contacts().size());
    targets.push_back({set.contacts[c], set.closures[model.closures().size() + c].X_B2});
  }
  if (fits) {
    ConstraintSet own = makeConstraintSet(model, targets);
    for (size_t c = 0; c < own.closures.size(); ++c)
      own.closures[c].kp = set.closures[c].kp, own.closures[c].kd = set.closures[c].kd;
    fits = same(set, own);
  }
  if (!fits)
    throw py::value_error(
        "constraints: this ConstraintSet does not belong to the model; make it with Model.constraints");
  return set;
}

int findContact(const Model& model, const std::string& name) {
  const int contact = model.findContact(name);
  if (contact < 0)
    throw InputError(model.name(), "contact '" + name + "'", "there is no contact of this name",
                     "name one of Model.contacts");
  return contact;
}

ConstraintSet readConstraints(const Model& model, py::handle contacts) {
  if (py::isinstance<ConstraintSet>(contacts)) return requireFit(model, contacts.cast<ConstraintSet>());
  std::vector<ContactTarget> targets;
  for (const py::handle contact : py::reinterpret_borrow<py::iterable>(contacts)) {
    if (py::isinstance<ContactTarget>(contact)) {
      targets.push_back(contact.cast<ContactTarget>());
      if (targets.back().contact < 0 || targets.back().contact >= static_cast<int>(model.contacts().size()))
        throw py::index_error("contact " + std::to_string(targets.back().contact) + ": the robot has " +
                              std::to_string(model.contacts().size()));
      continue;
    }
    ContactTarget target;
    target.contact = findContact(model, read<std::string>(contact, "contacts"));
    targets.push_back(target);
  }
  return makeConstraintSet(model, targets);
}

py::object makeNamed(const char* type, const std::vector<py::array>& arrays) {
  py::tuple values(arrays.size());
  for (size_t i = 0; i < arrays.size(); ++i) values[i] = arrays[i];
  return py::module_::import("bielle.named").attr(type)(*values);
}

namespace {

void bindParts(py::module_& module) {
  Value<ModelParts>(module, "ModelParts", "The parts of a model.")
      .field("name", &ModelParts::name, "name of the robot")
      .field("gravity", &ModelParts::gravity, "(3,), m/s^2")
      .field("bodies", &ModelParts::bodies, "the world first")
      .field("joints", &ModelParts::joints, "a placeholder for the world first")
      .field("frames", &ModelParts::frames, "links among them")
      .field("closures", &ModelParts::closures, "closures of the loops")
      .field("motors", &ModelParts::motors, "in the order of u")
      .field("joint_forces", &ModelParts::joint_forces, "springs, dampers and friction")
      .field("point_springs", &ModelParts::point_springs, "springs and dampers between points")
      .field("contacts", &ModelParts::contacts, "frames that may touch the ground")
      .field("references", &ModelParts::references, "postures by name")
      .field("visuals", &ModelParts::visuals, "what is drawn")
      .field("shapes", &ModelParts::shapes, "shapes of the bodies, for distances")
      .field("serial_joints", &ModelParts::serial_joints, "indices of the joints of the equivalent serial chain")
      .field("lower_limits", &ModelParts::lower_limits, "(nv,)")
      .field("upper_limits", &ModelParts::upper_limits, "(nv,)")
      .field("velocity_limits", &ModelParts::velocity_limits, "(nv,)")
      .field("armature", &ModelParts::armature, "(nv,)");
}

// A read-only attribute: what a const accessor returns, as a view where there is memory to view.
template <typename Result>
void addAttribute(ModelType& type, const char* name, Result (Model::*get)() const, const char* doc) {
  type.def_property_readonly(
      name, [get](const py::object& self) { return show((self.cast<const Model&>().*get)(), self); }, doc);
}

void addAttributes(ModelType& type) {
  addAttribute(type, "name", &Model::name, "name of the robot");
  addAttribute(type, "nq", &Model::nq, "size of a configuration q");
  addAttribute(type, "nv", &Model::nv, "size of a velocity v, and of tangent vectors");
  addAttribute(type, "nu", &Model::nu, "number of motors");
  addAttribute(type, "num_closure_rows", &Model::numClosureRows, "scalar constraints of all closures");
  addAttribute(type, "mass", &Model::mass, "kg, without the world");
  addAttribute(type, "gravity", &Model::gravity, "(3,), m/s^2");
  addAttribute(type, "has_free_flyer", &Model::hasFreeFlyer, "whether the first joint is one");
  addAttribute(type, "bodies", &Model::bodies, "the world first");
  addAttribute(type, "joints", &Model::joints, "a placeholder for the world first");
  addAttribute(type, "frames", &Model::frames, "links among them");
  addAttribute(type, "closures", &Model::closures, "closures of the loops");
  addAttribute(type, "clusters", &Model::clusters, "closures that share dofs");
  addAttribute(type, "motors", &Model::motors, "in the order of u");
  addAttribute(type, "joint_forces", &Model::jointForces, "springs, dampers and friction on joints");
  addAttribute(type, "point_springs", &Model::pointSprings, "springs and dampers between points");
  addAttribute(type, "contacts", &Model::contacts, "frames that may touch the ground");
  addAttribute(type, "references", &Model::references, "postures by name");
  addAttribute(type, "visuals", &Model::visuals, "what is drawn");
  addAttribute(type, "shapes", &Model::shapes, "shapes of the bodies for distances, as boxes with rounded edges");
  addAttribute(type, "serial_joints", &Model::serialJoints, "indices of the joints of the equivalent serial chain");
  addAttribute(type, "lower_limits", &Model::lowerLimits, "(nv,), -inf if there is none");
  addAttribute(type, "upper_limits", &Model::upperLimits, "(nv,)");
  addAttribute(type, "velocity_limits", &Model::velocityLimits, "(nv,), rad/s or m/s");
  addAttribute(type, "armature", &Model::armature, "(nv,), added to the diagonal of the mass matrix");
  type.def_property_readonly(
      "q_names", [](const Model& m) { return show(makePositionNames(m), {}); }, "names of the entries of q");
  type.def_property_readonly(
      "v_names", [](const Model& m) { return show(makeVelocityNames(m), {}); }, "names of the entries of v");
  type.def_property_readonly(
      "u_names", [](const Model& m) { return show(getNames(m.motors()), {}); }, "names of the motors");
}

void addConfigurations(ModelType& type) {
  type.def(
      "neutral", [](const Model& m) { return makeArray(m.makeNeutral()); }, "Neutral configuration (nq,).");
  type.def(
      "standing", [](const Model& m) { return makeArray(makeStandingPosture(m)); },
      "The starting posture of motions (nq,): the reference `half_sitting`, or the only one.\n\n"
      "Raises InputError when there is none, or it cannot be closed.");
  type.def(
      "integrate",
      [](const Model& m, const py::object& q, const py::object& dq) {
        return mapStates({{"q", q, m.nq()}, {"dq", dq, m.nv()}}, {{m.nq()}}, [&m] {
          return [&m](State& s) {
            VectorXd out(m.nq());
            m.integrate(s.in[0], s.in[1], out);
            s.out[0] = out;
          };
        })[0];
      },
      py::arg("q"), py::arg("dq"), "q (+) dq (nq,), for q (nq,) and a tangent vector dq (nv,); or for many, (N, ..).");
  type.def(
      "difference",
      [](const Model& m, const py::object& q0, const py::object& q1) {
        return mapStates({{"q0", q0, m.nq()}, {"q1", q1, m.nq()}}, {{m.nv()}}, [&m] {
          return [&m](State& s) {
            VectorXd out(m.nv());
            m.difference(s.in[0], s.in[1], out);
            s.out[0] = out;
          };
        })[0];
      },
      py::arg("q0"), py::arg("q1"), "The dq (nv,) with q0 (+) dq = q1; or many, (N, nv).");
  type.def(
      "constraints", [](const Model& m, const py::object& contacts) { return readConstraints(m, contacts); },
      py::arg("contacts") = py::tuple(),
      "ConstraintSet of all closures and the given contacts, by name or as ContactTargets.");
}

const AssemblyResult& requireClosed(const Model& model, const AssemblyResult& result) {
  if (result.status != NumericalStatus::Ok)
    throw InputError(model.name(), "posture", result.message,
                     result.worst.rfind("joint '", 0) == 0 ? "hold it there" : "start from a closer configuration");
  return result;
}

void addAssembly(ModelType& type) {
  type.def(
      "close",
      [](const Model& m, const py::object& q, const std::vector<std::string>& hold) {
        const VectorXd start = readVector(q, m.nq(), "q");
        AssemblyResult result;
        {
          const py::gil_scoped_release release;
          result = closeConfiguration(m, start, hold);
        }
        return makeArray(requireClosed(m, result).q);
      },
      py::arg("q"), py::arg("hold") = std::vector<std::string>(),
      "The closed configuration nearest to q (nq,), in which the joints of these names stay where they are.\n\nRaises "
      "InputError when the loops do not close, with the gap and the nearest value in reach of a joint that cannot "
      "stay. "
      "LoopCloser closes many, in microseconds.");
  type.def(
      "posture",
      [](const Model& m, const std::string& name) {
        AssemblyResult result;
        {
          const py::gil_scoped_release release;
          result = name.empty() ? findClosedConfiguration(m) : assembleReference(m, name);
          if (name.empty() && result.status != NumericalStatus::Ok) throw makeClosingError(m, m.name(), result);
        }
        return makeArray(requireClosed(m, result).q);
      },
      py::arg("name") = "",
      "A reference by name, closed (nq,); without a name some closed configuration.\n\n"
      "Raises InputError when there is no such reference, or the loops do not close.");
  type.def(
      "mobility",
      [](const Model& m, const py::object& q) {
        const Mobility mobility = calcMobility(m, readVector(q, m.nq(), "q"));
        py::dict out;
        out["rows"] = mobility.rows;
        out["rank"] = mobility.rank;
        out["mobility"] = mobility.mobility;
        out["singular_values"] = makeArray(mobility.singular_values);
        return out;
      },
      py::arg("q"), "Rows and rank of the closures at q (nq,), and the mobility nv - rank.");
}

void bindBuilder(py::module_& module) {
  py::class_<ModelBuilder>(
      module, "ModelBuilder",
      "Collects bodies, joints, closures, motors and frames, then validates them and makes the model.\n\nBodies go by "
      "the name of their link; \"world\" is the ground. Elements must be declared before they are referred to. Errors "
      "are InputErrors that name the element and the remedy.")
      .def(py::init<std::string>(), py::arg("name"))
      .def("add_link", &ModelBuilder::addLink, py::arg("link"), py::arg("parent_link"), py::arg("joint"),
           py::arg("inertia"), py::arg("limits") = JointLimits(),
           "A link carried by a Joint, whose X_PJ places it in the parent link; its Inertia in the frame of the link.")
      .def("add_inertia", &ModelBuilder::addInertia, py::arg("link"), py::arg("inertia"),
           "More inertia on a link, in the frame of that link.")
      .def("add_frame", &ModelBuilder::addFrame, py::arg("name"), py::arg("link"), py::arg("X_LF"),
           "A named frame on a link; X_LF is its placement there (SE3, m).")
      .def(
          "add_closure",
          [](ModelBuilder& self, const std::string& name, ClosureKind kind, const std::string& frame1,
             const std::string& frame2, py::handle axis, double kp,
             double kd) { self.addClosure(name, kind, frame1, frame2, readMatrix<Vector3d>(axis, "axis"), kp, kd); },
          py::arg("name"), py::arg("kind"), py::arg("frame1"), py::arg("frame2"),
          py::arg("axis") = py::make_tuple(0, 0, 1), py::arg("kp") = 0, py::arg("kd") = 0,
          "Closes a loop: two frames coincide, or keep their distance, as specified by the ClosureKind.\n\n"
          "axis: (3,), of a hinge or slider, in frame 1; kp [1/s^2], kd [1/s]: Baumgarte stabilization.")
      .def(
          "add_distance",
          [](ModelBuilder& self, const std::string& name, const std::string& frame1, const std::string& frame2,
             const py::object& length, double kp, double kd) {
            self.addDistance(name, frame1, frame2, read<std::optional<double>>(length, "length"), kp, kd);
          },
          py::arg("name"), py::arg("frame1"), py::arg("frame2"), py::arg("length") = py::none(), py::arg("kp") = 0,
          py::arg("kd") = 0,
          "A massless rod with a ball at either end: keeps the origins of two frames at a distance.\n\n"
          "length: m, above 0; None: their distance where all coordinates are neutral; kp [1/s^2], kd [1/s]: Baumgarte "
          "stabilization.")
      .def("add_coupler", &ModelBuilder::addCoupler, py::arg("name"), py::arg("coefficients"), py::arg("offset") = 0,
           py::arg("kp") = 0, py::arg("kd") = 0, py::arg("higher") = std::map<std::string, std::vector<double>>(),
           "A belt, a gear or a cam: the sum of coefficients times coordinates is the offset, rad or m.\n\n"
           "coefficients: by name of joint, at least two; kp [1/s^2], kd [1/s]: Baumgarte stabilization; higher: lists "
           "of\n"
           "coefficients of the squares, cubes, .. of the coordinates of some of these joints.")
      .def("add_joint_force", &ModelBuilder::addJointForce, py::arg("joint"), py::arg("force"),
           "Spring, damper and friction (JointForce) on a joint of one coordinate.")
      .def("add_point_spring", &ModelBuilder::addPointSpring, py::arg("frame1"), py::arg("frame2"), py::arg("spring"),
           "Spring and damper (PointSpring) between a point of frame 1 and one of frame 2, links or frames.")
      .def(
          "add_motor",
          [](ModelBuilder& self, const std::string& joint, double armature, double effort, double velocity,
             const py::object& loss) {
            self.addMotor(joint, armature, effort, velocity, read<std::optional<double>>(loss, "torque_loss"));
          },
          py::arg("joint"), py::arg("armature") = 0, py::arg("effort_limit") = std::numeric_limits<double>::infinity(),
          py::arg("velocity_limit") = std::numeric_limits<double>::infinity(), py::arg("torque_loss") = py::none(),
          "A motor on a joint of one dof; they are numbered in the order of their calls.\n\n"
          "armature: kg m^2 or kg; effort_limit: N m or N; velocity_limit: rad/s or m/s; torque_loss: "
          "W/(N m)^2, or None if it is not known.")
      .def("add_contact", &ModelBuilder::addContact, py::arg("name"), py::arg("frame"), py::arg("kind"),
           py::arg("half_length") = 0, py::arg("half_width") = 0,
           "A frame that may touch the ground; half_length, half_width of a sole along its x and y, m.")
      .def("add_reference", &ModelBuilder::addReference, py::arg("reference"), "A posture by name.")
      .def("add_shape", &ModelBuilder::addShape, py::arg("link"), py::arg("shape"), "A shape of a link, for distances.")
      .def("add_visual", &ModelBuilder::addVisual, py::arg("link"), py::arg("visual"), "What is drawn of a link.")
      .def("add_serial_joint", &ModelBuilder::addSerialJoint, py::arg("joint"),
           "A joint of the equivalent serial chain, for reduction ratios and serial models.")
      .def(
          "set_gravity",
          [](ModelBuilder& self, py::handle gravity) { self.setGravity(readMatrix<Vector3d>(gravity, "gravity")); },
          py::arg("gravity"), "(3,), m/s^2; (0, 0, -9.81) unless it is called.")
      .def("set_armature", &ModelBuilder::setArmature, py::arg("joint"), py::arg("armature"),
           "Inertia that is added to every dof of a joint, kg m^2 or kg.")
      .def(
          "build", [](const ModelBuilder& self) { return std::make_shared<Model>(self.build()); },
          "The Model. Raises InputError naming the faulty element.");
}

}  // namespace

void bindModel(py::module_& module) {
  bindParts(module);
  ModelType type(module, "Model",
                 "A robot: a spanning tree of bodies and joints, closed by closures. Immutable.\n\n"
                 "Functions of states take one state, e.g. q (nq,), or N of them, (N, nq), on all cores; results then "
                 "have an axis of N in front. SI units; twists and wrenches have their linear part first.");
  addAttributes(type);
  addConfigurations(type);
  addAssembly(type);
  type.def(
      "cut_at_balls", [](const Model& model) { return std::make_shared<Model>(cutAtBalls(model)); },
      py::call_guard<py::gil_scoped_release>(),
      "The same mechanism with fewer coordinates: rods that were cut and welded are whole, and end in balls.");
  type.def("__repr__", [](const Model& m) {
    return "<Model '" + m.name() + "': nq " + std::to_string(m.nq()) + ", nv " + std::to_string(m.nv()) + ", " +
           std::to_string(m.nu()) + " motors, " + std::to_string(m.closures().size()) + " closures>";
  });
  type.def("__eq__", [](const std::shared_ptr<Model>& self, const py::object& other) -> py::object {
    if (!py::isinstance<Model>(other)) return py::reinterpret_borrow<py::object>(Py_NotImplemented);
    return py::bool_(same(self, other.cast<std::shared_ptr<Model>>()));
  });
  type.def("__copy__", [](const py::object& self) { return self; });
  type.def("__deepcopy__", [](const py::object& self, const py::dict&) { return self; });
  type.def(py::pickle([](const Model& model) { return takeParts(model); },
                      [](const ModelParts& parts) { return std::make_shared<Model>(ModelBuilder::restore(parts)); }));
  bindBuilder(module);
}

}  // namespace bielle::python
