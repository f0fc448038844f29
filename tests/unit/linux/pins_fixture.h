// What the tests of the virtual pins share: a file of their own, and a machine that writes down
// what it is told.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "board/linux/kernel/clock.h"
#include "board/linux/pin/pins_server.h"
#include "board/linux/pin/virtual_pins.h"
#include "board/peripherals.h"

namespace qduino::board::linux::test {

/// A file name on a tmpfs, unlike any other test's, removed at the end.
class TemporaryPins {
  public:
    TemporaryPins() {
        static std::atomic<int> number{0};
        path_ = "/dev/shm/qduino-test-" + std::to_string(::getpid()) + "-" + std::to_string(number++);
    }
    ~TemporaryPins() { ::unlink(path_.c_str()); }
    TemporaryPins(const TemporaryPins&) = delete;
    TemporaryPins& operator=(const TemporaryPins&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }

  private:
    std::string path_;
};

struct Seen {
    Instant time;
    std::uint16_t pin = 0;
    bool pwm = false;
    double value = 0;
};

/// Peripherals with a memory: read it when the machine has stopped; the atomics at any time. I2C
/// chip 0x48 answers with the bytes it was sent, each plus one; SPI inverts.
class RecordingMachine final : public Peripherals {
  public:
    void pin_written(Instant now, PinId pin, Level level) override {
        seen.push_back({now, pin.number, false, level == Level::high ? 1.0 : 0.0});
        last_edge_ns = to_ns(now);
        ++edges;
    }
    void pwm_written(Instant now, PinId pin, double duty) override {
        seen.push_back({now, pin.number, true, duty});
    }
    Level pin_level(Instant, PinId pin) override {
        return outside[pin.number].load() ? Level::high : Level::low;
    }
    double analog_level(Instant, PinId pin) override { return pin.number / 256.0; }
    Result<void> i2c_transfer(Instant now, I2cBus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        last_transaction_ns = to_ns(now);
        if (address.value != 0x48) return make_error(ErrorCode::timed_out, "nobody at this address");
        for (std::size_t i = 0; i < in.size(); ++i) {
            in[i] = static_cast<std::uint8_t>(i < out.size() ? out[i] + 1 : 0xEE);
        }
        return {};
    }
    Result<void> spi_transfer(Instant, SpiBus, SpiSettings, std::span<std::uint8_t> data) override {
        for (auto& byte : data) byte = static_cast<std::uint8_t>(~byte);
        return {};
    }

    std::vector<Seen> seen;
    std::array<std::atomic<bool>, kPinCount> outside{};
    std::atomic<std::size_t> edges{0};
    std::atomic<std::int64_t> last_edge_ns{0};
    std::atomic<std::int64_t> last_transaction_ns{0};
};

inline PinsServer open_server(const std::string& path) {
    auto made = PinsServer::create(path);
    EXPECT_TRUE(made.ok()) << made.error().message.view();
    return std::move(*made);
}

inline void attach(VirtualPins& pins, const std::string& path) {
    const auto attached = pins.attach(path);
    ASSERT_TRUE(attached.ok()) << attached.error().message.view();
}

/// What the machine answers in the end. On a busy computer that may come after its time; then it is
/// asked again.
template <typename Ask>
auto answered(Ask ask) {
    auto answer = ask();
    const auto silent = [&] { return !answer && answer.error().message.view().ends_with("is it running?"); };
    for (int again = 0; again < 50 && silent(); ++again) answer = ask();
    return answer;
}

/// Both ends, where the test itself polls the server.
struct PolledPins {
    PolledPins() { attach(pins, file.path()); }
    TemporaryPins file;
    PinsServer server = open_server(file.path());
    VirtualPins pins;
};

/// Polls a server on a thread of its own until it goes.
class RunningMachine {
  public:
    explicit RunningMachine(const std::string& path)
        : server_(open_server(path)), thread_([this] { run(); }) {}
    ~RunningMachine() { stop(); }
    RunningMachine(const RunningMachine&) = delete;
    RunningMachine& operator=(const RunningMachine&) = delete;

    /// Ends the thread after a last poll that sees everything written before the call; then the
    /// record may be read.
    void stop() {
        if (!thread_.joinable()) return;
        stop_ = true;
        thread_.join();
        // Everything written before this call is older than this instant by more than a writer's
        // hold.
        std::this_thread::sleep_for(kWriterHold + 1ms);
        while (server_.poll(monotonic_now(), machine) == PinsServer::kBatch) {
        }
    }
    [[nodiscard]] PinsServer& server() { return server_; }
    RecordingMachine machine;

  private:
    void run() {
        while (!stop_) {
            server_.wait(1ms);
            server_.poll(monotonic_now(), machine);
        }
    }
    PinsServer server_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace qduino::board::linux::test
