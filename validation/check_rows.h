#pragma once
// Parts of checkMotion: the worst value of a quantity, and groups of rows.
#include <cmath>
#include <limits>

#include "check.h"
#include "check_trace.h"

namespace bielle::validation {

// The worst of many values and its node: the largest for an upper bound, the least for a lower one.
class Worst {
 public:
  explicit Worst(CheckRow::Kind kind = CheckRow::Kind::AtMost) : Worst(kind, kind) {}
  // `judged`: the kind of the row, a note perhaps.
  Worst(CheckRow::Kind kind, CheckRow::Kind judged) : kind_(kind), judged_(judged) {}

  // NaN is worse than any number: a computation that fails must not pass.
  void add(double value, int node, const std::string& what = "") {
    const bool worse = std::isnan(value) || (kind_ == CheckRow::Kind::AtLeast ? value < value_ : value > value_);
    if (!empty() && (std::isnan(value_) || !worse)) return;
    value_ = value;
    node_ = node;
    what_ = what;
  }
  bool empty() const { return node_ < 0; }
  double value() const { return value_; }
  int node() const { return node_; }

  // "node 96, 1.440 s, knee_left"
  std::string describePlace(const CheckedMotion& motion) const;
  // `nothing`: the note of a row without value, if nothing was added.
  CheckRow makeRow(const std::string& name, const std::string& unit, double bound, const CheckedMotion& motion,
                   const std::string& nothing = "") const;

 private:
  CheckRow::Kind kind_, judged_;
  double value_ = 0;
  int node_ = -1;
  std::string what_;
};

// Input and output of the functions that make a group of rows.
struct CheckContext {
  const CheckedMotion& motion;
  const MotionTrace& trace;
  const CheckBounds& bounds;
  std::vector<CheckRow>& rows;

  const Model& model() const { return motion.model; }
  void add(const Worst& worst, const std::string& name, const std::string& unit, double bound,
           const std::string& nothing = "") {
    rows.push_back(worst.makeRow(name, unit, bound, motion, nothing));
  }
};

void addDynamicsRows(CheckContext& context);
void addStateRows(CheckContext& context);
void addWorkRow(CheckContext& context);
void addEnergyRows(CheckContext& context);
void addStanceRows(CheckContext& context);
void addSwingRows(CheckContext& context);
void addShapeRows(CheckContext& context);
void addLinkageRows(CheckContext& context);
void addForceRows(CheckContext& context);
void addLimitRows(CheckContext& context);
void addGoalRows(CheckContext& context);

// \param more  digits beside the usual ones
std::string formatNumber(double value, int more = 0);
// How many more digits it takes to tell two numbers apart.
int countMoreDigits(double a, double b);

}  // namespace bielle::validation
