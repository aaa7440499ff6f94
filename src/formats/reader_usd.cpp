#include "formats/reader_usd.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/model/error.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr size_t kMostUsdParts = 3000;  // bodies, joints
constexpr const char* kFlatten = "let `usdcat FILE -o flat.usda --flatten` write one file with all in it";

// Prims that say nothing of a mechanism, and all that is in them.
bool isScenery(std::string_view type) {
  static const std::set<std::string_view> types = {
      "Material",    "Shader",     "NodeGraph", "Camera",        "DistantLight",   "DomeLight",
      "SphereLight", "DiskLight",  "RectLight", "CylinderLight", "RenderSettings", "RenderProduct",
      "RenderVar",   "GeomSubset", "OmniGraph", "OmniGraphNode", "OmniLPE",        "PhysicsCollisionGroup",
      "ComputeGraph"};
  return types.count(type) > 0;
}

// Properties of bodies, joints and shapes that change nothing here.
bool isHarmless(std::string_view name) {
  static const std::set<std::string_view> names = {"purpose",
                                                   "visibility",
                                                   "extent",
                                                   "proxyPrim",
                                                   "doubleSided",
                                                   "orientation",
                                                   "subdivisionScheme",
                                                   "kind",
                                                   "physics:collisionEnabled",
                                                   "physics:startsAsleep",
                                                   "physics:velocity",
                                                   "physics:linearVelocity",
                                                   "physics:angularVelocity",
                                                   "physics:simulationOwner",
                                                   "physics:filteredPairs",
                                                   "physics:approximation",
                                                   "physics:engine",
                                                   "extentsHint"};
  if (names.count(name)) return true;
  for (const std::string_view prefix : {"primvars:",
                                        "material:",
                                        "ui:",
                                        "omni:",
                                        "semantic",
                                        "state:",
                                        "physxRigidBody:",
                                        "physxCollision:",
                                        "physxConvexHullCollision:",
                                        "physxArticulation:",
                                        "physxScene:",
                                        "physxSDFMeshCollision:",
                                        "collection:",
                                        "physics:tensor:",
                                        "physics:newton:",
                                        "newton:kamino:",
                                        "mjc:option:",
                                        "mjc:flag:",
                                        "mjc:sol",
                                        "mjc:con",
                                        "mjc:group",
                                        "mjc:compiler:",
                                        "userProperties:",
                                        "inputs:",
                                        "outputs:",
                                        "isaac:",
                                        "newton:contact",
                                        "physxConvexDecompositionCollision:",
                                        "mjc:priority",
                                        "mjc:margin",
                                        "mjc:gap",
                                        "mjc:torsional",
                                        "mjc:rolling",
                                        "mjc:slidingfriction",
                                        "newton:maxHullVertices",
                                        "mjc:maxhullvert",
                                        "newton:selfCollisionEnabled",
                                        "newton:jointsAddMobility",
                                        "newton:timeSteps",
                                        "newton:maxSolver",
                                        "mjc:shellinertia",
                                        "newton:massModel",
                                        "newton:shellThickness"})
    if (name.substr(0, prefix.size()) == prefix) return true;
  return false;
}

// Schemas that are read, or of what changes nothing here: all others are told.
bool isKnownApi(std::string_view name) {
  for (const std::string_view prefix : {"PhysicsRigidBodyAPI",
                                        "PhysicsMassAPI",
                                        "PhysicsCollisionAPI",
                                        "PhysicsMeshCollisionAPI",
                                        "PhysicsDriveAPI:",
                                        "PhysicsLimitAPI:",
                                        "PhysicsArticulationRootAPI",
                                        "PhysicsMaterialAPI",
                                        "PhysicsFilteredPairsAPI",
                                        "PhysicsJointStateAPI:",
                                        "PhysxRigidBodyAPI",
                                        "PhysxCollisionAPI",
                                        "PhysxJointAPI",
                                        "PhysxArticulationAPI",
                                        "PhysxSceneAPI",
                                        "PhysxLimitAPI:",
                                        "PhysxMaterialAPI",
                                        "PhysxConvex",
                                        "PhysxTriangleMesh",
                                        "PhysxSDFMesh",
                                        "PhysxMimicJointAPI:",
                                        "MaterialBindingAPI",
                                        "GeomModelAPI",
                                        "CollectionAPI",
                                        "Semantics",
                                        "Mjc",
                                        "Newton",
                                        "IsaacLinkAPI",
                                        "IsaacJointAPI",
                                        "IsaacRobotAPI",
                                        "IsaacSiteAPI",
                                        "VisibilityAPI",
                                        "PhysxContactReportAPI",
                                        "ShapingAPI",
                                        "OmniSensorAPI"})
    if (name.substr(0, prefix.size()) == prefix) return true;
  return false;
}

}  // namespace

UsdReader::UsdReader(const std::string& path) : path_(path), bodies_(1) {
  tree_.path = yaml_.path = path;
  tree_.root = "world";
  tree_.links["world"].name = "world";
  tree_.has_own_base = true;
  bodies_[0].name = "world";
}

RobotFiles UsdReader::read() {
  load();
  readLayer();
  UsdTransform M = UsdTransform::Identity();
  M.diagonal().head<3>().setConstant(meter_);
  const std::string up = [&] {
    const UsdProperty* axis = layer_->root.findMetadata("upAxis");
    const std::vector<std::string> texts = axis ? listUsdStrings(axis->value) : std::vector<std::string>();
    return texts.empty() ? "Y" : texts[0];
  }();
  if (up != "Z" && up != "Y") throw InputError(path_, "upAxis", "it is '" + up + "'", "make it \"Y\" or \"Z\"");
  if (up == "Y")
    M.topLeftCorner<3, 3>() = meter_ * makeAxisRotation(Vector3d::UnitX(), kPi / 2).array().round().matrix();
  bodies_[0].M = places_[nullptr] = M;
  for (const auto& prim : layer_->root.children) collect(*prim, M, UsdTransform::Identity(), 0);
  if (bodies_.size() == 1)
    throw InputError(
        path_, "document", "it has no rigid body (PhysicsRigidBodyAPI)",
        "give a file with the physics of a robot; files that refer to others are read once `usdcat FILE -o "
        "flat.usda --flatten` has made them one");
  if (bodies_.size() > kMostUsdParts || joint_prims_.size() > kMostUsdParts)
    throw InputError(path_, "document", "it has more than 3000 bodies or joints", "no robot needs so many");
  for (const UsdPrim* prim : scenes_) readScene(*prim);
  for (const UsdPrim* prim : joint_prims_) readJoint(*prim);
  for (const UsdPrim* prim : actuators_) readActuator(*prim);
  chainJoints();
  chooseCarriers();
  addTree();
  for (const UsdJoint& joint : joints_) readMimic(joint);
  addStart();
  for (const auto& prim : layer_->root.children) noteUnused(*prim);
  notes_.addTo(tree_);
  tree_.rounding = {angles_.calcHalfUnit(), lengths_.calcHalfUnit(), false, {}};
  return {std::move(tree_), std::move(yaml_)};
}

void UsdReader::load() {
  std::string text = readRobotText(path_);
  if (text.rfind("PXR-USDC", 0) == 0)
    throw InputError(path_, "file", "it is USD in binary form",
                     "let `usdcat FILE -o flat.usda --flatten` write it as text");
  if (text.rfind("PK", 0) == 0)
    throw InputError(path_, "file", "it is USD in a package (.usdz)",
                     "let `usdcat FILE -o flat.usda --flatten` write it as text");
  if (text.rfind("#usda", 0) != 0)
    throw InputError(path_, "line 1", "it does not begin with '#usda 1.0'", "give a file of USD in text form");
  layer_ = parseUsda(std::move(text), path_);
}

// Units, and what would bring in other files.
void UsdReader::readLayer() {
  const UsdPrim& root = layer_->root;
  const auto get = [&](const char* key, double otherwise) {
    const UsdProperty* entry = root.findMetadata(key);
    if (!entry) return otherwise;
    const auto numbers = parseUsdNumbers(entry->value);
    if (!numbers || numbers->size() != 1 || !std::isfinite((*numbers)[0]) || !((*numbers)[0] > 0))
      throw InputError(path_, std::string(key) + " (line " + std::to_string(entry->line) + ")",
                       "it is not a positive number", "correct it");
    return (*numbers)[0];
  };
  meter_ = get("metersPerUnit", 0.01);
  kilogram_ = get("kilogramsPerUnit", 1);
  if (!root.findMetadata("metersPerUnit"))
    tree_.warnings.push_back(
        path_ + ": metersPerUnit: it is missing, so lengths are in centimetres, by the specification of USD");
  if (const UsdProperty* layers = root.findMetadata("subLayers");
      layers && layers->value.find('@') != std::string::npos)
    throw InputError(path_, "subLayers (line " + std::to_string(layers->line) + ")", "other files are parts of it",
                     kFlatten);
  tree_.name = std::filesystem::path(path_).stem().string();
  if (const UsdProperty* prim = root.findMetadata("defaultPrim"))
    if (const std::vector<std::string> names = listUsdStrings(prim->value); !names.empty() && !names[0].empty())
      tree_.name = names[0];
}

void UsdReader::note(int line, const std::string& element, const std::string& problem) {
  notes_.add(path_, element, line, problem);
}

// Whether a prim takes no part, with all that is in it. \throws InputError for what would bring in other prims
bool UsdReader::isOmitted(const UsdPrim& prim) {
  const UsdProperty* active = prim.findMetadata("active");
  if (prim.specifier != "def" || (active && parseUsdBool(active->value) == false)) {
    note(prim.line, prim.specifier == "def" ? "prim that is not active" : std::string(prim.specifier));
    return true;
  }
  if (isScenery(prim.type)) return true;
  for (const UsdProperty& entry : prim.metadata)
    if (contains(listUsdArcs(), entry.name) && entry.value.find('@') != std::string::npos &&
        entry.operation != "delete")
      failUsd(path_, prim, entry, "would bring in prims of another file", kFlatten);
  if (prim.variants) failUsd(path_, prim, "it has variants (line " + std::to_string(prim.variants) + ")", kFlatten);
  return false;
}

std::string UsdReader::makeName(const UsdPrim& prim, std::set<std::string>& taken) {
  std::string name(prim.name);
  // What others show in place of the name: there, that of a robot whose names USD does not allow.
  for (const std::string& shown : prim.listMetadata("displayName"))
    if (!shown.empty() && name.rfind(makeUsdName(shown), 0) == 0 && shown != makeUsdName(shown)) name = shown;
  for (const UsdPrim* above = prim.parent; above && !above->name.empty() && taken.count(name); above = above->parent)
    name = std::string(above->name) + "_" + name;
  name = makeUnusedName(name, [&taken](const std::string& made) { return taken.count(made) > 0; });
  taken.insert(name);
  return name;
}

int UsdReader::addBody(const UsdPrim& prim, const UsdTransform& M) {
  UsdBody body;
  body.prim = &prim;
  body.name = makeName(prim, link_names_);
  body.M = M;
  body.X_WS = calcUsdPlace(path_, prim, M);
  body.is_kinematic = getFlag(prim, "physics:kinematicEnabled", false);
  if (body.is_kinematic)
    note(prim.line, "kinematic body", "nothing moves it here: it stands in the world where the file has it");
  bodies_.push_back(std::move(body));
  return static_cast<int>(bodies_.size()) - 1;
}

// Bodies, joints and shapes, depth first. \param M  of its parent   \param B  likewise, to the body   \param body  that it is part of
void UsdReader::collect(const UsdPrim& prim, UsdTransform M, UsdTransform B, int body) {
  if (isOmitted(prim)) return;
  bool resets = false;
  const UsdTransform own = calcUsdTransform(path_, prim, resets);
  M = resets ? UsdTransform(bodies_[0].M * own) : UsdTransform(M * own);
  B = resets ? UsdTransform(bodies_[static_cast<size_t>(body)].M.inverse() * M) : UsdTransform(B * own);
  if (!M.allFinite()) failUsd(path_, prim, "its place is not finite", "give smaller numbers");
  if (prim.hasApi("PhysicsRigidBodyAPI") && getFlag(prim, "physics:rigidBodyEnabled", true)) {
    body = addBody(prim, M);
    B.setIdentity();
  }
  body_of_[&prim] = body;
  places_[&prim] = M;
  const std::string_view type = prim.type;
  if (type.find("Joint") != std::string_view::npos)
    joint_prims_.push_back(&prim);
  else if (type == "PhysicsScene")
    scenes_.push_back(&prim);
  else if (type == "MjcActuator" || type == "NewtonActuator")
    actuators_.push_back(&prim);
  else if (!type.empty() && type != "Xform" && type != "Scope" && type != "SkelRoot")
    readShape(prim, M, B, body);
  if ((prim.hasApi("NewtonSiteAPI") || prim.hasApi("MjcSiteAPI") || prim.hasApi("IsaacSiteAPI")) &&
      body_of_[&prim] > 0) {
    const SE3 X_WF = calcUsdPlace(path_, prim, M);
    sites_.push_back({makeName(prim, link_names_), body, calcPlaceInBody(X_WF, B, body)});
  }
  for (const auto& child : prim.children) collect(*child, M, B, body);
}

void UsdReader::readScene(const UsdPrim& prim) {
  if (yaml_.gravity) return note(prim.line, "second PhysicsScene");
  constexpr double kEarth = 9.81;
  const double magnitude = getNumber(prim, "physics:gravityMagnitude", -HUGE_VAL, true);
  const Vector3d direction = getUsdVector(path_, prim, "physics:gravityDirection", Vector3d::Zero());
  const Matrix3d R = bodies_[0].M.topLeftCorner<3, 3>() / meter_;
  const double norm = direction.stableNorm();
  const Vector3d way = norm > 0 ? Vector3d(R * (direction / norm)) : Vector3d(0, 0, -1);
  const double g = magnitude >= 0 ? magnitude * meter_ : kEarth;
  if (!std::isfinite(g)) failUsd(path_, prim, "its gravity is not finite", "correct physics:gravityMagnitude");
  yaml_.gravity = g * way;
}

double UsdReader::getNumber(const UsdPrim& prim, std::string_view property, double otherwise,
                            bool may_be_infinite) const {
  return getUsdNumber(path_, prim, property, otherwise, may_be_infinite);
}

bool UsdReader::getFlag(const UsdPrim& prim, std::string_view property, bool otherwise) const {
  const UsdProperty* found = prim.find(property);
  if (!found) return otherwise;
  const std::optional<bool> flag = parseUsdBool(found->value);
  if (!flag) failUsd(path_, prim, *found, "is neither 0 nor 1", "correct it");
  return *flag;
}

const UsdPrim* UsdReader::resolve(const UsdPrim& prim, const UsdProperty& relation, const std::string& path) const {
  std::string place = path;
  for (const UsdPrim* above = &prim; above && place == path; above = above->parent)
    for (const auto& [source, own] : above->sources)
      if (path.rfind(source, 0) == 0 && (path.size() == source.size() || path[source.size()] == '/'))
        place = own + path.substr(source.size());
  const UsdPrim* at = findUsdPrim(prim, place);
  if (!at) failUsd(path_, prim, relation, "leads to no prim: <" + path + ">", "correct the path");
  return at == &layer_->root ? nullptr : at;
}

const UsdPrim* UsdReader::findTarget(const UsdPrim& prim, std::string_view relation) const {
  const UsdProperty* found = prim.find(relation);
  const std::vector<std::string> paths = found ? listUsdStrings(found->value, '<') : std::vector<std::string>();
  if (paths.empty()) return nullptr;
  if (paths.size() > 1) failUsd(path_, prim, *found, "has several targets", "give one");
  return resolve(prim, *found, paths[0]);
}

// What nobody asked for, by its line.
void UsdReader::noteUnused(const UsdPrim& prim) {
  if (!places_.count(&prim)) return;
  const std::string type = prim.type.empty() ? "prim" : std::string(prim.type);
  for (const std::string& schema : prim.listMetadata("apiSchemas"))
    if (!isKnownApi(schema)) note(prim.line, "schema " + schema);
  for (const UsdProperty& property : prim.properties) {
    if (property.is_used || isHarmless(property.name)) continue;
    if (body_of_.at(&prim) == 0 && type.find("Joint") == std::string::npos) continue;
    note(property.line, type + " " + std::string(property.name));
  }
  for (const auto& child : prim.children) noteUnused(*child);
}

RobotFiles readUsd(const std::string& path) { return UsdReader(path).read(); }

}  // namespace bielle
