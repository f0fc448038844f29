#include "board/linux/pin/sysfs_pin.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;
using posix::write_small_file;
namespace {

std::string folder_of(const PwmChannel& channel, const std::string& root) {
    return text<std::string>(root, "/sys/class/pwm/pwmchip", channel.chip, "/pwm", channel.channel);
}

}  // namespace

// ---- PWM ----------------------------------------------------------------------------------------

Result<void> PwmPin::open() {
    const std::string channel = folder_of(channel_, root_);
    period_ = channel_.period;
    if (::access(channel.c_str(), F_OK) != 0) {
        const std::string chip = channel.substr(0, channel.rfind('/'));
        QDUINO_TRY(write_small_file(chip + "/export", std::to_string(channel_.channel)));
    }
    // Refused when the channel has no period yet: it is off then.
    static_cast<void>(write_small_file(channel + "/enable", "0"));
    // In this order: the kernel refuses a period below the duty that it still has.
    for (const auto& [file, value] :
         {std::pair{"/duty_cycle", std::int64_t{0}}, std::pair{"/period", to_ns(channel_.period)}}) {
        QDUINO_TRY(write_small_file(channel + file, std::to_string(value)));
    }
    for (const auto& [file, name] :
         {std::pair{&duty_file_, "/duty_cycle"}, std::pair{&enable_file_, "/enable"}}) {
        *file = UniqueFd{::open((channel + name).c_str(), O_WRONLY | O_CLOEXEC)};
        if (!file->valid()) return system_error("open", channel + name);
    }
    return {};
}

void PwmPin::set_duty(std::int64_t duty_ns) {
    const auto digits = text<FixedString<24>>(duty_ns);
    duty_ns_ = ::pwrite(duty_file_.get(), digits.view().data(), digits.size(), 0) < 0 ? 0 : duty_ns;
}

Result<void> PwmPin::enable() {
    enabled_ = enabled_ || ::pwrite(enable_file_.get(), "1", 1, 0) == 1;
    if (enabled_) return {};
    return make_error(ErrorCode::faulted, "the kernel does not switch this PWM channel on");
}

Result<void> PwmPin::set_mode(VcpuId, PinId, PinMode mode) {
    if (mode == PinMode::output) return enable();  // with the duty that was written before
    return pin_cannot("other mode than output");
}

void PwmPin::write(VcpuId, PinId, Level level) { set_duty(level == Level::high ? to_ns(period_) : 0); }

Result<void> PwmPin::write_pwm(VcpuId, PinId, double duty) {
    if (!(duty >= 0 && duty <= 1)) return make_error(ErrorCode::out_of_range, "a PWM duty is within 0…1");
    set_duty(std::llround(duty * static_cast<double>(to_ns(period_))));
    return enable();  // analogWrite() needs no pinMode()
}

Result<void> PwmPin::set_pwm_period(VcpuId, PinId, Nanoseconds period) {
    if (period == Nanoseconds{0}) period = channel_.period;
    const double duty = static_cast<double>(duty_ns_) / static_cast<double>(to_ns(period_));
    set_duty(0);  // the kernel refuses a period below the duty that it still has
    auto done = write_small_file(folder_of(channel_, root_) + "/period", std::to_string(to_ns(period)));
    if (done) period_ = period;
    set_duty(std::llround(duty * static_cast<double>(to_ns(period_))));
    return done;
}

Result<void> PwmPin::set_safe_state(PinId, Level level) {
    safe_ = static_cast<int>(level);
    return {};
}

void PwmPin::force_safe_states() {
    if (safe_ >= 0) set_duty(safe_ > 0 ? to_ns(period_) : 0);
}

bool force_pwm_channel(const PwmChannel& channel, const std::string& root, Level level) {
    const std::string folder = folder_of(channel, root);
    const std::string duty = level == Level::high ? text_of_file(folder + "/period") : "0";
    if (write_small_file(folder + "/duty_cycle", duty.empty() ? "0" : duty)) return true;
    return write_small_file(folder + "/enable", "0").ok();
}

// ---- analog -------------------------------------------------------------------------------------

Result<void> AnalogPin::open() {
    const auto path = text<std::string>(root_, "/sys/bus/iio/devices/iio:device", channel_.device,
                                        "/in_voltage", channel_.channel, "_raw");
    file_ = UniqueFd{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (!file_.valid()) return system_error("open", path);
    return {};
}

Result<double> AnalogPin::read_analog(VcpuId, PinId) {
    std::array<char, 32> digits{};
    const auto bytes = std::max<ssize_t>(::pread(file_.get(), digits.data(), digits.size(), 0), 0);
    const auto raw = whole_number<long>(trimmed({digits.data(), static_cast<std::size_t>(bytes)}));
    if (!raw) return make_error(ErrorCode::faulted, "the analog converter gives no value");
    return std::clamp(static_cast<double>(*raw) / channel_.full_scale, 0.0, 1.0);
}

Level AnalogPin::read(VcpuId vcpu, PinId pin) {
    const auto value = read_analog(vcpu, pin);
    return value && *value >= 0.5 ? Level::high : Level::low;
}

}  // namespace qduino::board::linux
