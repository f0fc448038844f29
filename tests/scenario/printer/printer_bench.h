// A printer in virtual time for one scenario: feeds jobs and commands, and watches from the link
// and from the metal.
#pragma once

#include <sys/mman.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/printer_sim/sim_printer.h"
#include "config/twin_machine.h"
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
        : PrinterBench(config, apps::twin_machine(config)) {}
    /// On a machine of its own numbers.
    PrinterBench(const printer::MachineConfig& config, const twin::Machine& metal)
        : printer_(config, metal, *memory_) {}

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
            tell_typed_objects();
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
        feeder_.emplace(std::make_shared<BytesInMemory>(std::make_shared<const std::string>(text)), id);
        watch(std::move(text));
    }
    /// From here on the twin compares with `text`, whoever prints it.
    void watch(std::string text) {
        watch_.reset();  // one at a time watches the pins
        watch_ = std::make_unique<twin::Job>(
            printer_.twin(), std::make_unique<twin::TextSource>(std::move(text)), printer_.now());
    }
    bool finish_job(double limit_s = 2000) {
        return run_until(
            [&] { return status().outcome != link::JobOutcome::running && status().job_id != 0; }, limit_s);
    }
    void command(link::Command command, std::string_view text = {}) {
        ASSERT_TRUE(link::try_push(printer_.link().commands, link::encode(link::CommandText{command, text})));
    }
    void type(std::string_view line) { command(link::Command::gcode, line); }
    /// The twin is not told what is typed of the job, until tell_typed().
    void hold_typed() { holds_typed_ = true; }
    void tell_typed() {
        holds_typed_ = false;
        tell_typed_objects();
    }
    void emergency() { printer_.link().emergency.fetch_add(1); }

    [[nodiscard]] link::JobStatus status() { return printer_.link().job_status.read(); }
    [[nodiscard]] link::MotionStatus motion() { return printer_.link().motion_status.read(); }
    [[nodiscard]] link::HeatStatus heat() { return printer_.link().heat_status.read(); }
    [[nodiscard]] twin::PrinterState metal() { return printer_.twin().state(printer_.now()); }
    [[nodiscard]] twin::Printer& twin() { return printer_.twin(); }
    [[nodiscard]] twin::Report report() { return watch_->finish(printer_.now(), true, status().excursions); }
    [[nodiscard]] const std::string& replies() const { return replies_; }
    /// To a serial host, since the last call.
    [[nodiscard]] std::vector<std::pair<link::ReplyKind, std::string>> take_host_replies() {
        return std::exchange(host_replies_, {});
    }
    [[nodiscard]] std::string fault() { return std::string(status().fault.view()); }
    [[nodiscard]] Instant now() const { return printer_.now(); }
    [[nodiscard]] apps::SimPrinter& printer() { return printer_; }

  private:
    /// As the service does it (spool/spool.cpp).
    void tell_typed_objects() {
        const link::JobStatus now = status();
        if (now.job_id != job_id_) typed_told_ = 0;
        job_id_ = now.job_id;
        for (; watch_ && !holds_typed_ && typed_told_ < now.typed_objects; ++typed_told_) {
            const link::TypedObject& typed = now.typed_object[typed_told_ % link::kTypedObjects];
            watch_->on_typed(typed.behind_line, typed.text.view(), typed.left_mm);
        }
    }
    void drain_replies() {
        while (true) {
            const auto frame = reader_.read(printer_.link().replies);
            if (!frame.ok() || !frame->has_value()) return;
            const auto reply = link::decode_reply((*frame)->payload);
            if (!reply.ok()) continue;
            if (reply->kind >= link::ReplyKind::host_text) {
                host_replies_.emplace_back(reply->kind, reply->text);
            } else {
                replies_.append(reply->text).push_back('\n');
            }
        }
    }

    std::unique_ptr<link::LinkLayout> memory_ = std::make_unique<link::LinkLayout>();
    std::optional<spool::Feeder> feeder_;
    apps::SimPrinter printer_;
    std::unique_ptr<twin::Job> watch_;
    std::uint64_t job_id_ = 0;
    std::uint32_t typed_told_ = 0;
    bool holds_typed_ = false;
    link::FrameReader reader_;
    std::string replies_;
    std::vector<std::pair<link::ReplyKind, std::string>> host_replies_;
};

}  // namespace qduino::tests
