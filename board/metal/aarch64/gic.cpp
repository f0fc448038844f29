#include "board/metal/aarch64/gic.h"

#include <algorithm>
#include <bit>

#include "base/contract.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/computer/spin_lock.h"

namespace qduino::board::metal {
namespace {

// Registers of the distributor.
constexpr std::uint32_t kDistribute = 0x000, kGroups = 0x080, kOn = 0x100, kOff = 0x180, kPriorities = 0x400,
                        kTargets = 0x800, kSend = 0xf00;
// Registers of a CPU interface.
constexpr std::uint32_t kControl = 0x00, kPriorityMask = 0x04, kAcknowledge = 0x0c, kEnd = 0x10;

// Interrupts by their numbers. 0…15 are sent by software; those from kDevices on stand for devices.
constexpr std::uint32_t kStop = 0, kCall = 1, kDevices = 2, kFirstPrivate = 16, kTimer = 27;
constexpr std::uint32_t kOwn = 0xffffu | 1u << kTimer;
constexpr std::uint32_t kFirstShared = 32;
constexpr std::uint32_t kUsual = 0xa0;  // a priority; 0 is the highest

constinit SpinLock targets_lock;

std::uint32_t bit_of(std::uint32_t number) { return 1u << number % 32; }
std::uint32_t word_of(std::uint32_t number) { return number / 32 * 4; }

/// `value` into the byte of interrupt `number`: four share a word.
void set_byte(std::uint64_t registers, std::uint32_t number, std::uint32_t value) {
    const std::uint64_t at = registers + number / 4 * 4;
    const std::uint32_t shift = number % 4 * 8;
    memory_write(at, (memory_read(at) & ~(0xffu << shift)) | value << shift);
}

}  // namespace

void Gic::open(std::uint64_t distributor, std::uint64_t cpu_interface) {
    distributor_ = distributor;
    cpu_ = cpu_interface;
    for (std::uint32_t number = kFirstShared; number < kNumbers; number += 32) {
        memory_write(distributor_ + kOff + word_of(number), UINT32_MAX);
        memory_write(distributor_ + kGroups + word_of(number), UINT32_MAX);
    }
    memory_write(distributor_ + kDistribute, 3);  // both groups
}

/// Group 0 is FIQ and group 1 is IRQ, where the registers of groups are ours. Where they are the
/// firmware's, all are IRQ, and the order to stop waits for a core that holds interrupts back.
void Gic::enable() {
    constexpr std::uint32_t kBothGroups = 3, kOneRegisterForBoth = 4, kGroup0IsFiq = 8;
    memory_write(distributor_ + kGroups, ~(1u << kStop));
    memory_write(distributor_ + kOff, ~kOwn);
    for (std::uint32_t number = 0; number < kFirstShared; ++number)
        set_byte(distributor_ + kPriorities, number, number == kStop ? 0 : kUsual);
    memory_write(distributor_ + kOn, kOwn);
    memory_write(cpu_ + kPriorityMask, 0xff);
    memory_write(cpu_ + kControl, kBothGroups | kOneRegisterForBoth | kGroup0IsFiq);
}

/// Targets of the first words are read-only: each core finds itself there (IHI 0048B, 4.3.12).
std::uint32_t Gic::number() {
    const std::uint32_t own = memory_read(distributor_ + kTargets) & 0xff;
    return own == 0 ? 0 : static_cast<std::uint32_t>(std::countr_zero(own));
}

void Gic::acknowledge(Frame& frame) {
    const std::uint32_t word = memory_read(cpu_ + kAcknowledge), number = word & 0x3ff;
    frame.error = word;
    if (number == kTimer) {
        QDUINO_WRITE_SYSTEM(cntv_ctl_el0, 0);  // once
        frame.vector = kTimerVector;
    } else if (number == kStop || number == kCall) {
        frame.vector = number == kStop ? kStopVector : kCallVector;
    } else if (number < kFirstPrivate) {
        frame.vector = kDeviceVectors + number - kDevices;
    } else {
        frame.vector = number < kNumbers ? vectors_[number] : kSpuriousVector;
    }
}

void Gic::end_of_interrupt(const Frame& frame) {
    memory_write(cpu_ + kEnd, static_cast<std::uint32_t>(frame.error));
}

void Gic::set_alarm(Instant t) {
    if (t == kForever) {
        QDUINO_WRITE_SYSTEM(cntv_ctl_el0, 0);
        return;
    }
    QDUINO_WRITE_SYSTEM(cntv_cval_el0, computer_clock.count_at(std::max(t, kEpoch)));
    QDUINO_WRITE_SYSTEM(cntv_ctl_el0, 1);
}

void Gic::interrupt_core(std::uint32_t target, std::uint8_t vector) {
    const std::uint32_t number = vector == kCallVector ? kCall : kDevices + vector - kDeviceVectors;
    QDUINO_EXPECT(number < kFirstPrivate);
    asm volatile("dsb ish" : : : "memory");  // what was left in its mail is there first
    memory_write(distributor_ + kSend, 1u << (16 + target) | number);
}

void Gic::stop_other_cores() {
    constexpr std::uint32_t kAllOthers = 1u << 24;
    memory_write(distributor_ + kSend, kAllOthers | kStop);
}

void Gic::route(std::uint32_t number, std::uint8_t vector, std::uint32_t target) {
    QDUINO_EXPECT(number >= kFirstShared && number < kNumbers);
    const SpinGuard held(targets_lock);
    memory_write(distributor_ + kOff + word_of(number), bit_of(number));
    vectors_[number] = vector;
    set_byte(distributor_ + kPriorities, number, kUsual);
    set_byte(distributor_ + kTargets, number, 1u << target);
    asm volatile("dsb ish" : : : "memory");
    memory_write(distributor_ + kOn + word_of(number), bit_of(number));
}

}  // namespace qduino::board::metal
