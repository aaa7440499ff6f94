#pragma once
/// \file Closing loops while some coordinates are held; from joints to the motors that drive them, and back.
///
/// On the closed configurations of a linkage with the basis N of its closed motions (linkage.h), the held coordinates q_X go
/// to what they are asked to be, x, by least squares (Levenberg and Marquardt) along the closed motions; of joints with several
/// coordinates, x - q_X is in tangent coordinates (notation.h):
///     dq = N z,    (N_X^T N_X + lambda 1) z = N_X^T (x - q_X),                                                      (1)
/// each step closed again. Without lambda it is Newton's method, or, where fewer coordinates are held than the linkage has
/// freedoms, its shortest step. What is out of reach has a stationary distance at a dead point of what is held, where N_X
/// loses rank: (1) goes there, and lambda grows.
#include <memory>
#include <string>
#include <vector>

#include "bielle/dynamics/assembly.h"

namespace bielle {

/// Whether held coordinates are where they are asked to be.
struct HeldResult {
  /// Ok; NearDeadPoint: they are, but there they hardly determine the linkage, whose other coordinates may go either way;
  /// NotClosed: they are at the nearest values in reach; NotFinite: nothing was written
  NumericalStatus status = NumericalStatus::Ok;
  double gap = 0;  ///< the largest distance from what is asked for, of one tangent coordinate, rad or m
  int joint = -1;  ///< that has it, in Model::joints(); -1 if there is no gap
};

/// Closes one configuration after the other, each from the one before it: of several ways to close, it keeps to one.
/// No function allocates but the constructor.
class LoopCloser {
 public:
  /// \param q     closed configuration (nq) to start from
  /// \param held  names of joints, of any kind
  /// \throws InputError when q is open, or there is no such joint
  LoopCloser(const Model& model, ConstVectorRef q, const std::vector<std::string>& held);
  ~LoopCloser();
  LoopCloser(LoopCloser&&) noexcept;
  LoopCloser& operator=(LoopCloser&&) noexcept;

  /// Closes q (nq): held coordinates stay, those of their linkages that are not held are written, no other is. A held one
  /// that is out of reach is written too: the nearest value in reach. The next call then starts where the last regular one
  /// ended.
  HeldResult close(VectorRef q);
  /// Starts from another closed configuration (nq). False, and nothing changes, if it is open by more than 1e-8
  bool reset(ConstVectorRef q);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// Positions of all motors for those of the joints that they drive, and back: what firmware needs. Each call starts from the
/// configuration of the one before it. No function allocates but the constructor.
class LinkageMap {
 public:
  /// \param q  closed configuration (nq) to start from
  /// \throws InputError when q is open, or a linkage has not as many serial joints (Model::serialJoints) as motors
  LinkageMap(const Model& model, ConstVectorRef q);
  ~LinkageMap();
  LinkageMap(LinkageMap&&) noexcept;
  LinkageMap& operator=(LinkageMap&&) noexcept;

  /// Indices in Model::joints(), one per motor: the serial joints of all linkages, and joints with motors of their own, in the
  /// order of the model.
  const std::vector<int>& joints() const;
  /// \param joints  positions (nu), rad or m   \param motors  theirs, in the order of u (nu), rad or m
  HeldResult calcMotors(ConstVectorRef joints, VectorRef motors);
  /// The reverse.
  HeldResult calcJoints(ConstVectorRef motors, VectorRef joints);
  /// Configuration (nq) of the last call; joints that are not driven are where they were at the start.
  const VectorXd& q() const;
  bool reset(ConstVectorRef q);  ///< as for LoopCloser

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// The closed configuration nearest to q (nq) among those in which the held joints are where they are in q.
/// \return NotClosed if there is none: then q has them at the nearest values in reach, and the message gives joint, gap and
/// that value
/// \throws InputError when there is no such joint
AssemblyResult closeConfiguration(const Model& model, ConstVectorRef q, const std::vector<std::string>& held,
                                  const AssemblyOptions& options = {});

}  // namespace bielle
