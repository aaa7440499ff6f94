#pragma once
// Play of gears and rods, at whose stops torques tell where they are.
#include "bielle/model/wear.h"
#include "cli/identify_tasks.h"
#include "identify/estimate.h"

namespace bielle::cli {

// Lets a fit look for the play that is asked for. \param q  nq, closed   \param window  s, of the polynomials
// \param log  with all rows   \param time  of the rows of the fit, s
// \throws InputError for torques of motors that the log lacks, and play of which no row tells where it is
void addPlays(LogFit& fit, const Model& model, ConstVectorRef q, const LoggedTask& logged, const IdentifyChoice& choice,
              double window, const MotionLog& log, const VectorXd& time);

// The play of a robot with what was found of it.
Wear changePlays(Wear wear, const std::vector<LinkagePlay>& plays, const Estimate& estimate);

}  // namespace bielle::cli
