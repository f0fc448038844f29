// The records of a file for chrome://tracing and ui.perfetto.dev, each a JSON object: "Trace Event
// Format" (Google, JSON array form). A core is a process; each VCPU is a thread in it, and its
// interrupts are another. Times are pieces (base/text.h), in microseconds.
#pragma once

#include <string>
#include <string_view>

#include "base/text.h"

namespace qduino::apps::chrome {

inline constexpr int kInterruptThread = 1000;  // sorts after the VCPUs

/// The name of a thread, and of a core.
[[nodiscard]] inline std::string thread_name(int core, int thread, std::string_view name) {
    return text<std::string>(R"({"ph":"M","name":"thread_name","pid":)", core, R"(,"tid":)", thread,
                             R"(,"args":{"name":")", name, "\"}}");
}
[[nodiscard]] inline std::string core_name(int core) {
    return text<std::string>(R"({"ph":"M","name":"process_name","pid":)", core, R"(,"args":{"name":"core )",
                             core, "\"}}");
}

/// What further a record says of an interrupt: the last argument below.
[[nodiscard]] inline std::string device(std::string_view name) {
    return text<std::string>(R"(,"args":{"device":")", name, "\"}");
}
/// A stretch of a core's time.
template <typename Time>
[[nodiscard]] std::string stretch(std::string_view name, int core, int thread, const Time& since,
                                  const Time& length, std::string_view further = "") {
    return text<std::string>(R"({"ph":"X","name":")", name, R"(","pid":)", core, R"(,"tid":)", thread,
                             R"(,"ts":)", since, R"(,"dur":)", length, further, '}');
}
template <typename Time>
[[nodiscard]] std::string instant(std::string_view name, int core, int thread, const Time& at,
                                  std::string_view further = "") {
    return text<std::string>(R"({"ph":"i","s":"t","name":")", name, R"(","pid":)", core, R"(,"tid":)", thread,
                             R"(,"ts":)", at, further, '}');
}

}  // namespace qduino::apps::chrome
