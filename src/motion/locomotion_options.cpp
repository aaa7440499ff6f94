// The options of a locomotion by name.
#include "bielle/motion/locomotion.h"

namespace bielle {

void describe(OptionFields& f, LocomotionOptions& o) {
  f.number("start_support", o.timing.start, "s", kNotNegative,
           "least duration of double support before the first step");
  f.number("start_pressure", o.start_pressure, "1", kNotNegative,
           "start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never");
  f.number("single_support", o.timing.single, "s", kNotNegative, "duration with one foot on the ground");
  f.number("double_support", o.timing.both, "s", kNotNegative,
           "duration with both feet on the ground between two steps");
  f.number("end_support", o.timing.end, "s", kNotNegative, "duration of double support after the last step");
  f.number("time_step", o.timing.time_step, "s", kNotNegative,
           "length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings");
  f.number("swing_height", o.swing.height, "m", kNotNegative,
           "apex of the swing foot above the higher end of its path");
  f.number("swing_apex", o.swing.apex, "1", kNotNegative, "time of the apex as a fraction of the swing, from 0 to 1");
  f.number("swing_leave", o.swing.leave, "1", kNotNegative,
           "time at which the swing foot starts to move horizontally, from 0 to 1");
  f.number("swing_arrive", o.swing.arrive, "1", {0, 1},
           "time at which the swing foot is above its foothold, from 0 to 1");
  f.flag("rigid_landing", o.rigid_landing, "a rigid impact at every landing, as a separate stage");
  f.number("landing_speed", o.landing_speed, "m/s", kNotNegative,
           "with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest");
  f.number("foothold_room", o.foothold_room, "m", kNotNegative,
           "largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it");
  f.number("heading_weight", o.heading_weight, "1", kNotNegative,
           "keep the heading of the feet, within the state regularization");
  f.number("com_weight", o.com_weight, "1/m^2", kNotNegative, "horizontal position of the centre of mass");
  f.number("com_height_weight", o.com_height_weight, "1/m^2", kNotNegative, "height of the centre of mass");
  f.number("com_velocity_weight", o.com_velocity_weight, "s^2/m^2", kNotNegative,
           "velocity of the centre of mass in the direction of travel");
  f.number("swing_weight", o.swing_weight, "1/m^2", kNotNegative, "path of the swing foot");
  f.number("swing_velocity_weight", o.swing_velocity_weight, "s^2/m^2", kNotNegative,
           "velocity of the swing foot along its path");
  f.number("swing_rotation_weight", o.swing_rotation_weight, "1", kNotNegative, "orientation of the swing foot");
  f.number("foothold_weight", o.foothold_weight, "1/m^2", kNotNegative,
           "with foothold_room: land near the foothold, swing near its horizontal path");
  f.number("feet_distance", o.feet_distance, "m", kNotNegative,
           "least distance between the soles, or that of the footholds if smaller");
  f.number("terminal_weight", o.terminal_weight, "1/m^2", kNotNegative, "position of the centre of mass at the end");
  describe(f, static_cast<MotionOptions&>(o));
  f.number("closure_kp", o.closure_kp, "1/s^2", kNotNegative,
           "position gain of the stabilisation of closures (full formulation)");
  f.number("closure_kd", o.closure_kd, "1/s", kNotNegative,
           "velocity gain of the stabilisation of closures (full formulation)");
}

}  // namespace bielle
