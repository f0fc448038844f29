// The certificate of an admission: all that it assumed of each core, and the response times that it
// derived from that, as JSON in whole nanoseconds. tools/check_certificate.py verifies one, and
// shares no code with the analysis.
//
// It names the texts that it speaks of, each by its SHA-256: the sketch's sources and the board
// file. Its last line is the SHA-256 of all the rest, as compact JSON: one that was changed is no
// certificate. (That keeps away mistakes, not forgers.)
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "runtime/plan.h"

namespace qduino::apps {

/// What a certificate speaks of.
struct CertifiedTexts {
    std::string sketch;                          ///< its name
    std::vector<std::filesystem::path> sources;  ///< its files
    std::filesystem::path board;                 ///< its board file; empty: none
    /// Locks of which nobody says who holds them, where R depends on it.
    std::vector<std::string> locks_that_say_nothing;
};

/// Contract: the plan is admitted. Error: a file cannot be read.
[[nodiscard]] Result<std::string> certificate_json(const runtime::Plan& plan, const CertifiedTexts& texts);

}  // namespace qduino::apps
