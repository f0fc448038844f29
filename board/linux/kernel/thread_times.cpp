#include "board/linux/kernel/thread_times.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/fixed_string.h"
#include "base/text.h"
#include "base/whole_number.h"

namespace qduino::board::linux {

namespace {

std::int64_t next_number(std::string_view& text) {
    const std::size_t end = std::min(text.find_first_of(" \n"), text.size());
    const auto number = whole_number<std::int64_t>(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    return number.value_or(0);
}

}  // namespace

std::string_view read_anew(int file, TaskText& buffer) {
    const ssize_t bytes = ::pread(file, buffer.data(), buffer.size(), 0);
    return {buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(bytes, 0))};
}

bool ThreadTimesFile::open(pid_t process, pid_t tid) {
    const auto path = text<FixedString<64>>("/proc/", process, "/task/", tid, "/schedstat", '\0');
    file_ = ::open(path.view().data(), O_RDONLY | O_CLOEXEC);
    sched::ThreadTimes times;
    return read(times);
}

void ThreadTimesFile::close() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
}

bool ThreadTimesFile::read(sched::ThreadTimes& times) const {
    std::array<char, 128> buffer;
    const ssize_t bytes = ::pread(file_, buffer.data(), buffer.size(), 0);
    if (bytes <= 0) return false;
    std::string_view told{buffer.data(), static_cast<std::size_t>(bytes)};
    times.cpu = Nanoseconds{next_number(told)};
    times.delayed = Nanoseconds{next_number(told)};
    return true;
}

}  // namespace qduino::board::linux
