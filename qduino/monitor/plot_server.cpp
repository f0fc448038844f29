#include "qduino/monitor/plot_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sodium.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <iterator>
#include <nlohmann/json.hpp>

#include "posix/system_error.h"
#include "qduino/monitor/plotter_files.h"

namespace qduino::apps {
namespace {

constexpr std::size_t kLineMax = 4096;

/// 128 bits that nobody guesses. Empty: the library does not start.
std::string random_key() {
    if (::sodium_init() < 0) return {};
    std::array<unsigned char, 16> bytes{};
    ::randombytes_buf(bytes.data(), bytes.size());
    std::array<char, 2 * bytes.size() + 1> digits{};
    return ::sodium_bin2hex(digits.data(), digits.size(), bytes.data(), bytes.size());
}

/// The page may load nothing but itself.
std::string head_of(const char* status, const char* type, const std::string& more) {
    return std::string("HTTP/1.1 ") + status + "\r\nContent-Type: " + type +
           "; charset=utf-8\r\nConnection: close\r\nCache-Control: no-store\r\n"
           "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
           "Content-Security-Policy: default-src 'none'; connect-src 'self'; script-src 'self' "
           "'unsafe-inline'; style-src 'unsafe-inline'; frame-ancestors 'none'\r\n" +
           more + "\r\n";
}

std::string whole_answer(const char* status, const char* type, std::string_view body) {
    return head_of(status, type, "Content-Length: " + std::to_string(body.size()) + "\r\n").append(body);
}

/// Takes as long for every key of that length that is wrong.
bool is_same_key(std::string_view a, std::string_view b) {
    return !b.empty() && a.size() == b.size() && ::sodium_memcmp(a.data(), b.data(), b.size()) == 0;
}

}  // namespace

std::string event_of(const std::string& line) {
    return "data: " + nlohmann::json(line).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) +
           "\n\n";
}

Result<PlotServer> PlotServer::listen(int port) {
    posix::UniqueFd listener{::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    socklen_t size = sizeof address;
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    const int yes = 1;
    ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (::bind(listener.get(), generic, size) != 0 || ::listen(listener.get(), 16) != 0 ||
        ::getsockname(listener.get(), generic, &size) != 0)
        return posix::system_error("serve the plotter at port", std::to_string(port));
    PlotServer server(std::move(listener));
    server.key_ = random_key();
    if (server.key_.empty()) return posix::system_error("make", "a key");
    server.address_ = "http://127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + "/?key=" + server.key_;
    return server;
}

void PlotServer::take(std::string_view bytes) {
    for (const char byte : bytes) {
        if (byte != '\n') {
            if (byte != '\r' && line_.size() < kLineMax) line_ += byte;
            continue;
        }
        lines_.push_back(event_of(line_));
        line_.clear();
        for (Client& client : clients_) {
            if (client.streams) client.waiting += lines_.back();
        }
        if (lines_.size() > kLinesKept) lines_.erase(lines_.begin());
    }
}

std::vector<pollfd> PlotServer::waits() const {
    std::vector<pollfd> waits{{clients_.size() < kClientsMax ? listener_.get() : -1, POLLIN, 0}};
    for (const Client& client : clients_) {
        const int events = client.waiting.empty() ? POLLIN : POLLIN | POLLOUT;
        waits.push_back({client.fd.get(), static_cast<short>(events), 0});
    }
    return waits;
}

void PlotServer::serve(std::span<const pollfd> seen) {
    if (seen.empty()) return;
    auto look = seen.begin() + 1;
    for (auto client = clients_.begin(); client != clients_.end() && look != seen.end(); ++look) {
        const bool stays = serve(*client, look->revents);
        client = stays ? std::next(client) : clients_.erase(client);
    }
    if (seen[0].revents != 0) accept_one();
}

void PlotServer::accept_one() {
    posix::UniqueFd fd{::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
    if (fd.valid()) clients_.push_back({.fd = std::move(fd), .request = {}, .waiting = {}});
}

bool PlotServer::serve(Client& client, short events) {
    if ((events & POLLIN) != 0) {
        std::array<char, 2048> bytes;
        const ssize_t count = ::read(client.fd.get(), bytes.data(), bytes.size());
        if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) return false;
        if (count > 0 && !client.answered)
            client.request.append(bytes.data(), static_cast<std::size_t>(count));
        read_request(client);
    }
    if ((events & POLLOUT) != 0) {
        const ssize_t count =
            ::send(client.fd.get(), client.waiting.data(), client.waiting.size(), MSG_NOSIGNAL);
        if (count < 0 && errno != EAGAIN && errno != EINTR) return false;
        if (count > 0) client.waiting.erase(0, static_cast<std::size_t>(count));
    }
    const bool done = client.answered && !client.streams && client.waiting.empty();
    const bool bad = client.request.size() > kRequestMax || client.waiting.size() > kWaitingMax;
    return !done && !bad && (events & (POLLERR | POLLNVAL)) == 0;
}

void PlotServer::read_request(Client& client) {
    if (client.answered || client.request.find("\r\n\r\n") == std::string::npos) return;
    client.answered = true;
    client.waiting = answer_to(client.request, client.streams);
    if (!client.streams) return;
    for (const std::string& line : lines_) client.waiting += line;
}

std::string PlotServer::answer_to(std::string_view request, bool& streams) const {
    streams = false;
    const std::string_view first = request.substr(0, request.find("\r\n"));
    const std::size_t target_end = first.find(' ', 4);
    if (!first.starts_with("GET ") || target_end == std::string_view::npos)
        return whole_answer("405 Method Not Allowed", "text/plain", "The plotter is only looked at.\n");
    const std::string_view target = first.substr(4, target_end - 4);
    const std::size_t query = target.find("?key=");
    const std::string_view path = target.substr(0, query);
    const std::string_view key = query == std::string_view::npos ? "" : target.substr(query + 5);
    if (!is_same_key(key, key_))
        return whole_answer("403 Forbidden", "text/plain", "Open the address that qduino printed.\n");
    if (path == "/") return whole_answer("200 OK", "text/html", kPlotterPage);
    if (path == "/series.js") return whole_answer("200 OK", "text/javascript", kPlotterSeries);
    if (path != "/lines") return whole_answer("404 Not Found", "text/plain", "There is no such page.\n");
    streams = true;
    return head_of("200 OK", "text/event-stream", "");
}

}  // namespace qduino::apps
