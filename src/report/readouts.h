#pragma once
// Numbers of a linkage beside its sliders: angles of joints without a motor, its ratio, and how far it is from dead points.
#include <memory>
#include <optional>
#include <vector>

#include "bielle/dynamics/linkage.h"
#include "results/json_text.h"

namespace bielle {

class Readouts {
 public:
  // \param motors  of the linkage   \param joints  its joints, by their bodies   \param start  nq, closed
  Readouts(const Model& model, const std::vector<int>& motors, const std::vector<int>& joints, ConstVectorRef start);

  // [{"name", "unit", "most"}], in the order of calc(); a value of `most` stands for that and more.
  Json describe() const;
  // At a closed configuration, nq; not finite where there is none, as ratios at dead points.
  Eigen::RowVectorXd calc(ConstVectorRef q) const;

 private:
  const Model& model_;
  std::vector<int> passive_;  // joints of one coordinate
  std::optional<Linkage> linkage_;
};

}  // namespace bielle
