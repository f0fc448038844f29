#include "spool/blob_store.h"

#include <fcntl.h>
#include <sodium/randombytes.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace qduino::spool {

namespace {

constexpr std::uint64_t kSpaceCheckEveryBytes = std::uint64_t{8} << 20;

Error system_error(std::string_view what, int number) {
    if (number == ENOSPC || number == EDQUOT) {
        return make_error(ErrorCode::unavailable,
                          "the disk is full; delete finished jobs or free some space");
    }
    const ErrorCode code =
        number == EACCES || number == EPERM ? ErrorCode::not_permitted : ErrorCode::internal;
    Error error{code, {}};
    error.message.append("job files: cannot ").append(what).append(": ").append(std::strerror(number));
    return error;
}

Result<void> write_all(int descriptor, std::span<const char> bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return system_error("write", errno);
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return {};
}

std::string random_name() {
    std::array<unsigned char, 16> bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    return sha256_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()}).substr(0, 32);
}

Result<void> sync_folder(const std::filesystem::path& folder) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return system_error("open the folder", errno);
    const int failed = ::fsync(descriptor) != 0 ? errno : 0;
    ::close(descriptor);
    if (failed) return system_error("sync the folder", failed);
    return {};
}

/// A small file, whole on the disk before it has its name.
Result<void> write_file(const std::filesystem::path& path, std::string_view bytes) {
    const std::filesystem::path part = path.string() + ".part";
    const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (descriptor < 0) return system_error("create", errno);
    Result<void> written = write_all(descriptor, {bytes.data(), bytes.size()});
    if (written.ok() && ::fdatasync(descriptor) != 0) written = system_error("sync", errno);
    ::close(descriptor);
    if (written.ok() && ::rename(part.c_str(), path.c_str()) != 0) written = system_error("rename", errno);
    if (!written.ok()) ::unlink(part.c_str());
    return written;
}

/// Packed layers can be made again from the bytes, but the job's row promises them: synced before they are named.
Result<void> sync_and_move(const std::filesystem::path& from, const std::filesystem::path& to) {
    const int descriptor = ::open(from.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0 && errno == ENOENT) return {};
    if (descriptor < 0) return system_error("open", errno);
    const int failed = ::fdatasync(descriptor) != 0 ? errno : 0;
    ::close(descriptor);
    if (failed) return system_error("sync", failed);
    if (::rename(from.c_str(), to.c_str()) != 0) return system_error("rename", errno);
    return {};
}

}  // namespace

StagedFile::StagedFile(std::filesystem::path path, int descriptor, BlobLimits limits)
    : path_(std::move(path)), descriptor_(descriptor), limits_(limits) {}

StagedFile::~StagedFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    ::unlink(path_.c_str());
    ::unlink(layers_path().c_str());
}

Result<void> StagedFile::write(std::span<const char> bytes) {
    QDUINO_EXPECT(descriptor_ >= 0);
    if (bytes.size() > limits_.size_max_bytes - size_) {
        return make_error(ErrorCode::out_of_range, "the file is longer than this printer accepts");
    }
    if (size_ == 0 || size_ - space_checked_at_ >= kSpaceCheckEveryBytes) {
        struct statvfs disk {};
        space_checked_at_ = size_;
        if (::fstatvfs(descriptor_, &disk) == 0 &&
            static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize < limits_.free_space_min_bytes) {
            return system_error("write", ENOSPC);
        }
    }
    const Result<void> written = write_all(descriptor_, bytes);
    if (!written.ok()) return written;
    hash_.add(bytes);
    size_ += bytes.size();
    return {};
}

Result<void> StagedFile::seal() {
    QDUINO_EXPECT(descriptor_ >= 0);
    const int failed = ::fdatasync(descriptor_) != 0 ? errno : 0;
    ::close(descriptor_);
    descriptor_ = -1;
    if (failed) return system_error("sync", failed);
    sha256_ = hash_.finish();
    return {};
}

BlobStore::BlobStore(std::filesystem::path folder, BlobLimits limits)
    : incoming_(folder / "incoming"), blobs_(folder / "blobs"), limits_(limits) {}

Result<std::unique_ptr<BlobStore>> BlobStore::open(const std::filesystem::path& folder, BlobLimits limits) {
    std::unique_ptr<BlobStore> store{new BlobStore{folder, limits}};
    std::error_code failed;
    for (const std::filesystem::path& each : {folder, store->incoming_, store->blobs_}) {
        std::filesystem::create_directories(each, failed);
        if (failed) return system_error("make the folder", failed.value());
        std::filesystem::permissions(each, std::filesystem::perms::owner_all, failed);
        if (failed) return system_error("restrict the folder", failed.value());
    }
    for (const auto& entry : std::filesystem::directory_iterator{store->incoming_, failed}) {
        std::error_code ignored;  // what cannot be swept now is swept next time
        std::filesystem::remove(entry.path(), ignored);
    }
    if (failed) return system_error("read the folder", failed.value());
    return store;
}

Result<std::unique_ptr<StagedFile>> BlobStore::stage() const {
    const std::filesystem::path path = incoming_ / random_name();
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (descriptor < 0) return system_error("create", errno);
    return std::unique_ptr<StagedFile>{new StagedFile{path, descriptor, limits_}};
}

Result<void> BlobStore::adopt(StagedFile& file, std::string_view layers_index,
                              std::string_view thumbnail) const {
    QDUINO_EXPECT(!file.sha256().empty());
    const std::string& name = file.sha256();
    // Companions first: once the blob itself has its name, the rest is there.
    Result<void> done = sync_and_move(file.layers_path(), path(name, BlobPart::layers));
    if (done.ok() && !layers_index.empty())
        done = write_file(path(name, BlobPart::layers_index), layers_index);
    if (done.ok() && !thumbnail.empty()) done = write_file(path(name, BlobPart::thumbnail), thumbnail);
    if (done.ok() && ::access(path(name, BlobPart::gcode).c_str(), F_OK) != 0) {
        if (::rename(file.path().c_str(), path(name, BlobPart::gcode).c_str()) != 0) {
            done = system_error("rename", errno);
        }
    }
    if (done.ok()) done = sync_folder(blobs_);
    return done;
}

void BlobStore::remove(const std::string& sha256) const {
    for (const BlobPart part :
         {BlobPart::gcode, BlobPart::layers, BlobPart::layers_index, BlobPart::thumbnail}) {
        ::unlink(path(sha256, part).c_str());
    }
}

void BlobStore::sweep(const std::set<std::string>& wanted) const {
    std::error_code failed;
    for (const auto& entry : std::filesystem::directory_iterator{blobs_, failed}) {
        const std::string name = entry.path().filename().string();
        const bool partial = name.ends_with(".part");
        if (!partial && wanted.contains(name.substr(0, name.find('.')))) continue;
        std::error_code ignored;
        std::filesystem::remove(entry.path(), ignored);
    }
}

std::filesystem::path BlobStore::path(const std::string& sha256, BlobPart part) const {
    switch (part) {
        case BlobPart::gcode:
            return blobs_ / (sha256 + ".gcode");
        case BlobPart::layers:
            return blobs_ / (sha256 + ".layers");
        case BlobPart::layers_index:
            return blobs_ / (sha256 + ".layers.json");
        case BlobPart::thumbnail:
            return blobs_ / (sha256 + ".png");
    }
    return {};
}

}  // namespace qduino::spool
