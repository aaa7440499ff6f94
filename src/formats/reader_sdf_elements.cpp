// What libsdformat does not say of an SDF file: elements that are not read, those of later versions, absent inertia.
#include <algorithm>
#include <cstdio>

#include "bielle/model/error.h"
#include "formats/reader_sdf.h"
#include "model/number_text.h"

namespace bielle {

// What is not read, by its line.
void SdfReader::noteElements(const XMLElement& element) {
  static const std::map<std::string, std::set<std::string>> read = {
      {"model", {"link", "joint", "frame", "pose", "static", "include"}},
      {"link", {"pose", "inertial", "visual", "collision"}},
      {"inertial", {"pose", "mass", "inertia"}},
      {"joint", {"parent", "child", "pose", "axis", "axis2", "drake:parent_frame", "drake:child_frame", "drake:mimic"}},
      {"axis", {"xyz", "limit", "dynamics", "mimic", "use_parent_model_frame"}},
      {"axis2", {"xyz", "limit", "dynamics", "use_parent_model_frame"}},
      {"limit", {"lower", "upper", "effort", "velocity"}},
      {"dynamics", {"damping", "friction", "spring_reference", "spring_stiffness"}}};
  static const std::set<std::string> harmless = {
      "sensor",    "light",        "battery",     "audio_source",       "audio_sink", "particle_emitter",
      "projector", "self_collide", "enable_wind", "allow_auto_disable", "physics"};
  const std::string& tag = getTag(element);
  for (const XMLElement* e : getChildren(element)) {
    const std::string& own = getTag(*e);
    if (own.rfind("drake:", 0) == 0 && tag == "model") continue;  // reader_sdf_drake.cpp
    if (harmless.count(own))
      notes_.addHarmless(path_, "<" + tag + "> <" + own + ">", e->GetLineNum());
    else if (own == "density" && element.BoolAttribute("auto"))  // of <inertial>
      continue;
    else if (own == "plugin" && e->FirstChildElement("joint") && e->FirstChildElement("mimicJoint"))  // is read
      continue;
    else if (!read.at(tag).count(own))
      notes_.add(path_, "<" + tag + "> <" + own + ">", e->GetLineNum(), "left out");
    else if (read.count(own))
      noteElements(*e);
  }
}

// libsdformat reads files of later versions without an error, and leaves out what it does not know.
void SdfReader::checkVersion(const XMLElement& root) {
  const std::string version = getAttribute(&root, "version");
  if (version.empty())
    fail("<sdf> (line " + std::to_string(root.GetLineNum()) + ")", "it has no version",
         "give the one that it was written for, e.g. version=\"" SDF_PROTOCOL_VERSION "\"");
  const auto parse = [](const std::string& text) {
    int major = 0, minor = 0;
    std::sscanf(text.c_str(), "%d.%d", &major, &minor);
    return std::pair(major, minor);
  };
  if (parse(version) > parse(SDF_PROTOCOL_VERSION))
    tree_.warnings.push_back(path_ + ": version " + version + " is later than " + SDF_PROTOCOL_VERSION +
                             ", the last one that libsdformat " SDF_MAJOR_VERSION_STR
                             " reads: elements that came after it have "
                             "no effect, but for <mimic> and <inertial auto>");
}

// What the specification puts where a file says nothing of a link's inertia, which is hardly ever meant.
void SdfReader::checkInertia(const XMLElement& link) {
  const std::string name = "link '" + getAttribute(&link, "name") + "'";
  const XMLElement* inertial = link.FirstChildElement("inertial");
  if (inertial && inertial->BoolAttribute("auto")) return computeInertia(link, *inertial);
  std::string missing;
  if (!inertial)
    missing = "it has no <inertial>: its mass is 1 kg and its moments of inertia are 1 kg m²";
  else if (!inertial->FirstChildElement("mass"))
    missing = "its <inertial> has no <mass>: it is 1 kg";
  else if (!inertial->FirstChildElement("inertia"))
    missing = "its <inertial> has no <inertia>: its moments are 1 kg m²";
  if (!missing.empty())
    tree_.warnings.push_back(path_ + ": " + name + " (line " + std::to_string(link.GetLineNum()) + "): " + missing +
                             ", by the specification of SDF");
}

// q = multiplier (q of the other joint - reference) + offset, of SDF 1.11; of Drake, with attributes.
void SdfReader::readMimic(const XMLElement& joint) {
  const XMLElement* axis = joint.FirstChildElement("axis");
  const XMLElement* mimic = axis ? axis->FirstChildElement("mimic") : nullptr;
  if (!mimic) mimic = joint.FirstChildElement("drake:mimic");
  if (!mimic) return;
  const std::string name = getAttribute(&joint, "name"), other = getAttribute(mimic, "joint");
  const std::string element = "joint '" + name + "': <mimic> (line " + std::to_string(mimic->GetLineNum()) + ")";
  const auto find = [this](const std::string& sought) {
    return std::find_if(tree_.joints.begin(), tree_.joints.end(),
                        [&sought](const UrdfJoint& candidate) { return candidate.joint.name == sought; });
  };
  const auto follower = find(name), leader = find(other);
  const auto is_single = [this](auto found) { return found != tree_.joints.end() && getNv(found->joint.kind) == 1; };
  if (!is_single(leader)) fail(element, "'" + other + "' is no joint with one coordinate", "name one");
  if (!is_single(follower)) fail(element, "this joint closes a loop or has not one coordinate", "remove it");
  const auto get = [&](const char* tag, double usual) {
    const XMLElement* e = mimic->FirstChildElement(tag);
    const char* text = e ? e->GetText() : mimic->Attribute(tag);
    if (!e && !text) return usual;
    std::vector<double> numbers;
    if (!parseNumbers(text ? text : "", numbers) || numbers.size() != 1)
      fail(element, std::string("<") + tag + "> is not a finite number", "correct it");
    return numbers[0];
  };
  follower->mimicked = other;
  follower->multiplier = get("multiplier", 1);
  follower->offset = get("offset", 0) - follower->multiplier * get("reference", 0);
}
}  // namespace bielle
