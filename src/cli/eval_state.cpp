#include "cli/eval_state.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kept_motion.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "formats/text_file.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "results/json_text.h"

namespace bielle::cli {

const char* const kStateHelp =
    "The state is a JSON object. Defaults: neutral position, zero velocity, zero torque, no contact:\n"
    "  {\"joints\": {\"knee_right\": {\"q\": 0.5, \"v\": 0.1}, \"root_joint\": {\"q\": [0, 0, 0.6, 0, 0, 0, 1]}},\n"
    "   \"torques\": {\"motor_knee_right\": 3.5}, \"contacts\": [\"foot_left\", \"foot_right\"]}\n"
    "Order of the numbers of a joint (SI, rad; quaternions are normalised; one number needs no brackets):\n"
    "  joint       q                                      v\n"
    "  revolute    angle                                  its rate\n"
    "  continuous  angle, or [cos, sin]                   its rate\n"
    "  prismatic   length                                 its rate\n"
    "  spherical   quaternion x y z w                     angular velocity in the child frame\n"
    "  universal   angle about axis 1, about axis 2       their rates\n"
    "  planar      x, y, angle, or [x, y, cos, sin]       v_x, v_y, rate in the child frame\n"
    "  free-flyer  position, quaternion x y z w           linear, then angular velocity in the child frame\n";

namespace {

using nlohmann::json;

constexpr double kFollows = 1e-6;         // weight of joints that are not given, relative to those that are
constexpr double kToldDifference = 1e-6;  // rad or m, and per s relative above 1: differences from what is given
constexpr int kDeepest = 20;              // elements of a state are not nested deeper; reading them recurses

class StateReader {
 public:
  StateReader(const Model& model, const std::string& file, ConstVectorRef q) : model_(model), file_(file) {
    state_.q = q;
    state_.v.setZero(model.nv());
    state_.u.setZero(model.nu());
  }

  EvalState read(const std::string& text) {
    const json state = parse(text);
    checkKeys(state, "state", {"joints", "torques", "contacts"});
    const json joints = getObject(state, "joints"), torques = getObject(state, "torques");
    for (const auto& [name, joint] : joints.items()) readJoint(name, joint);
    for (const auto& [name, torque] : torques.items()) readTorque(name, torque);
    if (state.contains("contacts")) readContacts(state["contacts"]);
    return state_;
  }

 private:
  [[noreturn]] void fail(const std::string& element, const std::string& problem, const std::string& remedy) const {
    throw InputError(file_, element, problem, remedy);
  }

  // A key given twice would silently hide the first one.
  json parse(const std::string& text) const {
    std::vector<std::set<std::string>> keys;
    const auto check = [&](int depth, json::parse_event_t event, json& parsed) {
      if (depth > kDeepest)
        fail("document", "it is nested too deeply", "write {\"joints\": {...}, \"torques\": {...}}");
      if (event == json::parse_event_t::object_start) keys.emplace_back();
      if (event == json::parse_event_t::object_end) keys.pop_back();
      if (event == json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
        fail("key '" + parsed.get<std::string>() + "'", "it is given twice", "keep one of them");
      return true;
    };
    try {
      return json::parse(text, check);
    } catch (const json::exception& error) {
      fail("JSON", describeJsonError(error), "see bielle eval --help for an example");
    }
  }

  void checkKeys(const json& object, const std::string& element, const std::vector<std::string>& known) const {
    if (!object.is_object()) fail(element, "it is not an object", "write {...}");
    for (const auto& item : object.items())
      if (std::find(known.begin(), known.end(), item.key()) == known.end())
        fail(element, "there is no key '" + item.key() + "'", "the keys are: " + listItems(known));
  }

  json getObject(const json& state, const char* key) const {
    if (!state.contains(key)) return json::object();
    if (!state[key].is_object()) fail(std::string("key '") + key + "'", "it is not an object", "write {...} by name");
    return state[key];
  }

  VectorXd readNumbers(const json& value, const std::string& element) const {
    const json list = value.is_array() ? value : json::array({value});
    VectorXd numbers(list.size());
    for (size_t i = 0; i < list.size(); ++i) {
      if (!list[i].is_number()) fail(element, list[i].dump() + " is not a number", "give numbers");
      numbers[i] = list[i].get<double>();
      if (!std::isfinite(numbers[i])) fail(element, "a number is not finite", "give finite numbers");
    }
    return numbers;
  }

  // q of a joint, also from alternative coordinates.
  VectorXd convertPosition(const Joint& joint, const VectorXd& given, const std::string& element) const {
    const bool cos_sin = (joint.kind == JointKind::Continuous && given.size() == 2) ||
                         (joint.kind == JointKind::Planar && given.size() == 4);
    VectorXd q = given;
    if (cos_sin) {
      const auto direction = given.tail<2>();
      if (direction.norm() < 1e-9) fail(element, "cos and sin are both zero", "give the cosine and sine of an angle");
      q.conservativeResize(given.size() - 1);
      q.tail<1>()[0] = std::atan2(direction[1], direction[0]);
    }
    if (q.size() != joint.nq)
      fail(element, std::to_string(given.size()) + " numbers for a " + getName(joint.kind) + " joint",
           "give " + std::to_string(joint.nq));
    if (joint.kind == JointKind::Spherical || joint.kind == JointKind::FreeFlyer) {
      const double norm = q.tail<4>().norm();
      if (norm < 1e-9) fail(element, "its quaternion is zero", "give x y z w, e.g. 0 0 0 1");
      q.tail<4>() /= norm;
    }
    return q;
  }

  void readJoint(const std::string& name, const json& value) {
    const std::string element = "joint '" + name + "'";
    const int index = model_.findJoint(name);
    if (index <= 0) fail(element, "the robot has no such joint", "its joints are: " + listItems(listJoints()));
    checkKeys(value, element, {"q", "v"});
    const Joint& joint = model_.joints()[index];
    if (value.contains("q")) {
      state_.q.segment(joint.idx_q, joint.nq) =
          convertPosition(joint, readNumbers(value["q"], element + ": q"), element + ": q");
      state_.placed.push_back(index);
    }
    if (!value.contains("v")) return;
    const VectorXd v = readNumbers(value["v"], element + ": v");
    if (v.size() != joint.nv)
      fail(element + ": v", std::to_string(v.size()) + " numbers for a " + getName(joint.kind) + " joint",
           "give " + std::to_string(joint.nv));
    state_.v.segment(joint.idx_v, joint.nv) = v;
    state_.moving.push_back(index);
  }

  std::vector<std::string> listJoints() const {
    std::vector<std::string> names = getNames(model_.joints());
    names.erase(names.begin());  // the world's placeholder
    return names;
  }

  void readTorque(const std::string& name, const json& value) {
    const std::string element = "torque '" + name + "'";
    const int motor = model_.findMotor(name);
    if (motor < 0)
      fail(element, model_.findJoint(name) > 0 ? "this joint has no motor" : "the robot has no such joint",
           "the motors are: " + listItems(getNames(model_.motors())));
    const VectorXd torque = readNumbers(value, element);
    if (torque.size() != 1) fail(element, std::to_string(torque.size()) + " numbers", "give one, in N m or N");
    state_.u[motor] = torque[0];
  }

  void readContacts(const json& list) {
    if (!list.is_array()) fail("key 'contacts'", "it is not a list", "write [\"name\", ...]");
    for (const json& item : list) {
      const std::string name = item.is_string() ? item.get<std::string>() : item.dump();
      const int contact = model_.findContact(name);
      if (contact < 0)
        fail("contact '" + name + "'", "the robot has no such contact",
             "its contacts are: " + listItems(getNames(model_.contacts())));
      if (std::count(state_.contacts.begin(), state_.contacts.end(), contact))
        fail("contact '" + name + "'", "it is listed twice", "keep one of them");
      state_.contacts.push_back(contact);
    }
  }

  const Model& model_;
  std::string file_;
  EvalState state_;
};

}  // namespace

EvalState readState(const Model& model, const std::string& path, ConstVectorRef q) {
  if (path == "-") {
    const std::string text{std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>()};
    return StateReader(model, "standard input", q).read(text);
  }
  return StateReader(model, path, q).read(readTextFile(path));
}

void warnOfMisfit(const std::string& file, const Joint& joint, const std::string& what, double given, double taken) {
  std::cerr << "bielle: warning: " << file << ": joint '" << joint.name << "': its " << what << " "
            << formatNumber(given) << " does not fit to the loops; it starts with " << formatNumber(taken) << "\n";
}

void closeState(const Model& model, const std::string& file, EvalState& state) {
  if (model.closures().empty()) return;
  AssemblyProblem problem;
  problem.q_ref = state.q;
  problem.weights = VectorXd::Constant(model.nv(), state.placed.empty() ? 1 : kFollows);
  for (int j : state.placed) {
    const Joint& joint = model.joints()[j];
    problem.weights.segment(joint.idx_v, joint.nv).setOnes();
  }
  const AssemblyResult closed = assemble(model, problem);
  if (closed.status != NumericalStatus::Ok)
    throw InputError(file, closed.worst, "its loop does not close near these positions: " + closed.message,
                     "give other joints, or fewer: those that are not given follow");
  const VectorXd moved = model.difference(state.q, closed.q);
  for (int j : state.placed) {
    const Joint& joint = model.joints()[j];
    if (moved.segment(joint.idx_v, joint.nv).cwiseAbs().maxCoeff() > kToldDifference)
      warnOfMisfit(file, joint, "position", state.q[joint.idx_q], closed.q[joint.idx_q]);
  }
  state.q = closed.q;
}

void closeMotion(const Model& model, const std::string& file, EvalState& state) {
  if (model.closures().empty() || state.moving.empty()) return;
  Workspace ws(model);
  const ConstraintSet loops = makeConstraintSet(model);
  updatePositions(model, ws, state.q);
  std::vector<int> held;
  for (int j : state.moving)
    for (int k = 0; k < model.joints()[j].nv; ++k) held.push_back(model.joints()[j].idx_v + k);
  VectorXd values(held.size());
  for (size_t k = 0; k < held.size(); ++k) values[k] = state.v[held[k]];
  const VectorXd wanted = Closing(model, ws, loops, held).solve(VectorXd::Zero(loops.rows), values);
  const VectorXd given = state.v;
  state.v = projectVelocity(model, ws, loops, state.q, wanted);
  for (int j : state.moving) {
    const Joint& joint = model.joints()[j];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k)
      if (std::abs(state.v[k] - given[k]) > kToldDifference * (1 + std::abs(given[k])))
        warnOfMisfit(file, joint, "velocity", given[k], state.v[k]);
  }
}

}  // namespace bielle::cli
