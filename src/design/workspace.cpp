#include "design/workspace.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "design/conditioning.h"

namespace bielle {
namespace {

constexpr double kMostPoints = 100000;
constexpr int kTries = 2;  // of a point, from different neighbours
const char* const kAxes[] = {"x", "y", "z", "roll", "pitch", "yaw"};

using Kind = WorkspaceAxis::Kind;

int findContact(const Model& model, const std::string& name) {
  if (model.contacts().empty())
    throw InputError(model.name(), "workspace", "the robot has no contacts", "name its feet in its YAML file");
  const int contact = name.empty() ? 0 : model.findContact(name);
  if (contact < 0)
    throw InputError(model.name(), "workspace: foot '" + name + "'", "there is no such contact",
                     "`bielle info` lists them");
  return contact;
}

int findBase(const Model& model, const std::string& name) {
  if (name.empty()) {
    const auto moves = [](const Motor& motor) { return motor.joint == 1; };
    return std::any_of(model.motors().begin(), model.motors().end(), moves) ? 0 : 1;
  }
  for (int i = 0; i < model.numBodies(); ++i)
    if (model.bodies()[i].name == name || (i == 0 && name == "world")) return i;
  throw InputError(model.name(), "workspace: base '" + name + "'", "there is no such link", "`bielle info` lists them");
}

// Ranges and counts with the defaults filled in.
std::array<WorkspaceAxis, 6> fillAxes(const Model& model, const WorkspaceRegion& region, const ContactFrame& foot,
                                      double distance) {
  std::array<WorkspaceAxis, 6> axes = region.axes;
  if (std::all_of(axes.begin(), axes.end(), [](const WorkspaceAxis& axis) { return axis.kind == Kind::Default; })) {
    axes[0] = {Kind::Range, -0.25 * distance, 0.25 * distance, 9};
    axes[2] = {Kind::Range, -0.2 * distance, 0.2 * distance, 9};
  }
  double total = 1;
  for (size_t i = 0; i < axes.size(); ++i) {
    WorkspaceAxis& axis = axes[i];
    if (axis.kind == Kind::Default)
      axis.kind = (i > 2 && foot.kind == ContactKind::Point3D) || (i == 3 && foot.kind == ContactKind::Edge5D)
                      ? Kind::Free
                      : Kind::Range;
    if (axis.kind == Kind::Free || axis.lower == axis.upper) axis.points = 1;
    if (!(axis.lower <= axis.upper && axis.points > 0))
      throw InputError(model.name(), std::string("workspace: ") + kAxes[i],
                       "its range is in the wrong order, or has no points",
                       "give the lower bound first, and at least one point");
    total *= axis.points;
  }
  if (total > kMostPoints)
    throw InputError(model.name(), "workspace", "it has more than 100000 points", "give fewer points per axis");
  return axes;
}

double getMiddle(const WorkspaceAxis& axis, int cell) {
  return axis.lower + (cell + 0.5) / axis.points * (axis.upper - axis.lower);
}

SE3 calcBaseToFoot(const Model& model, int base, const ContactFrame& foot, ConstVectorRef q, SE3* X_WB = nullptr) {
  Workspace ws(model);
  updatePlacements(model, ws, q);
  if (X_WB) *X_WB = ws.X_WB[base];
  return ws.X_WB[base].inverse() * getPlacement(ws, foot.body, foot.X_BF);
}

std::array<int, 6> getCell(const WorkspaceGrid& grid, int point) {
  std::array<int, 6> cell{};
  for (int i = 5; i >= 0; --i) cell[i] = point % grid.counts[i], point /= grid.counts[i];
  return cell;
}

int getPoint(const WorkspaceGrid& grid, const std::array<int, 6>& cell) {
  int point = 0;
  for (int i = 0; i < 6; ++i) point = point * grid.counts[i] + cell[i];
  return point;
}

bool isInRange(const Model& model, const VectorXd& q) {
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (joint.nq != joint.nv || joint.nv == 0) continue;  // ranges are of scalar coordinates
    const auto values = q.segment(joint.idx_q, joint.nq).array();
    if ((values < model.lowerLimits().segment(joint.idx_v, joint.nv).array()).any() ||
        (values > model.upperLimits().segment(joint.idx_v, joint.nv).array()).any())
      return false;
  }
  return true;
}

// Tries the points of a grid from their neighbours.
class Explorer {
 public:
  Explorer(const Model& model, const WorkspaceGrid& grid)
      : model_(model), grid_(grid), standing_(makeStandingPosture(model)), conditioning_(model, standing_) {
    standing_foot_ = calcBaseToFoot(model, grid.base, model.contacts()[grid.contact], standing_, &X_WB_);
    postures_.resize(grid.placements.size());
    tries_.resize(grid.placements.size());
  }

  std::vector<char> explore() {
    for (const int point : orderByNearness())
      if (tryPoint(point, standing_)) break;
    while (!queue_.empty()) {
      const int point = queue_.front();
      queue_.pop_front();
      const std::array<int, 6> cell = getCell(grid_, point);
      for (int axis = 0; axis < 6; ++axis)
        for (int side : {-1, 1}) {
          std::array<int, 6> other = cell;
          other[axis] += side;
          if (other[axis] >= 0 && other[axis] < grid_.counts[axis]) tryPoint(getPoint(grid_, other), *postures_[point]);
        }
    }
    std::vector<char> reached;
    for (const std::optional<VectorXd>& posture : postures_) reached.push_back(posture.has_value());
    return reached;
  }

 private:
  // Starts from the standing posture, with the held part of the placement.
  std::vector<int> orderByNearness() const {
    std::vector<double> distances;
    for (const SE3& placement : grid_.placements)
      distances.push_back(grid_.held.select(log6(standing_foot_.inverse() * placement), Vector6d::Zero()).norm());
    std::vector<int> order(distances.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return distances[a] < distances[b]; });
    return order;
  }

  bool tryPoint(int point, const VectorXd& from) {
    if (postures_[point] || tries_[point] == kTries) return false;
    ++tries_[point];
    const ContactFrame& foot = model_.contacts()[grid_.contact];
    AssemblyProblem problem;
    problem.q_ref = from;
    problem.frames.push_back({foot.name, foot.body, foot.X_BF, X_WB_ * grid_.placements[point], grid_.held});
    if (grid_.base > 0) problem.frames.push_back({model_.bodies()[grid_.base].name, grid_.base, SE3(), X_WB_});
    AssemblyOptions options;
    options.step = AssemblyStep::Shortest;
    options.tolerance = 1e-9;
    options.max_iterations = 20;
    options.continuation_steps = 2;
    const AssemblyResult result = assemble(model_, problem, options);
    if (result.status != NumericalStatus::Ok || !isGood(result.q)) return false;
    postures_[point] = result.q;
    queue_.push_back(point);
    return true;
  }

  bool isGood(const VectorXd& q) {
    return isInRange(model_, q) &&
           (std::isinf(grid_.max_conditioning) || conditioning_.calc(q) <= grid_.max_conditioning);
  }

  const Model& model_;
  const WorkspaceGrid& grid_;
  VectorXd standing_;
  LinkageConditioning conditioning_;
  SE3 X_WB_, standing_foot_;
  std::vector<std::optional<VectorXd>> postures_;
  std::vector<int> tries_;
  std::deque<int> queue_;
};

}  // namespace

WorkspaceGrid makeWorkspaceGrid(const Model& start, const WorkspaceRegion& region) {
  WorkspaceGrid grid;
  grid.contact = findContact(start, region.foot);
  grid.base = findBase(start, region.base);
  grid.max_conditioning = region.max_conditioning;
  const ContactFrame& foot = start.contacts()[grid.contact];
  const SE3 X_BF0 = calcBaseToFoot(start, grid.base, foot, makeStandingPosture(start));
  const std::array<WorkspaceAxis, 6> axes = fillAxes(start, region, foot, X_BF0.p.norm());
  for (int i = 0; i < 6; ++i) {
    grid.counts[i] = axes[i].points;
    grid.held[i] = axes[i].kind != Kind::Free;
  }
  const int total = std::accumulate(grid.counts.begin(), grid.counts.end(), 1, std::multiplies<int>());
  for (int point = 0; point < total; ++point) {
    const std::array<int, 6> cell = getCell(grid, point);
    Vector6d at;
    for (int i = 0; i < 6; ++i) at[i] = getMiddle(axes[i], cell[i]);
    const Matrix3d R = (Eigen::AngleAxisd(at[5], Vector3d::UnitZ()) * Eigen::AngleAxisd(at[4], Vector3d::UnitY()) *
                        Eigen::AngleAxisd(at[3], Vector3d::UnitX()))
                           .toRotationMatrix();
    grid.placements.push_back({R * X_BF0.R, X_BF0.p + at.head<3>()});  // Eq. (1)
  }
  return grid;
}

WorkspaceCoverage calcCoverage(const Model& model, const WorkspaceGrid& grid) {
  WorkspaceCoverage out;
  out.reached = Explorer(model, grid).explore();
  out.share = static_cast<double>(std::count(out.reached.begin(), out.reached.end(), 1)) /
              static_cast<double>(out.reached.size());
  return out;
}

}  // namespace bielle
