// The options of a locomotion by name, and the published values.
#include "bielle/motion/locomotion.h"

namespace bielle {

std::vector<OptionEntry> listOptions(LocomotionOptions& o) {
  return {
      {"start_support", &o.timing.start, "s", "least duration of double support before the first step"},
      {"start_pressure", &o.start_pressure, "1",
       "start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never"},
      {"single_support", &o.timing.single, "s", "duration with one foot on the ground"},
      {"double_support", &o.timing.both, "s", "duration with both feet on the ground between two steps"},
      {"end_support", &o.timing.end, "s", "duration of double support after the last step"},
      {"time_step", &o.timing.time_step, "s",
       "length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings"},
      {"swing_height", &o.swing.height, "m", "apex of the swing foot above the higher end of its path"},
      {"swing_apex", &o.swing.apex, "1", "time of the apex as a fraction of the swing, from 0 to 1"},
      {"swing_leave", &o.swing.leave, "1", "time at which the swing foot starts to move horizontally, from 0 to 1"},
      {"swing_arrive", &o.swing.arrive, "1", "time at which the swing foot is above its foothold, from 0 to 1"},
      {"friction", &o.friction, "1", "friction coefficient"},
      {"cone_margin", &o.cone_margin, "1", "share of friction and soles that wrenches leave unused"},
      {"published", &o.published, "0 or 1",
       "1: the paper's problem, with free landing places; 0: footholds and Bielle's costs"},
      {"rigid_landing", &o.rigid_landing, "0 or 1", "1: a rigid impact at every landing, as a separate stage; 0: none"},
      {"landing_speed", &o.landing_speed, "m/s",
       "with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest"},
      {"foothold_room", &o.foothold_room, "m",
       "largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it"},
      {"state_weight", &o.state_weight, "1", "stay near the standing posture, at rest"},
      {"torso_weight", &o.torso_weight, "1", "keep the torso upright, within the state regularization"},
      {"heading_weight", &o.heading_weight, "1", "keep the heading of the feet, within the state regularization"},
      {"motor_weight", &o.motor_weight, "1", "keep motors slow, within the state regularization"},
      {"control_weight", &o.control_weight, "1/(N m)^2", "keep motor torques small"},
      {"com_weight", &o.com_weight, "1/m^2", "horizontal position of the centre of mass"},
      {"com_height_weight", &o.com_height_weight, "1/m^2", "height of the centre of mass"},
      {"com_velocity_weight", &o.com_velocity_weight, "s^2/m^2",
       "velocity of the centre of mass in the direction of travel"},
      {"swing_weight", &o.swing_weight, "1/m^2", "path of the swing foot"},
      {"swing_velocity_weight", &o.swing_velocity_weight, "s^2/m^2", "velocity of the swing foot along its path"},
      {"swing_rotation_weight", &o.swing_rotation_weight, "1", "orientation of the swing foot"},
      {"foothold_weight", &o.foothold_weight, "1/m^2",
       "with foothold_room: land near the foothold, swing near its horizontal path"},
      {"force_weight", &o.force_weight, "1", "transfer the weight evenly between the feet, relative to (m g)^2"},
      {"pressure_weight", &o.pressure_weight, "1", "keep the centre of pressure in the middle of the sole"},
      {"feet_distance", &o.feet_distance, "m", "least distance between the soles, or that of the footholds if smaller"},
      {"terminal_weight", &o.terminal_weight, "1/m^2", "position of the centre of mass at the end"},
      {"contact_kp", &o.contact_kp, "1/s^2",
       "position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2))"},
      {"contact_kd", &o.contact_kd, "1/s", "velocity gain of the stabilisation of contacts (at most 1/h)"},
      {"closure_kp", &o.closure_kp, "1/s^2", "position gain of the stabilisation of closures (full formulation)"},
      {"closure_kd", &o.closure_kd, "1/s", "velocity gain of the stabilisation of closures (full formulation)"}};
}

void setPaperWeights(LocomotionOptions& o) {
  // Durations are truncated to whole time steps; the last step has its node of double support, then the end follows.
  const double h = o.timing.time_step = 0.015;
  o.timing.start = 13 * h;   // 0.2 s
  o.timing.single = 26 * h;  // 0.4 s
  o.timing.both = h;
  o.timing.end = 14 * h;  // h + 0.2 s
  o.published = 1;
  o.start_pressure = 0;
  o.state_weight = 1;
  o.torso_weight = 2500;
  o.heading_weight = 0;
  o.motor_weight = 0;
  o.control_weight = 0.02;
  o.com_weight = 0;
  o.com_height_weight = 1000;
  o.com_velocity_weight = 100;
  o.swing_weight = o.swing_rotation_weight = o.swing_velocity_weight = 0;
  o.force_weight = 10;
  o.pressure_weight = 10;
  o.contact_kp = 0;
  o.contact_kd = 100;
  o.closure_kp = o.closure_kd = 0;
}

}  // namespace bielle
