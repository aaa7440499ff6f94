#pragma once
/// \file Lines of a file of USD in text form, their numbers, and names of its prims.
#include <set>
#include <string>
#include <vector>

#include "bielle/math/se3.h"
#include "formats/robot_text.h"
#include "formats/usda.h"
#include "math/direction.h"
#include "math/settled.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {

inline std::string formatTuple(const Vector3d& v) { return "(" + formatExact(v, ", ") + ")"; }

inline std::string formatQuaternion(const Matrix3d& R) {
  Eigen::Quaterniond q(settleRotation(R));
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return "(" + formatExact(q.w()) + ", " + formatExact(Vector3d(q.vec()), ", ") + ")";
}

inline std::string listQuoted(const std::vector<std::string>& items) {
  std::vector<std::string> quoted;
  for (const std::string& item : items) quoted.push_back(quoteUsd(item));
  return "[" + listItems(quoted) + "]";
}

// The axis of a joint as one of x, y and z, the nearest one, of a frame that is turned by R.
struct UsdAxis {
  char token = 'Z';
  Matrix3d R = Matrix3d::Identity();
};

inline UsdAxis makeUsdAxis(const Vector3d& axis) {
  const NearestAxis nearest = findNearestAxis(axis);
  Eigen::Index i = 0;
  nearest.axis.cwiseAbs().maxCoeff(&i);
  Matrix3d flip = Matrix3d::Identity();  // by half a turn, where it points the other way
  if (nearest.axis[i] < 0) flip(i, i) = flip((i + 1) % 3, (i + 1) % 3) = -1;
  return {static_cast<char>('X' + i), settleRotation(nearest.turn * flip)};
}

// Names of the prims in one place.
class UsdNames {
 public:
  std::string add(const std::string& name) {
    const std::string own = makeUsdName(name);
    std::string made = own;
    for (int i = 2; !taken_.insert(made).second; ++i) made = own + "_" + std::to_string(i);
    return made;
  }

 private:
  std::set<std::string> taken_;
};

// Lines with indentation. Every prim has its contents on lines of their own, without which some readers lose it.
class UsdLines {
 public:
  void add(const std::string& line) { text_ += (line.empty() ? "" : std::string(4 * depth_, ' ') + line) + "\n"; }
  void set(const std::string& property, const std::string& value) { add(property + " = " + value); }
  void open(const std::string& type, const std::string& name, const std::string& shown,
            const std::vector<std::string>& schemas = {}) {
    add("");
    const bool is_renamed = shown != name;
    add("def " + type + " \"" + name + "\"" + (schemas.empty() && !is_renamed ? "" : " ("));
    ++depth_;
    if (!schemas.empty()) add("prepend apiSchemas = " + listQuoted(schemas));
    if (is_renamed) add("displayName = " + quoteUsd(shown));
    --depth_;
    if (!schemas.empty() || is_renamed) add(")");
    add("{");
    ++depth_;
  }
  void close() {
    --depth_;
    add("}");
  }
  void place(const SE3& X, const std::string& scale = "") {
    set("double3 xformOp:translate", formatTuple(X.p));
    set("quatd xformOp:orient", formatQuaternion(X.R));
    if (!scale.empty()) set("double3 xformOp:scale", scale);
    set("uniform token[] xformOpOrder",
        std::string("[\"xformOp:translate\", \"xformOp:orient\"") + (scale.empty() ? "]" : ", \"xformOp:scale\"]"));
  }
  const std::string& get() const { return text_; }

 private:
  std::string text_;
  size_t depth_ = 0;
};

}  // namespace bielle
