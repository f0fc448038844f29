#include "serial/serial_session.h"

#include <algorithm>
#include <array>

#include "base/text.h"
#include "printer/gcode/command_table.h"

namespace qduino::apps {

using namespace printer;
using gcode::Command;
using gcode::Ok;

namespace {

/// While heat is waited for, hosts expect the temperatures this often, as from Marlin.
constexpr Nanoseconds kHeatEvery = 1s;
/// M113 and M155 take whole seconds, this many at most: Marlin's bytes.
constexpr double kEveryMax_s = 255;

bool is_m(const Command& command, std::uint32_t number) {
    return command.letter == 'M' && command.number == number && !command.subcode;
}

bool waits_for_heat(const Command& command) {
    constexpr std::array<std::uint32_t, 3> kWaits{109, 116, 190};
    return std::ranges::any_of(kWaits, [&](std::uint32_t number) { return is_m(command, number); });
}

/// S in seconds; `otherwise` when it is not given, or is no sensible number.
Nanoseconds every(const Command& command, Nanoseconds otherwise) {
    const auto given = command.parameters.value('S');
    return given && *given >= 0 && *given <= kEveryMax_s ? from_seconds(*given) : otherwise;
}

}  // namespace

void SerialSession::open() {
    close();
    input_.begin();
    greet();
}

void SerialSession::greet() {
    open_ = true;
    say("start");
}

void SerialSession::close() {
    open_ = false;
    parser_ = {};
    host_ = {};
    input_.drop();
    lacks_lines_ = false;
    output_.clear();
    awaited_.reset();
    report_every_ = Nanoseconds{0};
    busy_every_ = 2s;
}

void SerialSession::say(std::string_view line) {
    if (!open_ || output_.size() + line.size() >= kOutputMax) return;
    output_.append(line).push_back('\n');
}

// ---- lines --------------------------------------------------------------------------------------

void SerialSession::take(std::span<const char> bytes, Instant now) {
    input_.append(bytes);
    advance(now);
}

void SerialSession::advance(Instant now) {
    std::span<const char> rest = input_.bytes();
    bool asks_again = false;
    while (!asks_again && !rest.empty() && !awaited_ && under_way() < link::kHostLinesMax) {
        const gcode::Line* line = parser_.next(rest);
        if (line == nullptr) break;
        const gcode::HostVerdict verdict = judge(*line);
        asks_again = !verdict.accepted;
        if (asks_again) {
            say(verdict.reply.view());
        } else {
            carry_out(*line, now);
        }
    }
    input_.take(input_.size() - rest.size());
    if (asks_again) input_.drop();
}

gcode::HostVerdict SerialSession::judge(const gcode::Line& line) {
    if (line.text.find(HeldLines::kGap) != std::string_view::npos) {
        lacks_lines_ = true;
        return host_.ask_again("lines did not fit, and were dropped");
    }
    gcode::HostVerdict verdict = host_.accept(line);
    const bool begins_anew = line.command != nullptr && is_m(*line.command, 110);
    if (verdict.accepted && (line.frame.number || begins_anew)) lacks_lines_ = false;
    return verdict;
}

void SerialSession::carry_out(const gcode::Line& line, Instant now) {
    if (line.error) {
        say(text<std::string>("Error:", line.error->message));
        return say("ok");
    }
    if (line.command == nullptr) {
        if (line.frame.number) say("ok");  // Marlin answers no empty line, but it counts this one
        return;
    }
    // Without its frame such a line would be read as a numbered one.
    if (line.command->letter == 'N') {
        say("Error:two line numbers");
        return say("ok");
    }
    if (!answer(*line.command, now)) forward(line, now);
}

/// True: the line is not the printer's.
bool SerialSession::answer(const Command& command, Instant now) {
    if (is_m(command, 105)) {
        say(text<std::string>("ok ", news_.temperatures));
        return true;
    }
    if (is_m(command, 113)) busy_every_ = every(command, busy_every_);
    if (is_m(command, 155)) {
        report_every_ = every(command, report_every_);
        reported_ = now;
    }
    constexpr std::array<std::uint32_t, 6> kHere{108, 110, 112, 113, 155, 410};
    const bool here = std::ranges::any_of(kHere, [&](std::uint32_t number) { return is_m(command, number); });
    if (here) say("ok");
    return here;
}

void SerialSession::forward(const gcode::Line& line, Instant now) {
    if (!news_.connected) {
        say("Error:the printer's program does not run");
        return say("ok");
    }
    const bool claims = gcode::takes_the_printer(*line.command);
    if (lacks_lines_ && claims) {
        say("Error:lines before this one were dropped: send them again with numbers, or begin anew with "
            "M110");
        return say("ok");
    }
    lines_.push_back({std::string{line.code}, claims});
    ++sent_;
    if (gcode::ok_of(*line.command) == Ok::at_once) return say("ok");
    awaited_ = Awaited{waits_for_heat(*line.command)};
    reported_ = busy_said_ = now;
}

void SerialSession::send_at_once(std::string_view line) {
    const auto is_it = [line](const HostLine& waiting) { return waiting.text == line; };
    if (!news_.connected || std::ranges::any_of(lines_, is_it)) return;
    lines_.insert(lines_.begin(), {std::string{line}, false});
    ++sent_;
}

// ---- what the printer says ----------------------------------------------------------------------

void SerialSession::hear(link::ReplyKind kind, std::string_view words) {
    const std::string_view prefix = kind == link::ReplyKind::host_error     ? "Error:"
                                    : kind == link::ReplyKind::host_warning ? "echo:"
                                                                            : "";
    say(text<std::string>(prefix, words));
}

void SerialSession::refuse(const Error& why) {
    ++refused_;
    say(text<std::string>("Error:", why.message));
    settle();
}

void SerialSession::settle() {
    if (!awaited_ || under_way() != 0) return;
    awaited_.reset();
    say("ok");
}

void SerialSession::learn(const PrinterNews& news, Instant now) {
    if (!news.connected) return lose_printer(now);
    const bool anew = !news_.connected || news.session != news_.session;
    const bool restarted = anew && news_.session != 0;
    if (!news.fault.empty() && news.fault != news_.fault)
        say(text<std::string>("Error:Printer halted. ", news.fault));
    news_ = news;
    if (anew) {
        over_at_start_ = news.lines_over;
        forget_lines();
    }
    if (restarted && open_) {
        close();
        greet();
    }
    settle();
    advance(now);
}

void SerialSession::lose_printer(Instant now) {
    if (!std::exchange(news_.connected, false)) return;
    say("Error:the printer's program has ended");
    forget_lines();
    settle();
    advance(now);
}

/// None is under way any more.
void SerialSession::forget_lines() {
    lines_.clear();
    refused_ = 0;
    sent_ = over();
}

void SerialSession::tick(Instant now) {
    const Nanoseconds report_every = awaited_ && awaited_->heats ? kHeatEvery : report_every_;
    if (report_every > Nanoseconds{0} && now - reported_ >= report_every) {
        reported_ = now;
        say(text<std::string>(' ', news_.temperatures));
    }
    if (awaited_ && busy_every_ > Nanoseconds{0} && now - busy_said_ >= busy_every_) {
        busy_said_ = now;
        say("echo:busy: processing");
    }
}

}  // namespace qduino::apps
