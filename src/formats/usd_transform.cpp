#include "formats/usd_transform.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "math/constants.h"
#include "math/so3.h"

namespace bielle {
namespace {

std::string describeUsd(const UsdPrim& prim, int line) {
  return "prim '" + prim.getPath() + "' (line " + std::to_string(line) + ")";
}

UsdTransform toTransform(const Matrix3d& R) {
  UsdTransform M = UsdTransform::Identity();
  M.topLeftCorner<3, 3>() = R;
  return M;
}

Matrix3d makeTurn(char axis, double degrees) {
  return makeAxisRotation(Vector3d::Unit(axis - 'X'), degrees * kPi / 180);
}

Matrix3d toRotation(const std::vector<double>& wxyz) {
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  return q.norm() > 0 ? q.normalized().toRotationMatrix() : Matrix3d::Identity();
}

// rotateXYZ: about x first.
bool isOrder(const std::string& kind) {
  return kind == "XYZ" || kind == "XZY" || kind == "YXZ" || kind == "YZX" || kind == "ZXY" || kind == "ZYX";
}

class Operation {
 public:
  Operation(const std::string& path, const UsdPrim& prim, const std::string& name)
      : path_(path), prim_(prim), name_(name) {}

  UsdTransform calc() const {
    const std::string kind = name_.substr(0, name_.find(':', 8)).substr(8);  // behind "xformOp:"
    UsdTransform M = UsdTransform::Identity();
    if (kind == "translate") {
      const std::vector<double> p = get({0, 0, 0});
      M.topRightCorner<3, 1>() = Vector3d(p[0], p[1], p[2]);
    } else if (kind == "scale") {
      const std::vector<double> s = get({1, 1, 1});
      M.diagonal().head<3>() = Vector3d(s[0], s[1], s[2]);
    } else if (kind == "orient") {
      M = toTransform(toRotation(get({1, 0, 0, 0})));
    } else if (kind == "transform") {
      const std::vector<double> rows = get({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
      M = Eigen::Map<const UsdTransform>(rows.data());  // its rows are our columns
    } else if (kind.size() == 7 && kind.substr(0, 6) == "rotate" && kind[6] >= 'X' && kind[6] <= 'Z') {
      M = toTransform(makeTurn(kind[6], get({0})[0]));
    } else if (kind.size() == 9 && kind.substr(0, 6) == "rotate" && isOrder(kind.substr(6))) {
      const std::vector<double> angles = get({0, 0, 0});
      Matrix3d R = Matrix3d::Identity();
      for (size_t i = 6; i < 9; ++i) R = makeTurn(kind[i], angles[static_cast<size_t>(kind[i] - 'X')]) * R;
      M = toTransform(R);
    } else {
      failUsd(path_, prim_, "its xformOpOrder has the unknown operation '" + name_ + "'",
              "write it by translate, orient and scale");
    }
    return M;
  }

 private:
  std::vector<double> get(std::vector<double> otherwise) const {
    return getUsdNumbers(path_, prim_, name_, std::move(otherwise));
  }

  const std::string& path_;
  const UsdPrim& prim_;
  const std::string& name_;
};

}  // namespace

void failUsd(const std::string& path, const UsdPrim& prim, const std::string& problem, const std::string& remedy) {
  throw InputError(path, describeUsd(prim, prim.line), problem, remedy);
}

void failUsd(const std::string& path, const UsdPrim& prim, const UsdProperty& property, const std::string& problem,
             const std::string& remedy) {
  throw InputError(path, describeUsd(prim, property.line), std::string(property.name) + " " + problem, remedy);
}

std::vector<double> getUsdNumbers(const std::string& path, const UsdPrim& prim, std::string_view property,
                                  std::vector<double> otherwise, bool may_be_infinite) {
  const UsdProperty* found = prim.find(property);
  for (const UsdProperty& other : prim.properties)
    if (!found && other.name == property && !other.suffix.empty())
      failUsd(path, prim, other, "has no value of its own (." + std::string(other.suffix) + ")",
              "give it the value at the start");
  if (!found) return otherwise;
  const std::optional<std::vector<double>> numbers = parseUsdNumbers(found->value);
  const std::string what =
      otherwise.size() == 1 ? "a finite number" : std::to_string(otherwise.size()) + " finite numbers";
  bool is_good = numbers && numbers->size() == otherwise.size();
  for (size_t i = 0; is_good && i < numbers->size(); ++i)
    is_good = may_be_infinite ? !std::isnan((*numbers)[i]) : std::isfinite((*numbers)[i]);
  if (!is_good) failUsd(path, prim, *found, "is not " + what, "correct it");
  return *numbers;
}

double getUsdNumber(const std::string& path, const UsdPrim& prim, std::string_view property, double otherwise,
                    bool may_be_infinite) {
  return getUsdNumbers(path, prim, property, {otherwise}, may_be_infinite)[0];
}

Vector3d getUsdVector(const std::string& path, const UsdPrim& prim, std::string_view property,
                      const Vector3d& otherwise) {
  const std::vector<double> v = getUsdNumbers(path, prim, property, {otherwise.x(), otherwise.y(), otherwise.z()});
  return {v[0], v[1], v[2]};
}

Matrix3d getUsdRotation(const std::string& path, const UsdPrim& prim, std::string_view property) {
  return toRotation(getUsdNumbers(path, prim, property, {1, 0, 0, 0}));
}

std::string getUsdText(const UsdPrim& prim, std::string_view property, char quote) {
  const UsdProperty* found = prim.find(property);
  const std::vector<std::string> texts = found ? listUsdStrings(found->value, quote) : std::vector<std::string>();
  return texts.empty() ? "" : texts[0];
}

UsdTransform calcUsdTransform(const std::string& path, const UsdPrim& prim, bool& resets) {
  resets = false;
  UsdTransform M = UsdTransform::Identity();
  const UsdProperty* order = prim.find("xformOpOrder");
  if (!order) return M;
  for (std::string name : listUsdStrings(order->value)) {
    constexpr const char* kInverse = "!invert!";
    const bool is_inverse = name.rfind(kInverse, 0) == 0;
    if (is_inverse) name = name.substr(std::string(kInverse).size());
    if (name == "!resetXformStack!") {
      resets = true;
      M.setIdentity();
      continue;
    }
    if (name.rfind("xformOp:", 0) != 0)
      failUsd(path, prim, *order, "has '" + name + "', which is no xformOp", "correct it");
    if (std::none_of(prim.properties.begin(), prim.properties.end(),
                     [&](const UsdProperty& p) { return p.name == name; }))
      failUsd(path, prim, *order, "has '" + name + "', which the prim does not have",
              "give it that attribute, or leave it out of the order");
    const UsdTransform own = Operation(path, prim, name).calc();
    if (is_inverse && !(std::abs(own.topLeftCorner<3, 3>().determinant()) > 0))
      failUsd(path, prim, *order, "inverts '" + name + "', which flattens", "correct it");
    M *= is_inverse ? UsdTransform(own.inverse()) : own;
  }
  if (!M.allFinite()) failUsd(path, prim, *order, "makes numbers that are not finite", "give smaller ones");
  return M;
}

Vector3d calcUsdScale(const UsdTransform& M) {
  Vector3d scale = M.topLeftCorner<3, 3>().colwise().norm();
  for (double& factor : scale)
    if (std::abs(factor - 1) < 1e-14) factor = 1;  // of a rotation
  return scale;
}

std::optional<SE3> findUsdPlace(const UsdTransform& M) {
  constexpr double kSkew = 1e-5;  // of float, over a few transforms
  const Vector3d scale = calcUsdScale(M);
  Matrix3d R = M.topLeftCorner<3, 3>();
  for (int i = 0; i < 3; ++i) R.col(i) /= scale[i];
  if (!R.allFinite() || (R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff() > kSkew || R.determinant() < 0)
    return {};
  return SE3(Eigen::Quaterniond(R).normalized().toRotationMatrix(), M.topRightCorner<3, 1>());
}

SE3 calcUsdPlace(const std::string& path, const UsdPrim& prim, const UsdTransform& M) {
  const std::optional<SE3> X = findUsdPlace(M);
  if (!X) failUsd(path, prim, "its transform mirrors, shears or flattens", "keep rotation and positive scale apart");
  return *X;
}

}  // namespace bielle
