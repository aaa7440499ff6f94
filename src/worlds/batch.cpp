#include "bielle/worlds/batch.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "bielle/dynamics/assembly.h"
#include "bielle/motion/motion.h"
#include "solve/team.h"
#include "worlds/leapfrog.h"
#include "worlds/left_out.h"

namespace bielle::worlds {
namespace {

using Steps = LeapfrogOf<Lanes>;
using MatrixView = Eigen::Ref<const MatrixXd>;

void requireShape(const MatrixView& x, Eigen::Index rows, Eigen::Index columns, const char* name) {
  if (x.rows() == rows && x.cols() == columns) return;
  throw std::invalid_argument("worlds: " + std::string(name) + " is " + std::to_string(x.rows()) + " x " +
                              std::to_string(x.cols()) + "; give " + std::to_string(rows) + " x " +
                              std::to_string(columns) + ", a column per world");
}

// Of a thread: allocated once, since worlds step in loops.
struct Worker {
  Worker(const Model& model, const BielleWorldOptions& options)
      : steps(model, options.world.ground, options.contact, options.world.pushed_body),
        q(model.nq()),
        v(model.nv()),
        efforts(model.nu()),
        wrenches(6 * static_cast<Eigen::Index>(model.contacts().size())) {}

  Steps steps;
  VectorX<Lanes> q, v, efforts, wrenches;
  Steps::Courses courses;
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
  void takeSteps(Worker& worker, size_t group, const MatrixView& u, const MatrixView& push, double duration);

  Model model;
  BielleWorldOptions options;
  int count;
  double time_step;
  std::vector<std::unique_ptr<Worker>> workers;
  Team team;
  std::vector<Steps::State> groups;  // of kLane worlds
  MatrixXd q, v, wrenches;
  VectorXd times;
  std::vector<char> is_ok, marks;  // marks: of those that are reset
  std::vector<std::string> messages, warnings;
};

WorldBatch::Data::Data(const Model& model, int count, const WorldBatchOptions& all)
    : model(model),
      options(all.world),
      count(count),
      time_step(options.world.time_step > 0 ? options.world.time_step : kBielleTimeStep),
      warnings(listMissingStops(model)) {
  if (count < 1) throw std::invalid_argument("worlds: the count is " + std::to_string(count) + "; give at least one");
  const size_t size = (static_cast<size_t>(count) + kLane - 1) / kLane;
  const auto threads = static_cast<size_t>(all.threads > 0 ? all.threads : getDefaultThreads());
  for (size_t t = 0; t < std::clamp<size_t>(threads, 1, size); ++t)
    workers.push_back(std::make_unique<Worker>(model, options));
  groups.assign(size, workers.front()->steps.copyState());
  q = model.makeNeutral().replicate(1, count);
  v.setZero(model.nv(), count);
  wrenches.setZero(6 * static_cast<Eigen::Index>(model.contacts().size()), count);
  times.setZero(count);
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

void WorldBatch::Data::takeSteps(Worker& worker, size_t group, const MatrixView& u, const MatrixView& push,
                                 double duration) {
  worker.efforts.setZero();
  Vector3<Lanes> force = Vector3<Lanes>::Zero();
  LaneMask which = choose(group, is_ok);
  for (int l = 0; l < kLane; ++l) {
    if (!which[l]) continue;
    const int world = getFirst(group) + l;
    if (!u.col(world).allFinite() || !push.col(world).allFinite()) {
      is_ok[world] = false;
      messages[world] = "its torques or its push are not finite";
      which.set(l, false);
      continue;
    }
    for (int m = 0; m < model.nu(); ++m) {
      const Motor& motor = model.motors()[m];
      worker.efforts[m].set(l, motor.clampEffort(u(m, world), v(motor.dof, world)));
    }
    for (int i = 0; i < 3; ++i) force[i].set(l, push(i, world));
  }
  if (!any(which)) return;
  const double count = World::countSteps(duration, time_step), h = duration / count;
  Steps::Courses& courses = worker.courses;
  for (int l = 0; l < kLane; ++l)
    if (which[l]) courses[l].time = times[getFirst(group) + l];
  worker.steps.command(worker.efforts, force);
  worker.steps.advance(count, h, which, options.world.interrupt, courses);
  for (int l = 0; l < kLane; ++l) {
    if (!which[l]) continue;
    const int world = getFirst(group) + l;
    const bool is_done = courses[l].taken == count;
    times[world] += is_done ? duration : courses[l].taken * h;
    is_ok[world] = courses[l].message.empty();
    messages[world] = courses[l].message;
  }
  read(worker, group, which);
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
  if (!where.empty() && where.size() != static_cast<size_t>(d.count))
    throw std::invalid_argument("worlds: where has " + std::to_string(where.size()) + " entries; give " +
                                std::to_string(d.count));
  const auto isMarked = [&](int i) { return where.empty() || where[i]; };
  for (int i = 0; i < d.count; ++i)
    if (isMarked(i) && !(q.col(i).allFinite() && v.col(i).allFinite()))
      throw std::invalid_argument("worlds: the state of world " + std::to_string(i) +
                                  " has a number that is not finite; give a closed configuration and a velocity");
  for (int i = 0; i < d.count; ++i) d.marks[i] = isMarked(i);
  d.visit([&](Worker& worker, size_t group) {
    const LaneMask which = d.choose(group, d.marks);
    if (!any(which)) return;
    d.pack(q, group, worker.q);
    d.pack(v, group, worker.v);
    const LaneMask done = worker.steps.start(worker.q, worker.v, which);
    for (int l = 0; l < kLane; ++l) {
      if (!which[l]) continue;
      const int world = d.getFirst(group) + l;
      d.times[world] = 0;
      d.is_ok[world] = done[l];
      d.messages[world] = done[l] ? "" : worker.steps.tree().failure(l);
    }
    d.read(worker, group, done);
  });
}

bool WorldBatch::step(const MatrixView& u, const MatrixView& push, double duration) {
  Data& d = *data_;
  requireShape(u, d.model.nu(), d.count, "u");
  requireShape(push, 3, d.count, "push");
  if (!(duration > 0 && std::isfinite(duration)))
    throw std::invalid_argument("worlds: the duration is " + std::to_string(duration) +
                                " s; give a positive number of seconds");
  d.visit([&](Worker& worker, size_t group) { d.takeSteps(worker, group, u, push, duration); });
  return std::all_of(d.is_ok.begin(), d.is_ok.end(), [](char ok) { return ok != 0; });
}

const Model& WorldBatch::model() const { return data_->model; }
int WorldBatch::count() const { return data_->count; }
MatrixView WorldBatch::configurations() const { return data_->q; }
MatrixView WorldBatch::velocities() const { return data_->v; }
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
