#include "board/metal/driver/pc_timers.h"

#include <algorithm>

#include "board/metal/computer/instructions.h"
#include "board/metal/driver/wide_ports.h"

namespace qduino::board::metal {
namespace {

constexpr int kLooks = 10'000;  // 60 us at the least, in which each timer changes
constexpr std::uint16_t kPitControl = 0x43, kPitChannel0 = 0x40, kPitChannel2 = 0x42, kPitGate = 0x61;
constexpr std::uint64_t kPitHz = 1'193'182;

std::uint64_t rate_by_processor() {
    constexpr std::uint32_t kLeaf = 0x15;
    if (cpuid(0).eax < kLeaf) return 0;
    const ProcessorFacts ratio = cpuid(kLeaf);  // ebx / eax of a crystal of ecx hertz
    return ratio.eax == 0 ? 0 : std::uint64_t{ratio.ecx} * ratio.ebx / ratio.eax;
}

// ---- PIT ----------------------------------------------------------------------------------------

std::uint32_t pit_count() {
    constexpr std::uint8_t kLatchChannel2 = 0x80;
    port_write(kPitControl, kLatchChannel2);
    const std::uint32_t low = port_read(kPitChannel2);
    return low | std::uint32_t{port_read(kPitChannel2)} << 8;
}

/// Counts down `ticks` from now on, and then raises its output (mode 0; port 0x61 has gate and
/// output).
void start_pit(std::uint32_t ticks) {
    constexpr std::uint8_t kBothBytesMode0 = 0xb0;
    port_write(kPitGate, static_cast<std::uint8_t>((port_read(kPitGate) & ~2u) | 1u));
    port_write(kPitControl, kBothBytesMode0);
    port_write(kPitChannel2, static_cast<std::uint8_t>(ticks));
    port_write(kPitChannel2, static_cast<std::uint8_t>(ticks >> 8));
}

bool pit_counts() {
    start_pit(0xffff);
    const std::uint32_t first = pit_count();
    for (int looks = 0; looks < kLooks; ++looks) {
        if (pit_count() != first) return true;
    }
    return false;
}

std::uint64_t rate_by_pit() {
    constexpr std::uint32_t kTicks = 59'659;  // 50 ms
    if (!pit_counts()) return 0;
    start_pit(kTicks);
    const std::uint64_t begin = clock_count();
    while ((port_read(kPitGate) & 0x20) == 0) {
    }
    return (clock_count() - begin) * kPitHz / kTicks;
}

// ---- ACPI's timer -------------------------------------------------------------------------------

/// Of 24 bits, or 32: it comes round after more than 4 s.
std::uint32_t acpi_count(std::uint16_t port) { return port_read_word(port) & 0xff'ffff; }

std::uint64_t rate_by_acpi(std::uint16_t port) {
    constexpr std::uint64_t kHz = 3'579'545, kTicks = kHz / 20;
    if (port == 0) return 0;
    const std::uint32_t before = acpi_count(port);
    std::uint32_t first = before;
    for (int looks = 0; first == before; first = acpi_count(port)) {
        if (++looks == kLooks) return 0;
    }
    const std::uint64_t begin = clock_count();
    std::uint32_t passed = 0;
    while (passed < kTicks) passed = (acpi_count(port) - first) & 0xff'ffff;
    return (clock_count() - begin) * kHz / passed;
}

}  // namespace

std::uint64_t clock_rate(std::uint16_t acpi_timer) {
    std::uint64_t hz = rate_by_processor();
    if (hz == 0) hz = rate_by_pit();
    return hz == 0 ? rate_by_acpi(acpi_timer) : hz;
}

/// Mode 2, rate generator.
void repeat_pit(double us) {
    constexpr std::uint8_t kBothBytesMode2 = 0x34;
    const auto ticks =
        static_cast<std::uint16_t>(std::clamp(us * static_cast<double>(kPitHz) / 1e6, 2.0, 65535.0));
    port_write(kPitControl, kBothBytesMode2);
    port_write(kPitChannel0, static_cast<std::uint8_t>(ticks));
    port_write(kPitChannel0, static_cast<std::uint8_t>(ticks >> 8));
}

}  // namespace qduino::board::metal
