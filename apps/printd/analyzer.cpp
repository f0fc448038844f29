#include "apps/printd/analyzer.h"

#include <fcntl.h>

#include <array>
#include <cerrno>
#include <memory>
#include <nlohmann/json.hpp>

#include "posix/small_file.h"
#include "posix/unique_fd.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/no_actions.h"
#include "printer/gcode/parser.h"
#include "printer/preflight/layer_packer.h"
#include "printer/preflight/preflight.h"
#include "spool/file_error.h"

namespace qduino::printd {

namespace {

using Json = nlohmann::ordered_json;
using printer::preflight::Facts;
using printer::preflight::Finding;

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// Writes packed layers behind one another, and keeps their index.
class LayerFile final : public printer::preflight::LayerSink {
  public:
    explicit LayerFile(const std::filesystem::path& path)
        : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)) {}

    void on_layer(const printer::preflight::LayerRecord& record,
                  std::span<const std::uint8_t> bytes) override {
        const std::span<const char> text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
        failed_ = failed_ || !posix::write_all(file_.get(), text, "packed layers").ok();
        if (!index_.empty()) index_ += ",";
        index_ += text_of({{"index", count_++},
                           {"layer", record.layer.index},
                           {"z_mm", record.layer.z_mm},
                           {"segments", record.segments},
                           {"bytes", bytes.size()},
                           {"first_byte", record.layer.first_byte}});
    }
    [[nodiscard]] bool failed() const { return failed_; }
    [[nodiscard]] std::string index() const { return "[" + index_ + "]"; }

  private:
    posix::UniqueFd file_;
    std::string index_;
    int count_ = 0;
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

Json facts_json(const Facts& facts) {
    Json warnings = Json::array();
    for (const Finding& warning : facts.warnings) {
        warnings.push_back({{"line", warning.line}, {"message", sentence_of(warning)}});
    }
    const auto& metadata = facts.metadata;
    return {{"estimated_s", metadata.estimated ? Json(metadata.estimated->value()) : Json{}},
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
    analysis.facts_json = text_of(facts_json(facts));
    if (facts.metadata.estimated) analysis.estimated_s = facts.metadata.estimated->value();
    analysis.layers_json = packed.index();
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
