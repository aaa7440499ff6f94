#pragma once
/// \file Closing a configuration: find q on all closures that also meets given targets.
///
/// Hard conditions h(q) = 0 (closures, frame targets) and a soft preference for given joint values are met by Newton
/// steps in the tangent space: with H = dh/dq and N a basis of its null space,
///     dq = H^+ (-h) + N z,    z = argmin || W (dq - d) ||,    d = q_ref (-) q, (1)
/// H^+ truncates small singular values and is damped far from the solution; steps are clamped, and halved while |h|
/// grows. The preference fades after some iterations: if the conditions keep q far from q_ref, it can make the iterates
/// cycle. If this stalls, the conditions are approached by continuation: h(q) = (1 - t) h(q_0), t from 0 to 1.
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "bielle/model/error.h"

namespace bielle {

/// A frame to be placed: rows 0-2 its position in the world, rows 3-5 its orientation; rows with mask 0 are free.
struct FrameTarget {
  std::string name;
  int body = 0;
  SE3 X_BF;
  SE3 X_WT;
  Eigen::Matrix<bool, 6, 1> mask = Eigen::Matrix<bool, 6, 1>::Constant(true);
};

/// A contact to be placed, as far as its kind stands firm: a point turns freely, an edge rolls about itself.
FrameTarget makeFrameTarget(const ContactFrame& contact, const SE3& X_WT);

struct AssemblyProblem {
  VectorXd q_ref;    ///< nq, start and preferred configuration
  VectorXd weights;  ///< nv, of the preference for q_ref; empty: all one
  std::vector<FrameTarget> frames;
};

enum class AssemblyStep {
  Preferred,  ///< Eq. (1), by a singular value decomposition
  Shortest    ///< z = 0: the least change per step, by a complete orthogonal decomposition, many times cheaper
};

struct AssemblyOptions {
  AssemblyStep step = AssemblyStep::Preferred;
  double tolerance = 1e-12;  ///< on every closure and target, m and rad
  double step_limit = 0.2;   ///< largest change of a coordinate per step, m or rad
  int max_iterations = 200;  ///< per continuation step
  /// Iterations in which the norm of the conditions has to fall by three tenths, while it is above 1e-6; 0: no such limit. With
  /// one, targets out of reach are refused sooner, and so are those that are only reached past worse postures.
  int patience = 0;
  int continuation_steps = 20;
  /// Singular values of H below this, relative to the largest, count as zero. It is above the square root of rounding,
  /// where second-order residuals would be mistaken for directions, and a tenth of kRankTolerance (reduction.h), so
  /// that a linkage that counts as movable can be moved.
  double rank_tolerance = 1e-7;
};

struct AssemblyResult {
  NumericalStatus status = NumericalStatus::NotClosed;
  VectorXd q;           ///< nq, the best found
  std::string message;  ///< names the worst loop or target and its gap when not closed
  int iterations = 0;
  double gap = 0;     ///< largest closure residual, m or rad
  std::string worst;  ///< name of the closure or target with the largest residual
};

/// Whole turns are left out of angles beyond 1e4 rad, which are rounded by more than the tolerance, where nothing counts them, as
/// ranges, springs and couplers do.
AssemblyResult assemble(const Model& model, const AssemblyProblem& problem, const AssemblyOptions& options = {});

/// Nearest closed configuration to q, without other targets.
AssemblyResult closeConfiguration(const Model& model, ConstVectorRef q, const AssemblyOptions& options = {});

/// A closed configuration of the robot. Starts from its references, the configuration nearest to neutral, then from
/// points farther and farther from neutral (the same at every call). If none closes, returns the attempt with the
/// smallest gap.
AssemblyResult findClosedConfiguration(const Model& model, const AssemblyOptions& options = {});

/// The assembly problem of a reference of the robot's file: preferred joint values, feet flat at their places, height.
/// A free base that is not given is over the middle of the feet, with the attitude in which its soles on unbent legs lie flat (rounded
/// to right angles where the given joint angles allow it), and faces as they do, so that the posture does not depend on where the robot stands. A foot without a yaw is free to turn about the
/// vertical where an angle but 0 of a joint of its leg about the vertical is given; else it faces as the base does, where
/// that is given, or else as the robot has to turn for its feet to lie as near as possible to their places (two: across or
/// along the line between them; more: a fit in the plane, in the least-squares sense; a single foot faces x).
AssemblyProblem makeReferenceProblem(const Model& model, const Reference& reference);
/// Assembled reference by name.
/// \throws InputError when there is no such reference
AssemblyResult assembleReference(const Model& model, const std::string& name, const AssemblyOptions& options = {});

/// A joint that a reference gives: its q there and in an assembled configuration.
struct ReferenceJoint {
  int joint = 0;  ///< body/joint index
  VectorXd given, assembled;
  double moved = 0;  ///< largest difference of a coordinate, rad or m
};

/// The joints of a reference but for the free-flyer, which stands where height and feet put it. Their values are preferences:
/// closures, height and feet come first.
std::vector<ReferenceJoint> listReferenceJoints(const Model& model, const Reference& reference, ConstVectorRef q);

/// Closest velocity (in the least-squares sense over v) that keeps all closures of the set closed.
VectorXd projectVelocity(const Model& model, Workspace& ws, const ConstraintSet& constraints, ConstVectorRef q,
                         ConstVectorRef v);

/// Largest residual of the loops of the set at the workspace's q; the name of its closure goes to `worst`, if given.
double calcLargestGap(const Workspace& ws, const ConstraintSet& constraints, std::string* worst = nullptr);

/// The error for a robot without a closed configuration according to findClosedConfiguration().
/// \param source  file or name of the robot
InputError makeClosingError(const Model& model, const std::string& source, const AssemblyResult& open);

}  // namespace bielle
