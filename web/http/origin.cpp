#include "web/http/origin.h"

#include <algorithm>

#include "base/whole_number.h"
#include "web/http/forwarded.h"

namespace qduino::web {

namespace {

/// The host of `host[:port]`, brackets of an IPv6 address included; empty when malformed.
std::string_view without_port(std::string_view text) {
    const std::size_t bracket = text.find(']');
    const std::size_t colon = text.find(':', bracket == std::string_view::npos ? 0 : bracket);
    if (colon == std::string_view::npos) return text;
    return whole_number<unsigned>(text.substr(colon + 1)) && text.size() - colon <= 6 ? text.substr(0, colon)
                                                                                      : std::string_view{};
}

/// An IPv6 address stands in brackets, an IPv4 address does not.
bool is_address(std::string_view host) {
    const bool brackets = host.front() == '[' && host.back() == ']';
    if (brackets) host = host.substr(1, host.size() - 2);
    return brackets == (host.find(':') != std::string_view::npos) && is_numeric_address(host);
}

}  // namespace

bool HostPolicy::allows(std::string_view host) const {
    const std::string_view name = without_port(host);
    if (name.empty()) return false;
    if (equal_ignoring_case(name, "localhost") || is_address(name)) return true;
    return std::any_of(names_.begin(), names_.end(),
                       [&](const std::string& allowed) { return equal_ignoring_case(name, allowed); });
}

bool is_same_origin(const RequestHead& head, const Client& client, bool absent_is_same) {
    const std::string* origin = head.find("Origin");
    if (!origin) return absent_is_same;
    std::string_view rest = *origin;
    for (const std::string_view scheme : {"http://", "https://"}) {
        if (rest.size() > scheme.size() && equal_ignoring_case(rest.substr(0, scheme.size()), scheme)) {
            if (client.secure && scheme == "http://") return false;
            return equal_ignoring_case(rest.substr(scheme.size()), client.host);
        }
    }
    return false;  // "null", or a scheme that serves nothing of ours
}

}  // namespace qduino::web
