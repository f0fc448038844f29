// IPAddress: an IPv4 address, as four bytes, a 32-bit number in network order, or text; or an IPv6
// address, as sixteen bytes or text. (As in ArduinoCore-API.)
//
//   bytes_   0 … 11   12 … 15
//   IPv4     zeros    a.b.c.d
//   IPv6     ────── all ─────
//
// The sockets here speak IPv4: Network.h refuses to connect or to send to an IPv6 address.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "arduino/Print.h"
#include "arduino/Printable.h"

enum IPType { IPv4, IPv6 };

class IPAddress : public Printable {
    static constexpr std::size_t kV4 = 12;
    /// A pointer to these, and not a 0, which may mean an address as well.
    template <typename T, typename Pointed>
    static constexpr bool points_to = std::is_convertible_v<T, const Pointed*> && !std::is_null_pointer_v<T>;

  public:
    constexpr IPAddress() = default;
    /// No address yet, of this type: 0.0.0.0 or ::.
    explicit constexpr IPAddress(IPType type) : type_(type) {}
    constexpr IPAddress(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d)
        : bytes_{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, a, b, c, d} {}
    constexpr IPAddress(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d, std::uint8_t e,
                        std::uint8_t f, std::uint8_t g, std::uint8_t h, std::uint8_t i, std::uint8_t j,
                        std::uint8_t k, std::uint8_t l, std::uint8_t m, std::uint8_t n, std::uint8_t o,
                        std::uint8_t p)
        : bytes_{a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p}, type_(IPv6) {}
    /// The bytes as they lie in memory: network order.
    IPAddress(std::uint32_t address);  // NOLINT: implicit, as the language has it
    /// Four bytes; sixteen for IPv6.
    IPAddress(IPType type, const std::uint8_t* bytes);
    template <typename Bytes>
    requires(points_to<Bytes, std::uint8_t>) explicit IPAddress(const Bytes& bytes)
        : IPAddress(IPv4, static_cast<const std::uint8_t*>(bytes)) {}
    /// What fromString() makes of it; 0.0.0.0 when that is nothing.
    template <typename Text>
    requires(points_to<Text, char>) IPAddress(const Text& text) {  // NOLINT: implicit
        fromString(static_cast<const char*>(text));
    }

    /// Four bytes. (A template, so that `ip = {}` means one thing alone.)
    template <typename Bytes>
    requires(points_to<Bytes, std::uint8_t>) IPAddress& operator=(const Bytes& bytes) {
        return *this = IPAddress(bytes);
    }

    /// 0 of an IPv6 address.
    operator std::uint32_t() const;  // NOLINT
    [[nodiscard]] IPType type() const { return type_; }
    std::uint8_t operator[](int index) const { return bytes_[place(index)]; }
    std::uint8_t& operator[](int index) { return bytes_[place(index)]; }
    bool operator==(const IPAddress& other) const { return type_ == other.type_ && bytes_ == other.bytes_; }
    /// Four bytes: no IPv6 address equals them.
    bool operator==(const std::uint8_t* bytes) const { return *this == IPAddress(IPv4, bytes); }

    /// "192.168.0.7", "2001:db8::7". False, and nothing changed, when `text` is not an address.
    bool fromString(const char* text);
    bool fromString(const String& text) { return fromString(text.c_str()); }
    /// All digits of an IPv6 address: "2001:0db8:0000:0000:0000:0000:0000:0007".
    [[nodiscard]] String toString() const;
    /// The short form of an IPv6 address (RFC 5952): "2001:db8::7".
    std::size_t printTo(Print& out) const override;

  private:
    [[nodiscard]] std::size_t place(int index) const {
        const auto number = static_cast<std::size_t>(index);
        return type_ == IPv4 ? kV4 + (number & 3) : number & 15;
    }
    [[nodiscard]] unsigned group(std::size_t index) const {
        return unsigned{bytes_[2 * index]} << 8 | bytes_[2 * index + 1];
    }

    alignas(4) std::array<std::uint8_t, 16> bytes_{};
    IPType type_ = IPv4;
};

// The system's headers have a number of this name.
#undef INADDR_NONE
inline const IPAddress INADDR_NONE{IPv4};
inline const IPAddress IN6ADDR_ANY{IPv6};

namespace arduino {
using ::IN6ADDR_ANY;
using ::INADDR_NONE;
using ::IPAddress;
using ::IPType;
using ::IPv4;
using ::IPv6;
}  // namespace arduino
