#pragma once
/// \file Why loops do not close: a smallest set of conflicting closures, and the smallest change of one place of the
/// mechanism that closes them.
///
/// Let r(q) be the residuals of the closures of a cluster, angles taken times a length L so that all are in m. Where
/// they cannot close, |r|^2 has a minimum other than zero,
///     J^T r = 0,    J = dr/dq                                                                                      (1)
/// so that r is a self-stress: forces of the closures that no joint feels. Closures without a share in it do not
/// matter. From the others, each closure is removed in turn if the rest still does not close without it (a deletion
/// filter). The remaining set is a smallest conflict: it closes without any one of its closures.
///
/// A change p of one place (m; angles times L) alters the residuals by P p to first order (variation.h). Multiplying
/// r + J dq + P p = 0 by r^T, by Eq. (1),
///     |p| >= |r|^2 / |P^T r|                                                                                       (2)
/// which orders the places. For the first of them the least change is found exactly,
///     min |p|^2 / 2 over q and p,  such that r(q, p) = 0                                                           (3)
/// by an augmented Lagrangian whose minima are found by Newton's method: with the curvature of the loops, because at a
/// stretched linkage J alone does not determine q. All minima are local ones. A change is offered only after the changed
/// model has been made and closed by assemble() to 1e-9.
#include "bielle/dynamics/assembly.h"

namespace bielle {

/// A place of the mechanism: of a joint in the body that carries it, of an end of a closure in its body, or the offset
/// of a coupler or length of a distance.
struct ModelPlace {
  enum class Kind { Joint, Frame1, Frame2, Offset } kind = Kind::Joint;
  int index = 0;  ///< body/joint index, or index into Model::closures()
};

/// A change of one place: its placement X becomes X * change; an offset has `offset` added.
struct LoopRemedy {
  ModelPlace place;
  SE3 change;         ///< a translation or a rotation
  double offset = 0;  ///< of a coupler, or the length of a distance, m
  double size = 0;    ///< translation or length, m; or angle or offset of a coupler times L of Eq. (1)
};

struct LoopConflict {
  std::vector<int> closures;         ///< indices of the smallest conflict found, increasing
  VectorXd q;                        ///< nq, of Eq. (1)
  double gap = 0;                    ///< largest residual of the cluster there, m or rad
  int worst = 0;                     ///< the closure of the conflict with that, or the largest, gap
  std::vector<LoopRemedy> remedies;  ///< of different places, smallest first, at most three
};

/// One conflict per cluster of loops that does not close near q, those with larger gaps first; empty if all close.
std::vector<LoopConflict> findLoopConflicts(const Model& model, ConstVectorRef q);

/// The model with the remedy applied.
Model applyRemedy(const Model& model, const LoopRemedy& remedy);

/// One sentence on the conflict, and one on its remedies: empty if there are none.
std::string describeConflict(const Model& model, const LoopConflict& conflict);
std::string describeRemedies(const Model& model, const LoopConflict& conflict);

}  // namespace bielle
