#include "qduino/upload/remote.h"

#include <cstdlib>

#include "qduino/common/child_process.h"
#include "qduino/common/host_name.h"
#include "qduino/common/sdk.h"

namespace qduino::apps {
namespace {

constexpr int kSshFailed = 255;  // ssh(1), EXIT STATUS

Result<int> checked(const std::string& host, int status) {
    if (status == kSshFailed)
        return make_error(ErrorCode::unavailable, "ssh cannot reach ", host, "; its reason is above");
    if (status == 127) {
        return make_error(ErrorCode::not_found, "there is no qduino on ", host,
                          ": run ./install there, as its user or as root");
    }
    return status;
}

}  // namespace

std::string host_error(const std::string& host) {
    constexpr const char* kAllowed =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.@:%[]/";
    const bool good =
        !host.empty() && host.front() != '-' && host.find_first_not_of(kAllowed) == std::string::npos;
    return good ? "" : "'" + host + "' is no computer as ssh takes it, such as pi@printer.local";
}

Words remote_qduino(const std::string& host, const Words& words) {
    const char* named = std::getenv("QDUINO_SSH");
    Words command = words_of(named != nullptr && named[0] != '\0' ? named : "ssh");
    Words qduino{"qduino"};
    append(qduino, words);
    const std::string there = "PATH=\"$HOME/.local/bin:/usr/local/bin:$PATH\"; exec " + shell_words(qduino);
    // Two shells read it: the user's own there, whichever it is, and sh.
    append(command, {"-T", host, shell_words({"sh", "-c", there})});
    return command;
}

Result<int> send_folder(const std::string& host, const std::filesystem::path& folder, const Words& words) {
    Words command{"sh", "-c", "tar -C \"$0\" -czf - . | \"$@\"", folder.string()};
    append(command, remote_qduino(host, words));
    QDUINO_TRY_ASSIGN(const int status, run_in_front(command));
    return checked(host, status);
}

Result<int> run_remote(const std::string& host, const Words& words) {
    QDUINO_TRY_ASSIGN(const int status, run_in_front(remote_qduino(host, words)));
    return checked(host, status);
}

}  // namespace qduino::apps
