#include "bielle/worlds/bielle_world.h"

#include "worlds/leapfrog.h"
#include "worlds/left_out.h"
#include "worlds/open_loops.h"

namespace bielle::worlds {
namespace {

class BielleWorld : public World {
 public:
  BielleWorld(const Model& model, const BielleWorldOptions& options)
      : World(model, options.world),
        time_step_(options.world.time_step > 0 ? options.world.time_step : kBielleTimeStep),
        interrupt_(options.world.interrupt),
        steps_(model, options.world, options.contact) {
    integration_.integrator = "leapfrog";
    warnings_ = listMissingStops(model);
  }

  Books books() const override {
    Books books = World::books();
    steps_.contacts().addTo(
        books, [this](int body, const Vector3d& point) { return steps_.getPlace(body, point); },
        [this](const JointStop& stop) { return q_[stop.coordinate]; });
    return books;
  }

 private:
  void start() override {
    message_ = steps_.start(q_, v_, true) ? describeOpenLoops(model_, ws_, q_) : steps_.tree().failure();
    readState();
    steps_.contacts().setStart([this](int body, const Vector3d& point) { return steps_.getPlace(body, point); },
                               [this](const JointStop& stop) { return q_[stop.coordinate]; });
  }

  void noteForces() override { steps_.command(u_, push_); }

  bool step(double duration) override {
    const double steps = countSteps(duration, time_step_), h = duration / steps;
    Course& course = course_[0];
    course.time = time_;
    course.steps = steps;
    steps_.advance(h, true, interrupt_, course_);
    message_ = course.message;
    const bool is_done = course.taken == steps && message_.empty();
    time_ += is_done ? duration : course.taken * h;
    if (course.longest_step > 0) {
      noteStep(course.longest_step);
      noteStep(course.shortest_step);
    }
    const WorksOf<double>& works = steps_.moment().works;
    work_ = {works.motor, works.push, works.contact, works.stop, works.joint};
    readState();
    for (size_t c = 0; c < model_.contacts().size(); ++c)
      setFootWrench(static_cast<int>(c), steps_.moment().wrenches[c]);
    reportFeet([this](int body) { return steps_.tree().getPlacement(body); });
    return is_done;
  }

  void readState() {
    q_ = steps_.tree().configuration() + steps_.tree().turns();
    v_ = steps_.tree().velocity();
  }

  const double time_step_;
  const std::atomic<bool>* const interrupt_;
  LeapfrogOf<double> steps_;
  LeapfrogOf<double>::Courses course_;
};

}  // namespace

std::unique_ptr<World> makeBielleWorld(const Model& model, const BielleWorldOptions& options) {
  return std::make_unique<BielleWorld>(model, options);
}

}  // namespace bielle::worlds
