#include "worlds/play_world.h"

#include "bielle/dynamics/kinematics.h"

namespace bielle::worlds {
namespace {

int findBody(const Model& model, const std::string& link) { return model.frames()[model.findFrame(link)].body; }

class PlayWorld : public World {
 public:
  using Make = std::function<std::unique_ptr<World>(const Model&, const WorldOptions&)>;

  // \param options  without play
  PlayWorld(const Model& model, const Model& robot, const WorldOptions& options, const Make& make)
      : World(model, options) {
    WorldOptions inside = options;
    inside.pushed_body = findBody(robot, model.bodies()[options.pushed_body].name);
    world_ = make(robot, inside);
    for (int i = 1; i < model.numBodies(); ++i) {
      const std::string& name = model.joints()[i].name;
      places_.push_back({i, robot.findJoint(name), robot.findJoint(getPlayName(name))});
    }
    warnings_ = world_->warnings();
    integration_ = world_->integration();
    q_inside_ = robot.makeNeutral();
    v_inside_.setZero(robot.nv());
    q_motors_ = q_;
  }

  Books books() const override { return world_->books(); }
  double gap() const override { return world_->gap(); }
  const VectorXd& motorConfiguration() const override { return q_motors_; }

 private:
  struct Place {
    int joint = 0, inside = 0, play = -1;  // the last one -1: none
  };

  // Calls visit(joint of the model, that of the robot, the coordinate of its play or null).
  template <typename Visit>
  void visitJoints(const Visit& visit) const {
    const std::vector<Joint>& joints = world_->model().joints();
    for (const Place& place : places_)
      visit(model_.joints()[place.joint], joints[place.inside], place.play < 0 ? nullptr : &joints[place.play]);
  }

  void start() override {
    q_inside_ = world_->model().makeNeutral();
    v_inside_.setZero();
    visitJoints([this](const Joint& joint, const Joint& inside, const Joint*) {
      q_inside_.segment(inside.idx_q, inside.nq) = q_.segment(joint.idx_q, joint.nq);
      v_inside_.segment(inside.idx_v, inside.nv) = v_.segment(joint.idx_v, joint.nv);
    });
    q_motors_ = q_;
    world_->reset(q_inside_, v_inside_);
    message_ = world_->message();
  }

  void noteForces() override {
    world_->setTorques(u_);
    u_ = world_->torques();
    world_->setPush(push_);
  }

  bool step(double duration) override {
    const bool is_done = world_->advance(duration);
    message_ = world_->message();
    time_ = world_->time();
    integration_ = world_->integration();
    visitJoints([this](const Joint& joint, const Joint& inside, const Joint* play) {
      q_.segment(joint.idx_q, joint.nq) = world_->configuration().segment(inside.idx_q, inside.nq);
      v_.segment(joint.idx_v, joint.nv) = world_->velocity().segment(inside.idx_v, inside.nv);
      q_motors_.segment(joint.idx_q, joint.nq) = q_.segment(joint.idx_q, joint.nq);
      if (!play) return;
      q_[joint.idx_q] += world_->configuration()[play->idx_q];
      v_[joint.idx_v] += world_->velocity()[play->idx_v];
    });
    updatePlacements(model_, ws_, q_);
    const auto getPlacement = [this](int body) { return ws_.X_WB[body]; };
    for (size_t c = 0; c < model_.contacts().size(); ++c) {
      const ContactFrame& contact = model_.contacts()[c];
      setFootWrench(static_cast<int>(c),
                    (getPlacement(contact.body) * contact.X_BF).actForce(world_->feet()[c].wrench));
    }
    reportFeet(getPlacement);
    return is_done;
  }

  std::unique_ptr<World> world_;
  std::vector<Place> places_;
  VectorXd q_inside_, v_inside_;  // of the robot with play
  VectorXd q_motors_;
};

}  // namespace

std::unique_ptr<World> makePlayWorld(
    const Model& model, const WorldOptions& options,
    const std::function<std::unique_ptr<World>(const Model& model, const WorldOptions& options)>& make) {
  if (options.wear.plays.empty()) return make(model, options);
  WorldOptions others = options;
  others.wear.plays.clear();
  return std::make_unique<PlayWorld>(model, addPlay(model, options.wear.plays), others, make);
}

}  // namespace bielle::worlds
