#include "bench/rig/report.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <string_view>

namespace qduino::bench {
namespace {

std::string cell(const Json& value) {
    char text[48];
    if (value.is_string()) return value.get<std::string>();
    if (value.is_number_float()) {
        const double number = value.get<double>();
        std::snprintf(text, sizeof text, std::abs(number) >= 1e6 ? "%.0f" : "%.3f", number);
        return text;
    }
    return value.is_null() ? "-" : value.dump();
}

void print_table(const std::vector<Json>& rows) {
    if (rows.empty()) return;
    std::vector<std::string> keys;
    std::vector<std::size_t> widths;
    for (const auto& [key, value] : rows.front().items()) {
        keys.push_back(key);
        std::size_t width = key.size();
        for (const Json& row : rows) width = std::max(width, cell(row.at(key)).size());
        widths.push_back(width);
    }
    const auto line = [&](const auto& text_of) {
        for (std::size_t i = 0; i < keys.size(); ++i) {
            const bool left = rows.front().at(keys[i]).is_string();
            std::printf(left ? "%-*s  " : "%*s  ", static_cast<int>(widths[i]), text_of(keys[i]).c_str());
        }
        std::putchar('\n');
    };
    line([](const std::string& key) { return key; });
    for (const Json& row : rows) line([&](const std::string& key) { return cell(row.at(key)); });
}

}  // namespace

std::string computer_name() {
    std::ifstream cpuinfo{"/proc/cpuinfo"};
    std::string model = "unknown CPU";
    for (std::string line; std::getline(cpuinfo, line);) {
        if (line.rfind("model name", 0) == 0 || line.rfind("Model", 0) == 0)
            model = line.substr(line.find(':') + 2);
    }
    return model + ", " + std::to_string(::sysconf(_SC_NPROCESSORS_ONLN)) + " CPUs";
}

std::string kernel_release() {
    utsname names{};
    return ::uname(&names) == 0 ? std::string{names.sysname} + " " + names.release : "unknown";
}

std::string commit() {
    char text[64] = "";
    if (FILE* git = ::popen("git -C '" QDUINO_SOURCE_DIR "' rev-parse --short=12 HEAD 2>/dev/null", "r")) {
        if (!std::fgets(text, sizeof text, git)) text[0] = '\0';
        ::pclose(git);
    }
    const std::string_view line{text};
    return line.empty() ? "unknown" : std::string{line.substr(0, line.find('\n'))};
}

std::map<std::string, std::map<std::string, const Json*>> by_load_and_who(const Report& report) {
    std::map<std::string, std::map<std::string, const Json*>> at;
    for (const Json& each : report.results) at[each["load"]][each["who"]] = &each;
    return at;
}

std::string verdict(bool holds, const char* format, ...) {
    char text[160];
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    return std::string(holds ? "  holds     " : "  MISSED    ") + text;
}

void print(const Report& report, bool json) {
    if (json) {
        Json whole{{"machine", computer_name()},    {"kernel", kernel_release()},
                   {"compiler", __VERSION__},       {"commit", commit()},
                   {"guarantee", report.guarantee}, {"results", report.results}};
        if (!report.failures.empty()) whole["failures"] = report.failures;
        std::printf("%s\n", whole.dump(2).c_str());
        return;
    }
    std::printf("%s, %s, commit %s\n\n", computer_name().c_str(), kernel_release().c_str(), commit().c_str());
    print_table(report.results);
    if (!report.remarks.empty() || !report.failures.empty()) std::putchar('\n');
    for (const std::string& remark : report.remarks) std::printf("%s\n", remark.c_str());
    for (const auto& [what, runs] : report.failures)
        std::printf("  not run   %s (%d runs)\n", what.c_str(), runs);
}

}  // namespace qduino::bench
