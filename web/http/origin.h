// The host names and origins that a browser may come from: against DNS rebinding and cross-site
// requests. Pure.
//
// A page of another site can make a browser send requests here: with our cookie, or under a name
// that the site's own DNS points at this computer. The first shows in Origin, the second in Host:
// - Host must be an address, `localhost`, or a name that the owner has allowed: a rebinding attack
//   needs a name.
// - Origin, where it is given or required, must equal the Host that the request itself was sent to.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "web/http/http.h"

namespace qduino::web {

class HostPolicy {
  public:
    /// Further names, without port, e.g. "printer.local".
    explicit HostPolicy(std::vector<std::string> names = {}) : names_(std::move(names)) {}

    /// True when the value of a Host field is one of ours. The port is not compared: a tunnel may
    /// change it.
    [[nodiscard]] bool allows(std::string_view host) const;

  private:
    std::vector<std::string> names_;
};

/// True when the request comes from a page of this very service: Origin is http(s):// and the name
/// that the client called. A client that came by TLS has no page of ours without it; a proxy that
/// nobody has named may have ended the TLS before us. A request without Origin is `absent_is_same`.
[[nodiscard]] bool is_same_origin(const RequestHead& head, const Client& client, bool absent_is_same);

}  // namespace qduino::web
