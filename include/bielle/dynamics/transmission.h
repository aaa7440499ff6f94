#pragma once
/// \file The transmission of a linkage, and how far the linkage is from its dead points.
///
/// A linkage is here a loop cluster with as many motors as mobility m (up to 6). N (n x m) is an orthonormal basis of
/// its closed motions, N_M its rows of the motors, and O N the motion of what the linkage is there for, its output: its
/// serial joints, where there are m of them; else the bodies that carry other joints, soles or (if there are none of
/// these) frames, by their twists relative to the body that carries the linkage, with lengths over the size of the
/// linkage. Of the volumes
///     s_M = |det N_M|,    s_O = sqrt(det (O N)^T (O N))                                                            (1)
/// the first vanishes at dead points of the motors, where the linkage moves though its motors stand, and the second at
/// dead points of the output, which stands still while motors move. With T = N N_M^{-1} and Q = O T, the transmission
/// is
///     rho = +-s_O / s_M = +-sqrt(det Q^T Q), over that at a reference,                                             (2)
/// with the sign of det Q_0^T Q: 1 at the reference, 0 at a dead point of the output, infinite at one of the motors.
/// J T = 0 and T_M = 1 hold everywhere, so that with J' and O' the changes of the closure Jacobian and of O
///     dT = -(I - T P_M) J^+ J' T,    drho = rho tr(Q^+ dQ) = rho sum_j (Q^+ O' - y^T J')_j t_j,
///     y_j^T = e_j^T Q^+ O (I - T P_M) J^+,                                                                         (3)
/// t_j being the columns of T and P_M the selection of the motors' rows. None of this depends on the basis or on the metric.
#include <memory>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct LoopBases;

/// The nearest dead point of a linkage. \see findDeadPoint
struct DeadPoint {
  enum class Kind { None, Output, Motors } kind = Kind::None;
  /// The largest way of a motor or of a serial joint to there, rad (m where prismatic); of a linkage without serial
  /// joints, of any hinge or slider. Infinite if there is none within kFarthestDeadPoint.
  double distance = 0;
};
inline constexpr double kFarthestDeadPoint = 0.5;

/// A linkage with its transmission. Copies share their data; functions may be called from several threads at once.
struct Transmission {
  std::string output;  ///< names of the serial joints, or of the bodies
  std::shared_ptr<const class TransmissionMap> data;
};

/// The transmissions of all loop clusters with as many motors as mobility. \param q_reference  nq, closed
/// \throws ModelError when the reference is open or a dead point
std::vector<Transmission> listTransmissions(const Model& model, ConstVectorRef q_reference);

/// Eq. (2) at a closed configuration (nq); 0 where the closures lose rank.
/// \param bases  of that configuration, where they are known already
double calcTransmission(const Transmission& transmission, const Model& model, ConstVectorRef q,
                        const LoopBases* bases = nullptr);
/// The same with its derivative by the motors (nu), which the other joints follow.
double calcTransmission(const Transmission& transmission, const Model& model, ConstVectorRef q, VectorRef gradient);
/// Eq. (3): a row of nv, of which the entries of the linkage are written.
void calcTransmissionJacobian(const Transmission& transmission, const Model& model, ConstVectorRef q, MatrixRef row,
                              const LoopBases* bases = nullptr);

/// The nearest dead point from a closed configuration (nq), found by Newton's method on the volumes (1) along closed
/// configurations: both ways with a mobility of one, else along the steepest descent of each.
DeadPoint findDeadPoint(const Transmission& transmission, const Model& model, ConstVectorRef q);

}  // namespace bielle
