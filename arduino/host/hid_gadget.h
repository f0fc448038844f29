// A keyboard or a mouse that this computer is to another one: a USB gadget of the host, whose
// reports are bytes written to /dev/hidg0 (Linux, Documentation/usb/gadget_hid.rst).
#pragma once

#include <cstdint>
#include <span>

#include "posix/unique_fd.h"

namespace qduino::arduino::host {

class HidGadget {
  public:
    /// `variable` of the environment names the device; else it is `path`. Reported in the name of
    /// `call` when there is none.
    HidGadget(const char* call, const char* variable, const char* path)
        : call_(call), variable_(variable), path_(path) {}

    bool open();
    void close() { device_.reset(); }
    /// Waits up to 100 ms until the other side has fetched the last report. False: it did not, or
    /// the device is not open.
    bool send(std::span<const std::uint8_t> report);

  private:
    const char *call_, *variable_, *path_;
    posix::UniqueFd device_;
};

}  // namespace qduino::arduino::host
