#include "arduino/host/hid_gadget.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cstdlib>

#include "arduino/core/diagnostics.h"
#include "posix/system_error.h"

namespace qduino::arduino::host {

namespace {

constexpr int kFetchMs = 100;

}  // namespace

bool HidGadget::open() {
    const char* const set = std::getenv(variable_);
    const char* const path = set ? set : path_;
    device_.reset(::open(path, O_WRONLY | O_NONBLOCK | O_CLOEXEC));
    if (device_.valid()) return true;
    const Error failed = posix::system_error("open", path);
    report_error(call_, 0,
                 make_error(failed.code, failed.message, " (a USB gadget of the host; ", variable_,
                            " names another device)"));
    return false;
}

bool HidGadget::send(std::span<const std::uint8_t> report) {
    pollfd room{device_.get(), POLLOUT, 0};
    if (!device_.valid() || ::poll(&room, 1, kFetchMs) != 1) return false;
    return ::write(device_.get(), report.data(), report.size()) == static_cast<ssize_t>(report.size());
}

}  // namespace qduino::arduino::host
