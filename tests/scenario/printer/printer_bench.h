// A printer in virtual time for one scenario: feeds jobs and commands, and watches from the link
// and from the metal.
#pragma once

#include <sys/mman.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "apps/machine_file/twin_machine.h"
#include "apps/printer_sim/sim_printer.h"
#include "posix/small_file.h"
#include "printer/link/frame.h"
#include "spool/feeder.h"
#include "tests/unit/twin/text_source.h"
#include "twin/job.h"

namespace qduino::tests {

namespace link = printer::link;

class PrinterBench {
  public:
    explicit PrinterBench(const printer::MachineConfig& config = {})
        : printer_(config, apps::twin_machine(config), *memory_) {}

    /// `front`: see SimPrinter::begin.
    bool begin(board::Peripherals* front = nullptr) {
        const bool ok = printer_.begin(front).ok();
        run(0.5);
        return ok;
    }
    void run(double seconds) {
        const Instant end = printer_.now() + from_seconds(seconds);
        while (printer_.now() < end) {
            if (feeder_) {
                ASSERT_TRUE(feeder_->feed_alone(printer_.link(), printer_.now()));
            }
            printer_.run(std::min(end, printer_.now() + 50ms));
            drain_replies();
        }
    }
    /// Runs until `done()` or for `limit_s` of virtual time; says which.
    template <typename Done>
    bool run_until(Done done, double limit_s) {
        const Instant end = printer_.now() + from_seconds(limit_s);
        while (!done()) {
            if (printer_.now() >= end) return false;
            run(0.05);
        }
        return true;
    }
    void job(std::string text, std::uint64_t id = 1) {
        posix::UniqueFd file{::memfd_create("job", MFD_CLOEXEC)};
        ASSERT_TRUE(posix::write_all(file.get(), text, "job"));
        feeder_.emplace(std::move(file), id, text.size());
        watch_.reset();  // one at a time watches the pins
        watch_ = std::make_unique<twin::Job>(printer_.twin(), std::make_unique<twin::TextSource>(text),
                                             printer_.now());
    }
    bool finish_job(double limit_s = 2000) {
        return run_until(
            [&] { return status().outcome != link::JobOutcome::running && status().job_id != 0; }, limit_s);
    }
    void command(link::Command command, std::string_view text = {}) {
        ASSERT_TRUE(link::try_push(printer_.link().commands, link::encode(link::CommandText{command, text})));
    }
    void type(std::string_view line) { command(link::Command::gcode, line); }
    void emergency() { printer_.link().emergency.fetch_add(1); }

    [[nodiscard]] link::JobStatus status() { return printer_.link().job_status.read(); }
    [[nodiscard]] link::MotionStatus motion() { return printer_.link().motion_status.read(); }
    [[nodiscard]] link::HeatStatus heat() { return printer_.link().heat_status.read(); }
    [[nodiscard]] twin::PrinterState metal() { return printer_.twin().state(printer_.now()); }
    [[nodiscard]] twin::Printer& twin() { return printer_.twin(); }
    [[nodiscard]] twin::Report report() { return watch_->finish(printer_.now(), true, status().excursions); }
    [[nodiscard]] const std::string& replies() const { return replies_; }
    [[nodiscard]] std::string fault() { return std::string(status().fault.view()); }
    [[nodiscard]] Instant now() const { return printer_.now(); }
    [[nodiscard]] apps::SimPrinter& printer() { return printer_; }

  private:
    void drain_replies() {
        while (true) {
            const auto frame = reader_.read(printer_.link().replies);
            if (!frame.ok() || !frame->has_value()) return;
            const auto reply = link::decode_reply((*frame)->payload);
            if (reply.ok()) replies_.append(reply->text).push_back('\n');
        }
    }

    std::unique_ptr<link::LinkLayout> memory_ = std::make_unique<link::LinkLayout>();
    std::optional<spool::Feeder> feeder_;
    apps::SimPrinter printer_;
    std::unique_ptr<twin::Job> watch_;
    link::FrameReader reader_;
    std::string replies_;
};

}  // namespace qduino::tests
