#include "qduino/upload/board_folder.h"

#include <signal.h>
#include <sys/socket.h>

#include <cstdlib>
#include <system_error>

#include "base/whole_number.h"
#include "board/linux/kernel/run_lock.h"
#include "posix/local_socket.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// A sketch has a second to end by itself, and its supervisor as long again.
constexpr Nanoseconds kEndsWithin = 10s;

}  // namespace

Result<BoardFolder> BoardFolder::open() {
    const char* state = std::getenv("XDG_STATE_HOME");
    const char* home = std::getenv("HOME");
    const bool named = state != nullptr && state[0] == '/';
    if (!named && (home == nullptr || home[0] == '\0'))
        return make_error(ErrorCode::not_found, "no folder for an uploaded sketch: set HOME");
    const fs::path path =
        (named ? fs::path(state) : fs::path(home) / ".local" / "state") / "qduino" / "board";
    std::error_code failed;
    fs::create_directories(path, failed);
    // What is in it runs as this user.
    fs::permissions(path, fs::perms::owner_all, failed);
    if (failed) return make_error(ErrorCode::not_permitted, "cannot write here: ", path.native());
    return BoardFolder(path);
}

std::optional<BoardFolder::Running> BoardFolder::running() const {
    if (!fs::exists(lock()) || board::linux::lock_file(lock(), Nanoseconds{0})) return std::nullopt;
    const auto text = posix::read_small_file(keeper());
    if (!text) return std::nullopt;
    const std::size_t space = text->find(' ');
    const auto pid = whole_number<pid_t>(std::string_view(*text).substr(0, space));
    if (!pid || space == std::string::npos) return std::nullopt;
    return Running{*pid, text->substr(space + 1)};
}

Result<std::string> BoardFolder::stop() const {
    const auto found = running();
    if (!found) return std::string{};
    ::kill(found->keeper, SIGTERM);
    QDUINO_TRY(board::linux::lock_file(lock(), kEndsWithin));
    return found->sketch;
}

Result<posix::UniqueFd> BoardFolder::connect() const {
    if (Result<posix::UniqueFd> socket = posix::connect_local(serial())) return socket;
    return make_error(ErrorCode::not_found,
                      "no sketch was uploaded that runs here: 'qduino upload' starts one");
}

}  // namespace qduino::apps
