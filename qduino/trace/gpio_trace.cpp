#include "qduino/trace/gpio_trace.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <charconv>

#include "posix/system_error.h"

namespace qduino::apps {

std::optional<PinWrite> traced_write(std::string_view line) {
    constexpr std::string_view kBefore = " setting output ";
    const std::size_t at = line.find(kBefore);
    if (!line.starts_with("pl061_set_output ") || at == std::string_view::npos) return {};
    const char* const end = line.data() + line.size();
    unsigned pin = 0;
    const auto [behind, error] = std::from_chars(line.data() + at + kBefore.size(), end, pin);
    const std::string_view rest{behind, end};
    if (error != std::errc{} || pin > 7 || (rest != " to 0" && rest != " to 1")) return {};
    return PinWrite{.ns = 0, .pin = static_cast<std::uint8_t>(pin), .high = rest.back() == '1'};
}

/// For reading and writing: so it has no end while no emulator has opened it yet.
Result<void> GpioTrace::begin(const std::filesystem::path& path) {
    if (::mkfifo(path.c_str(), 0600) != 0) return posix::system_error("make the pipe", path.native());
    pipe_ = posix::UniqueFd(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (!pipe_.valid()) return posix::system_error("open the pipe", path.native());
    reader_ = std::jthread([this](const std::stop_token& end) { read_lines(end); });
    return {};
}

std::vector<PinWrite> GpioTrace::end() {
    reader_.request_stop();
    if (reader_.joinable()) reader_.join();
    return std::move(writes_);
}

void GpioTrace::read_lines(const std::stop_token& end) {
    constexpr int kLookMs = 50;  // at the emulator's end
    std::array<char, 65536> buffer{};
    for (;;) {
        const bool last = end.stop_requested();
        pollfd waited{.fd = pipe_.get(), .events = POLLIN, .revents = 0};
        ::poll(&waited, 1, last ? 0 : kLookMs);
        const ssize_t got = ::read(pipe_.get(), buffer.data(), buffer.size());
        if (got > 0)
            take({buffer.data(), static_cast<std::size_t>(got)});
        else if (last)
            return;
    }
}

void GpioTrace::take(std::string_view text) {
    for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
        rest_ += text.substr(0, end);
        text.remove_prefix(end + 1);
        const auto write = traced_write(rest_);
        rest_.clear();
        if (!write || levels_[write->pin] == write->high) continue;
        levels_[write->pin] = write->high;
        writes_.push_back(*write);
    }
    rest_ += text;
}

}  // namespace qduino::apps
