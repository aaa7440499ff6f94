// summary.json of a result, and the state that `bielle eval` is given: numbers, or one clear error.
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/robots/fourbar_chain.h"
#include "cli/eval_state.h"
#include "scratch.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace bielle;
  const fuzz::Scratch& scratch = fuzz::getScratch();
  const std::string text = fuzz::toText(data, size);
  scratch.write("summary.json", text);
  try {
    readSummary(scratch.path());
  } catch (const InputError&) {
  }
  static const Model model = makeFourBarChain().model;
  const std::string path = scratch.write("state.json", text);
  try {
    const cli::EvalState state = cli::readState(model, path);
    if (!state.q.allFinite() || !state.v.allFinite() || !state.u.allFinite()) fuzz::fail("a state is not finite");
  } catch (const InputError&) {
  }
  return 0;
}
