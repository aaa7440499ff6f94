#include "formats/mjcf_element.h"

#include <cmath>

#include "bielle/model/error.h"
#include "formats/robot_files.h"
#include "math/direction.h"
#include "math/so3.h"
#include "model/number_text.h"

namespace bielle {
namespace {

const std::string kLeftOut = "left out";  // the usual problem of what changes no mechanism

constexpr size_t kMostAttributes = 200, kMostDefaults = 100000;  // per element; copied from class to class

bool isOfContactsOrSolver(const std::string& attribute) {
  static const std::set<std::string> names = {"condim",
                                              "friction",
                                              "margin",
                                              "gap",
                                              "priority",
                                              "solmix",
                                              "solref",
                                              "solimp",
                                              "solreflimit",
                                              "solimplimit",
                                              "solreffriction",
                                              "solimpfriction",
                                              "fluidshape",
                                              "fluidcoef",
                                              "rgba",
                                              "material",
                                              "timestep",
                                              "integrator",
                                              "cone",
                                              "impratio",
                                              "jacobian",
                                              "solver",
                                              "iterations",
                                              "tolerance",
                                              "ls_iterations",
                                              "ls_tolerance",
                                              "noslip_iterations",
                                              "noslip_tolerance",
                                              "ccd_iterations",
                                              "ccd_tolerance",
                                              "mpr_iterations",
                                              "mpr_tolerance",
                                              "sdf_iterations",
                                              "sdf_initpoints",
                                              "apirate"};
  return names.count(attribute) > 0;
}

// Actuators of all kinds share their defaults.
std::string getDefaultTag(const std::string& tag) {
  static const std::set<std::string> actuators = {"general", "motor",    "position", "velocity", "intvelocity",
                                                  "damper",  "cylinder", "muscle",   "adhesion"};
  return actuators.count(tag) ? "general" : tag;
}

void merge(const XMLElement& element, const std::string& path, MjcfAttributes& attributes) {
  for (const tinyxml2::XMLAttribute* a = element.FirstAttribute(); a; a = a->Next())
    attributes[a->Name()] = {a->Value(), path, element.GetLineNum()};
  if (attributes.size() > kMostAttributes)
    throw InputError(path, describe(element), "it has more than " + std::to_string(kMostAttributes) + " attributes",
                     "remove the unused ones");
}

}  // namespace

void MjcfNotes::add(const std::string& path, const std::string& element, int line, const std::string& problem) {
  const Kind kind = {path, element, problem};
  if (!lines_.count(kind)) order_.push_back(kind);
  lines_[kind].insert(line);
}

void MjcfNotes::addAttribute(const std::string& path, const std::string& element, int line,
                             const std::string& attribute) {
  auto& [names, lines] = attributes_[{path, element}];
  names.insert(attribute);
  lines.insert(line);
}

void MjcfNotes::addHarmless(const std::string& path, const std::string& element, int line, const std::string& problem) {
  add(path, element, line, problem);
  harmless_.insert({path, element, problem});
}

void MjcfNotes::addTo(UrdfFile& tree) const {
  std::map<std::string, std::string> left_out;
  for (const Kind& kind : order_) {
    const std::string elements = kind.element + formatLines(lines_.at(kind));
    if (harmless_.count(kind)) {
      tree.harmless.push_back(kind.path + ": " + elements + (kind.problem == kLeftOut ? "" : ": " + kind.problem));
    } else if (kind.problem != kLeftOut) {
      tree.warnings.push_back(kind.path + ": " + elements + ": " + kind.problem);
    } else {
      std::string& list = left_out[kind.path];
      list += (list.empty() ? "" : ", ") + elements;
    }
  }
  for (const auto& [place, found] : attributes_) {
    std::string names, harmless;
    for (const std::string& name : found.first) {
      std::string& list = isOfContactsOrSolver(name) ? harmless : names;
      list += (list.empty() ? "'" : ", '") + name + "'";
    }
    const std::string element = place.first + ": " + place.second + formatLines(found.second) + ": ";
    if (!names.empty()) tree.warnings.push_back(element + "left out: " + names);
    if (!harmless.empty()) tree.harmless.push_back(element + harmless);
  }
  for (const auto& [path, elements] : left_out) tree.warnings.push_back(path + ": " + elements + ": " + kLeftOut);
}

void readMjcfDefaults(const XMLElement& element, const std::string& parent, MjcfSettings& settings) {
  const std::string& path = settings.files.getPath(element);
  const char* text = element.Attribute("class");
  const std::string name = text ? text : parent.empty() ? "main" : "";
  if (name.empty()) throw InputError(path, describe(element), "it has no class", "name it");
  if (!settings.defaults.count(name))
    settings.defaults[name] = parent.empty() ? std::map<std::string, MjcfAttributes>() : settings.defaults.at(parent);
  auto& defaults = settings.defaults[name];
  for (const auto& [tag, attributes] : defaults) settings.num_defaults += 1 + attributes.size();
  if (settings.num_defaults > kMostDefaults)
    throw InputError(path, describe(element), "there are more defaults than any robot needs", "remove classes");
  for (const XMLElement* e : settings.files.getChildren(element))
    if (getTag(*e) != "default") merge(*e, settings.files.getPath(*e), defaults[getDefaultTag(getTag(*e))]);
  for (const XMLElement* e : settings.files.getChildren(element, "default")) readMjcfDefaults(*e, name, settings);
}

MjcfElement::MjcfElement(const XMLElement& element, const std::string& childclass, MjcfSettings& settings)
    : MjcfElement(element, childclass, settings, getDefaultTag(getTag(element))) {}

MjcfElement::MjcfElement(const XMLElement& element, const std::string& childclass, MjcfSettings& settings,
                         const std::string& kind)
    : settings_(settings), path_(settings.files.getPath(element)), tag_(getTag(element)), line_(element.GetLineNum()) {
  if (const char* name = element.Attribute("name")) name_ = " '" + std::string(name) + "'";
  const XMLElement* parent = element.Parent() ? element.Parent()->ToElement() : nullptr;
  if (const char* body = parent && getTag(*parent) == "body" ? parent->Attribute("name") : nullptr;
      body && name_.empty())
    name_ = " of body '" + std::string(body) + "'";
  const char* text = element.Attribute("class");
  const std::string own = text ? text : childclass.empty() ? "main" : childclass;
  const auto defaults = settings.defaults.find(own);
  if (defaults == settings.defaults.end()) {
    if (own != "main") fail("there is no default class '" + own + "'", "correct the name");
  } else if (const auto it = defaults->second.find(kind); it != defaults->second.end()) {
    attributes_ = it->second;
  }
  merge(element, path_, attributes_);
  asked_ = {"name", "class", "user", "group"};  // they say nothing of the mechanism
}

MjcfElement::~MjcfElement() {
  for (const auto& [name, attribute] : attributes_)
    if (!asked_.count(name)) settings_.notes.addAttribute(attribute.path, "<" + tag_ + ">", attribute.line, name);
}

std::string MjcfElement::describe() const { return tag_ + name_ + " (line " + std::to_string(line_) + ")"; }

void MjcfElement::fail(const std::string& problem, const std::string& remedy) const {
  throw InputError(path_, describe(), problem, remedy);
}

void MjcfElement::noteHarmless(const std::string& problem) const {
  settings_.notes.addHarmless(path_, "<" + tag_ + ">", line_, problem);
}

void MjcfElement::note(const std::string& problem) const {
  if (problem == kLeftOut)
    settings_.notes.addHarmless(path_, "<" + tag_ + ">", line_);
  else
    settings_.notes.add(path_, "<" + tag_ + ">", line_, problem);
}

void MjcfElement::leaveOut(const std::string& problem) {
  note(problem);
  for (const auto& [name, attribute] : attributes_) asked_.insert(name);
}

const std::string* MjcfElement::find(const std::string& attribute) {
  asked_.insert(attribute);
  const auto it = attributes_.find(attribute);
  return it == attributes_.end() ? nullptr : &it->second.value;
}

std::string MjcfElement::getText(const std::string& attribute, const std::string& otherwise) {
  const std::string* text = find(attribute);
  return text ? *text : otherwise;
}

bool MjcfElement::getFlag(const std::string& attribute, bool otherwise) {
  const std::string* text = find(attribute);
  if (!text) return otherwise;
  if (*text != "true" && *text != "false")
    fail("its attribute '" + attribute + "' is '" + *text + "'", "use true or false");
  return *text == "true";
}

double MjcfElement::getNumber(const std::string& attribute, double otherwise) {
  const std::vector<double> numbers = getNumbers(attribute, 1, 1);
  return numbers.empty() ? otherwise : numbers[0];
}

std::vector<double> MjcfElement::getNumbers(const std::string& attribute, size_t least, size_t most) {
  std::vector<double> numbers;
  const std::string* text = find(attribute);
  if (!text) return numbers;
  // MuJoCo refuses commas, programs that write them do not.
  std::string spaced = *text;
  for (size_t at = 0; (at = spaced.find(", ", at)) != std::string::npos;) spaced[at] = ' ';
  if (spaced != *text) note("the commas between the numbers of its '" + attribute + "' are read as spaces");
  if (!parseNumbers(spaced, numbers) || numbers.size() < least || numbers.size() > most)
    fail("its attribute '" + attribute + "' is not made of " + std::to_string(least) +
             (most > least ? " to " + std::to_string(most) : "") + " finite number(s): " + *text,
         "correct it");
  return numbers;
}

Vector3d MjcfElement::getVector(const std::string& attribute, const Vector3d& otherwise) {
  const std::vector<double> v = getNumbers(attribute, 3, 3);
  return v.empty() ? otherwise : Vector3d(v[0], v[1], v[2]);
}

Matrix3d MjcfElement::getRotation() {
  const std::vector<double> quat = getNumbers("quat", 4, 4), turn = getNumbers("axisangle", 4, 4),
                            axes = getNumbers("xyaxes", 6, 6), z = getNumbers("zaxis", 3, 3),
                            euler = getNumbers("euler", 3, 3);
  if (!quat.empty() + !turn.empty() + !axes.empty() + !z.empty() + !euler.empty() > 1)
    fail("it has several orientations", "keep one of quat, axisangle, xyaxes, zaxis and euler");
  const auto normalize = [this](const Vector3d& v) -> Vector3d {
    const double norm = v.stableNorm();
    if (!(norm > 1e-12) || !std::isfinite(norm)) fail("its orientation has an axis without a direction", "correct it");
    return v / norm;
  };
  if (!quat.empty()) {
    const Eigen::Vector4d q(quat[1], quat[2], quat[3], quat[0]);
    const double norm = q.stableNorm();
    if (!(norm > 1e-12) || !std::isfinite(norm)) fail("its quat has zero length", "give a unit quaternion w x y z");
    return Eigen::Quaterniond(q / norm).toRotationMatrix();
  }
  if (!turn.empty()) return makeAxisRotation(normalize({turn[0], turn[1], turn[2]}), getAngle(turn[3]));
  if (!z.empty()) return calcRotationOfZ(normalize({z[0], z[1], z[2]}));
  Matrix3d R = Matrix3d::Identity();
  if (!axes.empty()) {
    R.col(0) = normalize({axes[0], axes[1], axes[2]});
    const Vector3d y = normalize({axes[3], axes[4], axes[5]});
    R.col(1) = normalize(y - R.col(0) * R.col(0).dot(y));
    R.col(2) = R.col(0).cross(R.col(1));
  }
  for (size_t i = 0; i < euler.size(); ++i) {
    const bool turns_with_body = std::islower(static_cast<unsigned char>(settings_.euler[i]));
    const Vector3d axis = Vector3d::Unit(std::tolower(settings_.euler[i]) - 'x');
    const Matrix3d step = makeAxisRotation(axis, getAngle(euler[i]));
    R = turns_with_body ? R * step : step * R;
  }
  return R;
}

SE3 MjcfElement::getPose() { return {getRotation(), getVector("pos", Vector3d::Zero())}; }

bool MjcfElement::isLimited(const std::string& limited, const std::string& range) {
  const std::string said = getText(limited, "auto");
  const bool has_range = find(range) != nullptr;
  if (said == "auto") {
    if (has_range && !settings_.auto_limits) note("its " + range + " is left out: " + limited + " is not set");
    return has_range && settings_.auto_limits;
  }
  if (said != "true" && said != "false") fail("its '" + limited + "' is '" + said + "'", "use true, false or auto");
  if (said == "true" && !has_range) fail("it is limited but has no " + range, "give one");
  return said == "true";
}

}  // namespace bielle
