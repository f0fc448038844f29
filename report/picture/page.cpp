#include "report/picture/page.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "base/text.h"
#include "base/words.h"
#include "report/picture/svg.h"
#include "report/picture/ticks.h"
#include "terminal/human.h"

namespace qduino::apps::picture {
namespace {

constexpr int kWidth = 1200;
constexpr double kLeft = 176, kPlot = kWidth - kLeft - 84;
constexpr double kMargin = 24;
constexpr double kAxis = 34;  // with its labels
constexpr double kPinRow = 26, kWave = 14;
// So many pins get a row.
constexpr std::size_t kPins = 24;
constexpr double kRow = 38, kBarTop = 11, kBar = 18, kTakenRow = 24, kCoreHead = 30;
constexpr double kResponseRow = 25, kResponseHead = 54;
// R is drawn up to so many periods.
constexpr double kResponsePlot = 700, kShown = 1.25;
// So many stretches, of all rows, are drawn one by one.
constexpr std::size_t kShapes = 6000;
// The most releases of a row that are drawn with arrows, and with marks.
constexpr std::size_t kHeads = 60, kMarks = 1200;

constexpr std::string_view kStyle =
    "text{font-family:'Helvetica Neue',Arial,'DejaVu Sans',sans-serif;font-size:12px;fill:#333}"
    ".page{fill:#fff}.title{font-size:19px;font-weight:600;fill:#111}.head{font-size:14px;font-weight:600;"
    "fill:#111}"
    ".name{font-size:13px;font-weight:600;text-anchor:end;fill:#111}.small{font-size:11px;text-anchor:end;"
    "fill:#666}"
    ".tick{font-size:11px;text-anchor:middle;fill:#666}.part{font-size:11px;fill:#666}.late{fill:#b34700;"
    "font-weight:600}"
    ".grid{stroke:#e4e4e4}.base{stroke:#bbb}.axis{stroke:#777}"
    ".runs{fill:#a6cfe8;stroke:#0072b2;stroke-width:.4}.io .runs{fill:#a9dfd0;stroke:#009e73}"
    ".left{fill:#0072b2}.io .left{fill:#009e73}.whole{fill:#0072b2;stroke:#0072b2;stroke-width:.4}"
    ".io .whole{fill:#009e73;stroke:#009e73}"
    ".waits{fill:#ddd}.throttled{fill:url(#hatch);stroke:#e69f00;stroke-width:.8}"
    ".taken{fill:#cc79a7;stroke:#cc79a7;stroke-width:.6}"
    ".release{stroke:#444;stroke-width:1}.tip{fill:#444}.met{fill:#fff;stroke:#009e73;stroke-width:1.3}"
    ".missed{fill:none;stroke:#d55e00;stroke-width:2.4}"
    ".track{fill:#f3f3f3;stroke:#ccc}.c{fill:#0072b2}.r{fill:#a6cfe8}.over{fill:#f0b48a}"
    ".period{stroke:#111;stroke-width:2}.seen{fill:#111;stroke:#fff;stroke-width:1}"
    ".hatch-page{fill:#fdf1d8}.wave{fill:none;stroke:#222;stroke-width:1.4}.high,.hatched{fill:#e3ebf2}."
    "hatch{fill:#e69f00}"
    "@media (prefers-color-scheme:dark){text{fill:#c9ced6}.page{fill:#14171c}.title,.head,.name{fill:#f2f4f7}"
    ".small,.tick,.part{fill:#9aa3af}.late{fill:#ff9a4d}.grid{stroke:#262b33}.base{stroke:#4a515c}"
    ".axis{stroke:#7d8590}.runs{fill:#1d4a68;stroke:#56b4e9}.io .runs{fill:#14493b;stroke:#2fc79c}"
    ".left,.c{fill:#56b4e9}.io .left{fill:#2fc79c}.whole{fill:#56b4e9;stroke:#56b4e9}"
    ".io .whole{fill:#2fc79c;stroke:#2fc79c}.waits{fill:#3a404a}.hatch-page{fill:#33270c}"
    ".release{stroke:#aab2bd}.tip{fill:#aab2bd}.met{fill:#14171c;stroke:#2fc79c}.missed{stroke:#ff7a33}"
    ".track{fill:#1c2027;stroke:#3a404a}.r{fill:#1d4a68}.over{fill:#7a3f14}.period{stroke:#f2f4f7}"
    ".seen{fill:#f2f4f7;stroke:#14171c}.wave{stroke:#e3e7ec}.high,.hatched{fill:#242c36}}";

constexpr std::string_view kDefinitions =
    "<pattern id=\"hatch\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" "
    "patternTransform=\"rotate(45)\">"
    "<rect class=\"hatch-page\" width=\"6\" height=\"6\"/><rect class=\"hatch\" width=\"2.4\" "
    "height=\"6\"/></pattern>";

constexpr Words<Doing::runs, Doing::throttled> kKinds{"runs", "waits", "throttled"};

std::string exact(Nanoseconds duration) { return text<std::string>(duration); }

std::string percent(double share) {
    return text<std::string>(Fixed{share * 100, share > 0 && share < 0.0995 ? 1 : 0}, " %");
}

/// The lines of `words`, each of at most `columns` characters, broken at spaces.
std::vector<std::string> lines_of(std::string_view words, std::size_t columns) {
    std::vector<std::string> lines;
    while (!words.empty()) {
        std::size_t end = words.size();
        if (end > columns) {
            end = words.rfind(' ', columns);
            if (end == std::string_view::npos || end == 0) end = columns;
        }
        lines.emplace_back(words.substr(0, end));
        words.remove_prefix(std::min(words.size(), end + 1));
    }
    return lines;
}

double promised(const Core& core) {
    double sum = 0;
    for (const Row& row : core.rows) {
        if (row.period > Nanoseconds{0}) sum += to_seconds(row.budget) / to_seconds(row.period);
    }
    return sum;
}

double part_that_runs(const Schedule& schedule, const Row& row) {
    double sum = 0;
    for (const Stretch& stretch : row.stretches) {
        if (stretch.doing != Doing::runs) continue;
        const Share share = share_of(schedule, stretch.from, stretch.until);
        sum += share.until - share.from;
    }
    return sum;
}

/// What is promised of a core's time, and what became of it within the window.
std::string load_of(const Schedule& schedule, const Core& core) {
    double used = 0, taken = 0;
    for (const Row& row : core.rows) used += part_that_runs(schedule, row);
    for (const Taken& t : core.taken) {
        const Share share = share_of(schedule, t.from, t.until);
        taken += share.until - share.from;
    }
    std::string load = core.rows.empty() ? "no loops" : percent(used) + " used here";
    if (promised(core) > 0) load = percent(promised(core)) + " promised, " + load;
    if (taken > 0) load += ", " + percent(taken) + " taken by interrupts and switches";
    return load;
}

/// What there is to explain.
struct Seen {
    bool budgets = false;    ///< of a stretch
    bool deadlines = false;  ///< of a release
};
Seen seen_in(const Schedule& schedule) {
    Seen seen;
    for (const Core& core : schedule.cores) {
        for (const Row& row : core.rows) {
            seen.budgets |= std::ranges::any_of(
                row.stretches, [](const Stretch& s) { return s.left_from >= Nanoseconds{0}; });
            seen.deadlines |=
                std::ranges::any_of(row.releases, [](const Release& r) { return r.due.has_value(); });
        }
    }
    return seen;
}

/// The pins' window is the cores', so they stand on the same axis.
bool shares_axis(const Schedule& schedule) {
    return !schedule.cores.empty() && schedule.pins_until == schedule.until;
}

double height_of_pins(const Schedule& schedule) {
    const auto rows = static_cast<double>(std::min(schedule.pins.size(), kPins));
    return kCoreHead + kPinRow * rows + (schedule.pins.size() > kPins ? 18 : 0) + 8;
}

double height_of(const Schedule& schedule, std::size_t remark_lines) {
    double height = 40 + 17.0 * static_cast<double>(remark_lines) + 40;
    for (const Core& core : schedule.cores) {
        height += kCoreHead + (core.taken.empty() ? 0 : kTakenRow) +
                  kRow * static_cast<double>(core.rows.size()) + 8;
    }
    height += kAxis;
    if (!schedule.pins.empty()) height += height_of_pins(schedule);
    if (!schedule.pins.empty() && !schedule.cores.empty() && !shares_axis(schedule)) height += kAxis;
    if (!schedule.responses.empty())
        height += kResponseHead + kResponseRow * static_cast<double>(schedule.responses.size()) + 16;
    return height;
}

std::string root_attributes(const Schedule& schedule) {
    return text<std::string>("data-from-ns=\"", to_ns(schedule.from), "\" data-until-ns=\"",
                             to_ns(schedule.until), "\" data-x=\"", Svg::point(kLeft), "\" data-width=\"",
                             Svg::point(kPlot), '"');
}

class Page {
  public:
    Page(const Schedule& schedule, std::vector<std::string> remark)
        : schedule_(schedule),
          remark_(std::move(remark)),
          svg_(kWidth, static_cast<int>(height_of(schedule, remark_.size())), kStyle, kDefinitions,
               root_attributes(schedule)) {
        const std::size_t rows = std::max<std::size_t>(row_count(schedule) + schedule.cores.size(), 1);
        shapes_ = std::max<std::size_t>(kShapes / rows, 100);
    }

    std::string draw() {
        head();
        const double top = y_ - 4;
        const bool has_pins = !schedule_.pins.empty(), one_axis = has_pins && shares_axis(schedule_);
        if (!schedule_.cores.empty()) {
            double bottom = y_ + (one_axis ? height_of_pins(schedule_) : 0);
            for (const Core& core : schedule_.cores) bottom += height_of_core(core);
            axis(schedule_, top, bottom);
            for (const Core& core : schedule_.cores) draw(core);
            if (one_axis) draw_pins();
            y_ += kAxis;
        }
        if (has_pins && !one_axis) {
            axis(window_of_pins(schedule_), y_, y_ + height_of_pins(schedule_));
            draw_pins();
            y_ += kAxis;
        }
        if (!schedule_.responses.empty()) responses();
        return svg_.finish();
    }

  private:
    [[nodiscard]] double x(double share) const { return kLeft + share * kPlot; }
    [[nodiscard]] double x(Instant t) const { return x(share_of(schedule_, t, t).from); }

    void head() {
        svg_.words("title", kMargin, 32, shortened(schedule_.title, 100));
        y_ = 40;
        for (const std::string& line : remark_) svg_.words("remark", kMargin, y_ += 17, line);
        y_ += 26;
        if (!schedule_.cores.empty()) legend();
        y_ += 14;
    }

    /// `words` behind a sample that was drawn up to `x`; returns where the next sample begins.
    double label(double x, std::string_view words) {
        svg_.words("part", x + 6, y_, words);
        return x + 6 + 6.1 * static_cast<double>(words.size()) + 20;
    }

    /// A sample of a bar, with its words.
    double sample(std::string_view kind, double x, std::string_view words) {
        svg_.rectangle(kind, x, y_ - 10, 26, 12);
        return label(x + 26, words);
    }

    void legend() {
        const Seen seen = seen_in(schedule_);
        double x = kMargin;
        if (seen.budgets) {
            svg_.rectangle("runs", x, y_ - 10, 26, 12);
            svg_.path("left", wedge(x, 26, y_ - 10, 12, 1, 0.3));
            x = label(x + 26, "runs (dark: budget left)");
        } else {
            x = sample("whole", x, "runs");
        }
        x = sample("waits", x, "waits for the core");
        x = sample("throttled", x, "throttled: budget spent");
        x = sample("taken", x, "interrupts, switches");
        release(x + 4, y_ - 11, 14, true);
        x = label(x + 8, seen.deadlines ? "release" : "wake-up");
        if (!seen.deadlines) return;
        svg_.path("met", met(x + 4, y_ - 8));
        x = label(x + 10, "ended in time");
        svg_.path("missed", cross(x + 4, y_ - 4));
        label(x + 8, "deadline missed");
    }

    // ---- the cores ------------------------------------------------------------------------------

    static double height_of_core(const Core& core) {
        return kCoreHead + (core.taken.empty() ? 0 : kTakenRow) +
               kRow * static_cast<double>(core.rows.size()) + 8;
    }

    void axis(const Schedule& window, double top, double bottom) {
        const Nanoseconds step = tick_step(window.until - window.from, 13);
        for (const Instant at : ticks(window.from, window.until, step)) {
            const double place = x(share_of(window, at, at).from);
            svg_.line("grid", place, top, place, bottom);
            svg_.words("tick", place, bottom + 17, tick_label(at, step));
        }
        svg_.line("axis", kLeft, bottom, kLeft + kPlot, bottom);
    }

    void draw(const Core& core) {
        svg_.begin_group("core", text<std::string>("data-core=\"", core.number, '"'));
        svg_.words("head", kMargin, y_ + 19, text<std::string>("core ", core.number));
        svg_.words("part", kLeft, y_ + 19, load_of(schedule_, core));
        y_ += kCoreHead;
        if (!core.taken.empty()) draw_taken(core);
        for (const Row& row : core.rows) draw(row);
        y_ += 8;
        svg_.end_group();
    }

    // ---- the pins -------------------------------------------------------------------------------

    void draw_pins() {
        const Schedule window = window_of_pins(schedule_);
        svg_.words("head", kMargin, y_ + 19, "pins");
        svg_.words("part", kLeft, y_ + 19,
                   "what the board drives: high, low; grey as high as the duty of a PWM");
        y_ += kCoreHead;
        const std::size_t shown = std::min(schedule_.pins.size(), kPins);
        for (std::size_t i = 0; i < shown; ++i) draw(schedule_.pins[i], window);
        if (schedule_.pins.size() > shown) {
            svg_.words("part", kLeft, y_ + 12,
                       text<std::string>("and ", schedule_.pins.size() - shown, " more"));
            y_ += 18;
        }
        y_ += 8;
    }

    void draw(const PinRow& pin, const Schedule& window) {
        svg_.begin_group("pin", text<std::string>("data-pin=\"", escaped(pin.name), '"'),
                         pin.name + ": " + pin.remark);
        svg_.words("name", kLeft - 12, y_ + 15, shortened(pin.name, 20));
        const double bottom = y_ + 4 + kWave;
        if (pin.stretches.size() > shapes_) {
            Row high;
            for (const PinStretch& s : pin.stretches)
                if (s.height > 0.5F) high.stretches.push_back({Doing::runs, s.from, s.until});
            svg_.path("hatched", columns_of(filled(window, high, Doing::runs, kColumns), {}, y_ + 4, kWave));
            svg_.line("wave", kLeft, bottom, kLeft + kPlot, bottom);
        } else {
            draw_wave(pin, window, bottom);
        }
        svg_.end_group();
        y_ += kPinRow;
    }

    /// One line from level to level; what is high, or has a duty, is filled below.
    void draw_wave(const PinRow& pin, const Schedule& window, double bottom) {
        std::string d;
        std::optional<Instant> end;
        for (const PinStretch& stretch : pin.stretches) {
            const Share at = share_of(window, stretch.from, stretch.until);
            const double y = bottom - kWave * static_cast<double>(stretch.height);
            const bool goes_on = end == stretch.from;
            if (goes_on) {
                write(d, 'V', Svg::point(y));
            } else {
                write(d, 'M', Svg::point(x(at.from)), ' ', Svg::point(y));
            }
            write(d, 'H', Svg::point(x(at.until)));
            end = stretch.until;
            if (stretch.height > 0)
                svg_.rectangle("high", x(at.from), y, (at.until - at.from) * kPlot, bottom - y);
        }
        if (!d.empty()) svg_.path("wave", d);
    }

    // ---- the cores ------------------------------------------------------------------------------

    void draw_taken(const Core& core) {
        svg_.words("small", kLeft - 12, y_ + 13, "interrupts, switches");
        svg_.begin_group("interrupts");
        if (core.taken.size() > shapes_) {
            Row shares;
            for (const Taken& taken : core.taken)
                shares.stretches.push_back({Doing::runs, taken.from, taken.until});
            svg_.path("taken", columns_of(filled(schedule_, shares, Doing::runs, kColumns), {}, y_ + 4, 12));
        } else {
            for (const Taken& taken : core.taken) {
                const Share at = share_of(schedule_, taken.from, taken.until);
                svg_.rectangle("taken", x(at.from), y_ + 4, (at.until - at.from) * kPlot, 12,
                               text<std::string>(taken.what, " takes ", taken.until - taken.from, " at ",
                                                 taken.from - kEpoch));
            }
        }
        svg_.end_group();
        y_ += kTakenRow;
    }

    void draw(const Row& row) {
        svg_.begin_group(row.is_io() ? "vcpu io" : "vcpu",
                         text<std::string>("data-vcpu=\"", row.id, "\" data-core=\"", row.core, '"'));
        const double bar = y_ + kBarTop;
        svg_.words("name", kLeft - 12, bar + 7, shortened(row.name, 20));
        const std::string share = row.owns_core ? "owns the core"
                                  : row.period == Nanoseconds{0}
                                      ? std::string{}
                                      : exact(row.budget) + " in " + exact(row.period);
        svg_.words("small", kLeft - 12, bar + 21, shortened(share, 26));
        svg_.words("part", kLeft + kPlot + 10, bar + 13, percent(part_that_runs(schedule_, row)));
        svg_.line("base", kLeft, bar + kBar, kLeft + kPlot, bar + kBar);
        if (row.stretches.size() > shapes_) {
            draw_shares(row, bar);
        } else {
            for (const Stretch& stretch : row.stretches) draw(row, stretch, bar);
        }
        marks(row);
        svg_.end_group();
        y_ += kRow;
    }

    void draw(const Row& row, const Stretch& stretch, double bar) {
        const Share at = share_of(schedule_, stretch.from, stretch.until);
        const double width = (at.until - at.from) * kPlot;
        const bool thin = stretch.doing == Doing::waits;
        const bool known = stretch.doing == Doing::runs && row.budget > Nanoseconds{0} && !row.owns_core &&
                           stretch.left_from >= Nanoseconds{0};
        const std::string_view kind =
            stretch.doing == Doing::runs && !known ? "runs whole" : kKinds(stretch.doing);
        std::string title =
            text<std::string>(row.name, ' ', kKinds(stretch.doing), ' ', stretch.until - stretch.from, ": ",
                              stretch.from - kEpoch, " to ", stretch.until - kEpoch);
        if (known) write(title, "; budget left: ", stretch.left_from, ", then ", stretch.left_until);
        svg_.rectangle(kind, x(at.from), thin ? bar + kBar - 6 : bar, width, thin ? 6 : kBar, title);
        if (!known) return;
        const auto level = [&](Nanoseconds left) {
            return std::clamp(to_seconds(left) / to_seconds(row.budget), 0.0, 1.0);
        };
        // What came back meanwhile is drawn as if it had been there from the beginning.
        const Nanoseconds from =
            std::max(stretch.left_from, stretch.left_until + (stretch.until - stretch.from));
        svg_.path("left", wedge(x(at.from), width, bar, kBar, level(from), level(stretch.left_until)));
    }

    /// How much of each column it ran, was throttled above that, and waited above that.
    void draw_shares(const Row& row, double bar) {
        std::vector<double> below(kColumns, 0.0);
        for (const auto& [doing, kind] :
             {std::pair{Doing::runs, "runs whole"}, std::pair{Doing::throttled, "throttled"},
              std::pair{Doing::waits, "waits"}}) {
            const std::vector<double> share = filled(schedule_, row, doing, kColumns);
            const std::string d = columns_of(share, below, bar, kBar);
            if (!d.empty()) {
                svg_.path(text<std::string>("shares ", kind), d,
                          row.name + ": too many stretches to draw one by one; heights are shares of time");
            }
            for (std::size_t i = 0; i < below.size(); ++i) below[i] += share[i];
        }
    }

    void marks(const Row& row) {
        if (row.releases.size() <= kMarks) {
            for (const Release& r : row.releases) {
                if (r.at < schedule_.from) continue;
                release(x(r.at), y_ + 1, kBarTop + kBar - 1, row.releases.size() <= kHeads);
            }
        }
        std::size_t drawn = 0;
        for (const Release& r : row.releases) {
            if (!r.met || !r.due || *r.due <= schedule_.from || *r.due > schedule_.until) continue;
            if (!*r.met && ++drawn <= kMarks) svg_.path("missed", cross(x(*r.due), y_ + 5));
        }
        if (row.releases.size() > kHeads) return;
        for (const Release& r : row.releases) {
            if (!r.met.value_or(false) || !r.done || *r.done < schedule_.from || *r.done > schedule_.until)
                continue;
            svg_.path("met", met(x(*r.done), y_ + kBarTop + kBar + 1));
        }
    }

    void release(double x, double top, double height, bool with_head) {
        svg_.line("release", x, top, x, top + (with_head ? height : 6));
        if (with_head)
            svg_.path("tip",
                      text<std::string>('M', Svg::point(x - 3.5), ' ', Svg::point(top + 6), "l3.5-7 3.5 7z"));
    }

    /// Its tip is at the instant, below the row.
    static std::string met(double x, double top) {
        return text<std::string>('M', Svg::point(x), ' ', Svg::point(top), "l3 6h-6z");
    }
    static std::string cross(double x, double y) {
        return text<std::string>('M', Svg::point(x - 4), ' ', Svg::point(y - 4), "l8 8m0-8l-8 8");
    }
    /// A bar's lower part, from `left` to `right` of its height.
    static std::string wedge(double x, double width, double top, double height, double left, double right) {
        return text<std::string>('M', Svg::point(x), ' ', Svg::point(top + height), 'V',
                                 Svg::point(top + height * (1 - left)), 'L', Svg::point(x + width), ' ',
                                 Svg::point(top + height * (1 - right)), 'V', Svg::point(top + height), 'Z');
    }
    static std::string columns_of(const std::vector<double>& share, const std::vector<double>& below,
                                  double top, double height) {
        std::string d;
        for (std::size_t i = 0; i < share.size(); ++i) {
            if (share[i] < 1e-4) continue;
            const double from = below.empty() ? 0 : below[i];
            write(d, 'M', Svg::point(kLeft + static_cast<double>(i) * kPlot / kColumns), ' ',
                  Svg::point(top + height * (1 - from)), 'v', Svg::point(-height * share[i]), 'h',
                  Svg::point(kPlot / kColumns), 'v', Svg::point(height * share[i]), 'z');
        }
        return d;
    }

    // ---- R against T ----------------------------------------------------------------------------

    void responses() {
        svg_.words("head", kMargin, y_ + 20, "R against T");
        double at = kLeft;
        y_ += 20;
        svg_.rectangle("c", at, y_ - 9, 22, 10);
        at = label(at + 22, "C: budget");
        svg_.rectangle("r", at, y_ - 9, 22, 10);
        at = label(at + 22, "R: longest response, by analysis");
        svg_.line("period", at + 2, y_ - 12, at + 2, y_ + 3);
        at = label(at + 2, "T: period");
        const auto has_seen = [](const Response& r) { return r.seen.has_value(); };
        if (std::ranges::any_of(schedule_.responses, has_seen)) {
            svg_.path("seen", diamond(at + 5, y_ - 4));
            label(at + 8, "longest response in this run");
        }
        y_ += kResponseHead - 34;
        for (const Response& response : schedule_.responses) draw(response);
    }

    void draw(const Response& response) {
        const double unit = kResponsePlot / kShown;
        const double period = to_seconds(response.period);
        const auto length = [&](Nanoseconds t) { return std::min(to_seconds(t) / period, kShown) * unit; };
        const bool late = !response.worst || *response.worst > response.period;
        const double worst = response.worst ? length(*response.worst) : kResponsePlot;
        svg_.begin_group("response");
        svg_.words("name", kLeft - 12, y_ + 14, shortened(response.name, 20));
        svg_.rectangle("track", kLeft, y_ + 3, unit, 14);
        svg_.rectangle(late ? "over" : "r", kLeft, y_ + 3, worst, 14);
        svg_.rectangle("c", kLeft, y_ + 3, length(response.budget), 14);
        svg_.line("period", kLeft + unit, y_, kLeft + unit, y_ + 20);
        if (response.seen) svg_.path("seen", diamond(kLeft + length(*response.seen), y_ + 10));
        std::string words =
            !response.worst ? "R: never ends, T " + exact(response.period)
            : late          ? text<std::string>("R ", *response.worst, " > T ", response.period)
                   : text<std::string>("R ", human_duration(*response.worst), " of T ", response.period);
        if (response.seen) write(words, ", longest here ", human_duration(*response.seen));
        const bool was_late = response.seen && *response.seen > response.period;
        svg_.words(late || was_late ? "part late" : "part", kLeft + kResponsePlot + 16, y_ + 14, words);
        svg_.end_group();
        y_ += kResponseRow;
    }

    static std::string diamond(double x, double y) {
        return text<std::string>('M', Svg::point(x), ' ', Svg::point(y - 6), "l5 6-5 6-5-6z");
    }

    static constexpr int kColumns = static_cast<int>(kPlot);
    const Schedule& schedule_;
    std::vector<std::string> remark_;
    Svg svg_;
    std::size_t shapes_;  // of a row, drawn one by one
    double y_ = 0;        // everything above has been drawn
};

}  // namespace

std::string svg_page(const Schedule& schedule) {
    return Page(schedule, lines_of(schedule.remark, 170)).draw();
}

}  // namespace qduino::apps::picture
