// Somewhere to draw without a screen.
#pragma once

#include <sys/types.h>

#include <string>

namespace vstent::apps {

/// While it lives, DISPLAY names an X server to render on off screen: an Xvfb of its own where that
/// program is found, otherwise the one that was set already.
class OffscreenDisplay {
 public:
  OffscreenDisplay();
  ~OffscreenDisplay();
  OffscreenDisplay(const OffscreenDisplay&) = delete;
  OffscreenDisplay& operator=(const OffscreenDisplay&) = delete;

  bool available() const { return available_; }
  const std::string& reason() const { return reason_; }  ///< why there is none, for a person

 private:
  pid_t server_ = -1;
  bool available_ = false;
  std::string previous_, reason_;
};

}  // namespace vstent::apps
