// The mechanism of a problem as data.
#include "dynamics/reduction.h"
#include "results/problem_file.h"
#include "results/problem_values.h"

namespace bielle {
namespace {

Json describeJoint(const Joint& joint) {
  Json json = {{"name", joint.name}, {"kind", getName(joint.kind)}, {"parent", joint.parent}};
  addPlacement(json, "_PJ", joint.X_PJ);
  if (joint.kind != JointKind::Spherical && joint.kind != JointKind::FreeFlyer) json["axis"] = listVector(joint.axis);
  if (joint.kind == JointKind::Universal) json["axis2"] = listVector(joint.axis2);
  json["first_q"] = joint.idx_q;
  json["first_v"] = joint.idx_v;
  return json;
}

Json describeClosure(const Closure& closure) {
  Json json = {{"name", closure.name}, {"kind", getName(closure.kind)}};
  if (closure.kind == ClosureKind::Coupler) {
    json["terms"] = Json::array();
    for (const CouplerTerm& term : closure.terms) {
      json["terms"].push_back({{"dof", term.dof}, {"q", term.idx_q}, {"coefficient", term.coefficient}});
      if (!term.isLinear()) json["terms"].back()["higher"] = term.higher;
    }
    json["offset"] = closure.offset;
    return json;
  }
  json["body1"] = closure.body1;
  addPlacement(json, "_B1", closure.X_B1);
  json["body2"] = closure.body2;
  addPlacement(json, "_B2", closure.X_B2);
  if (hasAxis(closure.kind)) json["axis"] = listVector(closure.axis);
  if (closure.kind == ClosureKind::Distance) json["length"] = closure.length;
  return json;
}

Json describeSprings(const Model& model) {
  Json springs = Json::array();
  for (const PointSpring& spring : model.pointSprings())
    springs.push_back({{"name", spring.name},
                       {"body1", spring.body1},
                       {"point1", listVector(spring.point1)},
                       {"body2", spring.body2},
                       {"point2", listVector(spring.point2)},
                       {"stiffness", spring.stiffness},
                       {"rest", spring.rest},
                       {"preload", spring.preload},
                       {"damping", spring.damping}});
  return springs;
}

Json describeForces(const Model& model) {
  Json forces = Json::array();
  for (const JointForce& force : model.jointForces())
    forces.push_back({{"q", force.idx_q},
                      {"dof", force.dof},
                      {"stiffness", force.stiffness},
                      {"rest", force.rest},
                      {"preload", force.preload},
                      {"damping", force.damping},
                      {"friction", force.friction},
                      {"friction_speed", force.friction_speed}});
  return forces;
}

Json describeContacts(const Model& model) {
  Json contacts = Json::array();
  for (const ContactFrame& contact : model.contacts()) {
    Json json = {{"name", contact.name}, {"kind", getName(contact.kind)}, {"body", contact.body}};
    addPlacement(json, "_BF", contact.X_BF);
    json["half_length"] = contact.half_length;
    json["half_width"] = contact.half_width;
    contacts.push_back(json);
  }
  return contacts;
}

// Diagonal of the metric in which loops are closed; 1 outside loops.
VectorXd makeMetric(const Model& model, ConstVectorRef q) {
  VectorXd metric = VectorXd::Ones(model.nv());
  if (model.closures().empty()) return metric;
  for (const ReducedCluster& cluster : makeReduction(model, q).clusters)
    for (size_t i = 0; i < cluster.dofs.size(); ++i)
      metric[cluster.dofs[i]] = cluster.metric[static_cast<Eigen::Index>(i)];
  return metric;
}

}  // namespace

Json describeMechanism(const Model& model, ConstVectorRef q) {
  Json json = {{"nq", model.nq()}, {"nv", model.nv()}, {"gravity", listVector(model.gravity())}};
  json["bodies"] = Json::array();
  for (const Body& body : model.bodies())
    json["bodies"].push_back({{"name", body.name},
                              {"mass", body.inertia.mass},
                              {"com", listVector(body.inertia.com)},
                              {"inertia", listMatrix(body.inertia.I_com)}});
  json["joints"] = Json::array();
  for (size_t i = 1; i < model.joints().size(); ++i) json["joints"].push_back(describeJoint(model.joints()[i]));
  json["armature"] = listVector(model.armature());
  json["closures"] = Json::array();
  for (const Closure& closure : model.closures()) json["closures"].push_back(describeClosure(closure));
  json["metric"] = listVector(makeMetric(model, q));
  json["motors"] = Json::array();
  for (const Motor& motor : model.motors()) json["motors"].push_back({{"name", motor.name}, {"dof", motor.dof}});
  json["joint_forces"] = describeForces(model);
  json["point_springs"] = describeSprings(model);
  json["contacts"] = describeContacts(model);
  return json;
}

}  // namespace bielle
