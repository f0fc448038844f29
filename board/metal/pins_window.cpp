#include "board/metal/pins_window.h"

#include <bit>

#include "board/board.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/core/kernel.h"
#include "board/metal/driver/pci.h"
#include "board/window/mail_client.h"

namespace qduino::board::metal {
PinsWindow pins_window;

bool PinsWindow::open() {
    constexpr std::uint16_t kVendor = 0x1af4, kSharedMemory = 0x1110;
    constexpr std::uint32_t kMemory = 2;
    const auto device = PciDevice::find(kVendor, kSharedMemory);
    if (!device) return false;
    device->enable(false);
    return open_layout(device->registers(kMemory).memory<PinsLayout>());
}

bool PinsWindow::open_at(std::uint64_t address) {
    waits_for_inputs_ = false;
    return open_layout(reinterpret_cast<PinsLayout*>(address));
}

bool PinsWindow::open_layout(PinsLayout* layout) {
    if (!layout || layout->magic.load(std::memory_order_acquire) != kPinsMagic) return false;
    if (layout->version != kPinsVersion || layout->size != kPinsFileSize) return false;
    layout->sketch_session.fetch_add(1, std::memory_order_release);
    layout_ = layout;
    return true;
}

NarrowRing& PinsWindow::ring_of(int writer) const {
    return *reinterpret_cast<NarrowRing*>(reinterpret_cast<std::uint8_t*>(layout_) + ring_offset(writer));
}

// ---- outputs ------------------------------------------------------------------------------------

/// The order is that of pins_layout.h: the flag, the clock, the push. Interrupts are off, so that
/// nobody holds the others' horizon back for longer than this takes.
void PinsWindow::push(PinEvent event) {
    const InterruptsOff off;
    const VcpuId writer = running_vcpu();
    WriterSlot& slot = layout_->writers[writer];
    if (slot.in_use.load(std::memory_order_relaxed) == 0) [[unlikely]]
        slot.in_use.store(1u + writer, std::memory_order_release);
    slot.writing.store(1, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    event.time_ns = to_ns(computer_clock.now());
    if (!ring_of(writer).try_push(event)) slot.lost.fetch_add(1, std::memory_order_relaxed);
    slot.writing.store(0, std::memory_order_release);
    layout_->sketch_clock_ns.store(event.time_ns, std::memory_order_release);
}

void PinsWindow::pin_written(Instant, PinId pin, Level level) {
    OutputPin& output = layout_->outputs[pin.number];
    output.level.store(static_cast<std::uint8_t>(level), std::memory_order_relaxed);
    if (!output.drives()) output.set_mode(PinMode::output);
    push({0, pin.number, PinEventKind::level, level, 0});
}

void PinsWindow::pwm_written(Instant, PinId pin, double duty) {
    OutputPin& output = layout_->outputs[pin.number];
    if (!output.drives()) output.set_mode(PinMode::output);
    push({0, pin.number, PinEventKind::pwm, Level::low,
          std::bit_cast<std::uint32_t>(static_cast<float>(duty))});
}

void PinsWindow::pwm_period_set(Instant, PinId pin, Nanoseconds period) {
    push({0, pin.number, PinEventKind::pwm_period, Level::low, static_cast<std::uint32_t>(to_ns(period))});
}

// ---- inputs and buses ---------------------------------------------------------------------------

Level PinsWindow::pin_level(Instant, PinId pin) {
    OutputPin& output = layout_->outputs[pin.number];
    if (!output.is_set()) [[unlikely]] {
        output.set_mode(PinMode::input);
        // It is answered after the next publication of inputs.
        static_cast<void>(ask({}, {}, {}, nullptr));
    }
    if (waits_for_inputs_) wait_for_inputs();
    return layout_->inputs[pin.number].level.load(std::memory_order_acquire) != 0 ? Level::high : Level::low;
}

void PinsWindow::wait_for_inputs() const {
    const std::int64_t asked_ns = to_ns(computer_clock.now());
    layout_->sketch_clock_ns.store(asked_ns, std::memory_order_release);
    while (layout_->inputs_as_of_ns.load(std::memory_order_acquire) < asked_ns - kInputAge.count() &&
           to_ns(computer_clock.now()) < asked_ns + Nanoseconds{kPatience}.count())
        spin_hint();
}

double PinsWindow::analog_level(Instant, PinId pin) {
    std::uint64_t bits = 0;
    const bool answered = ask({.kind = MailKind::analog, .pin = pin.number}, {}, {}, &bits).ok();
    return answered ? std::bit_cast<double>(bits) : 0.0;
}

Result<void> PinsWindow::i2c_transfer(Instant, I2cBus bus, I2cAddress address,
                                      std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    return ask(i2c_request(bus, address), out, in, nullptr);
}

Result<void> PinsWindow::spi_transfer(Instant, SpiBus bus, SpiSettings settings,
                                      std::span<std::uint8_t> data) {
    return ask(spi_request(bus, settings), data, data, nullptr);
}

Result<void> PinsWindow::ask(MailHead head, std::span<const std::uint8_t> out, std::span<std::uint8_t> in,
                             std::uint64_t* analog) {
    QDUINO_TRY_ASSIGN(head, with_sizes(head, out.size(), in.size()));
    board::Mailbox& mail = layout_->mail[running_vcpu()];
    Board& board = current();
    const Instant give_up = board.now() + kPatience;
    layout_->sketch_clock_ns.store(to_ns(board.now()), std::memory_order_release);
    const std::uint32_t sequence = post_request(mail, head, out);
    while (mail.reply.load(std::memory_order_acquire) != sequence) {
        if (board.now() >= give_up)
            return make_error(ErrorCode::timed_out, "the machine outside does not answer: is it running?");
        board.sleep_until(board.now() + kLook);
    }
    QDUINO_TRY(what_machine_said(mail));
    load_words(mail.in, in);
    if (analog) *analog = mail.analog_bits.load(std::memory_order_relaxed);
    return {};
}

}  // namespace qduino::board::metal
