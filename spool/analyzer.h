// The spool's question about a job's bytes before it queues them. The answer comes from outside:
// the spool knows no G-code.
//
// An upload of 300 MB whose tenth line is wrong should be refused at its tenth line. So a file is
// read while it comes in:
//
//   begin ──► feed … feed ─┬─► a refusal, which nothing that follows could change
//                          └─► finish ──► the verdict on the whole file
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "spool/job.h"

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
    /// Lines that make a file with a violation fit, put in front of it; empty: there are none.
    std::string prologue;
};

/// One file while it is read. One thread at a time.
class FileReading {
  public:
    virtual ~FileReading() = default;
    /// The next bytes of the file, in any pieces. Once a refusal stands whatever follows, it comes
    /// back, and nothing more may be fed. Never a verdict of `fits`.
    [[nodiscard]] virtual std::optional<Analysis> feed(std::span<const char> bytes) = 0;
    /// The file has ended. Once. Error: its layers cannot be written.
    [[nodiscard]] virtual Result<Analysis> finish() = 0;
};

class Analyzer {
  public:
    virtual ~Analyzer() = default;
    /// A file whose bytes come one after the other. Needs memory that does not grow with it, and
    /// packs its layers into `layers`, which outlives the reading. On worker threads, several at a
    /// time; touches nothing else.
    [[nodiscard]] virtual std::unique_ptr<FileReading> begin(ByteSink& layers) = 0;
    /// Reads an existing file, by begin(). Error: the file cannot be read, or its layers not be
    /// written.
    [[nodiscard]] Result<Analysis> analyze(const ByteSource& gcode, ByteSink& layers);
};

/// Writes the analyzer's findings into `job`.
void describe(Job& job, const Analysis& analysis);

}  // namespace qduino::spool
