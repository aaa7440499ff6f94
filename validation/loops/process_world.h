#pragma once
// Worlds of engines in programs of their own (outside_engine.h): mechanisms of hinges, slides and universal joints, closed by
// balls and hinges, with springs between points; no contact, no stops, no push. Steps are fixed.
#include <memory>
#include <string>

#include "bielle/worlds/world.h"

namespace bielle::loops {

class ProcessWorld : public worlds::World {
 public:
  // Of its steps since the start, s.
  virtual double cpu() const = 0;

 protected:
  using World::World;
};

// \throws InputError when the mechanism has other parts, or the program refuses it
std::unique_ptr<ProcessWorld> makeDartWorld(const Model& model, double time_step);
std::unique_ptr<ProcessWorld> makeOdeWorld(const Model& model, double time_step);

// Today's MuJoCo: npm's @mujoco/mujoco, WebAssembly in node, from the directory $BIELLE_NODE_MODULES.
bool hasMujoco3();
enum class Mujoco3Integrator { Euler = 0, RungeKutta = 1, Discrete = 4 };
// Closures are as stiff as the steps allow.
std::unique_ptr<ProcessWorld> makeMujoco3World(const Model& model, double time_step, Mujoco3Integrator integrator);

// The same program on any file, in coordinates of its own. Functions throw an InputError with what it complains of.
class Mujoco3 {
 public:
  Mujoco3(const std::string& xml, Mujoco3Integrator integrator);
  ~Mujoco3();

  void start(const VectorXd& qpos, const VectorXd& qvel);
  // Generalized forces, and one at the centre of mass of a body, N (world), from now on.
  void apply(const VectorXd& forces, int body, const Vector3d& push);
  void step(double h, int count);
  const VectorXd& qpos() const { return qpos_; }
  const VectorXd& qvel() const { return qvel_; }
  double cpu() const { return cpu_; }  // of the steps since start(), s

 private:
  struct Talk;
  std::unique_ptr<Talk> talk_;
  VectorXd qpos_, qvel_;
  double cpu_ = 0;
};

}  // namespace bielle::loops
