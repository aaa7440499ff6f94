#include "results/motion_mcap.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/results/result.h"
#include "dynamics/ground_step.h"
#include "model/number_text.h"
#include "motion.pb.h"
#include "results/foxglove_scene.h"
#include "results/ground_json.h"
#include "results/mcap_file.h"
#include "results/skeleton.h"

namespace bielle {
namespace {

const Eigen::Vector4d kContactColor(0.1, 0.6, 0.2, 1), kClosureColor(0.8, 0.3, 0.1, 1), kGroundColor(0.6, 0.6, 0.6, 1),
    kFootholdColor(0.1, 0.6, 0.2, 0.4), kPredictedColor(0.1, 0.4, 0.9, 0.4);
constexpr double kPlanOpacity = 0.3;
constexpr char kPlanPrefix[] = "plan/";

// A file with those that it imports before it, as readers want them.
void addDescription(const google::protobuf::FileDescriptor& file, std::set<std::string>& added,
                    google::protobuf::FileDescriptorSet& set) {
  if (!added.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) addDescription(*file.dependency(i), added, set);
  file.CopyTo(set.add_file());
}

class MotionMcapWriter {
 public:
  MotionMcapWriter(const LoadedRobot& robot, const MotionRecord& record, const Json& summary)
      : robot_(robot), model_(robot.model), record_(record), summary_(summary), ws_(robot.model) {
    file_.library = "bielle " + getBuildInfo().bielle;
    for (const Joint& joint : model_.joints())
      if (joint.nq == joint.nv && joint.kind != JointKind::Planar)  // whose rates are those of q
        for (int k = 0; k < joint.nv; ++k) coordinates_.emplace_back(joint.idx_q + k, joint.idx_v + k);
  }

  MotionMcap write(const std::optional<MotionRecord>& plan) {
    writeScene(plan.has_value());
    writeDescription();
    writeNodes(record_, "");
    if (plan) writeNodes(*plan, kPlanPrefix);
    writeStages();
    if (record_.footholds.rows() > 0) writePredictedFootholds();
    writeEvents();
    std::map<std::string, std::string>& about = file_.metadata["bielle"];
    for (const char* key : {"motion", "robot", "world", "control", "outcome"})
      if (summary_.contains(key) && summary_[key].is_string()) about[key] = summary_[key].get<std::string>();
    return {formatMcapFile(std::move(file_)), std::move(warnings_)};
  }

 private:
  void send(const std::string& topic, double time, const google::protobuf::Message& message) {
    const auto [it, is_new] = channels_.emplace(topic, static_cast<int>(file_.channels.size()));
    if (is_new) file_.channels.push_back({topic, "protobuf", findSchema(*message.GetDescriptor())});
    file_.messages.push_back({it->second, getNanoseconds(time), message.SerializeAsString()});
  }

  static std::uint64_t getNanoseconds(double time) { return static_cast<std::uint64_t>(std::llround(time * 1e9)); }

  int findSchema(const google::protobuf::Descriptor& type) {
    for (size_t i = 0; i < file_.schemas.size(); ++i)
      if (file_.schemas[i].name == type.full_name()) return static_cast<int>(i);
    google::protobuf::FileDescriptorSet set;
    std::set<std::string> added;
    addDescription(*type.file(), added, set);
    file_.schemas.push_back({type.full_name(), "protobuf", set.SerializeAsString()});
    return static_cast<int>(file_.schemas.size()) - 1;
  }

  void writeScene(bool has_plan) {
    foxglove::SceneUpdate scene = makeRobotScene(robot_, "", 1);
    addGround(scene);
    send("/scene/robot", record_.time[0], scene);
    if (has_plan) send("/scene/plan", record_.time[0], makeRobotScene(robot_, kPlanPrefix, kPlanOpacity));
  }

  // The robot as a URDF in a message of ROS 2, whose shapes Rerun draws at the frames of /tf. It does not find the files of
  // meshes: bodies that have nothing else get rods. Limits of joints are left out, since not all can be said.
  void writeDescription() {
    ModelParts parts = takeParts(model_);
    std::vector<Visual>& visuals = parts.visuals;
    const auto is_mesh = [](const Visual& visual) { return visual.shape == Visual::Shape::Mesh; };
    visuals.erase(std::remove_if(visuals.begin(), visuals.end(), is_mesh), visuals.end());
    std::vector<bool> is_drawn(model_.numBodies(), false);
    for (const Visual& visual : visuals) is_drawn[visual.body] = true;
    for (const Visual& rod : listSkeleton(model_, is_drawn)) visuals.push_back(rod);
    parts.lower_limits.setConstant(-HUGE_VAL);
    for (VectorXd* limits : {&parts.upper_limits, &parts.velocity_limits}) limits->setConstant(HUGE_VAL);
    std::string urdf;
    try {
      urdf = formatRobot(ModelBuilder::restore(std::move(parts))).urdf;
    } catch (const InputError& error) {
      warnings_.push_back(std::string("topic /robot_description is left out: ") + error.what());
      return;
    }
    const auto size = static_cast<std::uint32_t>(urdf.size() + 1);  // with the zero at its end
    std::string message("\0\1\0\0", 4);                             // CDR, little-endian
    for (int shift = 0; shift < 32; shift += 8) message += static_cast<char>(size >> shift & 0xff);
    file_.messages.push_back(
        {static_cast<int>(file_.channels.size()), getNanoseconds(record_.time[0]), message + urdf + '\0'});
    file_.channels.push_back({"/robot_description", "cdr", static_cast<int>(file_.schemas.size())});
    file_.schemas.push_back({"std_msgs/msg/String", "ros2msg", "string data"});
  }

  // The steps of the ground as plates; viewers have a grid of their own for the plane.
  void addGround(foxglove::SceneUpdate& scene) const {
    constexpr double kThickness = 0.02;  // m
    if (!summary_.contains("ground")) return;
    foxglove::SceneEntity& entity = addEntity("ground", kWorldFrame, scene);
    for (const GroundStep& step : readGround(summary_["ground"]).steps) {
      const Matrix3d R = calcRotation(step);
      const Eigen::Vector2d size = calcTopSize(step);
      addCube({R, step.top - kThickness / 2 * R.col(2)}, {size.x(), size.y(), kThickness}, kGroundColor, entity);
    }
  }

  // What is known at the nodes, of the motion or of its plan.
  void writeNodes(const MotionRecord& record, const std::string& prefix) {
    const std::string place = "/" + prefix;
    for (Eigen::Index k = 0; k < record.time.size(); ++k) {
      const double time = record.time[k];
      updatePlacements(model_, ws_, record.q.row(k).transpose());
      foxglove::FrameTransforms transforms;
      for (int i = 1; i < model_.numBodies(); ++i) {
        foxglove::FrameTransform& transform = *transforms.add_transforms();
        setTimestamp(time, *transform.mutable_timestamp());
        transform.set_parent_frame_id(kWorldFrame);
        transform.set_child_frame_id(prefix + model_.bodies()[i].name);
        setVector(ws_.X_WB[i].p, *transform.mutable_translation());
        setQuaternion(ws_.X_WB[i].R, *transform.mutable_rotation());
      }
      send(place + "tf", time, transforms);
      send(place + "joints", time, makeJointStates(record, k, coordinates_));
      send(place + "motors", time, makeJointStates(record, k, listMotors()));
      foxglove::PoseInFrame com;
      setTimestamp(time, *com.mutable_timestamp());
      com.set_frame_id(kWorldFrame);
      setPose({Matrix3d::Identity(), record.com.row(k).transpose()}, *com.mutable_pose());
      send(place + "com", time, com);
    }
  }

  using Coordinates = std::vector<std::pair<int, int>>;  // indices into q and v

  Coordinates listMotors() const {
    Coordinates motors;
    for (const Motor& motor : model_.motors()) motors.emplace_back(model_.joints()[motor.joint].idx_q, motor.dof);
    return motors;
  }

  // Accelerations and efforts are those of the stage that begins at the node; an impact has neither, passive joints no efforts.
  foxglove::JointStates makeJointStates(const MotionRecord& record, Eigen::Index k,
                                        const Coordinates& coordinates) const {
    const bool has_stage = k < record.u.rows() && record.time[k + 1] > record.time[k];
    foxglove::JointStates states;
    setTimestamp(record.time[k], *states.mutable_timestamp());
    for (const auto& [q, v] : coordinates) {
      foxglove::JointState& joint = *states.add_joints();
      joint.set_name(record.q_names[q]);
      joint.set_position(record.q(k, q));
      joint.set_velocity(record.v(k, v));
      if (has_stage && std::isfinite(record.a(k, v))) joint.set_acceleration(record.a(k, v));
      for (int m = 0; has_stage && m < model_.nu(); ++m)
        if (model_.motors()[m].dof == v) joint.set_effort(record.u(k, m));
    }
    return states;
  }

  bool isImpact(Eigen::Index stage) const { return record_.time[stage + 1] == record_.time[stage]; }

  // Wrenches and touchdowns.
  void writeStages() {
    // The weight of the robot is as long as its centre of mass is high in the beginning.
    constexpr double kLeastLength = 0.2;  // m
    const double weight = model_.mass() * model_.gravity().norm();
    force_scale_ = std::max(record_.com(0, 2), kLeastLength) / (weight > 0 ? weight : 1);
    std::vector<bool> was_loaded(model_.contacts().size(), false);
    for (Eigen::Index k = 0; k < record_.u.rows(); ++k) {
      if (isImpact(k)) continue;
      updatePlacements(model_, ws_, record_.q.row(k).transpose());
      msg::Wrenches contacts, closures;
      foxglove::SceneUpdate arrows;
      for (size_t c = 0; c < model_.contacts().size(); ++c) {
        const ContactFrame& contact = model_.contacts()[c];
        addWrench({contact.name, contact.body, contact.X_BF, "contact/", kContactColor},
                  record_.contact_wrenches.row(k).segment<6>(6 * c).transpose(), contacts, arrows);
        const bool is_loaded = !record_.contact_wrenches.row(k).segment<6>(6 * c).isZero(0);
        if (is_loaded != was_loaded[c]) writeContactChange(k, contact, is_loaded);
        was_loaded[c] = is_loaded;
      }
      for (size_t c = 0; c < model_.closures().size(); ++c) {
        const Closure& closure = model_.closures()[c];
        if (closure.kind == ClosureKind::Coupler) continue;  // it has no wrench
        Vector6d wrench = record_.closure_wrenches.row(k).segment<6>(6 * static_cast<Eigen::Index>(c)).transpose();
        if (closure.kind == ClosureKind::Distance)  // a tension
          wrench = getPlacement(ws_, closure.body1, closure.X_B1)
                       .actInvForce(calcClosureWrench<double>(ws_, closure, wrench.head<1>()));
        addWrench({closure.name, closure.body1, closure.X_B1, "closure/", kClosureColor}, wrench, closures, arrows);
      }
      const double time = record_.time[k];
      if (contacts.wrenches_size() > 0) sendAt("/wrenches/contacts", time, contacts);
      if (closures.wrenches_size() > 0) sendAt("/wrenches/closures", time, closures);
      for (foxglove::SceneEntity& entity : *arrows.mutable_entities()) setTimestamp(time, *entity.mutable_timestamp());
      for (foxglove::SceneEntityDeletion& deletion : *arrows.mutable_deletions())
        setTimestamp(time, *deletion.mutable_timestamp());
      if (arrows.entities_size() + arrows.deletions_size() > 0) send("/scene/forces", time, arrows);
    }
  }

  template <typename Message>
  void sendAt(const std::string& topic, double time, Message& message) {
    setTimestamp(time, *message.mutable_timestamp());
    send(topic, time, message);
  }

  struct ForcePlace {
    const std::string& name;
    int body;
    const SE3& X_BF;
    const char* kind;
    const Eigen::Vector4d& color;
  };

  // The wrench is in its frame, the arrow in the world. Where there is no force, an arrow of before is removed; forces that are
  // not known (NaN) are left out.
  void addWrench(const ForcePlace& place, const Vector6d& wrench, msg::Wrenches& wrenches,
                 foxglove::SceneUpdate& arrows) {
    if (!wrench.allFinite()) return;
    msg::Wrench& out = *wrenches.add_wrenches();
    out.set_name(place.name);
    out.set_frame_id(model_.bodies()[place.body].name);
    setPose(place.X_BF, *out.mutable_pose());
    setVector(linear(wrench), *out.mutable_force());
    setVector(angular(wrench), *out.mutable_torque());
    const std::string id = place.kind + place.name;
    if (linear(wrench).norm() > 0) {
      const SE3 X_WF = getPlacement(ws_, place.body, place.X_BF);
      foxglove::SceneEntity& entity = addEntity(id, kWorldFrame, arrows);
      addForce(X_WF.p, X_WF.R * linear(wrench), force_scale_, place.color, entity);
      shown_.insert(id);
    } else if (shown_.erase(id) > 0) {
      arrows.add_deletions()->set_id(id);
    }
  }

  void writeContactChange(Eigen::Index k, const ContactFrame& contact, bool is_loaded) {
    const double time = record_.time[k];
    if (k > 0) addEvent(time, foxglove::Log::INFO, contact.name + (is_loaded ? " touches down" : " lifts off"));
    if (!is_loaded) return;
    const SE3 X_WF = getPlacement(ws_, contact.body, contact.X_BF);
    msg::Footholds footholds;
    addFoothold(contact.name, time, X_WF, footholds);
    sendAt("/footholds", time, footholds);
    foxglove::SceneUpdate scene;
    foxglove::SceneEntity& entity =
        addEntity("foothold/" + contact.name + "/" + formatNumber(time), kWorldFrame, scene);
    setTimestamp(time, *entity.mutable_timestamp());
    addSole(contact, X_WF, kFootholdColor, entity);
    send("/scene/footholds", time, scene);
  }

  static void addFoothold(const std::string& name, double time, const SE3& X_WF, msg::Footholds& footholds) {
    msg::Foothold& foothold = *footholds.add_footholds();
    foothold.set_name(name);
    foothold.set_landing_time(time);
    setPose(X_WF, *foothold.mutable_pose());
  }

  static void addSole(const ContactFrame& contact, const SE3& X_WF, const Eigen::Vector4d& color,
                      foxglove::SceneEntity& entity) {
    constexpr double kLeast = 0.02, kThickness = 0.002;  // m
    addCube(X_WF, {std::max(2 * contact.half_length, kLeast), std::max(2 * contact.half_width, kLeast), kThickness},
            color, entity);
  }

  void writePredictedFootholds() {
    for (Eigen::Index k = 0; k < record_.footholds.rows(); ++k) {
      const double time = record_.time[k];
      msg::Footholds footholds;
      foxglove::SceneUpdate scene;
      for (size_t c = 0; c < model_.contacts().size(); ++c) {
        const ContactFrame& contact = model_.contacts()[c];
        const auto entries = record_.footholds.row(k).segment<MotionRecord::kFootholdEntries>(
            static_cast<Eigen::Index>(c) * MotionRecord::kFootholdEntries);
        const std::string id = "landing/" + contact.name;
        if (!entries.allFinite()) {
          if (shown_.erase(id) > 0) {
            foxglove::SceneEntityDeletion& deletion = *scene.add_deletions();
            deletion.set_id(id);
            setTimestamp(time, *deletion.mutable_timestamp());
          }
          continue;
        }
        const SE3 X_WF(Eigen::Quaterniond(entries[7], entries[4], entries[5], entries[6]).toRotationMatrix(),
                       entries.segment<3>(1).transpose());
        addFoothold(contact.name, entries[0], X_WF, footholds);
        foxglove::SceneEntity& entity = addEntity(id, kWorldFrame, scene);
        setTimestamp(time, *entity.mutable_timestamp());
        addSole(contact, X_WF, kPredictedColor, entity);
        shown_.insert(id);
      }
      sendAt("/plan/footholds", time, footholds);
      if (scene.entities_size() + scene.deletions_size() > 0) send("/scene/footholds", time, scene);
    }
  }

  void addEvent(double time, foxglove::Log::Level level, const std::string& text) {
    foxglove::Log log;
    setTimestamp(time, *log.mutable_timestamp());
    log.set_level(level);
    log.set_message(text);
    log.set_name("bielle");
    send("/events", time, log);
  }

  void writeEvents() {
    const bool has_happened = summary_.contains("outcome");
    if (!has_happened && summary_.contains("phases"))
      for (const Json& phase : summary_["phases"])
        if (const int node = phase.at("start_node"); node < record_.time.size())
          addEvent(record_.time[node], foxglove::Log::INFO, "phase " + phase.at("name").get<std::string>());
    if (!has_happened) return;
    for (const Json& push : summary_.value("pushes", Json::array()))
      addEvent(push.at("time_s"), foxglove::Log::WARNING,
               "push of " + formatNumber(push.at("impulse_Ns")) + " N s for " + formatNumber(push.at("duration_s")) +
                   " s in the direction of " + formatNumber(push.at("direction_deg")) + " degrees");
    const bool has_fallen = summary_.value("fell", false);
    const std::string message = summary_.value("outcome_message", "");
    addEvent(has_fallen ? summary_.at("fall_time").get<double>() : record_.time[record_.time.size() - 1],
             has_fallen ? foxglove::Log::ERROR : foxglove::Log::INFO,
             "it " + summary_["outcome"].get<std::string>() + (message.empty() ? "" : ": " + message));
  }

  const LoadedRobot& robot_;
  const Model& model_;
  const MotionRecord& record_;
  const Json& summary_;
  Workspace ws_;
  McapFile file_;
  std::map<std::string, int> channels_;  // by topic
  Coordinates coordinates_;
  double force_scale_ = 0;       // m/N
  std::set<std::string> shown_;  // entities that are in the scene
  std::vector<std::string> warnings_;
};

}  // namespace

MotionMcap formatMotionMcap(const LoadedRobot& robot, const MotionRecord& record,
                            const std::optional<MotionRecord>& plan, const Json& summary) {
  return MotionMcapWriter(robot, record, summary).write(plan);
}

}  // namespace bielle
