#include <cmath>
#include <limits>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/linkage.h"
#include "math/direction.h"
#include "report/drawing.h"
#include "report/pack.h"
#include "report/run.h"

namespace bielle {
namespace {

const double kNone = std::numeric_limits<double>::quiet_NaN();

Json describeJoints(const Model& model) {
  Json joints = Json::array();
  for (int j = 1; j < model.numBodies(); ++j) {
    const Joint& joint = model.joints()[j];
    const auto& serial = model.serialJoints();
    joints.push_back({{"name", joint.name},
                      {"kind", getName(joint.kind)},
                      {"q", joint.idx_q},
                      {"v", joint.idx_v},
                      {"nv", joint.nv},
                      {"serial", std::find(serial.begin(), serial.end(), j) != serial.end()}});
    if (joint.nv != 1) continue;
    joints.back()["lower"] = packNumber(model.lowerLimits()[joint.idx_v]);
    joints.back()["upper"] = packNumber(model.upperLimits()[joint.idx_v]);
    joints.back()["velocity"] = packNumber(model.velocityLimits()[joint.idx_v]);
  }
  return joints;
}

Json describeContacts(const Model& model) {
  Json contacts = Json::array();
  for (const ContactFrame& contact : model.contacts())
    contacts.push_back({{"name", contact.name},
                        {"body", contact.body},
                        {"pose", packPose(contact.X_BF)},
                        {"surface", contact.kind == ContactKind::Surface6D},
                        {"half_length", contact.half_length},
                        {"half_width", contact.half_width}});
  return contacts;
}

Json describeSprings(const Model& model) {
  Json springs = Json::array();
  for (const PointSpring& spring : model.pointSprings())
    springs.push_back({{"name", spring.name},
                       {"body1", spring.body1},
                       {"point1", packVector(spring.point1)},
                       {"body2", spring.body2},
                       {"point2", packVector(spring.point2)},
                       {"pulls", spring.stiffness != 0 || spring.preload != 0},
                       {"damps", spring.damping != 0}});
  return springs;
}

// Whether a contact is on the ground during a stage.
bool isLoaded(const MotionRecord& record, int stage, int contact) {
  return !record.contact_wrenches.row(stage).segment<6>(6 * contact).isZero(0);
}

// Quantities that follow from the placements, node by node.
struct NodeTables {
  RowMatrixXd placements;  // bodies x 7
  RowMatrixXd tilt;        // roll, pitch, yaw of the first body since the first node, about the axes of the world
  RowMatrixXd feet;        // position (3) of every contact
  RowMatrixXd gaps;        // of every closure: norms of position and angle
  RowMatrixXd energy;      // kinetic, potential with that of the springs, their sum
  Json footprints = Json::array();  // placement of each contact at touchdown
};

NodeTables makeNodeTables(const Model& model, const MotionRecord& record) {
  const int nodes = static_cast<int>(record.time.size()), contacts = static_cast<int>(model.contacts().size());
  NodeTables tables;
  tables.placements.resize(nodes, 7 * model.numBodies());
  tables.tilt.resize(nodes, model.numBodies() > 1 ? 3 : 0);
  tables.feet.resize(nodes, 3 * contacts);
  tables.gaps.resize(nodes, 2 * model.closures().size());
  tables.energy.resize(nodes, 3);
  Workspace ws(model);
  Matrix3d R_start = Matrix3d::Identity();
  for (int k = 0; k < nodes; ++k) {
    updatePositions(model, ws, record.q.row(k).transpose());
    updateVelocities<double>(model, ws, record.v.row(k).transpose());
    const double kinetic = calcKineticEnergy(model, ws), potential = calcPotentialEnergy(model, ws);
    tables.energy.row(k) << kinetic, potential, kinetic + potential;
    for (int i = 0; i < model.numBodies(); ++i) tables.placements.row(k).segment<7>(7 * i) = makePoseRow(ws.X_WB[i]);
    if (k == 0 && model.numBodies() > 1) R_start = ws.X_WB[1].R;
    if (model.numBodies() > 1) tables.tilt.row(k) = calcRollPitchYaw(ws.X_WB[1].R * R_start.transpose()).transpose();
    for (size_t c = 0; c < model.closures().size(); ++c) {
      const ClosureGap gap = calcClosureGap(ws, model.closures()[c]);
      tables.gaps(k, 2 * c) = gap.position;
      tables.gaps(k, 2 * c + 1) = gap.angle;
    }
    for (int c = 0; c < contacts; ++c) {
      const SE3 X_WF = getPlacement(ws, model.contacts()[c].body, model.contacts()[c].X_BF);
      tables.feet.row(k).segment<3>(3 * c) = X_WF.p;
      if (k + 1 < nodes && isLoaded(record, k, c) && (k == 0 || !isLoaded(record, k - 1, c)))
        tables.footprints.push_back({{"contact", c}, {"pose", packPose(X_WF)}, {"time", record.time[k]}});
    }
  }
  return tables;
}

// Centres of pressure in the frames of the contacts, x and y; none for zero force or a point contact.
RowMatrixXd makePressureCentres(const Model& model, const MotionRecord& record) {
  const int contacts = static_cast<int>(model.contacts().size());
  RowMatrixXd centres = RowMatrixXd::Constant(record.u.rows(), 2 * contacts, kNone);
  for (int k = 0; k < record.u.rows(); ++k)
    for (int c = 0; c < contacts; ++c) {
      const auto wrench = record.contact_wrenches.row(k).segment<6>(6 * c);
      if (model.contacts()[c].kind == ContactKind::Point3D || !(wrench[2] > 1e-6)) continue;
      centres(k, 2 * c) = -wrench[4] / wrench[2];
      centres(k, 2 * c + 1) = wrench[3] / wrench[2];
    }
  return centres;
}

// Distance of each linkage from its nearest dead point; between the nodes where it was looked for, that of a straight line.
RowMatrixXd makeDeadPointTable(const std::vector<DeadPointTrace>& linkages, Eigen::Index nodes) {
  RowMatrixXd distances = RowMatrixXd::Constant(nodes, static_cast<Eigen::Index>(linkages.size()), kNone);
  for (size_t i = 0; i < linkages.size(); ++i) {
    const DeadPointTrace& linkage = linkages[i];
    for (size_t n = 0; n < linkage.nodes.size(); ++n) {
      const int last = linkage.nodes[n], first = n > 0 ? linkage.nodes[n - 1] : last;
      const double at_last = linkage.points[n].distance, at_first = n > 0 ? linkage.points[n - 1].distance : at_last;
      for (int k = n > 0 ? first + 1 : last; k <= last; ++k) {
        const double share = last > first ? static_cast<double>(k - first) / (last - first) : 1;
        const double distance = k == last ? at_last : at_first + share * (at_last - at_first);
        if (std::isfinite(distance)) distances(k, static_cast<Eigen::Index>(i)) = distance;
      }
    }
  }
  return distances;
}

}  // namespace

Json describeRobot(const LoadedRobot& robot) {
  const Model& model = robot.model;
  Json motors = Json::array(), closures = Json::array();
  for (const Motor& motor : model.motors())
    motors.push_back({{"name", motor.name},
                      {"joint", motor.joint - 1},
                      {"effort", packNumber(motor.effort_limit)},
                      {"velocity", packNumber(motor.velocity_limit)}});
  for (const Closure& closure : model.closures())
    closures.push_back({{"name", closure.name},
                        {"kind", getName(closure.kind)},
                        {"body", closure.body1},
                        {"pose", packPose(closure.X_B1)},
                        {"body2", closure.body2},
                        {"pose2", packPose(closure.X_B2)}});
  Json json = describeDrawing(robot);
  json.update({{"name", model.name()},
               {"mass", model.mass()},
               {"gravity", model.gravity().norm()},
               {"free", model.hasFreeFlyer()},
               {"joints", describeJoints(model)},
               {"motors", motors},
               {"closures", closures},
               {"springs", describeSprings(model)},
               {"contacts", describeContacts(model)}});
  if (model.numBodies() > 1) json["trunk_com"] = packVector(model.bodies()[1].inertia.com);
  return json;
}

Json describeMotion(const ReportRun& run) {
  const MotionRecord& record = run.record;
  constexpr int kSearches = 60;  // for dead points
  const NodeTables tables = makeNodeTables(run.robot.model, record);
  const std::vector<DeadPointTrace> linkages = traceDeadPoints(run.robot.model, record.q, kSearches);
  Json outputs = Json::array();
  for (const DeadPointTrace& linkage : linkages) outputs.push_back(linkage.output);
  Json json = {{"time", packTable(record.time)},
               {"placements", packTable(tables.placements)},
               {"tilt", packTable(tables.tilt)},
               {"feet", packTable(tables.feet)},
               {"footprints", tables.footprints},
               {"gaps", packTable(tables.gaps)},
               {"energy", packTable(tables.energy)},
               {"linkages", outputs},
               {"dead_points", packTable(makeDeadPointTable(linkages, record.q.rows()))},
               {"q", packTable(record.q)},
               {"v", packTable(record.v)},
               {"u", packTable(record.u)},
               {"closure_wrenches", packTable(record.closure_wrenches)},
               {"contact_wrenches", packTable(record.contact_wrenches)},
               {"pressure", packTable(makePressureCentres(run.robot.model, record))},
               {"com", packTable(record.com)}};
  if (record.footholds.rows() > 0) json["footholds"] = packTable(record.footholds);
  return json;
}

Json describePlan(const ReportRun& run) {
  if (!run.plan) return {};
  const NodeTables tables = makeNodeTables(run.robot.model, *run.plan);
  return {{"time", packTable(run.plan->time)}, {"placements", packTable(tables.placements)},
          {"tilt", packTable(tables.tilt)},    {"feet", packTable(tables.feet)},
          {"q", packTable(run.plan->q)},       {"v", packTable(run.plan->v)},
          {"u", packTable(run.plan->u)},       {"com", packTable(run.plan->com)}};
}

}  // namespace bielle
