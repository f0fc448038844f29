// Multipart bodies: whatever the bytes, the parts do not depend on how they are cut, and a body is
// whole or an error.
//
// Input: one byte that seeds the cutting, then the body; its boundary is XX.
#include <cstdint>
#include <random>
#include <string>

#include "tests/fuzz/gcode/fuzz_check.h"
#include "web/http/multipart.h"

namespace {

using qduino::Result;
using namespace qduino::web;

/// All events as one text.
class Transcript final : public MultipartSink {
  public:
    Result<void> part_begin(const PartHead& head) override {
        FUZZ_EXPECT(!inside_);
        inside_ = true;
        text += "[" + head.name + "|" + head.file_name + (head.is_file ? "|f|" : "||");
        return {};
    }
    Result<void> part_data(std::span<const char> bytes) override {
        FUZZ_EXPECT(inside_ && !bytes.empty());
        text.append(bytes.data(), bytes.size());
        return {};
    }
    Result<void> part_end() override {
        FUZZ_EXPECT(inside_);
        inside_ = false;
        text += "]";
        return {};
    }
    [[nodiscard]] bool inside() const { return inside_; }
    std::string text;

  private:
    bool inside_ = false;
};

struct Outcome {
    std::string text;
    bool whole = false;
};

Outcome parse(std::string_view body, std::uint64_t seed) {
    Transcript transcript;
    MultipartParser parser{"XX", transcript};
    std::mt19937_64 random{seed};
    bool fed = true;
    while (!body.empty() && fed) {
        const std::size_t count =
            std::min<std::size_t>(seed == 0 ? body.size() : 1 + random() % 17, body.size());
        fed = parser.feed({body.data(), count}).ok();
        body.remove_prefix(count);
    }
    const bool whole = fed && parser.finish().ok();
    FUZZ_EXPECT(!whole || !transcript.inside());
    return {transcript.text, whole};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view body{reinterpret_cast<const char*>(data) + 1, size - 1};
    const Outcome at_once = parse(body, 0);
    const Outcome in_pieces = parse(body, 1 + data[0]);
    FUZZ_EXPECT(at_once.whole == in_pieces.whole);
    FUZZ_EXPECT(!at_once.whole || at_once.text == in_pieces.text);
    static_cast<void>(boundary_of(body));
    return 0;
}
