#pragma once
/// \file The maps of linkages as `bielle convert --to c` writes them (bielle/firmware/firmware.h), compiled by the C compiler
/// of this machine and loaded: what a robot's firmware makes of what a controller of the serial model measures and commands.
#include <memory>
#include <vector>

#include "bielle/firmware/firmware.h"
#include "bielle/motion/serial_model.h"

namespace bielle::worlds {

/// \throws InputError when there is no C compiler: before what takes long
void requireCompiler();

/// The maps for a plan, in C and double.
/// \param planned  configurations of the serial model: the range of each joint goes 0.2 rad or m beyond them; limits end it, and
/// where that of a linkage contains a dead point, half as far, and so on to 0.025
/// \throws InputError when there are none
FirmwareText formatMaps(const Model& closed, const SerialModel& serial, const std::vector<VectorXd>& planned);

/// Joints that no linkage drives are passed on as they are. Copies share the code; each has postures of its own, from which the next
/// ones are found.
class GeneratedMaps {
 public:
  struct Counts {
    long measured = 0;              ///< postures of linkages
    long clamped = 0;               ///< of these, out of the range of the maps
    long not_reached = 0;           ///< of these, no posture of the linkage
    double largest_difference = 0;  ///< of a joint from the one measured, rad or m
  };

  /// At the reference of the serial model. Allocates, compiles, and leaves no file behind.
  /// \param text  of formatMaps()
  /// \throws InputError when a linkage of the serial model has no maps, there is no compiler, or it fails
  GeneratedMaps(const Model& closed, const SerialModel& serial, Belief belief, const FirmwareText& text);

  /// From the motors in a state of the closed robot (nq, nv) to the joints of its linkages in one of the serial model, whose other
  /// entries stay. Belief::Serial takes the ratios there.
  void measure(ConstVectorRef q, ConstVectorRef v, VectorRef q_s, VectorRef v_s);
  /// The other way: what the motors are commanded.
  void lead(ConstVectorRef q_s, ConstVectorRef v_s, VectorRef q, VectorRef v);
  /// From torques of the joints (nu of the serial model) to those of the motors (nu of the closed one), with the ratios taken last.
  void calcTorques(ConstVectorRef tau, VectorRef u) const;

  const Counts& counts() const { return counts_; }

 private:
  class Code;
  struct Map {
    size_t function;                                       // of the code
    std::vector<int> motor_positions, motor_dofs, motors;  // of the closed model
    std::vector<int> joint_positions, joint_dofs, joints;  // of the serial one; the last are its motors
    std::vector<double> state;                             // memory of the code
  };

  std::shared_ptr<const Code> code_;
  std::vector<Map> maps_;
  std::vector<std::pair<int, int>> direct_;  // motors of the closed model, and the same of the serial one
  int takes_ratio_;
  Counts counts_;
};

}  // namespace bielle::worlds
