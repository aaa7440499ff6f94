#pragma once
/// \file A design problem in a YAML file.
///
/// ```yaml
/// robot: bipetto                 # name, directory or .urdf file (a path: from this file); or
/// generator: cleobot             # with  set: {thigh_length: 0.2}
/// variables:
///   - name: crank                # of a given robot: the distance of two places (joints or frames) of one body
///     bounds: [0.04, 0.06]       # m
///     length:                    # one map, or a list: the first is the value, the others change by the same amount
///       - {from: motor_knee_right, to: transmission_knee_right, across: [0, 0, 1], stretch: knee_crank_right}
///       - {from: motor_knee_left, to: transmission_knee_left, across: [0, 0, 1], stretch: knee_crank_left}
///   - name: motor_x              # or a shift of places from their positions
///     bounds: [-0.01, 0.01]
///     shift: {of: motor_knee_right, along: [1, 0, 0]}
///   - {name: foot, parameter: ankle_height, unit: m, bounds: [0.05, 0.08]}    # of a generator
///   - {name: gear, ratio: "*knee*", bounds: [6, 20], start: 9}     # turns of the rotor per turn of the joint; * is any text
///   # Choices: of a part of a generator, and of a motor of robots/motors.yaml or of motor_catalogue; `mass` only of a generator.
///   - {name: knee, parameter: knee, choices: [belt, four_bar]}
///   - {name: knee_motor, motor: "*knee*", choices: [ak80-9, ak10-9], mass: knee_motor_mass, start: ak10-9}
/// architecture: [four_bar_knee, belt_knee, rsu_ankle, differential_ankle, three_rrs_hip, serial_hip]   # of a generator of
///                                # parts: a variable for each of its parts that several are named of, CHOICE_PARAMETER, or
///                                # CHOICE where only one part has it (three_rrs); a part within a part always needs the former
/// motor_catalogue: motors.yaml   # or a list of them, relative to this file; searched first
/// motions:
///   - {motion: squat, set: {depth: 0.6}}
///   - {motion: walk, weight: 0.5, payload: 5, payload_at: [0.1, 0, 0.2]}    # share in objectives and sums; kg fixed to the
///                                # trunk, in its frame (m), at its centre of mass if not given
/// mode: reoptimized              # or kept, then with
/// margin: 0.1                    # from dead points: least motion of a joint in a unit motion of its linkage; of motions
///                                # that are kept, or in searches with gradients of those of the start
/// objective:                     # peak_torque, rms_torque, energy, electrical_energy, conditioning; all motors by
/// default
///   - {measure: peak_torque, motors: [motor_knee_left, motor_knee_right], weight: 1}
///   - measure: workspace         # 1 / share of the places of a foot that can be reached (workspace.h)
///     region:                    # ranges [from, to] or [from, to, points] (m, rad), numbers (held), or free
///       {foot: foot_left, base: torso, x: [-0.2, 0.2, 9], z: [-0.1, 0.1], yaw: free, max_conditioning: 10}
/// constraints:                   # measures of all motions within bounds; envelope and heat at most 1 unless told otherwise
///   - {measure: envelope}        # torque, speed and voltage over what a motor can give
///   - {measure: heat}            # root mean square torque over what it bears for ever
///   - {measure: mass, at_most: 26}
///   - {measure: margin, at_least: 0.2}       # from dead points
///   - {measure: dead_point_distance, at_least: 0.1}   # way of a motor or joint to there, up to 0.5 rad
///   - {measure: range, joints: ["knee*"], angles: [0, 2.1]}   # all of these angles are reached; without `angles`, those of the
///                                # start, without `joints`, all of linkages. Likewise least_ratio and largest_ratio over them
///   - {measure: distance, at_least: 0.005, except: [["thigh*", "rod_knee*"]]}     # of bodies that are not neighbours and
///                                # do not overlap as they are drawn (near_bodies.h), m; but for these
/// drives:                        # for electrical_energy (measures.h)
///   motor_constant: 2            # N m/sqrt(W) at the joints, all motors except those of `motors`; else those of the robot
///   motors: {motor_knee_left: 3, motor_knee_right: 3}
///   regeneration: 0              # recovered share of negative electrical power
/// search:
///   seed: 1
///   searches: 2                  # independent ones, one thread each; or
///   starts: [{crank: 0.05}, {crank: 0.055, foot: 0.06}]      # one search each; what is left out is that of the robot
///   stages:                      # crs or isres, then bobyqa or sbplx; slsqp or mma (gradients)
///     - {algorithm: crs, evaluations: 200, tolerance: 1e-3}
/// ```
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bielle/design/search.h"
#include "bielle/model/options.h"
#include "design/evaluation.h"
#include "design/front_search.h"
#include "formats/yaml_entry.h"
#include "model/payload.h"

namespace bielle {

struct RobotSpec {
  std::string name, generator;  ///< either of them; a name may be a path
  OptionValues settings;        ///< of the generator
};

struct MotionSpec {
  std::string motion;
  OptionValues settings;
  double weight = 1;     ///< DesignMotion
  Payload payload = {};  ///< likewise
};

/// Several objectives kept apart.
struct FrontSpec {
  FrontOptions options;
  std::optional<SearchStage> refine;  ///< from every point of the front, with gradients
};

struct DesignSpec {
  std::string path, text;  ///< the file and its content
  RobotSpec robot;
  std::vector<DesignVariable> variables;
  std::vector<MotionSpec> motions;
  MotionMode mode = MotionMode::Reoptimized;
  double margin = EvaluationOptions().margin;
  std::vector<ObjectiveTerm> objective;
  std::vector<DesignConstraint> constraints;
  DriveTable drives;
  std::vector<std::pair<std::string, YamlEntry>> motor_names;  ///< of the three, * stands for any text
  unsigned seed = 1;
  int searches = 2;
  std::vector<VectorXd> starts;  ///< of searches, in place of their number; NaN: the value of the start design
  std::vector<SearchStage> stages = {{SearchAlgorithm::Crs, 200, 1e-3}, {SearchAlgorithm::Sbplx, 100, 1e-3}};
  std::optional<FrontSpec> front;  ///< then there are no searches and stages
};

/// \throws InputError naming the file, the key with its line, and the remedy
DesignSpec readDesignSpec(const std::string& path);

/// The robot of a file with its variables. \throws InputError when there is no such robot or variable
Parametrization makeParametrization(const DesignSpec& spec);

/// With the motions of its start design. \throws InputError as makeParametrization() and DesignEvaluator do
DesignEvaluator makeEvaluator(const DesignSpec& spec);
/// Warnings of walks and runs that are over before they reach their speed: what they need is not what walking needs.
/// \param goals  of the start design
std::vector<std::string> listShortMotions(const DesignSpec& spec, const std::vector<DesignGoal>& goals);

/// DesignSpec::starts, complete.
std::vector<VectorXd> listStarts(const DesignSpec& spec, const Parametrization& robot);

}  // namespace bielle
