#include "arduino/libraries/EEPROM/EEPROM.h"

#include <array>
#include <atomic>

#include "arduino/avr/eeprom.h"
#include "arduino/core/constants.h"
#include "arduino/core/diagnostics.h"
#include "arduino/core/lock.h"
#include "arduino/libraries/EEPROM/eeprom_file.h"
#include "board/real_time_mark.h"

using qduino::arduino::report_error;
using qduino::board::AllowAllocation;

EEPROMClass EEPROM QDUINO_BEFORE_SKETCH;

namespace {

constexpr std::size_t kSize = E2END + 1;

// Once in a run: the first access opens the file, in setup() or out of time.
qduino::arduino::Lock opening{"EEPROM", qduino::runtime::Unsaid::brief};
std::atomic<std::uint8_t*> bytes{nullptr};  // null until first used
bool in_file = false;

std::uint8_t* in_memory_alone() {
    static std::array<std::uint8_t, kSize> memory = [] {
        std::array<std::uint8_t, kSize> blank;
        blank.fill(0xff);
        return blank;
    }();
    return memory.data();
}

/// Maps the file at `path` (empty: the program's own). If that fails, keeps the present bytes, or
/// memory alone. Call under `opening`.
bool open_file(const std::string& path) {
    const auto mapped = qduino::arduino::map_eeprom(path, kSize);
    if (mapped.ok()) {
        in_file = true;
        bytes.store(mapped.value().data(), std::memory_order_release);
        return true;
    }
    report_error("EEPROM", 0, mapped.error());
    if (!bytes.load()) bytes.store(in_memory_alone(), std::memory_order_release);
    return false;
}

std::uint8_t* storage() {
    if (std::uint8_t* there = bytes.load(std::memory_order_acquire)) return there;
    const qduino::arduino::LockGuard held{opening};
    const AllowAllocation once{
        "EEPROM has no begin(): its file is opened at the first access, which may be a loop's"};
    if (!bytes.load()) open_file({});
    return bytes.load();
}

bool is_index(int index) { return index >= 0 && static_cast<std::size_t>(index) < kSize; }

}  // namespace

EERef::operator std::uint8_t() const { return EEPROM.read(index_); }
EERef& EERef::operator=(std::uint8_t value) {
    EEPROM.write(index_, value);
    return *this;
}

std::uint8_t EEPROMClass::read(int index) { return is_index(index) ? storage()[index] : 0xff; }

void EEPROMClass::write(int index, std::uint8_t value) {
    if (is_index(index)) storage()[index] = value;
}

void EEPROMClass::commit() {
    std::uint8_t* const memory = storage();
    if (in_file)
        qduino::arduino::succeeded("EEPROM.commit", 0, qduino::arduino::sync_eeprom({memory, kSize}));
}

bool EEPROMClass::open(const char* path) {
    const qduino::arduino::LockGuard held{opening};
    return open_file(path);
}

std::uint8_t qduino_eeprom_read(std::size_t index) {
    return index < kSize ? EEPROM.read(static_cast<int>(index)) : 0xff;
}
void qduino_eeprom_write(std::size_t index, std::uint8_t value) {
    if (index < kSize) EEPROM.write(static_cast<int>(index), value);
}
