#include "spool/disk/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "posix/durable_file.h"
#include "posix/small_file.h"
#include "posix/unique_fd.h"
#include "spool/disk/file_error.h"
#include "spool/disk/store_schema.h"

namespace qduino::spool {

namespace {

std::atomic<StepHook> step_hook{nullptr};

void step(const char* name) {
    if (const StepHook hook = step_hook.load(std::memory_order_relaxed)) hook(name);
}

std::filesystem::path journal_of(const std::filesystem::path& folder) { return folder / "journal.sqlite"; }
std::filesystem::path copy_of(const std::filesystem::path& folder) { return folder / "journal.copy.sqlite"; }

std::filesystem::path with(const std::filesystem::path& file, const char* ending) {
    return file.string() + ending;
}

bool is_missing_or_empty(const std::filesystem::path& file) {
    std::error_code absent;
    const std::uintmax_t size = std::filesystem::file_size(file, absent);
    return absent || size <= 1;  // SQLite takes a file of one byte for an empty one
}

/// SQLite writes whole pages only. But it takes a last page that was cut off for one that ends in
/// zeros, and calls the file sound.
bool ends_within_a_page(const std::filesystem::path& file) {
    std::array<char, 18> head{};
    const posix::UniqueFd opened{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
    const Result<std::size_t> read = posix::read_some(opened.get(), head, "the journal");
    // SQLite itself reports this case.
    if (!read || *read < head.size()) return false;
    // "Database File Format", 1.3.2
    const unsigned stored = static_cast<unsigned char>(head[16]) << 8U | static_cast<unsigned char>(head[17]);
    const std::uintmax_t page_bytes = stored == 1 ? 65536 : stored;
    std::error_code absent;
    const std::uintmax_t size = std::filesystem::file_size(file, absent);
    return !absent && page_bytes >= 512 && size % page_bytes != 0;
}

void remove_parts(const std::filesystem::path& folder) {
    std::error_code failed;
    for (const auto& entry : std::filesystem::directory_iterator{folder, failed}) {
        const std::string name = entry.path().filename().string();
        std::error_code ignored;
        if (name.starts_with("journal.") && name.find(".part") != std::string::npos)
            std::filesystem::remove(entry.path(), ignored);
    }
}

/// The error as a person gets it, with the way out.
Error with_way_out(const Error& error) {
    if (error.code == ErrorCode::unsupported) {
        return make_error(
            error.code,
            "the job journal was written by a newer version of this program: install that one again, or run "
            "printd --recover, which sets the journal aside and makes held jobs of the stored files");
    }
    return make_error(
        error.code, "the job journal is damaged (", error.message.view().substr(0, 90),
        ") and there is no sound copy; printd --recover sets it aside and makes held jobs of the stored "
        "files");
}

/// The repaired journal, beside the damaged one, whole and held.
Result<void> make_repaired(const std::filesystem::path& folder, const std::filesystem::path& part,
                           const std::string& reason) {
    std::error_code failed;
    std::filesystem::copy_file(copy_of(folder), part, std::filesystem::copy_options::overwrite_existing,
                               failed);
    if (failed) return file_error("copy", "the journal's copy", failed.value());
    step("repair: copied");
    {
        QDUINO_TRY_ASSIGN(std::unique_ptr<SqliteStore> store, SqliteStore::open(part));
        QDUINO_TRY(store->hold_everything(reason));
    }  // closed: its log is in it
    if (!is_missing_or_empty(with(part, "-wal")))
        return make_error(ErrorCode::internal, "job store: the repair did not close");
    return posix::sync_to_disk(part);
}

Result<OpenedJournal> repair(const std::filesystem::path& folder, UnixSeconds now_s, const Error& damage) {
    if (is_missing_or_empty(copy_of(folder))) return with_way_out(damage);
    const std::string why{damage.message.view()};
    const std::string reason =
        "the job journal was damaged and has been repaired from its copy: look through the jobs, all of them "
        "are held; "
        "the last ones may have been printed already";
    const std::filesystem::path part = folder / "journal.repaired.part";
    const Result<void> made = make_repaired(folder, part, reason);
    if (!made.ok()) return made.error().code == ErrorCode::corrupt ? with_way_out(damage) : made.error();
    step("repair: made");
    QDUINO_TRY_ASSIGN(const std::string aside, set_journal_aside(folder, now_s));
    step("repair: set aside");
    QDUINO_TRY(posix::rename_and_sync(part, journal_of(folder)));
    step("repair: named");
    QDUINO_TRY_ASSIGN(std::unique_ptr<SqliteStore> store, SqliteStore::open(journal_of(folder)));
    return OpenedJournal{std::move(store), why + (aside.empty() ? "" : "; it was set aside as " + aside)};
}

}  // namespace

void set_journal_step_hook(StepHook hook) { step_hook.store(hook); }

Result<std::string> set_journal_aside(const std::filesystem::path& folder, UnixSeconds now_s) {
    const std::filesystem::path journal = journal_of(folder);
    const std::string stem = "journal.damaged-" + utc_text(now_s, "%Y%m%d-%H%M%S");
    std::string name = stem + ".sqlite";
    for (int i = 2; std::filesystem::exists(folder / name); ++i)
        name = text<std::string>(stem, '-', i, ".sqlite");
    const std::filesystem::path aside = folder / name;
    // The journal first. SQLite ignores a log without its journal; a journal without its log would
    // pass for a sound, older one.
    if (::rename(journal.c_str(), aside.c_str()) != 0) {
        if (errno != ENOENT) return file_error("set aside", "the journal", errno);
        name.clear();
    }
    step("set aside: journal");
    for (const char* ending : {"-wal", "-shm"}) {
        if (::rename(with(journal, ending).c_str(), with(aside, ending).c_str()) != 0 && errno != ENOENT)
            return file_error("set aside", "the journal's log", errno);
    }
    QDUINO_TRY(posix::sync_to_disk(folder));
    return name;
}

void set_copy_aside(const std::filesystem::path& folder, const std::string& journal_aside) {
    std::error_code ignored;  // there may be no copy
    std::filesystem::rename(copy_of(folder), folder / (journal_aside + ".copy"), ignored);
}

Result<OpenedJournal> open_journal(const std::filesystem::path& folder, UnixSeconds now_s) {
    remove_parts(folder);
    const std::filesystem::path journal = journal_of(folder);
    if (is_missing_or_empty(journal)) {
        const bool copied = !is_missing_or_empty(copy_of(folder));
        if (copied)
            return repair(folder, now_s,
                          make_error(ErrorCode::corrupt, "job store: the journal is missing or empty"));
        // Its log, if one is left, belongs to what is lost.
        for (const char* ending : {"-wal", "-shm"}) ::unlink(with(journal, ending).c_str());
    }
    if (ends_within_a_page(journal))
        return repair(folder, now_s,
                      make_error(ErrorCode::corrupt, "job store: the end of the journal is cut off"));
    Result<std::unique_ptr<SqliteStore>> store = SqliteStore::open(journal);
    if (store.ok()) return OpenedJournal{std::move(*store), {}};
    if (store.error().code == ErrorCode::unsupported) return with_way_out(store.error());
    if (store.error().code == ErrorCode::corrupt) return repair(folder, now_s, store.error());
    return store.error();
}

Result<void> copy_journal(const std::filesystem::path& folder) {
    static std::atomic<int> copies{0};
    const std::filesystem::path part = folder / (text<std::string>("journal.copy.", ++copies, ".part"));
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    step("copy: begin");
    try {
        SQLite::Database journal{journal_of(folder).string(), SQLite::OPEN_READONLY};
        journal.setBusyTimeout(5000);
        // VACUUM copies row by row through the trees and not page by page: damage ends it, and
        // never gets into a copy.
        SQLite::Statement copy{journal, "VACUUM INTO ?"};
        copy.bind(1, part.string());
        copy.exec();
    } catch (const SQLite::Exception& exception) {
        std::filesystem::remove(part, ignored);
        return as_error(exception);
    }
    step("copy: written");
    QDUINO_TRY(posix::sync_to_disk(part));
    step("copy: synced");
    const Result<void> named = posix::rename_and_sync(part, copy_of(folder));
    step("copy: named");
    return named;
}

void JournalCopier::wait() {
    if (thread_.joinable()) thread_.join();
}

void JournalCopier::begin() {
    wait();
    busy_.store(true, std::memory_order_relaxed);
    thread_ = std::thread{[this] {
        last_ = copy_journal(folder_);
        busy_.store(false, std::memory_order_release);
    }};
}

void JournalCopier::after(std::uint64_t commits) {
    const bool due = copied_ ? commits - copied_at_ >= kCopyEvery : commits > 0;
    if (!due || busy_.load(std::memory_order_acquire)) return;
    copied_ = true;
    copied_at_ = commits;
    begin();
}

void JournalCopier::begin_if_missing() {
    if (is_missing_or_empty(copy_of(folder_))) begin();
}

Result<void> JournalCopier::finish(std::uint64_t commits) {
    wait();
    if (commits == copied_at_ && last_.ok()) return {};  // none since the last copy, or none at all
    copied_at_ = commits;
    last_ = copy_journal(folder_);
    return last_;
}

std::string JournalCopier::take_trouble() {
    if (busy_.load(std::memory_order_acquire) || last_.ok()) return {};
    std::string text{last_.error().message.view()};
    last_ = {};
    return text;
}

}  // namespace qduino::spool
