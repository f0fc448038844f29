#include "report/picture/strip.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

#include "base/text.h"
#include "report/picture/ticks.h"
#include "terminal/colour.h"
#include "terminal/human.h"

namespace qduino::apps::picture {
namespace {

constexpr int kStrip = 66;        // columns of time
constexpr int kBars = 36;         // columns of a period
constexpr int kNameColumns = 10;  // "  loop 12 "

struct Alphabet {
    std::array<std::string_view, 9> runs;  // from none to all of a column
    std::string_view waits, throttled, missed;
    std::string_view budget, response, rest, period, over;
    std::string_view high, low, both;  // of a pin
};
constexpr Alphabet kBlocks{
    {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"}, "·", "░", "!", "█", "▒", "·", "│", "!", "▔", "▁", "▒"};
constexpr Alphabet kAscii{
    {" ", "_", "_", "o", "o", "o", "O", "O", "#"}, ".", "x", "!", "#", "=", ".", "|", "!", "-", "_", "#"};

/// A sign of a line, and what it is about.
struct Sign {
    std::string_view sign;
    Tone tone = Tone::plain;
};

/// `signs` behind `begin`, each stretch of one tone painted at once; without blanks at the end.
std::string line_of(std::string begin, std::vector<Sign> signs, bool colours) {
    while (!signs.empty() && signs.back().sign == " ") signs.pop_back();
    for (std::size_t i = 0; i < signs.size();) {
        std::string stretch;
        const Tone tone = signs[i].tone;
        for (; i < signs.size() && signs[i].tone == tone; ++i) stretch += signs[i].sign;
        begin += painted(stretch, tone, colours);
    }
    begin.erase(begin.find_last_not_of(' ') + 1);
    return begin + '\n';
}

Tone tone_of(const Row& row) { return row.is_io() ? Tone::io : Tone::loop; }

std::string name_column(std::string_view name, Tone tone = Tone::plain, bool colours = false) {
    const std::string padded = column(text<std::string>("  ", name), -kNameColumns);
    return colours ? painted(padded, tone, colours) : padded;
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

std::string row_line(const Schedule& schedule, const Row& row, const Alphabet& signs, bool colours) {
    const std::vector<double> runs = filled(schedule, row, Doing::runs, kStrip);
    const std::vector<double> throttled = filled(schedule, row, Doing::throttled, kStrip);
    const std::vector<double> waits = filled(schedule, row, Doing::waits, kStrip);
    const std::vector<bool> missed = missed_in(schedule, row);
    std::vector<Sign> line;
    for (std::size_t i = 0; i < kStrip; ++i) {
        // Whatever ran is seen, however short.
        const auto level =
            static_cast<std::size_t>(std::clamp(runs[i] * 8 + (runs[i] > 1e-9 ? 0.999 : 0.5), 0.0, 8.0));
        if (missed[i]) {
            line.push_back({signs.missed, Tone::bad});
        } else if (runs[i] >= std::max(throttled[i], waits[i]) || runs[i] > 0.5) {
            line.push_back({signs.runs[level], tone_of(row)});
        } else if (throttled[i] > waits[i]) {
            line.push_back({signs.throttled, Tone::throttled});
        } else {
            line.push_back({signs.waits});
        }
    }
    return line_of(name_column(row.name, tone_of(row), colours), std::move(line), colours);
}

/// A column of a pin: the parts of it that are high, low, and driven at all; how often it changes.
struct PinColumn {
    double high = 0, driven = 0;
    int stretches = 0;
    bool varies = false;  // PWM
};

std::vector<PinColumn> columns_of_pin(const Schedule& window, const PinRow& pin) {
    std::vector<PinColumn> columns(kStrip);
    for (const PinStretch& stretch : pin.stretches) {
        const Share part = share_of(window, stretch.from, stretch.until);
        const double from = part.from * kStrip, until = part.until * kStrip;
        for (auto i = static_cast<std::size_t>(from); i < columns.size(); ++i) {
            const auto begin = static_cast<double>(i);
            // A pulse that took no time is in the column where it stands.
            if (begin >= until && stretch.from != stretch.until) break;
            const double share = std::max(std::min(until, begin + 1) - std::max(from, begin), 0.0);
            columns[i].driven += share;
            columns[i].high += share * static_cast<double>(stretch.height);
            ++columns[i].stretches;
            columns[i].varies |= stretch.height > 0 && stretch.height < 1;
            if (stretch.from == stretch.until) break;
        }
    }
    return columns;
}

std::string pin_line(const Schedule& window, const PinRow& pin, const Alphabet& signs) {
    std::vector<Sign> line;
    for (const PinColumn& column : columns_of_pin(window, pin)) {
        const double high = column.driven > 0 ? column.high / column.driven : 0;
        const auto level = static_cast<std::size_t>(std::clamp(high * 8 + 0.5, 1.0, 8.0));
        line.push_back({column.stretches == 0  ? " "
                        : column.varies        ? signs.runs[level]
                        : column.stretches > 2 ? signs.both
                        : high >= 0.5          ? signs.high
                                               : signs.low});
    }
    return line_of(name_column(pin.name), std::move(line), false);
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

std::string pins_key(Signs which) {
    return which == Signs::blocks
               ? "  ▔ high   ▁ low   ▒ both, too quick to draw   ▄ PWM, as high as its duty\n"
               : "  - high   _ low   # both, too quick to draw   o PWM, as high as its duty\n";
}

std::string pin_lines(const Schedule& schedule, const Alphabet& signs) {
    const Schedule window = window_of_pins(schedule);
    std::string out = "pins\n";
    const std::size_t shown = std::min(schedule.pins.size(), kStripRows);
    for (std::size_t i = 0; i < shown; ++i) out += pin_line(window, schedule.pins[i], signs);
    if (schedule.pins.size() > shown) write(out, "  and ", schedule.pins.size() - shown, " more\n");
    return out;
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

std::string strip(const Schedule& schedule, Signs signs, bool colours) {
    const std::size_t rows = row_count(schedule);
    const bool has_rows = rows > 0 && rows <= kStripRows, has_pins = !schedule.pins.empty();
    const Alphabet& alphabet = signs == Signs::blocks ? kBlocks : kAscii;
    std::string out;
    for (const Core& core : schedule.cores) {
        if (core.rows.empty() || !has_rows) continue;
        write(out, "core ", core.number, '\n');
        for (const Row& row : core.rows) out += row_line(schedule, row, alphabet, colours);
    }
    // One axis for both, where they have one window.
    const bool one_axis = has_rows && has_pins && schedule.pins_until == schedule.until;
    if (has_rows && !one_axis) out += axis_line(schedule) + key_line(signs) + (has_pins ? "\n" : "");
    if (has_pins) out += pin_lines(schedule, alphabet) + axis_line(window_of_pins(schedule));
    if (one_axis) out += key_line(signs);
    if (has_pins) out += pins_key(signs);
    if (!has_rows || schedule.responses.empty()) return out;
    out += signs == Signs::blocks ? "\nC █, R ▒, of one period T:\n" : "\nC #, R =, of one period T:\n";
    for (const Response& response : schedule.responses) out += response_line(response, alphabet);
    return out;
}

}  // namespace qduino::apps::picture
