// Any bytes from a serial host, in any pieces, with a printer that is done with lines, dies and
// comes back at any moment. The first byte says how the rest is cut, how often each piece comes (a
// flood fills what is held), and what happens between the pieces. Each line that crosses is one
// line of G-code; nothing grows without bound; when the printer has done everything, the host is
// owed nothing.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "printer/gcode/command_table.h"
#include "serial/serial_session.h"
#include "tests/fuzz/gcode/fuzz_check.h"

namespace {

using namespace qduino;
using apps::SerialSession;

class Printer {
  public:
    explicit Printer(SerialSession& session) : session_(session) { session_.learn(news_, now_); }

    /// What `choice` says.
    void act(unsigned choice) {
        now_ += std::chrono::milliseconds{choice * 40};
        for (const apps::HostLine& line : session_.take_lines()) check(line);
        if (choice % 4 == 1) news_.lines_over += session_.under_way() / 2;
        if (choice % 16 == 3) session_.hear(printer::link::ReplyKind::host_warning, "a warning");
        if (choice % 32 == 5 && session_.under_way() > 0)
            session_.refuse(make_error(ErrorCode::unavailable, "no"));
        if (choice % 64 == 7) news_ = {.connected = true, .session = news_.session + 1};
        if (choice % 64 == 9) news_.connected = !news_.connected;
        session_.learn(news_, now_);
        session_.tick(now_);
        FUZZ_EXPECT(session_.under_way() <= printer::link::kHostLinesMax);
    }
    /// Does all that is left.
    void finish() {
        news_.connected = true;
        do {
            session_.learn(news_, now_);
            for (const apps::HostLine& line : session_.take_lines()) check(line);
            news_.lines_over += session_.under_way();
            session_.learn(news_, now_);
            static_cast<void>(session_.take_output());
        } while (session_.under_way() > 0);
    }
    [[nodiscard]] Instant now() const { return now_; }

  private:
    static void check(const apps::HostLine& line) {
        FUZZ_EXPECT(!line.text.empty() && line.text.size() <= printer::gcode::kLineBytesMax);
        FUZZ_EXPECT(line.text.find_first_of("\r\n") == std::string::npos);
        const auto parsed = printer::gcode::parse_line(line.text);
        FUZZ_EXPECT(parsed.ok() && parsed->has_value());
    }
    SerialSession& session_;
    apps::PrinterNews news_{.connected = true, .session = 1};
    Instant now_ = instant_from_ns(0);
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::size_t step = 1 + data[0] % 64;
    const auto bytes = printer::gcode::as_chars({data + 1, size - 1});
    SerialSession session;
    Printer printer{session};
    session.open();
    for (std::size_t at = 0; at < bytes.size(); at += step) {
        const auto piece = bytes.subspan(at, std::min(step, bytes.size() - at));
        for (int copies = data[0] >= 192 ? 30 : 1; copies > 0; --copies) session.take(piece, printer.now());
        FUZZ_EXPECT(session.held() <= apps::HeldLines::kMax);
        printer.act(static_cast<std::uint8_t>(piece[0]) ^ data[0]);
        FUZZ_EXPECT(session.take_output().size() <= SerialSession::kOutputMax);
    }
    printer.finish();
    FUZZ_EXPECT(session.under_way() == 0);
    return 0;
}
