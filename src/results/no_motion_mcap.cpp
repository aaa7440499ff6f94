// In place of motion_mcap.cpp where protobuf is not installed.
#include "bielle/model/error.h"
#include "results/motion_mcap.h"

namespace bielle {

MotionMcap formatMotionMcap(const LoadedRobot&, const MotionRecord&, const std::optional<MotionRecord>&, const Json&) {
  throw InputError("", "--format mcap", "its messages are written by protobuf, without which this program was built",
                   "install libprotobuf-dev and protobuf-compiler and build again, or take another format");
}

}  // namespace bielle
