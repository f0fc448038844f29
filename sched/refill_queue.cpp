#include "sched/refill_queue.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::sched {

RefillQueue::RefillQueue(Instant start, Nanoseconds total, std::size_t limit) : limit_(limit) {
    QDUINO_EXPECT(total > Nanoseconds{0});
    QDUINO_EXPECT(limit >= 1 && limit <= kCapacity);
    refills_.push_back({start, total});
}

Nanoseconds RefillQueue::contiguous_from(Instant now) const {
    Nanoseconds sum{0};
    for (const Refill& refill : refills_) {
        if (refill.time > now + sum) break;
        sum += refill.amount;
    }
    return sum;
}

Nanoseconds RefillQueue::total() const {
    Nanoseconds sum{0};
    for (const Refill& refill : refills_) sum += refill.amount;
    return sum;
}

void RefillQueue::spend(Nanoseconds used, Nanoseconds period) {
    const Nanoseconds sum = total();
    QDUINO_EXPECT(used >= Nanoseconds{0} && sum <= period);

    // Spending every token once moves the whole list by one period, so whole rounds need no loop.
    const std::int64_t rounds = used / sum;
    for (Refill& refill : refills_) refill.time += rounds * period;
    used -= rounds * sum;

    while (used > Nanoseconds{0}) {
        Refill& head = refills_.front();
        const Nanoseconds chunk = std::min(head.amount, used);
        const Refill later{head.time + period, chunk};
        if (chunk == head.amount) {
            refills_.erase(0);
        } else {
            head = {head.time + chunk, head.amount - chunk};
        }
        append(later);
        used -= chunk;
    }
    check(sum);
    QDUINO_EXPECT(refills_.back().end() <= refills_.front().time + period);
}

void RefillQueue::append(Refill later) {
    if (refills_.empty() || (refills_.back().end() < later.time && refills_.size() < limit_)) {
        refills_.push_back(later);
        return;
    }
    Refill& last = refills_.back();
    last.time = later.time - last.amount;  // moves it later, or not at all: it touches already
    last.amount += later.amount;
}

void RefillQueue::advance(Instant now) {
    if (now <= refills_.front().time) return;
    const Nanoseconds sum = total();
    refills_.front().time = now;
    while (refills_.size() > 1 && refills_[1].time <= refills_.front().end()) {
        refills_.front().amount += refills_[1].amount;
        refills_.erase(1);
    }
    check(sum);
}

void RefillQueue::join_splinters(Nanoseconds shortest) {
    if (refills_.size() == 1 || refills_.front().amount >= shortest) return;
    const Nanoseconds sum = total();
    while (refills_.size() > 1 && refills_.front().amount < shortest) delay_head();
    check(sum);
}

void RefillQueue::close_gaps(Nanoseconds shortest) {
    const Nanoseconds sum = total();
    while (refills_.size() > 1 && refills_[1].time - refills_.front().end() < shortest) delay_head();
    check(sum);
}

/// The run at the head becomes the beginning of the next one.
void RefillQueue::delay_head() {
    const Nanoseconds head = refills_.front().amount;
    refills_.erase(0);
    refills_.front() = {refills_.front().time - head, refills_.front().amount + head};
}

void RefillQueue::check(Nanoseconds total_before) const {
    QDUINO_EXPECT(!refills_.empty() && refills_.size() <= limit_);
    QDUINO_EXPECT(total() == total_before);
    for (std::size_t i = 0; i < refills_.size(); ++i) {
        QDUINO_EXPECT(refills_[i].amount > Nanoseconds{0});
        if (i > 0) QDUINO_EXPECT(refills_[i - 1].end() < refills_[i].time);
    }
}

}  // namespace qduino::sched
