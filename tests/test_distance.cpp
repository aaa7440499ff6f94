// Distances between shapes. Oracles: certificates of optimality (points within the shapes give an upper bound, a direction a
// lower one), closed forms, and central differences of fourth order. Every derivative test also notices a poisoned entry.
#include "bielle/dynamics/distance.h"
#include "bielle/dynamics/kept_motion.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "moved_model.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

Shape makeBox(const Vector3d& half, double radius = 0) {
  Shape shape;
  shape.half = half;
  shape.radius = radius;
  return shape;
}

// A sphere, a capsule, a rectangle with round edges, a box or a box with round edges, of some 0.2 m.
Shape makeRandomShape(std::mt19937& rng, int kind) {
  std::uniform_real_distribution<double> size(0.05, 0.2);
  Shape shape = makeBox(Vector3d(kind >= 3 ? size(rng) : 0, kind >= 2 ? size(rng) : 0, kind >= 1 ? size(rng) : 0),
                        kind == 3 ? 0 : size(rng));
  shape.X_BS = randomPlacement(rng);
  return shape;
}
constexpr int kKinds = 5;

SE3 place(const Vector3d& p) { return {Matrix3d::Identity(), p}; }

// How far a shape reaches along a unit direction.
double calcReach(const Shape& shape, const SE3& X_WB, const Vector3d& direction) {
  const SE3 X = X_WB * shape.X_BS;
  return direction.dot(X.p) + (X.R.transpose() * direction).cwiseAbs().dot(shape.half) + shape.radius;
}

// By how much a shape is in front of another along a direction, negative if they overlap.
double calcGapAlong(const Shape& a, const SE3& X_WA, const Shape& b, const SE3& X_WB, const Vector3d& direction) {
  return -calcReach(a, X_WA, -direction) - calcReach(b, X_WB, direction);
}

// Whether a point is on the surface, or in the core of a shape without radius, to 1e-12.
bool isPointOf(const Shape& shape, const SE3& X_WB, const Vector3d& point) {
  const Vector3d p = (X_WB * shape.X_BS).inverse().act(point), beyond = (p.cwiseAbs() - shape.half).cwiseMax(0);
  return beyond.norm() <= shape.radius + 1e-12;
}

}  // namespace

TEST_CASE("distance: of spheres, capsules and boxes, against closed forms") {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ(), none = Vector3d::Zero();
  const auto calc = [](const Shape& a, const SE3& X_A, const Shape& b, const SE3& X_B) {
    const ShapeDistance d = calcDistance(a, X_A, b, X_B);
    CHECK((d.point_a - d.point_b - d.distance * d.normal).norm() < 1e-12);
    CHECK(calcDistance(b, X_B, a, X_A).distance == Approx(d.distance).margin(1e-12));
    return d.distance;
  };
  const Shape cube = makeBox({1, 1, 1}), ball = makeBox(none, 0.5), rod = makeCapsule(0, -x, x, 0.1);
  SE3 turned;  // a cube on its edge
  turned.R = Eigen::AngleAxisd(EIGEN_PI / 4, y).toRotationMatrix();
  CHECK(calc(ball, place(3 * x), ball, place(none)) == Approx(2));
  CHECK(calc(ball, place(0.2 * x), ball, place(none)) == Approx(-0.8));
  CHECK(calc(ball, place(none), ball, place(none)) == Approx(-1));
  CHECK(calc(ball, place(3 * x + 3 * y), cube, place(none)) == Approx(2 * std::sqrt(2) - 0.5));
  CHECK(calc(ball, place(0.7 * x), cube, place(none)) == Approx(-0.8));
  CHECK(calc(cube, place(2.5 * x + 0.3 * y), cube, place(none)) == Approx(0.5));
  CHECK(calc(cube, place(1.5 * x + 0.3 * y), cube, place(none)) == Approx(-0.5));
  CHECK(calc(cube, place(none), cube, place(none)) == Approx(-2));
  CHECK(calc(cube, place(3 * z) * turned, cube, place(none)) == Approx(2 - std::sqrt(2)));
  CHECK(calc(cube, place(2 * z) * turned, cube, place(none)) == Approx(1 - std::sqrt(2)));
  CHECK(calc(rod, place(0.5 * y), rod, place(none)) == Approx(0.3));                       // beside each other
  CHECK(calc(rod, place(3 * x), rod, place(none)) == Approx(0.8));                         // one behind the other
  CHECK(calc(rod, place(0.5 * x), rod, place(none)) == Approx(-0.2));                      // on one line
  CHECK(calc(makeCapsule(0, -y, y, 0.1), place(none), rod, place(none)) == Approx(-0.2));  // across
  CHECK(calc(makeCapsule(0, -y, y, 0.1), place(2 * z), rod, place(none)) == Approx(1.8));
  CHECK(calc(rod, place(1.3 * z), cube, place(none)) == Approx(0.2));
  CHECK(calc(rod, place(0.9 * z), cube, place(none)) == Approx(-0.2));
  CHECK(calc(makeBox(none), place(none), makeBox(none), place(none)) == 0);
}

TEST_CASE("distance: points and a direction prove that it is the least, whatever the shapes") {
  std::mt19937 rng(61);
  int apart = 0, overlapping = 0;
  for (int a_kind = 0; a_kind < kKinds; ++a_kind)
    for (int b_kind = 0; b_kind < kKinds; ++b_kind)
      for (int i = 0; i < 60; ++i) {
        CAPTURE(a_kind, b_kind, i);
        const Shape a = makeRandomShape(rng, a_kind), b = makeRandomShape(rng, b_kind);
        const SE3 X_WA = randomPlacement(rng);
        SE3 X_WB = randomPlacement(rng);
        if (i % 2) X_WB.p += (X_WA * a.X_BS).p + randomVector(rng, 3, 0.1) - (X_WB * b.X_BS).p;  // close to each other
        if (i % 6 == 5) X_WB.R = X_WA.R * a.X_BS.R * b.X_BS.R.transpose();                       // parallel edges
        const ShapeDistance d = calcDistance(a, X_WA, b, X_WB);
        CHECK(std::abs(d.normal.norm() - 1) < 1e-12);
        CHECK((d.point_a - d.point_b - d.distance * d.normal).norm() < 1e-10);
        CHECK(isPointOf(a, X_WA, d.point_a));
        CHECK(isPointOf(b, X_WB, d.point_b));
        // Apart: no points are nearer. Overlapping: a displacement of that size along n parts them.
        CHECK(std::abs(calcGapAlong(a, X_WA, b, X_WB, d.normal) - d.distance) < 1e-10);
        (d.distance > 0 ? apart : overlapping) += 1;
        if (d.distance > 0) continue;
        double least = 1e9;  // of displacements that part them
        for (int j = 0; j < 200; ++j)
          least = std::min(least, -calcGapAlong(a, X_WA, b, X_WB, randomVector(rng, 3).normalized()));
        CHECK(-d.distance <= least + 1e-12);
      }
  CHECK(apart > 300);
  CHECK(overlapping > 300);
}

namespace {

// The mechanism with shapes of all kinds on its bodies, and some in the world.
Model addShapes(std::mt19937& rng, const Model& model) {
  ModelParts parts = takeParts(model);
  for (int i = 0; i < model.numBodies(); ++i) {
    parts.shapes.push_back(makeRandomShape(rng, (i + 1) % kKinds));
    parts.shapes.back().body = i;
  }
  return ModelBuilder::restore(std::move(parts));
}

// Whether a nearest point is well within its face, edge or corner: it does not move to another one nearby.
bool isWithinFeature(const Shape& shape, const SE3& X_WB, const Vector3d& point, const Vector3d& outwards) {
  const SE3 X = X_WB * shape.X_BS;
  const Vector3d p = X.R.transpose() * (point - shape.radius * outwards - X.p), n = X.R.transpose() * outwards;
  for (int k = 0; k < 3; ++k) {
    if (shape.half[k] == 0) continue;
    const double room = shape.half[k] - std::abs(p[k]);  // at an end the distance must change along the edge, m
    if (room > 1e-9 ? room < 5e-3 : std::abs(n[k]) < 0.03) return false;
  }
  return true;
}

// Whether the distance is smooth around here.
bool isSmooth(const Shape& a, const SE3& X_WA, const Shape& b, const SE3& X_WB) {
  const ShapeDistance d = calcDistance(a, X_WA, b, X_WB);
  if (std::abs(d.distance + a.radius + b.radius) < 0.03) return false;
  if (!isWithinFeature(a, X_WA, d.point_a, -d.normal) || !isWithinFeature(b, X_WB, d.point_b, d.normal)) return false;
  for (int k = 0; k < 6; ++k)
    for (double step : {-0.01, 0.01})
      if ((calcDistance(a, X_WA * exp6(Vector6d(step * Vector6d::Unit(k))), b, X_WB).normal - d.normal).norm() > 0.2)
        return false;
  return true;
}

// Some pairs that are not on one body.
std::vector<ShapePair> choosePairs(std::mt19937& rng, const Model& model, const VectorXd& q) {
  Workspace ws(model);
  updatePlacements(model, ws, q);
  std::vector<ShapePair> pairs;
  const int n = static_cast<int>(model.shapes().size());
  for (int i = 0; pairs.size() < 4; ++i) {
    REQUIRE(i < 1000);
    const ShapePair pair{static_cast<int>(rng() % n), static_cast<int>(rng() % n), false};
    const Shape &a = model.shapes()[pair.a], &b = model.shapes()[pair.b];
    if (a.body != b.body && isSmooth(a, ws.X_WB[a.body], b, ws.X_WB[b.body])) pairs.push_back(pair);
  }
  return pairs;
}

VectorXd calcDistances(const Model& model, const std::vector<ShapePair>& pairs, const VectorXd& q) {
  Workspace ws(model);
  updatePlacements(model, ws, q);
  VectorXd out(pairs.size());
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Shape &a = model.shapes()[pairs[i].a], &b = model.shapes()[pairs[i].b];
    out[static_cast<Eigen::Index>(i)] = calcDistance(a, ws.X_WB[a.body], b, ws.X_WB[b.body]).distance;
  }
  return out;
}

// Joints, closures and shapes, each along a direction of its own, and everything at once.
std::vector<ModelVariation> listShapeVariations(std::mt19937& rng, const Model& model,
                                                const std::vector<ShapePair>& pairs) {
  std::vector<ModelVariation> out;
  ModelVariation all(model);
  for (int i = 1; i < model.numBodies(); ++i) {
    out.emplace_back(model);
    all.joints[i] = out.back().joints[i] = randomVector(rng, 6);
  }
  for (size_t c = 0; c < model.closures().size(); ++c) {
    if (model.closures()[c].kind == ClosureKind::Coupler) continue;
    out.emplace_back(model);
    all.frames1[c] = out.back().frames1[c] = randomVector(rng, 6);
    all.frames2[c] = out.back().frames2[c] = randomVector(rng, 6);
  }
  for (const ShapePair& pair : pairs)
    for (int s : {pair.a, pair.b}) {
      const Shape& shape = model.shapes()[s];
      out.emplace_back(model);
      ShapeVariation& change = out.back().shapes[s];
      change.frame = randomVector(rng, 6);
      for (int k = 0; k < 3; ++k) change.half[k] = shape.half[k] > 0 ? randomVector(rng, 1)[0] : 0;
      change.radius = shape.radius > 0 ? randomVector(rng, 1)[0] : 0;
      all.shapes[s] = change;
    }
  out.push_back(all);
  return out;
}

}  // namespace

TEST_CASE("distance: derivatives by the state and by the mechanism, every joint kind times every closure kind",
          "[sweep]") {
  std::mt19937 rng(33);
  Selection selection;
  for (const MechanismKind& kind : listMechanismKinds()) {
    if (selection.isLeftOut()) continue;
    CAPTURE(kind);
    const Mechanism mechanism = makeRandomMechanism(rng, kind.joint, kind.closure, kind.base);
    const Model model = addShapes(rng, mechanism.model);
    const VectorXd& q = mechanism.q_closed;
    const std::vector<ShapePair> pairs = choosePairs(rng, model, q);
    const Eigen::Index n = static_cast<Eigen::Index>(pairs.size());

    Workspace ws(model);
    updatePositions(model, ws, q);
    updateVelocities(model, ws, VectorXd::Zero(model.nv()));
    updateAccelerations(model, ws, VectorXd::Zero(model.nv()));
    std::vector<ShapeDistance> distances;
    MatrixXd gradient = MatrixXd::Zero(n, model.nv());
    for (Eigen::Index i = 0; i < n; ++i) {
      const Shape &a = model.shapes()[pairs[i].a], &b = model.shapes()[pairs[i].b];
      distances.push_back(calcDistance(a, ws.X_WB[a.body], b, ws.X_WB[b.body]));
      addDistanceGradient(model, ws, a, b, distances.back(), gradient.middleRows(i, 1));
    }
    checkDerivative(
        gradient,
        differentiateTangent(model, q, kModelStep, [&](const VectorXd& x) { return calcDistances(model, pairs, x); }),
        "by the tangent of q");

    // Along the closed configurations, by the coordinates that determine them.
    const std::vector<int> kept = chooseKept(model, q);
    const Closing closing(model, ws, makeConstraintSet(model), kept);
    const MatrixXd tangent = closing.calcTangent();
    checkDerivative(gradient * tangent,
                    differentiate(VectorXd::Zero(tangent.cols()), kModelStep,
                                  [&](const VectorXd& t) {
                                    const VectorXd near = model.integrate(q, tangent * t);
                                    VectorXd fixed = closeHeld(model, near, kept);
                                    return calcDistances(model, pairs, model.integrate(near, fixed));
                                  }),
                    "along the loops");

    // By the mechanism, which stays closed.
    const std::vector<ModelVariation> directions = listShapeVariations(rng, model, pairs);
    MatrixXd analytic(n, static_cast<Eigen::Index>(directions.size()));
    VariationWorkspace variation(model);
    for (size_t d = 0; d < directions.size(); ++d) {
      MotionVariation motion(model);
      REQUIRE(closing.calcMotion(model, ws, directions[d], motion) < 1e-9);
      updateVariation(model, ws, directions[d], motion, variation);
      for (Eigen::Index i = 0; i < n; ++i)
        analytic(i, static_cast<Eigen::Index>(d)) =
            calcDistanceVariation(model, ws, pairs[i].a, pairs[i].b, distances[i], directions[d], variation);
    }
    checkDerivative(analytic,
                    differentiateModel(model, directions, kModelStep,
                                       [&](const Model& moved) {
                                         const VectorXd x = moved.integrate(q, closeHeld(moved, q, kept));
                                         return calcDistances(moved, pairs, x);
                                       }),
                    "by the mechanism");
  }
}

TEST_CASE("pairs of shapes: neighbours do not count, legs are told from the trunk") {
  const Model model = loadRobot("bipetto").model;
  const std::vector<ShapePair> pairs = listShapePairs(model);
  const auto name = [&](int shape) { return model.bodies()[model.shapes()[shape].body].name; };
  int of_two_legs = 0;
  for (const ShapePair& pair : pairs) {
    const int a = model.shapes()[pair.a].body, b = model.shapes()[pair.b].body;
    CAPTURE(name(pair.a), name(pair.b));
    CHECK(a != b);
    CHECK(model.joints()[a].parent != b);
    CHECK(model.joints()[b].parent != a);
    for (const Closure& closure : model.closures())
      CHECK_FALSE(((closure.body1 == a && closure.body2 == b) || (closure.body1 == b && closure.body2 == a)));
    const auto has = [&](const char* side) {
      return name(pair.a).find(side) != std::string::npos || name(pair.b).find(side) != std::string::npos;
    };
    CHECK(pair.of_two_legs == (has("left") && has("right")));
    of_two_legs += pair.of_two_legs;
  }
  CHECK(of_two_legs > 20);
  // The nearest of all is no farther than any.
  Workspace ws(model);
  updatePlacements(model, ws, model.makeNeutral());
  const NearestPair nearest = findNearestPair(model, ws.X_WB, pairs);
  CHECK(nearest.distance.distance == calcDistances(model, pairs, model.makeNeutral()).minCoeff());
}
