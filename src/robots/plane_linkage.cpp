#include "robots/plane_linkage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "model/listing.h"
#include "robots/part_solids.h"
#include "robots/part_tree.h"

namespace bielle {
namespace {

constexpr double kBarRadius = 0.006;  // m, unless it is given

const YamlKeys kLinkageKeys("part", "linkage",
                            {"base", "through", "normal", "points", "fixed", "bars", "hinges", "radius", "density"});
const YamlKeys kFixedKeys("part", "linkage.fixed.LINK", {"points", "angles"});
const YamlKeys kBarKeys("part", "linkage.bars.LINK", {"points", "radius", "density"});

struct Body {
  std::string name;  // of its link
  YamlEntry entry;
  bool is_bar = false;
  std::vector<std::string> points = {};
  std::map<std::string, double> angles = {};                  // of joints between the base and a link, in the drawing
  std::vector<std::pair<std::string, YamlEntry>> given = {};  // these angles, by the names of the joints
  std::optional<SE3> X = {};  // of a bar in the base, in the drawing, once it hangs on something
};

class PlaneLinkage {
 public:
  PlaneLinkage(const YamlEntry& entry, const LinkagePlace& place)
      : entry_(entry), place_(place), fields_(entry.getFields(kLinkageKeys)) {
    readPoints();
    readFixed();
    readBars();
    if (const YamlEntry* hinges = find(fields_, "hinges"))
      for (const auto& [point, name] : hinges->getMap()) {
        requirePoint(point, name);
        hinges_.emplace(point, name);
      }
  }

  void add() {
    for (bool is_new = true; is_new;) {
      is_new = false;
      for (Body& bar : bodies_)
        if (bar.is_bar && !bar.X && placeBar(bar)) is_new = true;
    }
    for (const Body& bar : bodies_)
      if (bar.is_bar && !bar.X)
        bar.entry.fail("the bar has no point in common with a link or with another bar that hangs on one",
                       "name a common point, fix one of its points under `fixed`, or mount the part after the link");
    for (const auto& [point, name] : hinges_)
      if (!hung_.count(point))
        name.fail("no bar hangs on point '" + point + "'", "name a point by which a bar is carried");
    place_.later.push_back([self = *this] { self.checkAngles(); });  // of links that come after it, too
    close();
  }

 private:
  // Angles are those of joints between the base and a link.
  void checkAngles() const {
    for (const Body& body : bodies_)
      for (const auto& [name, angle] : body.given) {
        const std::vector<std::string> way = listWay(body);
        if (!contains(way, name))
          angle.fail("joint '" + name + "' is not between link '" + base_ + "' and link '" + body.name + "'",
                     "known are " + listItems(way));
        for (const UrdfJoint& joint : place_.files.urdf.joints)
          if (joint.joint.name == name && getNv(joint.joint.kind) != 1)
            angle.fail("joint '" + name + "' has not one coordinate", "draw the linkage where it is at 0");
      }
  }

  std::vector<std::string> listWay(const Body& body) const {
    std::vector<std::string> way;
    const std::vector<UrdfJoint>& joints = place_.files.urdf.joints;
    for (std::string link = body.name; link != base_;) {
      const auto it =
          std::find_if(joints.begin(), joints.end(), [&link](const UrdfJoint& j) { return j.child == link; });
      if (it == joints.end()) break;
      way.push_back(it->joint.name);
      link = it->parent;
    }
    return way;
  }

  void requirePoint(const std::string& point, const YamlEntry& entry) const {
    if (!points_.count(point)) entry.fail("there is no point '" + point + "'", "known are " + listKeys(points_));
  }

  void readPoints() {
    const YamlEntry& base = require(fields_, "base", entry_);
    base_ = place_.resolve(base.getText(), base);
    Vector3d through = Vector3d::Zero();
    if (const YamlEntry* given = find(fields_, "through")) through = readPlace(*given, place_.side);
    std::string normal = "y";
    if (const YamlEntry* given = find(fields_, "normal")) normal = given->getText();
    if (normal != "x" && normal != "y" && normal != "z")
      fields_.at("normal").fail("it is not a direction of the link", "use x, y or z");
    const int n = normal[0] - 'x', u = n == 0 ? 1 : 0, v = n == 2 ? 1 : 2;
    normal_ = Vector3d::Unit(n);
    for (const auto& [name, entry] : require(fields_, "points", entry_).getMap()) {
      const std::vector<double> place = entry.getNumbers(2);
      Vector3d p = Vector3d::Zero();
      p[u] = place[0], p[v] = place[1];
      if (n != 1) p.y() *= place_.side;
      points_[name] = through + p;
    }
  }

  std::vector<std::string> readNames(const YamlEntry& list) const {
    std::vector<std::string> names = list.getTexts();
    for (const std::string& name : names) requirePoint(name, list);
    return names;
  }

  void readFixed() {
    for (const auto& [link, entry] : require(fields_, "fixed", entry_).getMap()) {
      Body body{place_.resolve(link, entry), entry};
      if (entry.isList()) {
        body.points = readNames(entry);
      } else {
        const YamlFields fields = entry.getFields(kFixedKeys);
        body.points = readNames(require(fields, "points", entry));
        if (const YamlEntry* angles = find(fields, "angles"))
          for (const auto& [joint, angle] : angles->getMap()) {
            body.given.emplace_back(place_.resolve(joint, angle), angle);
            body.angles[body.given.back().first] = angle.getNumber();
          }
      }
      bodies_.push_back(body);
    }
  }

  void readBars() {
    for (const auto& [name, entry] : require(fields_, "bars", entry_).getMap()) {
      Body bar{place_.make_name(name, entry), entry, true};
      bar.points = entry.isList() ? readNames(entry) : readNames(require(entry.getFields(kBarKeys), "points", entry));
      if (bar.points.size() < 2) entry.fail("a bar joins two points or more", "name them");
      bodies_.push_back(bar);
    }
  }

  // A joint in the posture of the drawing. In a mirror image, angles about an axis that is the image of itself, as y is not, have the
  // other sign, and so have ways along y, which is not its own image.
  SE3 calcDrawn(const Joint& joint, double coordinate) const {
    if (joint.kind == JointKind::Prismatic)
      return {Matrix3d::Identity(), (isAcross(joint.axis) ? place_.side : 1) * coordinate * joint.axis};
    const double angle = (isAcross(joint.axis) ? 1 : place_.side) * coordinate;
    return {Eigen::AngleAxisd(angle, joint.axis).toRotationMatrix(), Vector3d::Zero()};
  }

  // In the base, in the posture of the drawing; none for a link that is not there yet, or does not hang on the base.
  std::optional<SE3> findPlacement(const Body& body) const {
    if (body.is_bar) return body.X;
    SE3 X;
    const std::vector<UrdfJoint>& joints = place_.files.urdf.joints;
    for (std::string link = body.name; link != base_;) {
      const auto it =
          std::find_if(joints.begin(), joints.end(), [&link](const UrdfJoint& j) { return j.child == link; });
      if (it == joints.end()) return {};
      const auto drawn = body.angles.find(it->joint.name);
      X = it->joint.X_PJ * (drawn == body.angles.end() ? X : calcDrawn(it->joint, drawn->second) * X);
      link = it->parent;
    }
    return X;
  }

  Vector3d getPlaceIn(const Body& body, const std::string& point) const {
    const std::optional<SE3> X = findPlacement(body);
    if (!X)
      body.entry.fail("link '" + body.name + "' does not hang on link '" + base_ + "', where the linkage is drawn",
                      "draw it in a link below which are all others");
    return X->R.transpose() * (points_.at(point) - X->p);
  }

  std::vector<Solid> makeBar(const Body& bar) const {
    const YamlFields own = bar.entry.isList() ? YamlFields() : bar.entry.getFields(kBarKeys);
    const auto get = [&](const char* key, double usual) {
      const YamlEntry* value = find(own, key) ? find(own, key) : find(fields_, key);
      if (!value && std::isnan(usual))
        bar.entry.fail("its mass per length is unknown", "give `density` [kg/m], for it or for the linkage");
      return value ? value->getNumber() : usual;
    };
    const double radius = get("radius", kBarRadius), density = get("density", NAN);
    if (!(radius > 0 && density > 0)) bar.entry.fail("radius and density are not positive", "correct them");
    std::vector<Solid> rods;
    const size_t count = bar.points.size();
    for (size_t i = 0; i < (count == 2 ? 1 : count); ++i) {
      const Vector3d a = getPlaceIn(bar, bar.points[i]), b = getPlaceIn(bar, bar.points[(i + 1) % count]);
      if (!((b - a).norm() > 1e-9))
        bar.entry.fail("points '" + bar.points[i] + "' and '" + bar.points[(i + 1) % count] + "' are in one place",
                       "move one of them");
      rods.push_back(makeRod(a, b, radius, density, colors::kRod));
    }
    return rods;
  }

  bool placeBar(Body& bar) {
    for (const Body& carrier : bodies_) {
      const std::optional<SE3> X = findPlacement(carrier);
      if (!X) continue;
      for (const std::string& point : bar.points) {
        if (!contains(carrier.points, point)) continue;
        UrdfJoint joint;
        joint.parent = carrier.name;
        joint.child = bar.name;
        joint.joint.kind = JointKind::Revolute;
        joint.joint.axis = normal_;
        joint.joint.X_PJ.p = getPlaceIn(carrier, point);
        const auto named = hinges_.find(point);
        const bool is_named = named != hinges_.end() && !hung_.count(point);
        joint.joint.name = is_named ? place_.make_name(named->second.getText(), named->second) : bar.name + "_hinge";
        if (is_named) named_.push_back(joint.joint.name);
        addJointTo(place_.files.urdf, joint, bar.entry);
        bar.X = SE3{X->R, points_.at(point)};
        addSolidsTo(place_.files.urdf.links.at(bar.name), makeBar(bar));
        hung_[point].push_back(&bar);
        return true;
      }
    }
    return false;
  }

  // All bodies at a point that no hinge holds together there.
  void close() {
    for (const auto& [point, where] : points_) {
      std::vector<const Body*> there;
      for (const Body& body : bodies_)
        if (contains(body.points, point)) there.push_back(&body);
      // The bodies that hang on one at this point are one with it.
      std::vector<const Body*> groups;
      for (const Body* body : there) {
        const auto hung = hung_.find(point);
        const bool hangs = hung != hung_.end() && contains(hung->second, body);
        const bool is_link = !body->is_bar && !groups.empty() && !groups.front()->is_bar;
        if (!hangs && !is_link) groups.push_back(body);
      }
      for (size_t i = 1; i < groups.size(); ++i) closeAt(point, *groups[0], *groups[i], i);
    }
  }

  // A universal joint in place of the hinge of a bar that carries no other: then no row of the closure is redundant.
  void freeOne(const std::string& point, const Body& a, const Body& b) {
    std::vector<UrdfJoint>& joints = place_.files.urdf.joints;
    const bool is_first_simpler = a.points.size() < b.points.size();  // a rod rather than what turns several
    for (const Body* bar : {is_first_simpler ? &a : &b, is_first_simpler ? &b : &a}) {
      const bool carries =
          std::any_of(joints.begin(), joints.end(), [bar](const UrdfJoint& j) { return j.parent == bar->name; });
      const auto it =
          std::find_if(joints.begin(), joints.end(), [bar](const UrdfJoint& j) { return j.child == bar->name; });
      if (!bar->is_bar || carries || it->joint.kind != JointKind::Revolute || contains(named_, it->joint.name))
        continue;
      // Across the bar as far as axes of coordinates go.
      const Vector3d along = getPlaceIn(*bar, point);
      Vector3d across;
      double least = std::numeric_limits<double>::infinity();
      for (int i = 0; i < 3; ++i) {
        const double share = normal_[i] != 0 ? least : std::abs(along[i]);
        if (share < least) least = share, across = Vector3d::Unit(i);
      }
      it->joint.kind = JointKind::Universal;
      it->joint.axis2 = across;
      return;
    }
  }

  void closeAt(const std::string& point, const Body& a, const Body& b, size_t number) {
    const std::string stem =
        place_.make_name(point + "_{part}" + (number > 1 ? "_" + std::to_string(number) : ""), entry_);
    ClosureSpec closure;
    closure.name = stem;
    closure.kind = ClosureKind::Ball3D;
    closure.frame1 = stem + "_1";
    closure.frame2 = stem + "_2";
    place_.files.yaml.closures.push_back(closure);
    freeOne(point, a, b);
    const auto self = *this;
    place_.later.push_back([self, a, b, closure, point = point] {
      UrdfFile& urdf = self.place_.files.urdf;
      addFrameTo(urdf, closure.frame1, a.name, {Matrix3d::Identity(), self.getPlaceIn(a, point)}, a.entry);
      addFrameTo(urdf, closure.frame2, b.name, {Matrix3d::Identity(), self.getPlaceIn(b, point)}, b.entry);
    });
  }

  YamlEntry entry_;
  LinkagePlace place_;
  YamlFields fields_;
  std::string base_;
  Vector3d normal_;
  std::map<std::string, Vector3d> points_;  // in the base
  std::vector<Body> bodies_;
  std::map<std::string, YamlEntry> hinges_;
  std::vector<std::string> named_;                        // joints of hinges_, which keep their coordinate
  std::map<std::string, std::vector<const Body*>> hung_;  // bars that hang on a point
};

}  // namespace

void addPlaneLinkage(const YamlEntry& entry, const LinkagePlace& place) { PlaneLinkage(entry, place).add(); }

}  // namespace bielle
