// From the places that G-code asks for to those where the machine must go, because it is not
// square, and its bed not flat:
//
//   asked ──► skew:  x' = x − y·XY − z·(XZ − XY·YZ)      ──► mesh:  z' = z + h(x', y')·f(z)
//                    y' = y − z·YZ
//
// The skew is Marlin's (planner.h, M852) and Klipper's, which agree. XY, XZ
// and YZ are the tangents of what the angles lack of 90°.
//
// Fade. The height of the bed is followed up to `fade_start`, and from there less and less, so that
// from `fade_end` on layers are plane (Klipper, "Bed Mesh"). 0: it does not fade.
//
//   f  1 ─────────╮
//   0             ╰──╲____      z
//            fade_start fade_end
//
// A straight way over a surface that is not plane is not straight. split() cuts it at the lines of
// the grid and at the ends of the fade, and then as finely as needed: no piece leaves the surface
// by more than kSplitError_mm, unless that took more than kPiecesMax pieces.
//
// Pure; no heap; loop 1.
#pragma once

#include <cstddef>

#include "base/fixed_vector.h"
#include "printer/motion/bed_mesh.h"
#include "printer/motion/settings.h"

namespace qduino::printer::motion {

class Correction {
  public:
    static constexpr std::size_t kPiecesMax = 64;
    static constexpr double kSplitError_mm = 0.002;
    /// The end of a piece: its share of the whole way, and the place.
    struct Piece {
        double share = 0;
        AxisVector end{};
    };
    using Pieces = FixedVector<Piece, kPiecesMax>;

    explicit Correction(const MachineConfig& config)
        : skew_(config.skew),
          fade_end_(config.mesh.fade_end.value()),
          fade_start_(config.mesh.fade_start.value()) {}

    /// Something differs from what is asked.
    [[nodiscard]] bool active() const { return follows_bed() || skew_ != SkewConfig{}; }
    [[nodiscard]] bool follows_bed() const { return use_mesh_ && mesh_.known(); }
    /// … once a bed is known.
    [[nodiscard]] bool uses_mesh() const { return use_mesh_; }
    [[nodiscard]] const BedMesh& mesh() const { return mesh_; }
    [[nodiscard]] const SkewConfig& skew() const { return skew_; }
    [[nodiscard]] double fade_end() const { return fade_end_; }

    /// Each change of these moves the machine at once where its next move begins: adjust().
    void set_mesh(const BedMesh& mesh) { mesh_ = mesh, adjust(); }
    void use_mesh(bool on) {
        if (use_mesh_ != on) adjust();
        use_mesh_ = on;
    }
    void set_fade_end(double mm) { fade_end_ = mm, adjust(); }
    void set_skew(const SkewConfig& skew) { skew_ = skew, adjust(); }
    /// The machine may not stand where what is asked leads it.
    void adjust() { stale_ = true; }
    /// The next move must first go to where it begins; true once.
    [[nodiscard]] bool take_stale() {
        const bool was = stale_;
        stale_ = false;
        return was;
    }

    [[nodiscard]] AxisVector corrected(const AxisVector& asked) const;
    /// Back: corrected(asked_of(p)) is p.
    [[nodiscard]] AxisVector asked_of(const AxisVector& corrected) const;
    /// The way from `from` to `to`, as asked, in corrected pieces; the last ends at corrected(to).
    [[nodiscard]] Pieces split(const AxisVector& from, const AxisVector& to) const;

  private:
    [[nodiscard]] double fade(double z) const;
    [[nodiscard]] double bend(const AxisVector& from, const AxisVector& to, double begin, double span) const;
    void cut_at(double from, double to, double line, FixedVector<double, 2 * kPiecesMax>& shares) const;

    SkewConfig skew_{};
    BedMesh mesh_{};
    bool use_mesh_ = false;
    bool stale_ = false;
    double fade_end_ = 0;
    double fade_start_ = 0;
};

}  // namespace qduino::printer::motion
