// String: Arduino's text, over std::string (up to 15 characters without a heap).
//
// It differs from std::string where the language does: numbers turn into text by constructor and by
// +; an index outside reads as 0 and writes nowhere; indexOf() gives -1; toInt() of no number gives
// 0. Longer strings allocate: build them in setup() or in a loop that has no hard deadline.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>

#include "arduino/core/constants.h"
#include "arduino/core/program_memory.h"

/// Text in flash on an AVR. Here it is ordinary memory, but a type of its own, so that the
/// overloads of libraries resolve.
class __FlashStringHelper;
#ifndef F
#define F(text) (reinterpret_cast<const __FlashStringHelper*>(PSTR(text)))
#endif

class String {
    template <typename T>
    static constexpr bool is_number = std::is_arithmetic_v<T>;

  public:
    String(const char* text = "");  // NOLINT: implicit, as the language has it
    String(const char* text, unsigned int length);
    String(const std::uint8_t* text, unsigned int length);
    String(const __FlashStringHelper* text);  // NOLINT
    String(const String&) = default;
    String(String&&) noexcept = default;
    explicit String(char c);
    /// In a base other than 10 a negative number is its two's complement, as wide as its own type.
    template <typename T>
    requires(std::is_integral_v<T> ||
             (std::is_enum_v<T> &&
              std::is_convertible_v<T, long long>)) explicit String(T value, unsigned char base = 10) {
        const auto number = +value;
        using Bits = std::make_unsigned_t<decltype(+value)>;
        const bool minus = base == 10 && number < 0;
        set_number(minus ? Bits{0} - static_cast<Bits>(number) : static_cast<Bits>(number), minus, base);
    }
    /// All digits before the point, where print() says "ovf" beyond 32 bits.
    explicit String(float value, unsigned char decimals = 2);
    explicit String(double value, unsigned char decimals = 2);
    ~String() = default;

    String& operator=(const String&) = default;
    String& operator=(String&& other) noexcept {
        if (this == &other) return *this;
        text_ = std::move(other.text_);
        valid_ = other.valid_;
        return *this;
    }
    String& operator=(const char* text) { return *this = String(text); }
    String& operator=(const __FlashStringHelper* text) { return *this = String(text); }
    String& operator=(char c) { return *this = String(c); }

    /// False only for a String made of a null pointer.
    explicit operator bool() const { return valid_; }

    bool reserve(unsigned int size);
    [[nodiscard]] unsigned int length() const { return static_cast<unsigned int>(text_.size()); }
    [[nodiscard]] bool isEmpty() const { return text_.empty(); }
    void clear() { text_.clear(); }
    [[nodiscard]] const char* c_str() const { return text_.c_str(); }
    char* begin() { return text_.data(); }
    char* end() { return text_.data() + text_.size(); }
    [[nodiscard]] const char* begin() const { return text_.data(); }
    [[nodiscard]] const char* end() const { return text_.data() + text_.size(); }

    // ---- appending: false when nothing was appended (a null pointer) ----------------------------
    bool concat(const String& other);
    bool concat(const char* text);
    bool concat(const char* text, unsigned int length);
    bool concat(const std::uint8_t* text, unsigned int length);
    bool concat(const __FlashStringHelper* text) { return concat(reinterpret_cast<const char*>(text)); }
    bool concat(char c) { return concat(&c, 1); }
    template <typename T>
    requires is_number<T>
    bool concat(T value) { return concat(String(promoted(value))); }
    template <typename T>
    String& operator+=(const T& value) {
        concat(value);
        return *this;
    }
    friend String operator+(String left, const String& right) { return left += right; }
    friend String operator+(String left, const char* right) { return left += right; }
    friend String operator+(String left, const __FlashStringHelper* right) { return left += right; }
    friend String operator+(const char* left, const String& right) { return String(left) += right; }
    friend String operator+(const __FlashStringHelper* left, const String& right) {
        return String(left) += right;
    }
    template <typename T>
    requires is_number<T>
    friend String operator+(String left, T right) { return left += right; }
    template <typename T>
    requires is_number<T>
    friend String operator+(T left, const String& right) { return String(promoted(left)) += right; }

    // ---- comparing ------------------------------------------------------------------------------
    [[nodiscard]] int compareTo(const String& other) const { return std::strcmp(c_str(), other.c_str()); }
    [[nodiscard]] bool equals(const String& other) const { return text_ == other.text_; }
    [[nodiscard]] bool equals(const char* text) const { return text_ == (text ? text : ""); }
    [[nodiscard]] bool equalsIgnoreCase(const String& other) const;
    [[nodiscard]] bool startsWith(const String& prefix, unsigned int offset = 0) const;
    [[nodiscard]] bool endsWith(const String& suffix) const {
        return std::string_view(text_).ends_with(suffix.text_);
    }
    friend bool operator==(const String& a, const String& b) { return a.equals(b); }
    friend bool operator==(const String& a, const char* b) { return a.equals(b); }
    friend bool operator<(const String& a, const String& b) { return a.compareTo(b) < 0; }
    friend bool operator>(const String& a, const String& b) { return a.compareTo(b) > 0; }
    friend bool operator<=(const String& a, const String& b) { return a.compareTo(b) <= 0; }
    friend bool operator>=(const String& a, const String& b) { return a.compareTo(b) >= 0; }

    // ---- characters -----------------------------------------------------------------------------
    [[nodiscard]] char charAt(unsigned int index) const { return index < length() ? text_[index] : '\0'; }
    void setCharAt(unsigned int index, char c);
    char operator[](unsigned int index) const { return charAt(index); }
    char& operator[](unsigned int index);
    /// Copies from `index` as much as fits, terminated.
    void getBytes(unsigned char* buffer, unsigned int size, unsigned int index = 0) const;
    void toCharArray(char* buffer, unsigned int size, unsigned int index = 0) const;

    // ---- searching: -1 when not found -----------------------------------------------------------
    [[nodiscard]] int indexOf(char c, unsigned int from = 0) const;
    [[nodiscard]] int indexOf(const String& text, unsigned int from = 0) const;
    [[nodiscard]] int lastIndexOf(char c) const;
    [[nodiscard]] int lastIndexOf(char c, unsigned int from) const;
    [[nodiscard]] int lastIndexOf(const String& text) const;
    [[nodiscard]] int lastIndexOf(const String& text, unsigned int from) const;
    /// From `from` up to but not including `to`; bounds in the wrong order are swapped, beyond the
    /// end are cut.
    [[nodiscard]] String substring(unsigned int from) const { return substring(from, length()); }
    [[nodiscard]] String substring(unsigned int from, unsigned int to) const;

    // ---- changing -------------------------------------------------------------------------------
    void replace(char find, char with);
    void replace(const String& find, const String& with);
    void remove(unsigned int index) { remove(index, length()); }
    void remove(unsigned int index, unsigned int count);
    void toLowerCase();
    void toUpperCase();
    void trim();

    // ---- numbers: text behind the number is ignored; no number is 0 -----------------------------
    [[nodiscard]] qduino::arduino::Long toInt() const {
        return static_cast<qduino::arduino::Long>(std::strtol(c_str(), nullptr, 10));
    }
    [[nodiscard]] float toFloat() const { return static_cast<float>(toDouble()); }
    [[nodiscard]] double toDouble() const { return std::strtod(c_str(), nullptr); }

  private:
    /// The constructor's own type for a number: bool and short count as int, char as a character.
    template <typename T>
    static constexpr auto promoted(T value) {
        if constexpr (std::is_same_v<T, char> || std::is_same_v<T, unsigned char> ||
                      std::is_floating_point_v<T>) {
            if constexpr (std::is_same_v<T, long double>) {
                return static_cast<double>(value);
            } else {
                return value;
            }
        } else {
            return +value;
        }
    }

    void set_number(std::uint64_t value, bool minus, unsigned base);

    std::string text_;
    bool valid_ = true;
};

/// The AVR core's helper type; some libraries name it.
using StringSumHelper = String;

namespace arduino {
using ::__FlashStringHelper;
using ::String;
using ::StringSumHelper;
}  // namespace arduino
