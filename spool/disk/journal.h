// The journal's file and its copy: opened, checked, repaired from the copy when it is damaged, and
// copied while it is in use.
//
//   DIR/journal.sqlite              the journal, with -wal and -shm while it is open
//   DIR/journal.copy.sqlite         a consistent copy, some commits old at most (kCopyEvery)
//   DIR/journal.damaged-DATE.sqlite a damaged one, set aside; this program never removes it
//   DIR/*.part                      half of a copy or of a repair; removed at the next start
//
// A journal is damaged when SQLite finds a damaged page, or when it is no SQLite file at all. Then
// the copy takes its place. The copy is older than the journal was, and a job could print twice. So
// everything in it that waits or prints is held (SqliteStore::hold_everything). A kill between any
// two steps leaves either the old state or a repair that is done again.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "base/result.h"
#include "spool/disk/sqlite_store.h"
#include "spool/job.h"

namespace qduino::spool {

/// Called before each step of a copy or a repair; for tests that kill there.
using StepHook = void (*)(const char* step);
void set_journal_step_hook(StepHook hook);

struct OpenedJournal {
    std::unique_ptr<SqliteStore> store;
    std::string repaired;  ///< why it had to be repaired; empty: it was sound
};

/// `now_s` dates the name of a journal that is set aside. Errors: unsupported (a newer program's),
/// corrupt (damaged, and there is no sound copy), both with the way out; unavailable, internal. The
/// caller must hold the lock of the state folder.
[[nodiscard]] Result<OpenedJournal> open_journal(const std::filesystem::path& folder, UnixSeconds now_s);

/// Moves the journal and its log out of the way, whatever they are. Returns the new name.
[[nodiscard]] Result<std::string> set_journal_aside(const std::filesystem::path& folder, UnixSeconds now_s);

/// Moves the journal's copy out of the way, too, as "<journal_aside>.copy": otherwise it would take
/// the journal's place.
void set_copy_aside(const std::filesystem::path& folder, const std::string& journal_aside);

/// Writes a whole, checked copy of DIR/journal.sqlite, and names it once it is on the disk. May run
/// beside a running journal: any thread. Errors: corrupt (the journal; the last copy stays),
/// unavailable, internal.
[[nodiscard]] Result<void> copy_journal(const std::filesystem::path& folder);

/// Copies now and then, on a thread of its own: meanwhile the spool's thread feeds a printer.
class JournalCopier {
  public:
    /// Commits between two copies.
    static constexpr std::uint64_t kCopyEvery = 64;

    explicit JournalCopier(std::filesystem::path folder) : folder_(std::move(folder)) {}
    ~JournalCopier() { wait(); }
    JournalCopier(const JournalCopier&) = delete;
    JournalCopier& operator=(const JournalCopier&) = delete;

    /// Call from the spool's thread after commits. Begins a copy when enough commits have come
    /// since the last copy. After the start one commit is enough: an earlier service may have been
    /// killed with some not copied. Returns at once.
    void after(std::uint64_t commits);
    /// Begins a copy now, unless there is one already.
    void begin_if_missing();
    /// Copies what is not copied yet, and waits for it: the journal is about to be closed.
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
