#include "apps/qduino/local_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <string>

#include "posix/system_error.h"

namespace qduino::apps {
namespace {

/// Error: the path has more than 107 bytes.
Result<sockaddr_un> local_address(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path)
        return make_error(ErrorCode::invalid_argument, "too long for a socket: ", path);
    path.copy(address.sun_path, path.size());
    return address;
}

}  // namespace

Result<posix::UniqueFd> listen_local(const std::filesystem::path& path) {
    QDUINO_TRY_ASSIGN(const sockaddr_un address, local_address(path.native()));
    posix::UniqueFd listener{::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    ::unlink(path.c_str());
    if (::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::chmod(path.c_str(), 0600) != 0 || ::listen(listener.get(), 8) != 0)
        return posix::system_error("listen at", path.native());
    return listener;
}

Result<posix::UniqueFd> connect_local(const std::filesystem::path& path) {
    QDUINO_TRY_ASSIGN(const sockaddr_un address, local_address(path.native()));
    posix::UniqueFd socket{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return posix::system_error("connect to", path.native());
    return socket;
}

}  // namespace qduino::apps
