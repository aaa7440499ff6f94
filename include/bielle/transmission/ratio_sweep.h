#pragma once
/// \file The reduction ratio of a linkage along its way, and over the ranges of two joints (the paper's figure of the
/// reduction ratio).
///
/// One joint is swept, the others of the linkage stand still: a curve q(s) of closed configurations, s its length
/// over all dofs of the block (rad and m alike). With C a unit vector such that the held joints do not move, N_held C = 0,
///     dq/ds = N C.                                                                                                  (1)
/// The curve is followed by steps along (1), corrected onto the closures and the held angles, in both directions from the
/// start until a joint reaches its limit, the closures lose rank or do not close, or the linkage comes back to its start
/// after a full turn. It runs through dead points without notice: they are roots along s of
///     joint:  v_j(s) = N_j C,        motor:  det [N_M C, N_M H](s),   N_held H = I,                                 (2)
/// found by bracketing. At a dead point of the joint the angle turns back: what follows is another branch of the ratio as
/// a function of the joint angle. Branch 0 holds the start.
#include <string>
#include <vector>

#include "bielle/transmission/linkage.h"

namespace bielle {

enum class DeadPointKind { None, Joint, Motor };
/// "", "joint", "motor"
const char* getName(DeadPointKind kind);

struct RatioSample {
  double s = 0;        ///< length along the curve from the start
  int branch = 0;      ///< counted by dead points of the joint from the start
  VectorXd joints;     ///< m, angles of the linkage's joints (m where prismatic), not wrapped
  VectorXd motors;     ///< m
  LinkageRatio ratio;  ///< at a dead point of the joint: infinite R and condition, zero dR
  DeadPointKind dead = DeadPointKind::None;
  bool loses_rank = false;  ///< the loops can go on in several ways there; the ratio is that of the way that was come
  VectorXd q;               ///< configuration of the block; empty for a direct linkage
};

struct SweepOptions {
  double step = 0.02;        ///< largest step along the curve, rad or m (norm over all dofs of the block)
  double length = 200;       ///< the curve ends there at the latest
  double tolerance = 1e-12;  ///< of dead points and limits, along the curve
};

struct RatioSweep {
  int joint = 0;                     ///< which joint of the linkage is swept
  std::vector<RatioSample> samples;  ///< in increasing s, dead points among them
  std::string begin, end;            ///< why the curve ends there
  bool full_turn = false;            ///< both ends are the same configuration

  std::vector<RatioSample> getDeadPoints() const;
};

/// \param q  closed configuration of the whole model to start from
/// \param joint  which joint of the linkage is swept, the others keep their angles of q
/// \throws ModelError when the start is a dead point of the joint that is swept
RatioSweep sweepRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int joint = 0,
                      const SweepOptions& options = {});

/// R over the ranges of both joints of a linkage of mobility two, as far as they can be reached without crossing a dead point:
/// rows of equal angle of the first joint, along each of which the second joint is swept.
struct RatioMap {
  std::vector<double> first, second;  ///< angles of the grid
  std::vector<std::vector<RatioSample>>
      rows;                              ///< per angle of `first`, what is reached, in increasing angle of the second
  std::vector<RatioSample> dead_points;  ///< where the rows, and the way from row to row, end
};
/// \param count  angles of the first joint; those of the second have the same spacing
RatioMap mapRatio(const Model& model, const Linkage& linkage, ConstVectorRef q, int count = 25,
                  const SweepOptions& options = {});

}  // namespace bielle
