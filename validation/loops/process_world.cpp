#include "loops/process_world.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "bielle/dynamics/constrained.h"
#include "bielle/model/error.h"
#include "dynamics/loop_conflict.h"
#include "formats/mjcf.h"
#include "formats/process.h"

namespace bielle::loops {
namespace {

using nlohmann::json;

json listVector(const Vector3d& x) { return {x[0], x[1], x[2]}; }
json listRows(const Matrix3d& R) {
  const Matrix3d columns = R.transpose();
  return std::vector<double>(columns.data(), columns.data() + columns.size());
}

// A program that answers lines of JSON.
class Program {
 public:
  explicit Program(const std::vector<std::string>& arguments) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw InputError("", "new process", "there can be no pipe to it", "end other processes");
    const int none = open("/dev/null", O_WRONLY | O_CLOEXEC);  // engines complain of numbers that are not finite
    pid_ = startProcess(arguments, {ends[1], ends[1], none, true});
    close(none);
    close(ends[1]);
    file_ = ends[0];
  }
  ~Program() {
    close(file_);
    waitForProcess(pid_);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  // Only the mechanism has no answer.
  void tell(const json& line) {
    const std::string text = line.dump() + "\n";
    for (size_t sent = 0; sent < text.size();) {
      const ssize_t count = send(file_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;  // what it has said before tells why
      sent += static_cast<size_t>(count);
    }
  }
  json ask(const json& line) {
    tell(line);
    char buffer[65536];
    size_t end;
    while ((end = heard_.find('\n')) == std::string::npos) {
      const ssize_t count = recv(file_, buffer, sizeof buffer, 0);
      if (count <= 0) return {{"error", "the engine has broken off"}};
      heard_.append(buffer, static_cast<size_t>(count));
    }
    json answer = json::parse(heard_.substr(0, end));
    heard_.erase(0, end + 1);
    return answer;
  }

 private:
  pid_t pid_;
  int file_;
  std::string heard_;
};

void checkParts(const Model& model) {
  const auto refuse = [&model](const std::string& part, const std::string& what) {
    throw InputError(model.name(), part, "this engine has no " + what + " here", "choose another engine");
  };
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    if (joint.nq != joint.nv || joint.kind == JointKind::Planar)
      refuse("joint '" + joint.name + "'", std::string(getName(joint.kind)) + " joints");
  }
  for (const Closure& closure : model.closures())
    if (closure.kind != ClosureKind::Ball3D && closure.kind != ClosureKind::Hinge5D)
      refuse("closure '" + closure.name + "'", std::string(getName(closure.kind)) + " closures");
  if (!model.jointForces().empty())
    refuse("joint '" + model.joints()[model.jointForces()[0].joint].name + "'", "springs and friction of joints");
}

class LineWorld : public ProcessWorld {
 public:
  // \param order  ours of each coordinate of the engine
  LineWorld(const Model& model, double time_step, const std::vector<std::string>& arguments, const json& mechanism,
            std::vector<int> order)
      : ProcessWorld(model, {}), time_step_(time_step), order_(std::move(order)), program_(arguments) {
    integration_.integrator = "an engine of its own";
    program_.tell(mechanism);
  }
  double cpu() const override { return cpu_; }

 private:
  void start() override { take(program_.ask({{"q", arrange(q_)}, {"v", arrange(v_)}})); }
  void noteForces() override { take(program_.ask({{"forces", arrange(calcMotorForces(model_, u_))}})); }
  bool step(double duration) override {
    if (!message_.empty()) return false;
    const double count = countSteps(duration, time_step_), h = duration / count;
    if (!take(program_.ask({{"step", h}, {"count", count}}))) return false;
    noteStep(h);
    time_ += duration;
    return true;
  }
  bool take(const json& answer) {
    if (answer.contains("error")) return fail(answer["error"].get<std::string>());
    cpu_ = answer["cpu"];
    for (size_t k = 0; k < order_.size(); ++k) {
      q_[order_[k]] = answer["q"][k];
      v_[order_[k]] = answer["v"][k];
    }
    return true;
  }
  json arrange(const VectorXd& x) const {
    json out = json::array();
    for (const int k : order_) out.push_back(x[k]);
    return out;
  }

  const double time_step_;
  const std::vector<int> order_;
  double cpu_ = 0;
  Program program_;
};

json describe(const Model& model) {
  json out = {{"gravity", listVector(model.gravity())},
              {"bodies", json::array()},
              {"closures", json::array()},
              {"springs", json::array()}};
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const Inertia& inertia = model.bodies()[i].inertia;
    const char* kind = joint.kind == JointKind::Prismatic   ? "slide"
                       : joint.kind == JointKind::Universal ? "universal"
                                                            : "hinge";
    out["bodies"].push_back({{"kind", kind},
                             {"parent", joint.parent},
                             {"R", listRows(joint.X_PJ.R)},
                             {"p", listVector(joint.X_PJ.p)},
                             {"axis", listVector(joint.axis)},
                             {"axis2", listVector(joint.axis2)},
                             {"mass", inertia.mass},
                             {"com", listVector(inertia.com)},
                             {"moments", listRows(inertia.I_com)}});
  }
  for (const Closure& closure : model.closures()) {
    json entry = {{"body1", closure.body1},
                  {"body2", closure.body2},
                  {"point1", listVector(closure.X_B1.p)},
                  {"point2", listVector(closure.X_B2.p)}};
    if (closure.kind == ClosureKind::Hinge5D) entry["axis"] = listVector(closure.X_B1.R * closure.axis);
    out["closures"].push_back(entry);
  }
  for (const PointSpring& spring : model.pointSprings())
    out["springs"].push_back({{"body1", spring.body1},
                              {"body2", spring.body2},
                              {"point1", listVector(spring.point1)},
                              {"point2", listVector(spring.point2)},
                              {"stiffness", spring.stiffness},
                              {"rest", spring.rest},
                              {"preload", spring.preload},
                              {"damping", spring.damping}});
  return out;
}

[[maybe_unused]] std::unique_ptr<ProcessWorld> makeWorld(const Model& model, double time_step, const char* program) {
  checkParts(model);
  std::vector<int> order(static_cast<size_t>(model.nv()));
  std::iota(order.begin(), order.end(), 0);
  return std::make_unique<LineWorld>(model, time_step, std::vector<std::string>{program}, describe(model), order);
}

const char* getNodeModules() {
  const char* modules = std::getenv("BIELLE_NODE_MODULES");
  return modules ? modules : "";
}

// Steps are taken once before the clock runs, so that node's compiler has done its work.
constexpr const char* kMujoco3 = R"(
import fs from 'fs';
const M = await (await import(process.argv[1] + '/@mujoco/mujoco/mujoco.js')).default();
const buffer = Buffer.alloc(65536);
let heard = '';
function read() {
  for (let end; (end = heard.indexOf('\n')) < 0;) {
    const count = fs.readSync(0, buffer);
    if (!count) process.exit(0);
    heard += buffer.toString('utf8', 0, count);
  }
  const end = heard.indexOf('\n'), line = JSON.parse(heard.slice(0, end));
  heard = heard.slice(end + 1);
  return line;
}
const getTime = () => { const {user, system} = process.cpuUsage(); return 1e-6 * (user + system); };
try {
  const {xml, integrator} = read();
  const model = M.MjModel.from_xml_string(xml), data = new M.MjData(model);
  model.opt.integrator = integrator;
  for (let i = 0; i < 300; ++i) M.mj_step(model, data);
  let cpu = 0;
  for (;;) {
    const request = read();
    if (request.q) {
      M.mj_resetData(model, data);
      data.qpos.set(request.q);
      data.qvel.set(request.v);
      cpu = 0;
    } else if (request.forces) {
      data.qfrc_applied.set(request.forces);
      if (request.push) data.xfrc_applied.set(request.push, 6 * request.body);
    } else {
      model.opt.timestep = request.step;
      const before = getTime();
      for (let i = 0; i < request.count; ++i) M.mj_step(model, data);
      cpu += getTime() - before;
    }
    const q = Array.from(data.qpos), v = Array.from(data.qvel);
    const warned = [...Array(data.warning.size()).keys()].some(i => data.warning.get(i).number > 0);
    const answer = warned || ![...q, ...v].every(Number.isFinite) ?
        {error: "MuJoCo's accelerations are no longer finite"} : {q, v, cpu};
    fs.writeSync(1, JSON.stringify(answer) + '\n');
  }
} catch (error) {
  fs.writeSync(1, JSON.stringify({error: String(error)}) + '\n');
}
)";

// Functions are compiled when they are first called, by the better compiler at once.
std::vector<std::string> listMujoco3Command() {
  return {"node", "--no-liftoff", "--input-type=module", "-e", kMujoco3, "--", getNodeModules()};
}

}  // namespace

#ifdef BIELLE_LOOPS_DART
std::unique_ptr<ProcessWorld> makeDartWorld(const Model& model, double time_step) {
  return makeWorld(model, time_step, BIELLE_LOOPS_DART);
}
#endif
#ifdef BIELLE_LOOPS_ODE
std::unique_ptr<ProcessWorld> makeOdeWorld(const Model& model, double time_step) {
  return makeWorld(model, time_step, BIELLE_LOOPS_ODE);
}
#endif

bool hasMujoco3() {
  return isOnPath("node") && std::filesystem::exists(std::string(getNodeModules()) + "/@mujoco/mujoco/mujoco.js");
}

struct Mujoco3::Talk {
  Program program{listMujoco3Command()};

  void ask(const json& request, Mujoco3& out) {
    const json answer = program.ask(request);
    if (answer.contains("error"))
      throw InputError("", "MuJoCo 3", answer["error"].get<std::string>(), "see its manual");
    const auto q = answer["q"].get<std::vector<double>>(), v = answer["v"].get<std::vector<double>>();
    out.qpos_ = Eigen::Map<const VectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
    out.qvel_ = Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
    out.cpu_ = answer["cpu"];
  }
};

Mujoco3::Mujoco3(const std::string& xml, Mujoco3Integrator integrator) : talk_(std::make_unique<Talk>()) {
  talk_->program.tell({{"xml", xml}, {"integrator", static_cast<int>(integrator)}});
}
Mujoco3::~Mujoco3() = default;
void Mujoco3::start(const VectorXd& qpos, const VectorXd& qvel) {
  talk_->ask(
      {{"q", std::vector<double>(qpos.begin(), qpos.end())}, {"v", std::vector<double>(qvel.begin(), qvel.end())}},
      *this);
}
void Mujoco3::apply(const VectorXd& forces, int body, const Vector3d& push) {
  talk_->ask(
      {{"forces", std::vector<double>(forces.begin(), forces.end())}, {"body", body}, {"push", listVector(push)}},
      *this);
}
void Mujoco3::step(double h, int count) { talk_->ask({{"step", h}, {"count", count}}, *this); }

std::unique_ptr<ProcessWorld> makeMujoco3World(const Model& model, double time_step, Mujoco3Integrator integrator) {
  checkParts(model);
  const AssemblyResult closed = findClosedConfiguration(model);
  if (closed.status != NumericalStatus::Ok) throw makeClosingError(model, model.name(), closed);
  MjcfOptions options;
  options.time_step = time_step;
  options.closure_time = 2 * time_step;
  std::vector<int> order;
  for (const int body : listMjcfBodies(model))
    for (int k = 0; k < model.joints()[body].nv; ++k) order.push_back(model.joints()[body].idx_v + k);
  return std::make_unique<LineWorld>(
      model, time_step, listMujoco3Command(),
      json{{"xml", formatMjcf(model, closed.q, options).xml}, {"integrator", static_cast<int>(integrator)}}, order);
}

}  // namespace bielle::loops
