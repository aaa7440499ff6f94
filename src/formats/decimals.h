#pragma once
/// \file By how much the numbers of a file may be rounded, from how they are written.
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "dynamics/rounded_linkages.h"

namespace tinyxml2 {
class XMLElement;
}

namespace bielle {

/// Digits of numbers. Files have a number of decimals, or of significant digits (printf's %.6f and %.6g): half a unit is that of the
/// last of the most decimals, or of the most significant digits (of four or more), whichever is larger. Numbers that are those of
/// float, printed with more digits than it has, are off by half of its last bit. Angles and directions that are rounded from multiples
/// of 15 degrees, their sines or cosines are off by half a unit of their own last digits, whatever the others have (1.5708 beside
/// 3.141592653589793). Numbers in different units are written differently: of degrees and directions, what is coarser counts.
class Decimals {
 public:
  enum class Kind { Angles, Lengths };
  explicit Decimals(Kind kind = Kind::Lengths) : kind_(kind) {}
  /// \param text  anything; what is no number is passed over   \param unit  of these numbers
  /// \param are_floats  whether they are floats by the format, however few digits they need
  void add(const std::string& text, double unit = 1, bool are_floats = false);
  int most_digits() const;
  /// 0 without numbers.
  double calcHalfUnit() const;

 private:
  struct Group {
    int most_digits = 0;
    bool all_floats = true;
    double finest = HUGE_VAL;     // unit of the last decimal
    std::vector<double> largest;  // number by its significant digits
    double largest_float = 0;
    double constant = 0;  // the most that a rounded constant may be off
    double calcHalfUnit() const;
  };
  Kind kind_;
  std::map<double, Group> groups_;  // by the unit of their numbers, and in it
};

/// Of the placements and axes of joints, of bodies, sites and frames and of the loops in a document: in URDF, MJCF or SDF.
class GeometryDecimals {
 public:
  /// \param degrees  whether Euler's angles of MJCF are in degrees
  void add(const tinyxml2::XMLElement& root, bool degrees = false);
  RoundingTolerance calcTolerance() const { return {angles_.calcHalfUnit(), lengths_.calcHalfUnit(), false, {}}; }

 private:
  Decimals angles_{Decimals::Kind::Angles}, lengths_;
};

}  // namespace bielle
