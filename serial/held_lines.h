// Bytes of a serial host that wait for a reader, at most so many: what does not fit is dropped by
// whole lines, and a sign stands where something is missing.
//
//   N7 G1 X1*53 ⏎  N8 G1 X2*   full: the rest of line 8, and all lines up to the next room, are
//   N7 G1 X1*53 ⏎  N8 G1 X2 ␘ ⏎  N31 …   dropped; then whole lines again
//
// A port must be read and looked through at all times, or an M112 would wait behind what nobody
// takes. So there must be a place for bytes that is never full. A line with the sign in it is
// damaged, however it reads, and is asked for again (serial_session.h). Without the sign the two
// ends of a gap would be read as one line.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace qduino::apps {

class HeldLines {
  public:
    static constexpr std::size_t kMax = 64 * 1024;
    /// ASCII's CANCEL: "the data preceding it is in error" (ECMA-48, 8.3.6). No G-code has it.
    static constexpr char kGap = '\x18';

    HeldLines() { bytes_.reserve(kMax); }

    /// Takes them all; allocates nothing. Behind a gap lines are held again once half of the room
    /// is free, so that a slow reader meets few gaps and not one for each line.
    void append(std::span<const char> bytes) {
        for (const char c : bytes) append(c);
    }
    [[nodiscard]] std::span<const char> bytes() const { return bytes_; }
    [[nodiscard]] std::size_t size() const { return bytes_.size(); }
    [[nodiscard]] bool empty() const { return bytes_.empty(); }
    /// Takes `count` bytes off the front. Contract: there are so many.
    void take(std::size_t count) { bytes_.erase(0, count); }
    /// Forgets all that is held, and of a line that has not ended what is still to come.
    void drop() {
        bytes_.clear();
        skips_ = skips_ || in_line_;
    }
    /// Another host begins.
    void begin() {
        bytes_.clear();
        skips_ = in_line_ = false;
    }

  private:
    void append(char c) {
        if (skips_ && !in_line_ && bytes_.size() <= kMax / 2) skips_ = false;
        if (!skips_ && bytes_.size() + 2 >= kMax) {
            bytes_ += {kGap, '\n'};
            skips_ = true;
        }
        if (!skips_) bytes_ += c;
        in_line_ = c != '\n' && c != '\r';
    }

    std::string bytes_;
    bool in_line_ = false;  // the last byte that came, held or not, did not end its line
    bool skips_ = false;
};

}  // namespace qduino::apps
