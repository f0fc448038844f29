#include "apps/printer_sim/step_log.h"

namespace qduino::apps {

StepLog::StepLog(const std::string& path, const printer::MachineConfig& config, board::Peripherals& next)
    : file_(path, std::ios::binary) {
    forward_to(next);
    for (std::size_t i = 0; i < printer::kAxisCount; ++i) {
        wires_[config.axes[i].step_pin] = {Role::step, static_cast<std::uint8_t>(i)};
        wires_[config.axes[i].direction_pin] = {Role::direction, static_cast<std::uint8_t>(i)};
        inverted_[i] = config.axes[i].direction_inverted;
        positive_[i] = inverted_[i];
    }
    file_ << "time_ns,axis,direction\n";
}

void StepLog::pin_written(Instant now, board::PinId pin, board::Level level) {
    const Wire wire = wires_[pin.number];
    const bool high = level == board::Level::high;
    if (wire.role == Role::direction) positive_[wire.axis] = high != inverted_[wire.axis];
    if (wire.role == Role::step) {
        if (begun_ && high && !high_[wire.axis]) write_line(now, wire.axis);
        high_[wire.axis] = high;
    }
    ForwardingPeripherals::pin_written(now, pin, level);
}

void StepLog::write_line(Instant now, std::size_t axis) {
    file_ << text<FixedString<40>>(to_ns(now), ',', printer::kAxisLetter[axis],
                                   positive_[axis] ? ",1\n" : ",-1\n")
                 .view();
}

bool StepLog::close() {
    file_.close();
    return file_.good();
}

}  // namespace qduino::apps
