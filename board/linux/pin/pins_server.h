// The machine's side of the virtual hardware (pins_layout.h): turns what crosses the pins into
// calls of Peripherals.
//
//   loop of an app that plays the machine:
//       server.wait(1ms);                       sleeps until a bus request comes, at most so long
//       server.poll(server.past());             edges in order of time, bus requests, inputs
//
// One thread. A sketch may die at any instruction and another attach. The server goes on, and still
// plays what the dead sketch had pushed.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/fixed_vector.h"
#include "base/result.h"
#include "board/linux/pin/pins_file.h"
#include "board/peripherals.h"
#include "posix/mapping.h"

namespace qduino::board::linux {

/// Counts of what went wrong; all 0 in a healthy run.
struct PinsFaults {
    std::uint64_t lost = 0;  ///< edges dropped by writers whose ring was full (this sketch's)
    /// Edges that came after the horizon had passed them; delivered with a later time.
    std::uint64_t disordered = 0;
    std::uint64_t malformed = 0;  ///< edges of no pin or no kind; dropped
};

class PinsServer {
  public:
    /// Makes the file at `path` (on a tmpfs: /dev/shm/…) and serves it. Errors: PinsFile::create.
    /// "/dev/mem@268435456": in that memory, at this address, without a file.
    /// `own_clock`: the sketch will have a clock of its own (PinsLayout::sketch_clock_ns).
    static Result<PinsServer> create(const std::string& path, bool own_clock = false);

    PinsServer(PinsServer&&) = default;
    PinsServer& operator=(PinsServer&&) = default;

    /// Delivers events in order of time up to `until`, publishes the input pins, then serves bus
    /// requests. If there are requests, it first delivers events up to the latest of them: the
    /// peripherals see what a sketch wrote before it asked, and then answer. `until` is of the
    /// sketch's clock and past; the call spins where it is less than kSettle ago. Times given to
    /// `peripherals` do not go back. Returns how many events and requests were served; at most
    /// kBatch events a call, so that requests are not starved.
    std::size_t poll(Instant until, Peripherals& peripherals);

    /// Sleeps until a bus request comes, at most `limit`. A sketch with a clock of its own cannot
    /// wake it: then at most kNoBell.
    void wait(Nanoseconds limit);

    /// Now, on the sketch's clock: CLOCK_MONOTONIC, or its own as it last told.
    [[nodiscard]] Instant now() const;
    /// The latest instant for poll() that needs no spinning where the clock is shared.
    [[nodiscard]] Instant past() const;

    /// Time of the latest call of Peripherals.
    [[nodiscard]] Instant horizon() const { return horizon_; }
    [[nodiscard]] PinsFaults faults() const;
    /// Sketches that have attached so far; a change means a new one.
    [[nodiscard]] std::uint64_t sketch_session() const;
    [[nodiscard]] SketchDeath sketch_death() const;
    [[nodiscard]] PinsLayout& layout() const { return file_.layout(); }

    static constexpr std::size_t kBatch = 50'000;
    static constexpr Nanoseconds kNoBell{100'000};

  private:
    /// A ring that has been in use.
    struct Source {
        posix::Mapping ring;
        WriterSlot* slot = nullptr;
        bool wide = false;
        /// Nothing more will come up to here: the writer was seen not to be writing.
        Instant quiet_since{};

        [[nodiscard]] const PinEvent* front();
        void pop();
    };

    PinsServer() = default;
    [[nodiscard]] bool has_own_clock() const;
    void settle(Instant until) const;
    void find_new_sources(Instant until);
    [[nodiscard]] bool sketch_lives() const;
    [[nodiscard]] Instant exact_until(Instant asked);
    std::size_t deliver(Instant until, Peripherals& peripherals);
    void hand_over(const PinEvent& event, Peripherals& peripherals);
    void publish_inputs(Peripherals& peripherals);
    /// The sequence of each mailbox's unanswered request; 0: none.
    using Requests = std::array<std::uint32_t, kVcpuLimit>;
    [[nodiscard]] bool find_requests(Requests& asked);
    std::size_t serve_mail(const Requests& asked, Peripherals& peripherals);
    void serve(Mailbox& mail, std::uint32_t sequence, Peripherals& peripherals);

    PinsFile file_;
    std::array<bool, kWriterCount> known_{};
    std::array<Source, kWriterCount> sources_;
    std::size_t source_count_ = 0;
    Instant horizon_{};
    std::uint32_t doorbell_seen_ = 0;
    PinsFaults faults_;
};

}  // namespace qduino::board::linux
