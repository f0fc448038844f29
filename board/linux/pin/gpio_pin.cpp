#include "board/linux/pin/gpio_pin.h"

#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>

#include <algorithm>

#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;
namespace {

std::string chip_path(unsigned chip) { return "/dev/gpiochip" + std::to_string(chip); }

/// The configuration of one line; `level` is for outputs.
gpio_v2_line_config config_of(std::uint64_t flags, Level level) {
    gpio_v2_line_config config{};
    config.flags = flags;
    if ((flags & GPIO_V2_LINE_FLAG_OUTPUT) == 0) return config;
    config.num_attrs = 1;
    config.attrs[0].attr.id = GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES;
    config.attrs[0].attr.values = level == Level::high ? 1 : 0;
    config.attrs[0].mask = 1;
    return config;
}

/// Requests one line. A negative result is −errno.
int request_line(unsigned chip, unsigned line, std::uint64_t flags, Level level) {
    const UniqueFd device{::open(chip_path(chip).c_str(), O_RDWR | O_CLOEXEC)};
    if (!device.valid()) return -errno;
    gpio_v2_line_request request{};
    request.offsets[0] = line;
    request.num_lines = 1;
    request.config = config_of(flags, level);
    std::ranges::copy(std::string_view{"qduino"}, request.consumer);
    if (::ioctl(device.get(), GPIO_V2_GET_LINE_IOCTL, &request) != 0) return -errno;
    return request.fd;
}

std::uint64_t flags_of(PinMode mode) {
    constexpr std::array<std::uint64_t, 5> kFlags{
        GPIO_V2_LINE_FLAG_INPUT,
        GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_BIAS_PULL_UP,
        GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN,
        GPIO_V2_LINE_FLAG_OUTPUT,
        GPIO_V2_LINE_FLAG_OUTPUT | GPIO_V2_LINE_FLAG_OPEN_DRAIN,
    };
    return kFlags.at(static_cast<std::size_t>(mode));
}

/// Async-signal-safe.
void set_value(int fd, Level level) {
    gpio_v2_line_values values{};
    values.mask = 1;
    values.bits = level == Level::high ? 1 : 0;
    ::ioctl(fd, GPIO_V2_LINE_SET_VALUES_IOCTL, &values);
}

}  // namespace

std::string GpioPin::name() const {
    return text<std::string>("line ", line_.line, " of ", chip_path(line_.chip));
}

Result<void> GpioPin::open() {
    const int fd = request_line(line_.chip, line_.line, GPIO_V2_LINE_FLAG_INPUT, Level::low);
    if (fd < 0) {
        return system_error("get", name(), -fd);
    }
    fd_ = UniqueFd{fd};
    return {};
}

Result<void> GpioPin::configure(std::uint64_t flags) {
    gpio_v2_line_config config = config_of(flags, latch_);
    if (::ioctl(fd_.get(), GPIO_V2_LINE_SET_CONFIG_IOCTL, &config) == 0) return {};
    return system_error("configure", name());
}

Result<void> GpioPin::set_mode(VcpuId, PinId, PinMode mode) {
    QDUINO_TRY(configure(flags_of(mode)));
    mode_ = mode;
    watching_ = false;
    return {};
}

void GpioPin::write(VcpuId, PinId, Level level) {
    latch_.store(level, std::memory_order_relaxed);
    if (is_output(mode_)) set_value(fd_.get(), level);
}

Level GpioPin::read(VcpuId, PinId) {
    gpio_v2_line_values values{};
    values.mask = 1;
    if (::ioctl(fd_.get(), GPIO_V2_LINE_GET_VALUES_IOCTL, &values) != 0) return Level::low;
    return (values.bits & 1) != 0 ? Level::high : Level::low;
}

Result<void> GpioPin::set_safe_state(PinId, Level level) {
    safe_ = static_cast<int>(level);
    return {};
}

void GpioPin::force_safe_states() {
    if (const int level = safe_; level >= 0) set_value(fd_.get(), static_cast<Level>(level));
}

// Asks for the wanted edges only. For a line watched for both, the kernel tells the edges apart by
// the level that it reads afterwards, and takes both ends of a short pulse for the same edge
// (drivers/gpio/gpiolib-cdev.c, edge_irq_thread).
Result<void> GpioPin::watch_edges(PinId, Edge edge) {
    std::uint64_t edges = 0;
    if (edge != Edge::falling) edges |= GPIO_V2_LINE_FLAG_EDGE_RISING;
    if (edge != Edge::rising) edges |= GPIO_V2_LINE_FLAG_EDGE_FALLING;
    QDUINO_TRY(configure(flags_of(mode_) | edges));
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
            const bool rising = events[i].id == GPIO_V2_LINE_EVENT_RISING_EDGE;
            const std::uint32_t number = ++(rising ? counts_.rising : counts_.falling);
            (rising ? rising_times_ : falling_times_)
                .note(number, instant_from_ns(static_cast<std::int64_t>(events[i].timestamp_ns)));
        }
    }
}

/// The kernel's own, taken in the interrupt, on CLOCK_MONOTONIC.
Instant GpioPin::edge_instant(PinId, Level to, std::uint32_t number) {
    return to == Level::high ? rising_times_.at(number, counts_.rising)
                             : falling_times_.at(number, counts_.falling);
}

UniqueFd take_over_line(unsigned chip, unsigned line, Level level) {
    return UniqueFd{std::max(request_line(chip, line, GPIO_V2_LINE_FLAG_OUTPUT, level), -1)};
}

}  // namespace qduino::board::linux
