#include "board/guarantee_text.h"

#include <array>
#include <cstdio>
#include <string_view>

namespace qduino::board {
namespace {

constexpr std::size_t kColumns = 80;

template <typename... Arguments>
std::string format(const char* pattern, Arguments... arguments) {
    std::array<char, 256> line{};
    std::snprintf(line.data(), line.size(), pattern, arguments...);
    return line.data();
}

/// "30 ms", "1.5 s", "100 us": up to three decimals of the largest unit that fits.
std::string duration(Nanoseconds d) {
    if (d >= 1s) return format("%.4g s", to_seconds(d));
    if (d >= 1ms) return format("%.4g ms", to_seconds(d) * 1e3);
    if (d >= 1us) return format("%.4g us", to_seconds(d) * 1e6);
    return format("%lld ns", static_cast<long long>(d.count()));
}

/// `text` in lines of at most kColumns, the first after `first`, the others indented as far.
std::string wrapped(std::string_view first, std::string_view text) {
    std::string out{first};
    std::size_t column = first.size();
    while (!text.empty()) {
        const std::size_t space = text.find(' ');
        const std::string_view word = text.substr(0, space);
        text = space == std::string_view::npos ? std::string_view{} : text.substr(space + 1);
        if (column > first.size() && column + 1 + word.size() > kColumns) {
            out += '\n' + std::string(first.size(), ' ');
            column = first.size();
        } else if (column > first.size()) {
            out += ' ';
            ++column;
        }
        out += word;
        column += word.size();
    }
    return out + '\n';
}

std::string loop_text(const LoopGuarantee& loop) {
    const bool whole = loop.budget == loop.period;
    std::string text = format("  %4d  %4d  %-22s  %-8s  %-8s  %s\n", static_cast<int>(loop.id), loop.core,
                              (duration(loop.budget) + " / " + duration(loop.period)).c_str(),
                              loop.priority_enforced ? "enforced" : "NO",
                              whole                  ? "never"
                              : loop.budget_enforced ? "enforced"
                                                     : "NO",
                              loop.core_owned ? "OWNED"
                              : whole         ? "not owned"
                                              : "shared");
    if (!loop.shortfall.empty()) text += wrapped("        ! ", loop.shortfall.view());
    return text;
}

std::string core_text(const CoreGuarantee& core) {
    std::string facts;
    if (core.interrupts_per_second >= 0)
        facts += format("%.0f interrupts/s left, ", core.interrupts_per_second);
    if (core.worst_gap >= Nanoseconds{0}) {
        facts += "worst gap of a bare spin " + duration(core.worst_gap) + ", ";
    }
    facts += core.tick_stopped ? "no tick" : "tick on";
    if (core.throttling_lifted) facts += ", RT throttling lifted";
    std::string text = wrapped(format("  core %d: ", core.core), facts);
    if (!core.note.empty()) text += wrapped("        - ", core.note.view());
    return text;
}

/// A JSON string, quotes included.
std::string quoted(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (byte < 0x20) {
            out += format("\\u%04x", byte);
        } else {
            out += c;
        }
    }
    return out + '"';
}

std::string microseconds(Nanoseconds d) { return format("%.10g", to_seconds(d) * 1e6); }

const char* boolean(bool value) { return value ? "true" : "false"; }

}  // namespace

std::string guarantee_text(const GuaranteeReport& report) {
    std::string text = "guarantee: " + std::string{report.board.view()} +
                       (report.simulated       ? ""
                        : report.memory_locked ? "; memory locked"
                                               : "; memory NOT locked") +
                       "\n";
    text += "  loop  core  budget / period         priority  budget    core\n";
    for (const LoopGuarantee& loop : report.loops) text += loop_text(loop);
    for (const CoreGuarantee& core : report.cores) text += core_text(core);
    return text;
}

std::string guarantee_json(const GuaranteeReport& report) {
    std::string json = "{\"board\":" + quoted(report.board) + ",\"simulated\":" + boolean(report.simulated) +
                       ",\"memory_locked\":" + boolean(report.memory_locked) + ",\"loops\":[";
    const char* separator = "";
    for (const LoopGuarantee& loop : report.loops) {
        json +=
            separator + format("{\"id\":%d,\"core\":%d", static_cast<int>(loop.id), loop.core) +
            ",\"budget_us\":" + microseconds(loop.budget) + ",\"period_us\":" + microseconds(loop.period) +
            ",\"priority_enforced\":" + boolean(loop.priority_enforced) +
            ",\"budget_enforced\":" + boolean(loop.budget_enforced) +
            ",\"core_owned\":" + boolean(loop.core_owned) + ",\"shortfall\":" + quoted(loop.shortfall) + "}";
        separator = ",";
    }
    json += "],\"cores\":[";
    separator = "";
    for (const CoreGuarantee& core : report.cores) {
        json +=
            separator + format("{\"core\":%d,\"interrupts_per_second\":", core.core) +
            (core.interrupts_per_second < 0 ? "null" : format("%.6g", core.interrupts_per_second)) +
            ",\"worst_gap_us\":" + (core.worst_gap < Nanoseconds{0} ? "null" : microseconds(core.worst_gap)) +
            ",\"tick_stopped\":" + boolean(core.tick_stopped) +
            ",\"throttling_lifted\":" + boolean(core.throttling_lifted) + ",\"note\":" + quoted(core.note) +
            "}";
        separator = ",";
    }
    return json + "]}";
}

}  // namespace qduino::board
