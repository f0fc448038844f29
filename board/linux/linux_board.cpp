#include "board/linux/linux_board.h"

#include <algorithm>
#include <string>

#include "base/contract.h"
#include "board/linux/bus_device.h"
#include "board/linux/futex.h"
#include "board/linux/gpio_pin.h"
#include "board/linux/overheads.h"
#include "board/linux/real_time_thread.h"
#include "board/linux/sysfs_pin.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace qduino::board::linux {
namespace {

/// Tells the core that this is a spin: saves power, and time of the other hyper-thread.
inline void relax_core() {
#if defined(__x86_64__)
    _mm_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// Below this a pause of the core (up to 140 cycles) would be seen in the result.
constexpr Nanoseconds kTightSpin = 300ns;
/// Time for a look at both clocks, and for another when an interrupt came between.
constexpr Nanoseconds kLongSpin = 10us;
/// Below this three readings of the clock instead of one would be seen in the result.
constexpr Nanoseconds kWorthMeasuring = 300ns;
/// A reading that takes longer was interrupted, or is no reading of the cycle counter.
constexpr Nanoseconds kReadingAtMost = 100ns;
/// Before the end of a long spin: some cache misses, and little enough that what was fetched is still there.
constexpr Nanoseconds kRehearsal = 1500ns;

void spin_until(Instant t) {
    for (Nanoseconds left = t - cycle_clock.soon(); left > Nanoseconds{0}; left = t - cycle_clock.soon()) {
        if (left > kTightSpin) relax_core();
    }
}

}  // namespace

// ---- opening --------------------------------------------------------------------------------------------

Result<std::unique_ptr<LinuxBoard>> LinuxBoard::open(LinuxConfig config) {
    std::unique_ptr<LinuxBoard> board{new LinuxBoard{std::move(config)}};
    board->core_count_ = cpu_count();
    cycle_clock.start();
    if (auto opened = board->open_devices(); !opened) return opened.error();
    if (board->config_.handle_signals) {
        board->signals_ = std::make_unique<FatalSignals>(
            Will{[](void* self) { static_cast<LinuxBoard*>(self)->force_safe_states(); },
                 [](void* self) { static_cast<LinuxBoard*>(self)->request_stop(); }, board.get()});
    }
    return board;
}

Result<void> LinuxBoard::open_devices() {
    if (!config_.pins_path.empty()) {
        if (auto attached = virtual_.attach(config_.pins_path); !attached) return attached;
        pins_.fill(&virtual_);
        i2c_.fill(&virtual_);
        spi_.fill(&virtual_);
        watched_ = virtual_.heartbeat_bound() > Nanoseconds{0};
        heartbeat_bound_ = std::max(config_.heartbeat_bound, virtual_.heartbeat_bound());
    }
    if (auto opened = open_real_pins(); !opened) return opened;
    return open_real_buses();
}

template <typename Driver>
Result<void> LinuxBoard::add_pin(PinId pin, std::unique_ptr<Driver> driver) {
    if (pin.number >= kPinCount) return make_error(ErrorCode::invalid_argument, "a pin number is below 128");
    if (auto opened = driver->open(); !opened) return opened;
    pins_[pin.number] = driver.get();
    real_pins_.push_back(std::move(driver));
    return {};
}

Result<void> LinuxBoard::open_real_pins() {
    for (const GpioLine& line : config_.gpio) {
        if (auto added = add_pin(line.pin, std::make_unique<GpioPin>(line)); !added) return added;
        if (virtual_.attached()) virtual_.publish_line(line.pin, line.chip, line.line);
    }
    for (const PwmChannel& channel : config_.pwm) {
        if (auto added = add_pin(channel.pin, std::make_unique<PwmPin>(channel, config_.sysfs_root)); !added)
            return added;
        if (virtual_.attached()) virtual_.publish_channel(channel.pin, channel.chip, channel.channel);
    }
    for (const AnalogChannel& channel : config_.analog) {
        auto added = add_pin(channel.pin, std::make_unique<AnalogPin>(channel, config_.sysfs_root));
        if (!added) return added;
    }
    return {};
}

Result<void> LinuxBoard::open_real_buses() {
    for (const I2cPort& port : config_.i2c) {
        if (port.bus.number >= kBusLimit)
            return make_error(ErrorCode::invalid_argument, "an I2C bus number is below 16");
        auto device = std::make_unique<I2cDevice>();
        if (auto opened = device->open(port); !opened) return opened;
        i2c_[port.bus.number] = device.get();
        real_i2c_.push_back(std::move(device));
    }
    for (const SpiPort& port : config_.spi) {
        if (port.bus.number >= kBusLimit)
            return make_error(ErrorCode::invalid_argument, "an SPI bus number is below 16");
        auto device = std::make_unique<SpiDevice>();
        if (auto opened = device->open(port); !opened) return opened;
        spi_[port.bus.number] = device.get();
        real_spi_.push_back(std::move(device));
    }
    return {};
}

LinuxBoard::~LinuxBoard() {
    request_stop();
    threads_.clear();  // joins
    force_safe_states();
    witness_.dismiss();
    static_cast<void>(
        settings_.undo());  // what could not be undone stays in the state file, for `qduino restore`
}

// ---- time -----------------------------------------------------------------------------------------------

// What follows a spin is meant to happen at once, and most often it is a write to a pin. But while a core spins, its caches fill with
// what others do (the other hyper-thread, the interrupts): every twentieth write then took 0.3 to 1 us, on a noisy host. So what a
// write needs is fetched before.
//
//   ├ rest, if it must ┼ anchor of the clock ┼ pause ··· pause ┼ rehearsal ┼ pause ··· look, look, look ┤ digitalWrite
//                                                            t - 1.5 us                t - 0.3 us      t
void LinuxBoard::busy_until(Instant t) {
    if (watched_) promise_until(t);
    VcpuThread* thread = VcpuThread::current();
    if (thread) thread->rest_before_spin(t);
    const Nanoseconds left = t - cycle_clock.soon();
    if (left > kLongSpin) {
        cycle_clock.keep_fresh();
        spin_until(t - kRehearsal);
        if (thread) virtual_.rehearse_write(current_vcpu());
    }
    if (left > Nanoseconds{0}) spin_until(t);
}

// The caller measures from its own reading of the clock before the call to the one after it:
//
//   caller's reading ─ way in ─┬─ begin ─────────── length ────────────┬─ way out ─ caller's reading
//                              └─ one reading of the clock, at least ──┘
//
// The ways in and out take one reading of the clock at least, so that much may be left out of the spin. How long a reading takes
// changes from one moment to the next by a factor of eight here (what else the processor does); so it is measured in the call.
// Of two in a row the shorter: what comes between (an interrupt, a line that another core has) comes between one of them only.
void LinuxBoard::busy_for(Nanoseconds length) {
    const Instant begin = now();
    if (length < kWorthMeasuring) return busy_until(begin + length);
    const Instant second = now();
    const Instant third = now();
    const Nanoseconds reading = std::min(second - begin, third - second);
    busy_until(begin + length - (reading <= kReadingAtMost ? reading : Nanoseconds{0}));
}

void LinuxBoard::sleep_until(Instant t) {
    if (watched_) promise_until(t);
    VcpuThread* thread = VcpuThread::current();
    if (!thread) return block_until(t);
    thread->sleep_towards(t);
    spin_until(t);
}

void LinuxBoard::promise_until(Instant t) {
    const VcpuId vcpu = current_vcpu();
    if (vcpu == kNoVcpu) return;
    const Instant latest = kForever - heartbeat_bound_;
    virtual_.promise(vcpu, std::min(std::max(t, now()), latest) + heartbeat_bound_);
}

void LinuxBoard::note_release() {
    if (watched_) promise_until(kEpoch);
}

// ---- pins and buses -------------------------------------------------------------------------------------

PinDriver* LinuxBoard::driver_of(PinId pin) const {
    return pin.number < kPinCount ? pins_[pin.number] : nullptr;
}

Result<void> LinuxBoard::pin_mode(PinId pin, PinMode mode) {
    PinDriver* driver = driver_of(pin);
    if (!driver) return nothing_at(pin);
    return driver->set_mode(current_vcpu(), pin, mode);
}

void LinuxBoard::pin_write(PinId pin, Level level) {
    if (PinDriver* driver = driver_of(pin)) driver->write(current_vcpu(), pin, level);
}

Level LinuxBoard::pin_read(PinId pin) {
    PinDriver* driver = driver_of(pin);
    return driver ? driver->read(current_vcpu(), pin) : Level::low;
}

Result<void> LinuxBoard::pwm_write(PinId pin, double duty) {
    PinDriver* driver = driver_of(pin);
    if (!driver) return nothing_at(pin);
    return driver->write_pwm(current_vcpu(), pin, duty);
}

Result<void> LinuxBoard::pwm_period(PinId pin, Nanoseconds period) {
    PinDriver* driver = driver_of(pin);
    if (!driver) return nothing_at(pin);
    if (!is_pwm_period(period)) return bad_pwm_period();
    return driver->set_pwm_period(current_vcpu(), pin, period);
}

Result<double> LinuxBoard::analog_read(PinId pin) {
    PinDriver* driver = driver_of(pin);
    if (!driver) return nothing_at(pin);
    return driver->read_analog(current_vcpu(), pin);
}

Result<void> LinuxBoard::i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                      std::span<std::uint8_t> in) {
    I2cDriver* driver = bus.number < kBusLimit ? i2c_[bus.number] : nullptr;
    if (!driver) return make_error(ErrorCode::unsupported, "this I2C bus is connected to nothing");
    return driver->transfer(current_vcpu(), bus, address, out, in);
}

Result<void> LinuxBoard::spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) {
    SpiDriver* driver = bus.number < kBusLimit ? spi_[bus.number] : nullptr;
    if (!driver) return make_error(ErrorCode::unsupported, "this SPI bus is connected to nothing");
    return driver->transfer(current_vcpu(), bus, settings, data);
}

Result<void> LinuxBoard::safe_state(PinId pin, Level level) {
    PinDriver* driver = driver_of(pin);
    if (!driver) return nothing_at(pin);
    if (virtual_.attached() && driver != &virtual_)
        virtual_.publish_safe_state(pin, level);  // for the supervisor
    return driver->set_safe_state(pin, level);
}

void LinuxBoard::force_safe_states() {
    if (made_safe_.exchange(true)) return;
    virtual_.force_safe_states();
    for (const auto& driver : real_pins_) driver->force_safe_states();
}

std::uint64_t LinuxBoard::lost_edges() const { return virtual_.attached() ? virtual_.lost_edges() : 0; }

// ---- running --------------------------------------------------------------------------------------------

Result<void> LinuxBoard::check(std::span<const VcpuSpec> specs) const {
    std::array<bool, kVcpuLimit> taken{};
    for (const VcpuSpec& spec : specs) {
        const bool sound = spec.id != kNoVcpu && spec.id < kVcpuLimit && !taken[spec.id] && spec.core >= 0 &&
                           spec.core < core_count_ && spec.budget > Nanoseconds{0} &&
                           spec.budget <= spec.period && (spec.entry || spec.kind == VcpuKind::io);
        if (!sound) {
            Error error{ErrorCode::invalid_argument, "loop "};
            error.message.append(std::to_string(spec.id));
            error.message.append(
                ": id taken or out of range, no such core, budget not within its period, or no body");
            return error;
        }
        taken[spec.id] = true;
        const bool shares = std::any_of(specs.begin(), specs.end(), [&](const VcpuSpec& other) {
            return other.id != spec.id && other.core == spec.core;
        });
        if (config_.enforce_budgets && shares && !spec.owns_core && spec.budget < kShortestSharedBudget) {
            Error error{ErrorCode::out_of_range, "loop "};
            error.message.append(std::to_string(spec.id))
                .append(" has a budget below 100 us on a core that others use: ");
            error.message.append(
                "enforcing it would cost more than the budget. Give it its own core (budget = period), ");
            error.message.append("or make budget and period longer");
            return error;
        }
    }
    return {};
}

/// Rate-monotonic over the whole board: each shorter distinct period is one priority higher.
int LinuxBoard::priority_of(const VcpuSpec& spec, std::span<const VcpuSpec> all) const {
    if (!config_.real_time) return 0;
    std::vector<Nanoseconds> shorter;
    for (const VcpuSpec& other : all) {
        if (other.period < spec.period) shorter.push_back(other.period);
    }
    std::sort(shorter.begin(), shorter.end());
    const auto rank = std::unique(shorter.begin(), shorter.end()) - shorter.begin();
    return std::max(config_.priority_lowest, config_.priority_highest - static_cast<int>(rank));
}

Result<void> LinuxBoard::start(std::span<const VcpuSpec> specs) {
    QDUINO_EXPECT(threads_.empty());
    if (auto checked = check(specs); !checked) return checked;
    if (auto locked = lock_cores(specs); !locked) return locked;
    for (const VcpuSpec& spec : specs) {
        if (!virtual_.attached()) break;
        if (auto opened = virtual_.open_writer(spec.id, spec.owns_core); !opened) return opened;
        virtual_.publish_place(spec.id, {.core = spec.core, .priority = priority_of(spec, specs)});
    }
    if (virtual_.attached()) witness_.call(virtual_.layout().witness, config_.real_time);
    if (config_.real_time) {
        if (auto awake = keep_cores_awake(config_.sysfs_root); awake) awake_ = std::move(*awake);
    }
    if (config_.lock_memory) memory_locked_ = lock_memory().ok();
    take_cores(specs);
    schedule_bottom_halves(specs);
    started_at_ = now();
    return make_threads(specs);
}

Result<void> LinuxBoard::make_threads(std::span<const VcpuSpec> specs) {
    gate_ = std::make_unique<StartGate>();
    const StopSignalsBlocked for_new_threads;
    Result<void> made;
    for (const VcpuSpec& spec : specs) {
        VcpuSpec mine = spec;
        if (!mine.entry) {
            mine.entry = &LinuxBoard::edge_entry;
            mine.context = this;
        }
        VcpuThreadOptions options;
        options.priority = priority_of(spec, specs);
        options.stack_bytes = config_.stack_bytes;
        options.enforce_budget = config_.enforce_budgets && !spec.owns_core;
        if (spec.owns_core) options.spin_share = real_time_share(config_.sysfs_root);
        options.isolation = isolation_.owns(spec.core) ? &isolation_ : nullptr;
        options.gate = gate_.get();
        options.returned = &returned_;
        threads_.push_back(std::make_unique<VcpuThread>(mine, options));
        made = threads_.back()->create();
        if (!made) break;
    }
    if (!made) {
        threads_.pop_back();
        open_gate(2);
        threads_.clear();
        return made;
    }
    for (std::uint32_t ready = 0; (ready = gate_->ready.load()) < threads_.size();) {
        futex_wait_until(gate_->ready, ready, kForever);
    }
    open_gate(1);
    return {};
}

void LinuxBoard::open_gate(std::uint32_t state) {
    gate_->state.store(state, std::memory_order_release);
    futex_wake_all(gate_->state);
}

bool LinuxBoard::all_returned() const {
    return std::all_of(threads_.begin(), threads_.end(),
                       [](const auto& thread) { return thread->returned(); });
}

void LinuxBoard::run(Instant until) {
    for (;;) {
        const std::uint32_t seen = returned_.load();
        if (stop_requested() && all_returned()) {
            force_safe_states();
            return;
        }
        if (now() >= until) return;
        futex_wait_until(returned_, seen, until);
    }
}

void LinuxBoard::request_stop() {
    stop_.store(true, std::memory_order_release);
    returned_.fetch_add(1);
    futex_wake_all(returned_);
    if (virtual_.attached()) virtual_.wake_input_waiters();
}

}  // namespace qduino::board::linux
