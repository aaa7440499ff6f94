#pragma once
/// \file What sets the worlds of a batch apart, as given and as lanes take it.
#include <string>
#include <vector>

#include "bielle/worlds/batch.h"
#include "dynamics/closure_change.h"
#include "dynamics/reduction.h"

namespace bielle::worlds {

/// \param name  of the matrix, for the message  \throws std::invalid_argument
void requireShape(const Eigen::Ref<const MatrixXd>& x, Eigen::Index rows, Eigen::Index columns, const char* name);

/// Those of the model.
WorldParameters makeParameters(const Model& model, int count, double friction);

/// Takes over those that are not empty, but grounds.
/// \throws std::invalid_argument; nothing has changed then
void takeParameters(const Model& model, const WorldParameters& given, WorldParameters& out);

/// The motor m of a world.
void updateMotor(const WorldParameters& parameters, int m, int world, Motor& motor);

/// The rods of closures of a model, where they may be of other lengths.
class Rods {
 public:
  Rods(const Model& model, const Reduction& reduction);
  /// \param changes  closures x count, m \throws std::invalid_argument where a closure cannot have its change
  void check(const Eigen::Ref<const MatrixXd>& changes) const;
  /// Of one robot, in a lane.
  void write(ConstVectorRef changes, int lane, std::vector<ClosureChangeOf<Lanes>>& out) const;

 private:
  struct Rod {
    std::string closure, refusal;  // why it keeps its length, and what to do, or empty
    double length = 0;             // m
    bool is_distance = false;
    Vector3d shift1 = Vector3d::Zero(), shift2 = Vector3d::Zero();  // per m longer, of the frames in themselves
  };
  std::vector<Rod> rods_;
};

}  // namespace bielle::worlds
