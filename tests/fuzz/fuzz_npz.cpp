// A trajectory as a NumPy archive: what is read is written and read again as the same, or there is one clear error.
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "scratch.h"

namespace bielle::fuzz {
namespace {

bool areSame(const MotionRecord& a, const MotionRecord& b) {
  const auto same = [](const auto& x, const auto& y) {
    if (x.rows() != y.rows() || x.cols() != y.cols()) return false;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (x.data()[i] != y.data()[i] && !(std::isnan(x.data()[i]) && std::isnan(y.data()[i]))) return false;
    return true;
  };
  return a.q_names == b.q_names && a.v_names == b.v_names && a.u_names == b.u_names &&
         a.closure_names == b.closure_names && a.contact_names == b.contact_names && same(a.time, b.time) &&
         same(a.q, b.q) && same(a.v, b.v) && same(a.a, b.a) && same(a.u, b.u) && same(a.com, b.com) &&
         same(a.closure_wrenches, b.closure_wrenches) && same(a.contact_wrenches, b.contact_wrenches) &&
         same(a.gap, b.gap);
}

}  // namespace
}  // namespace bielle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  using namespace bielle::fuzz;
  const std::string path = getScratch().write("trajectory.npz", toText(data, size));
  try {
    const MotionRecord record = readRecord(path);
    writeNpz(getScratch().path() + "/again.npz", record);
    if (!areSame(readRecord(getScratch().path() + "/again.npz"), record)) fail("it reads differently again");
  } catch (const InputError&) {
  }
  return 0;
}
