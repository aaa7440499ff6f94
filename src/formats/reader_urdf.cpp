// The only file that uses urdfdom. The document itself first provides what urdfdom discards or accepts:
// the order of the joints, links with two parents, detached cycles, the place of a bad number.
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <filesystem>
#include <locale>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "formats/decimals.h"
#include "formats/log_capture.h"
#include "formats/mesh.h"
#include "formats/reader_dialects.h"
#include "formats/reader_drake.h"
#include "formats/robot_files.h"
#include "formats/xml_document.h"

namespace bielle {
namespace {

struct NumberRule {
  const char *tag, *attribute;
  int count;
};
constexpr NumberRule kNumbers[] = {
    {"origin", "xyz", 3},   {"origin", "rpy", 3},      {"axis", "xyz", 3},         {"mass", "value", 1},
    {"inertia", "ixx", 1},  {"inertia", "ixy", 1},     {"inertia", "ixz", 1},      {"inertia", "iyy", 1},
    {"inertia", "iyz", 1},  {"inertia", "izz", 1},     {"limit", "lower", 1},      {"limit", "upper", 1},
    {"limit", "effort", 1}, {"limit", "velocity", 1},  {"dynamics", "damping", 1}, {"dynamics", "friction", 1},
    {"box", "size", 3},     {"cylinder", "radius", 1}, {"cylinder", "length", 1},  {"sphere", "radius", 1},
    {"mesh", "scale", 3},   {"color", "rgba", 4},      {"mimic", "multiplier", 1}, {"mimic", "offset", 1}};

const std::map<std::string, JointKind> kJointKinds = {
    {"revolute", JointKind::Revolute},  {"continuous", JointKind::Continuous}, {"prismatic", JointKind::Prismatic},
    {"fixed", JointKind::Fixed},        {"floating", JointKind::FreeFlyer},    {"planar", JointKind::Planar},
    {"spherical", JointKind::Spherical}};
const std::map<std::string, JointKind> kDrakeKinds = {
    {"ball", JointKind::Spherical}, {"planar", JointKind::Planar}, {"universal", JointKind::Universal}};

struct Tree {
  std::string robot, root;
  std::vector<std::pair<std::string, JointKind>> joints;  // depth first
  std::vector<std::string> warnings;
};

bool areFiniteNumbers(const std::string& text, int count) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double value;
  int n = 0;
  while (stream >> value) n += std::isfinite(value);
  return stream.eof() && n == count;
}

void checkNumbers(const XMLElement& element, const std::string& owner, const std::string& path) {
  // Of damping, joints of Drake may have several numbers, or none that we use.
  if (getTag(element) == "dynamics" && element.Parent()->Value() == std::string("drake:joint")) return;
  for (const NumberRule& rule : kNumbers) {
    const char* text = getTag(element) == rule.tag ? element.Attribute(rule.attribute) : nullptr;
    if (text && !areFiniteNumbers(text, rule.count))
      throw InputError(path, owner,
                       "<" + getTag(element) + " " + rule.attribute + "=\"" + text + "\"> (line " +
                           std::to_string(element.GetLineNum()) + ") is not made of " + std::to_string(rule.count) +
                           " finite number(s)",
                       "correct it");
  }
  for (const XMLElement* e : getChildren(element)) checkNumbers(*e, owner, path);
}

// Names of the links or of the joints; also checks their numbers.
std::set<std::string> collectNames(const XMLElement& robot, const std::string& tag, const std::string& path) {
  std::set<std::string> names;
  for (const XMLElement* e : getChildren(robot)) {
    if (tag == "joint" ? !isJoint(*e) : getTag(*e) != tag) continue;
    const std::string name = getAttribute(e, "name"), line = " (line " + std::to_string(e->GetLineNum()) + ")";
    if (name.empty()) {
      const auto getLink = [e](const char* end, const char* word) {
        const XMLElement* found = e->FirstChildElement(end);
        const char* link = found ? found->Attribute("link") : nullptr;
        return link ? word + std::string(" '") + link + "'" : std::string();
      };
      throw InputError(path, tag + getLink("parent", " from") + getLink("child", " to") + line, "it has no name",
                       "give it a name attribute");
    }
    const std::string element = tag + " '" + name + "'";
    if (!names.insert(name).second)
      throw InputError(path, element, "it is declared twice" + line, "rename one of them");
    checkNumbers(*e, element, path);
  }
  return names;
}

const std::map<std::string, JointKind>& getKinds(const XMLElement& joint) {
  return getTag(joint) == "joint" ? kJointKinds : kDrakeKinds;
}

bool isGiven(const XMLElement& element, const char* attribute) {
  return getAttribute(&element, attribute).find_first_not_of("+-0. ") != std::string::npos;
}

// Errors in a joint that urdfdom accepts.
void checkJoint(const XMLElement& joint, const std::string& path, std::vector<std::string>& warnings) {
  const std::map<std::string, JointKind>& kinds = getKinds(joint);
  const std::string element = "joint '" + getAttribute(&joint, "name") + "'", type = getAttribute(&joint, "type");
  if (!kinds.count(type)) {
    std::string known;
    for (const auto& [name, kind] : kinds) known += (known.empty() ? "" : ", ") + name;
    throw InputError(path, element, "its type '" + type + "' is unknown", "use one of " + known);
  }
  if (joint.FirstChildElement("mimic") && kinds.at(type) == JointKind::Fixed)
    warnings.push_back(path + ": " + element + ": it is fixed, so <mimic> is ignored");
  const XMLElement* dynamics = joint.FirstChildElement("dynamics");
  if (dynamics && getNv(kinds.at(type)) != 1 && (isGiven(*dynamics, "damping") || isGiven(*dynamics, "friction")))
    warnings.push_back(path + ": " + element + ": its <dynamics> (line " + std::to_string(dynamics->GetLineNum()) +
                       ") is left out: only joints of one coordinate have damping and friction");
}

struct Edge {
  std::string joint, parent, child;
  JointKind kind;
};

// All joints in the order of the file, their links checked to exist and to have one parent at most.
std::vector<Edge> collectEdges(const XMLElement& robot, const std::set<std::string>& links, const std::string& path,
                               std::vector<std::string>& warnings) {
  std::vector<Edge> edges;
  std::map<std::string, std::string> carrier;  // link -> the joint that carries it
  for (const XMLElement* j : getChildren(robot)) {
    if (!isJoint(*j)) continue;
    checkJoint(*j, path, warnings);
    const Edge edge = {getAttribute(j, "name"), getAttribute(j->FirstChildElement("parent"), "link"),
                       getAttribute(j->FirstChildElement("child"), "link"), getKinds(*j).at(getAttribute(j, "type"))};
    for (const auto& [end, link] : {std::pair("parent", edge.parent), std::pair("child", edge.child)})
      if (!links.count(link))
        throw InputError(path, "joint '" + edge.joint + "'",
                         std::string("its ") + end + " link '" + link + "' does not exist",
                         "declare the link or correct the name");
    const auto [other, is_first] = carrier.emplace(edge.child, edge.joint);
    if (!is_first)
      throw InputError(path, "link '" + edge.child + "'",
                       "it is the child of two joints, '" + other->second + "' and '" + edge.joint + "'",
                       "cut the loop there and declare it as a closure");
    edges.push_back(edge);
  }
  return edges;
}

Tree makeTree(const XMLElement& robot, const std::string& path) {
  const std::set<std::string> links = collectNames(robot, "link", path);
  if (getAttribute(&robot, "name").empty())
    throw InputError(path, "element 'robot'", "it has no name", "give it a name attribute");
  if (links.empty()) throw InputError(path, "element 'robot'", "it has no links", "declare at least one");
  collectNames(robot, "joint", path);
  Tree tree;
  tree.robot = getAttribute(&robot, "name");
  const std::vector<Edge> edges = collectEdges(robot, links, path, tree.warnings);

  std::set<std::string> unreached = links;
  std::map<std::string, std::vector<const Edge*>> below;  // link -> its child joints
  for (const Edge& edge : edges) {
    unreached.erase(edge.child);
    below[edge.parent].push_back(&edge);
  }
  if (unreached.size() > 1)
    throw InputError(path, "link '" + *unreached.rbegin() + "'",
                     "it is a second root beside '" + *unreached.begin() + "'", "connect it by a joint, or remove it");
  if (!unreached.empty()) tree.root = *unreached.begin();
  unreached = links;
  unreached.erase(tree.root);
  const std::vector<const Edge*>& first = below[tree.root];
  std::vector<const Edge*> stack(first.rbegin(), first.rend());
  while (!stack.empty()) {
    const Edge& edge = *stack.back();
    stack.pop_back();
    tree.joints.emplace_back(edge.joint, edge.kind);
    unreached.erase(edge.child);
    const std::vector<const Edge*>& next = below[edge.child];
    stack.insert(stack.end(), next.rbegin(), next.rend());
  }
  if (!unreached.empty())
    throw InputError(path, "link '" + *unreached.begin() + "'", "the joints above it form a cycle without a root",
                     "cut the loop and declare it as a closure");
  return tree;
}

Vector3d toEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

SE3 toSE3(const urdf::Pose& pose) {
  const urdf::Rotation& r = pose.rotation;
  return {Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix(), toEigen(pose.position)};
}

// What a visual and a collision have in common.
template <typename Element>
Visual makeShape(const Element& element, const char* kind, const std::string& link, const std::string& path) {
  Visual out;
  out.X_BV = toSE3(element.origin);
  if (!element.geometry)
    throw InputError(path, "link '" + link + "'", std::string("a ") + kind + " has no geometry",
                     "give one or remove it");
  switch (element.geometry->type) {
    case urdf::Geometry::BOX:
      out.shape = Visual::Shape::Box;
      out.size = toEigen(static_cast<const urdf::Box&>(*element.geometry).dim);
      break;
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(*element.geometry);
      out.shape = Visual::Shape::Cylinder;
      out.size = {cylinder.radius, cylinder.length, 0};
      break;
    }
    case urdf::Geometry::SPHERE:
      out.shape = Visual::Shape::Sphere;
      out.size = {static_cast<const urdf::Sphere&>(*element.geometry).radius, 0, 0};
      break;
    case urdf::Geometry::MESH: {
      const auto& mesh = static_cast<const urdf::Mesh&>(*element.geometry);
      out.shape = Visual::Shape::Mesh;
      out.size = toEigen(mesh.scale);
      out.mesh = mesh.filename;
      out.bounds = fitMesh(out.mesh, std::filesystem::path(path).parent_path().string(), out.size);
      break;
    }
  }
  return out;
}

Visual makeVisual(const urdf::Visual& visual, const std::string& link, const std::string& path) {
  Visual out = makeShape(visual, "visual", link, path);
  if (visual.material) {
    const urdf::Color& color = visual.material->color;
    out.rgba = {color.r, color.g, color.b, color.a};
  }
  return out;
}

// Links of rotors often have rotational inertia alone, but nothing without mass has inertia: they get next to none.
void giveMass(const std::string& path, UrdfLink& link, std::vector<std::string>& warnings) {
  constexpr double kLeast = 1e-9;  // kg
  if (link.inertia.mass != 0 || !(link.inertia.I_com.cwiseAbs().maxCoeff() > 0)) return;
  link.inertia.mass = kLeast;
  warnings.push_back(path + ": link '" + link.name + "': it has rotational inertia but no mass: 1e-9 kg is taken");
}

// `unread`: meshes that give its body no shape.
UrdfLink makeLink(const urdf::Link& link, const std::string& path, std::vector<std::string>& unread) {
  UrdfLink out;
  out.name = link.name;
  if (link.inertial) {
    const urdf::Inertial& in = *link.inertial;
    Matrix3d I;
    I << in.ixx, in.ixy, in.ixz, in.ixy, in.iyy, in.iyz, in.ixz, in.iyz, in.izz;
    out.inertia = Inertia{in.mass, Vector3d::Zero(), I}.transformed(toSE3(in.origin));
  }
  for (const auto& visual : link.visual_array) out.visuals.push_back(makeVisual(*visual, link.name, path));
  for (const auto& collision : link.collision_array) {
    const Visual geometry = makeShape(*collision, "collision", link.name, path);
    if (std::optional<Shape> shape = fitShape(geometry)) {
      shape->fitted = false;
      out.shapes.push_back(*shape);
    } else {
      unread.push_back(geometry.mesh);
    }
  }
  if (out.shapes.empty())
    for (const Visual& visual : out.visuals)
      if (!fitShape(visual)) unread.push_back(visual.mesh);
  return out;
}

UrdfJoint makeJoint(const urdf::Joint& joint, JointKind kind, const std::string& path) {
  UrdfJoint out;
  out.parent = joint.parent_link_name;
  out.child = joint.child_link_name;
  out.joint.name = joint.name;
  out.joint.kind = kind;
  out.joint.X_PJ = toSE3(joint.parent_to_joint_origin_transform);
  if (kind == JointKind::Revolute || kind == JointKind::Continuous || kind == JointKind::Prismatic ||
      kind == JointKind::Planar)
    out.joint.axis = toEigen(joint.axis);
  if (kind == JointKind::Universal) {  // of Drake, which knows no others
    out.joint.axis = Vector3d::UnitX();
    out.joint.axis2 = Vector3d::UnitY();
  }
  if (joint.mimic && kind != JointKind::Fixed) {
    out.mimicked = joint.mimic->joint_name;
    out.multiplier = joint.mimic->multiplier;
    out.offset = joint.mimic->offset;
  }
  if (joint.dynamics && getNv(kind) == 1) {
    out.damping = joint.dynamics->damping;
    out.friction = joint.dynamics->friction;
    if (out.damping < 0 || out.friction < 0)
      throw InputError(path, "joint '" + joint.name + "'", "the damping or friction of its <dynamics> is negative",
                       "give 0 or more");
  }
  if (!joint.limits) return out;
  const urdf::JointLimits& limits = *joint.limits;
  if (limits.effort < 0 || limits.velocity < 0)
    throw InputError(path, "joint '" + joint.name + "'", "its effort or velocity limit is negative",
                     "give a positive limit, or 0 for none");
  if ((limits.lower != 0 || limits.upper != 0) && kind != JointKind::Continuous && getNv(kind) == 1) {
    out.lower = VectorXd::Constant(1, limits.lower > -kNoLimit ? limits.lower : -HUGE_VAL);
    out.upper = VectorXd::Constant(1, limits.upper < kNoLimit ? limits.upper : HUGE_VAL);
  }
  if (limits.effort > 0 && limits.effort < kNoLimit) out.effort = limits.effort;
  if (limits.velocity > 0 && limits.velocity < kNoLimit) out.velocity = limits.velocity;
  return out;
}

std::string warnOfMeshes(const std::vector<std::string>& unread, const std::string& path) {
  return path + ": " + std::to_string(unread.size()) + " mesh(es) cannot be read, among them '" + unread.front() +
         "': their bodies have no shape from them, so distances ignore them; replace them by STL, OBJ or "
         "COLLADA files or give "
         "<collision> with boxes, cylinders or spheres";
}

// Joints of Bullet's and MuJoCo's readers, which urdfdom does not know; their kind is in the tree.
void hideBalls(XMLElement& robot) {
  for (XMLElement* e = robot.FirstChildElement("joint"); e; e = e->NextSiblingElement("joint"))
    if (getAttribute(e, "type") == "spherical") e->SetAttribute("type", "floating");
}

// urdfdom refuses the whole robot for a colour that nothing before it defines.
void removeUnknownColours(XMLElement& robot, const std::string& path, std::vector<std::string>& warnings) {
  std::set<std::string> known, told;
  for (const XMLElement* e : getChildren(robot))
    if (getTag(*e) == "material") known.insert(getAttribute(e, "name"));
  for (XMLElement* link = robot.FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
    for (XMLElement* visual = link->FirstChildElement("visual"); visual;
         visual = visual->NextSiblingElement("visual")) {
      XMLElement* const material = visual->FirstChildElement("material");
      if (!material) continue;
      const std::string name = getAttribute(material, "name");
      if (material->FirstChildElement()) {
        known.insert(name);
      } else if (!name.empty() && known.count(name) == 0) {
        if (told.insert(name).second)
          warnings.push_back(path + ": link '" + getAttribute(link, "name") + "': no <material> '" + name +
                             "' is defined before it: it has no colour from it");
        visual->DeleteChild(material);
      }
    }
}

// A root without mass whose only child floats is the world, on which the file itself puts a free base.
void takeRootAsWorld(UrdfFile& file) {
  const UrdfLink& root = file.links.at(file.root);
  std::vector<UrdfJoint*> below;
  for (UrdfJoint& joint : file.joints)
    if (joint.parent == file.root) below.push_back(&joint);
  if (below.size() != 1 || below[0]->joint.kind != JointKind::FreeFlyer || file.root == "world" ||
      root.inertia.mass != 0 || !root.visuals.empty() || !root.shapes.empty() || file.links.count("world"))
    return;
  file.warnings.push_back(file.path + ": link '" + file.root + "': it is the world: without mass, and joint '" +
                          below[0]->joint.name + "' floats on it");
  file.links.erase(file.root);
  below[0]->parent = file.root = "world";
  file.links["world"].name = "world";
  file.has_own_base = true;
}

void checkForXacro(const XMLElement& element, const std::string& path) {
  if (getTag(element).rfind("xacro:", 0) == 0) refuseXacro(path, describe(element));
  for (const XMLElement* e : getChildren(element)) checkForXacro(*e, path);
}

}  // namespace

void refuseXacro(const std::string& path, const std::string& element) {
  std::filesystem::path urdf = std::filesystem::path(path).filename();
  const bool is_urdf = urdf.extension() == ".urdf";  // and must not be replaced by what comes out
  if (!is_urdf) urdf = urdf.stem();
  if (urdf.extension() == ".urdf") urdf = urdf.stem();
  urdf += is_urdf ? ".expanded.urdf" : ".urdf";
  throw InputError(path, element, "it is written in xacro, which is not expanded here",
                   "expand it and give the result: `xacro " + path + " > " + urdf.string() + "`");
}

UrdfFile parseUrdf(const std::string& xml, const std::string& path, YamlFile& settings) {
  XMLDocument document(true, tinyxml2::COLLAPSE_WHITESPACE);
  const XMLElement& robot = parseXml(xml, path, "robot", document);
  checkForXacro(robot, path);
  Tree tree = makeTree(robot, path);
  const bool for_drake = isForDrake(robot);
  XMLDocument
      plain;  // printed for urdfdom, which recurses through whatever TinyXML makes of a text that is not well-formed
  document.DeepCopy(&plain);
  if (for_drake) removeDrake(*plain.RootElement());
  hideBalls(*plain.RootElement());
  removeUnknownColours(*plain.RootElement(), path, tree.warnings);
  urdf::ModelInterfaceSharedPtr model;
  std::string complaints;
  {
    LogCapture capture;
    model = urdf::parseURDF(formatXml(plain));
    complaints = capture.text();
  }
  // urdfdom continues after some errors (a link whose inertial it could not read has none); we do not.
  if (!model || !complaints.empty())
    throw InputError(path, "robot '" + tree.robot + "'", "urdfdom cannot read it: " + complaints,
                     "correct the element");
  UrdfFile file;
  file.path = path;
  file.is_urdf = true;
  file.name = tree.robot;
  file.root = tree.root;
  file.warnings = std::move(tree.warnings);
  GeometryDecimals decimals;
  decimals.add(robot);
  file.rounding = decimals.calcTolerance();
  std::vector<std::string> unread;
  for (const auto& [name, link] : model->links_) {
    file.links[name] = makeLink(*link, path, unread);
    giveMass(path, file.links[name], file.warnings);
  }
  if (!unread.empty()) file.warnings.push_back(warnOfMeshes(unread, path));
  for (const auto& [name, kind] : tree.joints) file.joints.push_back(makeJoint(*model->joints_.at(name), kind, path));
  if (for_drake) readDrakeElements(robot, file, settings);
  readDialects(robot, for_drake, file, settings);
  takeRootAsWorld(file);
  return file;
}

}  // namespace bielle
