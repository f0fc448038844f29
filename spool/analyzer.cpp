#include "spool/analyzer.h"

#include <array>

namespace qduino::spool {

Result<Analysis> Analyzer::analyze(const ByteSource& gcode, ByteSink& layers) {
    const std::unique_ptr<FileReading> reading = begin(layers);
    std::array<char, 16 * 1024> bytes;
    for (std::uint64_t at = 0;;) {
        const Result<std::size_t> count = gcode.read_at(at, bytes);
        if (!count.ok()) return make_error(ErrorCode::internal, "the uploaded file cannot be read back");
        if (*count == 0) return reading->finish();
        if (std::optional<Analysis> refusal = reading->feed({bytes.data(), *count})) return *refusal;
        at += *count;
    }
}

void describe(Job& job, const Analysis& analysis) {
    job.facts_json = analysis.facts_json.empty() ? "{}" : analysis.facts_json;
    job.estimated_s = analysis.estimated_s;
    job.has_layers = !analysis.layers_json.empty();
    job.has_thumbnail = !analysis.thumbnail.empty();
}

}  // namespace qduino::spool
