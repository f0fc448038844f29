#include "apps/picture/strip.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

#include "apps/picture/ticks.h"
#include "apps/terminal/human.h"
#include "base/text.h"

namespace qduino::apps::picture {
namespace {

constexpr int kStrip = 66;        // columns of time
constexpr int kBars = 36;         // columns of a period
constexpr int kNameColumns = 10;  // "  loop 12 "

struct Alphabet {
    std::array<std::string_view, 9> runs;  // from none to all of a column
    std::string_view waits, throttled, missed;
    std::string_view budget, response, rest, period, over;
};
constexpr Alphabet kBlocks{
    {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"}, "·", "░", "!", "█", "▒", "·", "│", "!"};
constexpr Alphabet kAscii{
    {" ", "_", "_", "o", "o", "o", "O", "O", "#"}, ".", "x", "!", "#", "=", ".", "|", "!"};

std::string name_column(std::string_view name) {
    return column(text<std::string>("  ", name), -kNameColumns);
}

/// Columns in which a deadline was missed.
std::vector<bool> missed_in(const Schedule& schedule, const Row& row) {
    std::vector<bool> missed(kStrip, false);
    for (const Release& release : row.releases) {
        if (release.met.value_or(true) || !release.due) continue;
        if (*release.due <= schedule.from || *release.due > schedule.until) continue;
        const double share = share_of(schedule, *release.due, *release.due).from;
        missed[std::min<std::size_t>(static_cast<std::size_t>(share * kStrip), kStrip - 1)] = true;
    }
    return missed;
}

std::string row_line(const Schedule& schedule, const Row& row, const Alphabet& signs) {
    const std::vector<double> runs = filled(schedule, row, Doing::runs, kStrip);
    const std::vector<double> throttled = filled(schedule, row, Doing::throttled, kStrip);
    const std::vector<double> waits = filled(schedule, row, Doing::waits, kStrip);
    const std::vector<bool> missed = missed_in(schedule, row);
    std::string line = name_column(row.name);
    for (std::size_t i = 0; i < kStrip; ++i) {
        // Whatever ran is seen, however short.
        const auto level =
            static_cast<std::size_t>(std::clamp(runs[i] * 8 + (runs[i] > 1e-9 ? 0.999 : 0.5), 0.0, 8.0));
        line += missed[i]                                                      ? signs.missed
                : runs[i] >= std::max(throttled[i], waits[i]) || runs[i] > 0.5 ? signs.runs[level]
                : throttled[i] > waits[i]                                      ? signs.throttled
                                                                               : signs.waits;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    return line + '\n';
}

/// Marks below the strips, each label from its mark's column on.
std::string axis_line(const Schedule& schedule) {
    const Nanoseconds step = tick_step(schedule.until - schedule.from, 7);
    std::string line(kNameColumns, ' ');
    for (const Instant at : ticks(schedule.from, schedule.until, step)) {
        const double share = share_of(schedule, at, at).from;
        const auto place = static_cast<std::size_t>(kNameColumns + share * kStrip);
        const std::string label = "|" + tick_label(at, step);
        if (place + label.size() > 79 || place < line.size()) continue;
        line.resize(place, ' ');
        line += label;
    }
    return line + '\n';
}

std::string key_line(Signs which) {
    return which == Signs::blocks
               ? "  █ runs   ░ throttled: its budget is spent   · waits   ! misses its deadline\n"
               : "  # runs   x throttled: its budget is spent   . waits   ! misses its deadline\n";
}

std::string response_line(const Response& response, const Alphabet& signs) {
    std::string line = name_column(response.name);
    const double period = to_seconds(response.period);
    const bool late = !response.worst || *response.worst > response.period;
    const auto columns = [&](Nanoseconds t) {
        return std::clamp(static_cast<int>(to_seconds(t) / period * kBars + 0.5), 1, kBars);
    };
    const int budget = columns(response.budget), worst = late ? kBars : columns(*response.worst);
    for (int i = 0; i < kBars; ++i)
        line += i < budget ? signs.budget : i < worst ? signs.response : signs.rest;
    line += late ? signs.over : signs.period;
    if (!response.worst) return line + " R never ends, T " + human_duration(response.period) + '\n';
    write(line, " R ", human_duration(*response.worst), late ? " > T " : " of T ",
          human_duration(response.period));
    if (response.seen) write(line, ", seen ", human_duration(*response.seen));
    return line + '\n';
}

}  // namespace

Signs signs_of_terminal() {
    for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
        const char* const value = std::getenv(name);
        if (!value || !*value) continue;
        std::string locale = value;
        std::ranges::transform(locale, locale.begin(),
                               [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        const bool utf8 =
            locale.find("utf-8") != std::string::npos || locale.find("utf8") != std::string::npos;
        return utf8 ? Signs::blocks : Signs::ascii;
    }
    return Signs::ascii;
}

std::string strip(const Schedule& schedule, Signs signs) {
    const std::size_t rows = row_count(schedule);
    if (rows == 0 || rows > kStripRows) return {};
    const Alphabet& alphabet = signs == Signs::blocks ? kBlocks : kAscii;
    std::string out;
    for (const Core& core : schedule.cores) {
        if (core.rows.empty()) continue;
        write(out, "core ", core.number, '\n');
        for (const Row& row : core.rows) out += row_line(schedule, row, alphabet);
    }
    out += axis_line(schedule) + key_line(signs);
    if (schedule.responses.empty()) return out;
    out += signs == Signs::blocks ? "\nC █, R ▒, of one period T:\n" : "\nC #, R =, of one period T:\n";
    for (const Response& response : schedule.responses) out += response_line(response, alphabet);
    return out;
}

}  // namespace qduino::apps::picture
