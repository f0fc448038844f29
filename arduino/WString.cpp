#include "arduino/WString.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <limits>

#include "arduino/core/number_format.h"

namespace {

using qduino::arduino::format_float;
using qduino::arduino::format_unsigned;
using qduino::arduino::kDecimalsMax;
using qduino::arduino::kFloatTextMax;
using qduino::arduino::kIntegerTextMax;

std::string float_text(double value, unsigned decimals) {
    char text[kFloatTextMax];
    std::string written(text, format_float(text, value, decimals));
    if (written != "ovf") return written;
    char all[1 + std::numeric_limits<double>::max_exponent10 + 1 + kDecimalsMax + 2];
    const int shown = static_cast<int>(std::min(decimals, kDecimalsMax));
    return std::string(all, std::to_chars(all, all + sizeof all, value, std::chars_format::fixed, shown).ptr);
}

const char* plain(const __FlashStringHelper* text) { return reinterpret_cast<const char*>(text); }

int index_or_minus_one(std::size_t found) {
    return found == std::string::npos ? -1 : static_cast<int>(found);
}

}  // namespace

String::String(const char* text) : text_(text ? text : ""), valid_(text != nullptr) {}
String::String(const char* text, unsigned int length) : valid_(text != nullptr) {
    if (text) text_.assign(text, length);
}
String::String(const std::uint8_t* text, unsigned int length)
    : String(reinterpret_cast<const char*>(text), length) {}
String::String(const __FlashStringHelper* text) : String(plain(text)) {}
String::String(char c) : text_(1, c) {}
String::String(float value, unsigned char decimals)
    : text_(float_text(static_cast<double>(value), decimals)) {}
String::String(double value, unsigned char decimals) : text_(float_text(value, decimals)) {}

void String::set_number(std::uint64_t value, bool minus, unsigned base) {
    char text[kIntegerTextMax];
    text_.assign(text, format_unsigned(text, value, base));
    toLowerCase();
    if (minus) text_.insert(0, 1, '-');
}

bool String::reserve(unsigned int size) {
    text_.reserve(size);
    return true;
}

bool String::concat(const String& other) {
    text_ += other.text_;
    valid_ = valid_ || other.valid_;
    return other.valid_;
}
bool String::concat(const char* text) {
    return text && concat(text, static_cast<unsigned int>(std::strlen(text)));
}
bool String::concat(const char* text, unsigned int length) {
    if (!text) return false;
    text_.append(text, length);
    return valid_ = true;
}
bool String::concat(const std::uint8_t* text, unsigned int length) {
    return concat(reinterpret_cast<const char*>(text), length);
}

bool String::equalsIgnoreCase(const String& other) const {
    return std::equal(begin(), end(), other.begin(), other.end(), [](char a, char b) {
        return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
    });
}

bool String::startsWith(const String& prefix, unsigned int offset) const {
    return offset <= length() && text_.compare(offset, prefix.length(), prefix.text_) == 0;
}

void String::setCharAt(unsigned int index, char c) {
    if (index < length()) text_[index] = c;
}

char& String::operator[](unsigned int index) {
    thread_local char nowhere;
    nowhere = '\0';
    return index < length() ? text_[index] : nowhere;
}

void String::getBytes(unsigned char* buffer, unsigned int size, unsigned int index) const {
    if (!buffer || size == 0) return;
    const std::size_t count = index < length() ? std::min<std::size_t>(size - 1, length() - index) : 0;
    std::memcpy(buffer, text_.data() + (count ? index : 0), count);
    buffer[count] = 0;
}
void String::toCharArray(char* buffer, unsigned int size, unsigned int index) const {
    getBytes(reinterpret_cast<unsigned char*>(buffer), size, index);
}

int String::indexOf(char c, unsigned int from) const { return index_or_minus_one(text_.find(c, from)); }
int String::indexOf(const String& text, unsigned int from) const {
    return from < length() ? index_or_minus_one(text_.find(text.text_, from)) : -1;
}
int String::lastIndexOf(char c) const { return index_or_minus_one(text_.rfind(c)); }
int String::lastIndexOf(char c, unsigned int from) const {
    return from < length() ? index_or_minus_one(text_.rfind(c, from)) : -1;
}
int String::lastIndexOf(const String& text) const { return lastIndexOf(text, length()); }
int String::lastIndexOf(const String& text, unsigned int from) const {
    return text.isEmpty() ? -1 : index_or_minus_one(text_.rfind(text.text_, from));
}

String String::substring(unsigned int from, unsigned int to) const {
    if (from > to) std::swap(from, to);
    if (from >= length()) return String();
    return String(text_.data() + from, std::min(to, length()) - from);
}

void String::replace(char find, char with) { std::replace(text_.begin(), text_.end(), find, with); }

void String::replace(const String& find, const String& with) {
    if (find.isEmpty()) return;
    std::string result;
    std::size_t from = 0;
    for (std::size_t at; (at = text_.find(find.text_, from)) != std::string::npos;
         from = at + find.length()) {
        result.append(text_, from, at - from).append(with.text_);
    }
    text_ = result.append(text_, from);
}

void String::remove(unsigned int index, unsigned int count) {
    if (index < length()) text_.erase(index, count);
}

void String::toLowerCase() {
    for (char& c : text_) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}
void String::toUpperCase() {
    for (char& c : text_) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
}
void String::trim() {
    const auto is_space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
    text_.erase(std::find_if_not(text_.rbegin(), text_.rend(), is_space).base(), text_.end());
    text_.erase(text_.begin(), std::find_if_not(text_.begin(), text_.end(), is_space));
}
