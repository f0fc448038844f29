#include "board/linux/gpio_pin.h"

#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>

#include <cstdio>
#include <cstring>
#include <string>

#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;
namespace {

std::string chip_path(unsigned chip) { return "/dev/gpiochip" + std::to_string(chip); }

/// Requests one line; `value` is for outputs. A negative result is −errno.
int request_line(unsigned chip, unsigned line, std::uint64_t flags, bool value) {
    const UniqueFd device{::open(chip_path(chip).c_str(), O_RDWR | O_CLOEXEC)};
    if (!device.valid()) return -errno;
    gpio_v2_line_request request{};
    request.offsets[0] = line;
    request.num_lines = 1;
    request.config.flags = flags;
    std::snprintf(request.consumer, sizeof request.consumer, "qduino");
    if ((flags & GPIO_V2_LINE_FLAG_OUTPUT) != 0) {
        request.config.num_attrs = 1;
        request.config.attrs[0].attr.id = GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES;
        request.config.attrs[0].attr.values = value ? 1 : 0;
        request.config.attrs[0].mask = 1;
    }
    if (::ioctl(device.get(), GPIO_V2_GET_LINE_IOCTL, &request) != 0) return -errno;
    return request.fd;
}

std::uint64_t flags_of(PinMode mode) {
    switch (mode) {
        case PinMode::input:
            return GPIO_V2_LINE_FLAG_INPUT;
        case PinMode::input_pullup:
            return GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_BIAS_PULL_UP;
        case PinMode::input_pulldown:
            return GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN;
        case PinMode::output:
            return GPIO_V2_LINE_FLAG_OUTPUT;
        case PinMode::output_open_drain:
            return GPIO_V2_LINE_FLAG_OUTPUT | GPIO_V2_LINE_FLAG_OPEN_DRAIN;
    }
    return GPIO_V2_LINE_FLAG_INPUT;
}

/// Async-signal-safe.
void set_value(int fd, Level level) {
    gpio_v2_line_values values{};
    values.mask = 1;
    values.bits = level == Level::high ? 1 : 0;
    ::ioctl(fd, GPIO_V2_LINE_SET_VALUES_IOCTL, &values);
}

}  // namespace

Result<void> GpioPin::open() {
    const int fd = request_line(line_.chip, line_.line, GPIO_V2_LINE_FLAG_INPUT, false);
    if (fd < 0) {
        const std::string name = "line " + std::to_string(line_.line) + " of " + chip_path(line_.chip);
        return system_error("get", name, -fd);
    }
    fd_ = UniqueFd{fd};
    return {};
}

Result<void> GpioPin::configure(std::uint64_t flags) {
    gpio_v2_line_config config{};
    config.flags = flags;
    if ((flags & GPIO_V2_LINE_FLAG_OUTPUT) != 0) {
        config.num_attrs = 1;
        config.attrs[0].attr.id = GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES;
        config.attrs[0].attr.values = latch_ == Level::high ? 1 : 0;
        config.attrs[0].mask = 1;
    }
    if (::ioctl(fd_.get(), GPIO_V2_LINE_SET_CONFIG_IOCTL, &config) == 0) return {};
    return system_error("configure", "line " + std::to_string(line_.line) + " of " + chip_path(line_.chip));
}

Result<void> GpioPin::set_mode(VcpuId, PinId, PinMode mode) {
    if (auto done = configure(flags_of(mode)); !done) return done;
    mode_ = mode;
    watching_ = false;
    return {};
}

void GpioPin::write(VcpuId, PinId, Level level) {
    latch_.store(level, std::memory_order_relaxed);
    if (mode_ == PinMode::output || mode_ == PinMode::output_open_drain) set_value(fd_.get(), level);
}

Level GpioPin::read(VcpuId, PinId) {
    gpio_v2_line_values values{};
    values.mask = 1;
    if (::ioctl(fd_.get(), GPIO_V2_LINE_GET_VALUES_IOCTL, &values) != 0) return Level::low;
    return (values.bits & 1) != 0 ? Level::high : Level::low;
}

Result<void> GpioPin::set_safe_state(PinId, Level level) {
    safe_.store(static_cast<std::uint8_t>(1 + static_cast<unsigned>(level)), std::memory_order_release);
    return {};
}

void GpioPin::force_safe_states() {
    const std::uint8_t safe = safe_.load(std::memory_order_acquire);
    if (safe != 0) set_value(fd_.get(), safe > 1 ? Level::high : Level::low);
}

// Asks for the wanted edges only. For a line watched for both, the kernel tells the edges apart by
// the level that it reads afterwards, and takes both ends of a short pulse for the same edge
// (drivers/gpio/gpiolib-cdev.c, edge_irq_thread).
Result<void> GpioPin::watch_edges(PinId, Edge edge) {
    std::uint64_t edges = 0;
    if (edge != Edge::falling) edges |= GPIO_V2_LINE_FLAG_EDGE_RISING;
    if (edge != Edge::rising) edges |= GPIO_V2_LINE_FLAG_EDGE_FALLING;
    if (auto done = configure(flags_of(mode_) | edges); !done) return done;
    ::fcntl(fd_.get(), F_SETFL, O_NONBLOCK);
    watching_ = true;
    return {};
}

EdgeCounts GpioPin::edges(PinId) {
    if (!watching_) return counts_;
    std::array<gpio_v2_line_event, 16> events;
    for (;;) {
        const ssize_t bytes = ::read(fd_.get(), events.data(), sizeof events);
        if (bytes <= 0) return counts_;
        for (std::size_t i = 0; i < static_cast<std::size_t>(bytes) / sizeof events[0]; ++i) {
            ++(events[i].id == GPIO_V2_LINE_EVENT_RISING_EDGE ? counts_.rising : counts_.falling);
        }
    }
}

UniqueFd take_over_line(unsigned chip, unsigned line, Level level) {
    const int fd = request_line(chip, line, GPIO_V2_LINE_FLAG_OUTPUT, level == Level::high);
    return UniqueFd{fd < 0 ? -1 : fd};
}

}  // namespace qduino::board::linux
