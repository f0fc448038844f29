#include "board/linux/pin/safe_outputs.h"

#include "board/linux/pin/gpio_pin.h"
#include "board/linux/pin/sysfs_pin.h"
#include "board/linux/pin/virtual_pins.h"

namespace qduino::board::linux {

using posix::UniqueFd;

Result<void> SafeOutputs::open(const PinsFile& file, int writer, std::string sysfs_root) {
    layout_ = &file.layout();
    sysfs_root_ = std::move(sysfs_root);
    lines_.resize(kPinCount);
    return writer_.open(file, writer, kNoVcpu);
}

void SafeOutputs::release_lines() {
    for (UniqueFd& line : lines_) line.reset();
}

ForcedOutputs SafeOutputs::force() {
    // Writers that died in the middle of a write would hold the machine back for a moment.
    for (int writer = 0; writer < kWriterCount; ++writer) {
        if (writer != kSupervisorWriter && writer != kHeatWatchWriter)
            layout_->writers[static_cast<std::size_t>(writer)].writing.store(0);
    }
    ForcedOutputs forced;
    forced.pins = force_safe_states(*layout_, writer_);
    for (std::size_t pin = 0; pin < kPinCount; ++pin) {
        const OutputPin& output = layout_->outputs[pin];
        const auto level = output.safe_level();
        if (!level) continue;
        if (!force_channel(output, *level)) ++forced.channels_failed;
        if (!force_line(pin, output, *level)) ++forced.lines_missing;
    }
    return forced;
}

/// True: it is safe, or the pin is no channel.
bool SafeOutputs::force_channel(const OutputPin& output, Level level) const {
    const std::uint32_t word = output.pwm_channel.load(std::memory_order_acquire);
    const auto [chip, channel] = ChipPlace::from(word);
    return word == 0 || force_pwm_channel({{}, chip, channel}, sysfs_root_, level);
}

/// True: it is held at its safe level, or the pin is no line.
bool SafeOutputs::force_line(std::size_t pin, const OutputPin& output, Level level) {
    const std::uint32_t word = output.line.load(std::memory_order_acquire);
    if (word == 0 || lines_[pin].valid()) return true;
    const auto [chip, line] = ChipPlace::from(word);
    lines_[pin] = take_over_line(chip, line, level);
    return lines_[pin].valid();
}

}  // namespace qduino::board::linux
