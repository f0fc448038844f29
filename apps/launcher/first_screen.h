// The first screen of a printer that has come up: at most ten lines of at most 80 columns, with
// what a person needs. All else is in the report (STATE/report.txt, `./run --report`), in the page
// and in STATE/run.log.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/time.h"

namespace qduino::launcher {

struct ScreenFacts {
    Nanoseconds took{};   ///< from the start of `./run`, the build included
    std::string where;    ///< "Real time, core 1 is the stepper's.", "Simulated, 20 times …"
    std::string machine;  ///< its name; empty: unknown
    std::string address;  ///< with the key
    std::filesystem::path state;
    std::string serial;      ///< what a serial host opens; empty: none
    std::string guarantees;  ///< "steps yes, heat yes"
    std::string budget;      ///< of the service: "web budget 10 of 100 ms"
};

[[nodiscard]] std::string first_screen(const ScreenFacts& facts);

/// "5 min 31 s", "14 s".
[[nodiscard]] std::string minutes_and_seconds(Nanoseconds length);

/// How long this process has lived: exec(2) changes nothing of it, so ./run's time counts as well.
[[nodiscard]] Nanoseconds age_of_this_process();

/// The kept report in the state folder `folder`, with a line before it that says whether that
/// printer runs. Somebody else may have written the file: what is no plain text is left out. Error:
/// not_found (no printer has run with it), and what the system says.
[[nodiscard]] Result<std::string> kept_report(const std::filesystem::path& folder);

}  // namespace qduino::launcher
