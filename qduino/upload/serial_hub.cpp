#include "qduino/upload/serial_hub.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <iterator>

namespace qduino::apps {
namespace {

/// Appends, and drops the oldest bytes beyond `most`.
void append_bounded(std::string& text, std::string_view more, std::size_t most) {
    text.append(more);
    if (text.size() > most) text.erase(0, text.size() - most);
}

bool is_only_busy() { return errno == EAGAIN || errno == EINTR; }

}  // namespace

void SerialHub::add(posix::UniqueFd client) { clients_.push_back({std::move(client), backlog_}); }

void SerialHub::take_output(std::string_view bytes) {
    append_bounded(backlog_, bytes, kBacklogMax);
    for (Client& client : clients_) append_bounded(client.waiting, bytes, kWaitingMax);
}

bool SerialHub::has_output() const {
    return std::ranges::any_of(clients_, [](const Client& client) { return !client.waiting.empty(); });
}

std::vector<pollfd> SerialHub::waits() const {
    std::vector<pollfd> waits;
    for (const Client& client : clients_) {
        const int events = (input_.size() < kInputMax ? POLLIN : 0) | (client.waiting.empty() ? 0 : POLLOUT);
        waits.push_back({client.fd.get(), static_cast<short>(events), 0});
    }
    return waits;
}

void SerialHub::serve(std::span<const pollfd> seen) {
    auto look = seen.begin();
    for (auto client = clients_.begin(); client != clients_.end() && look != seen.end(); ++look) {
        const bool stays = serve(*client, look->revents);
        client = stays ? std::next(client) : clients_.erase(client);
    }
}

bool SerialHub::serve(Client& client, short events) {
    if ((events & POLLIN) != 0) {
        std::array<char, 4096> bytes;
        const ssize_t count = ::read(client.fd.get(), bytes.data(), bytes.size());
        if (count == 0 || (count < 0 && !is_only_busy())) return false;
        if (count > 0) input_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    if ((events & POLLOUT) != 0) {
        const ssize_t count = ::write(client.fd.get(), client.waiting.data(), client.waiting.size());
        if (count < 0 && !is_only_busy()) return false;
        if (count > 0) client.waiting.erase(0, static_cast<std::size_t>(count));
    }
    return (events & (POLLERR | POLLNVAL)) == 0 && ((events & POLLHUP) == 0 || (events & POLLIN) != 0);
}

}  // namespace qduino::apps
