#include "analysis/preflight_analyzer.h"

#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "printer/estimate/estimator.h"
#include "printer/facts/facts_json.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/no_actions.h"
#include "printer/gcode/parser.h"
#include "printer/preflight/layer_packer.h"
#include "printer/preflight/preflight.h"
#include "printer/preflight/prologue.h"

namespace qduino::analysis {

namespace {

using printer::tenths;
using Json = nlohmann::ordered_json;
using printer::estimate::Estimate;
using printer::preflight::Facts;
using printer::preflight::Finding;

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// Writes packed layers behind one another, and keeps what their index needs.
class PackedLayers final : public printer::preflight::LayerSink {
  public:
    explicit PackedLayers(ByteSink& bytes) : bytes_(bytes) {}

    void on_layer(const printer::preflight::LayerRecord& record,
                  std::span<const std::uint8_t> bytes) override {
        const std::span<const char> text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
        if (written_) written_ = bytes_.write(text);
        rows_.push_back({record.layer.index, record.part, static_cast<float>(record.layer.z_mm),
                         record.segments, bytes.size(), record.layer.first_byte});
    }
    [[nodiscard]] const Result<void>& written() const { return written_; }
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
                              {"time_s", timed ? printer::tenths(estimate.layer_s[row.layer]) : 0.0}});
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

    ByteSink& bytes_;
    std::vector<Row> rows_;
    Result<void> written_;
};

spool::Analysis refusal(const Facts& facts, const printer::MachineConfig& machine) {
    spool::Analysis analysis;
    const bool is_gcode = facts.content == printer::gcode::Content::gcode;
    analysis.verdict = is_gcode ? spool::Analysis::Verdict::violation : spool::Analysis::Verdict::not_gcode;
    const Finding& first = facts.first_error();
    analysis.message = printer::sentence_of(first);
    analysis.line = first.line;
    if (facts.lacks_start()) analysis.prologue = printer::preflight::prologue_of(machine, facts);
    return analysis;
}

/// On the heap: findings and parser state are too large for a thread's stack to be taken for
/// granted.
class Reading final : public spool::FileReading {
  public:
    Reading(const printer::MachineConfig& machine, ByteSink& layers) : machine_(machine), packed_(layers) {
        preflight_.add_sink(packer_);
        preflight_.add_sink(estimator_);
    }
    std::optional<spool::Analysis> feed(std::span<const char> bytes) override {
        preflight_.feed(bytes);
        if (!preflight_.is_refused()) return std::nullopt;
        return refusal(preflight_.facts(), machine_);
    }
    Result<spool::Analysis> finish() override {
        const Facts& facts = preflight_.finish();
        if (!facts.accepted()) return refusal(facts, machine_);
        // Where they have no room at all the file is printed without them.
        const Result<void>& packed = packed_.written();
        if (!packed && packed.error().code != ErrorCode::out_of_range) return packed.error();
        spool::Analysis analysis;
        const Estimate& estimate = estimator_.estimate();
        analysis.facts_json = text_of(printer::facts_json(facts, estimate));
        analysis.estimated_s = estimate.total_s;
        if (packed) analysis.layers_json = packed_.index(estimate);
        analysis.thumbnail.assign(facts.thumbnail.png.begin(), facts.thumbnail.png.end());
        return analysis;
    }

  private:
    printer::MachineConfig machine_;
    PackedLayers packed_;
    printer::preflight::LayerPacker packer_{machine_.filament_diameter.value(), packed_};
    printer::preflight::Preflight preflight_{machine_};
    printer::estimate::Estimator estimator_{machine_};
};

}  // namespace

std::unique_ptr<spool::FileReading> PreflightAnalyzer::begin(ByteSink& layers) {
    printer::MachineConfig machine = machine_;
    machine.step_cost = step_cost();
    return std::make_unique<Reading>(machine, layers);
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

}  // namespace qduino::analysis
