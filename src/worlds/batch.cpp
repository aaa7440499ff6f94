#include "bielle/worlds/batch.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "solve/team.h"
#include "worlds/batch_parameters.h"
#include "worlds/contact_law.h"
#include "worlds/leapfrog.h"
#include "worlds/left_out.h"
#include "worlds/open_loops.h"
#include "worlds/torque_pipe.h"

namespace bielle::worlds {
namespace {

using Steps = LeapfrogOf<Lanes>;
using MatrixView = Eigen::Ref<const MatrixXd>;

// Of a thread: allocated once, since worlds step in loops.
struct Worker {
  Worker(const Model& model, const BielleWorldOptions& options)
      : steps(model, options.world, options.contact),
        motors(model.motors()),
        q(model.nq()),
        v(model.nv()),
        efforts(model.nu()),
        wrenches(6 * static_cast<Eigen::Index>(model.contacts().size())),
        closures(model.closures().size()) {}

  Steps steps;
  std::vector<Motor> motors;
  VectorX<Lanes> q, v, efforts, wrenches;
  Steps::Courses courses;
  std::vector<ClosureChangeOf<Lanes>> closures;
};

}  // namespace

struct WorldBatch::Data {
  Data(const Model& model, int count, const WorldBatchOptions& options);

  int getFirst(size_t group) const { return static_cast<int>(group) * static_cast<int>(kLane); }
  // Lanes of a group from columns of a matrix of all worlds, of which the last group may lack some.
  void pack(const MatrixView& x, size_t group, VectorX<Lanes>& out) const {
    std::array<const double*, kLane> columns;
    for (int l = 0; l < kLane; ++l)
      columns[l] = x.data() + x.outerStride() * std::min<Eigen::Index>(getFirst(group) + l, x.cols() - 1);
    packLanes(columns, x.rows(), out.data());
  }
  void unpack(const VectorX<Lanes>& in, size_t group, const LaneMask& which, MatrixXd& x) const {
    std::array<double*, kLane> columns{};
    for (int l = 0; l < kLane; ++l)
      if (which[l]) columns[l] = x.data() + x.rows() * (getFirst(group) + l);
    unpackLanes(in.data(), in.size(), columns);
  }
  LaneMask choose(size_t group, const std::vector<char>& marks) const {
    LaneMask out = makeMask<Lanes>(false);
    for (int l = 0; l < kLane && getFirst(group) + l < count; ++l) out.set(l, marks[getFirst(group) + l]);
    return out;
  }
  // Calls task(worker, group) with the robots of each group in the steps of a thread.
  template <typename Task>
  void visit(const Task& task) {
    std::atomic<size_t> next{0};
    const auto work = [&](int thread) {
      for (size_t group; (group = next++) < groups.size();) {
        Worker& worker = *workers[thread];
        worker.steps.swap(groups[group]);
        task(worker, group);
        worker.steps.swap(groups[group]);
      }
    };
    team.run(static_cast<int>(workers.size()), work);
  }
  void read(Worker& worker, size_t group, const LaneMask& which);
  void vary(Worker& worker, size_t group, const WorldParameters& before);
  void command(Worker& worker, int lane, int world, ConstVectorRef u);
  void takeSteps(Worker& worker, size_t group, const MatrixView& u, const MatrixView& push, double duration);
  void mark(const std::vector<char>& where);
  void start(const MatrixView& q, const MatrixView& v);
  void refuseOpen(const MatrixView& q);
  bool shiftToHeight(const MatrixView& q);
  void setGrounds(const std::vector<std::shared_ptr<const Ground>>& grounds);

  Model model;
  BielleWorldOptions options;
  int count;
  double time_step;
  std::vector<std::unique_ptr<Worker>> workers;
  Team team;
  std::vector<Steps::State> groups;  // of kLane worlds
  WorldParameters parameters;
  std::optional<Rods> rods;
  std::vector<std::shared_ptr<const Terrain>> terrains;  // of parameters.grounds
  std::vector<TorquePipe> pipes;                         // empty where no torques are delayed
  MatrixXd q, v, torques, wrenches;
  Workspace ws;  // of springs()
  VectorXd times, shortest_steps, longest_steps;
  std::vector<char> is_ok, marks;  // marks: of those that are reset, or step
  std::vector<std::string> messages, warnings;
};

WorldBatch::Data::Data(const Model& model, int count, const WorldBatchOptions& all)
    : model(model),
      options(all.world),
      count(count),
      time_step(options.world.time_step > 0 ? options.world.time_step : kBielleTimeStep),
      ws(model),
      warnings(listMissingStops(model)) {
  if (count < 1) throw std::invalid_argument("worlds: the count is " + std::to_string(count) + "; give at least one");
  const size_t size = (static_cast<size_t>(count) + kLane - 1) / kLane;
  const auto threads = static_cast<size_t>(all.threads > 0 ? all.threads : getDefaultThreads());
  for (size_t t = 0; t < std::clamp<size_t>(threads, 1, size); ++t)
    workers.push_back(std::make_unique<Worker>(model, options));
  groups.assign(size, workers.front()->steps.copyState());
  q = model.makeNeutral().replicate(1, count);
  parameters = makeParameters(model, count, options.world.ground.friction);
  rods.emplace(model, workers.front()->steps.tree().reduction());
  v.setZero(model.nv(), count);
  torques.setZero(model.nu(), count);
  wrenches.setZero(6 * static_cast<Eigen::Index>(model.contacts().size()), count);
  for (VectorXd* x : {&times, &shortest_steps, &longest_steps}) x->setZero(count);
  is_ok.assign(static_cast<size_t>(count), false);
  marks = is_ok;
  messages.assign(static_cast<size_t>(count), "it has not been reset");
}

void WorldBatch::Data::read(Worker& worker, size_t group, const LaneMask& which) {
  const ClosedTreeOf<Lanes>& tree = worker.steps.tree();
  worker.q = tree.configuration() + tree.turns();
  unpack(worker.q, group, which, q);
  unpack(tree.velocity(), group, which, v);
  for (size_t c = 0; c < model.contacts().size(); ++c) {
    const ContactFrame& contact = model.contacts()[c];
    const SE3Of<Lanes> X_WF = tree.getPlacement(contact.body) * contact.X_BF;
    worker.wrenches.segment<6>(6 * static_cast<Eigen::Index>(c)) = X_WF.actInvForce(worker.steps.moment().wrenches[c]);
  }
  unpack(worker.wrenches, group, which, wrenches);
}

// Torques of a world that act now, cut at what its motors can give.
void WorldBatch::Data::command(Worker& worker, int lane, int world, ConstVectorRef u) {
  for (int m = 0; m < model.nu(); ++m) {
    Motor& motor = worker.motors[m];
    updateMotor(parameters, m, world, motor);
    torques(m, world) = motor.clampEffort(u[m], v(motor.dof, world));
    worker.efforts[m].set(lane, torques(m, world));
  }
}

void WorldBatch::Data::takeSteps(Worker& worker, size_t group, const MatrixView& u, const MatrixView& push,
                                 double duration) {
  Steps::Courses& courses = worker.courses;
  Vector3<Lanes> force = Vector3<Lanes>::Zero();
  LaneMask which = choose(group, is_ok) && choose(group, marks);
  std::array<double, kLane> start{}, taken{};
  for (int l = 0; l < kLane; ++l) {
    if (!which[l]) continue;
    const int world = getFirst(group) + l;
    if (!u.col(world).allFinite() || !push.col(world).allFinite()) {
      is_ok[world] = false;
      messages[world] = "its torques or its push are not finite";
      which.set(l, false);
      continue;
    }
    if (!pipes.empty()) pipes[world].send(times[world] + parameters.delays[world], u.col(world));
    for (int i = 0; i < 3; ++i) force[i].set(l, push(i, world));
    start[l] = times[world];
  }
  const double count = World::countSteps(duration, time_step), h = duration / count;
  // Where torques are delayed, once for those that act still and once for each that begin to.
  while (any(which)) {
    worker.efforts.setZero();
    for (int l = 0; l < kLane; ++l) {
      if (!which[l]) continue;
      const int world = getFirst(group) + l;
      courses[l].time = times[world];
      courses[l].steps = count - taken[l];
      if (pipes.empty()) {
        command(worker, l, world, u.col(world));
        continue;
      }
      command(worker, l, world, pipes[world].take(times[world] + 0.5 * h));
      const double until = std::max(1.0, std::round((pipes[world].getNext() - times[world]) / h));
      courses[l].steps = std::min(courses[l].steps, until);
    }
    worker.steps.command(worker.efforts, force);
    worker.steps.advance(h, which, options.world.interrupt, courses);
    read(worker, group, which);
    for (int l = 0; l < kLane; ++l) {
      if (!which[l]) continue;
      const int world = getFirst(group) + l;
      taken[l] += courses[l].taken;
      if (courses[l].longest_step > 0) {
        longest_steps[world] = std::max(longest_steps[world], courses[l].longest_step);
        double& shortest = shortest_steps[world];
        shortest = shortest > 0 ? std::min(shortest, courses[l].shortest_step) : courses[l].shortest_step;
      }
      times[world] = start[l] + (taken[l] == count ? duration : taken[l] * h);
      is_ok[world] = courses[l].message.empty();
      messages[world] = courses[l].message;
      which.set(l, is_ok[world] && courses[l].taken == courses[l].steps && taken[l] < count);
    }
  }
}

void WorldBatch::Data::mark(const std::vector<char>& where) {
  if (!where.empty() && where.size() != static_cast<size_t>(count))
    throw std::invalid_argument("worlds: where has " + std::to_string(where.size()) + " entries; give " +
                                std::to_string(count));
  for (int i = 0; i < count; ++i) marks[i] = where.empty() || where[i];
}

WorldBatch::WorldBatch(const Model& model, int count, const WorldBatchOptions& options)
    : data_(std::make_unique<Data>(model, count, options)) {}
WorldBatch::~WorldBatch() = default;
WorldBatch::WorldBatch(WorldBatch&&) noexcept = default;
WorldBatch& WorldBatch::operator=(WorldBatch&&) noexcept = default;

void WorldBatch::reset(const MatrixView& q, const MatrixView& v, const std::vector<char>& where) {
  Data& d = *data_;
  requireShape(q, d.model.nq(), d.count, "q");
  requireShape(v, d.model.nv(), d.count, "v");
  d.mark(where);
  for (int i = 0; i < d.count; ++i)
    if (d.marks[i] && !(q.col(i).allFinite() && v.col(i).allFinite()))
      throw std::invalid_argument("worlds: the state of world " + std::to_string(i) +
                                  " has a number that is not finite; give a closed configuration and a velocity");
  d.start(q, v);
  d.refuseOpen(q);
  if (d.shiftToHeight(q)) d.start(d.q, v);
}

// Worlds that are marked. Each reads its own columns before it writes them, so that q0 may be q.
void WorldBatch::Data::start(const MatrixView& q0, const MatrixView& v0) {
  visit([&](Worker& worker, size_t group) {
    const LaneMask which = choose(group, marks);
    if (!any(which)) return;
    pack(q0, group, worker.q);
    pack(v0, group, worker.v);
    const LaneMask done = worker.steps.start(worker.q, worker.v, which);
    for (int l = 0; l < kLane; ++l) {
      if (!which[l]) continue;
      const int world = getFirst(group) + l;
      times[world] = shortest_steps[world] = longest_steps[world] = 0;
      torques.col(world).setZero();
      if (!pipes.empty()) pipes[world].clear();
      is_ok[world] = done[l];
      messages[world] = done[l] ? "" : worker.steps.tree().failure(l);
    }
    read(worker, group, done);
  });
}

void WorldBatch::Data::refuseOpen(const MatrixView& q) {
  for (int i = 0; i < count; ++i) {
    if (!marks[i] || !is_ok[i] || !parameters.rod_changes.col(i).isZero(0)) continue;
    messages[i] = describeOpenLoops(model, ws, q.col(i));
    is_ok[i] = messages[i].empty();
  }
}

// Where the loops of a world were closed for its own rods, its feet are no longer where they were given. \returns whether any q has
// changed; marked are those then
bool WorldBatch::Data::shiftToHeight(const MatrixView& given) {
  if (!model.hasFreeFlyer() || model.contacts().empty()) return false;
  bool shifts = false;
  for (int i = 0; i < count; ++i) {
    const bool may_shift = marks[i] && is_ok[i] && !parameters.rod_changes.col(i).isZero(0);
    const double shift =
        may_shift ? calcLeastHeight(model, ws, given.col(i)) - calcLeastHeight(model, ws, q.col(i)) : 0;
    q(2, i) += shift;
    marks[i] = shift != 0;
    shifts = shifts || marks[i];
  }
  return shifts;
}

// Worlds whose parameters stay are not touched.
void WorldBatch::Data::vary(Worker& worker, size_t group, const WorldParameters& before) {
  LaneMask rebuilt = makeMask<Lanes>(false);
  for (int l = 0; l < kLane && getFirst(group) + l < count; ++l) {
    const int world = getFirst(group) + l;
    if (parameters.rod_changes.col(world) == before.rod_changes.col(world)) continue;
    rebuilt.set(l, true);
    rods->write(parameters.rod_changes.col(world), l, worker.closures);
    is_ok[world] = false;
    messages[world] = "its rods have other lengths than when it was reset; reset it";
  }
  if (any(rebuilt)) worker.steps.setClosures(worker.closures, rebuilt);
  LaneMask which = makeMask<Lanes>(false);
  for (int l = 0; l < kLane && getFirst(group) + l < count; ++l) {
    const int world = getFirst(group) + l;
    which.set(l, parameters.mass_factors.col(world) != before.mass_factors.col(world) ||
                     parameters.armatures.col(world) != before.armatures.col(world) ||
                     parameters.friction[world] != before.friction[world]);
  }
  if (!any(which)) return;
  VectorX<Lanes> factors(model.numBodies()), armatures(model.nu()), armature = model.armature().cast<Lanes>();
  VectorX<Lanes> friction(1);
  pack(parameters.mass_factors, group, factors);
  pack(parameters.armatures, group, armatures);
  pack(parameters.friction.transpose(), group, friction);
  for (int m = 0; m < model.nu(); ++m) armature[model.motors()[m].dof] = armatures[m];
  worker.steps.vary(factors, armature, friction[0], which);
}

void WorldBatch::Data::setGrounds(const std::vector<std::shared_ptr<const Ground>>& grounds) {
  if (grounds.empty()) return;
  if (grounds.size() != static_cast<size_t>(count))
    throw std::invalid_argument("worlds: there are " + std::to_string(grounds.size()) + " grounds; give " +
                                std::to_string(count));
  const bool has_steps = !options.world.ground.steps.empty();
  std::map<const Ground*, std::shared_ptr<const Terrain>> known;
  for (size_t i = 0; i < terrains.size(); ++i) known[parameters.grounds[i].get()] = terrains[i];
  for (const auto& ground : grounds) {
    if (!ground || ground->steps.empty() == has_steps)
      throw std::invalid_argument(std::string("worlds: a ground has ") + (has_steps ? "no " : "") +
                                  "steps, other than that of all; give grounds with steps, or none");
    if (!known.count(ground.get())) known[ground.get()] = std::make_shared<const Terrain>(*ground);
  }
  terrains.resize(grounds.size());
  for (int i = 0; i < count; ++i) {
    terrains[i] = known.at(grounds[i].get());
    groups[i / kLane].grounds.set(static_cast<int>(i % kLane), *terrains[i]);
  }
}

void WorldBatch::set(const WorldParameters& parameters) {
  Data& d = *data_;
  WorldParameters all = d.parameters;
  takeParameters(d.model, parameters, all);
  d.rods->check(all.rod_changes);
  d.setGrounds(parameters.grounds);
  if (!parameters.grounds.empty()) all.grounds = parameters.grounds;
  std::swap(d.parameters, all);
  if (d.pipes.empty() && !d.parameters.delays.isZero(0)) d.pipes.resize(static_cast<size_t>(d.count));
  d.visit([&](Worker& worker, size_t group) { d.vary(worker, group, all); });
}

bool WorldBatch::step(const MatrixView& u, const MatrixView& push, double duration, const std::vector<char>& where) {
  Data& d = *data_;
  requireShape(u, d.model.nu(), d.count, "u");
  requireShape(push, 3, d.count, "push");
  if (!(duration > 0 && std::isfinite(duration)))
    throw std::invalid_argument("worlds: the duration is " + std::to_string(duration) +
                                " s; give a positive number of seconds");
  d.mark(where);
  d.visit([&](Worker& worker, size_t group) { d.takeSteps(worker, group, u, push, duration); });
  return std::all_of(d.is_ok.begin(), d.is_ok.end(), [](char ok) { return ok != 0; });
}

Works WorldBatch::works(int world) const {
  const WorksOf<Lanes>& works = data_->groups[world / kLane].moment.works;
  const auto lane = world % kLane;
  return {works.motor[lane], works.push[lane], works.contact[lane], works.stop[lane], works.joint[lane]};
}

SpringEnergies WorldBatch::springs(int world) const {
  Data& d = *data_;
  const Steps::State& state = d.groups[world / kLane];
  const auto lane = static_cast<int>(world % kLane);
  updatePlacements(d.model, d.ws, d.q.col(world));
  SpringEnergies out;
  for (const ContactPointOf<Lanes>& each : state.points) {
    const ContactPoint point = takeLane(each, lane);
    const Vector3d x = d.ws.X_WB[point.body].act(point.p);
    const TouchOf<double> touch = findTouch<double>(*state.grounds.terrains[lane], x, point.from);
    const double mu = state.friction[lane];
    out.contacts += calcContactForce<double>(touch, mu, point, x, Vector3d::Zero(), false, {}).elastic;
  }
  for (const JointStop& stop : d.workers.front()->steps.contacts().stops)
    out.stops += state.mass_ratio[lane] * calcStopForce(stop, d.q(stop.coordinate, world), 0).elastic;
  return out;
}

Integration WorldBatch::integration(int world) const {
  Integration out;
  out.integrator = "leapfrog";
  out.shortest_step = data_->shortest_steps[world];
  out.longest_step = data_->longest_steps[world];
  return out;
}

const WorldParameters& WorldBatch::parameters() const { return data_->parameters; }
const Model& WorldBatch::model() const { return data_->model; }
int WorldBatch::count() const { return data_->count; }
MatrixView WorldBatch::configurations() const { return data_->q; }
MatrixView WorldBatch::velocities() const { return data_->v; }
MatrixView WorldBatch::torques() const { return data_->torques; }
MatrixView WorldBatch::wrenches() const { return data_->wrenches; }
const VectorXd& WorldBatch::times() const { return data_->times; }
bool WorldBatch::ok(int world) const { return data_->is_ok[world] != 0; }
const std::string& WorldBatch::message(int world) const { return data_->messages[world]; }
const std::vector<std::string>& WorldBatch::warnings() const { return data_->warnings; }
double WorldBatch::rounds() const {
  double rounds = 0;
  for (const auto& worker : data_->workers) rounds += worker->steps.rounds();
  return rounds;
}

}  // namespace bielle::worlds
