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

}  // namespace

struct WorldBatch::Data {
  Data(const Model& model, int count, const WorldBatchOptions& options);

  int getFirst(size_t group) const { return static_cast<int>(group) * static_cast<int>(kLane); }
  // Lanes of a group from columns of a matrix of all worlds, of which the last group may lack some.
  VectorX<Lanes> pack(const MatrixView& x, size_t group) const {
    VectorX<Lanes> out(x.rows());
    std::array<const double*, kLane> columns;
    for (int l = 0; l < kLane; ++l)
      columns[l] = x.data() + x.outerStride() * std::min<Eigen::Index>(getFirst(group) + l, x.cols() - 1);
    packLanes(columns, x.rows(), out.data());
    return out;
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
  // Calls task(steps, group) with the robots of each group in the steps of a thread.
  template <typename Task>
  void visit(const Task& task) {
    std::atomic<size_t> next{0};
    const auto work = [&](int thread) {
      for (size_t group; (group = next++) < groups.size();) {
        steps[thread]->swap(groups[group]);
        task(*steps[thread], group);
        steps[thread]->swap(groups[group]);
      }
    };
    team.run(static_cast<int>(steps.size()), work);
  }
  void read(const Steps& steps, size_t group, const LaneMask& which);
  void takeSteps(Steps& steps, size_t group, const MatrixView& u, const MatrixView& push, double duration);

  Model model;
  BielleWorldOptions options;
  int count;
  double time_step;
  std::vector<std::unique_ptr<Steps>> steps;  // one a thread
  Team team;
  std::vector<Steps::State> groups;  // of kLane worlds
  MatrixXd q, v, wrenches;
  VectorXd times;
  std::vector<char> is_ok;
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
    steps.push_back(std::make_unique<Steps>(model, options.world.ground, options.contact, options.world.pushed_body));
  groups.assign(size, steps.front()->copyState());
  q = model.makeNeutral().replicate(1, count);
  v.setZero(model.nv(), count);
  wrenches.setZero(6 * static_cast<Eigen::Index>(model.contacts().size()), count);
  times.setZero(count);
  is_ok.assign(static_cast<size_t>(count), false);
  messages.assign(static_cast<size_t>(count), "it has not been reset");
}

void WorldBatch::Data::read(const Steps& steps, size_t group, const LaneMask& which) {
  unpack(steps.tree().configuration() + steps.tree().turns(), group, which, q);
  unpack(steps.tree().velocity(), group, which, v);
  VectorX<Lanes> all(wrenches.rows());
  for (size_t c = 0; c < model.contacts().size(); ++c) {
    const ContactFrame& contact = model.contacts()[c];
    const SE3Of<Lanes> X_WF = steps.tree().getPlacement(contact.body) * contact.X_BF;
    all.segment<6>(6 * static_cast<Eigen::Index>(c)) = X_WF.actInvForce(steps.moment().wrenches[c]);
  }
  unpack(all, group, which, wrenches);
}

void WorldBatch::Data::takeSteps(Steps& steps, size_t group, const MatrixView& u, const MatrixView& push,
                                 double duration) {
  VectorX<Lanes> efforts = VectorX<Lanes>::Zero(model.nu());
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
      efforts[m].set(l, motor.clampEffort(u(m, world), v(motor.dof, world)));
    }
    for (int i = 0; i < 3; ++i) force[i].set(l, push(i, world));
  }
  if (!any(which)) return;
  const double count = World::countSteps(duration, time_step), h = duration / count;
  Steps::Courses courses;
  for (int l = 0; l < kLane; ++l)
    if (which[l]) courses[l].time = times[getFirst(group) + l];
  steps.command(efforts, force);
  steps.advance(count, h, which, options.world.interrupt, courses);
  for (int l = 0; l < kLane; ++l) {
    if (!which[l]) continue;
    const int world = getFirst(group) + l;
    const bool is_done = courses[l].taken == count;
    times[world] += is_done ? duration : courses[l].taken * h;
    is_ok[world] = courses[l].message.empty();
    messages[world] = courses[l].message;
  }
  read(steps, group, which);
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
  const std::vector<char> marks = where.empty() ? std::vector<char>(static_cast<size_t>(d.count), true) : where;
  for (int i = 0; i < d.count; ++i)
    if (marks[i] && !(q.col(i).allFinite() && v.col(i).allFinite()))
      throw std::invalid_argument("worlds: the state of world " + std::to_string(i) +
                                  " has a number that is not finite; give a closed configuration and a velocity");
  d.visit([&](Steps& steps, size_t group) {
    const LaneMask which = d.choose(group, marks);
    if (!any(which)) return;
    const LaneMask done = steps.start(d.pack(q, group), d.pack(v, group), which);
    for (int l = 0; l < kLane; ++l) {
      if (!which[l]) continue;
      const int world = d.getFirst(group) + l;
      d.times[world] = 0;
      d.is_ok[world] = done[l];
      d.messages[world] = done[l] ? "" : steps.tree().failure(l);
    }
    d.read(steps, group, done);
  });
}

bool WorldBatch::step(const MatrixView& u, const MatrixView& push, double duration) {
  Data& d = *data_;
  requireShape(u, d.model.nu(), d.count, "u");
  requireShape(push, 3, d.count, "push");
  if (!(duration > 0 && std::isfinite(duration)))
    throw std::invalid_argument("worlds: the duration is " + std::to_string(duration) +
                                " s; give a positive number of seconds");
  d.visit([&](Steps& steps, size_t group) { d.takeSteps(steps, group, u, push, duration); });
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
  for (const auto& steps : data_->steps) rounds += steps->rounds();
  return rounds;
}

}  // namespace bielle::worlds
