// Bytes → lines → words. The first byte says how the rest is cut; lines must not depend on it.
// Every number is finite, every text is printable UTF-8, every line stands where it says.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "fuzz_check.h"
#include "printer/gcode/content.h"
#include "printer/gcode/emergency_scanner.h"
#include "printer/gcode/host_session.h"
#include "printer/gcode/parser.h"
#include "printer/gcode/text.h"

namespace {

using namespace qduino::printer::gcode;

bool is_printable(std::string_view text) {
    while (!text.empty()) {
        const std::size_t count = printable_sequence(text);
        if (count == 0) return false;
        text.remove_prefix(count);
    }
    return true;
}

class Checker {
  public:
    explicit Checker(std::string_view bytes) : bytes_(bytes) {}

    void operator()(const Line& line) {
        const Source& s = line.source;
        FUZZ_EXPECT(s.line == ++lines_);
        FUZZ_EXPECT(s.offset >= end_ && s.offset <= end_ + 1);
        FUZZ_EXPECT(s.offset + s.length <= bytes_.size());
        FUZZ_EXPECT(bytes_.substr(s.offset, s.length).find_first_of("\r\n") == std::string_view::npos);
        end_ = s.end_offset;
        FUZZ_EXPECT(!(line.error && line.command != nullptr));
        if (line.command != nullptr) check(*line.command);
        (void)host_.accept(line);
        transcript_ += line.error ? 'e' : line.command != nullptr ? line.command->letter + '\1' : '-';
        transcript_ += line.comment;
    }
    [[nodiscard]] const std::string& transcript() const { return transcript_; }

  private:
    static void check(const Command& command) {
        FUZZ_EXPECT(is_printable(command.text));
        FUZZ_EXPECT(!command.name().empty());
        for (char letter = 'A'; letter <= 'Z'; ++letter) {
            const auto value = command.parameters.value(letter);
            FUZZ_EXPECT(!value || std::isfinite(*value));
            FUZZ_EXPECT(!value || command.parameters.has(letter));
        }
    }
    std::string_view bytes_;
    std::string transcript_;
    HostSession host_;
    std::uint64_t lines_ = 0;
    std::uint64_t end_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::size_t step = 1 + data[0] % 64;
    const auto bytes = as_chars({data + 1, size - 1});
    const std::string_view text{bytes.data(), bytes.size()};
    (void)look_at_content(bytes, {});

    Checker whole{text};
    Parser at_once;
    at_once.feed(bytes, whole);
    at_once.finish(whole);

    Checker pieces{text};
    Parser in_steps;
    EmergencyScanner scanner;
    for (std::size_t at = 0; at < bytes.size(); at += step) {
        const auto piece = bytes.subspan(at, std::min(step, bytes.size() - at));
        in_steps.feed(piece, pieces);
        (void)scanner.feed(piece);
    }
    in_steps.finish(pieces);
    FUZZ_EXPECT(whole.transcript() == pieces.transcript());
    return 0;
}
