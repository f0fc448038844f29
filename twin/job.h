// Job: the watch over one print. Joins the printer's motion with the file that asked for it, and
// reports.
//
//   Printer ──on_step, on_endstop──► Job ──► Inspector   (built against asked)
//      ▲                              ├───► Deposit      (plastic, layers)
//      └────── temperatures ──────────┘     temperatures while extruding, cold extrusion
//
// Begin it before the first byte of the job reaches the firmware; finish it once the last pulse has
// been played. One job watches a printer at a time. The printer must outlive the job.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/time.h"
#include "twin/byte_source.h"
#include "twin/deposit.h"
#include "twin/inspector.h"
#include "twin/observer.h"
#include "twin/print_record.h"
#include "twin/printer.h"
#include "twin/racking.h"
#include "twin/report.h"

namespace qduino::twin {

class Job final : public MotionObserver {
  public:
    /// `before`: where the last job of the same session ended, if there was one. Without it the
    /// firmware is assumed to call the present place 0, as it does at power-on.
    Job(Printer& printer, std::unique_ptr<ByteSource> asked, Instant now,
        const std::optional<InspectionStart>& before = std::nullopt);
    ~Job() override;
    Job(const Job&) = delete;
    Job& operator=(const Job&) = delete;

    /// Fills in `record` from now on; null: none. It outlives the job.
    void fill_in(PrintRecord* record) { record_ = record; }

    void on_step(const StepSeen& step) override;
    void on_extra_step(std::size_t which, std::int64_t position) override;
    void on_probe(Instant at) override { inspector_.on_probe(at); }
    void on_endstop(Instant at, int axis, bool pressed) override { inspector_.on_endstop(at, axis, pressed); }

    /// `line` was typed beside the job when the machine had read it up to `behind_line`. To be told
    /// before that line has been printed: the machine reads ahead.
    /// `left_mm`: filament of that line that was still to be laid down.
    void on_typed(std::uint64_t behind_line, std::string_view line, double left_mm = 0) {
        inspector_.on_typed(behind_line, line, left_mm);
    }

    /// Ends the watch. Call once. `read_rest`: see Inspector::finish. `excursions_told`: how often
    /// the machine reports that it left the path and came back.
    [[nodiscard]] Report finish(Instant now, bool read_rest = true, std::uint64_t excursions_told = 0);
    /// The start of the next job of this session. After finish().
    [[nodiscard]] InspectionStart next_start() const { return inspector_.next_start(); }
    /// The line of the file at which the nozzle is.
    [[nodiscard]] std::uint64_t line() const { return inspector_.line(); }

  private:
    static InspectionStart start_for(Printer& printer, Instant now,
                                     const std::optional<InspectionStart>& before);
    void sample_temperatures(Instant at);
    void watch_racking(std::size_t which);
    [[nodiscard]] std::int64_t apart(std::size_t which) const;

    Printer& printer_;
    std::unique_ptr<ByteSource> asked_;
    Instant began_;
    PrinterState at_begin_;
    Inspector inspector_;
    Deposit deposit_;
    Gantry gantry_;
    Counts position_;
    std::array<double, kAxisCount> mm_per_step_{};
    std::vector<Racking> racking_;  // per extra motor
    std::uint64_t pushed_ = 0;
    std::uint64_t cold_ = 0;
    bool too_cold_ = false;
    bool watching_ = true;
    PrintRecord* record_ = nullptr;
    TemperatureRange hot_end_{1e9, -1e9};
    TemperatureRange bed_{1e9, -1e9};
};

}  // namespace qduino::twin
