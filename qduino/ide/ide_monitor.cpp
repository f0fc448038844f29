#include "qduino/ide/ide_monitor.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "base/whole_number.h"
#include "posix/system_error.h"
#include "qduino/common/host_name.h"

namespace qduino::apps {
namespace {

using posix::UniqueFd;

/// "127.0.0.1:4711". Error: it is no IPv4 address with a port.
Result<sockaddr_in> address_of(const std::string& text) {
    sockaddr_in address{};
    const std::size_t colon = text.find(':');
    const auto port =
        colon == std::string::npos ? std::nullopt : whole_number<std::uint16_t>(text.substr(colon + 1));
    if (!port || ::inet_pton(AF_INET, text.substr(0, colon).c_str(), &address.sin_addr) != 1)
        return make_error(ErrorCode::invalid_argument, "not an address with a port: ", text);
    address.sin_family = AF_INET;
    address.sin_port = htons(*port);
    return address;
}

Result<UniqueFd> connect_to(const std::string& text) {
    QDUINO_TRY_ASSIGN(const sockaddr_in address, address_of(text));
    UniqueFd socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return posix::system_error("connect to", text);
    return socket;
}

bool is_only_busy() { return errno == EAGAIN || errno == EINTR; }

}  // namespace

std::string IdeMonitor::carry_out(const Words& words) {
    if (words[0] == "DESCRIBE" && words.size() == 1) {
        // A rate means nothing here, so there is nothing to choose.
        return tool_message(
            {{"eventType", "describe"},
             {"message", "OK"},
             {"port_description",
              {{"protocol", kIdeProtocol}, {"configuration_parameters", nlohmann::json::object()}}}});
    }
    if (words[0] == "CONFIGURE" && words.size() == 3)
        return tool_error("configure", "There is no parameter " + words[1]);
    if (words[0] == "OPEN" && words.size() == 3) return open(words[1], words[2]);
    if (words[0] == "CLOSE" && words.size() == 1) {
        if (!is_open()) return tool_error("close", "The port is closed");
        close();
        return tool_answer("close");
    }
    return "";
}

std::string IdeMonitor::open(const std::string& client, const std::string& port) {
    if (is_open()) return tool_error("open", "A port is open");
    const Result<void> connected = connect(client, port);
    if (connected) return tool_answer("open");
    close();
    return tool_error("open", connected.error().message);
}

Result<void> IdeMonitor::connect(const std::string& client, const std::string& port) {
    const bool here = port == kThisComputer;
    if (!here && !host_error(port).empty()) return make_error(ErrorCode::invalid_argument, host_error(port));
    QDUINO_TRY_ASSIGN(way_, open_way(here ? "" : port));
    QDUINO_TRY_ASSIGN(client_, connect_to(client));
    ends_ = {End{client_.get(), "", "The IDE has closed the connection"},
             End{way_.socket.get(), "", "The sketch has ended"}};
    return {};
}

void IdeMonitor::close() {
    if (way_.child != 0) ::kill(way_.child, SIGTERM);
    close_way(way_);
    client_.reset();
    ends_ = {};
}

std::vector<pollfd> IdeMonitor::waits() const {
    if (!is_open()) return {};
    std::vector<pollfd> waits;
    for (std::size_t i = 0; i < ends_.size(); ++i) {
        const bool reads = ends_[1 - i].waiting.empty();
        const int events = (reads ? POLLIN : 0) | (ends_[i].waiting.empty() ? 0 : POLLOUT);
        // One that may neither read nor write would still be told of its end, again and again.
        waits.push_back({events != 0 ? ends_[i].fd : -1, static_cast<short>(events), 0});
    }
    return waits;
}

std::string IdeMonitor::serve(std::span<const pollfd> seen) {
    for (std::size_t i = 0; i < seen.size(); ++i) {
        if (serve(ends_[i], ends_[1 - i], seen[i].revents)) continue;
        const std::string farewell = ends_[i].farewell;
        close();
        return tool_message({{"eventType", "port_closed"}, {"message", farewell}});
    }
    return "";
}

/// False: this end has gone.
bool IdeMonitor::serve(End& end, End& other, short events) {
    if ((events & POLLOUT) != 0) {
        const ssize_t count =
            ::send(end.fd, end.waiting.data(), end.waiting.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (count < 0 && !is_only_busy()) return false;
        if (count > 0) end.waiting.erase(0, static_cast<std::size_t>(count));
    }
    if (!other.waiting.empty()) return true;  // its end is seen when that has gone
    if ((events & (POLLIN | POLLHUP | POLLERR)) == 0) return true;
    std::array<char, 16 * 1024> bytes;
    const ssize_t count = ::recv(end.fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count > 0) other.waiting.assign(bytes.data(), static_cast<std::size_t>(count));
    return count > 0 || (count < 0 && is_only_busy());
}

}  // namespace qduino::apps
