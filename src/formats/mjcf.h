#pragma once
/// \file A robot as a file of MuJoCo (MJCF), as version 2.2.2 reads it.
///
/// Bodies are written depth first, children in the order of the model, and keep their names and frames. They stand at
/// the closed configuration q_ref, MuJoCo's qpos0, because MuJoCo closes a loop where its bodies stand in the file.
/// Coordinates follow the bodies; mjcf_coordinates.h maps those of a joint.
///
/// Motors are actuators of their names, in the order of u, in N m or N. A weld is a `weld`, a ball a `connect`, a hinge
/// two `connect`s NAME.1 and NAME.2 on its axis, a distance a spatial tendon whose length is fixed; a slider is refused, because
/// MuJoCo has no such equality. A sole is a box, an edge a capsule, a point a sphere, which the lowest points
/// of the contact belong to: NAME.1 with the contact's name; they touch only the ground. References are keyframes. A point spring is
/// a spatial tendon of its name between two sites, its preload a shift of its spring length. A preload without a stiffness
/// gets kMjcfPreloadStiffness, by which a joint that turns by 1 rad changes it by 1e-9 N m. Windings, gears, losses and limits of
/// speed of motors are in texts "bielle:motor:NAME" of <custom>, in the words of our YAML file, for our own reader.
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "formats/mjcf_coordinates.h"

namespace bielle {

/// N m/rad or N/m
inline constexpr double kMjcfPreloadStiffness = 1e-9;

struct MjcfOptions {
  double time_step = 2.5e-4;   ///< s
  double closure_time = 5e-4;  ///< time constant of closures, s; MuJoCo takes at least two steps
  double contact_time = 1e-3;  ///< time constant of contacts and joint stops, s
  double impedance = 0.9999;   ///< share of a constraint's acceleration that is met, below 1
  double friction = 0.7;       ///< Coulomb coefficient between soles and ground
  double sole_radius = 5e-3;   ///< of points and edges, half the thickness of soles, m
  double hinge_lever = 0.02;   ///< distance of the two points of a hinge from its frame, m
  double ground_height = 0;    ///< of the plane that soles touch, m
  MjcfRotations rotations = MjcfRotations::Balls;
  int num_boxes = 0;  ///< that soles touch, too: "box.1" ..., for whoever moves them
};

struct MjcfText {
  std::string xml;
  /// Each names something that MJCF cannot express or that was changed.
  std::vector<std::string> warnings;
};

/// The coefficients in s of the polynomial c_0 + c_1 q + .. at q = x + s, exact for x = 0.
std::vector<double> shiftPolynomial(std::vector<double> c, double x);

/// \param q_ref  closed configuration (nq), as of findClosedConfiguration
MjcfText formatMjcf(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options = {});

}  // namespace bielle
