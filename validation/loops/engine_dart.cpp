// DART: joints of the tree in their coordinates, closures as impulses of its boxed LCP, steps of semi-implicit Euler. A hinge
// that closes a loop is two of its balls, a unit of length apart. Dependent rows are held apart by its force mixing, here the
// least that it takes.
#include <dart/constraint/BallJointConstraint.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/UniversalJoint.hpp>
#include <dart/simulation/World.hpp>

#include "outside_engine.h"

namespace {

using namespace bielle::outside;
using dart::dynamics::BodyNode;

class Dart {
 public:
  explicit Dart(const Mechanism& mechanism) : mechanism_(mechanism), nodes_(1, nullptr) {
    dart::constraint::DynamicJointConstraint::setConstraintForceMixing(1e-9);
    for (size_t i = 1; i < mechanism.bodies.size(); ++i) addBody(mechanism.bodies[i], std::to_string(i));
    world_->setGravity(mechanism.gravity);
    world_->addSkeleton(tree_);
  }

  void start(const VectorXd& q, const VectorXd& v) {
    tree_->setPositions(q);
    tree_->setVelocities(v);
    forces_ = VectorXd::Zero(mechanism_.size);
    world_->getConstraintSolver()->removeAllConstraints();
    for (const Closure& closure : mechanism_.closures) {
      addBall(closure, Vector3d::Zero());
      if (closure.is_hinge) addBall(closure, closure.axis);
    }
  }
  void setForces(const VectorXd& tau) { forces_ = tau; }
  void step(double h) {
    world_->setTimeStep(h);
    tree_->setForces(forces_);
    for (const Spring& spring : mechanism_.springs) {
      BodyNode *node1 = nodes_[spring.body1], *node2 = nodes_[spring.body2];
      const Vector3d force = spring.calcForce(locate(node1, spring.point1), calcVelocity(node1, spring.point1),
                                              locate(node2, spring.point2), calcVelocity(node2, spring.point2));
      if (node1) node1->addExtForce(force, spring.point1, false, true);
      if (node2) node2->addExtForce(-force, spring.point2, false, true);
    }
    world_->step();
  }
  VectorXd q() const { return tree_->getPositions(); }
  VectorXd v() const { return tree_->getVelocities(); }

 private:
  template <typename Joint>
  BodyNode* add(const Body& body, const std::string& name, typename Joint::Properties properties) {
    properties.mName = "joint" + name;
    properties.mT_ParentBodyToJoint = body.X_PJ;
    BodyNode::Properties node;
    node.mName = "body" + name;
    node.mInertia = dart::dynamics::Inertia(body.mass, body.com, body.moments);
    return tree_->createJointAndBodyNodePair<Joint>(nodes_[body.parent], properties, node).second;
  }
  void addBody(const Body& body, const std::string& name) {
    if (body.kind == Kind::Universal) {
      dart::dynamics::UniversalJoint::Properties properties;
      properties.mAxis = {body.axis, body.axis2};
      nodes_.push_back(add<dart::dynamics::UniversalJoint>(body, name, properties));
    } else if (body.kind == Kind::Slide) {
      dart::dynamics::PrismaticJoint::Properties properties;
      properties.mAxis = body.axis;
      nodes_.push_back(add<dart::dynamics::PrismaticJoint>(body, name, properties));
    } else {
      dart::dynamics::RevoluteJoint::Properties properties;
      properties.mAxis = body.axis;
      nodes_.push_back(add<dart::dynamics::RevoluteJoint>(body, name, properties));
    }
  }
  void addBall(const Closure& closure, const Vector3d& along) {
    BodyNode *node1 = nodes_[closure.body1], *node2 = nodes_[closure.body2];
    const Vector3d at = locate(node1, closure.point1 + along);
    using Ball = dart::constraint::BallJointConstraint;
    world_->getConstraintSolver()->addConstraint(node1 && node2 ? std::make_shared<Ball>(node1, node2, at)
                                                                : std::make_shared<Ball>(node1 ? node1 : node2, at));
  }
  static Vector3d locate(const BodyNode* node, const Vector3d& point) {
    return node ? node->getWorldTransform() * point : point;
  }
  static Vector3d calcVelocity(const BodyNode* node, const Vector3d& point) {
    return node ? node->getLinearVelocity(point) : Vector3d(Vector3d::Zero());
  }

  const Mechanism mechanism_;
  dart::simulation::WorldPtr world_ = dart::simulation::World::create();
  dart::dynamics::SkeletonPtr tree_ = dart::dynamics::Skeleton::create("mechanism");
  std::vector<BodyNode*> nodes_;  // per body; the world is none
  VectorXd forces_;
};

}  // namespace

int main() { return serve<Dart>(); }
