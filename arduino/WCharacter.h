// The kinds of characters: the language's names for the C library's tests.
#pragma once

#include <cctype>

constexpr bool isAscii(int c) { return c >= 0 && c <= 127; }
inline bool isAlpha(int c) { return isAscii(c) && std::isalpha(c); }
inline bool isAlphaNumeric(int c) { return isAscii(c) && std::isalnum(c); }
inline bool isControl(int c) { return isAscii(c) && std::iscntrl(c); }
inline bool isDigit(int c) { return isAscii(c) && std::isdigit(c); }
inline bool isGraph(int c) { return isAscii(c) && std::isgraph(c); }
inline bool isHexadecimalDigit(int c) { return isAscii(c) && std::isxdigit(c); }
inline bool isLowerCase(int c) { return isAscii(c) && std::islower(c); }
inline bool isPrintable(int c) { return isAscii(c) && std::isprint(c); }
inline bool isPunct(int c) { return isAscii(c) && std::ispunct(c); }
inline bool isSpace(int c) { return isAscii(c) && std::isspace(c); }
inline bool isUpperCase(int c) { return isAscii(c) && std::isupper(c); }
/// A space or a tab, and nothing else.
constexpr bool isWhitespace(int c) { return c == ' ' || c == '\t'; }
constexpr int toAscii(int c) { return c & 0x7f; }
inline int toLowerCase(int c) { return isAscii(c) ? std::tolower(c) : c; }
inline int toUpperCase(int c) { return isAscii(c) ? std::toupper(c) : c; }

namespace arduino {
using ::isAlpha;
using ::isAlphaNumeric;
using ::isAscii;
using ::isControl;
using ::isDigit;
using ::isGraph;
using ::isHexadecimalDigit;
using ::isLowerCase;
using ::isPrintable;
using ::isPunct;
using ::isSpace;
using ::isUpperCase;
using ::isWhitespace;
using ::toAscii;
using ::toLowerCase;
using ::toUpperCase;
}  // namespace arduino
