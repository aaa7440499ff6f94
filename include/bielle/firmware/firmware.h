#pragma once
/// \file The maps of a robot's linkages as code that runs in firmware: positions, speeds, torques, gains and limits from joints to
/// motors and back.
///
/// Formulas are built once, from the geometry of the robot, and printed. Where a linkage has a closed form (a plane four-bar, a
/// slider-crank, motors of rods on balls for given joints) it is that; the rest is Newton's method, started by polynomials of the
/// given coordinates, with a fixed number of iterations. The largest errors over the range against the mechanism with all its bodies
/// and closures (reduction.h) are measured as the code is made.
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/linkage.h"

namespace bielle {

/// Ros2Control: C++, and plug-ins that are transmissions of ros2_control.
enum class FirmwareLanguage { C, Cpp, NumPy, Torch, Ros2Control };

struct FirmwareOptions {
  FirmwareLanguage language = FirmwareLanguage::C;
  bool is_single = false;  ///< float instead of double; C and C++
  int postures = 100000;   ///< at which errors are measured, from 100
  /// Range of a joint by name, rad or m. Others have the limits of the robot's file, or where there are none, the largest range
  /// around q that stays kNearDeadPoint away from dead points, up to half a turn either way.
  std::map<std::string, std::pair<double, double>> ranges;
};

/// A linkage that has maps.
struct FirmwareLinkage {
  std::string name;                         ///< of its files, and before the names of C in them
  std::vector<std::string> joints, motors;  ///< in the order of its arrays
};

struct FirmwareText {
  std::map<std::string, std::string> files;  ///< by name
  std::vector<FirmwareLinkage> linkages;
  std::vector<std::string> warnings;  ///< linkages that are left out
};

/// The maps of all linkages whose output is joints.
/// \param q  closed configuration (nq): it determines the branch
/// \throws InputError when there is no such linkage, the range of a joint contains a dead point or another branch, a name is no C
/// identifier, or an option names no joint of a linkage
FirmwareText formatFirmware(const Model& model, ConstVectorRef q, const FirmwareOptions& options = {});

}  // namespace bielle
