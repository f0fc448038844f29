// How far into a job's file its motion is, at equal steps of time: what an ETA needs while the
// job is printed.
//
//   byte ^                 _____●     A printed byte says how much of the time is behind it,
//        |          __●---'           and how much is left. Bytes alone do not: a layer of
//        |      _●-'                  infill has few bytes and takes long.
//        +--●--+------+------+---> time, in steps of step_s
//
// The job's length is not known before its end. So the steps begin short, and whenever the table is
// full every other one is dropped: it has between kPointsMax / 2 and kPointsMax points in the end.
// Pure; no heap.
#pragma once

#include <cstdint>

#include "base/fixed_vector.h"

namespace qduino::printer::estimate {

class TimeProfile {
  public:
    static constexpr std::size_t kPointsMax = 96;

    /// Everything before `byte` of the file has been done `time_s` after the beginning. Neither
    /// goes back.
    void add(double time_s, std::uint64_t byte) {
        while (time_s >= step_s_ * static_cast<double>(bytes_.size() + 1)) {
            if (bytes_.full()) {
                thin_out();
            } else {
                bytes_.push_back(last_byte_);
            }
        }
        last_byte_ = byte;
    }

    [[nodiscard]] double step_s() const { return step_s_; }
    /// The bytes of the file that are done after one step, after two, …
    [[nodiscard]] const FixedVector<std::uint64_t, kPointsMax>& bytes() const { return bytes_; }

  private:
    void thin_out() {
        for (std::size_t i = 0; i < bytes_.size() / 2; ++i) bytes_[i] = bytes_[2 * i + 1];
        while (bytes_.size() > kPointsMax / 2) bytes_.pop_back();
        step_s_ *= 2;
    }

    double step_s_ = 1;
    FixedVector<std::uint64_t, kPointsMax> bytes_;
    std::uint64_t last_byte_ = 0;
};

}  // namespace qduino::printer::estimate
