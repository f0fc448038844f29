// EEPROM: 4096 bytes (the Mega's) that outlive the program, in a file.
//
// The file is mapped into memory. A write is a store, so it is safe in a real-time loop, and
// survives the death of the program at any instant (but not that of the computer, unless commit()
// was called after it). A byte never written is 0xff. The file is QDUINO_EEPROM, or else
// /qduino/<program>.eeprom in $XDG_STATE_HOME or ~/.local/state. If it cannot be made, that is
// reported once, and the bytes live in memory alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>

inline constexpr int E2END = 0xfff;

/// One byte of the EEPROM, as a thing that can be assigned to.
class EERef {
  public:
    explicit EERef(int index) : index_(index) {}
    operator std::uint8_t() const;  // NOLINT: a byte, wherever one is wanted
    EERef& operator=(std::uint8_t value);
    EERef& operator=(const EERef& other) { return *this = static_cast<std::uint8_t>(other); }
    EERef(const EERef&) = default;
    EERef& operator+=(std::uint8_t value) { return *this = static_cast<std::uint8_t>(*this + value); }
    EERef& operator-=(std::uint8_t value) { return *this = static_cast<std::uint8_t>(*this - value); }
    EERef& operator|=(std::uint8_t value) { return *this = static_cast<std::uint8_t>(*this | value); }
    EERef& operator&=(std::uint8_t value) { return *this = static_cast<std::uint8_t>(*this & value); }
    EERef& operator^=(std::uint8_t value) { return *this = static_cast<std::uint8_t>(*this ^ value); }
    EERef& operator++() { return *this += 1; }
    EERef& operator--() { return *this -= 1; }
    EERef& update(std::uint8_t value) { return *this = value; }

  private:
    int index_;
};

/// Walks over the bytes.
class EEPtr {
  public:
    using iterator_category = std::input_iterator_tag;
    using value_type = std::uint8_t;
    using difference_type = std::ptrdiff_t;
    using pointer = EERef*;
    using reference = EERef;

    explicit EEPtr(int index) : index_(index) {}
    operator int() const { return index_; }  // NOLINT
    EERef operator*() const { return EERef(index_); }
    EEPtr& operator++() {
        ++index_;
        return *this;
    }
    bool operator!=(const EEPtr& other) const { return index_ != other.index_; }
    bool operator==(const EEPtr& other) const { return index_ == other.index_; }

  private:
    int index_;
};

class EEPROMClass {
  public:
    /// An index outside 0…length()-1 reads as 0xff and writes nowhere.
    std::uint8_t read(int index);
    void write(int index, std::uint8_t value);
    /// As write(). (An AVR writes only when the byte differs, because its EEPROM wears.)
    void update(int index, std::uint8_t value) { write(index, value); }
    EERef operator[](int index) { return EERef(index); }

    /// Any plain object, byte by byte.
    template <typename T>
    T& get(int index, T& value) {
        static_assert(std::is_trivially_copyable_v<T>, "only plain bytes can be kept");
        std::uint8_t bytes[sizeof(T)];
        for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = read(index + static_cast<int>(i));
        std::memcpy(static_cast<void*>(&value), bytes, sizeof(T));
        return value;
    }
    template <typename T>
    const T& put(int index, const T& value) {
        static_assert(std::is_trivially_copyable_v<T>, "only plain bytes can be kept");
        std::uint8_t bytes[sizeof(T)];
        std::memcpy(bytes, &value, sizeof(T));
        for (std::size_t i = 0; i < sizeof(T); ++i) write(index + static_cast<int>(i), bytes[i]);
        return value;
    }

    EEPtr begin() { return EEPtr(0); }
    EEPtr end() { return EEPtr(length()); }
    static constexpr std::uint16_t length() { return E2END + 1; }

    /// Waits until the file is on the disk. Not for a real-time loop.
    void commit();
    /// Setup-time: opens (or changes to) the file at `path` now. False, and reported, when that
    /// fails.
    bool open(const char* path);
};

extern EEPROMClass EEPROM;
