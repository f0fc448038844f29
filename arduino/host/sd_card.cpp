// SD.h over the files of the host.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "arduino/core/diagnostics.h"
#include "arduino/core/host_question.h"
#include "arduino/host/state_path.h"
#include "arduino/libraries/SD/SD.h"
#include "posix/unique_fd.h"

namespace fs = std::filesystem;

namespace qduino::arduino::host {

struct OpenFile {
    posix::UniqueFd descriptor;
    std::string path, name;
    bool is_folder = false;
    std::vector<std::string> entries{};  // of a folder: those that are still to come, the next last
};

namespace {

std::vector<std::string> entries_of(const std::string& folder) {
    std::vector<std::string> names;
    std::error_code failed;
    for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed))
        names.push_back(at->path().filename());
    std::ranges::sort(names, std::greater{});
    return names;
}

/// Opening a file, or looking for it, takes the host as long as so many short system calls.
constexpr int kPathCalls = 10;
constexpr auto kDisk = board::DeviceClass::disk;

File open_at(const std::string& path, int mode) {
    asked_in_vain(kDisk, kPathCalls);
    if (path.empty()) return File();
    std::error_code ignored;
    auto file = std::make_shared<OpenFile>();
    file->path = path;
    file->name = fs::path(path).filename();
    file->is_folder = fs::is_directory(path, ignored);
    // A file that is written can be read as well.
    const int access = (mode & O_ACCMODE) == O_RDONLY ? O_RDONLY : O_RDWR;
    const int how =
        file->is_folder ? O_RDONLY | O_DIRECTORY : access | (mode & (O_CREAT | O_APPEND | O_TRUNC | O_EXCL));
    file->descriptor.reset(::open(path.c_str(), how | O_CLOEXEC, 0666));
    if (!file->descriptor.valid()) return File();
    if (file->is_folder) file->entries = entries_of(path);
    if ((mode & O_APPEND) != 0) ::lseek(file->descriptor.get(), 0, SEEK_END);
    return File(std::move(file));
}

}  // namespace
}  // namespace qduino::arduino::host

using qduino::arduino::asked_in_vain;
using qduino::arduino::found_on;
using qduino::arduino::host::entries_of;
using qduino::arduino::host::kDisk;
using qduino::arduino::host::kPathCalls;
using qduino::arduino::host::open_at;

SDClass SD QDUINO_BEFORE_SKETCH;

// ---- File ---------------------------------------------------------------------------------------

std::size_t File::write(const std::uint8_t* buffer, std::size_t size) {
    std::size_t written = 0;
    while (file_ && written < size) {
        const ssize_t count = ::write(file_->descriptor.get(), buffer + written, size - written);
        if (count <= 0) break;
        written += static_cast<std::size_t>(count);
    }
    if (written < size) setWriteError();
    return written;
}

int File::available() {
    if (!file_ || file_->is_folder) return found_on(kDisk, 0);
    const std::uint32_t left = size() - std::min(position(), size());
    return found_on(kDisk, static_cast<int>(std::min<std::uint32_t>(left, 0x7FFF)));
}

int File::read() {
    std::uint8_t value = 0;
    return read(&value, 1) == 1 ? value : -1;
}

int File::read(void* buffer, std::size_t size) {
    if (!file_ || file_->is_folder) return found_on(kDisk, -1);
    return found_on(kDisk, static_cast<int>(::read(file_->descriptor.get(), buffer, size)));
}

int File::peek() {
    std::uint8_t value = 0;
    const bool readable = file_ && !file_->is_folder;
    const ssize_t count =
        readable ? ::pread(file_->descriptor.get(), &value, 1, static_cast<off_t>(position())) : -1;
    return found_on(kDisk, count) == 1 ? value : -1;
}

void File::flush() {
    if (file_ && !file_->is_folder) ::fsync(file_->descriptor.get());
}

bool File::seek(std::uint32_t position) {
    if (!file_ || position > size()) return false;
    return ::lseek(file_->descriptor.get(), static_cast<off_t>(position), SEEK_SET) >= 0;
}

std::uint32_t File::position() const {
    return file_ ? static_cast<std::uint32_t>(::lseek(file_->descriptor.get(), 0, SEEK_CUR)) : 0;
}

std::uint32_t File::size() const {
    struct stat status {};
    if (!file_ || file_->is_folder || ::fstat(file_->descriptor.get(), &status) != 0) return 0;
    return static_cast<std::uint32_t>(status.st_size);
}

const char* File::name() const { return file_ ? file_->name.c_str() : ""; }

bool File::isDirectory() const { return file_ && file_->is_folder; }

File File::openNextFile(int mode) {
    while (isDirectory() && !file_->entries.empty()) {
        const std::string path = file_->path + "/" + file_->entries.back();
        file_->entries.pop_back();
        if (File next = open_at(path, mode)) return next;  // else it has gone
    }
    return File();
}

void File::rewindDirectory() {
    if (isDirectory()) file_->entries = entries_of(file_->path);
}

// ---- SDClass ------------------------------------------------------------------------------------

bool SDClass::begin(int) {
    const std::string folder = qduino::arduino::host::state_path("QDUINO_SD", ".sd");
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (fs::is_directory(folder, failed)) {
        root_ = folder;
        return true;
    }
    return qduino::arduino::refuse("SD.begin", 0, qduino::ErrorCode::not_found, folder,
                                   " is no folder and cannot be made (set QDUINO_SD to one)");
}

std::string SDClass::place(const char* path) const {
    if (root_.empty() || path == nullptr) return {};
    std::string place = root_;
    for (const fs::path& part : fs::path(path).relative_path()) {
        if (part == "..") return {};
        if (!part.empty() && part != ".") place += "/" + part.string();
    }
    return place;
}

File SDClass::open(const char* path, int mode) { return open_at(place(path), mode); }

bool SDClass::exists(const char* path) {
    std::error_code ignored;
    const std::string there = place(path);
    asked_in_vain(kDisk, kPathCalls);
    return !there.empty() && fs::exists(there, ignored);
}

bool SDClass::mkdir(const char* path) {
    std::error_code failed;
    const std::string there = place(path);
    if (there.empty()) return false;
    fs::create_directories(there, failed);
    return fs::is_directory(there, failed);
}

bool SDClass::remove(const char* path) {
    const std::string there = place(path);
    return !there.empty() && ::unlink(there.c_str()) == 0;
}

bool SDClass::rmdir(const char* path) {
    const std::string there = place(path);
    return !there.empty() && there != root_ && ::rmdir(there.c_str()) == 0;
}
