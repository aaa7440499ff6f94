#include "worlds/planned_record.h"

#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "motion/record_tables.h"

namespace bielle::worlds {

MotionRecord makePlannedRecord(const Model& model, const Policy& plan, const MotionRecord& happened) {
  MotionRecord planned = happened;  // its names and times
  planned.footholds.resize(0, 0);
  for (const RecordTable& table : listTables(planned))
    (planned.*table.data).setConstant(std::numeric_limits<double>::quiet_NaN());
  Policy policy = plan;  // update() is not const
  Workspace ws(model);
  Measurement at{0, model.makeNeutral(), VectorXd::Zero(model.nv())};
  VectorXd u(model.nu());
  for (Eigen::Index k = 0; k < planned.time.size(); ++k) {
    at.time = planned.time[k];
    plan.getReference(at.time, at.q, at.v);
    planned.q.row(k) = at.q;
    planned.v.row(k) = at.v;
    updatePositions(model, ws, at.q);
    planned.com.row(k) = calcCom(model, ws);
    if (k >= planned.u.rows()) continue;
    policy.update(at, u);  // on the plan there is no deviation to feed back
    planned.u.row(k) = u;
  }
  return planned;
}

}  // namespace bielle::worlds
