#include "board/metal/x86/local_apic.h"

#include <algorithm>

#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint32_t kBaseMsr = 0x1b;
constexpr std::uint32_t kDeadlineMsr = 0x6e0;
constexpr std::uint32_t kX2ApicMsrs = 0x800;
constexpr std::uint32_t kCommandMsr = 0x830;

constexpr std::uint32_t kDivideByOne = 0xb;
constexpr std::uint32_t kPending = 0x1000;

// Words of the command register (SDM volume 3, figure 11-12).
constexpr std::uint32_t kInit = 0x4500;
constexpr std::uint32_t kStartup = 0x4600;
constexpr std::uint32_t kNmiToAllOthers = 0xc4400;

void wait_us(std::uint64_t length) {
    const std::uint64_t end = clock_count() + computer_clock.hz() / 1'000'000 * length;
    while (clock_count() < end) spin_hint();
}

}  // namespace

std::uint32_t LocalApic::read(std::uint32_t offset) {
    return x2apic_ ? static_cast<std::uint32_t>(msr_read(kX2ApicMsrs + offset / 16))
                   : memory_read(address_ + offset);
}

void LocalApic::write(std::uint32_t offset, std::uint32_t value) {
    if (x2apic_) return msr_write(kX2ApicMsrs + offset / 16, value);
    memory_write(address_ + offset, value);
}

void LocalApic::enable(std::uint64_t address, bool may_change) {
    constexpr std::uint32_t kHasX2Apic = 1u << 21, kHasDeadline = 1u << 24;
    const std::uint32_t features = cpuid(1).ecx;
    address_ = address;
    x2apic_ = may_change && (features & kHasX2Apic) != 0;
    tsc_deadline_ = (features & kHasDeadline) != 0;
    constexpr std::uint64_t kEnabled = 1u << 11, kX2Mode = 1u << 10;
    msr_write(kBaseMsr, msr_read(kBaseMsr) | kEnabled | (x2apic_ ? kX2Mode : 0));
    write(kSpurious, 0x100 | kSpuriousVector);
    write(kTaskPriority, 0);
    write(kLint0, kMasked);
    write(kLint1, kMasked);
    write(kDivider, kDivideByOne);
    set_timer_mode();
}

std::uint32_t LocalApic::number() { return x2apic_ ? read(kNumber) : read(kNumber) >> 24; }

void LocalApic::calibrate(std::uint64_t hz) {
    computer_clock.set(hz, clock_count());
    write(kTimer, kMasked | kTimerVector);
    write(kCount, UINT32_MAX);
    const std::uint64_t begin = clock_count();
    wait_us(20'000);
    const std::uint64_t counted = UINT32_MAX - read(kCountLeft), passed = clock_count() - begin;
    write(kCount, 0);
    set_timer_mode();
    timer_hz_ = static_cast<std::uint64_t>(static_cast<double>(counted) * static_cast<double>(hz) /
                                           static_cast<double>(passed));
}

/// An instant that is past would interrupt the next context before its first instruction; the
/// smallest count of the timer lets it get on.
void LocalApic::set_alarm(Instant t) {
    if (tsc_deadline_)
        return msr_write(kDeadlineMsr, t == kForever ? 0 : computer_clock.count_at(std::max(t, kEpoch)));
    if (t == kForever) return write(kCount, 0);
    const Nanoseconds left = std::clamp(t - computer_clock.now(), Nanoseconds{0}, Nanoseconds{1s});
    const std::uint64_t ticks = static_cast<std::uint64_t>(left.count()) * timer_hz_ / 1'000'000'000 + 1;
    write(kCount, static_cast<std::uint32_t>(std::min<std::uint64_t>(ticks, UINT32_MAX)));
}

void LocalApic::command(std::uint32_t apic, std::uint32_t word) {
    order_stores();  // what was left for that core is there first
    if (x2apic_) return msr_write(kCommandMsr, std::uint64_t{apic} << 32 | word);
    while ((read(kCommand) & kPending) != 0) spin_hint();
    write(kCommandHigh, apic << 24);
    write(kCommand, word);
}

void LocalApic::interrupt_core(std::uint32_t apic, std::uint8_t vector) {
    constexpr std::uint32_t kFixed = 0x4000;
    const InterruptsOff off;  // two registers are one command
    command(apic, kFixed | vector);
}

/// SDM volume 3, 9.4.4.1: INIT, 10 ms, STARTUP twice, 200 us apart.
void LocalApic::start_core(std::uint32_t apic, std::uint32_t trampoline) {
    command(apic, kInit);
    wait_us(10'000);
    for (int i = 0; i < 2; ++i) {
        command(apic, kStartup | trampoline >> 12);
        wait_us(200);
    }
}

void LocalApic::stop_other_cores() { command(0, kNmiToAllOthers); }

}  // namespace qduino::board::metal
