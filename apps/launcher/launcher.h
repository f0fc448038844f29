// Starts the printer's processes, keeps them running, and stops them so that nothing stays hot and
// nothing is left behind. The terminal gets a first screen of ten lines (first_screen.h) and what a
// person should know; what the processes say goes into a log (run_log.h), and all that holds into a
// report in the state folder.
//
//   real time     virtual machine ──► supervisor with the sketch ──► (port) ──► print service
//   --speed       simulated printer ───────────────────────────────► (port) ──► print service
//   --lan NAME    besides, printer-name tells the network what NAME.local is
//                 each starts when the one before has come up; they end in the opposite order
//
// As root there are two users: root has the folder in memory, and the service's user has the state
// folder. Root touches no file in that folder by root's own rights (posix/acting_as.h). What its
// processes need from there is copied for them first: it may be a link, or endless.
//
// When one of them is killed:
//
//   print service      it starts again; the print goes on meanwhile
//   supervisor, sketch the pins are safe (apps/supervisor); the computer's settings are put back,
//                      then both start again
//   virtual machine    a printer whose power failed: it comes back cold, and the sketch is started
//                      anew with it
//   this launcher      the supervisor sees it (board/linux/pin/starter.h), kills the sketch, and
//                      the pins are safe. The kernel asks all others to end (kept_process.h). The
//                      virtual machine is the last: it stays while a process of the sketch's side
//                      lives, as a real one would (the folder's file "sketch.lock")
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/launcher/kept_process.h"
#include "apps/launcher/link_giver.h"
#include "apps/launcher/run_log.h"
#include "apps/launcher/service_user.h"
#include "apps/launcher/service_vcpu.h"
#include "apps/launcher/sketch_report.h"
#include "base/result.h"
#include "board/linux/kernel/memory_folder.h"
#include "board/linux/kernel/run_lock.h"
#include "board/linux/pin/starter.h"
#include "config/service_options.h"
#include "posix/acting_as.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

struct Options {
    std::filesystem::path programs;  ///< folder of the printer's programs
    std::filesystem::path state;     ///< jobs, queue and key
    std::filesystem::path ui;        ///< the page's files
    std::string machine;             ///< machine file; empty: the reference machine
    /// The user that the service becomes when root starts it; empty: it stays root.
    std::string service_user;
    /// A serial host's: "pty", DEVICE or DEVICE@BAUD; empty: none.
    std::string serial_port;
    /// The address that the service listens on, as numbers; "::": all of this computer's.
    std::string listen;
    int port = 8080;
    double speed = 0;  ///< of the simulator; 0: in real time, on this computer
    bool isolate = false;
    apps::ServiceOptions service;
    /// The budget of the service in each 100 ms of core 0; nothing: it is an ordinary process.
    std::optional<Nanoseconds> service_budget = kServiceBudget;
    /// Asked for: it is not made smaller when it does not fit.
    bool service_budget_exactly = false;
    std::string settings_state;  ///< where the sketch notes what it changed on this computer
};

class Launcher {
  public:
    /// Takes the state folder; nothing runs yet. Errors: already_exists (a printer runs with it),
    /// and what the kernel says.
    [[nodiscard]] static Result<std::unique_ptr<Launcher>> open(Options options);

    /// Runs until SIGINT, SIGTERM or SIGHUP is readable from `signals`, or something has failed for
    /// good. Returns the exit status.
    int run(int signals);

  private:
    explicit Launcher(Options options) : options_(std::move(options)) {}
    [[nodiscard]] ProcessPlan plan_of(const char* name, const char* program,
                                      std::vector<std::string> words) const;
    [[nodiscard]] std::string kept_settings() const;
    [[nodiscard]] std::filesystem::path services_port() const;
    [[nodiscard]] Result<void> make_services_folder() const;
    [[nodiscard]] Result<void> copy_kept_settings() const;
    [[nodiscard]] Result<void> before_sketch();
    [[nodiscard]] posix::ActingAs as_service() const;
    void add(ProcessPlan plan);
    void plan_machine();
    void plan_sketch();
    void plan_simulator();
    void plan_port();
    void plan_service();
    void put_settings_back() const;
    [[nodiscard]] bool come_up(int signals);
    [[nodiscard]] bool keep(int signals);
    [[nodiscard]] bool advance_all(std::size_t started);
    void say(std::string_view words) const { log_.say(words); }
    void look_after_files(Instant now);
    void show_step(std::string_view words) const;
    void note_address() const;
    [[nodiscard]] std::string address() const;
    [[nodiscard]] std::string serial_port() const;
    [[nodiscard]] SketchWords sketch_words() const;
    [[nodiscard]] std::string report() const;
    void keep_report();
    [[nodiscard]] std::string screen() const;
    void say_network() const;
    [[nodiscard]] std::unique_ptr<KeptProcess> plan_name() const;
    void stop_all();

    Options options_;
    ServiceUser service_;  // this process's own where it is not root
    posix::UniqueFd state_lock_;
    RunLog log_;
    SketchReport sketch_report_;
    board::linux::StarterLife life_;
    std::string kept_report_;  // as it was written last
    Instant looked_at_{};
    board::linux::MemoryFolder memory_;
    LinkGiver link_;
    std::unique_ptr<ServiceVcpu> service_vcpu_;
    std::vector<std::unique_ptr<KeptProcess>> processes_;  // in the order of their start
    std::unique_ptr<KeptProcess> name_;  // on the network; null: none. The printer works without
};

}  // namespace qduino::launcher
