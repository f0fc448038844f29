// The same in every main(): it says why it failed and ends with a status, and a signal asks it to
// stop.
#pragma once

#include <string_view>

namespace qduino::apps {

/// constexpr apps::Fail fail{"printer: "};  …  return fail("the link cannot be made");
struct Fail {
    std::string_view prefix;
    int status = 1;

    /// Says it on standard error, and is the status.
    int operator()(std::string_view message) const;
};

/// From here on SIGINT and SIGTERM only set what stop_asked() reads. They interrupt a wait in the
/// kernel.
void stop_on_signals();
/// A signal has come. Any thread.
[[nodiscard]] bool stop_asked();

}  // namespace qduino::apps
