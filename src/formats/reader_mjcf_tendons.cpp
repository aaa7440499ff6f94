// Fixed tendons: sums of coordinates that equalities, limits and motors act on.
#include <algorithm>
#include <cmath>

#include "formats/mjcf.h"
#include "formats/reader_mjcf.h"
#include "model/number_text.h"

namespace bielle {

// Adds the length of a tendon, less that of the file as it stands, to what a coupler keeps.
void MjcfReader::addTendonLength(FixedTendon& tendon, double factor, ClosureSpec& coupler, const MjcfElement& e) {
  tendon.is_used = true;
  for (const auto& [joint, coefficient] : tendon.coefficients) {
    coupler.coefficients[joint] += factor * coefficient;
    coupler.offset += factor * coefficient * findSlot(e, joint).q_ref[0];
  }
}

std::string MjcfReader::nameCoupler(const std::string& made) const {
  return makeUnusedName(made, [this](const std::string& name) {
    return std::any_of(ties_.begin(), ties_.end(), [&](const Tie& tie) { return tie.name == name; });
  });
}

// The link that carries all these joints.
std::string MjcfReader::findCarrier(const std::map<std::string, double>& joints) const {
  const auto listAbove = [this](const std::string& joint) {
    std::vector<std::string> links;
    const auto driven = std::find_if(tree_.joints.begin(), tree_.joints.end(),
                                     [&](const UrdfJoint& j) { return j.joint.name == joint; });
    for (auto at = driven; at != tree_.joints.end();
         at = std::find_if(tree_.joints.begin(), tree_.joints.end(),
                           [&](const UrdfJoint& j) { return j.child == links.back(); }))
      links.push_back(at->parent);
    return links;
  };
  std::vector<std::string> common = listAbove(joints.begin()->first);
  for (const auto& [joint, coefficient] : joints) {
    const std::vector<std::string> above = listAbove(joint);
    common.erase(std::remove_if(common.begin(), common.end(),
                                [&](const std::string& link) {
                                  return std::find(above.begin(), above.end(), link) == above.end();
                                }),
                 common.end());
  }
  return common.front();
}

// The length of a tendon as a coordinate of its own, with the range, springs and dampers of the tendon: then a motor of the force f
// loads joint j with coef_j f, as in MuJoCo.
void MjcfReader::addRotor(FixedTendon& tendon, const std::string& name, MjcfElement& motor) {
  MjcfElement e(*tendon.element, "", settings_, "tendon");
  tendon.rotor =
      makeUnusedName(name, [this](const std::string& made) { return joint_names_.count(made) || taken_.count(made); });
  joint_names_.insert(tendon.rotor);
  taken_.insert(tendon.rotor);
  const auto& coefficients = tendon.coefficients;
  const bool slides = std::all_of(coefficients.begin(), coefficients.end(), [&](const auto& term) {
    return findSlot(e, term.first).kind == JointKind::Prismatic;
  });
  UrdfJoint& joint = addLink(tendon.rotor, findCarrier(coefficients),
                             slides ? JointKind::Prismatic : JointKind::Continuous, tendon.rotor, {});
  tree_.links[tendon.rotor] = makeRotor(tendon.rotor);
  if (e.isLimited("limited", "range")) {
    const std::vector<double> range = e.getNumbers("range", 2, 2);
    if (!slides) joint.joint.kind = JointKind::Revolute;
    joint.lower = VectorXd::Constant(1, range[0]), joint.upper = VectorXd::Constant(1, range[1]);
  }
  JointForce force;
  force.stiffness = e.getNumber("stiffness", 0);
  force.damping = e.getNumber("damping", 0);
  force.friction = e.getNumber("frictionloss", 0);
  const std::vector<double> lengths = e.getNumbers("springlength", 1, 2);
  for (const auto& [coupled, coefficient] : coefficients)
    force.rest +=
        coefficient * findSlot(e, coupled).q_ref[0];  // without a length, or with -1, as long as the file stands
  if (!lengths.empty() && lengths[0] >= 0) force.rest = lengths[0];
  if (lengths.size() == 2 && lengths[1] != lengths[0]) {
    e.note("its spring is slack between two lengths; the spring is left out");
    force.stiffness = 0;
  }
  if (force.stiffness == 0) force.rest = 0;
  if (force.stiffness != 0 || force.damping != 0 || force.friction != 0)
    yaml_.joint_forces.push_back({tendon.rotor, force});
  for (const char* without_meaning : {"width", "material", "rgba", "group", "user"}) e.find(without_meaning);

  ClosureSpec coupler;
  coupler.coefficients[tendon.rotor] = 1;
  for (const auto& [coupled, coefficient] : coefficients) coupler.coefficients[coupled] = -coefficient;
  addCoupler(nameCoupler(name), coupler, e);
  tendon.is_used = true;
  motor.note("its tendon '" + tendon.rotor + "' is a coordinate without inertia, coupled with its joints");
}

// A tendon with a narrow range and nothing else is a coupler with play.
void MjcfReader::readTendonRanges() {
  for (auto& [name, tendon] : tendons_) {
    if (!tendon.rotor.empty()) continue;
    MjcfElement e(*tendon.element, "", settings_, "tendon");
    for (const char* without_meaning : {"width", "material", "rgba", "group", "user"}) e.find(without_meaning);
    if (tendon.is_used) continue;  // by an equality; what else it has is noted
    if (tendon.coefficients.size() < 2 || !e.isLimited("limited", "range")) {
      e.leaveOut("the tendon is left out");
      continue;
    }
    const std::vector<double> range = e.getNumbers("range", 2, 2);
    const double play = (range[1] - range[0]) / 2, middle = (range[0] + range[1]) / 2;
    const auto slides = [&](const auto& term) { return findSlot(e, term.first).kind == JointKind::Prismatic; };
    const bool has_slide = std::any_of(tendon.coefficients.begin(), tendon.coefficients.end(), slides);
    if (!(play >= 0 && play <= (has_slide ? kMostSlidePlay : kMostPlay))) {
      e.leaveOut("the tendon is left out: its range is too wide for a coupler with play");
      continue;
    }
    ClosureSpec coupler;
    coupler.offset = middle;
    coupler.coefficients = tendon.coefficients;
    addCoupler(nameCoupler(name), coupler, e);
    e.note("it is read as a coupler that keeps its length of " + formatNumber(middle) + "; its play of " +
           formatNumber(play) + " to either side is left out");
  }
}

}  // namespace bielle
