#include "robots/part_composer.h"

#include <algorithm>
#include <functional>

#include "formats/motor_catalogue.h"
#include "model/listing.h"
#include "model/number_text.h"
#include "robots/part_parameters.h"
#include "robots/part_solids.h"
#include "robots/part_tree.h"
#include "robots/plane_linkage.h"

namespace bielle {
namespace {

using Values = std::map<std::string, OptionValue>;

const YamlKeys kRequirementKeys("part", "requires[]", {"that", "problem", "remedy"});
const YamlKeys kLinkKeys("part", "tree.LINK",
                         {"parent", "joint", "type", "place", "rpy", "axis", "axis2", "range", "solids"});

// Calls it, and says of which entry an error in an expression is.
template <typename Function>
auto callFor(const YamlEntry& entry, const Function& function) {
  try {
    return function();
  } catch (const ExpressionError& error) {
    entry.fail(error.problem, error.remedy);
  }
}

double toNumber(const OptionValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? 1 : 0;
  if (const int* whole = std::get_if<int>(&value)) return *whole;
  return std::get<double>(value);
}

class PartComposer {
 public:
  PartComposer(const PartFile& file, const MountedPart& part, Composition& out)
      : file_(file), part_(part), out_(out), symbols_(std::make_shared<Symbols>()) {
    placeholders_ = {{"part", part.name}};
    for (const PartParameter& p : file.parameters)
      if (!p.option.choices.empty()) {
        const auto chosen = part.chosen.find(p.option.name);
        placeholders_[p.option.name] =
            chosen != part.chosen.end() ? chosen->second : std::get<std::string>(part.values.at(p.option.name));
      }
  }

  void compose() {
    define();
    checkRequirements();
    // Links of the part may hang on bars that hang on what it is mounted on; bars on links of the part come after these.
    const bool is_on_own = isLinkageOnTree();
    if (!is_on_own) addLinkage();
    for (const auto& [name, entry] : file_.tree) {
      const YamlEntry scoped = entry.withSymbols(symbols_);
      mountsPart(entry) ? mountPart(name, scoped) : addLink(name, scoped);
    }
    if (is_on_own) addLinkage();
    addSolidsOfMounts();
    addFrames();
    addShared();
    applyRoles();
  }

 private:
  const YamlEntry* findScoped(const std::string& key) {
    const YamlEntry* entry = find(file_.fields, key);
    return entry ? &scoped_.emplace(key, entry->withSymbols(symbols_)).first->second : nullptr;
  }

  // Parameters, then the values of `let` in their order.
  void define() {
    symbols_->define("side", part_.side);
    for (const PartParameter& p : file_.parameters) {
      if (!p.option.choices.empty()) continue;
      callFor(*find(file_.fields, "parameters"),
              [&] { symbols_->define(p.option.name, toNumber(part_.values.at(p.option.name))); });
    }
    for (const std::string& name : file_.points)
      callFor(*find(file_.fields, "points"), [&] { symbols_->define(name, part_.points.at(name)); });
    const YamlEntry* let = findScoped("let");
    if (!let) return;
    for (const auto& [name, entry] : let->getMap())
      callFor(entry, [&, &name = name, &entry = entry] {
        if (entry.isList() || (entry.isText() && symbols_->usesPoints(entry.getText())))
          symbols_->define(name, entry.getVector3());
        else
          symbols_->define(name, entry.getNumber());
      });
  }

  void checkRequirements() {
    const YamlEntry* list = findScoped("requires");
    if (!list) return;
    for (const YamlEntry& entry : list->getList()) {
      const YamlFields fields = entry.getFields(kRequirementKeys);
      if (require(fields, "that", entry).getNumber() == 0)
        entry.fail(require(fields, "problem", entry).getText(), require(fields, "remedy", entry).getText());
    }
  }

  // What the part calls by this name; `entry` has it.
  std::string resolve(const std::string& name, const YamlEntry& entry) const {
    if (name == "world") return name;
    const auto mount = part_.mounts.find(name);
    return mount != part_.mounts.end() ? mount->second : fillIn(name, placeholders_, entry) + part_.suffix;
  }

  std::string makeName(const std::string& name, const YamlEntry& entry) const {
    if (part_.mounts.count(name)) entry.fail("'" + name + "' is what the part is mounted on", "choose another name");
    return fillIn(name, placeholders_, entry) + part_.suffix;
  }

  void addLink(const std::string& key, const YamlEntry& entry) {
    const YamlFields fields = entry.getFields(kLinkKeys);
    const std::string link = makeName(key, entry);
    UrdfFile& urdf = out_.files.urdf;
    if (const YamlEntry* parent = find(fields, "parent")) {
      UrdfJoint joint = readJoint(fields, entry, part_.side);
      const YamlEntry* name = find(fields, "joint");
      if (!name && joint.joint.kind != JointKind::Fixed) require(fields, "joint", entry);
      joint.joint.name = name ? makeName(name->getText(), *name) : link + "_joint";
      joint.parent = resolve(parent->getText(), *parent);
      joint.child = link;
      addJointTo(urdf, joint, entry);
    } else if (urdf.root.empty()) {
      urdf.root = link;
      urdf.links.emplace(link, UrdfLink{link, {}, {}, {}});
    } else {
      entry.fail("it has no parent, as link '" + urdf.root + "'", "name the link that carries it");
    }
    if (const YamlEntry* solids = find(fields, "solids"))
      addSolidsTo(urdf.links.at(link), readSolids(*solids, part_.side));
  }

  void addSolidsOfMounts() {
    const YamlEntry* solids = findScoped("solids");
    if (!solids) return;
    for (const auto& [link, list] : solids->getMap())
      out_.later.push_back([&urdf = out_.files.urdf, name = resolve(link, list), list = list, side = part_.side] {
        addSolidsTo(findLinkOf(urdf, name, list), readSolids(list, side));
      });
  }

  void addFrames() {
    const YamlEntry* frames = findScoped("frames");
    if (!frames) return;
    for (const auto& [key, entry] : frames->getMap()) {
      const YamlFields fields = entry.getFields(kFrameKeys);
      const YamlEntry& link = require(fields, "link", entry);
      SE3 X;
      if (const YamlEntry* place = find(fields, "place")) X.p = readPlace(*place, part_.side);
      if (const YamlEntry* rpy = find(fields, "rpy")) X.R = readAttitude(*rpy, part_.side);
      out_.later.push_back([&urdf = out_.files.urdf, name = makeName(key, entry),
                            parent = resolve(link.getText(), link), X,
                            link] { addFrameTo(urdf, name, parent, X, link); });
    }
  }

  bool isLinkageOnTree() const {
    const YamlEntry* linkage = find(file_.fields, "linkage");
    if (!linkage) return false;
    for (const auto& [key, base] : linkage->getMap())
      if (key == "base")
        return std::any_of(file_.tree.begin(), file_.tree.end(),
                           [&base = base](const auto& link) { return base.isWord(link.first); });
    return false;
  }

  void addLinkage() {
    const YamlEntry* linkage = findScoped("linkage");
    if (!linkage) return;
    // What is done later needs its names no more.
    addPlaneLinkage(
        *linkage, {part_.side, [this](const std::string& name, const YamlEntry& entry) { return resolve(name, entry); },
                   [this](const std::string& name, const YamlEntry& entry) { return makeName(name, entry); },
                   out_.files, out_.later});
  }

  // Closures, motors and so on, by the names of the part; then with those of the robot.
  void addShared() {
    YamlFields fields;
    for (const std::string& key : listSharedKeys())
      if (const YamlEntry* entry = findScoped(key)) fields.emplace(key, *entry);
    if (fields.empty()) return;
    if (const YamlEntry* roles = findScoped("roles"))
      fields.emplace("roles", *roles);  // applied once all motors are there
    YamlFile own;
    own.path = file_.path;
    readSharedKeys(fields, own);
    const YamlEntry& any = fields.begin()->second;
    const auto use = [&](std::string& name) { name = resolve(name, any); };
    const auto make = [&](std::string& name) { name = makeName(name, any); };
    YamlFile& yaml = out_.files.yaml;
    const auto append = [](auto& from, auto& to) { to.insert(to.end(), from.begin(), from.end()); };
    for (ClosureSpec& c : own.closures) {
      make(c.name);
      if (c.kind != ClosureKind::Coupler) use(c.frame1), use(c.frame2);
      std::map<std::string, double> coefficients;
      std::map<std::string, std::vector<double>> higher;
      for (const auto& [joint, value] : c.coefficients) coefficients[resolve(joint, any)] += value;
      for (const auto& [joint, values] : c.higher) {
        std::vector<double>& sum = higher[resolve(joint, any)];
        sum.resize(std::max(sum.size(), values.size()));
        std::transform(values.begin(), values.end(), sum.begin(), sum.begin(), std::plus<>());
      }
      c.coefficients = std::move(coefficients);
      c.higher = std::move(higher);
    }
    append(own.closures, yaml.closures);
    for (MotorSpec& motor : own.motors) use(motor.joint), motor.role = part_.role;
    append(own.motors, yaml.motors);
    for (const auto& [joint, value] : own.armature) yaml.armature[resolve(joint, any)] = value;
    for (JointForceSpec& force : own.joint_forces) use(force.joint);
    append(own.joint_forces, yaml.joint_forces);
    for (PointSpringSpec& spring : own.point_springs) {
      make(spring.spring.name), use(spring.frame1), use(spring.frame2);
      for (Vector3d* point : {&spring.spring.point1, &spring.spring.point2}) point->y() *= part_.side;
    }
    append(own.point_springs, yaml.point_springs);
    for (ContactSpec& contact : own.contacts) make(contact.name), use(contact.frame);
    append(own.contacts, yaml.contacts);
    for (std::string& joint : own.serial_joints) use(joint);
    append(own.serial_joints, yaml.serial_joints);
    for (auto& [joint, values] : own.importance) use(joint);
    append(own.importance, yaml.importance);
    for (const Reference& reference : own.references) mergeReference(reference, any);
    for (RobotName& part : own.names) part.name = resolve(part.name, part.entry);
    append(own.names, yaml.names);
    if (own.gravity) yaml.gravity = own.gravity;
    if (own.base) yaml.base = own.base;
    append(own.warnings, yaml.warnings);
  }

  // Motors by their role, those of the parts in this one: what the file says takes the place of what the parts said, but
  // for losses behind the motor.
  void applyRoles() {
    const YamlEntry* roles = findScoped("roles");
    if (!roles) return;
    const YamlEntry* catalogue = findScoped("motor_catalogue");
    std::vector<MotorSpec>& motors = out_.files.yaml.motors;
    for (const MotorSpec& spec : readMotorSpecs(*roles, file_.path, catalogue)) {
      std::vector<std::string> known;
      bool is_found = false;
      for (MotorSpec& motor : motors) {
        if (!motor.role.empty() && !contains(known, motor.role)) known.push_back(motor.role);
        if (motor.role != spec.joint) continue;
        const std::string joint = motor.joint;
        // Those of a motor without a type are of what the part puts behind it.
        const MotorDrive behind = motor.drive.type.empty() ? motor.drive : MotorDrive();
        is_found = true;
        motor = spec;
        motor.drive.efficiency *= behind.efficiency, motor.drive.back_efficiency *= behind.back_efficiency;
        motor.joint = joint, motor.role = spec.joint;
      }
      if (!is_found) roles->fail("no motor has the role '" + spec.joint + "'", "known are " + listItems(known));
    }
  }

  // References of one name are one.
  void mergeReference(const Reference& own, const YamlEntry& entry) {
    std::vector<Reference>& references = out_.files.yaml.references;
    auto it =
        std::find_if(references.begin(), references.end(), [&](const Reference& r) { return r.name == own.name; });
    if (it == references.end()) {
      references.emplace_back();
      references.back().name = own.name;
      it = std::prev(references.end());
    }
    for (const auto& [joint, values] : own.joints) it->joints[resolve(joint, entry)] = values;
    for (const auto& [foot, place] : own.feet) {
      const std::string contact = resolve(foot, entry);
      it->feet[contact] = Vector3d(1, part_.side, 1).cwiseProduct(place);
      it->yaws.erase(contact);
      if (const auto yaw = own.yaws.find(foot); yaw != own.yaws.end()) it->yaws[contact] = part_.side * yaw->second;
    }
    if (own.height_frame.empty()) return;
    it->height_frame = resolve(own.height_frame, entry);
    it->height = own.height;
  }

  void mountPart(const std::string& key, const YamlEntry& entry) {
    const PartMounting mounting(entry);
    if (const YamlEntry* when = find(mounting.fields, "when"))
      if (when->getNumber() == 0) return;
    PartChoices chosen = part_.chosen;
    for (const PartParameter& p : file_.parameters)
      if (!p.option.choices.empty()) chosen[p.option.name] = placeholders_.at(p.option.name);
    const PartFile& file = *listAlternatives(out_.library, file_, mounting, chosen).front();
    MountedPart part;
    part.name = fillIn(key, placeholders_, entry);
    part.suffix = part_.suffix;
    part.side = part_.side;
    const YamlEntry* role = find(mounting.fields, "role");
    part.role = role ? fillIn(role->getText(), placeholders_, *role) : part_.role;
    part.chosen = listBoundChoices(file_, mounting, chosen);
    part.values = bindValues(file, mounting, part.chosen);
    part.points = bindPoints(file, mounting);
    try {
      composeSides(file, mounting, part);
    } catch (const InputError&) {
      refuseOutside(file, mounting, part.chosen);
      throw;
    }
  }

  void composeSides(const PartFile& file, const PartMounting& mounting, MountedPart& part) {
    const YamlEntry* sides = find(mounting.fields, "sides");
    if (!sides) {
      part.mounts = bindMounts(file, mounting, "");
      return PartComposer(file, part, out_).compose();
    }
    const std::vector<std::string> suffixes = sides->getTexts(2);
    for (const std::string& suffix : suffixes) {
      part.mounts = bindMounts(file, mounting, suffix);
      part.suffix = part_.suffix + suffix;
      PartComposer(file, part, out_).compose();
      part.side = -part.side;
    }
  }

  // Whoever sets a parameter beyond its bounds is told that, and not of what it leads to in the part.
  void refuseOutside(const PartFile& file, const PartMounting& mounting, const PartChoices& chosen) {
    for (const PartParameter& p : listParameters(out_.library, file, chosen)) {
      const YamlEntry* set = mounting.findSet(p.option.name);
      if (!set || !std::holds_alternative<double>(p.option.value)) continue;
      const double value = set->getNumber();
      if (!(value >= p.option.bounds.lower && value <= p.option.bounds.upper))
        set->fail(formatNumber(value) + " is outside " + p.option.describeValues() + ", and the part cannot be made so",
                  "give a number within");
    }
  }

  std::map<std::string, std::string> bindMounts(const PartFile& file, const PartMounting& mounting,
                                                const std::string& side) {
    std::map<std::string, std::string> bound;
    std::vector<std::string> wanted, given;
    for (const auto& [name, kind] : file.mounts)
      wanted.push_back(name + (kind == MountKind::Link ? " (link)" : " (joint)"));
    const YamlEntry* mounts = find(mounting.fields, "mounts");
    std::map<std::string, std::string> placeholders = placeholders_;
    placeholders["side"] = side;
    if (mounts)
      for (const auto& [name, entry] : mounts->getMap()) {
        given.push_back(name);
        const auto it = std::find_if(file.mounts.begin(), file.mounts.end(),
                                     [&name = name](const auto& mount) { return mount.first == name; });
        if (it == file.mounts.end()) continue;  // other parts may want it
        const std::string text = entry.getText();
        const auto mount = part_.mounts.find(text);
        bound[name] = mount != part_.mounts.end()
                          ? mount->second
                          : fillIn(text, placeholders, entry) +
                                (text.find("{side}") == std::string::npos ? part_.suffix : std::string());
        out_.mounts.push_back({entry, bound[name], it->second});
      }
    if (bound.size() < file.mounts.size())
      mounting.entry.fail(
          "part " + file.path + " wants to be mounted on " + listItems(wanted) + ", offered are " + listItems(given),
          "name what the others are, under `mounts`");
    return bound;
  }

  Values bindValues(const PartFile& file, const PartMounting& mounting, const PartChoices& chosen) {
    Values values;
    for (const PartParameter& p : listParameters(out_.library, file, chosen)) {
      const std::string& name = p.option.name;
      const bool is_choice = !p.option.choices.empty(), is_flag = std::holds_alternative<bool>(p.option.value);
      if (const YamlEntry* set = mounting.findSet(name)) {
        if (is_choice)
          values[name] = set->getText();
        else if (is_flag && (set->isWord("true") || set->isWord("false")))
          values[name] = set->isWord("true");
        else
          values[name] = set->getNumber();
      } else if (file_.defines(name)) {
        values[name] = is_choice ? OptionValue(placeholders_.at(name))
                                 : callFor(mounting.entry, [&]() -> OptionValue { return symbols_->calcNumber(name); });
      } else {
        values[name] = part_.values.at(mounting.prefix + name);
      }
    }
    return values;
  }

  std::map<std::string, Vector3d> bindPoints(const PartFile& file, const PartMounting& mounting) {
    std::map<std::string, Vector3d> points;
    for (const std::string& name : file.points) {
      const YamlEntry* set = mounting.findSet(name);
      if (!set && !file_.defines(name))
        mounting.entry.fail("part " + file.path + " wants the point '" + name + "'", "give it under `set`");
      points[name] = set ? set->getVector3() : callFor(mounting.entry, [&] { return symbols_->calcPoint(name); });
    }
    return points;
  }

  const PartFile& file_;
  const MountedPart& part_;
  Composition& out_;
  std::shared_ptr<Symbols> symbols_;
  std::map<std::string, std::string> placeholders_;
  std::map<std::string, YamlEntry> scoped_;
};

}  // namespace

void composePart(const PartFile& file, const MountedPart& part, Composition& out) {
  PartComposer(file, part, out).compose();
}

}  // namespace bielle
