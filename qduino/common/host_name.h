// The name of another computer, as a person gives it to ssh.
#pragma once

#include <string>

namespace qduino::apps {

/// Empty: `host` may be handed to ssh: "user@host", "host", "ssh://user@host:2222". Else why not:
/// it could be taken for an option, or for something that a shell reads.
[[nodiscard]] std::string host_error(const std::string& host);

}  // namespace qduino::apps
