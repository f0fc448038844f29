// Where a model may go one way or another, it picks; whoever drives it has every way gone once, or
// ways at random.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace qduino::sched {

/// The ways of one run after the other, like the digits of a number that is counted up, each digit
/// with a base of its own.
class EveryWay {
  public:
    /// 0 … count − 1.
    int pick(int count) {
        if (at_ == taken_.size()) taken_.push_back({0, count});
        return taken_[at_++].way;
    }
    /// To the next run. False when every way has been gone.
    bool next() {
        at_ = 0;
        while (!taken_.empty() && taken_.back().way + 1 == taken_.back().count) taken_.pop_back();
        if (taken_.empty()) return false;
        ++taken_.back().way;
        return true;
    }

    /// The present run's ways, for a message.
    [[nodiscard]] std::string text() const {
        std::string text = "ways";
        for (const Taken& taken : taken_) text += " " + std::to_string(taken.way);
        return text;
    }

  private:
    struct Taken {
        int way;
        int count;
    };
    std::vector<Taken> taken_;
    std::size_t at_ = 0;
};

class AnyWay {
  public:
    explicit AnyWay(std::uint64_t seed) : random_(seed) {}
    int pick(int count) { return std::uniform_int_distribution<int>{0, count - 1}(random_); }

  private:
    std::mt19937_64 random_;
};

}  // namespace qduino::sched
