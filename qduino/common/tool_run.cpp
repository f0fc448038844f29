#include "qduino/common/tool_run.h"

#include <algorithm>
#include <string>

#include "qduino/common/build_step.h"
#include "qduino/common/child_process.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBlank = " \t\r\n";

/// The last line of `text`: the one with the reason.
std::string_view last_line(std::string_view text) {
    text = text.substr(0, text.find_last_not_of(kBlank) + 1);
    return text.substr(text.rfind('\n') + 1);
}

/// The name of the program: `env NAME=VALUE… git` is git.
std::string tool_name(const Words& command) {
    auto word = command.begin();
    if (*word == "env")
        word = std::find_if(word + 1, command.end(),
                            [](const std::string& w) { return w.find('=') == std::string::npos; });
    return word == command.end() ? command.front() : fs::path(*word).filename().string();
}

}  // namespace

Result<void> run_tool(const Words& command, const fs::path& log, std::string_view package) {
    const Result<int> status = run_into(command, log);
    if (!status && package.empty()) return status.error();
    if (!status)
        return make_error(status.error().code, status.error().message.view(),
                          ". As root, run 'apt-get install ", package, "'");
    if (*status == 0) return {};
    return make_error(ErrorCode::unavailable, tool_name(command), ": ", last_line(text_of(log)));
}

}  // namespace qduino::apps
