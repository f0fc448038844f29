#include "apps/printer_sim/step_log.h"

#include <charconv>
#include <cstring>

namespace qduino::apps {
namespace {
constexpr std::size_t kBufferBytes = 1 << 20;
constexpr std::size_t kLineBytesMax = 32;
}  // namespace

StepLog::StepLog(const std::string& path, const printer::MachineConfig& config, board::Peripherals& next)
    : next_(next), file_(std::fopen(path.c_str(), "wb")) {
    buffer_.reserve(kBufferBytes);
    for (std::size_t i = 0; i < printer::kAxisCount; ++i) {
        wires_[config.axes[i].step_pin] = {Role::step, static_cast<std::uint8_t>(i)};
        wires_[config.axes[i].direction_pin] = {Role::direction, static_cast<std::uint8_t>(i)};
        inverted_[i] = config.axes[i].direction_inverted;
        positive_[i] = inverted_[i];
    }
    static constexpr char kHead[] = "time_ns,axis,direction\n";
    buffer_.insert(buffer_.end(), kHead, kHead + sizeof kHead - 1);
}

StepLog::~StepLog() { close(); }

void StepLog::pin_written(Instant now, board::PinId pin, board::Level level) {
    const Wire wire = wires_[pin.number];
    const bool high = level == board::Level::high;
    if (wire.role == Role::direction) positive_[wire.axis] = high != inverted_[wire.axis];
    if (wire.role == Role::step) {
        if (high && !high_[wire.axis]) write_line(now, wire.axis);
        high_[wire.axis] = high;
    }
    next_.pin_written(now, pin, level);
}

void StepLog::write_line(Instant now, std::size_t axis) {
    if (buffer_.size() + kLineBytesMax > kBufferBytes) flush();
    char line[kLineBytesMax];
    char* end = std::to_chars(line, line + 24, to_ns(now)).ptr;
    *end++ = ',';
    *end++ = printer::kAxisLetter[axis];
    *end++ = ',';
    if (!positive_[axis]) *end++ = '-';
    *end++ = '1';
    *end++ = '\n';
    buffer_.insert(buffer_.end(), line, end);
}

void StepLog::flush() {
    if (file_ && std::fwrite(buffer_.data(), 1, buffer_.size(), file_) != buffer_.size()) failed_ = true;
    buffer_.clear();
}

bool StepLog::close() {
    if (!file_) return false;
    flush();
    if (std::fclose(file_) != 0) failed_ = true;
    file_ = nullptr;
    return !failed_;
}

}  // namespace qduino::apps
