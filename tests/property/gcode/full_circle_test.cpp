// A whole circle ends where it began, by the file's own decimal numbers. A reader counts in binary,
// and finds the two apart by what rounding has left: it must make the circle all the same.
//
// The oracle counts in whole thousandths (of a millimetre or of an inch), which is exact. It makes
// a program that comes to the start by relative moves, by a G92 or directly, and an arc from there:
// back to the same thousandth, or one thousandth beside it. It knows how long the way is. The
// printer and the twin are asked for theirs.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "../../unit/gcode/recorder.h"
#include "tests/unit/twin/text_source.h"
#include "twin/asked_path.h"

namespace qduino::printer::gcode::full_circle_test {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

struct Asked {
    std::string program;
    std::uint64_t line = 0;             ///< of the arc
    double length_mm = 0;               ///< of its way
    std::size_t first = 0, second = 1;  ///< the axes of its plane
};

std::string decimal(std::int64_t thousandths) {
    char text[32];
    const std::int64_t size = std::abs(thousandths);
    std::snprintf(text, sizeof text, "%s%lld.%03lld", thousandths < 0 ? "-" : "",
                  static_cast<long long>(size / 1000), static_cast<long long>(size % 1000));
    return text;
}

class Generator {
  public:
    explicit Generator(std::uint64_t seed) : random_(seed) {}

    Asked next() {
        const std::size_t plane = static_cast<std::size_t>(between(0, 2));
        constexpr char kAxes[3][3]{"XY", "ZX", "YZ"};
        constexpr char kCentre[3][3]{"IJ", "KI", "JK"};
        constexpr std::size_t kFirst[]{0, 2, 1}, kSecond[]{1, 0, 2};
        const char a = kAxes[plane][0], b = kAxes[plane][1];
        const bool inches = between(0, 3) == 0;
        Asked asked;
        asked.first = kFirst[plane];
        asked.second = kSecond[plane];
        say(asked, "G28");
        say(asked, "G1 F3000");
        say(asked, "G" + std::to_string(17 + plane));
        if (inches) say(asked, "G20");
        std::int64_t at_a = between(40'000, 60'000), at_b = between(40'000, 60'000);
        say(asked, "G90");
        say(asked, std::string{"G1 "} + a + decimal(at_a) + " " + b + decimal(at_b));
        come(asked, a, b, at_a, at_b);
        arc(asked, a, b, kCentre[plane], at_a, at_b, inches ? 25.4 : 1);
        return asked;
    }

  private:
    std::int64_t between(std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random_);
    }
    static void say(Asked& asked, const std::string& line) {
        asked.program += line + "\n";
        ++asked.line;
    }
    /// By sums of relative moves, behind other names of the place, or both.
    void come(Asked& asked, char a, char b, std::int64_t& at_a, std::int64_t& at_b) {
        for (std::int64_t i = between(0, 12); i > 0; --i) {
            if (between(0, 4) == 0) {
                at_a = between(-99'999, 99'999);
                at_b = between(-99'999, 99'999);
                say(asked, std::string{"G92 "} + a + decimal(at_a) + " " + b + decimal(at_b));
                continue;
            }
            const std::int64_t da = between(-900, 900), db = between(-900, 900);
            at_a += da;
            at_b += db;
            say(asked, "G91");
            say(asked, std::string{"G1 "} + a + decimal(da) + " " + b + decimal(db));
            say(asked, "G90");
        }
    }
    void arc(Asked& asked, char a, char b, const char* centre, std::int64_t at_a, std::int64_t at_b,
             double unit_mm) {
        const std::int64_t ci = between(-15'000, 15'000), cj = between(500, 15'000);
        const bool clockwise = between(0, 1) == 0;
        const std::int64_t turns = between(0, 2);
        std::int64_t da = 0, db = 0;
        if (between(0, 2) == 0) {
            da = between(-1, 1);
            db = between(-1, 1);
        }
        const bool whole = da == 0 && db == 0;
        std::string line = clockwise ? "G2" : "G3";
        if (!whole || between(0, 3) != 0)
            line += std::string{" "} + a + decimal(at_a + da) + " " + b + decimal(at_b + db);
        line += std::string{" "} + centre[0] + decimal(ci) + " " + centre[1] + decimal(cj);
        if (turns != 0) line += " P" + std::to_string(turns);
        say(asked, line);
        const auto from = static_cast<long double>(
            std::atan2(static_cast<long double>(-cj), static_cast<long double>(-ci)));
        const auto to = std::atan2(static_cast<long double>(db - cj), static_cast<long double>(da - ci));
        double sweep = static_cast<double>(clockwise ? from - to : to - from);
        if (sweep < 0) sweep += kTurn;
        if (whole) sweep = turns == 0 ? kTurn : 0;
        const double radius_mm =
            std::hypot(static_cast<double>(ci), static_cast<double>(cj)) / 1000 * unit_mm;
        asked.length_mm = radius_mm * (sweep + kTurn * static_cast<double>(turns));
    }

    std::mt19937_64 random_;
};

MachineConfig large_machine() {
    MachineConfig config;
    for (const Axis axis : kToolAxes) {
        config.axes[axis].minimum = -100000_mm;
        config.axes[axis].maximum = 100000_mm;
    }
    return config;
}

double printed_mm(const Asked& asked, std::string& error) {
    Bench bench{large_machine()};
    for (const std::string& noted : bench.run(asked.program))
        if (noted.rfind("error", 0) == 0) error = noted;
    double length = 0;
    for (const Move& move : bench.recorder.moves)
        if (move.source.line == asked.line)
            length += std::hypot((move.to[asked.first] - move.from[asked.first]).value(),
                                 (move.to[asked.second] - move.from[asked.second]).value());
    return length;
}

double asked_of_twin_mm(const Asked& asked) {
    twin::TextSource source{asked.program};
    twin::AskedPath path{source, {}, twin::Machine{}};
    double length = 0;
    twin::Position at{};
    for (twin::AskedItem item = path.next(); item.kind != twin::AskedItem::Kind::end; item = path.next()) {
        if (item.line == asked.line)
            length +=
                std::hypot(item.to[asked.first] - at[asked.first], item.to[asked.second] - at[asked.second]);
        at = item.to;
    }
    return length;
}

TEST(FullCircle, IsMadeWhereItsEndsAreOneByTheFilesOwnNumbers) {
    for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
        const Asked asked = Generator{seed}.next();
        std::string error;
        // A chord is shorter than its arc by r φ³/24; the ends may be a thousandth of an inch
        // apart.
        const double tolerance = asked.length_mm * 2e-3 + 0.06;
        EXPECT_NEAR(printed_mm(asked, error), asked.length_mm, tolerance) << "seed " << seed << "\n"
                                                                          << asked.program;
        EXPECT_EQ(error, "") << "seed " << seed << "\n" << asked.program;
        EXPECT_NEAR(asked_of_twin_mm(asked), asked.length_mm, tolerance) << "seed " << seed << "\n"
                                                                         << asked.program;
        if (HasFailure()) return;
    }
}

}  // namespace
}  // namespace qduino::printer::gcode::full_circle_test
