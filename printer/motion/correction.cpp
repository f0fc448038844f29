#include "printer/motion/correction.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace qduino::printer::motion {
namespace {

/// Corners nearer than this share of the way are one.
constexpr double kSameShare = 1e-9;

AxisVector between(const AxisVector& from, const AxisVector& to, double share) {
    AxisVector at{};
    for (std::size_t i = 0; i < kAxisCount; ++i) at[i] = from[i] + share * (to[i] - from[i]);
    return at;
}

}  // namespace

double Correction::fade(double z) const {
    if (fade_end_ <= 0 || z <= fade_start_) return 1;
    return z >= fade_end_ ? 0 : (fade_end_ - z) / (fade_end_ - fade_start_);
}

AxisVector Correction::corrected(const AxisVector& asked) const {
    AxisVector at = asked;
    at[0] = asked[0] - asked[1] * skew_.xy - asked[2] * (skew_.xz - skew_.xy * skew_.yz);
    at[1] = asked[1] - asked[2] * skew_.yz;
    if (follows_bed()) at[2] += mesh_.height_at(at[0], at[1]) * fade(asked[2]);
    return at;
}

AxisVector Correction::asked_of(const AxisVector& corrected) const {
    AxisVector at = corrected;
    if (follows_bed()) {
        const double height = mesh_.height_at(corrected[0], corrected[1]);
        const double whole = corrected[2] - height;
        at[2] = whole;
        if (fade_end_ > 0 && whole > fade_start_) {
            // z' = z + h·(end − z)/(end − start)
            const double span = fade_end_ - fade_start_;
            const double faded = (corrected[2] - height * fade_end_ / span) / (1 - height / span);
            at[2] = faded < fade_end_ ? faded : corrected[2];
        }
    }
    at[0] = corrected[0] + corrected[1] * skew_.xy + at[2] * skew_.xz;
    at[1] = corrected[1] + at[2] * skew_.yz;
    return at;
}

void Correction::cut_at(double from, double to, double line,
                        FixedVector<double, 2 * kPiecesMax>& shares) const {
    if (from == to) return;
    const double share = (line - from) / (to - from);
    if (share > kSameShare && share < 1 - kSameShare) static_cast<void>(shares.try_push_back(share));
}

/// The most that the height's second derivative is over `span` of the way, by differences of five
/// heights; at the ends as it goes on from the middle. A chord over 1/n leaves it by an eighth of
/// that over n².
double Correction::bend(const AxisVector& from, const AxisVector& to, double begin, double span) const {
    std::array<double, 5> z{};
    for (std::size_t i = 0; i < z.size(); ++i)
        z[i] = corrected(between(from, to, begin + span * static_cast<double>(i) / 4))[2];
    const auto second = [&](std::size_t i) { return 16 * (z[i - 1] - 2 * z[i] + z[i + 1]); };
    const double first = second(1), middle = second(2), last = second(3);
    return std::max({std::abs(middle), std::abs(2 * first - middle), std::abs(2 * last - middle)});
}

Correction::Pieces Correction::split(const AxisVector& from, const AxisVector& to) const {
    FixedVector<double, 2 * kPiecesMax> shares;
    shares.push_back(1);
    if (follows_bed() && (from[0] != to[0] || from[1] != to[1])) {
        const AxisVector begin = corrected(from), end = corrected(to);
        for (const Axis axis : {Axis::x, Axis::y})
            for (std::size_t i = 0; i < mesh_.lines(axis); ++i)
                cut_at(begin[axis], end[axis], mesh_.line_at(axis, i), shares);
        for (const double z : {fade_start_, fade_end_}) cut_at(from[2], to[2], z, shares);
        std::ranges::sort(shares);
    }
    Pieces pieces;
    double done = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const double span = shares[i] - done;
        if (span < kSameShare && i + 1 < shares.size()) continue;
        const double wanted = std::ceil(std::sqrt(bend(from, to, done, span) / (8 * kSplitError_mm)));
        const std::size_t left = kPiecesMax - pieces.size() - (shares.size() - 1 - i);
        const std::size_t parts = std::clamp<std::size_t>(static_cast<std::size_t>(wanted), 1, left);
        for (std::size_t part = 1; part <= parts; ++part) {
            const double share = done + span * static_cast<double>(part) / static_cast<double>(parts);
            const bool last = part == parts;
            const double at = last ? shares[i] : share;
            pieces.push_back({at, corrected(at >= 1 ? to : between(from, to, at))});
        }
        done = shares[i];
    }
    return pieces;
}

}  // namespace qduino::printer::motion
