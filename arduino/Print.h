// Print: the base of everything that takes text and numbers. A device gives write(byte), and
// write(bytes) if it can do better.
//
// Numbers are formatted without heap or stdio. In a base other than 10 a negative number is printed
// as its two's complement, as wide as its own type: print(-1, HEX) is FFFFFFFF. One call of print
// or println reaches a shared device whole, not mixed with another loop's (see hold()).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "arduino/Printable.h"
#include "arduino/WString.h"
#include "arduino/core/constants.h"

class Print {
  public:
    virtual ~Print() = default;

    virtual std::size_t write(std::uint8_t value) = 0;
    /// Returns how many bytes were taken.
    virtual std::size_t write(const std::uint8_t* buffer, std::size_t size);
    std::size_t write(const char* text) { return text ? write(text, std::strlen(text)) : 0; }
    std::size_t write(const char* buffer, std::size_t size) {
        return write(reinterpret_cast<const std::uint8_t*>(buffer), size);
    }
    /// Bytes that can be written without waiting; 0 when the device cannot tell.
    virtual int availableForWrite() { return 0; }
    /// Waits until everything written has left.
    virtual void flush() {}

    [[nodiscard]] int getWriteError() const { return write_error_; }
    void clearWriteError() { write_error_ = 0; }

    std::size_t print(const String& text) { return write(text.c_str(), text.length()); }
    std::size_t print(const char* text) { return write(text); }
    std::size_t print(const __FlashStringHelper* text) { return write(reinterpret_cast<const char*>(text)); }
    std::size_t print(char c) { return write(static_cast<std::uint8_t>(c)); }
    std::size_t print(const Printable& thing) { return thing.printTo(*this); }
    /// `base` 2…36; 0 writes the number as one raw byte.
    template <typename T>
    requires(std::is_integral_v<T> || (std::is_enum_v<T> && std::is_convertible_v<T, long long>)) std::size_t
        print(T value, int base = DEC) {
        using Promoted = decltype(+value);
        if constexpr (std::is_signed_v<Promoted>) {
            return print_signed(+value, static_cast<std::make_unsigned_t<Promoted>>(+value), base);
        } else {
            return print_unsigned(+value, base);
        }
    }
    std::size_t print(double value, int decimals = 2);
    /// A byte that is an object: PORTB, EEPROM[3].
    template <typename T>
    requires requires(const T& value) { value.operator std::uint8_t(); }
    std::size_t print(const T& value, int base = DEC) { return print(value.operator std::uint8_t(), base); }

    std::size_t println() { return write("\r\n", 2); }
    template <typename T, typename... Format>
    requires(!std::is_scalar_v<std::decay_t<T>>) std::size_t println(const T& value, Format... format) {
        return print_line(value, format...);
    }
    template <typename T, typename... Format>
    requires(std::is_scalar_v<T>) std::size_t println(T value, Format... format) {
        return print_line(value, format...);
    }

  protected:
    void setWriteError(int error = 1) { write_error_ = error; }
    /// Between these the device belongs to the calling loop. Nested calls are allowed.
    virtual void hold() {}
    virtual void release() {}

  private:
    template <typename T, typename... Format>
    std::size_t print_line(const T& value, Format... format) {
        hold();
        const std::size_t size = print(value, format...) + println();
        release();
        return size;
    }
    std::size_t print_signed(std::int64_t value, std::uint64_t bits, int base);
    std::size_t print_unsigned(std::uint64_t value, int base);

    int write_error_ = 0;
};

namespace arduino {
using ::Print;
}  // namespace arduino
