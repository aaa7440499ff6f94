#pragma once
/// \file A controller as Python holds it: with the model that it refers to.
#include <memory>
#include <mutex>

#include "bielle/control/policy.h"
#include "bielle/control/predictive_controller.h"
#include "motion.h"

namespace bielle::python {

struct HeldController {
  // A solve in a thread of its own may wait for the interpreter's lock, and its controller waits for the thread.
  ~HeldController() {
    const py::gil_scoped_release release;
    controller.reset();
  }
  std::shared_ptr<Model> model;
  std::unique_ptr<Controller> controller;
  const Policy* policy = nullptr;  // it, if it is one
  const PredictiveController* predictive = nullptr;
  std::mutex mutex;  // of updates
};

}  // namespace bielle::python
