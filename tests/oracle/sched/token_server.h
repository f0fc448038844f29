// The sporadic server by its definition, one nanosecond at a time: a sorted list of unit tokens.
//
// Nothing is merged, split or bounded here. A token may be spent from its instant on; spending it
// moves it one period later; waking at `now` moves the k-th token to now + k if it was earlier.
#pragma once

#include <cstdint>
#include <deque>
#include <span>

#include "sched/refill_queue.h"

namespace qduino::sched::oracle {

class TokenServer {
  public:
    TokenServer(std::int64_t budget, std::int64_t period, std::int64_t start) : period_(period) {
        for (std::int64_t k = 0; k < budget; ++k) tokens_.push_back(start + k);
    }

    void spend_one() {
        const std::int64_t token = tokens_.front();
        tokens_.pop_front();
        tokens_.push_back(token + period_);
    }
    void wake(std::int64_t now) {
        for (std::size_t k = 0; k < tokens_.size(); ++k) {
            const std::int64_t earliest = now + static_cast<std::int64_t>(k);
            if (tokens_[k] < earliest) tokens_[k] = earliest;
        }
    }
    [[nodiscard]] bool may_run(std::int64_t now) const { return tokens_.front() <= now; }
    [[nodiscard]] std::int64_t contiguous_from(std::int64_t now) const {
        std::int64_t k = 0;
        while (k < static_cast<std::int64_t>(tokens_.size()) &&
               tokens_[static_cast<std::size_t>(k)] <= now + k)
            ++k;
        return k;
    }
    [[nodiscard]] const std::deque<std::int64_t>& tokens() const { return tokens_; }
    void set_tokens(std::deque<std::int64_t> tokens) { tokens_ = std::move(tokens); }

  private:
    std::deque<std::int64_t> tokens_;
    std::int64_t period_;
};

/// A list of refills spelt out as its tokens.
inline std::deque<std::int64_t> tokens_of(std::span<const Refill> refills) {
    std::deque<std::int64_t> tokens;
    for (const Refill& refill : refills) {
        for (std::int64_t k = 0; k < refill.amount.count(); ++k) tokens.push_back(to_ns(refill.time) + k);
    }
    return tokens;
}

}  // namespace qduino::sched::oracle
