#include "qduino/monitor/monitor_text.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <utility>

#include "base/contract.h"

namespace qduino::apps {

std::string MonitorText::shown(std::string_view bytes) {
    std::string out;
    const auto end_line = [&] {
        out += '\n';
        in_line_ = false;
    };
    for (const char byte : bytes) {
        const bool after_return = std::exchange(returned_, byte == '\r');
        if (byte == '\n') {
            end_line();
        } else {
            if (after_return) end_line();
            if (byte == '\r') continue;
            if (!in_line_ && clock_) out += clock_();
            in_line_ = true;
            out += byte;
        }
    }
    return out;
}

std::string time_before_line() {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const std::time_t seconds = std::chrono::duration_cast<std::chrono::seconds>(now).count();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count() % 1000;
    std::tm local{};
    ::localtime_r(&seconds, &local);
    char text[32];
    std::snprintf(text, sizeof text, "%02d:%02d:%02d.%03d -> ", local.tm_hour, local.tm_min, local.tm_sec,
                  static_cast<int>(ms));
    return text;
}

std::string_view line_end_of(std::string_view name) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kLineEnds{
        {{"none", ""}, {"nl", "\n"}, {"cr", "\r"}, {"crlf", "\r\n"}}};
    for (const auto& [known, end] : kLineEnds) {
        if (known == name) return end;
    }
    QDUINO_EXPECT(false);
    return "";
}

std::string with_line_ends(std::string_view typed, std::string_view line_end) {
    std::string out;
    for (const char byte : typed) {
        if (byte == '\n')
            out += line_end;
        else
            out += byte;
    }
    return out;
}

}  // namespace qduino::apps
