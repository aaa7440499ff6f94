#include "report/mode_view.h"

#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "report/pack.h"
#include "report/page.h"
#include "report/run.h"

namespace bielle {
namespace {

constexpr double kLargestSwing = 0.2;       // rad or m
constexpr double kTogether = 0.01;          // a shape whose imaginary part is less than this all moves together
constexpr int kSwingCounts[] = {0, 21, 9};  // postures along each of the parts of a shape, by their number

std::vector<FrameTarget> holdContacts(const Model& model, ConstVectorRef q, const std::vector<int>& contacts) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  std::vector<FrameTarget> targets;
  for (int c : contacts) {
    const ContactFrame& contact = model.contacts()[c];
    targets.push_back(makeFrameTarget(contact, getPlacement(ws, contact.body, contact.X_BF)));
  }
  return targets;
}

// Postures on a grid over a cos p and, where not all moves together, a sin p.
Json describeSwing(const Model& model, ConstVectorRef q, const std::vector<FrameTarget>& held, const Mode& mode) {
  std::vector<VectorXd> parts = {mode.shape.real()};
  if (mode.shape.imag().cwiseAbs().maxCoeff() > kTogether) parts.push_back(-mode.shape.imag());
  const int count = kSwingCounts[parts.size()], size = parts.size() == 1 ? count : count * count;
  Json axes = Json::array(), bodies = Json::array(), closed = Json::array();
  for (size_t i = 0; i < parts.size(); ++i)
    axes.push_back({{"low", -kLargestSwing}, {"high", kLargestSwing}, {"start", 0}});
  for (int body = 1; body < model.numBodies(); ++body) bodies.push_back(body);
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  options.continuation_steps = 0;
  Workspace ws(model);
  RowMatrixXd poses = RowMatrixXd::Zero(size, 7 * bodies.size());
  for (int node = 0; node < size; ++node) {
    VectorXd change = VectorXd::Zero(model.nv());
    for (size_t i = 0, rest = node; i < parts.size(); ++i, rest /= count)
      change += kLargestSwing * (2.0 * static_cast<double>(rest % count) / (count - 1) - 1) * parts[i];
    const AssemblyResult result = assemble(model, {model.integrate(q, change), {}, held}, options);
    closed.push_back(result.status == NumericalStatus::Ok);
    updatePlacements(model, ws, result.q);
    for (int body = 1; body < model.numBodies(); ++body) {
      const SE3& X_WP = ws.X_WB[model.joints()[body].parent];
      poses.row(node).segment<7>(7 * (body - 1)) = makePoseRow(X_WP.inverseTimes(ws.X_WB[body]));
    }
  }
  return {{"motors", axes}, {"count", count}, {"bodies", bodies}, {"closed", closed}, {"poses", packTable(poses)}};
}

}  // namespace

std::string makeModeView(const LoadedRobot& robot, ConstVectorRef q, const std::vector<int>& contacts,
                         const std::vector<Mode>& modes) {
  const Model& model = robot.model;
  if (modes.empty()) throw InputError(robot.path(), "modes", "there are none, because nothing can move", "lock less");
  const std::vector<FrameTarget> held = holdContacts(model, q, contacts);
  const ReportRun still = makeStillRun(robot, q, "modes");
  Json swings = Json::array(), list = Json::array(), parents = Json::array();
  for (const Mode& mode : modes) {
    swings.push_back(describeSwing(model, q, held, mode));
    list.push_back({{"frequency", mode.frequency}, {"damping", mode.damping}, {"rate", mode.eigenvalue.real()}});
  }
  for (const Joint& joint : model.joints()) parents.push_back(joint.parent);
  return makePage({{"bielle", getBuildInfo().bielle},
                   {"runs",
                    {{{"label", model.name()},
                      {"summary", still.summary},
                      {"check", Json()},
                      {"robot", describeRobot(robot)},
                      {"motion", describeMotion(still)}}}},
                   {"views", Json::array({{{"parents", parents}, {"groups", swings}, {"modes", list}}})}});
}

void writeModeView(const std::string& path, const LoadedRobot& robot, ConstVectorRef q,
                   const std::vector<int>& contacts, const std::vector<Mode>& modes) {
  writeTextFile(path, makeModeView(robot, q, contacts, modes));
}

}  // namespace bielle
