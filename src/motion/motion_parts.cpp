// The motions of this library, entered when a program that links it starts (model/missing_part.h).
#include "bielle/motion/jump.h"
#include "bielle/motion/run.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "motion/footholds.h"
#include "motion/motion_part.h"
#include "motion/obstacles.h"

extern "C" const bool bielle_motions = [] {
  using namespace bielle;
  getMotionParts().insert({{"walk", {makePlanner(planWalk)}},
                           {"side-walk", {makePlanner(planSideWalk)}},
                           {"turn", {makePlanner(planTurn)}},
                           {"stairs", {makePlanner(planStairs)}},
                           {"footholds", {makePlanner(planFootholds), readFootholds}},
                           {"box", {makePlanner(planBox)}},
                           {"gap", {makePlanner(planGap)}},
                           {"jump", {makePlanner(planJump)}},
                           {"run", {makePlanner(planRun)}},
                           {"hop", {makePlanner(planHop)}}});
  return true;
}();
