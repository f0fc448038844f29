#include "board/linux/pin/virtual_pins.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "board/linux/kernel/futex.h"
#include "board/window/mail_client.h"

namespace qduino::board::linux {
namespace {

std::size_t index_of(PinId pin) {
    QDUINO_EXPECT(pin.number < kPinCount);
    return pin.number;
}

bool wait_for_reply(const Mailbox& mail, std::uint32_t sequence, Instant deadline) {
    for (;;) {
        const std::uint32_t answered = mail.reply.load(std::memory_order_acquire);
        if (answered == sequence) return true;
        if (monotonic_now() >= deadline) return false;
        futex_wait_until(mail.reply, answered, deadline);
    }
}

}  // namespace

Result<void> VirtualPins::attach(const std::string& path) {
    QDUINO_TRY_ASSIGN(file_, PinsFile::open(path, PinsRole::sketch));
    PinsLayout& layout = file_.layout();
    for (auto& slot : layout.writers) slot.lost.store(0, std::memory_order_relaxed);
    for (auto& beat : layout.heartbeats) {
        beat.expected_by_ns.store(0, std::memory_order_relaxed);
        beat.progress_by_ns.store(0, std::memory_order_relaxed);
        beat.place.store(0, std::memory_order_relaxed);
    }
    for (auto& output : layout.outputs) {  // as after a reset: all pins are inputs
        for (auto* byte : {&output.mode, &output.level, &output.pwm, &output.safe})
            byte->store(0, std::memory_order_relaxed);
        for (auto* word : {&output.line, &output.pwm_channel}) word->store(0, std::memory_order_relaxed);
    }
    for (int wide = kNarrowWriters; wide < kWriterCount; ++wide) {
        // Given out anew in this session. The machine still plays what the last owner left in the
        // ring: it goes on reading every ring that it has ever seen in use.
        layout.writers[static_cast<std::size_t>(wide)].in_use.store(0, std::memory_order_relaxed);
    }
    layout.input_waiters.store(0, std::memory_order_relaxed);
    layout.witness.store(0, std::memory_order_relaxed);
    layout.sketch_pid.store(static_cast<std::uint32_t>(::getpid()), std::memory_order_relaxed);
    layout.sketch_dead.store(0, std::memory_order_relaxed);
    layout.sketch_session.fetch_add(1, std::memory_order_release);
    QDUINO_TRY(will_.open(file_, kWillWriter, kNoVcpu));
    return open_writer(kNoVcpu, false);
}

Result<void> VirtualPins::open_writer(VcpuId vcpu, bool wide) {
    QDUINO_EXPECT(vcpu < kVcpuLimit);
    PinWriter& writer = writers_[vcpu];
    if (writer.is_open()) return {};
    for (int slot = kNarrowWriters; wide && slot < kWriterCount; ++slot) {
        if (file_.layout().writers[static_cast<std::size_t>(slot)].in_use.load() == 0) {
            return writer.open(file_, slot, vcpu);
        }
    }
    return writer.open(file_, vcpu, vcpu);
}

// ---- pins ---------------------------------------------------------------------------------------

Result<void> VirtualPins::set_mode(VcpuId vcpu, PinId pin, PinMode mode) {
    OutputPin& output = layout().outputs[index_of(pin)];
    output.set_mode(mode);
    if (is_output(mode)) {  // from now on the latch drives the pin
        write(vcpu, pin, output.level.load(std::memory_order_relaxed) ? Level::high : Level::low);
        return {};
    }
    // Kind sync: answered after the next publication of inputs.
    return ask(vcpu, {}, {}, {}, nullptr);
}

bool VirtualPins::latch(PinId pin, Level level) {
    OutputPin& output = layout().outputs[index_of(pin)];
    output.level.store(static_cast<std::uint8_t>(level), std::memory_order_relaxed);
    if (output.pwm.load(std::memory_order_relaxed)) output.pwm.store(0, std::memory_order_relaxed);
    return output.drives();
}

void VirtualPins::write(VcpuId vcpu, PinId pin, Level level) {
    if (!latch(pin, level)) return;
    with_writer(vcpu, [=](PinWriter& writer) { writer.write_level(pin, level); });
}

void VirtualPins::write_all(VcpuId vcpu, std::span<const PinId> pins, Level level) {
    bool all_drive = true;
    for (const PinId pin : pins)
        if (!latch(pin, level)) all_drive = false;
    if (all_drive) {
        with_writer(vcpu, [=](PinWriter& writer) { writer.write_levels(pins, level); });
    } else {
        for (const PinId pin : pins) write(vcpu, pin, level);
    }
}

Level VirtualPins::read(VcpuId, PinId pin) {
    OutputPin& output = layout().outputs[index_of(pin)];
    // A read without pinMode(): an input, as on an Arduino. The machine publishes its level from
    // now on.
    if (!output.is_set()) output.set_mode(PinMode::input);
    const bool high = output.drives()
                          ? output.level.load(std::memory_order_relaxed) != 0
                          : layout().inputs[pin.number].level.load(std::memory_order_acquire) != 0;
    return high ? Level::high : Level::low;
}

Result<void> VirtualPins::write_pwm(VcpuId vcpu, PinId pin, double duty) {
    OutputPin& output = layout().outputs[index_of(pin)];
    if (!(duty >= 0 && duty <= 1)) return make_error(ErrorCode::out_of_range, "a PWM duty is within 0…1");
    // analogWrite() needs no pinMode().
    if (!output.drives()) output.set_mode(PinMode::output);
    output.pwm.store(1, std::memory_order_relaxed);
    output.level.store(duty >= 0.5 ? 1 : 0, std::memory_order_relaxed);
    with_writer(vcpu, [=](PinWriter& writer) { writer.write_pwm(pin, duty); });
    return {};
}

Result<void> VirtualPins::set_pwm_period(VcpuId vcpu, PinId pin, Nanoseconds period) {
    static_cast<void>(index_of(pin));
    with_writer(vcpu, [=](PinWriter& writer) { writer.write_pwm_period(pin, period); });
    return {};
}

Result<double> VirtualPins::read_analog(VcpuId vcpu, PinId pin) {
    double value = 0;
    const auto index = static_cast<std::uint16_t>(index_of(pin));
    QDUINO_TRY(ask(vcpu, {.kind = MailKind::analog, .pin = index}, {}, {}, &value));
    return value;
}

Result<void> VirtualPins::set_safe_state(PinId pin, Level level) {
    publish_safe_state(pin, level);
    return {};
}

void VirtualPins::publish_safe_state(PinId pin, Level level) {
    layout().outputs[index_of(pin)].set_safe(level);
}

void VirtualPins::publish_line(PinId pin, ChipPlace line) {
    layout().outputs[index_of(pin)].line.store(line.word(), std::memory_order_release);
}

void VirtualPins::publish_channel(PinId pin, ChipPlace channel) {
    layout().outputs[index_of(pin)].pwm_channel.store(channel.word(), std::memory_order_release);
}

void VirtualPins::force_safe_states() {
    if (attached()) linux::force_safe_states(layout(), will_);
}

int force_safe_states(PinsLayout& layout, PinWriter& writer) {
    int forced = 0;
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        OutputPin& output = layout.outputs[number];
        const auto level = output.safe_level();
        if (!level) continue;
        if (output.pwm.load()) writer.write_pwm(PinId{number}, level == Level::high ? 1.0 : 0.0);
        writer.write_level(PinId{number}, *level);
        output.pwm.store(0);
        output.level.store(static_cast<std::uint8_t>(*level));
        ++forced;
    }
    return forced;
}

// ---- buses --------------------------------------------------------------------------------------

Result<void> VirtualPins::ask(VcpuId vcpu, MailHead head, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in, double* analog) {
    QDUINO_EXPECT(vcpu < kVcpuLimit);
    QDUINO_TRY_ASSIGN(head, with_sizes(head, out.size(), in.size()));
    std::unique_lock lock{shared_by_non_vcpus_, std::defer_lock};
    if (vcpu == kNoVcpu) lock.lock();
    Mailbox& mail = layout().mail[vcpu];
    const Instant deadline = monotonic_now() + kBusTimeout;
    const std::uint32_t sequence = post_request(mail, head, out);
    layout().doorbell.fetch_add(1, std::memory_order_release);
    futex_wake_all(layout().doorbell);
    if (!wait_for_reply(mail, sequence, deadline)) {
        return make_error(ErrorCode::timed_out, "the virtual machine does not answer: is it running?");
    }
    QDUINO_TRY(what_machine_said(mail));
    load_words(mail.in, in);
    if (analog) *analog = std::bit_cast<double>(mail.analog_bits.load(std::memory_order_relaxed));
    return {};
}

Result<void> VirtualPins::transfer(VcpuId vcpu, I2cBus bus, I2cAddress address,
                                   std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    return ask(vcpu, i2c_request(bus, address), out, in, nullptr);
}

Result<void> VirtualPins::transfer(VcpuId vcpu, SpiBus bus, SpiSettings settings,
                                   std::span<std::uint8_t> data) {
    return ask(vcpu, spi_request(bus, settings), data, data, nullptr);
}

// ---- inputs that change -------------------------------------------------------------------------

std::uint32_t VirtualPins::input_changes() const {
    return layout().input_changes.load(std::memory_order_acquire);
}

void VirtualPins::wait_input_change(std::uint32_t seen, Instant deadline) {
    layout().input_waiters.fetch_add(1);
    futex_wait_until(layout().input_changes, seen, deadline);
    layout().input_waiters.fetch_sub(1);
}

void VirtualPins::wake_input_waiters() {
    layout().input_changes.fetch_add(1);
    futex_wake_all(layout().input_changes);
}

Result<void> VirtualPins::watch_edges(PinId pin, Edge) {
    // The machine counts the edges of every input: the pin only has to be one.
    if (layout().outputs[index_of(pin)].is_set()) return {};
    return set_mode(kNoVcpu, pin, PinMode::input);
}

Instant VirtualPins::edge_instant(PinId pin, Level to, std::uint32_t number) {
    const InputPin& input = layout().inputs[index_of(pin)];
    const bool rising = to == Level::high;
    const EdgeTimes& times = rising ? input.rising_times : input.falling_times;
    return times.at(number, (rising ? input.rising : input.falling).load(std::memory_order_acquire));
}

EdgeCounts VirtualPins::edges(PinId pin) {
    const InputPin& input = layout().inputs[index_of(pin)];
    return {input.rising.load(std::memory_order_acquire), input.falling.load(std::memory_order_acquire)};
}

// ---- heartbeats, places, safe states ------------------------------------------------------------

void VirtualPins::promise(VcpuId vcpu, Instant expected_by) {
    Heartbeat& beat = layout().heartbeats[vcpu];
    beat.expected_by_ns.store(to_ns(expected_by), std::memory_order_relaxed);
    beat.count.store(beat.count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

void VirtualPins::prolong(VcpuId vcpu, Instant expected_by) {
    const std::atomic<std::int64_t>& promised = layout().heartbeats[vcpu].expected_by_ns;
    if (promised.load(std::memory_order_relaxed) < to_ns(expected_by)) promise(vcpu, expected_by);
}

void VirtualPins::promise_progress(VcpuId vcpu, Instant by, Nanoseconds limit) {
    Heartbeat& beat = layout().heartbeats[vcpu];
    beat.progress_limit_ns.store(to_ns(limit), std::memory_order_relaxed);
    beat.progress_by_ns.store(to_ns(by), std::memory_order_relaxed);
}

void VirtualPins::publish_place(VcpuId vcpu, LoopPlace place) {
    layout().heartbeats[vcpu].place.store(place.word(), std::memory_order_relaxed);
}

Nanoseconds VirtualPins::heartbeat_bound() const {
    return Nanoseconds{layout().heartbeat_bound_ns.load(std::memory_order_relaxed)};
}

std::uint64_t VirtualPins::lost_edges() const {
    std::uint64_t lost = 0;
    for (const auto& slot : layout().writers) lost += slot.lost.load(std::memory_order_relaxed);
    return lost;
}

}  // namespace qduino::board::linux
