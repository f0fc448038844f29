// Pins that are connected to nothing, on Linux: a machine that listens, so that people see what
// their sketch does.
//
//   sketch ── edges, with their times ──► rings in shared memory ──► this thread ──► PinWitness
//
// An ordinary thread: the times are the sketch's own, so it may be late. (A ring holds 131072 edges
// of a loop. What does not fit is counted.)
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "base/result.h"
#include "board/linux/pin/pins_server.h"
#include "report/pin/pin_witness.h"

namespace qduino::apps {

class LoosePins {
  public:
    /// Makes the file `pins` and listens. `dump`: for PinWitness::write_dump(). Rows begin at
    /// `from`. Errors: PinsServer::create, PinWitness::keep_dump.
    [[nodiscard]] static Result<std::unique_ptr<LoosePins>> serve(const std::filesystem::path& pins,
                                                                  bool dump, Nanoseconds from);
    LoosePins(const LoosePins&) = delete;
    LoosePins& operator=(const LoosePins&) = delete;
    ~LoosePins();

    /// The sketch has ended: takes what it left in its rings, and listens no more.
    void end();
    /// After end().
    [[nodiscard]] PinWitness& witness() { return witness_; }
    [[nodiscard]] board::linux::PinsFaults faults() const { return server_.faults(); }

  private:
    explicit LoosePins(board::linux::PinsServer server);
    void listen();

    board::linux::PinsServer server_;
    board::NoPeripherals nothing_;
    PinWitness witness_;
    std::atomic<bool> stop_{false};
    std::thread thread_;  // last: it uses all others
};

}  // namespace qduino::apps
