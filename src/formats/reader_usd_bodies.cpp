// Mass, shapes and frames of the bodies in files of USD.
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "formats/exact_moments.h"
#include "formats/mesh_inertia.h"
#include "formats/reader_usd.h"
#include "math/constants.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr double kUsualDensity = 1000;  // kg/m^3, of UsdPhysics
constexpr const char* kGiveMass = "give physics:mass and physics:diagonalInertia";

// That takes z to the axis of a cylinder or capsule.
Matrix3d makeAxisOf(const std::string& axis) {
  if (axis == "X") return makeAxisRotation(Vector3d::UnitY(), kPi / 2).array().round();
  if (axis == "Y") return makeAxisRotation(Vector3d::UnitX(), -kPi / 2).array().round();
  return Matrix3d::Identity();
}

bool isCapsule(const UsdPrim& prim) { return prim.type == "Capsule"; }

// Volume and moments per mass, in its own frame.
Inertia calcSolid(const UsdPrim& prim, const Visual& visual) {
  const Vector3d& size = visual.size;
  if (visual.shape == Visual::Shape::Box) return *calcPrimitiveInertia("box", size / 2);
  if (visual.shape == Visual::Shape::Sphere) return *calcPrimitiveInertia("sphere", size);
  return *calcPrimitiveInertia(isCapsule(prim) ? "capsule" : "cylinder", {size[0], size[1] / 2, 0});
}

}  // namespace

void UsdReader::addLink(const UsdBody& body) {
  UrdfLink& link = tree_.links[body.name];
  link.name = body.name;
  if (!body.prim) return;
  const SE3 X_LS = body.X_SL.inverse();
  link.inertia = readInertia(body).transformed(X_LS);
  link.visuals = body.visuals;
  for (Visual& visual : link.visuals) visual.X_BV = X_LS * visual.X_BV;
  link.shapes = body.shapes;
  for (Shape& shape : link.shapes) shape.X_BS = X_LS * shape.X_BS;
}

Inertia UsdReader::readInertia(const UsdBody& body) {
  const UsdPrim& prim = *body.prim;
  const double mass = kilogram_ * getNumber(prim, "physics:mass", 0);
  const double density = findDensity(prim);
  const Vector3d moments =
      kilogram_ * meter_ * meter_ * getUsdVector(path_, prim, "physics:diagonalInertia", Vector3d::Zero());
  const std::vector<double> com =
      getUsdNumbers(path_, prim, "physics:centerOfMass", {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, true);
  const Matrix3d R = getUsdRotation(path_, prim, "physics:principalAxes");
  const bool has_com = std::all_of(com.begin(), com.end(), [](double x) { return std::isfinite(x); });
  if (!(mass >= 0) || !(moments.array() >= 0).all())
    failUsd(path_, prim, "its mass or a moment of inertia is negative", "give 0 or more");
  Inertia out;
  const bool has_shapes = std::any_of(body.solids.begin(), body.solids.end(), [](auto& s) { return s.is_known; });
  if (mass > 0 && !moments.isZero(0)) {
    out.mass = mass;
    if (!has_com && has_shapes) out.com = computeInertia(body, mass, density).com;
    if (!has_com && !has_shapes && !body.solids.empty())
      note(prim.line, "body without physics:centerOfMass",
           "it would be computed from its shapes, which are not read: it is in the origin of the body");
  } else {
    out = computeInertia(body, mass, density);
    if (out.mass == 0)
      note(prim.line, "body", "it has neither mass nor shapes, and is without mass here; PhysX gives such a body 1 kg");
  }
  if (!moments.isZero(0)) out.I_com = R * moments.asDiagonal() * R.transpose();
  if (prim.find(kUsdInertia) &&
      !takeExactMoments(
          kilogram_ * meter_ * meter_ * makeMoments(getUsdNumbers(path_, prim, kUsdInertia, std::vector<double>(6))),
          out.I_com))
    note(prim.line, kUsdInertia, "left out: the body has other moments of inertia");
  if (has_com) out.com = calcUsdScale(body.M).cwiseProduct(Vector3d(com[0], com[1], com[2]));
  return out;
}

// From its shapes. \param mass  of the body, kg; 0: by density
Inertia UsdReader::computeInertia(const UsdBody& body, double mass, double density) const {
  Inertia sum;
  for (const UsdSolid& solid : body.solids) {
    if (!solid.is_known)
      failUsd(path_, *solid.prim,
              "the mass of body '" + body.name + "' is to be computed from it, a " + std::string(solid.prim->type),
              kGiveMass);
    Inertia own = solid.inertia;
    const double volume = own.mass;
    if (!(volume > 0)) continue;
    const double its_density = solid.density > 0 ? solid.density : density > 0 ? density : kUsualDensity;
    own.mass = solid.mass > 0 ? solid.mass : its_density * volume;
    own.I_com *= own.mass / volume;
    sum = sum + own;
  }
  if (mass > 0 && !(sum.mass > 0))
    failUsd(path_, *body.prim, "it has a mass, but no moments of inertia and no shapes to compute them from",
            kGiveMass);
  if (mass > 0) sum.I_com *= mass / sum.mass, sum.mass = mass;
  return sum;
}

// Of the prim itself, else of the material that is bound to it, kg/m^3; 0: not given.
double UsdReader::findDensity(const UsdPrim& prim) const {
  double density = getNumber(prim, "physics:density", 0);
  for (const char* binding : {"material:binding:physics", "material:binding"}) {
    if (density > 0) break;
    const UsdProperty* found = prim.find(binding);
    const std::vector<std::string> paths = found ? listUsdStrings(found->value, '<') : std::vector<std::string>();
    const UsdPrim* material = nullptr;
    try {
      if (paths.size() == 1) material = resolve(prim, *found, paths[0]);
    } catch (const InputError&) {  // a colour that is not there
    }
    if (material) density = getNumber(*material, "physics:density", 0);
  }
  if (!(density >= 0)) failUsd(path_, prim, "its density is negative", "give 0 or more");
  return density * kilogram_ / (meter_ * meter_ * meter_);
}

// Null for what has no shape here. \param X_GV  its frame there: cylinders are along z of ours
std::optional<Visual> UsdReader::readGeometry(const UsdPrim& prim, const Vector3d& scale, SE3& X_GV) {
  Visual out;
  if (prim.type == "Cube") {
    out.shape = Visual::Shape::Box;
    out.size = getNumber(prim, "size", 2) * scale;
  } else if (prim.type == "Sphere") {
    out.shape = Visual::Shape::Sphere;
    if ((scale.array() - scale[0]).abs().maxCoeff() > 1e-6 * scale[0]) {
      note(prim.line, "Sphere", "it is left out: its scale makes it an ellipsoid");
      return {};
    }
    out.size = {getNumber(prim, "radius", 1) * scale[0], 0, 0};
  } else if (prim.type == "Cylinder" || isCapsule(prim)) {
    out.shape = Visual::Shape::Cylinder;
    std::string axis = getUsdText(prim, "axis");
    if (axis != "X" && axis != "Y") axis = "Z";
    const int along = axis[0] - 'X', first = along == 0 ? 1 : 0, second = along == 2 ? 1 : 2;
    if (std::abs(scale[first] - scale[second]) > 1e-6 * scale[first]) {
      note(prim.line, std::string(prim.type), "it is left out: its scale makes it another shape");
      return {};
    }
    X_GV.R = makeAxisOf(axis);
    out.size = {getNumber(prim, "radius", isCapsule(prim) ? 0.5 : 1) * scale[first],
                getNumber(prim, "height", isCapsule(prim) ? 1 : 2) * scale[along], 0};
  } else {
    for (const UsdProperty& property : prim.properties) property.is_used = true;
    note(prim.line, std::string(prim.type),
         "it is left out: only cubes, spheres, cylinders and capsules have shapes here");
    return {};
  }
  if (!(out.size.array() >= 0).all()) failUsd(path_, prim, "its size is negative", "give a positive one");
  return out;
}

// By the numbers below the body alone, where it is not scaled: what goes through the world comes back rounded.
SE3 UsdReader::calcPlaceInBody(const SE3& X_WG, const UsdTransform& B, int body) const {
  const UsdBody& owner = bodies_[static_cast<size_t>(body)];
  const std::optional<SE3> X = findUsdPlace(B);
  return X && calcUsdScale(owner.M) == Vector3d::Ones() ? *X : owner.X_WS.inverse() * X_WG;
}

// What a body draws and lets collide; that of the ground is left out.
void UsdReader::readShape(const UsdPrim& prim, const UsdTransform& M, const UsdTransform& B, int index) {
  if (index == 0) return;
  if (prim.hasApi("NewtonSiteAPI") || prim.hasApi("MjcSiteAPI")) {  // how large it is drawn
    for (const UsdProperty& property : prim.properties) property.is_used = true;
    return;
  }
  UsdBody& body = bodies_[static_cast<size_t>(index)];
  const bool collides = prim.hasApi("PhysicsCollisionAPI") && getFlag(prim, "physics:collisionEnabled", true);
  const bool is_drawn = getUsdText(prim, "purpose") != "guide" && getUsdText(prim, "visibility") != "invisible";
  SE3 X_GV;
  const std::optional<SE3> X_WG = findUsdPlace(M);
  if (!X_WG) note(prim.line, std::string(prim.type), "it is left out: its transform mirrors, shears or flattens it");
  // Its own scale, where nothing above it scales: that of the matrix is rounded.
  Vector3d scale = calcUsdScale(M);
  if (const Vector3d own = getUsdVector(path_, prim, "xformOp:scale", scale); own.isApprox(scale, 1e-14)) scale = own;
  std::optional<Visual> visual = X_WG ? readGeometry(prim, scale, X_GV) : std::nullopt;
  UsdSolid solid;
  solid.prim = &prim;
  solid.density = findDensity(prim);
  solid.mass = kilogram_ * getNumber(prim, "physics:mass", 0);
  if (visual) {
    visual->X_BV = calcPlaceInBody(*X_WG, B, index) * X_GV;
    const Inertia own = calcSolid(prim, *visual);
    solid.inertia = Inertia{own.mass, Vector3d::Zero(), own.mass * own.I_com}.transformed(visual->X_BV);
    solid.is_known = true;
  }
  if (collides) body.solids.push_back(solid);
  if (!visual) return;
  if (const UsdProperty* color = prim.find("primvars:displayColor"))
    if (const auto rgb = parseUsdNumbers(color->value); rgb && rgb->size() == 3)
      visual->rgba.head<3>() = Vector3d((*rgb)[0], (*rgb)[1], (*rgb)[2]).cwiseMax(0).cwiseMin(1);
  if (const UsdProperty* opacity = prim.find("primvars:displayOpacity"))
    if (const auto alpha = parseUsdNumbers(opacity->value); alpha && alpha->size() == 1)
      visual->rgba[3] = std::clamp((*alpha)[0], 0.0, 1.0);
  if (!visual->rgba.allFinite()) visual->rgba = Visual().rgba;
  if (is_drawn) body.visuals.push_back(*visual);
  std::optional<Shape> shape = collides ? fitShape(*visual) : std::nullopt;
  if (!shape) return;
  if (isCapsule(prim)) {
    shape->half = {0, 0, visual->size[1] / 2};
    shape->radius = visual->size[0];
  }
  shape->fitted = false;
  body.shapes.push_back(*shape);
}

void UsdReader::addFrame(const std::string& name, const std::string& link, const SE3& X_LF) {
  UrdfJoint joint;
  joint.parent = link;
  joint.child = name;
  joint.joint.name = makeUnusedName(name + "_frame", [this](const auto& made) { return joint_names_.count(made) > 0; });
  joint_names_.insert(joint.joint.name);
  joint.joint.kind = JointKind::Fixed;
  joint.joint.X_PJ = X_LF;
  tree_.links[name].name = name;
  tree_.joints.push_back(joint);
}

}  // namespace bielle
