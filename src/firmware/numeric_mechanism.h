#pragma once
// The equations of a mechanism, as formulas and in numbers.
#include "firmware/mechanism.h"

namespace bielle::firmware {

// The formulas of all equations, and their derivatives by some coordinates.
std::vector<Scalar> listRows(const Mechanism& mechanism);
MatrixXs derive(const std::vector<Scalar>& rows, const std::vector<int>& columns);
// Row by row.
std::vector<Scalar> listEntries(const MatrixXs& A);
Eigen::MatrixXd toMatrix(const std::vector<double>& entries, Eigen::Index rows, Eigen::Index columns);
// z, and zeros for gravity and velocities.
std::vector<double> toInputs(const Mechanism& mechanism, const Eigen::VectorXd& z);
// begin, .., end - 1
std::vector<int> listRange(int begin, int end);

// Closed postures, one a row, in the coordinates of a mechanism.
using Postures = std::vector<Eigen::VectorXd>;

// The equations in numbers. Redundant rows do no harm here: steps are the shortest in the sense of least squares.
class NumericMechanism {
 public:
  explicit NumericMechanism(const Mechanism& mechanism);

  // Newton's method on the coordinates that are not given. False if it does not converge to 1e-13.
  bool close(const std::vector<int>& given, Eigen::VectorXd& z) const;
  // Independent motions minus `size`: 0 if the equations leave the linkage no more and no less mobility than it has.
  int calcExcess(const Eigen::VectorXd& z) const;

  struct Rates {
    Eigen::MatrixXd R;    // motors over joints
    double distance = 0;  // to the next dead point, as the code estimates it
  };
  Rates calcRates(const Eigen::VectorXd& z) const;

 private:
  Eigen::MatrixXd calcJacobian(const Eigen::VectorXd& z) const;
  const Mechanism& mechanism_;
  Program rows_, jacobian_, drift_;
  Eigen::Index num_rows_ = 0;
};

// An estimate by a step of Newton's method on the determinants D_J, D_M of the equations in the coordinates but the joints, and but
// the motors. The first vanishes at dead points of the output, the second at those of the motors, det R = +-D_M / D_J; both do
// where loops can go on in several ways. With g = d log D_J / dq_J, or g_k + tr(R^-1 dR/dq_k) of D_M, the way to there is 1/|g| in
// the joints and 1/|R^-T g| in the motors, of which the larger one counts.                                           (3)
// \param g  that of D_J
double calcDistance(const Eigen::MatrixXd& R, const std::vector<Eigen::MatrixXd>& dR, const Eigen::VectorXd& g);

}  // namespace bielle::firmware
