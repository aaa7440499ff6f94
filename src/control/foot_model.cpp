#include "control/foot_model.h"

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {
namespace {

constexpr double kLength = 0.2;           // L of Eq. (2), m
constexpr double kTrunk = 0.1;            // w of Eq. (2), 1
constexpr double kRest = 0.25;            // of Eq. (3): a faster foot is not at rest, m/s
constexpr double kRegularization = 1e-4;  // e of Eq. (2), 1

int countRows(ContactKind kind) { return kind == ContactKind::Point3D ? 3 : 6; }

}  // namespace

FootModel::FootModel(const Model& model)
    : model_(model), trunk_(model.hasFreeFlyer() ? 6 : 0), ws_(model), wrenches_(model.contacts().size()) {
  int rows = 0;
  for (const ContactFrame& contact : model.contacts()) {
    offsets_.push_back(rows);
    rows += countRows(contact.kind);
  }
  const int size = trunk_ + model.nu();
  scales_.setConstant(size, 1 / kLength);
  if (trunk_) scales_.head<6>() << Vector3d::Constant(kTrunk), Vector3d::Constant(kTrunk / kLength);
  for (int m = 0; m < model.nu(); ++m)
    if (model.joints()[model.motors()[m].joint].kind == JointKind::Prismatic) scales_[trunk_ + m] = 1;
  for (MatrixXd* x : {&A_, &standing_}) x->setZero(rows, size);
  motion_.setZero(size);
  normal_.setZero(rows, rows);
  residual_.setZero(size);
  f_.setZero(rows);
  factors_.compute(MatrixXd::Identity(rows, rows));  // sizes it
  for (Vector6d& wrench : wrenches_) wrench.setZero();
}

// Eq. (2)
void FootModel::update(const PassiveJoints& joints, ConstVectorRef q, ConstVectorRef v, ConstVectorRef a,
                       ConstVectorRef u) {
  updatePositions(model_, ws_, q);
  if (wrenches_.empty()) return;
  updateVelocities<double>(model_, ws_, v);
  updateInverseDynamics<double>(model_, ws_, a);
  residual_.setZero();
  for (int k = 0; k < trunk_; ++k) residual_[k] = ws_.b[k];
  residual_.tail(model_.nu()) = -u;
  for (int k = trunk_; k < model_.nv(); ++k)
    joints.visitRow(k, [&](int motor, double entry) { residual_[trunk_ + motor] += entry * ws_.b[k]; });
  residual_.array() *= scales_.array();
  A_.setZero();
  for (size_t c = 0; c < wrenches_.size(); ++c) updateRows(joints, c);
  normal_.noalias() = A_ * A_.transpose();
  normal_.diagonal().array() += kRegularization;
  factors_.compute(normal_);
  f_.noalias() = A_ * residual_;
  factors_.solveInPlace(f_);
  for (size_t c = 0; c < wrenches_.size(); ++c) {
    const ContactFrame& contact = model_.contacts()[c];
    const Matrix3d R = ws_.X_WB[contact.body].R * contact.X_BF.R;
    wrenches_[c].head<3>() = R.transpose() * f_.segment<3>(offsets_[c]);
    if (contact.kind != ContactKind::Point3D)
      wrenches_[c].tail<3>() = kLength * (R.transpose() * f_.segment<3>(offsets_[c] + 3));
  }
}

// Eq. (3), with columns and speeds divided by D, which cancels.
void FootModel::calmFeet(const std::vector<char>& standing, ConstVectorRef twist, VectorRef speeds) {
  if (wrenches_.empty()) return;
  standing_ = A_;
  motion_ << twist.head(trunk_), speeds;
  motion_.array() /= scales_.array();
  f_.noalias() = standing_ * motion_;
  for (size_t c = 0; c < wrenches_.size(); ++c) {
    const int rows = countRows(model_.contacts()[c].kind);
    if (standing[c] && f_.segment(offsets_[c], rows).norm() < kRest) continue;
    standing_.middleRows(offsets_[c], rows).setZero();
    f_.segment(offsets_[c], rows).setZero();
  }
  const auto motors = standing_.rightCols(model_.nu());
  normal_.noalias() = motors * motors.transpose();
  normal_.diagonal().array() += kRegularization;
  factors_.compute(normal_);
  factors_.solveInPlace(f_);
  motion_.tail(model_.nu()).noalias() -= motors.transpose() * f_;
  speeds = motion_.tail(model_.nu()).cwiseProduct(scales_.tail(model_.nu()));
}

// J_i T D about the middle of the foot, in the axes of the world. An edge bears no moment about itself, and may roll.
void FootModel::updateRows(const PassiveJoints& joints, size_t c) {
  const ContactFrame& contact = model_.contacts()[c];
  const Vector3d p = ws_.X_WB[contact.body].act(contact.X_BF.p);
  const int rows = countRows(contact.kind);
  const Vector3d edge = ws_.X_WB[contact.body].R * contact.X_BF.R.col(0);
  for (int k : model_.supportDofs(contact.body)) {
    Vector6d column = ws_.J.col(k);
    column.head<3>() += column.tail<3>().cross(p);
    if (contact.kind == ContactKind::Edge5D) column.tail<3>() -= edge.dot(column.tail<3>()) * edge;
    column.tail<3>() *= kLength;
    if (k < trunk_)
      A_.block(offsets_[c], k, rows, 1) += scales_[k] * column.head(rows);
    else
      joints.visitRow(k, [&](int motor, double entry) {
        A_.block(offsets_[c], trunk_ + motor, rows, 1) += scales_[trunk_ + motor] * entry * column.head(rows);
      });
  }
}

}  // namespace bielle
