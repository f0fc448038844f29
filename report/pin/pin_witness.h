// Sees what a sketch does with its pins, wherever they are virtual: in the simulator, and on Linux
// where nothing is wired to them.
//
//   board ──► PinWitness ──► what is wired
//                 ├─► a sentence for each pin, of the whole run     pin 13: 10 pulses, …
//                 ├─► rows of a picture, of its window              ▁▁▔▔▁▁▔▔
//                 └─► a value change dump, of the whole run         run.vcd
//
// Levels that something else drives onto inputs are not in it.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "board/peripherals.h"
#include "report/picture/schedule.h"
#include "report/pin/pin_story.h"
#include "report/pin/value_change_dump.h"

namespace qduino::apps {

class PinWitness final : public board::ForwardingPeripherals {
  public:
    /// The most changes that are kept for the rows. The rows end where these are used up.
    static constexpr std::size_t kKept = 500'000;
    /// So many pins get a sentence.
    static constexpr std::size_t kSentences = 12;

    /// Time counts from `origin`; without one from the first write.
    explicit PinWitness(std::optional<Instant> origin = {}) : origin_(origin) {}

    /// Keeps a dump, for write_dump(). Before the run. Error: no temporary file can be had.
    Result<void> keep_dump();
    /// Rows begin so long after the origin. Before the run.
    void rows_from(Nanoseconds after) { rows_from_ = after; }
    /// The run is over: what comes now is not seen any more.
    void end(Instant now);

    void pin_written(Instant now, board::PinId pin, board::Level level) override;
    void pin_released(Instant now, board::PinId pin) override;
    void pwm_written(Instant now, board::PinId pin, double duty) override;
    void pwm_period_set(Instant now, board::PinId pin, Nanoseconds period) override;

    /// Nothing was driven.
    [[nodiscard]] bool empty() const;
    [[nodiscard]] Instant origin() const { return origin_.value_or(kEpoch); }
    /// A line for each pin that was driven; of many the first, "and 12 more". Empty: none was.
    [[nodiscard]] std::string sentences() const;
    /// Adds the pins' rows to `schedule`, whose times count from `origin`. Their window is the
    /// schedule's; where that is too short to see two periods of a pin, and `may_choose`, a longer
    /// one. The end of the run bounds it.
    void add_rows(picture::Schedule& schedule, Instant origin, bool may_choose) const;
    /// Writes the dump to `path`. Error: the system's.
    Result<void> write_dump(const std::string& path);

  private:
    struct Change {
        Instant at;
        std::uint16_t pin = 0;
        float height = 0;  // of low 0, of high 1, of PWM its duty; below 0: not driven
    };
    struct CloseFile {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };

    [[nodiscard]] bool begins(Instant now);
    void keep(Instant now, board::PinId pin, float height);
    [[nodiscard]] std::int64_t since_origin(Instant now) const { return (now - origin()).count(); }
    void spill();
    [[nodiscard]] Instant window_end(const picture::Schedule& schedule, Instant origin) const;

    std::optional<Instant> origin_;
    std::optional<Instant> end_;
    Nanoseconds rows_from_{0};
    std::array<PinStory, board::kPinCount> stories_{};
    std::vector<Change> changes_;
    std::array<std::optional<float>, board::kPinCount> before_{};  // heights where the rows begin
    Instant kept_until_ = kForever;
    ValueChangeDump dump_;
    std::unique_ptr<std::FILE, CloseFile> body_;  // of the dump; null: none is kept
    bool spilled_ = true;                         // all of it could be written
};

}  // namespace qduino::apps
