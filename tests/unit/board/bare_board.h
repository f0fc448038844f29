// The least that is a board: one core, one loop at a time, run to its end on the caller's stack; no
// capability. Freestanding: it uses no operating system, no heap, no exceptions.
#pragma once

#include <array>

#include "base/contract.h"
#include "board/board.h"

namespace qduino::board::test {

class BareBoard final : public Board {
  public:
    int releases = 0;
    void (*on_start)() = nullptr;                    ///< called when the VCPUs are about to run
    void (*while_idle)(BareBoard& board) = nullptr;  ///< called at each sleep

    Instant now() override { return now_; }
    void busy_until(Instant t) override { now_ = t > now_ ? t : now_; }
    void busy_for(Nanoseconds length) override { busy_until(now_ + length); }
    void sleep_until(Instant t) override {
        busy_until(t);
        if (while_idle) while_idle(*this);
    }
    Result<void> pin_mode(PinId, PinMode) override { return {}; }
    void pin_write(PinId pin, Level level) override { levels_[pin.number] = level; }
    Level pin_read(PinId pin) override { return levels_[pin.number]; }
    Result<void> safe_state(PinId, Level) override { return {}; }
    void lock(LockWord& word) override { QDUINO_EXPECT(try_lock(word)); }
    bool try_lock(LockWord& word) override {
        std::uint32_t free = 0;
        return word.value.compare_exchange_strong(free, 1);
    }
    void unlock(LockWord& word) override { word.value = 0; }
    int core_count() const override { return 1; }
    VcpuId current_vcpu() const override { return current_; }
    Result<void> start(std::span<const VcpuSpec> specs) override {
        for (const VcpuSpec& spec : specs) {
            if (count_ == specs_.size())
                return make_error(ErrorCode::unavailable, "too many VCPUs for this board");
            specs_[count_++] = spec;
        }
        if (on_start) on_start();
        return {};
    }
    void run(Instant) override {
        for (std::size_t i = 0; i < count_; ++i) {
            if (!specs_[i].entry) continue;
            current_ = specs_[i].id;
            specs_[i].entry(specs_[i].context);
        }
        current_ = kNoVcpu;
    }
    void request_stop() override { stop_ = true; }
    bool stop_requested() override { return stop_; }
    GuaranteeReport guarantee() const override { return {}; }
    void note_release(Instant) override { ++releases; }

  private:
    Instant now_ = kEpoch;
    std::array<Level, kPinCount> levels_{};
    std::array<VcpuSpec, 4> specs_{};
    std::size_t count_ = 0;
    VcpuId current_ = kNoVcpu;
    bool stop_ = false;
};

}  // namespace qduino::board::test
