// The spool's question about a job's bytes before it queues them. The answer comes from outside:
// the spool knows no G-code.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace qduino::spool {

/// The verdict on one file.
struct Analysis {
    enum class Verdict : std::uint8_t {
        fits,       ///< may be printed
        not_gcode,  ///< no G-code at all, or not text
        violation,  ///< breaks a rule of this machine at `line`
    };
    Verdict verdict = Verdict::fits;
    /// For people. Repeats of the file's text only what the rule needs.
    std::string message;
    std::uint64_t line = 0;   ///< 1-based; 0: none
    std::string facts_json;   ///< an object
    double estimated_s = 0;   ///< 0: unknown
    std::string layers_json;  ///< array of layers in the packed file; empty: none were packed
    std::string thumbnail;    ///< PNG bytes; empty: none
    /// Of a violation: lines that would make it fit, put in front of it; empty: there are none.
    std::string prologue;
};

class Analyzer {
  public:
    virtual ~Analyzer() = default;
    /// Reads `gcode` once, with memory that does not grow with the file, and packs its layers into
    /// `layers` (created). Called on a worker thread, several at a time; touches nothing else.
    /// Error: the file cannot be read or written.
    [[nodiscard]] virtual Result<Analysis> analyze(const std::filesystem::path& gcode,
                                                   const std::filesystem::path& layers) = 0;
};

}  // namespace qduino::spool
