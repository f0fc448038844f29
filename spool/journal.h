// The journal's file and its copy: opened, checked, repaired from the copy when it is damaged, and copied while it is in use.
//
//   DIR/journal.sqlite              the journal, with -wal and -shm while it is open
//   DIR/journal.copy.sqlite         a consistent copy, some commits old at most (kCopyEvery)
//   DIR/journal.damaged-DATE.sqlite what was set aside; never removed by this program
//   DIR/*.part                      half of a copy or of a repair; removed at the next start
//
// A journal is damaged when SQLite says so of any of its pages, or when it is no SQLite file at all. Then the copy takes its
// place. It is older than what was lost: everything in it that waits or prints is held (Store::hold_everything), so that nothing
// prints twice. The steps are in such an order that a kill between any two leaves either the old state or a repair that is
// done again.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "base/result.h"
#include "spool/job.h"
#include "spool/store.h"

namespace qduino::spool {

/// Which step of a copy or a repair comes next; for tests that are killed there.
using StepHook = void (*)(const char* step);
void set_journal_step_hook(StepHook hook);

struct OpenedJournal {
    std::unique_ptr<Store> store;
    std::string repaired;  ///< why it had to be repaired; empty: it was sound
};

/// `now_s` names what is set aside. Errors: unsupported (a newer program's), corrupt (damaged, and there is no sound copy), both
/// with the way out; unavailable, internal. Only who holds the lock of the state folder may call this.
[[nodiscard]] Result<OpenedJournal> open_journal(const std::filesystem::path& folder, UnixSeconds now_s);

/// Moves the journal and its log out of the way, whatever it is. Gives the new name.
[[nodiscard]] Result<std::string> set_journal_aside(const std::filesystem::path& folder, UnixSeconds now_s);

/// Moves the journal's copy out of the way too, as "<journal_aside>.copy": else it would take the journal's place.
void set_copy_aside(const std::filesystem::path& folder, const std::string& journal_aside);

/// Writes a whole, checked copy of DIR/journal.sqlite, and gives it its name when it is on the disk. Beside a running journal: any
/// thread. Errors: corrupt (the journal; the last copy stays), unavailable, internal.
[[nodiscard]] Result<void> copy_journal(const std::filesystem::path& folder);

/// Copies now and then, on a thread of its own: the spool's thread feeds a printer meanwhile.
class JournalCopier {
  public:
    /// Commits between two copies.
    static constexpr std::uint64_t kCopyEvery = 64;

    explicit JournalCopier(std::filesystem::path folder) : folder_(std::move(folder)) {}
    ~JournalCopier() { wait(); }
    JournalCopier(const JournalCopier&) = delete;
    JournalCopier& operator=(const JournalCopier&) = delete;

    /// From the spool's thread, after commits: begins a copy when enough have come since the last one, or one since the start:
    /// what an earlier service left uncopied when it was killed is not known. Returns at once.
    void after(std::uint64_t commits);
    /// Begins one now, unless there is a copy already.
    void begin_if_missing();
    /// Copies what has not been copied yet, and waits for it: the journal is about to be closed.
    [[nodiscard]] Result<void> finish(std::uint64_t commits);
    /// Why the last copy failed, once; empty: it did not.
    [[nodiscard]] std::string take_trouble();

  private:
    void wait();
    void begin();
    std::filesystem::path folder_;
    bool copied_ = false;  // since the start
    std::uint64_t copied_at_ = 0;
    std::thread thread_;
    std::atomic<bool> busy_{false};
    Result<void> last_;  // written by the thread while busy_
};

}  // namespace qduino::spool
