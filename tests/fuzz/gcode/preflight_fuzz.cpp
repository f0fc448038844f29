// A whole job through the pre-flight and the layer packer: facts are finite and bounded, and the
// packed layers are read back as their format says. A refusal that comes before the file's end is
// the one that the whole file gets.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "fuzz_check.h"
#include "printer/gcode/text.h"
#include "printer/preflight/layer_packer.h"
#include "printer/preflight/preflight.h"

namespace {

using namespace qduino::printer;
using namespace qduino::printer::preflight;

template <typename T>
T read(std::span<const std::uint8_t> bytes, std::size_t offset) {
    T value;
    FUZZ_EXPECT(offset + sizeof value <= bytes.size());
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

class Checker : public LayerSink {
  public:
    void on_layer(const LayerRecord& record, std::span<const std::uint8_t> bytes) override {
        FUZZ_EXPECT(read<std::uint32_t>(bytes, 0) == kLayerMagic);
        const auto vertices = read<std::uint32_t>(bytes, 20);
        FUZZ_EXPECT(bytes.size() == kLayerHeaderBytes + vertices * kVertexBytes);
        FUZZ_EXPECT(record.layer.index >= layers_ || record.part > 0);
        layers_ = record.layer.index;
        std::uint32_t segments = 0;
        for (std::uint32_t i = 0; i < vertices; ++i) {
            const std::size_t vertex = kLayerHeaderBytes + i * kVertexBytes;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto coordinate = read<float>(bytes, vertex + 4 * k);
                FUZZ_EXPECT(coordinate >= -0.01F && coordinate <= 150.01F);
            }
            const auto flags = bytes[vertex + 13];
            FUZZ_EXPECT(flags <= kVertexStartsPolyline);
            FUZZ_EXPECT(i > 0 || flags == kVertexStartsPolyline);
            if (flags == 0) ++segments;
        }
        FUZZ_EXPECT(segments == read<std::uint32_t>(bytes, 24) && segments > 0);
    }

  private:
    std::uint32_t layers_ = 0;
};

bool is_printable(std::string_view text) {
    while (!text.empty()) {
        const std::size_t count = gcode::printable_sequence(text);
        if (count == 0) return false;
        text.remove_prefix(count);
    }
    return true;
}

void check(const Facts& facts, std::size_t size) {
    FUZZ_EXPECT(facts.bytes == size);
    FUZZ_EXPECT(facts.errors.size() <= facts.errors_count && facts.warnings.size() <= facts.warnings_count);
    FUZZ_EXPECT(std::isfinite(facts.filament.value()) && facts.filament.value() >= 0);
    FUZZ_EXPECT(std::isfinite(facts.step_rate_maximum_hz));
    FUZZ_EXPECT(std::isfinite(facts.layer_height.value()));
    FUZZ_EXPECT(facts.thumbnail.png.size() <= kThumbnailBytesMax);
    FUZZ_EXPECT(is_printable(facts.metadata.slicer) && is_printable(facts.metadata.material));
    FUZZ_EXPECT(!facts.metadata.estimated || facts.metadata.estimated->value() >= 0);
    for (const Finding& finding : facts.errors)
        FUZZ_EXPECT(is_printable(finding.text) && !finding.message.empty());
    for (const Finding& finding : facts.warnings) FUZZ_EXPECT(is_printable(finding.text));
    FUZZ_EXPECT(facts.accepted() || facts.errors_count > 0);
    FUZZ_EXPECT(facts.content == gcode::Content::gcode || !facts.accepted());
    FUZZ_EXPECT(facts.accepted() || facts.lacks_start() != facts.unmendable.has_value());
    FUZZ_EXPECT(!facts.unmendable || *facts.unmendable < facts.errors.size());
    FUZZ_EXPECT(facts.content == gcode::Content::gcode || !facts.lacks_start());
}

bool is_same(const Finding& a, const Finding& b) {
    return a.line == b.line && a.offset == b.offset && a.message.view() == b.message.view();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::size_t step = 1 + data[0] * 16U;
    const auto bytes = gcode::as_chars({data + 1, size - 1});
    MachineConfig slow;
    slow.step_low = qduino::Nanoseconds{49'000};  // 20 000 steps/s
    Preflight preflight{slow};
    Checker checker;
    LayerPacker packer{1.75, checker};
    preflight.add_sink(packer);
    // A refusal on the way is that of the whole file.
    std::optional<Finding> refusal;
    for (std::size_t at = 0; at < bytes.size(); at += step) {
        preflight.feed(bytes.subspan(at, std::min(step, bytes.size() - at)));
        FUZZ_EXPECT(preflight.is_refused() || !refusal);
        if (preflight.is_refused() && !refusal) refusal = preflight.facts().first_error();
    }
    const Facts& facts = preflight.finish();
    check(facts, bytes.size());
    FUZZ_EXPECT(!refusal || is_same(*refusal, facts.first_error()));
    return 0;
}
