#pragma once
/// \file Where prims of USD stand: xformOps.
#include <Eigen/Geometry>

#include "bielle/math/se3.h"
#include "formats/usda.h"

namespace bielle {

/// Placement with scale, as 4x4 on columns of homogeneous coordinates.
using UsdTransform = Eigen::Matrix4d;

/// \throws InputError naming the file, the prim and the property
[[noreturn]] void failUsd(const std::string& path, const UsdPrim& prim, const std::string& problem,
                          const std::string& remedy);
[[noreturn]] void failUsd(const std::string& path, const UsdPrim& prim, const UsdProperty& property,
                          const std::string& problem, const std::string& remedy);
/// `count` finite numbers, or what `otherwise` is; infinite ones pass where `may_be_infinite`.
std::vector<double> getUsdNumbers(const std::string& path, const UsdPrim& prim, std::string_view property,
                                  std::vector<double> otherwise, bool may_be_infinite = false);
double getUsdNumber(const std::string& path, const UsdPrim& prim, std::string_view property, double otherwise,
                    bool may_be_infinite = false);
Vector3d getUsdVector(const std::string& path, const UsdPrim& prim, std::string_view property,
                      const Vector3d& otherwise);
/// A unit quaternion; USD writes the real part first. All zero is none.
Matrix3d getUsdRotation(const std::string& path, const UsdPrim& prim, std::string_view property);
/// The first text, or path with '<', of the property; empty without it.
std::string getUsdText(const UsdPrim& prim, std::string_view property, char quote = '"');

/// The product of its xformOpOrder. \param resets  set if the transforms of its parents do not hold
/// \throws InputError for operations that are unknown, not finite, or change with time
UsdTransform calcUsdTransform(const std::string& path, const UsdPrim& prim, bool& resets);
/// Lengths of its columns: the scale along the axes of the prim.
Vector3d calcUsdScale(const UsdTransform& M);
/// Its place without the scale; none where it mirrors, shears or flattens.
std::optional<SE3> findUsdPlace(const UsdTransform& M);
/// \throws InputError where there is none
SE3 calcUsdPlace(const std::string& path, const UsdPrim& prim, const UsdTransform& M);

}  // namespace bielle
