#include "worlds/lane_worlds.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/largest_gaps.h"

namespace bielle::worlds {
namespace {

// One world of a batch, which alone steps it. Looks like any other.
class LaneWorld : public World {
 public:
  LaneWorld(const LaneRun& run, WorldBatch& batch, int index)
      : World(run.machine, {run.ground, 0, run.options.interrupt, 0}), batch_(batch), index_(index) {
    warnings_ = batch.warnings();
  }

  // After a step of the batch.
  bool read() {
    readState();
    time_ = batch_.times()[index_];
    work_ = batch_.works(index_);
    integration_ = batch_.integration(index_);
    message_ = batch_.message(index_);
    for (size_t c = 0; c < model_.contacts().size(); ++c) {
      const Vector6d wrench = batch_.wrenches().col(index_).segment<6>(6 * static_cast<Eigen::Index>(c));
      setFootWrench(static_cast<int>(c), getFrame(c).actForce(wrench));
    }
    reportFeet([this](int body) { return ws_.X_WB[body]; });
    return message_.empty();
  }
  const Vector3d& push() const { return push_; }

  Books books() const override {
    Books books = World::books();
    const SpringEnergies now = batch_.springs(index_);
    books.elastic = now.contacts + now.stops;
    books.contact_loss -= now.contacts - start_.contacts;
    books.stop_loss -= now.stops - start_.stops;
    return books;
  }
  double gap() const override { return calcLargestGaps(model_, ws_).position; }  // placements are those of now

 private:
  void start() override {
    std::vector<char> where(static_cast<size_t>(batch_.count()), 0);
    where[index_] = 1;
    MatrixXd q = batch_.configurations(), v = batch_.velocities();
    q.col(index_) = q_;
    v.col(index_) = v_;
    batch_.set(makeParameters());
    batch_.reset(q, v, where);
    readState();
    start_ = batch_.springs(index_);
    message_ = batch_.message(index_);
    integration_ = batch_.integration(index_);
  }
  // Runs advance together.
  bool step(double) override { return fail("it is one of a batch"); }

  WorldParameters makeParameters() const {
    WorldParameters out;
    out.mass_factors = batch_.parameters().mass_factors;
    out.friction = batch_.parameters().friction;
    out.grounds = batch_.parameters().grounds;
    for (int b = 0; b < model_.numBodies(); ++b) {
      const double nominal = batch_.model().bodies()[b].inertia.mass;
      out.mass_factors(b, index_) = nominal > 0 ? model_.bodies()[b].inertia.mass / nominal : 1;
    }
    out.friction[index_] = ground_.friction;
    out.grounds[index_] = std::make_shared<const Ground>(ground_);
    return out;
  }
  void readState() {
    q_ = batch_.configurations().col(index_);
    v_ = batch_.velocities().col(index_);
    updatePlacements(model_, ws_, q_);
  }
  SE3 getFrame(size_t contact) const {
    const ContactFrame& frame = model_.contacts()[contact];
    return ws_.X_WB[frame.body] * frame.X_BF;
  }

  WorldBatch& batch_;
  const int index_;
  SpringEnergies start_;
};

// What goes on in a lane. Its parts refer to those before them.
struct Lane {
  Lane(int number, std::unique_ptr<LaneRun> given, const Plan& plan, WorldBatch& batch, int index)
      : number(number),
        run(std::move(given)),
        world(*run, batch, index),
        carrying(plan, *run->controller, world, run->sensors, run->options) {}

  int number;
  std::unique_ptr<LaneRun> run;
  LaneWorld world;
  Carrying carrying;
};

WorldBatch makeBatch(const Model& model, const Ground& ground, int lanes, const LaneOptions& options) {
  WorldBatchOptions all;
  all.world.world = {ground, options.time_step};
  all.threads = options.threads;
  WorldBatch batch(model, lanes, all);
  WorldParameters own;
  own.grounds.assign(static_cast<size_t>(lanes), std::make_shared<const Ground>(ground));
  batch.set(own);
  return batch;
}

}  // namespace

void carryOutInLanes(const Plan& plan, const Model& model, int count, const LaneOptions& options,
                     const std::function<std::unique_ptr<LaneRun>(int run)>& make,
                     const std::function<void(int run, const LaneRun&, const Execution&, const World&)>& done) {
  if (count < 1) return;
  const int most = std::min(count, options.lanes);
  std::unique_ptr<LaneRun> first = make(0);
  const double period = first->options.control_period;
  const std::atomic<bool>* interrupt = first->options.interrupt;
  WorldBatch batch = makeBatch(model, first->ground, most, options);
  std::vector<std::unique_ptr<Lane>> lanes(static_cast<size_t>(most));
  std::vector<char> where(lanes.size(), 0);
  MatrixXd u = MatrixXd::Zero(model.nu(), most), push = MatrixXd::Zero(3, most);
  int next = 0;
  for (int left = count; left > 0 && !(interrupt && *interrupt);) {
    for (int i = 0; i < most; ++i) {
      std::unique_ptr<Lane>& lane = lanes[i];
      if (!lane && next < count) {
        lane = std::make_unique<Lane>(next, first ? std::move(first) : make(next), plan, batch, i);
        ++next;
      }
      where[i] = lane && !lane->carrying.isOver();
      if (!where[i]) continue;
      lane->carrying.command();
      lane->carrying.holdTorques();
      u.col(i) = lane->world.torques();
      push.col(i) = lane->world.push();
    }
    batch.step(u, push, period, where);
    for (int i = 0; i < most; ++i) {
      std::unique_ptr<Lane>& lane = lanes[i];
      if (!lane) continue;
      if (where[i]) lane->carrying.note(lane->world.read());
      if (!lane->carrying.isOver()) continue;
      done(lane->number, *lane->run, lane->carrying.finish(), lane->world);
      lane.reset();
      --left;
    }
  }
}

}  // namespace bielle::worlds
