#pragma once
/// \file The Approximate Serial model of the paper (its section IV-A): linkages frozen, motors moved to the serial
/// joints.
///
/// Every loop joint that is not a serial joint (Model::serialJoints()) becomes rigid at a reference configuration: its
/// bodies are merged, with their masses and inertias, into the bodies that carry them. The closures are removed; the
/// serial joints get motors of the same names. Base, joints outside loops with their motors, frames, contacts, visuals,
/// gravity and the names of all these stay, so that results map by name. A linkage is frozen only if its serial joints
/// determine it: as many coordinates as its mobility, and no dead point of the joint (ratio.h).
/// With R the ratio of the linkage at the reference, the limits of the new motors are those of its motors there:
///     effort <= sum_i |R_ij| effort_i,    velocity <= sum_i |R^{-1}_ji| velocity_i.                                (1)
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct SerialModelOptions {
  enum class Armature {
    Given,     ///< `armature` on every new motor, as in the paper
    Reflected  ///< sum_i R_ij^2 armature_i, the rotor inertia seen at the joint at the reference
  };
  Armature armature_kind = Armature::Given;
  double armature = 1e-3;  ///< kg m^2
};

/// What a solve or a controller takes a robot for.
enum class Belief {
  Closed,  ///< its model
  Serial,  ///< the serial model
  Ratio    ///< of controllers: the same, with the constant ratio of motors to joints where the robot stands
};
/// As on command lines and in files: "closed", "serial", "ratio".
const char* getName(Belief belief);
/// \throws InputError for another name
Belief parseBelief(const std::string& name);

/// Parses an armature: kg m^2, or "reflected"; empty for the default.
/// \throws InputError for any other text
SerialModelOptions parseSerialArmature(const std::string& text);

struct SerialModel {
  Model model;
  VectorXd q_reference;  ///< nq of the closed model
  /// Names of the changed elements.
  std::vector<std::string> frozen_joints, dropped_closures;
  struct Replacement {
    std::vector<std::string> motors,
        joints;  ///< of one linkage: these motors of the closed model are replaced by motors on these joints
    MatrixXd R;  ///< ratio at the reference
  };
  std::vector<Replacement> replacements;
  /// Targets of reference configurations that named frozen joints: "reference: joint".
  std::vector<std::string> dropped_targets;
};

/// \param q_reference  closed configuration where the linkages are frozen
/// \throws InputError naming the linkage and the reason, when the robot has no equivalent serial chain
SerialModel makeSerialModel(const Model& closed, ConstVectorRef q_reference, const SerialModelOptions& options = {});

/// Entries of q (nq) or v (nv) of the joints that `model` also has, by name: the serial part of a closed state.
VectorXd restrictConfiguration(const Model& from, const Model& model, ConstVectorRef q);
VectorXd restrictVelocity(const Model& from, const Model& model, ConstVectorRef v);
/// For each entry of q, or of v, of `model` that of the joint of that name in `from`: restrictVelocity(...)[i] = v[result[i]].
std::vector<int> findRestrictedCoordinates(const Model& from, const Model& model);
std::vector<int> findRestrictedDofs(const Model& from, const Model& model);

}  // namespace bielle
