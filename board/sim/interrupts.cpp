#include "board/sim/interrupts.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/contract.h"

namespace qduino::board::sim {

namespace {

constexpr std::uint64_t all_cores(int cores) {
    return cores == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << cores) - 1;
}

/// Inverse transform: −ln(u)/λ, with u in (0, 1] from the top 53 bits.
/// (std::exponential_distribution would differ from one standard library to another, and with it
/// the run.)
Nanoseconds exponential(std::mt19937_64& random, double rate_hz) {
    const double u = (static_cast<double>(random() >> 11) + 1.0) * 0x1.0p-53;
    return std::max(from_seconds(-std::log(u) / rate_hz), Nanoseconds{1});
}

}  // namespace

Interrupts::Interrupts(const SimConfig& config) {
    allowed_.fill(all_cores(config.cores));
    for (const InterruptSource& source : config.interrupts) {
        QDUINO_EXPECT(source.rate_hz > 0 && source.stuck_rate_hz > 0 && source.rate_hz <= 1e8);
        QDUINO_EXPECT(source.core >= 0 && source.core < config.cores && source.device != DeviceClass::all);
        sources_.push_back({.config = source, .origin = source.from, .random = std::mt19937_64{}});
    }
    if (config.tick_period > Nanoseconds{0}) {
        for (int core = 0; core < config.cores; ++core) {
            InterruptSource tick{.device = DeviceClass::all,
                                 .rate_hz = 1.0 / to_seconds(config.tick_period),
                                 .arrival = Arrival::periodic,
                                 .core = core,
                                 .top_half = config.tick_cost};
            sources_.push_back({.config = tick, .tick = true, .random = std::mt19937_64{}});
        }
    }
    for (std::size_t i = 0; i < sources_.size(); ++i) {
        sources_[i].random.seed(config.seed * 0x9E3779B97F4A7C15u + i);
        sources_[i].next = sources_[i].config.from;
        schedule_next(sources_[i]);
    }
    refresh_next();
}

void Interrupts::schedule_next(Source& source) {
    const InterruptSource& config = source.config;
    if (!source.stuck && config.stuck_from != kForever && source.next >= config.stuck_from) {
        source.stuck = true;
        source.origin = config.stuck_from;
        source.count = 0;
    }
    if (config.arrival == Arrival::periodic || source.stuck) {
        const double rate_hz = source.stuck ? config.stuck_rate_hz : config.rate_hz;
        source.next = source.origin + from_seconds(static_cast<double>(++source.count) / rate_hz);
    } else {
        source.next += exponential(source.random, config.rate_hz);
    }
    // A storm begins on time, even when the device was silent until then.
    if (!source.stuck && source.next > config.stuck_from) source.next = config.stuck_from;
    if (source.next >= config.lost_from) source.next = kForever;
}

void Interrupts::refresh_next() {
    next_ = kForever;
    for (const Source& source : sources_) next_ = std::min(next_, source.next);
}

int Interrupts::core_for(const InterruptSource& source) const {
    if (source.device == DeviceClass::all) return source.core;
    const std::uint64_t allowed = allowed_[static_cast<std::size_t>(source.device)];
    if (allowed >> source.core & 1) return source.core;
    return std::countr_zero(allowed);
}

bool Interrupts::take_due(Instant now, Fired& fired) {
    const auto due =
        std::find_if(sources_.begin(), sources_.end(), [&](const Source& s) { return s.next <= now; });
    if (due == sources_.end()) return false;
    fired = {.core = core_for(due->config),
             .device = due->config.device,
             .top_half = due->config.top_half,
             .bottom_half = due->config.bottom_half};
    schedule_next(*due);
    refresh_next();
    return true;
}

bool Interrupts::route(DeviceClass device, int core, bool allowed) {
    const std::uint64_t bit = std::uint64_t{1} << core;
    auto changed = allowed_;
    for (int d = 0; d < kDeviceClassCount; ++d) {
        if (device != DeviceClass::all && static_cast<int>(device) != d) continue;
        std::uint64_t& cores = changed[static_cast<std::size_t>(d)];
        cores = allowed ? cores | bit : cores & ~bit;
        if (cores == 0) return false;
    }
    allowed_ = changed;
    return true;
}

void Interrupts::serve(DeviceClass device, VcpuId io) {
    for (std::size_t d = 0; d < served_by_.size(); ++d) {
        if (device == DeviceClass::all || static_cast<std::size_t>(device) == d) served_by_[d] = io;
    }
}

void Interrupts::set_tick(int core, bool enabled, Instant now) {
    for (Source& source : sources_) {
        if (!source.tick || source.config.core != core) continue;
        if (enabled == (source.next != kForever)) continue;
        if (enabled) {  // back on the grid it left
            source.next = now;
            source.count =
                static_cast<std::uint64_t>(to_seconds(now - source.origin) * source.config.rate_hz);
            do schedule_next(source);
            while (source.next <= now);
        } else {
            source.next = kForever;
        }
    }
    refresh_next();
}

bool Interrupts::ticks(int core) const {
    return std::any_of(sources_.begin(), sources_.end(), [&](const Source& source) {
        return source.tick && source.config.core == core && source.next != kForever;
    });
}

std::vector<InterruptSource> Interrupts::on_core(int core) const {
    std::vector<InterruptSource> found;
    for (const Source& source : sources_) {
        if (source.next != kForever && core_for(source.config) == core) found.push_back(source.config);
    }
    return found;
}

double Interrupts::rate_hz(int core) const {
    double sum = 0;
    for (const InterruptSource& source : on_core(core)) sum += source.rate_hz;
    return sum;
}

}  // namespace qduino::board::sim
