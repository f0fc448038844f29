#include "serial/serial_port.h"

#include <asm/termbits.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

#include "base/whole_number.h"
#include "posix/local_socket.h"
#include "posix/system_error.h"

namespace qduino::apps {

using posix::system_error;
using posix::UniqueFd;

namespace {

/// Bytes as they are: no echo, no signals, no line ends changed. termios2 takes any baud rate
/// (ioctl_tty(2)), where tcsetattr(3) knows a list that has no 250000.
Result<void> make_raw(int fd, std::uint32_t baud, const std::string& name) {
    termios2 settings{};
    if (::ioctl(fd, TCGETS2, &settings) != 0) return system_error("ask the settings of", name);
    settings.c_iflag = 0;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
    settings.c_ispeed = settings.c_ospeed = baud;
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if (::ioctl(fd, TCSETS2, &settings) != 0) return system_error("set", name);
    return {};
}

constexpr int kOpenFlags = O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC;

}  // namespace

Result<SerialPort> SerialPort::make_pty(const std::filesystem::path& link) {
    UniqueFd master{::posix_openpt(kOpenFlags)};
    if (!master.valid()) return system_error("make", "a pseudo-terminal");
    std::array<char, 64> name{};
    if (::grantpt(master.get()) != 0 || ::unlockpt(master.get()) != 0 ||
        ::ptsname_r(master.get(), name.data(), name.size()) != 0) {
        return system_error("unlock", "a pseudo-terminal");
    }
    // Its settings outlive this opening, as the master stays open. From here on a host's closing is
    // seen.
    const UniqueFd slave{::open(name.data(), kOpenFlags)};
    if (!slave.valid()) return system_error("open", name.data());
    QDUINO_TRY(make_raw(slave.get(), kBaud, name.data()));
    std::error_code error;
    std::filesystem::remove(link, error);
    std::filesystem::create_symlink(name.data(), link, error);
    if (error)
        return make_error(ErrorCode::unavailable, "cannot make ", link.native(), ": ", error.message());
    return SerialPort{std::move(master), name.data(), true};
}

Result<SerialPort> SerialPort::open_device(std::string_view name) {
    std::uint32_t baud = kBaud;
    const std::size_t at = name.rfind('@');
    if (at != std::string_view::npos) {
        const auto given = whole_number<std::uint32_t>(name.substr(at + 1));
        if (!given || *given == 0)
            return make_error(ErrorCode::invalid_argument, "give DEVICE or DEVICE@BAUD, not '", name, "'");
        baud = *given;
        name = name.substr(0, at);
    }
    const std::string path{name};
    UniqueFd fd{::open(path.c_str(), kOpenFlags)};
    if (!fd.valid()) return system_error("open", path);
    if (::ioctl(fd.get(), TIOCEXCL) != 0) return system_error("take", path);
    QDUINO_TRY(make_raw(fd.get(), baud, path));
    return SerialPort{std::move(fd), path, false};
}

Result<SerialPort> SerialPort::relayed(const std::string& path, bool sees_host) {
    QDUINO_TRY_ASSIGN(UniqueFd listener, posix::listen_local(path, 1));
    SerialPort port{UniqueFd{}, path, sees_host};
    port.listener_ = std::move(listener);
    return port;
}

Result<UniqueFd> connect_relay(const std::string& path) { return posix::connect_local(path, SOCK_NONBLOCK); }

bool SerialPort::host_is_there() {
    if (listener_.valid() && !fd_.valid())
        fd_ = UniqueFd{::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
    if (!fd_.valid()) return false;
    pollfd look{fd_.get(), 0, 0};
    const bool ended = ::poll(&look, 1, 0) < 0 || (look.revents & POLLHUP) != 0;
    if (!listener_.valid()) return !sees_host_ || !ended;
    if (ended) fd_.reset();
    return !ended;
}

Result<std::size_t> SerialPort::read(std::span<char> bytes) const {
    const ssize_t count = ::read(fd_.get(), bytes.data(), bytes.size());
    if (count > 0) return static_cast<std::size_t>(count);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return std::size_t{0};
    return system_error("read", name_, count == 0 ? EIO : errno);
}

std::size_t SerialPort::write(std::string_view bytes) const {
    const ssize_t count = ::write(fd_.get(), bytes.data(), bytes.size());
    if (count >= 0) return static_cast<std::size_t>(count);
    return errno == EAGAIN || errno == EINTR ? 0 : bytes.size();
}

}  // namespace qduino::apps
