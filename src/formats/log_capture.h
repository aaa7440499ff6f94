#pragma once
// What urdfdom prints.
#include <console_bridge/console.h>

#include <mutex>
#include <string>

namespace bielle {

// Catches what urdfdom would print. console_bridge has one handler per process, hence the lock.
class LogCapture : public console_bridge::OutputHandler {
 public:
  LogCapture() : lock_(mutex()) { console_bridge::useOutputHandler(this); }
  ~LogCapture() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_WARN) text_ += (text_.empty() ? "" : ", ") + text;
  }
  const std::string& text() const { return text_; }

 private:
  static std::mutex& mutex() {
    static std::mutex instance;
    return instance;
  }
  std::lock_guard<std::mutex> lock_;
  std::string text_;
};

}  // namespace bielle
