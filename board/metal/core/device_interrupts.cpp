#include "board/metal/core/device_interrupts.h"

#include <algorithm>
#include <bit>

#include "base/text.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/core/kernel.h"

namespace qduino::board::metal {
namespace {

bool names(DeviceClass named, std::size_t kind) {
    return named == DeviceClass::all || static_cast<std::size_t>(named) == kind;
}

void run_bottom_half(void* device) { static_cast<Device*>(device)->serve_in_turn(); }

}  // namespace

void Device::serve_in_turn() {
    if (calls_.fetch_add(1) > 0) return;
    std::uint32_t seen = 0;
    do {
        seen = calls_.load();
        serve();
    } while (!calls_.compare_exchange_strong(seen, 0));
}

void DeviceInterrupts::add(InterruptSource& source, DeviceClass kind, std::uint8_t line, Device& device) {
    entries_.push_back({.source = &source, .device = &device, .kind = kind, .line = line});
    route(entries_.back());
}

void DeviceInterrupts::serve_on(DeviceClass kind, VcpuId io) {
    for (std::size_t i = 0; i < io_.size(); ++i) {
        if (names(kind, i)) io_[i] = io;
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
    const int wanted = io_of(entry) == kNoVcpu ? 0 : threads[io_of(entry)].spec.core;
    entry.core = wanted >= 0 && (forbidden >> wanted & 1) == 0 ? wanted : std::countr_one(forbidden);
    const auto index = static_cast<std::size_t>(&entry - entries_.begin());
    entry.source->route(entry.line, static_cast<std::uint8_t>(kDeviceVectors + index),
                        core_at(entry.core).target());
}

/// The bottom half becomes the work of its I/O VCPU. False: there is none that takes it.
bool DeviceInterrupts::give(const Entry& entry, Instant now) const {
    const Work work{.handler = &run_bottom_half, .context = entry.device, .came = now, .after_stop = true};
    return io_of(entry) != kNoVcpu && give_work(io_of(entry), work);
}

void DeviceInterrupts::serve(std::size_t index, Instant now) {
    if (index >= entries_.size()) return;  // nobody's vector
    const Entry& entry = entries_[index];
    entry.device->quiet();
    if (!give(entry, now)) entry.device->serve_in_turn();
}

void DeviceInterrupts::ask(const Device& device) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        const Entry& entry = entries_[i];
        if (entry.device != &device || give(entry, computer_clock.now())) continue;
        const InterruptsOff off;
        CoreInterrupts::interrupt_core(core_at(entry.core).target(),
                                       static_cast<std::uint8_t>(kDeviceVectors + i));
    }
}

bool DeviceInterrupts::serves_on(const Entry& entry, int core) const {
    return core == (io_of(entry) == kNoVcpu ? entry.core : threads[io_of(entry)].spec.core);
}

Instant DeviceInterrupts::next_turn(int core) const {
    Instant next = kForever;
    for (const Entry& entry : entries_) {
        if (serves_on(entry, core)) next = std::min(next, entry.device->next_turn());
    }
    return next;
}

void DeviceInterrupts::serve_turns(int core, Instant now) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        if (serves_on(entries_[i], core) && entries_[i].device->next_turn() <= now) serve(i, now);
    }
}

void DeviceInterrupts::serve_all() {
    const InterruptsOff off;
    for (const Entry& entry : entries_) entry.device->serve_in_turn();
}

int DeviceInterrupts::count_on(int core) const {
    int count = 0;
    for (const Entry& entry : entries_) count += entry.core == core ? 1 : 0;
    return count;
}

FixedString<80> DeviceInterrupts::words_on(int core) const {
    FixedString<80> words;
    for (const Entry& entry : entries_) {
        if (entry.core != core) continue;
        write(words, words.empty() ? " (" : ", ", kDeviceNames(entry.kind));
        if (io_of(entry) == kNoVcpu)
            write(words, ": above every loop");
        else
            write(words, ": io ", io_of(entry));
    }
    return words.empty() ? words : write(words, ')');
}

}  // namespace qduino::board::metal
