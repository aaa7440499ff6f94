#pragma once
/// \file Many worlds of one robot, for learning and for campaigns: those of makeBielleWorld() (bielle_world.h), as many at once as a
/// register holds numbers.
///
/// One world never disturbs another, to the last bit: results depend neither on the number of threads, nor on which worlds share a
/// register, nor on how many there are. Each halves its own steps, and is masked in Newton's method once its forces are found. They
/// differ from those of a single world by rounding.
#include <memory>
#include <string>
#include <vector>

#include "bielle/worlds/bielle_world.h"

namespace bielle::worlds {

/// What sets each world apart from the model and the ground of all. Matrices have a column per world.
struct WorldParameters {
  MatrixXd mass_factors;   ///< numBodies x count: mass and inertia of a body over those of the model; positive
  MatrixXd armatures;      ///< nu x count, Motor::armature, kg m^2 or kg; not negative
  MatrixXd effort_limits;  ///< nu x count, Motor::effort_limit, N m or N; positive, maybe infinite
  VectorXd friction;       ///< count, Ground::friction; not negative
  VectorXd delays;  ///< count, from step() until its torques act, to the nearest whole time step, s; not negative
  /// count, on which they stand, maybe the same one for several; either all have steps or none, as WorldOptions::ground. Worlds
  /// whose ground changes are to be reset. Their friction is not read.
  std::vector<std::shared_ptr<const Ground>> grounds{};
  /// Windings, nu x count, as in MotorDrive: torque constants k_t, N m/A, 0 where there is none; resistances R, ohm; voltages U of the
  /// supply, V, and currents i, A, both positive, maybe infinite. A motor gives what Motor::clampEffort() says within its effort
  /// limit and e n k_t i, with ratio n and efficiency e of the model; without a winding, R = 0 and U and i are infinite.
  MatrixXd torque_constants{}, resistances{}, voltages{}, currents{};
  /// closures x count: by how much longer than in the model the rod is that a closure ends, or is as a `distance`, m; 0 where a closure
  /// ends none. It grows along the line between its two joints, its mass and inertia stay. Loops must have no redundant rows, which
  /// another length would lock. Worlds whose rods change are not ok() until they are reset.
  MatrixXd rod_changes{};
};

/// What springs hold, J.
struct SpringEnergies {
  double contacts = 0, stops = 0;
};

struct WorldBatchOptions {
  BielleWorldOptions world;
  int threads = 0;  ///< 0: all
};

/// Matrices have a column per world. Not thread-safe.
class WorldBatch {
 public:
  /// All worlds wait for a reset(). \throws InputError as makeBielleWorld(); std::invalid_argument for a count below one
  WorldBatch(const Model& model, int count, const WorldBatchOptions& options = {});
  ~WorldBatch();
  WorldBatch(WorldBatch&&) noexcept;
  WorldBatch& operator=(WorldBatch&&) noexcept;

  /// Sets closed configurations q (nq x count) and velocities v (nv x count) that keep them closed, of all worlds or of those that
  /// `where` (count) marks; their time starts from zero. A world whose loops are open there by more than 1e-6 m or rad is not ok().
  /// Where a world has other rods than the model, its loops are closed from
  /// there, light links moving rather than heavy ones, and a free robot is shifted so that its lowest corner of a sole is as high as
  /// it was; a q that its own loops close stays.
  /// \throws std::invalid_argument for a wrong shape, or a number of theirs that is not finite; nothing has changed then
  void reset(const Eigen::Ref<const MatrixXd>& q, const Eigen::Ref<const MatrixXd>& v,
             const std::vector<char>& where = {});
  /// Advances by a duration, s, under torques of the motors u (nu x count, N m or N), cut at their limits, and a force at the centre of
  /// mass of the pushed body (3 x count), N (world). Worlds that are not ok(), or that `where` (count)
  /// does not mark, stay as they are.
  /// \returns whether all are ok() \throws std::invalid_argument for a wrong shape, or a duration that is not positive
  bool step(const Eigen::Ref<const MatrixXd>& u, const Eigen::Ref<const MatrixXd>& push, double duration,
            const std::vector<char>& where = {});

  /// Changes those parameters that are not empty, of all worlds, from now on: at once, and over reset(). Soles sink, and stops give
  /// way, as deep under another weight as under that of the model (ContactOptions). Torques that are under way still act when they
  /// would have, unless later ones overtake them; the first ones after reset() act at once.
  /// \throws std::invalid_argument for a wrong shape, or a number that cannot be; nothing has changed then
  void set(const WorldParameters& parameters);
  const WorldParameters& parameters() const;  ///< all of them

  const Model& model() const;
  int count() const;
  Eigen::Ref<const MatrixXd> configurations() const;  ///< nq x count
  Eigen::Ref<const MatrixXd> velocities() const;      ///< nv x count
  Eigen::Ref<const MatrixXd> torques() const;         ///< nu x count, those that acted last, as they were cut
  /// Of the ground on the feet in their contact frames, one after the other (6 contacts x count), N and N m.
  Eigen::Ref<const MatrixXd> wrenches() const;
  const VectorXd& times() const;  ///< count, since reset(), s
  /// False from a step on that could not be taken, or whose torques or push were not finite, until reset(): the state is the last
  /// that is closed and balances, and message() says why it is not ok.
  bool ok(int world) const;
  const std::string& message(int world) const;
  Works works(int world) const;              ///< since reset()
  SpringEnergies springs(int world) const;   ///< of contacts and stops, now
  Integration integration(int world) const;  ///< as World::integration()
  /// What the worlds leave out of the model (World::warnings()).
  const std::vector<std::string>& warnings() const;
  /// Rounds of Newton's method so far, of whole registers.
  double rounds() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle::worlds
