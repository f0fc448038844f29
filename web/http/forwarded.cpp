#include "web/http/forwarded.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace qduino::web {

namespace {

/// In the system's own spelling, an IPv4 address in IPv6 as IPv4; empty when it is no address.
std::string canonical(std::string_view text) {
    constexpr std::size_t kLongest = 64;
    if (text.empty() || text.size() > kLongest || text.find('\0') != std::string_view::npos) return {};
    const std::string address{text};
    std::array<char, INET6_ADDRSTRLEN> spelled{};
    in_addr four{};
    in6_addr six{};
    if (::inet_pton(AF_INET, address.c_str(), &four) == 1)
        return ::inet_ntop(AF_INET, &four, spelled.data(), spelled.size());
    if (::inet_pton(AF_INET6, address.c_str(), &six) != 1) return {};
    if (IN6_IS_ADDR_V4MAPPED(&six)) {
        std::memcpy(&four, &six.s6_addr[12], sizeof four);
        return ::inet_ntop(AF_INET, &four, spelled.data(), spelled.size());
    }
    return ::inet_ntop(AF_INET6, &six, spelled.data(), spelled.size());
}

/// "192.0.2.7", "192.0.2.7:4711", "2001:db8::7", "[2001:db8::7]:4711".
std::string address_of_hop(std::string_view hop) {
    if (hop.starts_with('[')) return canonical(hop.substr(1, hop.find(']') - 1));
    const bool has_port = std::ranges::count(hop, ':') == 1;
    return canonical(has_port ? hop.substr(0, hop.find(':')) : hop);
}

/// The value of a field that stands there once; nothing otherwise.
std::string_view only_value(const RequestHead& head, std::string_view name) {
    const auto is_it = [&](const Header& header) { return equal_ignoring_case(header.name, name); };
    return std::ranges::count_if(head.headers, is_it) == 1 ? trimmed(head.value(name)) : std::string_view{};
}

/// "/printer", "/a/b": what needs no quoting in a cookie or an address; empty otherwise.
std::string prefix_of(std::string_view text) {
    if (text.size() > Proxies::kPrefixMax || !text.starts_with('/')) return {};
    while (text.ends_with('/')) text.remove_suffix(1);
    const auto is_plain = [](char c) {
        return is_letter_or_digit(c) || c == '/' || c == '-' || c == '_' || c == '.';
    };
    const bool plain = std::ranges::all_of(text, is_plain) && text.find("//") == std::string_view::npos &&
                       text.find("..") == std::string_view::npos;
    return plain ? std::string{text} : std::string{};
}

}  // namespace

bool is_numeric_address(std::string_view text) { return !canonical(text).empty(); }

bool is_loopback_address(std::string_view address) {
    const std::string spelled = canonical(address);
    return spelled == "::1" || (spelled.starts_with("127.") && spelled.find(':') == std::string::npos);
}

std::string limited_name_of(std::string_view address) {
    const std::string spelled = canonical(address);
    if (spelled.empty()) return std::string{address};
    in6_addr six{};
    if (::inet_pton(AF_INET6, spelled.c_str(), &six) != 1) return spelled;
    std::fill(std::begin(six.s6_addr) + 8, std::end(six.s6_addr), std::uint8_t{0});
    std::array<char, INET6_ADDRSTRLEN> network{};
    return std::string{::inet_ntop(AF_INET6, &six, network.data(), network.size())} + "/64";
}

Proxies::Proxies(std::vector<std::string> trusted) : trusted_(std::move(trusted)) {
    for (std::string& address : trusted_) address = canonical(address);
    std::erase(trusted_, "");
}

bool Proxies::trusts(std::string_view address) const {
    return std::ranges::find(trusted_, address) != trusted_.end();
}

/// The last address of X-Forwarded-For that is no proxy of ours; `peer` when there is none.
std::string Proxies::last_stranger(const RequestHead& head, const std::string& peer) const {
    std::string hops;
    for (const Header& header : head.headers) {
        if (!equal_ignoring_case(header.name, "X-Forwarded-For")) continue;
        if (!hops.empty()) hops += ',';
        hops += header.value;
    }
    std::string last = peer;
    for (std::string_view rest = hops; !rest.empty();) {
        const std::size_t comma = rest.rfind(',');
        const std::size_t begin = comma == std::string_view::npos ? 0 : comma + 1;
        const std::string address = address_of_hop(trimmed(rest.substr(begin)));
        if (address.empty()) return last;
        last = address;
        if (!trusts(address)) return last;
        rest = rest.substr(0, begin == 0 ? 0 : comma);
    }
    return last;
}

Client Proxies::client_of(const RequestHead& head, const Peer& peer) const {
    Client client;
    client.secure = peer.secure;
    const std::string* const host = head.find("Host");
    client.host = host ? *host : peer.reached;
    if (!trusts(canonical(peer.address))) {
        client.name = limited_name_of(peer.address);
        return client;
    }
    client.name = limited_name_of(last_stranger(head, peer.address));
    const std::string_view scheme = only_value(head, "X-Forwarded-Proto");
    if (equal_ignoring_case(scheme, "https")) client.secure = true;
    if (equal_ignoring_case(scheme, "http")) client.secure = false;
    client.prefix = prefix_of(only_value(head, "X-Forwarded-Prefix"));
    return client;
}

}  // namespace qduino::web
