#include "apps/printer_sim/part_picture.h"

#include <algorithm>
#include <cmath>

#include "apps/printer_sim/part_view.h"
#include "base/contract.h"
#include "report/picture/svg.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

using picture::Svg;

constexpr int kWidth = 1200, kHeight = 916;
constexpr double kLeft = 32, kView = 556, kViewTop = 92, kViewHeight = 520, kGap = 24;
constexpr int kPixels = 2;  // of a view for each point of the page
constexpr double kLegendTop = kViewTop + kViewHeight + 22;
constexpr double kPanelTop = kLegendTop + 56, kLine = 19;
constexpr double kPanelWidth = (kWidth - 2 * kLeft - 2 * kGap) / 3;
constexpr std::size_t kPanelLines = 11;
// The most late spots that get a mark, and the most oozes.
constexpr std::size_t kMarks = 5;

constexpr std::string_view kStyle =
    "text{font-family:'Helvetica Neue',Arial,'DejaVu Sans',sans-serif;font-size:13px;fill:#333}"
    ".page{fill:#fff}.title{font-size:21px;font-weight:600;fill:#111}.head{font-size:14px;font-weight:600;"
    "fill:#111}.small{font-size:12px;fill:#666}.good{font-size:14px;fill:#00694d;font-weight:600}"
    ".bad{font-size:14px;fill:#b34700;font-weight:600}.middle{text-anchor:middle;font-size:12px;fill:#666}"
    ".end{text-anchor:end}.view{fill:#f6f7f8}.bar{fill:#a6cfe8}.scale{fill:url(#scale)}"
    ".late{fill:none;stroke:#111;stroke-width:1.6}.ooze{fill:none;stroke:#a3005f;stroke-width:1.6}"
    ".mark{font-size:12px;font-weight:600;fill:#111;stroke:#fff;stroke-width:3px;paint-order:stroke}"
    "@media (prefers-color-scheme:dark){text{fill:#c9ced6}.page{fill:#14171c}.title,.head{fill:#f2f4f7}"
    ".small,.middle{fill:#9aa3af}.good{fill:#2fc79c}.bad{fill:#ff9a4d}.view{fill:#1c2027}.bar{fill:#2c6a8f}"
    ".late{stroke:#f2f4f7}.ooze{stroke:#ff6fc0}.mark{fill:#f2f4f7;stroke:#14171c}}";

/// "12:05" or "1:02:03".
std::string clock(double seconds) {
    const auto whole = static_cast<long long>(std::llround(seconds));
    const auto two = [](long long n) { return (n < 10 ? "0" : "") + std::to_string(n); };
    const std::string minutes = std::to_string(whole / 60 % 60) + ":" + two(whole % 60);
    return whole < 3600 ? minutes
                        : std::to_string(whole / 3600) + ":" + (whole / 60 % 60 < 10 ? "0" : "") + minutes;
}

std::string hex(const picture::Colour& colour) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string out{"#"};
    for (const std::uint8_t part : {colour.red, colour.green, colour.blue})
        out += {kDigits[part / 16], kDigits[part % 16]};
    return out;
}

std::string definitions() {
    std::string out{"<linearGradient id=\"scale\">"};
    constexpr int kStops = 8;
    for (int i = 0; i <= kStops; ++i) {
        const double share = static_cast<double>(i) / kStops;
        write(out, "<stop offset=\"", Fixed{share, 3}, "\" stop-color=\"",
              hex(colour_of((2 * share - 1) * kWorstShown)), "\"/>");
    }
    return out + "</linearGradient>";
}

double micrometres(const Histogram& nm, double share) {
    return static_cast<double>(nm.quantile(share)) * 1e-3;
}

/// Draws one page; used once.
class Page {
  public:
    Page(const PrintResult& result, const PartPictureOptions& options)
        : result_(result),
          seen_(*result.observed),
          options_(options),
          svg_(kWidth, kHeight, kStyle, definitions(), "") {}

    Result<std::string> draw() {
        const auto& cells = seen_.heights.cells;
        if (cells.empty()) return make_error(ErrorCode::not_found, "no picture: nothing was laid down");
        const auto of_layer = options_.layer ? cells_of_layer(cells, *options_.layer) : cells;
        if (of_layer.empty())
            return make_error(ErrorCode::not_found, "no picture: there is no layer ", *options_.layer);
        title();
        view(cells, ViewFrom::corner, kLeft, "From the corner");
        view(of_layer, ViewFrom::above, kWidth - kLeft - kView,
             options_.layer ? text<std::string>("Layer ", *options_.layer, " from above") : "From above");
        legend();
        features();
        heights();
        faults();
        return svg_.finish();
    }

  private:
    void title() {
        svg_.words("title", kLeft, 38, picture::shortened(options_.title, 70));
        const twin::Report& built = result_.built;
        svg_.words(result_.success() ? "good" : "bad", kLeft, 62,
                   result_.success() ? "Built is what was asked" : "NOT what was asked");
        svg_.words(
            "small", kLeft + 190, 62,
            text<std::string>(clock(result_.print_time_s), " printed, ", built.layers.size(), " layers, ",
                              Fixed{built.findings.filament_built_mm / 1000, 2}, " m of filament"));
    }

    void view(std::span<const twin::HeightCell> cells, ViewFrom from, double left, const std::string& name) {
        const PartView seen(cells, from, static_cast<int>(kView * kPixels),
                            static_cast<int>(kViewHeight * kPixels), options_.line_mm);
        svg_.words("head", left, kViewTop - 8, name);
        svg_.rectangle("view", left, kViewTop, kView, kViewHeight);
        svg_.image(left, kViewTop, kView, kViewHeight, picture::data_address(seen.png()));
        const bool alone = from == ViewFrom::above && options_.layer;
        const auto is_seen = [&](const twin::PlaceOfLine& place) {
            return !alone || std::abs(place.mm[2] - static_cast<double>(cells[0].z_mm)) < 0.02;
        };
        const auto& spots = seen_.heights.late_spots;
        for (std::size_t i = 0; i < std::min(kMarks, spots.size()); ++i)
            if (is_seen(spots[i].place)) mark("late", seen, left, spots[i].place, i);
        const auto& oozes = seen_.heights.oozes;
        for (std::size_t i = 0; i < std::min(kMarks, oozes.size()); ++i)
            if (is_seen(oozes[i].from)) mark("ooze", seen, left, oozes[i].from, i);
    }

    /// A circle for a late spot, a triangle for ooze, and its number in the list.
    void mark(std::string_view kind, const PartView& seen, double left, const twin::PlaceOfLine& place,
              std::size_t index) {
        const picture::Spot at = seen.spot(place.mm[0], place.mm[1], place.mm[2]);
        const double x = left + static_cast<double>(at.x) / kPixels;
        const double y = kViewTop + static_cast<double>(at.y) / kPixels;
        sign(kind, x, y);
        const char name = static_cast<char>((kind == "late" ? '1' : 'a') + index);
        svg_.words("mark", x + 9, y - 5, std::string(1, name));
    }

    void sign(std::string_view kind, double x, double y) {
        if (kind == "late")
            return svg_.path(kind, text<std::string>('M', Svg::point(x - 7), ' ', Svg::point(y),
                                                     "a7 7 0 1 0 14 0a7 7 0 1 0 -14 0z"));
        svg_.path(kind, text<std::string>('M', Svg::point(x), ' ', Svg::point(y - 7), "l7 12h-14z"));
    }

    void legend() {
        constexpr double kScale = 360;
        svg_.rectangle("scale", kLeft, kLegendTop, kScale, 12);
        const std::string most = text<std::string>(Fixed{kWorstShown * 100, 0}, " %");
        svg_.words("small", kLeft, kLegendTop + 27, text<std::string>("thinner by ", most));
        svg_.words("middle", kLeft + kScale / 2, kLegendTop + 27, "as asked");
        svg_.words("small end", kLeft + kScale, kLegendTop + 27, text<std::string>("thicker by ", most));
        sign("late", kLeft + kScale + 60, kLegendTop + 6);
        svg_.words("small", kLeft + kScale + 74, kLegendTop + 11, "1 2 3: a late step laid it thicker");
        sign("ooze", kLeft + kScale + 300, kLegendTop + 7);
        svg_.words("small", kLeft + kScale + 314, kLegendTop + 11,
                   "a b c: most ooze, on a way without extrusion or at a rest");
    }

    // ---- panels ---------------------------------------------------------------------------------

    void begin_panel(int index, std::string_view name) {
        panel_ = kLeft + index * (kPanelWidth + kGap);
        y_ = kPanelTop;
        lines_ = 0;
        svg_.words("head", panel_, y_, name);
        y_ += 8;
    }
    /// False: the panel is full.
    bool row(const std::string& left, const std::string& right) {
        if (lines_++ >= kPanelLines) return false;
        y_ += kLine;
        svg_.words("", panel_, y_, left);
        if (!right.empty()) svg_.words("end", panel_ + kPanelWidth, y_, right);
        return true;
    }

    void features() {
        begin_panel(0, "Time by feature");
        double longest = 1e-9;
        for (const FeatureTime& feature : seen_.features) longest = std::max(longest, feature.seconds);
        for (const FeatureTime& feature : seen_.features) {
            if (lines_ + 1 >= kPanelLines) break;
            svg_.rectangle("bar", panel_, y_ + 5, kPanelWidth * feature.seconds / longest, kLine - 3);
            row(feature.name.empty() ? unnamed() : picture::shortened(feature.name, 40),
                clock(feature.seconds));
        }
        row("nothing moved: heating, pauses", clock(seen_.rested_s));
    }

    /// Lines in front of the first comment, or all, if the slicer wrote none.
    [[nodiscard]] std::string unnamed() const {
        return seen_.features.size() == 1 ? "all lines: the file names no features"
                                          : "before the first feature";
    }

    void heights() {
        const twin::Heights& found = seen_.heights;
        begin_panel(1, "Heights and rates");
        const auto um = [&](double share) {
            return text<std::string>(Fixed{micrometres(found.error_nm, share), 1}, " µm");
        };
        row("error of height, half are within", um(0.5));
        row("99 of 100 are within", um(0.99));
        row(text<std::string>("largest, near line ", found.worst.line), um(1));
        row("plastic laid / asked",
            text<std::string>(Fixed{found.laid_mm3, 1}, " / ", Fixed{found.asked_mm3, 1}, " mm³"));
        row("ooze on travel", text<std::string>(Fixed{found.travel_ooze_mm3, 2}, " mm³"));
        row("ooze at rest", text<std::string>(Fixed{found.rest_ooze_mm3, 2}, " mm³"));
        for (std::size_t axis = 0; axis < twin::kAxisCount; ++axis)
            row(text<std::string>("peak step rate ", twin::kAxisLetter[axis]),
                text<std::string>(Fixed{seen_.peak_steps_s[axis], 0}, " /s"));
    }

    void faults() {
        begin_panel(2, "Faults, with their line of the file");
        for (const std::string& difference : result_.built.differences)
            if (!row(picture::shortened(difference, 58), "")) return;
        const twin::Heights& found = seen_.heights;
        for (std::size_t i = 0; i < std::min(kMarks, found.late_spots.size()); ++i) {
            const twin::LateSpot& spot = found.late_spots[i];
            row(text<std::string>(i + 1, "  line ", spot.place.line, ": ",
                                  human_duration(from_seconds(spot.late_s)), " late"),
                text<std::string>("+", Fixed{spot.rise_mm * 1000, 0}, " µm"));
        }
        for (std::size_t i = 0; i < std::min(kMarks, found.oozes.size()); ++i) {
            const twin::Ooze& ooze = found.oozes[i];
            row(text<std::string>(
                    static_cast<char>('a' + i), "  line ", ooze.from.line, ": ooze ",
                    ooze.way_mm > 0 ? text<std::string>("on ", Fixed{ooze.way_mm, 1}, " mm") : "at rest"),
                text<std::string>(Fixed{ooze.volume_mm3, 3}, " mm³"));
        }
        if (lines_ == 0) row("none", "");
    }

    const PrintResult& result_;
    const Observed& seen_;
    const PartPictureOptions& options_;
    Svg svg_;
    double panel_ = 0, y_ = 0;  // the panel's left side, and what is drawn so far
    std::size_t lines_ = 0;
};

}  // namespace

Result<std::string> part_picture(const PrintResult& result, const PartPictureOptions& options) {
    QDUINO_EXPECT(result.observed.has_value());
    return Page(result, options).draw();
}

}  // namespace qduino::apps
