#include <omp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <optional>

#include "bielle/model/error.h"
#include "bielle/worlds/batch.h"
#include "bielle/worlds/bielle_world.h"
#include "bielle/worlds/sensors.h"
#include "bind.h"
#include "busy.h"
#include "engines.h"
#include "robot.h"

namespace bielle::python {
namespace {

using worlds::World;

std::unique_ptr<World> makeOwnWorld(const std::string&, const Model& model, const worlds::WorldOptions& options) {
  return worlds::makeOwnWorld(model, options);
}

// Of the module that links the engines, which is there where Bielle was built with them.
MakeWorld findEngine(const std::string& engine) {
  try {
    const py::object capsule = py::module_::import("bielle._engines").attr("make_world");
    void* function = PyCapsule_GetPointer(capsule.ptr(), kEnginesCapsule);
    if (!function) throw py::error_already_set();
    return reinterpret_cast<MakeWorld>(function);
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_ModuleNotFoundError)) throw;
    throw InputError("", "world '" + engine + "'", "this build only has its own engine",
                     "build Bielle with -DBIELLE_BUILD_SIMULATION=ON (it needs Simbody), or use engine='bielle'");
  }
}

enum class Numbers { Finite, NotNan, Any };

// One world, or many that are stepped together on all cores: those of Bielle's own engine at fixed steps in a WorldBatch.
class HeldWorlds {
 public:
  HeldWorlds(std::shared_ptr<Model> model, std::optional<int> count, const Ground& ground, double time_step,
             double tolerance, const std::string& engine, int threads, const NamedSizes& play,
             const std::vector<RodFriction>& rod_frictions)
      : model_(std::move(model)), many_(count), engine_(engine), time_step_(time_step) {
    if (count && *count < 1) throw py::value_error("count: at least one world");
    for (const auto& [name, value] : {std::pair{"time_step", time_step}, std::pair{"tolerance", tolerance}})
      if (!(value >= 0 && std::isfinite(value))) throw py::value_error(std::string(name) + ": 0 or a positive number");
    if (threads < 0) throw py::value_error("threads: 0 or the number of threads");
    threads_ = threads > 0 ? threads : omp_get_max_threads();
    const MakeWorld make = engine == "bielle" ? makeOwnWorld : findEngine(engine);
    worlds::WorldOptions options{ground, time_step};
    options.tolerance = tolerance;
    options.wear = makeWear(play, rod_frictions);
    const py::gil_scoped_release release;
    if (count && engine == "bielle" && tolerance == 0 && play.empty()) {
      const worlds::WorldBatchOptions all{{options, {}}, threads_};
      batch_ = std::make_unique<worlds::WorldBatch>(*model_, *count, all);
      return;
    }
    for (int i = 0; i < count.value_or(1); ++i) worlds_.push_back(make(engine, *model_, options));
    ok_.assign(worlds_.size(), false);
  }

  // Many worlds start from the same state, or each from its own; all of them, or those of a mask.
  py::object reset(const py::object& q, const py::object& v, const py::object& where) {
    const BusyGuard guard(is_busy_, "world");
    const MatrixXd q0 = readRows(q, model_->nq(), "q", true), v0 = readRows(v, model_->nv(), "v", true);
    const VectorXd chosen = readMask(where);
    if (batch_) {
      const std::vector<char> marks = makeMarks(chosen);
      const py::gil_scoped_release release;
      batch_->reset(q0, v0, marks);
    }
    run([&](World& world, Eigen::Index i) {
      if (chosen[i] == 0) return;
      world.reset(q0.col(i), v0.col(i));
      ok_[i] = world.message().empty();
    });
    return observe();
  }

  // Of all worlds (fields without an axis of them) or of each.
  void set(const py::object& mass_factors, const py::object& armatures, const py::object& effort_limits,
           const py::object& friction, const py::object& delays, const py::object& grounds,
           const py::object& torque_constants, const py::object& resistances, const py::object& voltages,
           const py::object& currents, const py::object& rod_changes) {
    if (!batch_)
      throw py::value_error(
          "set: expected worlds of Bielle's own engine at fixed steps, made with `count` (1 for one) and without play");
    const BusyGuard guard(is_busy_, "world");
    worlds::WorldParameters parameters;
    const auto read = [this](const py::object& given, Eigen::Index size, const char* name, MatrixXd& out) {
      if (!given.is_none()) out = readRows(given, size, name, true, Numbers::NotNan);
    };
    const auto readEach = [this](const py::object& given, const char* name, VectorXd& out) {
      if (!given.is_none()) out = readNumbers(given, name);
    };
    read(mass_factors, model_->numBodies(), "mass_factors", parameters.mass_factors);
    read(armatures, model_->nu(), "armatures", parameters.armatures);
    read(effort_limits, model_->nu(), "effort_limits", parameters.effort_limits);
    read(torque_constants, model_->nu(), "torque_constants", parameters.torque_constants);
    read(resistances, model_->nu(), "resistances", parameters.resistances);
    read(voltages, model_->nu(), "voltages", parameters.voltages);
    read(currents, model_->nu(), "currents", parameters.currents);
    read(rod_changes, numClosures(), "rod_changes", parameters.rod_changes);
    readEach(friction, "friction", parameters.friction);
    readEach(delays, "delays", parameters.delays);
    if (!grounds.is_none()) parameters.grounds = readGrounds(grounds);
    const py::gil_scoped_release release;
    batch_->set(parameters);
  }
  py::object parameters() {
    if (!batch_)
      throw py::value_error(
          "parameters: expected worlds of Bielle's own engine at fixed steps, made with `count` and without play");
    const BusyGuard guard(is_busy_, "world");
    const worlds::WorldParameters& now = batch_->parameters();
    const Shape motors = {model_->nu()};
    return makeNamed("WorldParameters",
                     {makeRows(now.mass_factors, {model_->numBodies()}), makeRows(now.armatures, motors),
                      makeRows(now.effort_limits, motors), makeRows(now.friction.transpose(), {}),
                      makeRows(now.delays.transpose(), {}), makeRows(now.torque_constants, motors),
                      makeRows(now.resistances, motors), makeRows(now.voltages, motors), makeRows(now.currents, motors),
                      makeRows(now.rod_changes, {numClosures()})});
  }

  // Of a single world.
  py::object books() {
    worlds::Books books;
    observeOnly([&](const World& world) { books = world.books(); });
    return py::module_::import("bielle.named")
        .attr("Books")(books.kinetic, books.potential, books.elastic, books.motor_work, books.push_work,
                       books.contact_loss, books.stop_loss, books.other_loss);
  }
  py::object message() {
    const BusyGuard guard(is_busy_, "world");
    py::list messages;
    for (int i = 0; batch_ && i < batch_->count(); ++i) messages.append(batch_->message(i));
    for (const std::unique_ptr<World>& world : worlds_) messages.append(world->message());
    return many_ ? py::object(messages) : py::object(messages[0]);
  }

  py::object step(const py::object& u, double duration, const py::object& push, const py::object& where) {
    if (!(duration > 0 && std::isfinite(duration)))
      throw py::value_error("duration: expected a positive number of seconds");
    const BusyGuard guard(is_busy_, "world");
    warnOfStep(duration);
    // Of a batch, worlds whose torques are not finite break off.
    const auto finite = batch_ ? Numbers::Any : Numbers::Finite;
    const MatrixXd torques = readRows(u, model_->nu(), "u", true, finite),
                   force = readRows(push, 3, "push", true, finite);
    const VectorXd chosen = readMask(where);
    if (batch_) {
      const std::vector<char> marks = makeMarks(chosen);
      const py::gil_scoped_release release;
      batch_->step(torques, force, duration, marks);
    }
    run([&](World& world, Eigen::Index i) {
      if (chosen[i] == 0) return;
      world.setTorques(torques.col(i));
      world.setPush(force.col(i));
      ok_[i] = world.advance(duration);
    });
    return observe();
  }

  py::array calcWrenches() {
    const BusyGuard guard(is_busy_, "world");
    const Eigen::Index contacts = static_cast<Eigen::Index>(model_->contacts().size());
    MatrixXd out(6 * contacts, numWorlds());
    if (batch_) out = batch_->wrenches();
    for (size_t i = 0; i < worlds_.size(); ++i)
      for (Eigen::Index c = 0; c < contacts; ++c) out.col(i).segment<6>(6 * c) = worlds_[i]->feet()[c].wrench;
    Shape shape = {contacts, 6};
    return makeRows(out, shape);
  }

  // Of a single world.
  py::dict integration() {
    worlds::Integration integration;
    observeOnly([&](const World& world) { integration = world.integration(); });
    py::dict out;
    out["integrator"] = integration.integrator;
    out["tolerance"] = integration.tolerance;
    out["closure_tolerance"] = integration.closure_tolerance;
    out["shortest_step"] = integration.shortest_step;
    out["longest_step"] = integration.longest_step;
    return out;
  }
  const std::vector<std::string>& warnings() const { return batch_ ? batch_->warnings() : worlds_.front()->warnings(); }

  // 1 for worlds that are chosen, else 0.
  VectorXd readMask(const py::object& where) const {
    const auto count = static_cast<Eigen::Index>(numWorlds());
    const VectorXd chosen = where.is_none() ? VectorXd::Ones(count) : readVector(where, count, "where");
    if (!(chosen.array() == 0 || chosen.array() == 1).all())
      throw py::value_error("where: expected True or False for each world");
    return chosen;
  }

  // Calls task(world, its state).
  template <typename Task>
  void visit(const Task& task) {
    const BusyGuard guard(is_busy_, "world");
    const py::gil_scoped_release release;
    for (Eigen::Index i = 0; batch_ && i < batch_->count(); ++i)
      task(i, worlds::SensedState{batch_->times()[i], batch_->configurations().col(i), batch_->velocities().col(i),
                                  batch_->torques().col(i)});
    for (size_t i = 0; i < worlds_.size(); ++i) {
      const World& world = *worlds_[i];
      task(i, worlds::SensedState{world.time(), world.motorConfiguration(), world.velocity(), world.torques()});
    }
  }

  const std::shared_ptr<Model>& model() const { return model_; }
  const std::optional<int>& count() const { return many_; }
  const std::string& engine() const { return engine_; }

  void requireSingle() const {
    if (many_) throw py::value_error("world: expected a single world, made without `count`");
  }

  py::array makeRows(const MatrixXd& columns, Shape shape) const {
    if (many_) shape.insert(shape.begin(), columns.cols());
    Array out(shape);
    Eigen::Map<MatrixXd>(out.mutable_data(), columns.rows(), columns.cols()) = columns;
    return std::move(out);
  }

  // Reads the state of a single world.
  template <typename Task>
  void observeOnly(const Task& task) {
    requireSingle();
    const BusyGuard guard(is_busy_, "world");
    const py::gil_scoped_release release;
    task(*worlds_.front());
  }

 private:
  static std::vector<char> makeMarks(const VectorXd& chosen) {
    std::vector<char> marks;
    for (const double mark : chosen) marks.push_back(mark != 0);
    return marks;
  }
  // One for all, or a sequence of one per world. The same object is one ground.
  std::vector<std::shared_ptr<const Ground>> readGrounds(const py::object& given) const {
    const auto copy = [](py::handle one) { return std::make_shared<const Ground>(read<Ground>(one, "grounds")); };
    if (!py::isinstance<py::sequence>(given)) return {numWorlds(), copy(given)};
    std::map<PyObject*, std::shared_ptr<const Ground>> known;
    std::vector<std::shared_ptr<const Ground>> out;
    for (const py::handle one : py::sequence(given)) {
      auto& ground = known[one.ptr()];
      if (!ground) ground = copy(one);
      out.push_back(ground);
    }
    return out;
  }

  // Once: the end of a step() ends a step of the world.
  void warnOfStep(double duration) {
    if (has_warned_ || time_step_ <= duration * (1 + 1e-9)) return;
    has_warned_ = true;
    const std::string text = py::str("time_step: {:g} s is longer than a step of {:g} s, and has no effect")
                                 .format(time_step_, duration)
                                 .cast<std::string>();
    if (PyErr_WarnEx(PyExc_RuntimeWarning, text.c_str(), 1) < 0) throw py::error_already_set();
  }

  Eigen::Index numClosures() const { return static_cast<Eigen::Index>(model_->closures().size()); }
  size_t numWorlds() const { return batch_ ? static_cast<size_t>(batch_->count()) : worlds_.size(); }

  // One column per world.
  MatrixXd readRows(py::handle value, Eigen::Index size, const std::string& what, bool shared,
                    Numbers numbers = Numbers::Finite) const {
    const Array array = readArray(value, what);
    if (!std::all_of(array.data(), array.data() + array.size(), [&](double x) {
          return std::isfinite(x) || numbers == Numbers::Any || (numbers == Numbers::NotNan && !std::isnan(x));
        }))
      throw py::value_error(what + ": expected finite numbers");
    const auto count = static_cast<Eigen::Index>(numWorlds());
    if (many_ && !(shared && array.ndim() == 1)) {
      requireShape(array, {count, size}, what);
      return Eigen::Map<const MatrixXd>(array.data(), size, count);
    }
    requireShape(array, {size}, what);
    return Eigen::Map<const VectorXd>(array.data(), size).replicate(1, count);
  }

  // One number per world, or the same for all.
  VectorXd readNumbers(py::handle value, const std::string& what) const {
    const auto count = static_cast<Eigen::Index>(numWorlds());
    const Array array = readArray(value, what);
    return array.ndim() == 0 ? VectorXd::Constant(count, *array.data()) : readVector(value, count, what);
  }

  py::object observe() const {
    MatrixXd time(1, numWorlds()), q(model_->nq(), numWorlds()), v(model_->nv(), numWorlds()), sound(1, numWorlds());
    if (batch_) {
      time = batch_->times().transpose();
      q = batch_->configurations();
      v = batch_->velocities();
      for (int i = 0; i < batch_->count(); ++i) sound(0, i) = batch_->ok(i);
    }
    for (size_t i = 0; i < worlds_.size(); ++i) {
      time(0, i) = worlds_[i]->time();
      q.col(i) = worlds_[i]->configuration();
      v.col(i) = worlds_[i]->velocity();
      sound(0, i) = ok_[i];
    }
    return makeNamed("WorldState", {makeRows(time, {}), makeRows(q, {model_->nq()}), makeRows(v, {model_->nv()}),
                                    makeRows(sound, {}).attr("astype")("bool")});
  }

  template <typename Task>
  void run(const Task& task) {
    const py::gil_scoped_release release;
    std::vector<std::exception_ptr> errors(worlds_.size());
#pragma omp parallel for schedule(dynamic) num_threads(threads_) if (worlds_.size() > 1)
    for (size_t i = 0; i < worlds_.size(); ++i) {
      try {
        task(*worlds_[i], static_cast<Eigen::Index>(i));
      } catch (...) {
        errors[i] = std::current_exception();
      }
    }
    for (const std::exception_ptr& error : errors)
      if (error) std::rethrow_exception(error);
  }

  std::shared_ptr<Model> model_;
  std::unique_ptr<worlds::WorldBatch> batch_;  // or else
  std::vector<std::unique_ptr<World>> worlds_;
  std::vector<char> ok_;  // of each, since its last step or reset
  std::optional<int> many_;
  std::string engine_;
  double time_step_ = 0;
  int threads_ = 1;
  bool has_warned_ = false;
  std::atomic<bool> is_busy_{false};
};

// The sensors of the robots in worlds, each with its own noise.
class HeldSensors {
 public:
  HeldSensors(std::shared_ptr<HeldWorlds> world, double noise, unsigned seed, const SE3& imu)
      : world_(std::move(world)) {
    worlds::SensorOptions options;
    options.noise = noise;
    options.imu = imu;
    for (int i = 0; i < world_->count().value_or(1); ++i) {
      options.seed = seed + static_cast<unsigned>(i);
      sensors_.emplace_back(*world_->model(), options);
    }
    readings_.resize(sensors_.size());
  }

  void reset(double time, const py::object& where) {
    const VectorXd chosen = world_->readMask(where);
    world_->visit([&](Eigen::Index i, const worlds::SensedState& state) {
      if (chosen[i] != 0) sensors_[i].reset(state, time);
    });
    is_reset_ = is_reset_ || where.is_none();
  }

  py::object read() {
    if (!is_reset_) throw std::runtime_error("sensors: reset them first, which sets the time of the first reading");
    world_->visit([&](Eigen::Index i, const worlds::SensedState& state) { readings_[i] = sensors_[i].read(state); });
    if (!world_->count()) return py::cast(readings_.front());
    const Model& model = *world_->model();
    const auto gather = [&](Eigen::Index size, const auto& get) {
      MatrixXd out(size, readings_.size());
      for (size_t i = 0; i < readings_.size(); ++i) out.col(i) = get(readings_[i]);
      return out;
    };
    const auto makeRows = [&](auto member, Eigen::Index size) {
      return world_->makeRows(gather(size, [&](const SensorReadings& r) { return r.*member; }), {size});
    };
    const MatrixXd time = gather(1, [](const SensorReadings& r) { return VectorXd::Constant(1, r.time); });
    return makeNamed("Readings",
                     {world_->makeRows(time, {}), makeRows(&SensorReadings::motor_positions, model.nu()),
                      makeRows(&SensorReadings::motor_torques, model.nu()),
                      makeRows(&SensorReadings::angular_velocity, 3), makeRows(&SensorReadings::specific_force, 3)});
  }

 private:
  std::shared_ptr<HeldWorlds> world_;
  std::vector<worlds::Sensors> sensors_;
  std::vector<SensorReadings> readings_;
  bool is_reset_ = false;
};

void bindSensors(py::module_& module) {
  py::class_<HeldSensors>(
      module, "Sensors",
      "Encoders of 14 bits on the motors and an IMU (Bosch BMI088) in the trunk of the robot of a World, or of each of "
      "its many.")
      .def(
          py::init<std::shared_ptr<HeldWorlds>, double, unsigned, const SE3&>(), py::arg("world"),
          py::arg("noise") = 1.0, py::arg("seed") = 1, py::arg("imu") = SE3(),
          "noise: factor of the data-sheet noise, 0: exact; seed: of the first world, the next ones count on; imu: its "
          "placement in the trunk.")
      .def(
          "reset", &HeldSensors::reset, py::arg("time"), py::arg("where") = py::none(),
          "Starts from the world's current state; the first readings come after a time, s. where: as in World.reset().")
      .def("read", &HeldSensors::read,
           "SensorReadings at the time of the world, or Readings with an axis of worlds; those of the IMU are means "
           "since the last call.");
}

}  // namespace

void bindWorlds(py::module_& module) {
  py::class_<HeldWorlds, std::shared_ptr<HeldWorlds>>(
      module, "World",
      "Physics with contact, in which motors drive a robot and the ground pushes it.\n\n"
      "engine: 'bielle', its own, or 'simbody' and 'mujoco' where it was built with them.\n"
      "time_step: s, of worlds of fixed steps; the longest one of others; 0: their own. A shorter step() cuts it, and "
      "warns.\n"
      "tolerance: error per step of 'bielle' and 'simbody', rad, m and relative in velocities; with it, 'bielle' takes "
      "steps of high order and controlled error, for mechanisms in motion; 0: fixed steps, the fastest on feet.\n"
      "play: of joints and of the rods that closures tie, {name: from stop to stop, rad or m}, as a Robot has it; * "
      "stands for any text. States are those of the robot without it: a joint is where its link is.\n"
      "rod_frictions: RodFrictions, as a Robot has them; in 'bielle', others warn.\n"
      "With `count`, that many worlds are stepped together on all cores, or on `threads`: arguments and results have a "
      "leading axis of worlds.")
      .def(py::init([](std::shared_ptr<Model> model, const py::object& count, const Ground& ground, double time_step,
                       double tolerance, const std::string& engine, int threads, const py::object& play,
                       const py::object& rod_frictions) {
             return std::make_shared<HeldWorlds>(std::move(model), read<std::optional<int>>(count, "count"), ground,
                                                 time_step, tolerance, engine, threads, read<NamedSizes>(play, "play"),
                                                 read<std::vector<RodFriction>>(rod_frictions, "rod_frictions"));
           }),
           py::arg("model"), py::arg("count") = py::none(), py::arg("ground") = Ground(), py::arg("time_step") = 0.0,
           py::arg("tolerance") = 0.0, py::arg("engine") = "bielle", py::arg("threads") = 0,
           py::arg("play") = py::dict(), py::arg("rod_frictions") = py::tuple())
      .def_property_readonly("model", &HeldWorlds::model, "Model")
      .def_property_readonly(
          "count", [](const HeldWorlds& self) { return show(self.count(), {}); }, "number of worlds, or None")
      .def_property_readonly("engine", &HeldWorlds::engine, "its name")
      .def("reset", &HeldWorlds::reset, py::arg("q"), py::arg("v"), py::arg("where") = py::none(),
           "Sets closed configurations (nq,) and velocities (nv,) that keep them closed; everything else starts "
           "again. Where loops are open, a world of 'bielle' is not ok, and its message tells how far.\n\n"
           "where: (count,), True for the worlds that are reset while the others stay unchanged; None: all. Returns "
           "the WorldState.")
      .def("step", &HeldWorlds::step, py::arg("u"), py::arg("duration"), py::arg("push") = py::make_tuple(0, 0, 0),
           py::arg("where") = py::none(),
           "Advances by a duration (s) under motor torques (nu,), cut at their limits, and a force at the trunk (3,), "
           "N.\n\n"
           "where: as in reset(); the other worlds stay as they are. With `count`, a world whose torques or push are "
           "not "
           "finite breaks off. Returns the WorldState; its `ok` is False where "
           "the integration failed.")
      .def(
          "set", &HeldWorlds::set, py::arg("mass_factors") = py::none(), py::arg("armatures") = py::none(),
          py::arg("effort_limits") = py::none(), py::arg("friction") = py::none(), py::arg("delays") = py::none(),
          py::arg("grounds") = py::none(), py::arg("torque_constants") = py::none(),
          py::arg("resistances") = py::none(), py::arg("voltages") = py::none(), py::arg("currents") = py::none(),
          py::arg("rod_changes") = py::none(),
          "Sets parameters by which worlds differ from the model, from now on and over reset(), of worlds made with "
          "`count` and without play; each for all alike, or with a leading axis of worlds.\n\n"
          "mass_factors: (bodies,), mass and inertia over those of the model, the world first; armatures: (nu,), of "
          "the motors, kg m^2 or kg; effort_limits: (nu,), N m or N; friction: of the ground; delays: from step() "
          "until "
          "its torques act, to the nearest whole time step, s; grounds: a Ground for all or a list of them, either all "
          "with steps or none, as the world was made; reset worlds whose ground changes.\n\n"
          "torque_constants: (nu,), of windings, N m/A, 0: none; resistances: (nu,), ohm; voltages: (nu,), of the "
          "supply, V; currents: (nu,), A: within its effort limit a motor gives efficiency * ratio * torque_constant * "
          "current at most, and, the faster it turns, what the voltage leaves (MotorDrive); rod_changes: (closures,), "
          "by how much the rod that a closure ends, or that is a distance, is longer than in the model, m, 0 where "
          "there is none: its loops must have no redundant rows. Worlds whose rods change are not ok until they are "
          "reset, which closes their loops from the state given, and shifts the robot so that its lowest foot is as "
          "high. Raises ValueError, and nothing changes.")
      .def_property_readonly("parameters", &HeldWorlds::parameters, "WorldParameters, of worlds made with `count`")
      .def_property_readonly("books", &HeldWorlds::books,
                             "energies now, and work and losses since reset, of a single world (Books), J")
      .def_property_readonly(
          "integration", &HeldWorlds::integration,
          "how a single world integrates: integrator, tolerances (0: none), shortest and longest step "
          "since reset, s")
      .def_property_readonly("warnings", &HeldWorlds::warnings,
                             "what the world leaves out of the model, or takes otherwise")
      .def_property_readonly("message", &HeldWorlds::message,
                             "why the integration failed, empty while it is sound; with `count`, a list of them")
      .def_property_readonly("wrenches", &HeldWorlds::calcWrenches,
                             "wrenches from the ground on the feet in their contact frames (contacts, 6), N and N m");
  bindSensors(module);
}

}  // namespace bielle::python
