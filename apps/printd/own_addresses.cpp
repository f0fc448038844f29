#include "apps/printd/own_addresses.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>

#include "posix/unique_fd.h"

namespace qduino::printd {

namespace {

std::string text_of(const in_addr& address) {
    std::array<char, INET_ADDRSTRLEN> spelled{};
    return ::inet_ntop(AF_INET, &address, spelled.data(), spelled.size());
}

/// No packet is sent: the kernel only chooses the way, and with it our address.
std::string source_of_default_route() {
    const posix::UniqueFd probe{::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
    sockaddr_in far{}, own{};
    far.sin_family = AF_INET;
    far.sin_port = htons(9);
    far.sin_addr.s_addr = htonl(0xC0000201);  // 192.0.2.1, nobody's (RFC 5737)
    socklen_t size = sizeof own;
    const auto* address = reinterpret_cast<const sockaddr*>(&far);
    if (!probe.valid() || ::connect(probe.get(), address, sizeof far) != 0) return {};
    return ::getsockname(probe.get(), reinterpret_cast<sockaddr*>(&own), &size) == 0 ? text_of(own.sin_addr)
                                                                                     : std::string{};
}

bool is_loopback_address(const std::string& address) { return address.starts_with("127."); }

}  // namespace

std::vector<std::string> own_addresses() {
    std::vector<std::string> addresses;
    ifaddrs* list = nullptr;
    if (::getifaddrs(&list) != 0) return addresses;
    for (const ifaddrs* each = list; each; each = each->ifa_next) {
        if (!each->ifa_addr || each->ifa_addr->sa_family != AF_INET || (each->ifa_flags & IFF_UP) == 0)
            continue;
        addresses.push_back(text_of(reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr));
    }
    ::freeifaddrs(list);
    return addresses;
}

std::string address_for_others() {
    const std::string routed = source_of_default_route();
    if (!routed.empty() && !is_loopback_address(routed)) return routed;
    for (const std::string& address : own_addresses())
        if (!is_loopback_address(address)) return address;
    return {};
}

}  // namespace qduino::printd
