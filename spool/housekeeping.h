// The spool's work beside printing: it deletes jobs that have ended, and takes up what the storage
// has to say.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "spool/clock_watch.h"
#include "spool/ledger.h"
#include "spool/spool_options.h"

namespace qduino::spool {

class Housekeeping {
  public:
    /// Both outlive this.
    Housekeeping(const SpoolOptions& options, Ledger& ledger) : options_(options), ledger_(ledger) {}

    /// Everything is loaded; no job has a time behind `newest_s` (0: there is none).
    void begin(UnixSeconds newest_s) {
        clock_ = ClockWatch{options_.calendar_from_s, newest_s};
        take_news();
    }
    /// Once each tick.
    void keep(Instant now, UnixSeconds now_s);

    /// Makes room for a file of `bytes` within the store's limit: deletes ended jobs, the oldest
    /// first; but none when that would not be enough. Errors: unavailable, and as Store::commit.
    [[nodiscard]] Result<void> make_room(const std::string& sha256, std::uint64_t bytes);
    /// Spool::erase_oldest.
    [[nodiscard]] Result<void> erase_oldest();
    /// After the row of `job` has gone, or was never written.
    void drop_files(const Job& job);

  private:
    [[nodiscard]] Result<void> erase_ended(const std::vector<Job>& jobs);
    void take_news();
    void retain(UnixSeconds now_s);

    const SpoolOptions& options_;
    Ledger& ledger_;
    ClockWatch clock_;
    UnixSeconds retained_s_ = 0;  // when ages were last looked at
};

}  // namespace qduino::spool
