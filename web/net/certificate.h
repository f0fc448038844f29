// A certificate that the service makes for itself: it names the printer and its addresses, and
// vouches for itself. A person who compares its fingerprint with the one that was printed at start
// knows that nobody stands between.
//
// Facts: RFC 5280; at most 825 days, as Apple's systems ask
// (https://support.apple.com/en-us/103769).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace qduino::web {

/// What a certificate has to name.
struct CertificateNames {
    std::vector<std::string> names;      ///< of hosts; others are left out
    std::vector<std::string> addresses;  ///< as numbers; others are left out
};

inline constexpr std::int64_t kCertificateDays = 820;
/// It is made anew so many days before it ends.
inline constexpr std::int64_t kCertificateRenewDays = 60;

/// A private key for it, PEM (NIST P-256).
[[nodiscard]] Result<std::string> make_private_key();
/// A certificate of `key_pem` for these names, PEM, from a day before `now_s` (Unix time) on.
[[nodiscard]] Result<std::string> make_certificate(const std::string& key_pem, const CertificateNames& names,
                                                   std::int64_t now_s);
/// True when it belongs to this key, names all of these, holds now, and will for long enough.
[[nodiscard]] bool is_certificate_good(const std::string& certificate_pem, const std::string& key_pem,
                                       const CertificateNames& names, std::int64_t now_s);
/// SHA-256 of the first certificate, as browsers show it: "AB:CD:…"; empty: it is none.
[[nodiscard]] std::string fingerprint_of(const std::string& certificate_pem);
/// "printer", "print.example.org": letters, digits, hyphens and dots, none of them at an end of a
/// label.
[[nodiscard]] bool is_host_name(std::string_view text);

}  // namespace qduino::web
