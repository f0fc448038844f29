#include "posix/local_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "posix/system_error.h"

namespace qduino::posix {

Result<sockaddr_un> local_address(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string& bytes = path.native();
    if (bytes.empty() || bytes.size() >= sizeof address.sun_path)
        return make_error(ErrorCode::invalid_argument, "a socket's path has 1 to 107 bytes, not ",
                          bytes.size(), ": ", bytes);
    bytes.copy(address.sun_path, bytes.size());
    return address;
}

Result<UniqueFd> listen_local(const std::filesystem::path& path, int waiting) {
    QDUINO_TRY_ASSIGN(const sockaddr_un address, local_address(path));
    UniqueFd listener{::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    ::unlink(path.c_str());
    if (::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::chmod(path.c_str(), 0600) != 0 || ::listen(listener.get(), waiting) != 0)
        return system_error("listen at", path.native());
    return listener;
}

Result<UniqueFd> connect_local(const std::filesystem::path& path, int flags) {
    QDUINO_TRY_ASSIGN(const sockaddr_un address, local_address(path));
    UniqueFd socket{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | flags, 0)};
    if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return system_error("connect to", path.native());
    return socket;
}

}  // namespace qduino::posix
