#pragma once
/// \file Bodies made of simple solids: one list defines both inertia and drawing.
///
/// Homogeneous solids of mass m, about their centres, in their own axes:
///     box a, b, c:            I = m/12 diag(b^2 + c^2, a^2 + c^2, a^2 + b^2)                                   (1)
///     cylinder r, l along z:  I = m diag(r^2/4 + l^2/12, r^2/4 + l^2/12, r^2/2)                                (2)
///     sphere r:               I = 2/5 m r^2 diag(1, 1, 1)                                                      (3)
/// With positive sizes and masses, they and their sums are positive definite and meet the triangle inequality strictly.
#include <string>
#include <vector>

#include "bielle/model/builder.h"

namespace bielle {

struct Solid {
  Visual::Shape shape = Visual::Shape::Box;
  Vector3d size = Vector3d::Zero();  ///< as of a Visual: box: edges; cylinder: radius, length; sphere: radius
  SE3 X_LS;                          ///< placement of its centre in the link
  double mass = 0;                   ///< kg
  Eigen::Vector4d rgba = {0.7, 0.7, 0.7, 1};
};

inline const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ(),
                      kOrigin = Vector3d::Zero();

/// Colours by the function of a part.
namespace colors {
inline const Eigen::Vector4d kShell(0.92, 0.92, 0.90, 1), kFrame(0.62, 0.81, 0.93, 1), kOutput(0.23, 0.38, 0.71, 1),
    kMotor(0.97, 0.53, 0, 1), kSteel(0.55, 0.55, 0.58, 1), kRod(0.80, 0.15, 0.15, 1), kSole(0.25, 0.25, 0.27, 1);
}  // namespace colors

Solid makeBox(const Vector3d& center, const Vector3d& edges, double mass, const Eigen::Vector4d& rgba);
Solid makeSphere(const Vector3d& center, double radius, double mass, const Eigen::Vector4d& rgba);
/// Cylinder along an axis (any length), centred.
Solid makeCylinder(const Vector3d& center, const Vector3d& axis, double radius, double length, double mass,
                   const Eigen::Vector4d& rgba);
/// Round rod from a to b, of `density` kg per metre of its length.
Solid makeRod(const Vector3d& a, const Vector3d& b, double radius, double density, const Eigen::Vector4d& rgba);

/// In the axes of the link, Eqs. (1) to (3).
Inertia calcInertia(const Solid& solid);
Inertia calcInertia(const std::vector<Solid>& solids);

Visual makeVisual(const Solid& solid);

/// Adds a link made of solids, and draws it.
void addSolidLink(const std::string& link, const std::string& parent, const Joint& joint,
                  const std::vector<Solid>& solids, ModelBuilder& builder);
/// Adds solids to a link (or draws them on the ground).
void addSolids(const std::string& link, const std::vector<Solid>& solids, ModelBuilder& builder);

/// Joints at a point of the parent, child axes parallel to the parent's.
Joint makeRevolute(const std::string& name, const Vector3d& place, const Vector3d& axis);
Joint makeUniversal(const std::string& name, const Vector3d& place, const Vector3d& axis1, const Vector3d& axis2);
Joint makeSpherical(const std::string& name, const Vector3d& place);

}  // namespace bielle
