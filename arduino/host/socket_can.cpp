#include "arduino/host/socket_can.h"

#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "arduino/core/diagnostics.h"
#include "arduino/core/host_question.h"
#include "arduino/libraries/CAN/Arduino_CAN.h"
#include "posix/system_error.h"

// Last: it has macros with the names of CanMsg's constants.
#include <linux/can.h>

namespace qduino::arduino::host {

/// A bus that cannot be opened takes the host as long as so many short system calls.
constexpr int kOpenCalls = 10;

Result<posix::UniqueFd> open_can(const std::string& interface) {
    posix::UniqueFd made{socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW)};
    if (!made.valid()) return posix::system_error("use CAN on", interface);
    ifreq request{};
    interface.copy(request.ifr_name, IFNAMSIZ - 1);
    if (ioctl(made.get(), SIOCGIFINDEX, &request) != 0) return posix::system_error("find", interface);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = request.ifr_ifindex;
    if (bind(made.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return posix::system_error("use", interface);
    return made;
}

bool SocketCan::begin(CanBitRate) {
    const char* const named = std::getenv("QDUINO_CAN");
    Result<posix::UniqueFd> opened = open_can(named ? named : "can0");
    if (opened) {
        socket_ = std::move(*opened);
        return true;
    }
    asked_in_vain(board::DeviceClass::nic, kOpenCalls);
    report_error("CAN.begin", 0, opened.error());
    return false;
}

int SocketCan::write(const CanMsg& msg) {
    can_frame frame{};
    frame.can_id = msg.id;  // laid out as the kernel's
    frame.can_dlc = msg.data_length;
    std::memcpy(frame.data, msg.data, msg.data_length);
    const ssize_t sent = send(socket_.get(), &frame, sizeof frame, MSG_DONTWAIT | MSG_NOSIGNAL);
    return sent == sizeof frame ? CAN_SUCCESS : CAN_ERROR_GENERIC;
}

std::size_t SocketCan::available() {
    can_frame frame{};
    while (!received_.isFull() && recv(socket_.get(), &frame, sizeof frame, MSG_DONTWAIT) == sizeof frame) {
        if ((frame.can_id & (CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0) continue;
        received_.enqueue(CanMsg(frame.can_id, frame.can_dlc, frame.data));
    }
    return found_on(board::DeviceClass::nic, received_.available());
}

CanMsg SocketCan::read() {
    available();
    return received_.dequeue();
}

}  // namespace qduino::arduino::host

namespace {
qduino::arduino::host::SocketCan can_of_host;
}
HardwareCAN& CAN = can_of_host;
