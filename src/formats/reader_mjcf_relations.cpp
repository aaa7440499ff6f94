// What relates bodies beside their joints: loops, couplers, springs; and motors.
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "formats/mjcf.h"
#include "formats/reader_mjcf.h"
#include "model/number_text.h"

namespace bielle {

const MjcfReader::BodyPlace& MjcfReader::findBody(MjcfElement& e, const char* attribute) {
  const std::string name = e.getText(attribute, "world");
  const auto it = places_.find(name);
  if (it == places_.end()) e.fail("there is no body '" + name + "'", "correct the name");
  return it->second;
}

const MjcfReader::BodyPlace& MjcfReader::findSite(MjcfElement& e, const char* attribute) {
  const std::string name = e.getText(attribute);
  const auto it = sites_.find(name);
  if (it == sites_.end()) e.fail("there is no site '" + name + "'", "correct the name");
  return it->second;
}

void MjcfReader::readEquality(const XMLElement& element) {
  MjcfElement e(element, "", settings_, "equality");
  if (!e.getFlag("active", true)) return e.leaveOut("it is not active, and left out");
  if (!has_equalities_) return e.leaveOut("it is left out, because <flag> disables equalities");
  std::string name = getAttribute(&element, "name");
  if (name.empty())
    name = makeUnusedName(e.tag() + "_" + std::to_string(e.line()), [this](const std::string& made) {
      return std::any_of(ties_.begin(), ties_.end(), [&](const Tie& tie) { return tie.name == made; });
    });
  readSoftness(e, name);
  if (e.tag() == "connect" || e.tag() == "weld")
    readTie(e, name);
  else if (e.tag() == "joint")
    readJointEquality(e, name);
  else if (e.tag() == "tendon")
    readTendonEquality(e, name);
  else
    e.fail("such equalities are not supported", "use connect, weld, joint or tendon, or remove it");
  ties_.back().equalities = {softness_.equalities.size() - 1};
  softness_.equalities.back().links = {ties_.back().body1, ties_.back().body2};
}

// Loops are rigid here. In MuJoCo they are springs and dampers (its documentation, "Computation", section on parameters of the
// solver): with the stiffness k and the damping b of solref and the impedance d of solimp, a loop that is open by r at a rate v
// moves at
//     a = (1 - d) a0 - d (b v + k r)                                                                                 (1)
// a0 being its acceleration without any force of it. At rest, r = (1 - d) a0 / (d k).
void MjcfReader::readSoftness(MjcfElement& e, const std::string& name) {
  MjcfEquality equality;
  equality.tag = e.tag();
  equality.name = name;
  const std::vector<double> ref = e.getNumbers("solref", 1, 2), imp = e.getNumbers("solimp", 1, 5);
  std::copy(ref.begin(), ref.end(), equality.settings.solref.begin());
  std::copy(imp.begin(), imp.end(), equality.settings.solimp.begin());
  noteSoftness(e, equality.settings);
  softness_.equalities.push_back(equality);
}

void MjcfReader::noteSoftness(const MjcfElement& e, const SoftSettings& settings) const {
  constexpr double kLeastShare = 2e-3, kLeastGap = 1e-6;  // of 1 - d, and of r in m under the gravity of the Earth
  const auto& [ref, imp] = settings;
  const auto clamp = [](double impedance) { return std::clamp(impedance, 0.0001, 0.9999); };
  const double d = clamp(imp[0]), most = clamp(imp[1]);
  const bool is_direct = ref[0] <= 0;
  const double time = softness_.step.is_safe ? std::max(ref[0], 2 * softness_.step.duration) : ref[0];
  const double k = is_direct ? -ref[0] * d / (most * most) : d / std::pow(most * time * ref[1], 2);
  const double gap = (1 - d) * 9.81 / (d * k);
  if (1 - d < kLeastShare && gap < kLeastGap) return;
  const auto join = [](const auto& values) {
    std::string text;
    for (double value : values) text += (text.empty() ? "" : " ") + formatNumber(value);
    return text;
  };
  e.note("it is read as rigid. In MuJoCo, solref " + join(ref) + " and solimp " + join(imp) + " at steps of " +
         formatNumber(1e3 * softness_.step.duration) + " ms let it give way: " + formatNumber(100 * (1 - d), "%.2g") +
         " % of an acceleration that opens it pass, it stands open by about " + formatNumber(1e3 * gap, "%.1g") +
         " mm (mrad) per g at which its parts would move apart, often tens under the weight of a robot" +
         (is_direct ? "" : ", and it closes within " + formatNumber(1e3 * time, "%.3g") + " ms") +
         "; solimp 0.9999 0.9999 and solref 0.0005 1 hold it");
}

void MjcfReader::readTie(MjcfElement& e, const std::string& name) {
  Tie tie;
  tie.name = name;
  tie.line = e.line();
  // A weld without torque, too, is a ball.
  const bool is_weld = e.tag() == "weld" && e.getNumber("torquescale", 1) != 0;
  tie.kind = is_weld ? ClosureKind::Weld6D : ClosureKind::Ball3D;
  if (e.find("site1") || e.find("site2")) {
    // Two sites are brought together, wherever the bodies stand.
    const BodyPlace &one = findSite(e, "site1"), &two = findSite(e, "site2");
    tie.body1 = one.link, tie.body2 = two.link;
    tie.X_L1 = one.X_LB, tie.X_L2 = two.X_LB;
  } else {
    if (!e.find("body1")) e.fail("it has no body1", "name the first body");
    const BodyPlace &one = findBody(e, "body1"), &two = findBody(e, "body2");
    const SE3 X_12 = one.X_WB.inverse() * two.X_WB;
    const Vector3d anchor = e.getVector("anchor", Vector3d::Zero());
    tie.body1 = one.link, tie.body2 = two.link;
    if (e.tag() == "weld") {
      tie.X_L1 = one.X_LB * X_12 * translate(anchor);
      tie.X_L2 = two.X_LB * translate(anchor);
      const std::vector<double> relative = e.getNumbers("relpose", 7, 7);
      if (!relative.empty()) {
        const Eigen::Vector4d q(relative[4], relative[5], relative[6], relative[3]);
        const double norm = q.stableNorm();
        // The anchor belongs to body 2 alone. A quaternion of zeros: as the bodies stand.
        if (norm > 1e-12 && std::isfinite(norm))
          tie.X_L1 =
              one.X_LB * SE3(Eigen::Quaterniond(q / norm).toRotationMatrix(), {relative[0], relative[1], relative[2]});
      }
    } else {
      if (!e.find("anchor")) e.fail("it has no anchor", "give the point that the bodies share, in the frame of body1");
      tie.X_L1 = one.X_LB * translate(anchor);
      tie.X_L2 = two.X_LB * X_12.inverse() * translate(anchor);
    }
  }
  ties_.push_back(tie);
}

// Two points that tie the same bodies, as far apart on one as on the other, make a hinge: 5 rows, of which 6 would say one twice.
// The writer's NAME.1 and NAME.2 give it their name.
void MjcfReader::joinHinges() {
  constexpr double kSameLength = 1e-6;  // relative
  // Of four points, each of whose coordinates is rounded; at most a hundredth of their distance.
  const double rounding = 4 * std::sqrt(3) * tree_.rounding.length;
  for (size_t i = 0; i < ties_.size(); ++i)
    for (size_t j = i + 1; j < ties_.size(); ++j) {
      Tie &a = ties_[i], &b = ties_[j];
      if (a.kind != ClosureKind::Ball3D || b.kind != ClosureKind::Ball3D || a.body1 != b.body1 || a.body2 != b.body2)
        continue;
      const Vector3d along = a.X_L1.p - b.X_L1.p, along2 = a.X_L2.p - b.X_L2.p;
      const double length = along.norm(), off = std::abs(length - along2.norm());
      if (!(length > 1e-6) || off > kSameLength * length + std::min(rounding, 0.01 * length)) continue;
      const Vector3d turned = a.X_L1.R * a.X_L2.R.transpose() * along2;  // where the bodies stand
      const std::string stem = a.name.substr(0, a.name.size() - std::min<size_t>(2, a.name.size()));
      if (a.name == stem + ".1" && b.name == stem + ".2")
        a.name = stem;
      else
        settings_.notes.add(settings_.path, "<connect>", b.line,
                            "together with '" + a.name + "' it makes a hinge of their two bodies, read as such");
      a.kind = ClosureKind::Hinge5D;
      a.lever = along.norm();
      a.axis = a.X_L1.R.transpose() * along.normalized();
      if (!along.isApprox(turned, kSameLength))  // its frames do not have the axis in common
        a.X_L2.R = Eigen::Quaterniond::FromTwoVectors(a.axis, along2).toRotationMatrix();
      for (const size_t at : a.equalities) softness_.equalities[at].lever = along.norm() / 2;
      for (const size_t at : b.equalities) softness_.equalities[at].lever = -along.norm() / 2;
      a.equalities.insert(a.equalities.end(), b.equalities.begin(), b.equalities.end());
      a.X_L1.p = (a.X_L1.p + b.X_L1.p) / 2;
      a.X_L2.p = (a.X_L2.p + b.X_L2.p) / 2;
      ties_.erase(ties_.begin() + static_cast<std::ptrdiff_t>(j));
      break;
    }
}

void MjcfReader::addClosures() {
  for (const Tie& tie : ties_) {
    ClosureSpec closure;
    closure.name = tie.name;
    closure.kind = tie.kind;
    if (!tie.coupler.empty()) {
      closure = couplers_.at(tie.coupler);
    } else {
      const bool is_point = tie.kind == ClosureKind::Ball3D || tie.kind == ClosureKind::Distance;
      closure.axis = tie.axis;
      if (tie.kind == ClosureKind::Distance) closure.length = tie.length;
      closure.frame1 = findFrame(tie.body1, tie.X_L1, is_point, tie.name + "_frame1");
      closure.frame2 = findFrame(tie.body2, tie.X_L2, is_point, tie.name + "_frame2");
    }
    for (const size_t at : tie.equalities) softness_.equalities[at].closure = closure.name;
    yaml_.closures.push_back(closure);
  }
}

void MjcfReader::addCoupler(const std::string& name, ClosureSpec coupler, const MjcfElement& e) {
  coupler.name = name;
  coupler.kind = ClosureKind::Coupler;
  if (!couplers_.emplace(name, coupler).second) e.fail("two equalities have this name", "rename one of them");
  Tie tie;
  tie.kind = ClosureKind::Coupler;
  tie.name = tie.coupler = name;
  ties_.push_back(tie);
}

const MjcfReader::Slot& MjcfReader::findSlot(const MjcfElement& e, const std::string& joint) const {
  for (const Slot& slot : slots_)
    if (slot.joint == joint) {
      if (slot.q_ref.size() != 1) e.fail("joint '" + joint + "' has several coordinates", "name a hinge or a slide");
      return slot;
    }
  e.fail("there is no joint '" + joint + "'", "correct the name");
}

std::vector<double> MjcfReader::readPolynomial(MjcfElement& e) {
  std::vector<double> p = e.getNumbers("polycoef", 1, 5);
  if (p.empty()) p = {0, 1};
  p.resize(5);
  return p;
}

// Subtracts p_1 s + p_2 s^2 + .. of s = c (x - x_ref) from the sum of a coupler.
void MjcfReader::subtractPolynomial(const std::vector<double>& p, double c, const std::string& x, double x_ref,
                                    ClosureSpec& coupler) {
  std::vector<double> powers(p.size());
  double power = 1;
  for (size_t k = 1; k < p.size(); ++k) powers[k] = (power *= c) * p[k];
  while (powers.size() > 2 && powers.back() == 0) powers.pop_back();
  powers = shiftPolynomial(std::move(powers), -x_ref);
  coupler.offset += powers[0];
  coupler.coefficients[x] -= powers[1];
  for (size_t k = 2; k < powers.size(); ++k) coupler.higher[x].push_back(-powers[k]);
}

// y - y_ref = p(x - x_ref)
void MjcfReader::readJointEquality(MjcfElement& e, const std::string& name) {
  const std::string y = e.getText("joint1"), x = e.getText("joint2");
  const std::vector<double> p = readPolynomial(e);
  if (y.empty()) e.fail("it has no joint1", "name one");
  const double y_ref = findSlot(e, y).q_ref[0];
  if (x.empty() || std::all_of(p.begin() + 1, p.end(), [](double c) { return c == 0; }))
    e.fail("it constrains a single joint", "remove the joint to fix the body");
  const double x_ref = findSlot(e, x).q_ref[0];
  if (x == y) e.fail("it couples a joint with itself", "name two joints");
  ClosureSpec coupler;
  coupler.coefficients = {{y, 1}};
  coupler.offset = y_ref + p[0];
  subtractPolynomial(p, 1, x, x_ref, coupler);
  softness_.equalities.back().sums = {{{y, 1}}, {{x, 1}}};
  addCoupler(name, coupler, e);
}

void MjcfReader::readTendon(const XMLElement& element) {
  if (getTag(element) == "spatial") return readSpatialTendon(element);
  if (getTag(element) != "fixed") return noteElement(element, "the tendon is left out");
  FixedTendon tendon;
  tendon.element = &element;
  for (const XMLElement* j : getChildren(element, "joint")) {
    MjcfElement term(*j, "", settings_, "");
    const std::string joint = term.getText("joint");
    findSlot(term, joint);
    if (!term.find("coef")) term.fail("it has no coef", "give one");
    const double coefficient = term.getNumber("coef", 0);
    if (!tendon.coefficients.emplace(joint, coefficient).second)
      term.fail("the tendon lists this joint twice", "add the coefficients up");
    if (coefficient == 0) tendon.coefficients.erase(joint);
  }
  const std::string name = getAttribute(&element, "name");
  if (name.empty() || tendon.coefficients.empty()) return noteElement(element, "the tendon is left out");
  if (!tendons_.emplace(name, tendon).second) refuse(element, "two tendons have this name", "rename one of them");
}

// Whether an equality holds its length, or ties it to that of another.
bool MjcfReader::isTied(const std::string& tendon) {
  bool is_tied = false;
  if (has_equalities_ && !tendon.empty())
    forEach("equality", [&](const XMLElement& element) {
      is_tied |= getTag(element) == "tendon" && getAttribute(&element, "active") != "false" &&
                 (getAttribute(&element, "tendon1") == tendon || getAttribute(&element, "tendon2") == tendon);
    });
  return is_tied;
}

// A spring or damper between two sites, or a rod if an equality holds its length; a tendon that bends or carries only load of its
// own has no like here.
void MjcfReader::readSpatialTendon(const XMLElement& element) {
  MjcfElement e(element, "", settings_, "tendon");
  const std::string given = getAttribute(&element, "name");
  const bool is_tied = isTied(given);
  SpatialTendon& tendon = spatial_tendons_[given];
  std::vector<const XMLElement*> sites;
  for (const XMLElement* s : getChildren(element)) {
    if (getTag(*s) != "site") return e.leaveOut("it bends about a <" + getTag(*s) + ">, and is left out");
    sites.push_back(s);
  }
  if (sites.size() != 2) return e.leaveOut("it does not run between two sites, and is left out");
  const auto find = [&](const XMLElement& site) {
    MjcfElement end(site, "", settings_, "");
    return findSite(end, "site");
  };
  const BodyPlace one = find(*sites[0]), two = find(*sites[1]);
  tendon.ends = {one, two};
  PointSpringSpec spec{one.link, two.link, {}};
  PointSpring& spring = spec.spring;
  spring.point1 = one.X_LB.p;
  spring.point2 = two.X_LB.p;
  spring.stiffness = e.getNumber("stiffness", 0);
  spring.damping = e.getNumber("damping", 0);
  const std::vector<double> lengths = e.getNumbers("springlength", 1, 2);
  // Without one, or with -1, as long as the file stands.
  spring.rest = lengths.empty() || lengths[0] < 0 ? (two.X_WB.p - one.X_WB.p).norm() : lengths[0];
  if (spring.stiffness == kMjcfPreloadStiffness)
    spring.preload = -spring.stiffness * spring.rest, spring.stiffness = spring.rest = 0;
  for (const char* without_meaning : {"width", "material", "rgba", "group", "user"}) e.find(without_meaning);
  if (lengths.size() == 2 && lengths[1] != lengths[0])
    return e.leaveOut("its spring is slack between two lengths; it is left out");
  if (spring.stiffness == 0 && spring.preload == 0 && spring.damping == 0 && is_tied) {
    for (const char* without_effect : {"limited", "range", "frictionloss", "margin"}) e.find(without_effect);
    return;
  }
  if (spring.stiffness == 0 && spring.preload == 0 && spring.damping == 0)
    return e.leaveOut(std::string("it has no spring or damper, and is left out") +
                      (e.isLimited("limited", "range") ? ": nothing limits its length" : ""));
  if (e.isLimited("limited", "range")) e.note("the limits of its length are left out"), e.find("range");
  if (e.getNumber("frictionloss", 0) != 0) e.note("its frictionloss is left out");
  spring.name = given;
  if (spring.name.empty()) spring.name = namePointSpring("tendon_" + std::to_string(e.line()), yaml_);
  yaml_.point_springs.push_back(spec);
}

// L - L_ref = a of the distance of two sites
void MjcfReader::readRod(MjcfElement& e, const std::string& name, const SpatialTendon& tendon) {
  if (!e.getText("tendon2").empty())
    e.fail("it ties a spatial tendon to another tendon",
           "remove tendon2: the length of a tendon of two sites can be fixed");
  if (tendon.ends.empty())
    e.fail("its tendon does not run straight between two sites", "give it two sites, or remove the equality");
  const BodyPlace &one = tendon.ends[0], &two = tendon.ends[1];
  const std::vector<double> p = e.getNumbers("polycoef", 1, 5);
  Tie tie;
  tie.kind = ClosureKind::Distance;
  tie.name = name;
  tie.line = e.line();
  tie.body1 = one.link, tie.body2 = two.link;
  tie.X_L1 = one.X_LB, tie.X_L2 = two.X_LB;
  tie.length = (two.X_WB.p - one.X_WB.p).norm() + (p.empty() ? 0 : p[0]);
  if (!(tie.length > kSamePlace))
    e.fail("it leaves its tendon no length", "move a site, correct its polycoef, or connect the two sites instead");
  ties_.push_back(tie);
}

// L1 - L1_ref = p(L2 - L2_ref) of sums of coordinates
void MjcfReader::readTendonEquality(MjcfElement& e, const std::string& name) {
  const std::string first = e.getText("tendon1"), second = e.getText("tendon2");
  for (const std::string& tendon : {first, second})
    if (const auto it = spatial_tendons_.find(tendon); it != spatial_tendons_.end() && !tendon.empty())
      return readRod(e, name, it->second);
  const std::vector<double> p = readPolynomial(e);
  ClosureSpec coupler;
  coupler.offset = p[0];
  const auto find = [&](const std::string& tendon) -> FixedTendon& {
    const auto it = tendons_.find(tendon);
    if (it == tendons_.end()) e.fail("there is no tendon of joints '" + tendon + "'", "name a <fixed> tendon");
    return it->second;
  };
  for (const std::string& tendon : {first, second})
    if (!tendon.empty()) softness_.equalities.back().sums.push_back(find(tendon).coefficients);
  addTendonLength(find(first), 1, coupler, e);
  const bool is_linear = std::all_of(p.begin() + 2, p.end(), [](double c) { return c == 0; });
  if (second.empty() || is_linear) {
    if (!second.empty()) addTendonLength(find(second), -p[1], coupler, e);
  } else {
    const std::map<std::string, double>& tendon = find(second).coefficients;
    find(second).is_used = true;
    if (tendon.size() != 1)
      e.fail("its polycoef is of degree 2 or more, of a sum of several joints",
             "make it linear, or couple tendon1 with a joint that is coupled with that sum");
    const auto& [x, coefficient] = *tendon.begin();
    subtractPolynomial(p, coefficient, x, findSlot(e, x).q_ref[0], coupler);
  }
  for (auto it = coupler.coefficients.begin(); it != coupler.coefficients.end();)
    it = it->second == 0 && !coupler.higher.count(it->first) ? coupler.coefficients.erase(it) : std::next(it);
  addCoupler(name, coupler, e);
}

}  // namespace bielle
