// A serial host beside the HTTP service: bytes between its port and the printer's console.
//
//   another process    port ─► M112 at once (apps/port) ─► socket
//   its own thread     socket ─► emergency scanner ─► M108, M410
//                       ▲          └─► session ─► lines ─┐
//                       └── ok, answers ◄── session      │ (a lock between the two threads)
//   the spool's thread        answers, news ─────┘       └─► Spool::host_line
//
// The thread of the port never waits for a disk, nor for the printer, and reads at any time. So an
// M108 in the bytes is heard however many lines wait in front of it.
//
// A host that closes a pty has gone. One on a wire has when it was owed nothing and sent nothing
// for kSilentAfter (hosts ask for temperatures every few seconds); it is greeted anew.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "printer/gcode/emergency_scanner.h"
#include "serial/serial_port.h"
#include "serial/serial_session.h"
#include "spool/spool.h"
#include "web/service.h"

namespace qduino::printd {

class SerialHost {
  public:
    static constexpr Nanoseconds kSilentAfter = std::chrono::seconds{60};

    /// `spool` outlives this; `on_spool` runs a task on the spool's thread. `has_bed`: M105 tells
    /// of one.
    [[nodiscard]] static Result<std::unique_ptr<SerialHost>> start(apps::SerialPort port, spool::Spool& spool,
                                                                   web::Executor on_spool, bool has_bed);
    SerialHost(const SerialHost&) = delete;
    SerialHost& operator=(const SerialHost&) = delete;
    ~SerialHost();

    /// Spool's thread, behind each of its ticks.
    void tick(Instant now);
    /// Ends the thread of the port. Before the threads that `on_spool` uses have ended.
    void stop();

  private:
    SerialHost(apps::SerialPort port, posix::UniqueFd wake, spool::Spool& spool, web::Executor on_spool,
               bool has_bed);

    // The thread of the port.
    void serve();
    void wait_for_work();
    void watch_presence(Instant now);
    void greet(Instant now);
    void read_port(Instant now);
    void act_on(const printer::gcode::EmergencyCodes& codes);
    void write_port();

    // The spool's thread.
    void send_lines();
    [[nodiscard]] apps::PrinterNews news() const;
    void wake() const;

    apps::SerialPort port_;
    posix::UniqueFd wake_;
    spool::Spool& spool_;
    web::Executor on_spool_;
    bool has_bed_;

    std::mutex mutex_;  // of the session
    apps::SerialSession session_;

    printer::gcode::EmergencyScanner scanner_;
    std::string unsent_;
    Instant heard_{};
    bool there_ = false;
    std::atomic<bool> sending_{false};  // the spool's thread is asked to
    std::atomic<bool> stop_{false};
    std::thread thread_;  // last: it uses all others
};

}  // namespace qduino::printd
