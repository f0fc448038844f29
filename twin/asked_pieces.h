// The asked path as the motors have it: in pieces that are straight for every motor, read as far as
// somebody looks.
//
// On a cartesian machine and on CoreXY a straight piece of the path is one for every motor. On a
// delta it is a curve for each carriage: the path is cut into pieces so short that no carriage
// leaves its chord by more than kChordSteps. A way over a measured bed is cut as a curve is.
#pragma once

#include <cstdint>
#include <deque>

#include "twin/allowance.h"
#include "twin/asked_path.h"
#include "twin/inspection_start.h"
#include "twin/motor_space.h"

namespace qduino::twin {

struct AskedPiece {
    AskedItem::Kind kind = AskedItem::Kind::end;
    std::uint8_t homed = 0;
    bool curved = false;
    std::uint64_t line = 0;
    MotorPoint from{};
    MotorPoint to{};
    double advance_s = 0;
    int map = 0;  ///< of the bed that is followed; 0: none
    double fade_end_mm = 0;

    [[nodiscard]] MotorPoint at(double share) const {
        if (share >= 1) return to;
        MotorPoint point;
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            point[axis] = from[axis] + share * (to[axis] - from[axis]);
        return point;
    }
};

/// `by` changes the filament of `pieces`. `share` is a place on the first of them, and stays the
/// same place. Returns the index of a piece that has come in; 0: none has.
[[nodiscard]] std::size_t stretch(std::deque<AskedPiece>& pieces, AskedPath::Stretch by, double steps_per_mm,
                                  double& share);

/// The pieces that were read since a place that the comparison may have to go back to. Each piece
/// that was ever read has a number.
class KeptPieces {
  public:
    void add(const AskedPiece& piece) {
        ++read_;
        if (keeping_) kept_.push_back(piece);
    }
    /// What is read from here on is kept.
    void keep() { keeping_ = true; }
    void forget_before(std::uint64_t number) { kept_.erase(kept_.begin(), begin_of(number)); }
    void forget_all() {
        kept_.clear();
        keeping_ = false;
    }
    /// The number of the piece that will be read next.
    [[nodiscard]] std::uint64_t next() const { return read_; }
    [[nodiscard]] std::size_t size() const { return kept_.size(); }
    void append_since(std::uint64_t number, std::deque<AskedPiece>& pieces) {
        pieces.insert(pieces.end(), begin_of(number), kept_.end());
    }
    /// As stretch(). Returns the number from which on pieces count one more.
    [[nodiscard]] std::uint64_t stretch(const AskedPath::Stretch& by, double steps_per_mm) {
        const std::uint64_t first = read_ - kept_.size();
        double nobody = 0;
        const std::size_t added = twin::stretch(kept_, by, steps_per_mm, nobody);
        if (added == 0) return read_ + 1;
        ++read_;
        return first + added;
    }

  private:
    [[nodiscard]] std::deque<AskedPiece>::iterator begin_of(std::uint64_t number) {
        return kept_.end() - static_cast<std::ptrdiff_t>(read_ - number);
    }

    std::deque<AskedPiece> kept_;
    bool keeping_ = false;
    std::uint64_t read_ = 0;
};

class AskedPieces {
  public:
    /// A place that the path has on a half step, or so near, may have been rounded either way.
    static constexpr double kTieSteps = 0.01;
    /// Below a tie: where a carriage turns back, the chord may miss a crossing by so much.
    static constexpr double kChordSteps = 0.005;
    /// The longest piece of a way over the measured bed.
    static constexpr double kBedPieceMm = 0.5;

    /// `source` must outlive this. The first piece has no length: the place to start from.
    AskedPieces(const Machine& machine, ByteSource& source, const InspectionStart& start);

    /// Reads as far as `index`; behind the end of the path the piece that says so.
    [[nodiscard]] const AskedPiece& piece(std::size_t index) {
        while (pieces_.size() <= index && pieces_.back().kind != AskedItem::Kind::end) read_item();
        return pieces_[std::min(index, pieces_.size() - 1)];
    }
    /// One that has been read.
    [[nodiscard]] const AskedPiece& operator[](std::size_t index) const { return pieces_[index]; }
    [[nodiscard]] const AskedPiece& front() const { return pieces_.front(); }
    /// All that were read and not dropped.
    [[nodiscard]] const std::deque<AskedPiece>& all() const { return pieces_; }
    void drop(std::size_t count) {
        pieces_.erase(pieces_.begin(), pieces_.begin() + static_cast<std::ptrdiff_t>(count));
    }
    /// Back to `pieces`, which were there when piece `next` was the next to be read.
    void go_back_to(std::deque<AskedPiece> pieces, std::uint64_t next) {
        pieces_ = std::move(pieces);
        kept_.append_since(next, pieces_);
    }
    [[nodiscard]] KeptPieces& kept() { return kept_; }
    [[nodiscard]] const KeptPieces& kept() const { return kept_; }

    [[nodiscard]] AskedPath& asked() { return asked_; }
    [[nodiscard]] const AskedPath& asked() const { return asked_; }
    [[nodiscard]] MotorSpace& space() { return space_; }
    [[nodiscard]] const MotorSpace& space() const { return space_; }
    [[nodiscard]] const Allowance& allowance() const { return allowance_; }
    /// AskedPath::insert. The pieces that are here are left as they are.
    [[nodiscard]] std::optional<AskedPath::Stretch> insert(std::uint64_t behind, std::string_view line,
                                                           double left_mm);
    /// stretch() of those that are here.
    void stretch(const AskedPath::Stretch& by, double& share) {
        static_cast<void>(twin::stretch(pieces_, by, space_.steps_per_mm(kExtruder), share));
    }

  private:
    void read_item();
    void push_way(const AskedItem& item);
    void push(const AskedPiece& piece) {
        pieces_.push_back(piece);
        kept_.add(piece);
    }
    void widen_reach();
    [[nodiscard]] Position home_from(const AskedItem& item) const;
    [[nodiscard]] MotorPoint place_at_start(const InspectionStart& start) const;

    MotorSpace space_;
    Allowance allowance_;
    AskedPath asked_;
    Position read_to_;  // the end of what has been read of it
    double chord_mm_;   // kChordSteps of the finest motor
    std::uint64_t filters_seen_ = 0;
    std::deque<AskedPiece> pieces_;
    KeptPieces kept_;
};

}  // namespace qduino::twin
