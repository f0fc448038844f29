#include "posix/local_socket.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>

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

namespace {

/// One byte, which carries the descriptor.
struct Parcel {
    char byte = 'd';
    iovec bytes{&byte, 1};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
    msghdr message{};

    Parcel() {
        message.msg_iov = &bytes;
        message.msg_iovlen = 1;
        message.msg_control = control;
        message.msg_controllen = sizeof control;
    }
};

}  // namespace

Result<void> send_descriptor(int socket, int descriptor) {
    Parcel parcel;
    cmsghdr* const head = CMSG_FIRSTHDR(&parcel.message);
    head->cmsg_level = SOL_SOCKET;
    head->cmsg_type = SCM_RIGHTS;
    head->cmsg_len = CMSG_LEN(sizeof descriptor);
    std::memcpy(CMSG_DATA(head), &descriptor, sizeof descriptor);
    if (::sendmsg(socket, &parcel.message, MSG_DONTWAIT | MSG_NOSIGNAL) == 1) return {};
    return system_error("hand over", "a descriptor");
}

Result<UniqueFd> receive_descriptor(int socket, int patience_ms) {
    pollfd way{socket, POLLIN, 0};
    if (::poll(&way, 1, patience_ms) <= 0)
        return make_error(ErrorCode::timed_out, "no descriptor came within ", patience_ms, " ms");
    Parcel parcel;
    if (::recvmsg(socket, &parcel.message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC) < 0)
        return system_error("receive", "a descriptor");
    const cmsghdr* const head = CMSG_FIRSTHDR(&parcel.message);
    if (head == nullptr || head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_RIGHTS ||
        head->cmsg_len != CMSG_LEN(sizeof(int)))
        return make_error(ErrorCode::corrupt, "no descriptor came");
    int descriptor = -1;
    std::memcpy(&descriptor, CMSG_DATA(head), sizeof descriptor);
    return UniqueFd{descriptor};
}

}  // namespace qduino::posix
