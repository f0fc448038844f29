// What a picture shows of a sketch's plan: its rows, R against T, and the critical instant.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "report/picture/recorder.h"
#include "runtime/plan.h"

namespace qduino::apps {

/// The part of the time that a picture shows, in seconds from the start of the run; what is absent
/// is chosen.
struct PictureWindow {
    double from_s = 0;
    std::optional<double> length_s;
};

/// A row for each VCPU that the plan has put on a core.
void declare_rows(const runtime::Plan& plan, picture::Recorder& recorder);

/// R against T of each loop that was analysed, in the order of its declaration.
[[nodiscard]] std::vector<picture::Response> responses_of(const runtime::Plan& plan);
/// Adds to them what was seen in a run.
void add_seen(const picture::Schedule& schedule, std::vector<picture::Response>& responses);

/// The length of a window that suits the plan's loops.
[[nodiscard]] Nanoseconds length_for(const runtime::Plan& plan, const PictureWindow& window);

/// Periods of the shortest loop until the end of the window: what a critical schedule costs.
[[nodiscard]] std::int64_t periods_until_end(const runtime::Plan& plan, const PictureWindow& window);

/// The worst schedule of the plan, by core, with its R against T. Empty of cores when the plan has
/// put nothing on any.
[[nodiscard]] picture::Schedule critical_schedule(const runtime::Plan& plan, const std::string& sketch,
                                                  const PictureWindow& window);

}  // namespace qduino::apps
