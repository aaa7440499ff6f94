#include "results/mechanism_figure.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "formats/pivots.h"

namespace bielle {
namespace {

constexpr double kSamePoint = 5e-4, kSameLimb = 5e-3;  // m, in the figure

struct FigureView {
  const char* name;
  int normal, right, up;  // axes of the world
};
constexpr FigureView kSide = {"from the side, x to the right, z up", 1, 0, 2},
                     kFront = {"from the front, y to the right, z up", 0, 1, 2},
                     kTop = {"from above, x to the right, y up", 2, 0, 1};

// Links of a model at a posture.
class LinkLayout {
 public:
  LinkLayout(const Model& model, ConstVectorRef q) : model_(model), links_(listRigidLinks(model)), ws_(model) {
    updatePlacements(model, ws_, q);
    link_of_.assign(static_cast<size_t>(model.numBodies()), 0);
    for (size_t i = 0; i < links_.size(); ++i)
      for (const int body : links_[i].bodies) link_of_[static_cast<size_t>(body)] = static_cast<int>(i);
    view_ = chooseView();
    chooseLimbs();
  }

  MechanismFigure draw() {
    MechanismFigure out;
    out.caption = view_.name;
    if (equals_ > 1) out.caption += "; one of " + std::to_string(equals_) + " limbs that look the same";
    for (size_t i = 0; i < links_.size(); ++i) drawLink(i, out);
    for (FigurePivot& pivot : out.pivots)  // those of linkages first: a label may leave out the others
      std::stable_partition(pivot.names.begin(), pivot.names.end(),
                            [this](const std::string& name) { return isOfLoop(name); });
    for (const LinkDistance& d : listLinkDistances(links_)) {
      const RigidLink& link = links_[static_cast<size_t>(d.link)];
      const Pivot &from = link.pivots[static_cast<size_t>(d.from)], &to = link.pivots[static_cast<size_t>(d.to)];
      if (is_shown_[static_cast<size_t>(d.link)] && shows(d.link, from) && shows(d.link, to))
        out.distances.push_back({link.name, from.name, to.name, project(link, from.p), project(link, to.p), d.length});
    }
    for (const Closure& c : model_.closures())
      if (c.kind == ClosureKind::Coupler)
        drawBelt(c, out);
      else if (c.kind == ClosureKind::Distance && showsBody(c.body1) && showsBody(c.body2))
        out.links.push_back({c.name, {projectPoint(c.body1, c.X_B1.p), projectPoint(c.body2, c.X_B2.p)}, true});
    for (const PointSpring& spring : model_.pointSprings())
      if (showsBody(spring.body1) && showsBody(spring.body2))
        out.springs.push_back({projectPoint(spring.body1, spring.point1), projectPoint(spring.body2, spring.point2)});
    for (const ContactFrame& contact : model_.contacts())
      if (showsBody(contact.body)) out.soles.push_back(listEnds(contact));
    return out;
  }

 private:
  FigureView chooseView() const {
    std::array<int, 3> counts{};
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      if (joint.kind != JointKind::Revolute && joint.kind != JointKind::Continuous) continue;
      int axis = 0;
      (ws_.X_WB[i].R * joint.axis).cwiseAbs().maxCoeff(&axis);
      ++counts[static_cast<size_t>(axis)];
    }
    if (counts[2] > counts[0] && counts[2] > counts[1]) return kTop;
    return counts[0] > counts[1] ? kFront : kSide;
  }

  Point2 project(const Vector3d& p) const { return {p[view_.right], p[view_.up]}; }
  Point2 project(const RigidLink& link, const Vector3d& p) const { return projectPoint(link.bodies.front(), p); }
  Point2 projectPoint(int body, const Vector3d& p) const { return project(ws_.X_WB[body].act(p)); }

  FigureLine listEnds(const ContactFrame& contact) const {
    FigureLine ends;
    for (const int end : {0, 1}) {
      Vector3d corner(contact.half_length, contact.half_width, 0);
      if (view_.normal == 1) corner.y() = 0;
      if (view_.normal == 0) corner.x() = 0;
      ends[static_cast<size_t>(end)] =
          projectPoint(contact.body, contact.X_BF.act(end == 0 ? Vector3d(-corner) : corner));
    }
    return ends;
  }

  // Whatever hangs on the base by itself is a limb; those that look like one before them are left out.
  void chooseLimbs() {
    base_ = model_.hasFreeFlyer() ? link_of_[1] : 0;
    std::vector<int> limb(links_.size());
    std::iota(limb.begin(), limb.end(), 0);
    const auto find = [&](int i) {
      while (limb[static_cast<size_t>(i)] != i) i = limb[static_cast<size_t>(i)];
      return i;
    };
    const auto join = [&](int a, int b) {
      a = find(link_of_[static_cast<size_t>(a)]), b = find(link_of_[static_cast<size_t>(b)]);
      if (a != find(base_) && b != find(base_)) limb[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
    };
    for (int i = 1; i < model_.numBodies(); ++i)
      if (model_.joints()[i].kind != JointKind::FreeFlyer) join(i, model_.joints()[i].parent);
    for (const Closure& c : model_.closures()) {
      join(c.body1, c.body2);
      for (size_t t = 1; t < c.terms.size(); ++t) join(c.terms[0].joint, c.terms[t].joint);
    }
    std::vector<std::vector<Point2>> looks;  // of limbs that are drawn
    std::set<int> shown;
    int limbs = 0;
    is_shown_.assign(links_.size(), false);
    for (int i = 0; i < static_cast<int>(links_.size()); ++i) {
      if (i == base_ || (i == 0 && model_.hasFreeFlyer()) || find(i) != i) continue;
      std::vector<Point2> look;
      for (int k = 0; k < static_cast<int>(links_.size()); ++k)
        if (find(k) == i)
          for (const Pivot& pivot : links_[static_cast<size_t>(k)].pivots)
            look.push_back(project(links_[static_cast<size_t>(k)], pivot.p));
      ++limbs;
      if (std::any_of(looks.begin(), looks.end(), [&](const auto& other) { return looksLike(look, other); })) continue;
      looks.push_back(look);
      shown.insert(i);
    }
    for (int i = 0; i < static_cast<int>(links_.size()); ++i)
      is_shown_[static_cast<size_t>(i)] = i == base_ || shown.count(find(i)) > 0;
    if (shown.size() == 1) equals_ = limbs;
    for (int i = 0; i < static_cast<int>(links_.size()); ++i)
      if (i != base_ && is_shown_[static_cast<size_t>(i)])
        for (const Pivot& pivot : links_[static_cast<size_t>(i)].pivots) shown_pivots_.insert(pivot.name);
  }

  static bool looksLike(const std::vector<Point2>& a, const std::vector<Point2>& b) {
    const auto has = [&b](const Point2& p) {
      return std::any_of(b.begin(), b.end(), [&p](const Point2& other) { return (other - p).norm() < kSameLimb; });
    };
    return a.size() == b.size() && std::all_of(a.begin(), a.end(), has);
  }

  bool showsBody(int body) const { return is_shown_[static_cast<size_t>(link_of_[static_cast<size_t>(body)])]; }
  // Of the base, pivots of limbs that are drawn.
  bool shows(int link, const Pivot& pivot) const { return link != base_ || shown_pivots_.count(pivot.name) > 0; }

  void drawLink(size_t i, MechanismFigure& out) const {
    if (!is_shown_[i]) return;
    const RigidLink& link = links_[i];
    std::vector<Point2> points;
    for (const Pivot& pivot : link.pivots) {
      if (!shows(static_cast<int>(i), pivot)) continue;
      const Point2 at = project(link, pivot.p);
      points.push_back(at);
      addPivot(at, pivot, out);
    }
    for (const ContactFrame& contact : model_.contacts())
      if (link_of_[static_cast<size_t>(contact.body)] == static_cast<int>(i))
        for (const Point2& end : listEnds(contact)) points.push_back(end);
    std::vector<Point2> outline = calcHull(points);
    if (outline.size() > 1) out.links.push_back({link.name, outline, isInLoop(link)});
  }

  static void addPivot(const Point2& at, const Pivot& pivot, MechanismFigure& out) {
    const auto is_here = [&](const FigurePivot& other) { return (other.at - at).norm() < kSamePoint; };
    auto place = std::find_if(out.pivots.begin(), out.pivots.end(), is_here);
    if (place == out.pivots.end()) place = out.pivots.insert(place, {at, {}, false});
    if (std::find(place->names.begin(), place->names.end(), pivot.name) == place->names.end())
      place->names.push_back(pivot.name);
    place->has_motor |= pivot.motor >= 0;
  }

  void drawBelt(const Closure& c, MechanismFigure& out) const {
    for (size_t t = 1; t < c.terms.size(); ++t) {
      const int a = c.terms[t - 1].joint, b = c.terms[t].joint;
      if (showsBody(a) && showsBody(b))
        out.belts.push_back({projectPoint(a, Vector3d::Zero()), projectPoint(b, Vector3d::Zero())});
    }
  }

  // Whether a joint, or a closure, is part of a loop.
  bool isOfLoop(const std::string& name) const {
    const int joint = model_.findJoint(name);
    return joint < 0 ||
           std::any_of(model_.clusters().begin(), model_.clusters().end(), [&](const LoopCluster& cluster) {
             return std::any_of(cluster.dofs.begin(), cluster.dofs.end(),
                                [&](int dof) { return model_.dofs()[static_cast<size_t>(dof)].joint == joint; });
           });
  }

  bool isInLoop(const RigidLink& link) const {
    for (const Closure& c : model_.closures())
      if (c.kind != ClosureKind::Coupler)
        for (const int dof : c.dofs)
          if (std::binary_search(link.bodies.begin(), link.bodies.end(), model_.dofs()[static_cast<size_t>(dof)].joint))
            return true;
    return false;
  }

  // Andrew's monotone chain; two ends where all lie on a line, one where all are the same.
  static std::vector<Point2> calcHull(std::vector<Point2> points) {
    std::sort(points.begin(), points.end(),
              [](const Point2& a, const Point2& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
    std::vector<Point2> hull;
    for (const int way : {1, -1}) {
      const size_t first = hull.size();
      for (const Point2& p : points) {
        while (hull.size() > first + 1) {
          const Point2 u = hull.back() - hull[hull.size() - 2], w = p - hull.back();
          if (u.x() * w.y() - u.y() * w.x() > 1e-9) break;
          hull.pop_back();
        }
        if (hull.size() == first || (p - hull.back()).norm() > kSamePoint) hull.push_back(p);
      }
      if (hull.size() > first + 1 || way < 0) hull.pop_back();
      if (way > 0) std::reverse(points.begin(), points.end());
    }
    if (hull.empty() && !points.empty()) hull.push_back(points.front());
    return hull;
  }

  const Model& model_;
  std::vector<RigidLink> links_;
  Workspace ws_;
  std::vector<int> link_of_;  // of bodies
  FigureView view_ = kSide;
  int base_ = 0, equals_ = 1;
  std::vector<bool> is_shown_;
  std::set<std::string> shown_pivots_;
};

}  // namespace

MechanismFigure makeMechanismFigure(const Model& model, ConstVectorRef q) { return LinkLayout(model, q).draw(); }

VectorXd makeDrawnPosture(const Model& model) {
  try {
    return makeStandingPosture(model);
  } catch (const InputError&) {  // there is no reference
    return findClosedConfiguration(model).q;
  }
}

}  // namespace bielle
