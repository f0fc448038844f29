#include "qduino/upload/serial_way.h"

#include <sys/socket.h>

#include <utility>

#include "posix/system_error.h"
#include "qduino/common/child_process.h"
#include "qduino/upload/board_folder.h"
#include "qduino/upload/remote.h"

namespace qduino::apps {

using posix::UniqueFd;

Result<SerialWay> open_way(const std::string& host) {
    if (host.empty()) {
        QDUINO_TRY_ASSIGN(const BoardFolder board, BoardFolder::open());
        QDUINO_TRY_ASSIGN(UniqueFd socket, board.connect());
        return SerialWay{std::move(socket), 0};
    }
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return posix::system_error("make", "a way to ssh");
    SerialWay way{UniqueFd{ends[0]}, 0};
    const UniqueFd theirs{ends[1]};
    QDUINO_TRY_ASSIGN(way.child,
                      start(remote_qduino(host, {"monitor", "--raw"}), {theirs.get(), theirs.get(), -1}));
    return way;
}

int close_way(SerialWay& way) {
    way.socket.reset();
    const pid_t child = std::exchange(way.child, 0);
    return child != 0 ? wait_for(child) : 0;
}

}  // namespace qduino::apps
