#include "spool/housekeeping.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace qduino::spool {

namespace {

constexpr std::size_t kErasedEachTick = 16;
constexpr UnixSeconds kAgesEvery_s = 60;
constexpr UnixSeconds kDay_s = 24 * 60 * 60;

}  // namespace

void Housekeeping::keep(Instant now, UnixSeconds now_s) {
    ledger_.storage().keep(now);
    take_news();
    clock_.see(now, now_s);
    retain(now_s);
}

void Housekeeping::take_news() {
    Storage::News news = ledger_.storage().take_news();
    for (const std::string& line : news.log) ledger_.log().add(line);
    if (!news.hold_reason.empty()) static_cast<void>(ledger_.hold_queue(std::move(news.hold_reason)));
}

void Housekeeping::drop_files(const Job& job) {
    const Result<bool> wanted = ledger_.store().blob_wanted(job.sha256);
    if (!wanted) return;
    if (*wanted) {
        ledger_.files().forget(job.sha256, job.id);
    } else {
        ledger_.files().remove(job.sha256);
    }
}

Result<void> Housekeeping::erase_ended(const std::vector<Job>& jobs) {
    Change change;
    for (const Job& job : jobs) change.erase.push_back(job.id);
    QDUINO_TRY(ledger_.commit(std::move(change)));
    for (const Job& job : jobs) drop_files(job);
    return {};
}

/// Deletes a few of the ended jobs that exceed the limit on their number or their age.
void Housekeeping::retain(UnixSeconds now_s) {
    const Retention& keep = options_.retention;
    const std::int64_t too_many = keep.jobs_max > 0 ? ledger_.store().counts().ended() - keep.jobs_max : 0;
    std::size_t count =
        too_many > 0 ? std::min<std::size_t>(static_cast<std::size_t>(too_many), kErasedEachTick) : 0;
    UnixSeconds until_s = now_s;
    if (count == 0) {
        if (keep.days_max == 0 || !clock_.believed()) return;
        if (std::abs(now_s - retained_s_) < kAgesEvery_s) return;
        until_s = now_s - keep.days_max * kDay_s;
        count = kErasedEachTick;
    }
    const Result<std::vector<Job>> oldest =
        too_many > 0 ? ledger_.store().oldest_ended(count)
                     : ledger_.store().oldest_ended(count, until_s, clock_.first_s());
    // All others are younger.
    if (too_many <= 0 && oldest.ok() && oldest->size() < count) retained_s_ = now_s;
    if (!oldest.ok() || oldest->empty()) return;
    if (!erase_ended(*oldest).ok()) return;
    ledger_.log().add("deleted ", oldest->size(), " of the oldest ended jobs: ",
                      too_many > 0 ? "more than --keep-jobs" : "older than --keep-days");
}

Result<void> Housekeeping::make_room(const std::string& sha256, std::uint64_t bytes) {
    const std::uint64_t limit = options_.retention.bytes_max;
    if (limit == 0) return {};
    QDUINO_TRY_ASSIGN(const bool stored, ledger_.store().blob_wanted(sha256));
    if (stored || ledger_.store().stored_bytes() + bytes <= limit) return {};
    std::vector<std::pair<std::string, std::uint64_t>> needed{{sha256, bytes}};
    for (const Job& job : ledger_.queue().jobs()) needed.emplace_back(job.sha256, job.stored_bytes);
    std::sort(needed.begin(), needed.end());
    std::uint64_t needed_bytes = 0;
    for (std::size_t i = 0; i < needed.size(); ++i)
        needed_bytes += i > 0 && needed[i].first == needed[i - 1].first ? 0 : needed[i].second;
    if (needed_bytes > limit) {
        return make_error(
            ErrorCode::unavailable,
            "the store is full with jobs that still wait or print; delete some of them, or give it more with "
            "--store-limit-mib");
    }
    while (ledger_.store().stored_bytes() + bytes > limit) QDUINO_TRY(erase_oldest());
    return {};
}

Result<void> Housekeeping::erase_oldest() {
    QDUINO_TRY_ASSIGN(const std::vector<Job> oldest, ledger_.store().oldest_ended(1));
    if (oldest.empty())
        return make_error(ErrorCode::unavailable, "the store is full, and no ended job is left to delete");
    return erase_ended(oldest);
}

}  // namespace qduino::spool
