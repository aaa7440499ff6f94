#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bielle/model/builder.h"
#include "bielle/model/wear.h"
#include "model/rod_end.h"

namespace bielle {
namespace {

// Of what has play, the part on the other side: some engines refuse bodies without inertia.
constexpr double kShare = 1e-3;

[[noreturn]] void refuse(const std::string& name, const std::string& problem, const std::string& remedy) {
  throw InputError("", "play of '" + name + "'", problem, remedy);
}

// Sizes by indices of joints and closures.
struct Places {
  std::map<int, double> joints, closures;
};

Places findPlaces(const Model& model, const std::vector<Play>& plays) {
  Places places;
  for (const Play& play : plays) {
    if (!(play.size >= 0 && std::isfinite(play.size)))
      refuse(play.name, "its size is negative or not finite", "give the way from stop to stop, rad or m");
    bool is_found = false;
    const auto set = [&](int index, std::map<int, double>& sizes) {
      is_found = true;
      if (play.size > 0)
        sizes[index] = play.size;
      else
        sizes.erase(index);
    };
    const auto fits = [&](const std::string& name) {
      return fnmatch(play.name.c_str(), name.c_str(), FNM_NOESCAPE) == 0;
    };
    for (int i = 1; i < model.numBodies(); ++i)
      if (fits(model.joints()[i].name)) set(i, places.joints);
    for (size_t c = 0; c < model.closures().size(); ++c)
      if (fits(model.closures()[c].name)) set(static_cast<int>(c), places.closures);
    if (!is_found)
      refuse(play.name, "there is no such joint or closure", "`bielle info` lists them; * stands for any text");
  }
  return places;
}

Inertia scale(const Inertia& inertia, double factor) {
  return {factor * inertia.mass, inertia.com, factor * inertia.I_com};
}

class PlayBuilder {
 public:
  PlayBuilder(const Model& model, const Places& places) : model_(model), places_(places), builder_(model.name()) {
    for (const Body& body : model.bodies()) inertias_.push_back(body.inertia);
  }

  Model build() {
    builder_.setGravity(model_.gravity());
    for (const auto& [c, size] : places_.closures) placeEnd(model_.closures()[static_cast<size_t>(c)], size);
    for (int i = 1; i < model_.numBodies(); ++i) addLink(i);
    for (const End& end : ends_)
      builder_.addLink(end.joint.name, getLink(end.body), end.joint, end.inertia, makeLimits(end.size));
    addFrames();
    for (const Closure& closure : model_.closures()) addClosure(closure);
    for (const Motor& motor : model_.motors()) builder_.addMotor(motor);
    for (const Joint& joint : model_.joints())
      if (joint.nv > 0 && model_.findMotor(joint.name) < 0)
        builder_.setArmature(joint.name, model_.armature()[joint.idx_v]);
    for (const JointForce& force : model_.jointForces())
      builder_.addJointForce(model_.joints()[static_cast<size_t>(force.joint)].name, force);
    for (const PointSpring& spring : model_.pointSprings()) builder_.copyPointSpring(model_, spring);
    for (Reference reference : model_.references()) {
      for (const std::string& name : names_) reference.joints[name] = {0};
      references_.push_back(std::move(reference));
    }
    addContacts();
    for (const Reference& reference : references_) builder_.addReference(reference);
    for (const Visual& visual : model_.visuals()) builder_.addVisual(getLink(visual.body), visual);
    for (const Shape& shape : model_.shapes())
      if (!shape.fitted) builder_.addShape(getLink(shape.body), shape);
    for (const int joint : model_.serialJoints())
      builder_.addSerialJoint(model_.joints()[static_cast<size_t>(joint)].name);
    return builder_.build();
  }

 private:
  // A rod's end beyond its play.
  struct End {
    int body = 0;
    Joint joint;
    Inertia inertia;
    double size = 0;
  };

  std::string getLink(int body) const { return body == 0 ? "world" : model_.bodies()[static_cast<size_t>(body)].name; }

  static JointLimits makeLimits(double size) {
    return {VectorXd::Constant(1, -0.5 * size), VectorXd::Constant(1, 0.5 * size), {}};
  }

  void addLink(int i) {
    const Joint& joint = model_.joints()[static_cast<size_t>(i)];
    const auto get = [&joint](const VectorXd& values) { return VectorXd(values.segment(joint.idx_v, joint.nv)); };
    const JointLimits limits = {get(model_.lowerLimits()), get(model_.upperLimits()), get(model_.velocityLimits())};
    const auto at = places_.joints.find(i);
    const Inertia& inertia = inertias_[static_cast<size_t>(i)];
    if (at == places_.joints.end()) {
      builder_.addLink(getLink(i), getLink(joint.parent), joint, inertia, limits);
      return;
    }
    if (joint.nv != 1)
      refuse(joint.name, "it has " + std::to_string(joint.nv) + " coordinates", "name a joint of one coordinate");
    if (!(model_.armature()[joint.idx_v] > 0))
      refuse(joint.name, "nothing turns before its play: it has no armature", "give its motor an armature");
    Joint play = joint;
    play.name = getPlayName(joint.name);
    play.X_PJ = SE3();
    if (play.kind == JointKind::Continuous) play.kind = JointKind::Revolute;
    builder_.addLink(play.name, getLink(joint.parent), joint, scale(inertia, kShare), limits);
    builder_.addLink(getLink(i), play.name, play, scale(inertia, 1 - kShare), makeLimits(at->second));
    names_.push_back(play.name);
  }

  void placeEnd(const Closure& closure, double size) {
    const std::optional<RodEnd> found = findRodEnd(model_, closure);
    if (!found)
      refuse(closure.name, "it does not close the end of a rod", "name a rod with a body of its own, or a joint");
    if (!(found->far.norm() > 1e-9))
      refuse(closure.name, "its rod has no length", "cut the loop at the rod's other end");
    End end;
    end.body = found->is_first ? closure.body1 : closure.body2;
    end.size = size;
    end.joint.name = getPlayName(closure.name);
    end.joint.kind = JointKind::Prismatic;
    end.joint.axis = found->far.normalized();
    end.joint.X_PJ.p = (found->is_first ? closure.X_B1 : closure.X_B2).p;
    Inertia& rod = inertias_[static_cast<size_t>(end.body)];
    end.inertia = scale(rod, kShare).transformed(end.joint.X_PJ.inverse());
    rod = scale(rod, 1 - kShare);
    names_.push_back(end.joint.name);
    ends_.push_back(std::move(end));
  }

  void addFrames() {
    for (const Frame& frame : model_.frames())
      if (frame.name != getLink(frame.body)) builder_.addFrame(frame.name, getLink(frame.body), frame.X_BF);
  }

  void addClosure(const Closure& closure) {
    const std::string name = getPlayName(closure.name);
    const auto end =
        std::find_if(ends_.begin(), ends_.end(), [&name](const End& other) { return other.joint.name == name; });
    if (end == ends_.end()) return builder_.copyClosure(model_, closure);
    const auto place = [&](const char* suffix, int body, const SE3& X_BF) {
      const bool is_end = body == end->body;
      builder_.addFrame(name + suffix, is_end ? name : getLink(body), is_end ? SE3(X_BF.R, Vector3d::Zero()) : X_BF);
      return name + suffix;
    };
    const std::string frame1 = place("/frame1", closure.body1, closure.X_B1);
    builder_.addClosure(frame1, place("/frame2", closure.body2, closure.X_B2), closure);
  }

  void addContacts() {
    for (const ContactFrame& contact : model_.contacts()) {
      const std::string frame = contact.name + "/frame";
      builder_.addFrame(frame, getLink(contact.body), contact.X_BF);
      builder_.addContact(contact.name, frame, contact.kind, contact.half_length, contact.half_width);
    }
  }

  const Model& model_;
  const Places& places_;
  ModelBuilder builder_;
  std::vector<Inertia> inertias_;  // of the bodies, without the ends
  std::vector<End> ends_;
  std::vector<std::string> names_;  // of the free coordinates
  std::vector<Reference> references_;
};

}  // namespace

std::string getPlayName(const std::string& name) { return name + ".play"; }

std::vector<Play> listPlays(const Model& model, const std::vector<Play>& plays) {
  const Places places = findPlaces(model, plays);
  std::vector<Play> out;
  for (const auto& [i, size] : places.joints) out.push_back({model.joints()[static_cast<size_t>(i)].name, size});
  for (const auto& [c, size] : places.closures) out.push_back({model.closures()[static_cast<size_t>(c)].name, size});
  return out;
}

Model addPlay(const Model& model, const std::vector<Play>& plays) {
  const Places places = findPlaces(model, plays);
  if (places.joints.empty() && places.closures.empty()) return model;
  return PlayBuilder(model, places).build();
}

}  // namespace bielle
