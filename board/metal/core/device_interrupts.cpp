#include "board/metal/core/device_interrupts.h"

#include <bit>

#include "board/metal/core/kernel.h"
#include "board/metal/machine/instructions.h"
#include "board/metal/machine/local_apic.h"

namespace qduino::board::metal {
namespace {

bool names(DeviceClass named, std::size_t kind) {
    return named == DeviceClass::all || static_cast<std::size_t>(named) == kind;
}

void run_bottom_half(void* device) { static_cast<Device*>(device)->serve(); }

}  // namespace

void DeviceInterrupts::add(IoApic& io_apic, DeviceClass kind, std::uint8_t line, Device& device) {
    entries_.push_back({.io_apic = &io_apic, .device = &device, .kind = kind, .line = line});
    route(entries_.back());
}

void DeviceInterrupts::serve_on(DeviceClass kind, VcpuId io) {
    for (Entry& entry : entries_) {
        if (names(kind, static_cast<std::size_t>(entry.kind))) entry.io = io;
    }
}

Result<void> DeviceInterrupts::route(DeviceClass kind, int core, bool allowed) {
    const std::uint64_t all = (std::uint64_t{1} << core_count()) - 1;
    const std::uint64_t bit = std::uint64_t{1} << core;
    auto forbidden = forbidden_;
    for (std::size_t i = 0; i < forbidden.size(); ++i) {
        if (!names(kind, i)) continue;
        forbidden[i] = allowed ? forbidden[i] & ~bit : forbidden[i] | bit;
        if ((forbidden[i] & all) == all)
            return make_error(ErrorCode::unavailable,
                              "noInterrupts: no other core is left to take this device's interrupts");
    }
    forbidden_ = forbidden;
    route_all();
    return {};
}

void DeviceInterrupts::route_all() {
    for (Entry& entry : entries_) route(entry);
}

/// To the core of its I/O VCPU, or to the first that takes it.
void DeviceInterrupts::route(Entry& entry) {
    const std::uint64_t forbidden = forbidden_[static_cast<std::size_t>(entry.kind)];
    const int wanted = entry.io == kNoVcpu ? 0 : threads[entry.io].spec.core;
    entry.core = wanted >= 0 && (forbidden >> wanted & 1) == 0 ? wanted : std::countr_one(forbidden);
    const auto index = static_cast<std::size_t>(&entry - entries_.begin());
    entry.io_apic->route(entry.line, static_cast<std::uint8_t>(kDeviceVectors + index),
                         cores[static_cast<std::size_t>(entry.core)].apic());
}

void DeviceInterrupts::serve(std::size_t index, Instant now) {
    if (index >= entries_.size()) return;  // nobody's vector
    const Entry& entry = entries_[index];
    entry.device->quiet();
    const Work work{.handler = &run_bottom_half, .context = entry.device, .came = now, .after_stop = true};
    if (entry.io == kNoVcpu || !give_work(entry.io, work)) entry.device->serve();
}

void DeviceInterrupts::serve_all() {
    const InterruptsOff off;
    for (const Entry& entry : entries_) entry.device->serve();
}

int DeviceInterrupts::count_on(int core) const {
    int count = 0;
    for (const Entry& entry : entries_) count += entry.core == core ? 1 : 0;
    return count;
}

}  // namespace qduino::board::metal
