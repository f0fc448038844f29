// The stops that loop 2 obeys at once: those that loop 1 asks for, and the service's emergency
// stops, which do not wait for loop 1.
//
//   loop 1   ask() ──► stop_asked() differs from what loop 2 has served ──► loop 2 drops every step
//            finished(), once loop 1 has taken in where that left the machine
//
//   service  link.emergency + 1 ──► the same; and emergency_pending() until loop 1 takes it:
//            nothing may move before
//
// An emergency stop may come in the middle of loop 1's release. Loop 2 obeys it at once. Loop 1
// goes on with the number that it saw when the release began, so that all its decisions agree, and
// answers the stop in its next release. Until then loop 2 plays nothing of what loop 1 sends.
#pragma once

#include <atomic>
#include <cstdint>

namespace qduino::printer::machine {

class Stops {
  public:
    /// `emergency`: the link's counter; it must outlive this. Its value now counts as answered.
    explicit Stops(const std::atomic<std::uint32_t>& emergency)
        : emergency_(emergency), taken_(emergency.load(std::memory_order_acquire)) {
        observe();
    }

    // Loop 1.
    /// Once per release, before anything is decided.
    void observe() { seen_emergency_ = emergency_.load(std::memory_order_acquire); }
    /// What loop 2 must have served before loop 1 may go on.
    [[nodiscard]] std::uint32_t asked_as_seen() const {
        return asked_.load(std::memory_order_relaxed) + seen_emergency_;
    }
    void ask() {
        running_ = true;
        asked_.fetch_add(1, std::memory_order_release);
    }
    /// Loop 1 has asked, and has not yet taken in where the machine stands.
    [[nodiscard]] bool running() const { return running_; }
    void finished() { running_ = false; }
    /// The emergency stops so far have been answered with a fault.
    void take_emergency() {
        taken_.store(emergency_.load(std::memory_order_acquire), std::memory_order_release);
    }

    // Any loop.
    /// Differs from the last one served: drop every step, now.
    [[nodiscard]] std::uint32_t stop_asked() const {
        return asked_.load(std::memory_order_acquire) + emergency_.load(std::memory_order_acquire);
    }
    /// An emergency stop that loop 1 has not taken in yet: nothing may move or heat, whatever was
    /// asked before.
    [[nodiscard]] bool emergency_pending() const {
        return emergency_.load(std::memory_order_acquire) != taken_.load(std::memory_order_acquire);
    }

  private:
    const std::atomic<std::uint32_t>& emergency_;
    std::atomic<std::uint32_t> taken_;
    std::atomic<std::uint32_t> asked_{0};
    std::uint32_t seen_emergency_ = 0;
    bool running_ = false;
};

}  // namespace qduino::printer::machine
