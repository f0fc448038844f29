#include "board/linux/sysfs_pin.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cmath>

#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;
namespace {

Result<void> write_once(const std::string& path, const std::string& text) {
    const UniqueFd file{::open(path.c_str(), O_WRONLY | O_CLOEXEC)};
    if (!file.valid()) return system_error("open", path);
    if (::write(file.get(), text.data(), text.size()) < 0) return system_error("write", path);
    return {};
}

std::string folder_of(const PwmChannel& channel, const std::string& root) {
    return root + "/sys/class/pwm/pwmchip" + std::to_string(channel.chip) + "/pwm" +
           std::to_string(channel.channel);
}

}  // namespace

// ---- PWM ----------------------------------------------------------------------------------------

std::string PwmPin::folder() const { return folder_of(channel_, root_); }

Result<void> PwmPin::open() {
    const std::string chip = root_ + "/sys/class/pwm/pwmchip" + std::to_string(channel_.chip);
    const std::string channel = folder();
    period_ = channel_.period;
    struct stat exported {};
    if (::stat(channel.c_str(), &exported) != 0) {
        if (auto done = write_once(chip + "/export", std::to_string(channel_.channel)); !done) return done;
    }
    // Refused when the channel has no period yet: it is off then.
    static_cast<void>(write_once(channel + "/enable", "0"));
    // In this order: the kernel refuses a period below the duty that it still has.
    for (const auto& [file, value] :
         {std::pair{"/duty_cycle", std::int64_t{0}}, std::pair{"/period", to_ns(channel_.period)}}) {
        if (auto done = write_once(channel + file, std::to_string(value)); !done) return done;
    }
    for (const auto& [file, name] :
         {std::pair{&duty_file_, "/duty_cycle"}, std::pair{&enable_file_, "/enable"}}) {
        *file = UniqueFd{::open((channel + name).c_str(), O_WRONLY | O_CLOEXEC)};
        if (!file->valid()) return system_error("open", channel + name);
    }
    return {};
}

void PwmPin::set_duty(std::int64_t duty_ns) {
    std::array<char, 24> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), duty_ns).ptr;
    duty_ns_ = duty_ns;
    if (::pwrite(duty_file_.get(), text.data(), static_cast<std::size_t>(end - text.data()), 0) < 0)
        duty_ns_ = 0;
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
    auto done = write_once(folder() + "/period", std::to_string(to_ns(period)));
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
    std::string duty = "0";
    if (level == Level::high) {
        const UniqueFd file{::open((folder + "/period").c_str(), O_RDONLY | O_CLOEXEC)};
        std::array<char, 32> text{};
        const ssize_t bytes = ::read(file.get(), text.data(), text.size());
        if (bytes > 0) duty.assign(text.data(), static_cast<std::size_t>(bytes));
    }
    if (write_once(folder + "/duty_cycle", duty)) return true;
    return write_once(folder + "/enable", "0").ok();
}

// ---- analog -------------------------------------------------------------------------------------

Result<void> AnalogPin::open() {
    const std::string path = root_ + "/sys/bus/iio/devices/iio:device" + std::to_string(channel_.device) +
                             "/in_voltage" + std::to_string(channel_.channel) + "_raw";
    file_ = UniqueFd{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (!file_.valid()) return system_error("open", path);
    return {};
}

Result<double> AnalogPin::read_analog(VcpuId, PinId) {
    std::array<char, 32> text{};
    const ssize_t bytes = ::pread(file_.get(), text.data(), text.size(), 0);
    long raw = 0;
    if (bytes <= 0 || std::from_chars(text.data(), text.data() + bytes, raw).ec != std::errc{}) {
        return make_error(ErrorCode::faulted, "the analog converter gives no value");
    }
    return std::min(1.0, std::max(0.0, static_cast<double>(raw) / channel_.full_scale));
}

Level AnalogPin::read(VcpuId vcpu, PinId pin) {
    const auto value = read_analog(vcpu, pin);
    return value && *value >= 0.5 ? Level::high : Level::low;
}

}  // namespace qduino::board::linux
