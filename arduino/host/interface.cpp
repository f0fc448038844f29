#include "arduino/host/interface.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <netpacket/packet.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "arduino/libraries/network/interface.h"
#include "base/parts.h"
#include "base/whole_number.h"
#include "posix/small_file.h"

namespace qduino::arduino::host {
namespace {

std::uint32_t ipv4_of(const sockaddr* address) {
    sockaddr_in read{};
    if (address) std::memcpy(&read, address, sizeof read);
    return read.sin_addr.s_addr;
}

void read_hardware_address(const ifaddrs* all, std::string_view name, Interface& interface) {
    for (const ifaddrs* one = all; one; one = one->ifa_next) {
        if (!one->ifa_addr || one->ifa_addr->sa_family != AF_PACKET || name != one->ifa_name) continue;
        sockaddr_ll address{};
        std::memcpy(&address, one->ifa_addr, sizeof address);
        std::copy_n(address.sll_addr, interface.hardware_address.size(), interface.hardware_address.begin());
    }
}

struct NamedInterface : Interface {
    std::string name;  ///< empty: there is none
};

NamedInterface find_first() {
    ifaddrs* all = nullptr;
    NamedInterface found;
    if (getifaddrs(&all) != 0) return found;
    for (const ifaddrs* one = all; one && found.name.empty(); one = one->ifa_next) {
        if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
        const std::uint32_t address = ipv4_of(one->ifa_addr);
        if ((ntohl(address) >> 24) == 127) continue;
        found.name = one->ifa_name;
        found.address = address;
        found.mask = ipv4_of(one->ifa_netmask);
        read_hardware_address(all, found.name, found);
    }
    freeifaddrs(all);
    return found;
}

std::string text_of(const char* path) {
    const auto read = posix::read_small_file(path);
    return read ? *read : "";
}

}  // namespace

// proc(5), /proc/net/route: the interface, the destination and the gateway, in hexadecimal, their
// bytes as they lie in memory.
std::uint32_t gateway_in(std::string_view route, std::string_view name) {
    for (const std::string_view line : parts(route, "\n")) {
        const std::vector<std::string_view> fields = parts(line, "\t ");
        if (fields.size() < 3 || fields[0] != name || fields[1] != "00000000") continue;
        return whole_number<std::uint32_t>(fields[2], 16).value_or(0);
    }
    return 0;
}

std::uint32_t name_server_in(std::string_view resolv_conf) {
    for (const std::string_view line : parts(resolv_conf, "\n")) {
        const std::vector<std::string_view> fields = parts(line, "\t ");
        in_addr address{};
        if (fields.size() >= 2 && fields[0] == "nameserver" &&
            inet_pton(AF_INET, std::string(fields[1]).c_str(), &address) == 1)
            return address.s_addr;
    }
    return 0;
}

// Linux wireless extensions, /proc/net/wireless: "wlan0: 0000   60.  -50.  -256 …", link and level.
std::optional<int> signal_in(std::string_view wireless, std::string_view name) {
    for (const std::string_view line : parts(wireless, "\n")) {
        const std::vector<std::string_view> fields = parts(line, "\t ");
        if (fields.size() < 4 || fields[0] != std::string(name) + ':') continue;
        return whole_number<int>(fields[3].substr(0, fields[3].find('.')));
    }
    return std::nullopt;
}

}  // namespace qduino::arduino::host

namespace qduino::arduino {

Interface first_interface() { return host::find_first(); }

std::uint32_t gateway() {
    return host::gateway_in(host::text_of("/proc/net/route"), host::find_first().name);
}

std::uint32_t name_server() { return host::name_server_in(host::text_of("/etc/resolv.conf")); }

std::optional<int> signal_dbm() {
    return host::signal_in(host::text_of("/proc/net/wireless"), host::find_first().name);
}

}  // namespace qduino::arduino
