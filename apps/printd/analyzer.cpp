#include "apps/printd/analyzer.h"

#include <fcntl.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "posix/small_file.h"
#include "posix/unique_fd.h"
#include "printer/estimate/estimator.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/no_actions.h"
#include "printer/gcode/parser.h"
#include "printer/preflight/layer_packer.h"
#include "printer/preflight/preflight.h"
#include "spool/file_error.h"

namespace qduino::printd {

namespace {

using Json = nlohmann::ordered_json;
using printer::estimate::Estimate;
using printer::preflight::Facts;
using printer::preflight::Finding;

double tenths(double seconds) { return std::round(seconds * 10) / 10; }

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// Writes packed layers behind one another, and keeps what their index needs.
class LayerFile final : public printer::preflight::LayerSink {
  public:
    explicit LayerFile(const std::filesystem::path& path)
        : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)) {}

    void on_layer(const printer::preflight::LayerRecord& record,
                  std::span<const std::uint8_t> bytes) override {
        const std::span<const char> text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
        failed_ = failed_ || !posix::write_all(file_.get(), text, "packed layers").ok();
        rows_.push_back({record.layer.index, record.part, static_cast<float>(record.layer.z_mm),
                         record.segments, bytes.size(), record.layer.first_byte});
    }
    [[nodiscard]] bool failed() const { return failed_; }
    /// A layer's time stands in its first record.
    [[nodiscard]] std::string index(const Estimate& estimate) const {
        std::string index{"["};
        for (const Row& row : rows_) {
            if (index.size() > 1) index += ',';
            const bool timed = row.part == 0 && row.layer < estimate.layer_s.size();
            index += text_of({{"index", &row - rows_.data()},
                              {"layer", row.layer},
                              {"z_mm", row.z_mm},
                              {"segments", row.segments},
                              {"bytes", row.bytes},
                              {"first_byte", row.first_byte},
                              {"time_s", timed ? tenths(estimate.layer_s[row.layer]) : 0.0}});
        }
        return index + ']';
    }

  private:
    struct Row {
        std::uint32_t layer, part;
        float z_mm;
        std::uint32_t segments;
        std::size_t bytes;
        std::uint64_t first_byte;
    };

    posix::UniqueFd file_;
    std::vector<Row> rows_;
    bool failed_ = false;
};

template <typename Positions>
Json xyz(const Positions& positions) {
    return {positions[0].value(), positions[1].value(), positions[2].value()};
}

std::string sentence_of(const Finding& finding) {
    std::string text{finding.message.view()};
    if (finding.advice.empty()) return text;
    if (!text.empty() && text.back() != '.') text += '.';
    return text.append(" ").append(finding.advice.view());
}

/// {"outer_wall": 123.4, …}: what takes any time.
Json activities_json(const Estimate& estimate) {
    Json activities = Json::object();
    for (std::size_t i = 0; i < estimate.activity_s.size(); ++i) {
        const auto activity = static_cast<printer::estimate::Activity>(i);
        if (const double time_s = tenths(estimate.activity_s[i]); time_s > 0)
            activities[std::string{name_of(activity)}] = time_s;
    }
    return activities;
}

/// What web/api/eta.h reads.
Json profile_json(const Estimate& estimate) {
    Json bytes = Json::array();
    for (const std::uint64_t byte : estimate.profile.bytes()) bytes.push_back(byte);
    return {{"step_s", estimate.profile.step_s()},
            {"bytes", std::move(bytes)},
            {"heating_s", tenths(estimate.heating_s())},
            {"heated_byte", estimate.heated_byte}};
}

Json facts_json(const Facts& facts, const Estimate& estimate) {
    Json warnings = Json::array();
    for (const Finding& warning : facts.warnings) {
        warnings.push_back({{"line", warning.line}, {"message", sentence_of(warning)}});
    }
    const auto& metadata = facts.metadata;
    return {{"estimated_s", tenths(estimate.total_s)},
            {"activities_s", activities_json(estimate)},
            {"profile", profile_json(estimate)},
            {"slicer_s", metadata.estimated ? Json(metadata.estimated->value()) : Json{}},
            {"filament_mm", facts.filament.value()},
            {"layers", facts.layers},
            {"layer_height_mm", facts.layer_height.value()},
            {"min_mm", xyz(facts.extruding_bounds.minimum)},
            {"max_mm", xyz(facts.extruding_bounds.maximum)},
            {"hot_end_c", facts.hot_end_maximum.value()},
            {"bed_c", facts.bed_maximum.value()},
            {"lines", facts.lines},
            {"moves", facts.moves},
            {"slicer", std::string{metadata.slicer.view()}},
            {"material", std::string{metadata.material.view()}},
            {"thumbnail", !facts.thumbnail.png.empty()},
            {"warnings", std::move(warnings)},
            {"warnings_count", facts.warnings_count}};
}

spool::Analysis refusal(const Facts& facts) {
    spool::Analysis analysis;
    const bool is_gcode = facts.content == printer::gcode::Content::gcode;
    analysis.verdict = is_gcode ? spool::Analysis::Verdict::violation : spool::Analysis::Verdict::not_gcode;
    const Finding& first = facts.errors[0];
    analysis.message = sentence_of(first);
    analysis.line = first.line;
    return analysis;
}

}  // namespace

Result<spool::Analysis> PreflightAnalyzer::analyze(const std::filesystem::path& gcode,
                                                   const std::filesystem::path& layers) {
    const posix::UniqueFd file{::open(gcode.c_str(), O_RDONLY | O_CLOEXEC)};
    LayerFile packed{layers};
    printer::preflight::LayerPacker packer{machine_.filament_diameter.value(), packed};
    // On the heap: findings and parser state are too large for a thread's stack to be taken for
    // granted.
    printer::MachineConfig machine = machine_;
    machine.step_cost = step_cost();
    const auto preflight = std::make_unique<printer::preflight::Preflight>(machine);
    preflight->add_sink(packer);
    const auto estimator = std::make_unique<printer::estimate::Estimator>(machine);
    preflight->add_sink(*estimator);
    std::array<char, 16 * 1024> bytes;
    for (;;) {
        const Result<std::size_t> count = posix::read_some(file.get(), bytes, "the uploaded file");
        if (!count.ok()) return make_error(ErrorCode::internal, "the uploaded file cannot be read back");
        if (*count == 0) break;
        preflight->feed({bytes.data(), *count});
    }
    const Facts& facts = preflight->finish();
    if (!facts.accepted() && !facts.errors.empty()) return refusal(facts);
    if (packed.failed()) return spool::file_error("write", "packed layers", ENOSPC);
    spool::Analysis analysis;
    const Estimate& estimate = estimator->estimate();
    analysis.facts_json = text_of(facts_json(facts, estimate));
    analysis.estimated_s = estimate.total_s;
    analysis.layers_json = packed.index(estimate);
    analysis.thumbnail.assign(facts.thumbnail.png.begin(), facts.thumbnail.png.end());
    return analysis;
}

Result<void> check_line(const printer::MachineConfig& machine, std::string_view line) {
    using namespace printer::gcode;
    const Result<std::optional<Command>> parsed = parse_line(line);
    if (!parsed.ok()) return parsed.error();
    // What a G code does depends on where the machine stands, and how it was told to read numbers.
    if (!parsed->has_value() || (*parsed)->letter != 'M') return {};
    NoActions nothing;
    Interpreter in_millimetres{machine, nothing};
    const Result<void> done = in_millimetres.execute(**parsed);
    if (done.ok()) return {};
    Interpreter in_inches{machine, nothing};
    static_cast<void>(in_inches.execute(**parse_line("G20")));
    return in_inches.execute(**parsed).ok() ? Result<void>{} : done;
}

}  // namespace qduino::printd
