#pragma once
// Springs that no motor moves: where the weight bends them, and how fast they swing.
#include "bielle/motion/locomotion.h"

namespace bielle {

// The posture q of the reference with its springs bent by the weight, but for those that it names.
VectorXd settleReference(const Model& model, const Reference& reference, const VectorXd& q);

// The longest stages, s, that follow such springs while the robot stands on these contacts: a fifth of the period of its fastest mode, in whole
// milliseconds, at least 2; infinity without springs. (The springs of spring_biped swing at 34 Hz: with stages of 12 ms it falls
// at once, of 9 ms in the first step, of 6 ms it walks.)
double calcSpringStage(const Model& model, ConstVectorRef q, const std::vector<ContactTarget>& contacts);
double calcSpringStage(const Model& model, const Stance& stance);

}  // namespace bielle
