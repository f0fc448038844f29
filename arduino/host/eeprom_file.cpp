// The EEPROM in a file of the host.
#include "arduino/libraries/EEPROM/eeprom_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

#include "arduino/host/state_path.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::arduino {

namespace {

Error file_error(const std::string& path) {
    const Error error = posix::system_error("use", path);
    return make_error(error.code, error.message, " (set QDUINO_EEPROM to a file that can be written)");
}

/// Fills from the file's end up to `size` with 0xff. False, with errno, when it cannot.
bool fill_up(int descriptor, std::size_t size) {
    struct stat status {};
    if (fstat(descriptor, &status) != 0) return false;
    std::array<std::uint8_t, 512> blank;
    blank.fill(0xff);
    for (auto at = static_cast<std::size_t>(status.st_size); at < size;) {
        const std::size_t count = std::min(blank.size(), size - at);
        const ssize_t written = pwrite(descriptor, blank.data(), count, static_cast<off_t>(at));
        if (written <= 0) return false;
        at += static_cast<std::size_t>(written);
    }
    return true;
}

}  // namespace

Result<std::span<std::uint8_t>> map_eeprom(const std::string& asked, std::size_t size) {
    const std::string path = asked.empty() ? host::state_path("QDUINO_EEPROM", ".eeprom") : asked;
    const posix::UniqueFd file{open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
    if (!file.valid() || !fill_up(file.get(), size)) return file_error(path);
    void* memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
    if (memory == MAP_FAILED) return file_error(path);
    return std::span<std::uint8_t>{static_cast<std::uint8_t*>(memory), size};
}

Result<void> sync_eeprom(std::span<std::uint8_t> bytes) {
    if (msync(bytes.data(), bytes.size(), MS_SYNC) != 0) return file_error("EEPROM");
    return {};
}

}  // namespace qduino::arduino
