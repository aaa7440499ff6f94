#pragma once
// Vectors, matrices and placements as JSON.
#include <cmath>
#include <string>

#include "bielle/math/se3.h"
#include "results/json_text.h"

namespace bielle {

// What is not finite becomes null: a bound that is none.
inline Json listVector(ConstVectorRef x) {
  Json json = Json::array();
  for (double entry : x) json.push_back(std::isfinite(entry) ? Json(entry) : Json(nullptr));
  return json;
}

// Row by row.
inline Json listMatrix(const MatrixXd& M) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < M.rows(); ++i) json.push_back(listVector(VectorXd(M.row(i).transpose())));
  return json;
}

inline void addPlacement(Json& json, const std::string& suffix, const SE3& X) {
  json["p" + suffix] = listVector(X.p);
  json["R" + suffix] = listMatrix(X.R);
}

}  // namespace bielle
