// A core that Linux has given up, for as long as this object lives.
//
//   take(): "0" to …/cpuN/online ─► start(): INIT, STARTUP ─► give_back(): INIT, "1" to …/online
//
// INIT and STARTUP go through the local APIC of the calling core, which /dev/mem maps: two
// registers, of which Linux writes the same ones when it interrupts another core. So the caller
// stays on one core, and the first is read back before the second is written. Linux never writes
// them while it has one core; with more, an interrupt between these two instructions would send the
// order to another core. A kernel module would be the remedy.
//
// Intel SDM volume 3, 9.4.4.1 (MP initialization), 11.6.1 (interrupt command register).
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "board/linux/computer/core_lock.h"
#include "posix/mapping.h"
#include "posix/unique_fd.h"

namespace qduino::apps::beside_linux {

/// The local APIC of the core that the caller runs on.
class LocalApicPage {
  public:
    /// Binds the calling thread to `cpu`, whose local APIC it is. Error: the system's; unsupported
    /// when Linux does not use the APIC by its memory.
    static Result<LocalApicPage> open(int cpu, std::uint32_t apic_number);
    /// Starts the core with the number `apic`, at `page`.
    void start(std::uint32_t apic, std::uint32_t page);
    /// Stops it, whatever it does.
    void park(std::uint32_t apic);

  private:
    void command(std::uint32_t apic, std::uint32_t word);

    posix::Mapping page_;
};

class GivenCore {
  public:
    /// Linux gives up core `core`, 1 to 7. A core that is off already, for an earlier run was
    /// killed, comes back first. Error: not_found (no such core, or one that Linux does not give
    /// up), unavailable (another program of QduinoMC has it), the system's.
    static Result<GivenCore> take(int core);
    /// The core comes back. An error then is told on standard error.
    ~GivenCore();
    GivenCore(GivenCore&& other) noexcept;
    GivenCore& operator=(GivenCore&&) = delete;
    GivenCore(const GivenCore&) = delete;
    GivenCore& operator=(const GivenCore&) = delete;

    /// It begins in the page at `page`. Once.
    void start(std::uint32_t page);
    /// Parks it, and Linux takes it back. Error: the system's.
    Result<void> give_back();

  private:
    GivenCore(int core, std::uint32_t apic_number, LocalApicPage apic, board::linux::CoreLock lock)
        : core_(core), apic_number_(apic_number), apic_(std::move(apic)), lock_(std::move(lock)) {}

    int core_;  // −1: given back, or moved from
    std::uint32_t apic_number_;
    LocalApicPage apic_;
    board::linux::CoreLock lock_;
};

}  // namespace qduino::apps::beside_linux
