#pragma once
// Springs on joints without a motor: where the weight bends them, and how fast they swing.
#include "bielle/motion/locomotion.h"

namespace bielle {

// The posture q of the reference with its springs bent by the weight, but for those that it names.
VectorXd settleReference(const Model& model, const Reference& reference, const VectorXd& q);

// The longest stages, s, that follow such springs while the robot stands on these contacts: a fifth of the period of its
// fastest mode, in whole milliseconds, at least 2; infinity without springs. (spring_biped oscillates at 34 Hz. Under its own
// gains it falls at once with stages of 12 ms and in the first step with 9 ms; with 6 ms it walks.)
double calcSpringStage(const Model& model, ConstVectorRef q, const std::vector<ContactTarget>& contacts);
double calcSpringStage(const Model& model, const Stance& stance);

}  // namespace bielle
