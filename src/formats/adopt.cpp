#include "formats/adopt.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "dynamics/smooth_friction.h"
#include "formats/adopt_dead_points.h"
#include "formats/adopt_feet.h"
#include "formats/adopt_freedoms.h"
#include "formats/robot_files.h"
#include "formats/robot_text.h"
#include "math/direction.h"

namespace bielle {
namespace {

using YAML::BeginMap, YAML::BeginSeq, YAML::EndMap, YAML::EndSeq, YAML::Flow, YAML::Key, YAML::Value;

constexpr double kDownward = 0.9;                               // cosine of gravity and -z, at least
constexpr double kHighest = 0.94, kLowest = 0.5, kStep = 0.04;  // shares of the height of the base
constexpr double kOver = 0.005;                                 // from the centre of mass to the middle of the feet, m
constexpr int kShifts = 20;
constexpr double kJointWeight = 0.01, kBentWeight = 0.1;  // of joints; knees that are bent are to stay so
constexpr double kMostWork = 1e9;                         // iterations times nv^3 for a posture: some ten seconds
constexpr double kRotor = 1e-3, kLever = 0.02, kSole = 0.1;

std::string format(double value) { return formatNumber(std::abs(value) < 1e-9 ? 0.0 : value, "%.4g"); }

double round(double length) { return std::round(length * 1e4) / 1e4; }

class Adopter {
 public:
  /// \param is_bent  starts with joints in the middle of their ranges, not from the neutral configuration
  Adopter(const LoadedRobot& robot, const std::string& path, bool is_bent)
      : model_(robot.model),
        file_(robot.path()),
        robot_file_(robot.file),
        path_(path),
        start_(is_bent ? "a configuration in the middle of all ranges" : "the neutral configuration"),
        ws_(robot.model) {
    if (!model_.hasFreeFlyer())
      fail("it has a fixed base",
           "only robots that stand on feet can be adopted; complete others by hand, with a YAML file that has the key "
           "`model`, motors and a reference");
    if (const Vector3d& down = model_.gravity(); !(down.z() <= -kDownward * down.norm()))
      fail("its gravity points along (" + format(down.x()) + ", " + format(down.y()) + ", " + format(down.z()) +
               "), but the ground is level where z is up",
           "turn it so that z is up");
    const AssemblyResult closed = findClosedConfiguration(model_);
    if (closed.status != NumericalStatus::Ok) fail("its loops do not close: " + closed.message, "correct the robot");
    q_ = closed.q;
    if (const VectorXd bent = is_bent ? bendIntoRanges() : VectorXd(); bent.size() > 0) q_ = bent;
    updatePositions(model_, ws_, q_);
  }
  bool hasPosture() const { return posture_.size() > 0; }

  Adoption write() {
    nameFeet();
    out_ << YAML::Comment("A first guess by `bielle adopt`: correct each entry, then delete the comment above it.")
         << BeginMap << Key << "model" << Value << path_;
    writeMotors();
    writeContacts();
    writePosture();
    writeFriction();
    writeSerialJoints();
    if (posture_.size() > 0) tellDeadPoints();
    out_ << EndMap;
    return {out_.c_str() + std::string("\n"), guesses_};
  }

 private:
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
    throw InputError(file_, "robot '" + model_.name() + "'", problem, remedy);
  }

  // A guess as a comment, before what it explains.
  void guess(const std::string& text) {
    guesses_.push_back(text);
    out_ << YAML::Newline << YAML::Newline << YAML::Comment(text);
  }

  // Feet are looked for on both sides of the xz plane: where there is no pair, after the robot is carried back to where a posture of
  // its file has it from.
  void nameFeet() {
    feet_ = findFeet(model_, ws_);
    if (feet_.size() < 2) {
      const VectorXd q = carryHome(q_);
      Workspace home(model_);
      updatePositions(model_, home, q);
      const std::vector<FoundFoot> feet = findFeet(model_, home);
      if (feet.size() > 1 || feet_.empty()) feet_ = feet, is_carried_ = true, updatePositions(model_, ws_, q);
    }
    if (feet_.empty())
      fail("no frame on a leg has its z axis up in the closed neutral configuration, and no body has a shape",
           "add a link without mass under each foot, z up and x forward");
    const std::vector<FoundFoot> ends = findLegEnds(model_, ws_, feet_);
    are_ends_ = !ends.empty() && std::none_of(ends.begin(), ends.end(),
                                              [this](const FoundFoot& end) { return canTurn(model_, q_, end); });
    if (are_ends_) feet_ = ends;
    are_turned_ = turnForward(feet_);
    has_made_frames_ = feet_[0].frame.empty();
    for (size_t i = 0; i < feet_.size() && has_made_frames_; ++i) {
      feet_[i].frame = "sole" + getContactName(i).substr(4);
      while (model_.findFrame(feet_[i].frame) >= 0) feet_[i].frame += "_";
    }
  }

  // With the base at x = y = 0, and its rotation about the vertical undone.
  VectorXd carryHome(VectorXd q) const {
    const Eigen::Quaterniond base(Eigen::Vector4d(q.segment<4>(3)));
    const Eigen::AngleAxisd back(-2 * std::atan2(base.z(), base.w()), Vector3d::UnitZ());
    q.head<2>().setZero();
    q.segment<4>(3) = (Eigen::Quaterniond(back) * base).coeffs();
    return q;
  }

  // Four feet are named by their quarters, if there is one in each.
  std::string getContactName(size_t i) const {
    if (feet_.size() == 1) return "foot";
    if (feet_.size() == 2) return i == 0 ? "foot_left" : "foot_right";
    static const char* const quarters[] = {"foot_front_left", "foot_front_right", "foot_back_left", "foot_back_right"};
    const double middle = std::accumulate(feet_.begin(), feet_.end(), 0.0, [this](double sum, const FoundFoot& foot) {
      return sum + foot.X_WF.p.x() / static_cast<double>(feet_.size());
    });
    bool is_by_quarters = feet_.size() == 4;
    for (size_t k = 0; k < feet_.size() && is_by_quarters; ++k)
      is_by_quarters = (feet_[k].X_WF.p.x() > middle) == (k < 2) && (feet_[k].X_WF.p.y() > 0) == (k % 2 == 0);
    return is_by_quarters ? quarters[i] : "foot_" + std::to_string(i + 1);
  }

  std::string describeFeet() const {
    return feet_.size() == 1   ? ": only one, without a mirror image."
           : feet_.size() == 2 ? ", mirror images of each other; left is where y is positive."
                               : ", one on each of " + std::to_string(feet_.size()) + " legs that reach as low.";
  }

  void writeMotors() {
    const bool is_given = !model_.motors().empty();
    motors_ = is_given ? model_.motors() : guessMotors(model_, q_, feet_, listEfforts(robot_file_));
    if (motors_.empty())
      return guess("Motors: none are given, and no joint could have one. Name joints under `motors`.");
    const double least = model_.mass() * 9.81 * kLever;
    bool unlimited = false, guessed = false;
    for (const Motor& motor : motors_) {
      unlimited |= motor.effort_limit < least;
      guessed |= motor.armature == 0;
    }
    guess(
        (is_given ? "Motors: those of the robot."
                  : "Motors: none are given; these " + std::to_string(motors_.size()) +
                        " joints, in loops those nearest to the base, move all others. Leave out what is not driven.") +
        std::string(
            guessed ? " Rotors of 1e-3 kg m^2 where none are given, so that light linkages do not accelerate too fast."
                    : "") +
        (unlimited ? " Limits below " + format(least) +
                         " N m, which could not hold the weight on 20 mm, are taken for "
                         "placeholders."
                   : ""));
    out_ << Key << "motors" << Value << BeginMap;
    for (const Motor& motor : motors_) {
      const bool is_weak = motor.effort_limit < least;
      const auto limit = [&](double value) { return is_weak || std::isinf(value) ? ".inf" : format(value); };
      out_ << Key << motor.name << Value << Flow << BeginMap;
      out_ << Key << "armature" << Value << format(motor.armature > 0 ? motor.armature : kRotor);
      out_ << Key << "effort" << Value << limit(motor.effort_limit);
      out_ << Key << "velocity" << Value << limit(motor.velocity_limit);
      for (const auto& [key, value] : getMotorData(motor)) out_ << Key << key << Value << value;
      out_ << EndMap;
    }
    out_ << EndMap;
  }

  void writeFrames() {
    const auto write = [this](const char* key, const Vector3d& v) {
      out_ << Key << key << Value << BeginSeq << formatExact(v.x()) << formatExact(v.y()) << formatExact(v.z())
           << EndSeq;
    };
    out_ << Key << "frames" << Value << BeginMap;
    for (const FoundFoot& foot : feet_) {
      out_ << Key << foot.frame << Value << Flow << BeginMap << Key << "link" << Value;
      out_ << model_.bodies()[foot.body].name;
      write("place", foot.X_BF.p);
      write("rpy", calcRollPitchYaw(foot.X_BF.R));
      out_ << EndMap;
    }
    out_ << EndMap;
  }

  void writeContacts() {
    bool is_measured = true, is_flat = true, is_held = false;
    ModelParts parts = takeParts(model_);
    parts.contacts.clear();
    parts.references.clear();
    for (size_t i = 0; i < feet_.size(); ++i) {
      const FoundFoot& foot = feet_[i];
      std::optional<ContactFrame> contact = measureFoot(model_, foot);
      is_measured &= contact.has_value();
      if (!contact) contact = ContactFrame{"", foot.body, foot.X_BF, ContactKind::Surface6D, kSole / 2, kSole / 2};
      contact->name = getContactName(i);
      if (contact->kind == ContactKind::Surface6D && !canTurn(model_, q_, foot)) {
        *contact = {contact->name, foot.body, foot.X_BF, ContactKind::Point3D, 0, 0};
        is_held = true;
      }
      is_flat &= contact->kind == ContactKind::Surface6D;
      parts.contacts.push_back(*contact);
    }
    guess(std::string(are_turned_
                          ? "Feet: new frames where the lowest ones with z up are, since some of these face backward"
                      : are_ends_ ? "Feet: new frames where legs end if their last links are uniform rods, since no "
                                    "shapes and no frames tell"
                      : has_made_frames_ ? "Feet: new frames on the lowest points of shapes in the posture below"
                                         : "Feet: the lowest frames with z up" +
                                               std::string(feet_[0].is_named ? " that are named like feet"
                                                                             : ", although not named like feet")) +
          describeFeet());
    guesses_.push_back(is_held       ? "Soles: points (3d), since the legs cannot turn their feet about them."
                       : is_measured ? "Soles: the extent of the feet's shapes, which may exceed the flat part."
                                     : "Soles: 0.1 m square, because the feet have no readable shapes.");
    if (!is_flat && !is_held) guesses_.back() += " Narrow or round ones are edges (5d) or points (3d), which roll.";
    if (!is_measured && (!has_made_frames_ || are_turned_) && !feet_[0].is_named)
      guesses_.back() +=
          " Where legs reach below these frames, add a link without mass under each foot, z up and x forward.";
    with_feet_ = ModelBuilder::restore(std::move(parts));
    out_ << YAML::Newline << YAML::Comment(guesses_.back());
    if (has_made_frames_) writeFrames();
    out_ << Key << "contacts" << Value << BeginMap;
    for (size_t i = 0; i < feet_.size(); ++i) {
      const ContactFrame& contact = with_feet_->contacts()[i];
      out_ << Key << contact.name << Value << Flow << BeginMap;
      out_ << Key << "frame" << Value << feet_[i].frame;
      out_ << Key << "type" << Value << getName(contact.kind);
      if (contact.kind == ContactKind::Edge5D) out_ << Key << "length" << Value << format(2 * contact.half_length);
      if (contact.kind == ContactKind::Surface6D)
        out_ << Key << "sole" << Value << BeginSeq << format(2 * contact.half_length) << format(2 * contact.half_width)
             << EndSeq;
      out_ << EndMap;
    }
    out_ << EndMap;
  }

  // The posture of a workspace at this share of the height of the base over the feet. \param least  of the distance of two feet from
  // their middle, in widths of their soles
  Reference makePosture(const Workspace& ws, double share, double least) const {
    const SE3& base = ws.X_WB[1];
    std::vector<Vector3d> places;
    Vector3d middle = Vector3d::Zero();
    for (const FoundFoot& foot : feet_) {
      places.push_back(getPlacement(ws, foot.body, foot.X_BF).p);
      middle += places.back() / static_cast<double>(feet_.size());
    }
    Reference reference;
    reference.name = "half_sitting";
    reference.height_frame = model_.bodies()[1].name;
    double apart = 0;  // from the middle
    for (size_t i = 0; i < feet_.size() && feet_.size() == 2; ++i)
      apart = std::max({apart, std::abs(places[i].y() - middle.y()), 2 * least * with_feet_->contacts()[i].half_width});
    reference.height = round(share * (base.p.z() - middle.z()));
    for (size_t i = 0; i < feet_.size(); ++i) {
      const Vector3d place = places[i] - middle;
      reference.feet[getContactName(i)] = feet_.size() > 2
                                              ? Vector3d(round(place.x()), round(place.y()), 0)
                                              : Vector3d(0, (i == 0 ? 1 : -1) * (least < 1 ? apart : round(apart)), 0);
    }
    reference.joints[model_.joints()[1].name] = {round(base.p.x() - middle.x()), 0, reference.height, 0, 0, 0, 1};
    return reference;
  }

  // Legs bend within the ranges of their joints, if these say which way.
  void preferRanges(Reference& reference) const {
    for (const Joint& joint : model_.joints())
      if (joint.nv == 1 && std::isfinite(model_.upperLimits()[joint.idx_v] - model_.lowerLimits()[joint.idx_v]))
        reference.joints[joint.name] = {(model_.lowerLimits()[joint.idx_v] + model_.upperLimits()[joint.idx_v]) / 2};
  }

  // Closed, with every joint as near to the middle of its range as loops let it; empty if they do not close.
  VectorXd bendIntoRanges() const {
    Reference middle;
    preferRanges(middle);
    const AssemblyResult result = assemble(model_, makeReferenceProblem(model_, middle));
    return result.status == NumericalStatus::Ok ? result.q : VectorXd();
  }

  // Whether it closes within the ranges of the joints; moves the base so that the centre of mass is over the feet. The base weighs
  // more than other joints that are given; if there are any, all get the values that they have there.
  bool stand(Reference& reference, double joint_weight = kJointWeight) {
    Workspace ws(*with_feet_);
    std::vector<double>& base = reference.joints.at(model_.joints()[1].name);
    double off = 0;
    for (int i = 0; i < kShifts; ++i) {
      AssemblyProblem problem = makeReferenceProblem(*with_feet_, reference);
      problem.weights.tail(model_.nv() - 6) = problem.weights.tail(model_.nv() - 6).cwiseMin(joint_weight);
      const AssemblyResult result = assemble(*with_feet_, problem);
      work_ += result.iterations * std::pow(model_.nv(), 3);
      if (result.status != NumericalStatus::Ok) return false;
      for (const Joint& joint : model_.joints())
        if (joint.nv == 1 && (result.q[joint.idx_q] < model_.lowerLimits()[joint.idx_v] ||
                              result.q[joint.idx_q] > model_.upperLimits()[joint.idx_v]))
          return false;
      updatePositions(*with_feet_, ws, result.q);
      off = calcCom(*with_feet_, ws).x();
      if (std::abs(off) < kOver) {
        posture_ = result.q;
        for (auto& [name, values] : reference.joints) {
          const Joint& joint = model_.joints()[model_.findJoint(name)];
          for (int k = 0; k < joint.nq && reference.joints.size() > 1; ++k)
            values[k] = round(result.q[joint.idx_q + k]);
        }
        return true;
      }
      base[0] = round(base[0] - off);
    }
    return false;
  }

  enum class Bend { None, IntoRanges, Knees };
  static constexpr int kBends = 3;

  void writePosture() {
    if (!model_.references().empty() && writeGivenPosture(model_.references().front())) return;
    const bool may_be_nearer = feet_.size() == 2 && with_feet_->contacts()[0].half_width > 0;
    for (const double least : {1.0, 0.5})  // legs without a roll of the ankle stand where they are alone, to all digits
      for (const Bend bend : {Bend::None, Bend::IntoRanges, Bend::Knees})
        for (double share = kHighest; share > kLowest && (least == 1 || may_be_nearer); share -= kStep) {
          if (work_ > kMostWork * (1 + static_cast<int>(bend)) / kBends) break;  // bends that come later have more left
          Reference r = makePosture(ws_, share, least);
          if (bend == Bend::IntoRanges) preferRanges(r);
          if (bend == Bend::Knees)
            for (const auto& [joint, angle] : bendKnees(model_, ws_, feet_)) r.joints[joint] = {angle};
          if (stand(r, bend == Bend::Knees ? kBentWeight : kJointWeight)) return writePosture(r, share, start_, least);
        }
    guess("Posture: none was found with flat feet and joints within their ranges. Give one under `references`.");
  }

  // From a posture of the robot's file, lowered a little, so that springs bear the weight, and as far as puts the feet flat on the
  // ground.
  bool writeGivenPosture(const Reference& given) {
    const AssemblyResult posture = assembleReference(model_, given.name);
    if (posture.status != NumericalStatus::Ok) return false;
    Workspace ws(model_);
    updatePositions(model_, ws, is_carried_ ? carryHome(posture.q) : posture.q);
    for (double share = 1 - kStep; share > kLowest; share -= kStep) {
      Reference r = makePosture(ws, share, 1);
      for (const Joint& joint : model_.joints())
        if (joint.nv == 1) r.joints[joint.name] = {posture.q[joint.idx_q]};
      if (!stand(r)) continue;
      writePosture(r, share, "the posture '" + given.name + "' of the robot", 1);
      return true;
    }
    return false;
  }

  void writePosture(const Reference& r, double share, const std::string& source, double least) {
    guess("Posture: feet flat below the centre of mass, as far apart as in " + source +
          (feet_.size() > 2 ? ";"
           : least < 1      ? " but at least a sole;"
                            : " but at least two soles;"));
    const std::string more =
        "the base at " + format(100 * share) +
        " % of its height there. Its loops close; angles under `joints` determine how the legs bend.";
    guesses_.back() += " " + more;
    out_ << YAML::Newline << YAML::Comment(more) << Key << "references" << Value << BeginMap;
    out_ << Key << r.name << Value << BeginMap << Key << "joints" << Value << BeginMap;
    for (const auto& [name, values] : r.joints) {
      out_ << Key << name << Value;
      if (values.size() != 1) out_ << Flow << BeginSeq;
      for (double value : values) out_ << format(value);
      if (values.size() != 1) out_ << EndSeq;
    }
    out_ << EndMap << Key << "height" << Value << Flow << BeginMap << Key << "frame" << Value << r.height_frame;
    out_ << Key << "value" << Value << format(r.height) << EndMap << Key << "feet" << Value << BeginMap;
    for (const auto& [name, place] : r.feet)
      out_ << Key << name << Value << Flow << BeginSeq << format(place.x()) << formatExact(place.y()) << "0" << EndSeq;
    out_ << EndMap << EndMap << EndMap;
  }

  // In the air joints move the least mass, and friction near rest is stiffest.
  void writeFriction() {
    constexpr double kStage = 0.015;  // of a squat, the longest of all motions, s
    const VectorXd& q = posture_.size() > 0 ? posture_ : q_;
    const std::vector<JointForce> raised = calcSmoothFriction(model_, makeConstraintSet(model_), q, kStage).raised;
    if (raised.empty()) return;
    guess(
        "Friction: below its friction_speed it acts like a damper, which steps of motions have to follow. The speeds "
        "suit steps of 15 ms.");
    out_ << Key << "joint_forces" << Value << BeginMap;
    for (const JointForce& force : raised) {
      out_ << Key << model_.joints()[force.joint].name << Value << Flow << BeginMap;
      for (const auto& [key, value] : getJointForceData({force, force.friction})) out_ << Key << key << Value << value;
      out_ << EndMap;
    }
    out_ << EndMap;
  }

  void writeSerialJoints() {
    std::vector<std::string> all;
    for (const FoundFoot& foot : feet_) {
      std::vector<std::string> joints;
      bool is_simple = true;
      for (int i = foot.body; i > 1; i = model_.joints()[i].parent) {
        is_simple &= model_.joints()[i].nv == 1;
        joints.insert(joints.begin(), model_.joints()[i].name);
      }
      if (!is_simple || joints.size() != 6)
        return guess("Serial joints: none guessed, because " + std::to_string(joints.size()) +
                     " joints lead from the base to a foot, not six.");
      all.insert(all.end(), joints.begin(), joints.end());
    }
    guess("Serial joints: all from the base to the feet.");
    out_ << Key << "serial_joints" << Value << all;
    serial_joints_ = all;
  }

  void tellDeadPoints() {
    ModelParts parts = takeParts(*with_feet_);
    parts.motors = motors_;
    parts.serial_joints.clear();
    for (const std::string& name : serial_joints_) parts.serial_joints.push_back(model_.findJoint(name));
    const std::vector<std::string> lines = describeDeadPoints(ModelBuilder::restore(std::move(parts)), q_, posture_);
    if (lines.empty()) return;
    guess("Dead points, where motor and joint do not move each other, as seen from the posture:");
    for (const std::string& line : lines) {
      guesses_.push_back("  " + line);
      out_ << YAML::Newline << YAML::Comment(line);
    }
  }

  const Model& model_;
  const std::string file_, robot_file_, path_;  // of the robot: as messages name it, absolute, and from the new file
  const std::string start_;                     // what q_ is
  VectorXd q_;                                  // closed
  VectorXd posture_;                            // in which it stands; empty if there is none
  std::vector<std::string> serial_joints_;
  Workspace ws_;
  std::vector<FoundFoot> feet_;
  std::vector<Motor> motors_;
  bool has_made_frames_ = false, are_turned_ = false, are_ends_ = false, is_carried_ = false;
  double work_ = 0;  // on postures
  std::optional<Model> with_feet_;
  YAML::Emitter out_;
  std::vector<std::string> guesses_;
};

}  // namespace

// Legs that cannot be as they are in the neutral configuration have their feet elsewhere: those are tried where no posture was found.
Adoption adoptRobot(const LoadedRobot& robot, const std::string& model) {
  Adopter neutral(robot, model, false);
  Adoption adoption = neutral.write();
  if (neutral.hasPosture()) return adoption;
  try {
    Adopter bent(robot, model, true);
    Adoption other = bent.write();
    if (bent.hasPosture()) return other;
  } catch (const InputError&) {  // without feet there
  }
  return adoption;
}

}  // namespace bielle
