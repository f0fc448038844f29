#include "spool/disk/blob_store.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "base/whole_number.h"
#include "base/words.h"
#include "posix/durable_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "spool/disk/file_error.h"

namespace qduino::spool {

namespace {

constexpr std::uint64_t kSpaceCheckEveryBytes = std::uint64_t{8} << 20;
constexpr const char* kJournalIdFile = "blobs-journal-id";
constexpr std::array kParts{BlobPart::layers, BlobPart::layers_index, BlobPart::thumbnail,
                            BlobPart::record, BlobPart::new_record,   BlobPart::gcode};

/// One line a record: number, time, name, separated by tabs. A name has no control characters.
std::string text_of(std::span<const UploadRecord> records) {
    std::string text;
    for (const auto& [id, uploaded_s, name] : records) write(text, id, '\t', uploaded_s, '\t', name, '\n');
    return text;
}

/// Nothing when the line is damaged.
std::optional<UploadRecord> record_of(std::string_view line) {
    UploadRecord record;
    for (std::int64_t* number : {&record.id, &record.uploaded_s}) {
        const std::size_t tab = line.find('\t');
        if (tab == std::string_view::npos) return std::nullopt;
        const auto whole = whole_number<std::int64_t>(line.substr(0, tab));
        if (!whole || *whole < 0) return std::nullopt;
        *number = *whole;
        line.remove_prefix(tab + 1);
    }
    record.name = line;
    return record;
}

/// Packed layers could be made again from the bytes. But the job's row promises them, so they are
/// synced before they get their name.
Result<void> sync_and_move(const std::filesystem::path& from, const std::filesystem::path& to) {
    if (::access(from.c_str(), F_OK) != 0 && errno == ENOENT) return {};
    QDUINO_TRY(posix::sync_to_disk(from));
    if (::rename(from.c_str(), to.c_str()) != 0) return posix::system_error("rename", "a file");
    return {};
}

}  // namespace

IncomingFile::IncomingFile(std::filesystem::path path, posix::UniqueFd file, BlobLimits limits)
    : path_(std::move(path)), file_(std::move(file)), limits_(limits) {}

IncomingFile::~IncomingFile() {
    ::unlink(path_.c_str());
    ::unlink(layers_path().c_str());
}

Result<void> IncomingFile::write(std::span<const char> bytes) {
    QDUINO_EXPECT(file_.valid());
    if (bytes.size() > limits_.size_max_bytes - size_) {
        return make_error(ErrorCode::out_of_range, "the file is longer than this printer accepts");
    }
    if (size_ == 0 || size_ - space_checked_at_ >= kSpaceCheckEveryBytes) {
        struct statvfs disk {};
        space_checked_at_ = size_;
        if (::fstatvfs(file_.get(), &disk) == 0 &&
            static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize < limits_.free_space_min_bytes) {
            return file_error("write", "a file", ENOSPC);
        }
    }
    const Result<void> written = posix::write_all(file_.get(), bytes, "a file");
    if (!written.ok()) return file_error(written.error());
    hash_.add(bytes);
    size_ += bytes.size();
    return {};
}

Result<void> IncomingFile::Layers::write(std::span<const char> bytes) {
    const Result<void> written = file_.write(bytes);
    return written.ok() ? written : file_error(written.error());
}

Result<void> IncomingFile::seal() {
    QDUINO_EXPECT(file_.valid());
    const posix::UniqueFd file = std::move(file_);
    if (::fdatasync(file.get()) != 0) return file_error("sync", "a file", errno);
    sha256_ = hash_.finish();
    return {};
}

std::shared_ptr<const ByteSource> IncomingFile::content() const { return posix::FileBytes::open(path_); }

std::uint64_t IncomingFile::layers_bytes() const {
    std::error_code absent;
    const std::uintmax_t bytes = std::filesystem::file_size(layers_path(), absent);
    return absent ? 0 : bytes;
}

BlobStore::BlobStore(std::filesystem::path folder, BlobLimits limits)
    : folder_(folder),
      incoming_(folder / "incoming"),
      blobs_(folder / "blobs"),
      set_aside_(folder / "set-aside"),
      limits_(limits) {}

Result<std::unique_ptr<BlobStore>> BlobStore::open(const std::filesystem::path& folder, BlobLimits limits) {
    std::unique_ptr<BlobStore> store{new BlobStore{folder, limits}};
    std::error_code failed;
    for (const std::filesystem::path& each : {folder, store->incoming_, store->blobs_}) {
        std::filesystem::create_directories(each, failed);
        if (failed) return file_error("make", "the folder", failed.value());
        std::filesystem::permissions(each, std::filesystem::perms::owner_all, failed);
        if (failed) return file_error("restrict", "the folder", failed.value());
    }
    for (const auto& entry : std::filesystem::directory_iterator{store->incoming_, failed}) {
        std::error_code ignored;  // what cannot be swept now is swept next time
        std::filesystem::remove(entry.path(), ignored);
    }
    if (failed) return file_error("read", "the folder", failed.value());
    return store;
}

Result<std::unique_ptr<StagedFile>> BlobStore::stage() {
    const std::filesystem::path path = incoming_ / random_name();
    posix::UniqueFd file{::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600)};
    if (!file.valid()) return file_error("create", "a file", errno);
    return std::unique_ptr<StagedFile>{new IncomingFile{path, std::move(file), limits_}};
}

Result<void> BlobStore::take_in(const std::string& sha256, const std::filesystem::path& gcode,
                                const std::filesystem::path& layers, const FileCompanions& companions,
                                std::span<const UploadRecord> records) const {
    // Companions first: once the blob itself has its name, everything else is there.
    Result<void> done = sync_and_move(layers, path(sha256, BlobPart::layers));
    if (done.ok() && !companions.layers_index.empty())
        done = posix::write_durably(path(sha256, BlobPart::layers_index), companions.layers_index);
    if (done.ok() && !companions.thumbnail.empty())
        done = posix::write_durably(path(sha256, BlobPart::thumbnail), companions.thumbnail);
    if (done.ok()) done = posix::write_durably(path(sha256, BlobPart::new_record), text_of(records));
    if (done.ok() && ::access(path(sha256, BlobPart::gcode).c_str(), F_OK) != 0) {
        if (::rename(gcode.c_str(), path(sha256, BlobPart::gcode).c_str()) != 0) {
            done = posix::system_error("rename", "a file");
        }
    }
    if (done.ok()) done = posix::sync_to_disk(blobs_);
    return done.ok() ? done : file_error(done.error());
}

Result<void> BlobStore::adopt(StagedFile& file, const FileCompanions& companions,
                              const UploadRecord& record) {
    QDUINO_EXPECT(!file.sha256().empty());
    const auto& incoming = static_cast<const IncomingFile&>(file);  // stage() makes no others
    std::vector<UploadRecord> all = records(file.sha256());
    if (all.size() >= kRecordsMax) all.erase(all.begin());
    all.push_back(record);
    return take_in(file.sha256(), incoming.path(), incoming.layers_path(), companions, all);
}

Result<void> BlobStore::adopt_again(const std::string& sha256, const std::filesystem::path& layers,
                                    const FileCompanions& companions, std::span<const UploadRecord> records) {
    QDUINO_TRY(take_in(sha256, part_of(set_aside_, sha256, BlobPart::gcode), layers, companions, records));
    confirm(sha256);
    for (const BlobPart part : kParts) ::unlink(part_of(set_aside_, sha256, part).c_str());
    return {};
}

void BlobStore::confirm(const std::string& sha256) {
    ::rename(path(sha256, BlobPart::new_record).c_str(), path(sha256, BlobPart::record).c_str());
}

void BlobStore::forget(const std::string& sha256, JobId id) {
    std::vector<UploadRecord> left = records(sha256);
    std::erase_if(left, [id](const UploadRecord& record) { return record.id == id; });
    // An upload that stays in the record comes back, held, after a repair: harmless.
    static_cast<void>(posix::write_durably(path(sha256, BlobPart::record), text_of(left)));
}

std::vector<UploadRecord> BlobStore::records(const std::string& sha256) const {
    for (const auto* folder : {&blobs_, &set_aside_}) {
        const Result<std::string> text = posix::read_small_file(part_of(*folder, sha256, BlobPart::record));
        if (!text.ok()) continue;
        std::vector<UploadRecord> found;
        for (std::string_view rest = *text; !rest.empty() && found.size() < kRecordsMax;) {
            const std::string_view line = rest.substr(0, rest.find('\n'));
            if (std::optional<UploadRecord> record = record_of(line)) found.push_back(std::move(*record));
            rest.remove_prefix(std::min(line.size() + 1, rest.size()));
        }
        return found;
    }
    return {};
}

void BlobStore::remove(const std::string& sha256) {
    for (const BlobPart part : kParts) ::unlink(path(sha256, part).c_str());
}

std::shared_ptr<const ByteSource> BlobStore::content(const std::string& sha256, FilePart part) const {
    return posix::FileBytes::open(path(sha256, static_cast<BlobPart>(part)));
}

void BlobStore::remove_partial(const std::string& name) const { ::unlink((blobs_ / name).c_str()); }

Result<void> BlobStore::set_aside(const std::string& sha256) const {
    std::error_code failed;
    std::filesystem::create_directories(set_aside_, failed);
    if (failed) return file_error("make", "the folder", failed.value());
    for (const BlobPart part :
         kParts) {  // the G-code last: while it is in its old place, this is tried again
        if (part == BlobPart::gcode) continue;
        ::rename(path(sha256, part).c_str(), part_of(set_aside_, sha256, part).c_str());
    }
    const auto from = path(sha256, BlobPart::gcode);
    if (::rename(from.c_str(), part_of(set_aside_, sha256, BlobPart::gcode).c_str()) != 0 && errno != ENOENT)
        return file_error("move aside", "a file", errno);
    return {};
}

std::vector<std::string> BlobStore::blobs_in(const std::filesystem::path& folder) {
    std::vector<std::string> found;
    std::error_code failed;
    for (const auto& entry : std::filesystem::directory_iterator{folder, failed}) {
        const std::string name = entry.path().filename().string();
        if (name.ends_with(".gcode")) found.push_back(name.substr(0, name.find('.')));
    }
    std::sort(found.begin(), found.end());
    return found;
}

std::string BlobStore::journal_id() const {
    const Result<std::string> text = posix::read_small_file(folder_ / kJournalIdFile);
    return text.ok() ? text->substr(0, text->find('\n')) : std::string{};
}

Result<void> BlobStore::set_journal_id(std::string_view id) const {
    QDUINO_TRY(posix::write_durably(folder_ / kJournalIdFile, text<std::string>(id, '\n')));
    return posix::sync_to_disk(folder_);
}

std::filesystem::path BlobStore::find_gcode(const std::string& sha256) const {
    const std::filesystem::path here = path(sha256, BlobPart::gcode);
    return ::access(here.c_str(), F_OK) == 0 ? here : part_of(set_aside_, sha256, BlobPart::gcode);
}

std::filesystem::path BlobStore::part_of(const std::filesystem::path& folder, const std::string& sha256,
                                         BlobPart part) {
    static constexpr Words<BlobPart::gcode, BlobPart::new_record> kEndings{
        ".gcode", ".layers", ".layers.json", ".png", ".job", ".job.new"};
    return folder / text<std::string>(sha256, kEndings(part));
}

}  // namespace qduino::spool
