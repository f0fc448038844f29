// The client behind a request that a proxy passes on. Pure.
//
//   browser 192.0.2.7 ──TLS──► proxy 127.0.0.1 ──► service
//                              X-Forwarded-For: 192.0.2.7      whom wrong keys are counted for
//                              X-Forwarded-Proto: https        the cookie is Secure
//                              Host: print.example             unchanged: compared with Origin
//                              X-Forwarded-Prefix: /printer    the path of cookies and addresses
//
// Anybody can send these fields. So they count only where the connection itself comes from an
// address that the owner has named (--trust-proxy). Of X-Forwarded-For the last address counts that
// is not such a proxy: what stands before it is the client's own word. A field that is doubled or
// malformed counts for nothing.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "web/http/http.h"

namespace qduino::web {

/// The other end of a connection.
struct Peer {
    std::string address;  ///< as numbers; an IPv4 address in its own form
    bool secure = false;  ///< TLS
    /// Where he has come to, `host:port`: the name that he calls when he says none (HTTP/1.0).
    std::string reached = "localhost";
};

/// True for an IPv4 or IPv6 address as numbers, without brackets or port.
[[nodiscard]] bool is_numeric_address(std::string_view text);

/// True for an address that only this computer can connect to: 127.…, ::1.
[[nodiscard]] bool is_loopback_address(std::string_view address);

/// The name under which an address is limited: an IPv4 address, or the first 64 bits of an IPv6
/// address, which one customer gets. Any other text stays as it is.
[[nodiscard]] std::string limited_name_of(std::string_view address);

class Proxies {
  public:
    static constexpr std::size_t kPrefixMax = 128;

    /// Addresses as numbers.
    explicit Proxies(std::vector<std::string> trusted = {});
    [[nodiscard]] Client client_of(const RequestHead& head, const Peer& peer) const;

  private:
    [[nodiscard]] bool trusts(std::string_view address) const;
    [[nodiscard]] std::string last_stranger(const RequestHead& head, const std::string& peer) const;

    std::vector<std::string> trusted_;  // each in the system's own spelling
};

}  // namespace qduino::web
