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

#include "arduino/core/interface.h"
#include "base/whole_number.h"
#include "posix/small_file.h"

namespace qduino::arduino::host {
namespace {

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
    std::vector<std::string_view> parts;
    for (std::size_t from = 0; from < text.size();) {
        const std::size_t end = std::min(text.find_first_of(separators, from), text.size());
        if (end > from) parts.push_back(text.substr(from, end - from));
        from = end + 1;
    }
    return parts;
}

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

std::string text_of(const char* path) {
    const auto read = posix::read_small_file(path);
    return read ? *read : "";
}

}  // namespace

// proc(5), /proc/net/route: the interface, the destination and the gateway, in hexadecimal, their
// bytes as they lie in memory.
std::uint32_t gateway_in(std::string_view route, std::string_view name) {
    for (const std::string_view line : split(route, "\n")) {
        const std::vector<std::string_view> fields = split(line, "\t ");
        if (fields.size() < 3 || fields[0] != name || fields[1] != "00000000") continue;
        return whole_number<std::uint32_t>(fields[2], 16).value_or(0);
    }
    return 0;
}

std::uint32_t name_server_in(std::string_view resolv_conf) {
    for (const std::string_view line : split(resolv_conf, "\n")) {
        const std::vector<std::string_view> fields = split(line, "\t ");
        in_addr address{};
        if (fields.size() >= 2 && fields[0] == "nameserver" &&
            inet_pton(AF_INET, std::string(fields[1]).c_str(), &address) == 1)
            return address.s_addr;
    }
    return 0;
}

// Linux wireless extensions, /proc/net/wireless: "wlan0: 0000   60.  -50.  -256 …", link and level.
std::optional<int> signal_in(std::string_view wireless, std::string_view name) {
    for (const std::string_view line : split(wireless, "\n")) {
        const std::vector<std::string_view> fields = split(line, "\t ");
        if (fields.size() < 4 || fields[0] != std::string(name) + ':') continue;
        return whole_number<int>(fields[3].substr(0, fields[3].find('.')));
    }
    return std::nullopt;
}

}  // namespace qduino::arduino::host

namespace qduino::arduino {

Interface first_interface() {
    ifaddrs* all = nullptr;
    Interface found;
    if (getifaddrs(&all) != 0) return found;
    for (const ifaddrs* one = all; one && found.address == 0; one = one->ifa_next) {
        if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
        const std::uint32_t address = host::ipv4_of(one->ifa_addr);
        if ((ntohl(address) >> 24) == 127) continue;
        found = {.address = address,
                 .mask = host::ipv4_of(one->ifa_netmask),
                 .gateway = host::gateway_in(host::text_of("/proc/net/route"), one->ifa_name),
                 .name_server = host::name_server_in(host::text_of("/etc/resolv.conf")),
                 .hardware_address = {},
                 .signal_dbm = host::signal_in(host::text_of("/proc/net/wireless"), one->ifa_name)};
        host::read_hardware_address(all, one->ifa_name, found);
    }
    freeifaddrs(all);
    return found;
}

}  // namespace qduino::arduino
