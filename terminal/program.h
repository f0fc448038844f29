// The same in every main(): it says why it failed and ends with a status, and a signal asks it to
// stop.
#pragma once

#include <initializer_list>
#include <string_view>

#include "base/result.h"

namespace qduino::apps {

/// constexpr apps::Fail fail{"printer: "};  …  return fail("the link cannot be made");
struct Fail {
    std::string_view prefix;
    int status = 1;

    /// Says it on standard error, and is the status.
    int operator()(std::string_view message) const;
    int operator()(const Error& error) const { return (*this)(error.message); }
};

/// From here on SIGINT and SIGTERM only set what stop_asked() reads. They interrupt a wait in the
/// kernel.
void stop_on_signals();
/// A signal has come. Any thread.
[[nodiscard]] bool stop_asked();
/// As if one had come. Any thread.
void ask_to_stop();

/// Makes descriptors 0 to 2 exist. One that was closed would be the next file that is opened, and a
/// sketch's words would go into it; now to use it is an error. First in main().
void keep_standard_descriptors();

/// Blocks `signals`. Returns a signalfd(2), from which they are read instead; −1: there is none.
[[nodiscard]] int block_and_watch(std::initializer_list<int> signals);

}  // namespace qduino::apps
