// A serial host's session, sans I/O: Marlin's side of the protocol that OctoPrint, Pronterface and
// Cura speak over a wire.
//
//   bytes ─► Parser ─► HostSession ─► answered here (M105 M110 M113 M155), or
//              │          │           ─► lines for the printer ══ link ══► console of loop 1
//              │          └ Resend: n                                        │
//   text  ◄────┴────────────── ok, answers, busy, temperatures ◄─────────────┘
//
// Marlin says `ok` when a command has returned. Here a line first crosses to another process, whose
// loop 1 looks every 100 ms: a host that waits for each `ok` would send ten lines a second. So a
// move gets its `ok` as soon as it is taken, while fewer than link::kHostLinesMax lines are under
// way. A line that answers or waits (gcode::Ok) gets it when the printer is done with it, and no
// other line is taken meanwhile.
//
// After a refused line everything that has come behind it is dropped, as Marlin does: it has the
// wrong numbers.
//
// M108, M112 and M410 are found in the bytes before they come here (gcode/emergency_scanner.h). As
// lines they are only answered.
//
// Every byte is taken at any time, so that a port is read and looked through however long a line
// takes. What does not fit is dropped and asked for again (held_lines.h). A host without numbers
// cannot send it again: none of its moves is made until it says M110 or opens the port anew, for a
// part with lines missing is worse than none.
//
// Bounded: at most HeldLines::kMax bytes in, kOutputMax out, and the window of lines. One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "printer/gcode/host_session.h"
#include "printer/gcode/parser.h"
#include "printer/link/layout.h"
#include "serial/held_lines.h"

namespace qduino::apps {

/// What the session is told of the printer, now and then.
struct PrinterNews {
    bool connected = false;
    std::uint64_t session = 0;     ///< of the link; another one: the printer was started anew
    std::uint64_t lines_over = 0;  ///< link::JobStatus::host_lines
    std::string temperatures{};    ///< as M105 answers them, without `ok `
    std::string fault{};           ///< empty: none
};

/// A line on its way to the printer.
struct HostLine {
    std::string text;
    bool claims = false;  ///< it moves or waits (gcode::takes_the_printer)
};

class SerialSession {
  public:
    static constexpr std::size_t kOutputMax = 64 * 1024;

    /// A host has opened the port: it is greeted.
    void open();
    /// It has gone: what it has not been answered is forgotten.
    void close();

    void take(std::span<const char> bytes, Instant now);
    /// Bytes that wait.
    [[nodiscard]] std::size_t held() const { return input_.size(); }
    /// M108 or M410 for the printer, ahead of every line that has not been sent. One that has not
    /// been sent yet stands for the next one, too.
    void send_at_once(std::string_view line);

    /// The printer answers a host's line.
    void hear(printer::link::ReplyKind kind, std::string_view text);
    /// A line did not reach the printer.
    void refuse(const Error& why);
    void learn(const PrinterNews& news, Instant now);
    /// Says what is due: temperatures, and that the printer is busy.
    void tick(Instant now);

    [[nodiscard]] std::string take_output() { return std::exchange(output_, {}); }
    [[nodiscard]] std::vector<HostLine> take_lines() { return std::exchange(lines_, {}); }
    [[nodiscard]] bool has_lines() const { return !lines_.empty(); }
    /// Lines under way to the printer, or in its hands.
    [[nodiscard]] std::uint64_t under_way() const { return sent_ - over(); }

  private:
    /// A line whose `ok` comes when all lines so far are over.
    struct Awaited {
        bool heats = false;  ///< temperatures are said meanwhile
    };

    void greet();
    void advance(Instant now);
    [[nodiscard]] printer::gcode::HostVerdict judge(const printer::gcode::Line& line);
    void carry_out(const printer::gcode::Line& line, Instant now);
    [[nodiscard]] bool answer(const printer::gcode::Command& command, Instant now);
    void forward(const printer::gcode::Line& line, Instant now);
    void settle();
    void lose_printer(Instant now);
    void forget_lines();
    void say(std::string_view line);
    [[nodiscard]] std::uint64_t over() const { return news_.lines_over - over_at_start_ + refused_; }

    bool open_ = false;
    printer::gcode::Parser parser_;
    printer::gcode::HostSession host_;
    HeldLines input_;           // behind the line in hand
    bool lacks_lines_ = false;  // dropped, and not sent again yet
    std::string output_;
    std::vector<HostLine> lines_;
    PrinterNews news_;
    std::uint64_t over_at_start_ = 0;
    std::uint64_t sent_ = 0;
    std::uint64_t refused_ = 0;
    std::optional<Awaited> awaited_;
    Nanoseconds report_every_{0};  // M155; 0: not
    Nanoseconds busy_every_ = std::chrono::seconds{2};
    Instant reported_{};
    Instant busy_said_{};
};

}  // namespace qduino::apps
