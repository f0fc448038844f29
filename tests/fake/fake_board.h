// A board made of memory: a clock that tests set, records that tests read, and no opinion about
// scheduling.
//
// Time moves only by busy_until and sleep_until, and by `look_cost` at every look at a pin or the
// clock, so that code that polls comes to an end and every instant can be worked out by hand.
//
// A test calls it from outside of any VCPU, and says with `vcpu` which loop it plays. Or it starts
// VCPUs, as a program does: then each is a fiber, as if on a core of its own, and the one that is
// due first runs until it waits.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/fiber.h"

namespace qduino::fake {

struct PinEvent {
    std::int64_t at_ns;
    int pin;
    int level;
    bool operator==(const PinEvent&) const = default;
};

struct PwmEvent {
    int pin;
    double duty;
};

struct PwmPeriod {
    int pin;
    std::int64_t period_ns;
    bool operator==(const PwmPeriod&) const = default;
};

struct I2cTransaction {
    int bus;
    int address;
    std::vector<std::uint8_t> out;
    std::size_t in_size;
    bool operator==(const I2cTransaction&) const = default;
};

struct AttachedEdge {
    int pin;
    board::Edge edge;
    board::EdgeHandler handler;
    void* context;
    board::VcpuId io;
    board::Level last;
    bool detached = false;
};

/// Everything that a fake board is told and has seen.
struct State {
    Instant now = kEpoch;
    Nanoseconds look_cost{};  ///< of each pin_read and now()
    board::VcpuId vcpu = board::kNoVcpu;
    bool stop = false;

    std::vector<PinEvent> writes;
    std::vector<PwmEvent> pwm;
    std::vector<PwmPeriod> pwm_periods;
    std::map<int, board::PinMode> modes;
    std::map<int, int> safe_states;
    std::vector<I2cTransaction> i2c;
    std::vector<std::string> calls;  ///< routing and the like, as text
    std::vector<AttachedEdge> attached;
    std::map<board::DeviceClass, std::size_t> device_bytes;  ///< device_work()
    std::map<board::VcpuId, Nanoseconds> promises;           ///< promise_progress(): the latest
    std::int64_t slept_ns = 0;
    std::int64_t spun_ns = 0;

    std::function<int(int pin, Instant now)> level_of = [](int, Instant) { return 0; };
    double chip_celsius = 40;
    std::function<double(int pin)> analog_of = [](int) { return 0.0; };
    /// Fills `in`; false: nobody answers.
    std::function<bool(const I2cTransaction&, std::span<std::uint8_t> in)> chip = [](const auto&, auto) {
        return true;
    };
    std::function<void(board::SpiSettings, std::span<std::uint8_t>)> spi_device = [](auto, auto) {};
    std::function<void()> while_sleeping = [] {};  ///< called at each sleep, after time has moved
    bool refuse_everything = false;                ///< what can be refused, is
    /// Stands in for level_of, analog_of, chip and spi_device; null: they hold.
    board::Peripherals* wires = nullptr;
};

class FakeBoard final : public board::Board {
  public:
    State state;

    Instant now() override;
    void busy_until(Instant t) override;
    void busy_for(Nanoseconds length) override { busy_until(now() + length); }
    void sleep_until(Instant t) override;

    Result<void> pin_mode(board::PinId pin, board::PinMode mode) override;
    void pin_write(board::PinId pin, board::Level level) override;
    board::Level pin_read(board::PinId pin) override;
    Result<void> safe_state(board::PinId pin, board::Level level) override;
    Result<void> pwm_write(board::PinId pin, double duty) override;
    Result<void> pwm_period(board::PinId pin, Nanoseconds period) override;
    Result<double> analog_read(board::PinId pin) override;
    Result<double> chip_temperature() override;
    Result<void> attach_edge(board::PinId pin, board::Edge edge, board::EdgeHandler handler, void* context,
                             board::VcpuId io) override;
    void detach_edge(board::PinId pin) override;
    Result<void> i2c_transfer(board::I2cBus bus, board::I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override;
    Result<void> spi_transfer(board::SpiBus bus, board::SpiSettings settings,
                              std::span<std::uint8_t> data) override;

    void device_work(board::DeviceClass device, std::size_t bytes) override {
        state.device_bytes[device] += bytes;
    }
    void promise_progress(board::VcpuId id, Nanoseconds limit) override { state.promises[id] = limit; }
    void lock(board::LockWord& word) override;
    bool try_lock(board::LockWord& word) override;
    void unlock(board::LockWord& word) override;

    int core_count() const override { return 4; }
    board::VcpuId current_vcpu() const override { return state.vcpu; }
    Result<void> start(std::span<const board::VcpuSpec> specs) override;
    void run(Instant until) override;
    void request_stop() override { state.stop = true; }
    bool stop_requested() override { return state.stop; }
    board::GuaranteeReport guarantee() const override;
    Result<void> serve_interrupts(board::DeviceClass device, board::VcpuId io) override;
    Result<void> change_io(board::VcpuId io, sched::VcpuParameters parameters) override;
    Result<void> route_interrupts(board::DeviceClass device, int core, bool allowed) override;
    Result<void> core_timer(int core, bool enabled) override;

    /// The core of the VCPU that runs; −1 outside of all.
    [[nodiscard]] int current_core() const { return running_ ? running_->spec.core : -1; }

  private:
    /// A VCPU that was started.
    struct Vcpu {
        board::VcpuSpec spec;
        FakeBoard* board = nullptr;
        std::unique_ptr<board::sim::Fiber> fiber;
        Instant wake{};
        std::deque<std::pair<board::EdgeHandler, void*>> handlers;  // to be called
    };

    Result<void> done_or_refused(std::string call);
    bool wait_in_fiber(Instant t);
    [[nodiscard]] bool is_output(board::PinId pin) const;
    void drive(board::PinId pin);
    void look_at_edges();
    static void vcpu_main(void* vcpu);
    void resume(Vcpu& vcpu);
    void force_safe_states();

    std::array<board::Level, board::kPinCount> levels_{};  // last written
    std::vector<std::unique_ptr<Vcpu>> vcpus_;
    Vcpu* running_ = nullptr;
    int loops_left_ = 0;
};

/// The board of the tests of the Arduino face. reset() before each of them.
FakeBoard& board();
State& state();
void reset();
/// Levels written to `pin`, in order.
std::vector<int> levels_written(int pin);

}  // namespace qduino::fake
