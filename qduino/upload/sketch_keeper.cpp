#include "qduino/upload/sketch_keeper.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <vector>

#include "board/linux/kernel/run_lock.h"
#include "posix/local_socket.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "qduino/common/child_process.h"
#include "qduino/upload/serial_hub.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;
using posix::UniqueFd;

constexpr int kLookForReportMs = 50;
constexpr int kLastWordsMs = 1000;
/// The whole old sketch may still be on its way out.
constexpr Nanoseconds kLockPatience = 10s;

struct Pipe {
    UniqueFd read, write;
};

Result<Pipe> make_pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return posix::system_error("make", "a pipe");
    return Pipe{UniqueFd{ends[0]}, UniqueFd{ends[1]}};
}

/// The one message that a keeper has for the upload.
struct News {
    bool ended = false;
    int status = 0;
};

class Keeper {
  public:
    Keeper(const BoardFolder& board, UniqueFd news) : board_(board), news_(std::move(news)) {}

    /// Error: the sketch could not be started.
    Result<void> start(const std::string& name, const CommandMaker& maker);
    /// Until the sketch has ended.
    void run();

  private:
    void tell(const News& news);
    void take_signal();
    void take_output();
    void give_input();
    void wait_and_serve(int timeout_ms);

    const BoardFolder& board_;
    UniqueFd news_;  // closed once told
    UniqueFd lock_, listener_, signals_, to_sketch_, from_sketch_;
    board::linux::MemoryFolder memory_;
    pid_t child_ = 0;
    std::optional<int> status_;
    SerialHub hub_;
};

Result<void> Keeper::start(const std::string& name, const CommandMaker& maker) {
    QDUINO_TRY_ASSIGN(lock_, board::linux::lock_file(board_.lock(), kLockPatience));
    QDUINO_TRY(posix::write_file(board_.keeper(), text<std::string>(::getpid(), ' ', name)));
    QDUINO_TRY_ASSIGN(listener_, posix::listen_local(board_.serial(), 8));
    QDUINO_TRY_ASSIGN(memory_, board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
    QDUINO_TRY_ASSIGN(const Words command, maker(memory_));
    signals_.reset(block_and_watch({SIGTERM, SIGINT, SIGHUP, SIGCHLD}));
    ::signal(SIGPIPE, SIG_IGN);
    QDUINO_TRY_ASSIGN(Pipe input, make_pipe());
    QDUINO_TRY_ASSIGN(Pipe output, make_pipe());
    const UniqueFd log{::open(board_.log().c_str(), O_WRONLY | O_APPEND | O_CLOEXEC)};
    if (!log.valid()) return posix::system_error("open", board_.log().native());
    QDUINO_TRY_ASSIGN(child_, apps::start(command, {input.read.get(), output.write.get(), log.get()}));
    to_sketch_ = std::move(input.write);
    from_sketch_ = std::move(output.read);
    ::fcntl(to_sketch_.get(), F_SETFL, O_NONBLOCK);
    return {};
}

void Keeper::tell(const News& news) {
    if (!news_.valid()) return;
    [[maybe_unused]] const ssize_t written = ::write(news_.get(), &news, sizeof news);
    news_.reset();
}

void Keeper::take_signal() {
    signalfd_siginfo signal{};
    if (::read(signals_.get(), &signal, sizeof signal) != static_cast<ssize_t>(sizeof signal)) return;
    int status = 0;
    if (signal.ssi_signo != SIGCHLD)
        ::kill(child_, SIGTERM);
    else if (::waitpid(child_, &status, WNOHANG) == child_)
        status_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

void Keeper::take_output() {
    std::array<char, 16 * 1024> bytes;
    const ssize_t count = ::read(from_sketch_.get(), bytes.data(), bytes.size());
    if (count > 0) hub_.take_output({bytes.data(), static_cast<std::size_t>(count)});
    if (count == 0) from_sketch_.reset();
}

void Keeper::give_input() {
    const std::string_view input = hub_.input();
    const ssize_t count = ::write(to_sketch_.get(), input.data(), input.size());
    if (count > 0) hub_.forget_input(static_cast<std::size_t>(count));
    if (count < 0 && errno == EPIPE) to_sketch_.reset();
}

void Keeper::wait_and_serve(int timeout_ms) {
    std::vector<pollfd> looks{{signals_.get(), POLLIN, 0},
                              {listener_.get(), POLLIN, 0},
                              {from_sketch_.get(), POLLIN, 0},
                              {hub_.input().empty() ? -1 : to_sketch_.get(), POLLOUT, 0}};
    const std::size_t own = looks.size();
    for (const pollfd& wait : hub_.waits()) looks.push_back(wait);
    if (::poll(looks.data(), looks.size(), timeout_ms) <= 0) return;
    hub_.serve(std::span(looks).subspan(own));
    if (looks[3].revents != 0) give_input();
    if (looks[2].revents != 0) take_output();
    if (looks[1].revents != 0) {
        UniqueFd client{::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
        if (client.valid()) hub_.add(std::move(client));
    }
    if (looks[0].revents != 0) take_signal();
}

void Keeper::run() {
    while (!status_) {
        wait_and_serve(news_.valid() ? kLookForReportMs : -1);
        if (news_.valid() && !status_ && fs::exists(board_.report())) tell({});
    }
    // Its last words, which wait in the pipe, are for those who listen still.
    ::fcntl(from_sketch_.get(), F_SETFL, O_NONBLOCK);
    for (int i = 0; i < 64 && from_sketch_.valid(); ++i) take_output();
    for (int waited = 0; hub_.has_output() && waited < kLastWordsMs; waited += kLookForReportMs)
        wait_and_serve(kLookForReportMs);
    fs::remove(board_.serial());
    fs::remove(board_.keeper());
    tell({.ended = true, .status = *status_});
}

/// The keeper's life. It has a session of its own, and nothing of the caller's terminal.
[[noreturn]] void be_keeper(const BoardFolder& board, const std::string& name, const CommandMaker& command,
                            UniqueFd news) {
    ::setsid();
    if (::fork() != 0) ::_exit(0);
    {
        Keeper keeper(board, std::move(news));
        const Result<void> started = keeper.start(name, command);
        if (!started) Fail{"qduino: "}(started.error());
        const UniqueFd nothing{::open("/dev/null", O_RDWR | O_CLOEXEC)};
        for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
            ::dup2(nothing.get(), standard);
        if (started) keeper.run();
    }
    ::_exit(0);
}

/// Prints what the log has from `from` on. Returns where it ends.
std::size_t show_log(const fs::path& log, std::size_t from) {
    const auto text = posix::read_small_file(log);
    if (!text || text->size() <= from) return from;
    std::fwrite(text->data() + from, 1, text->size() - from, stderr);
    return text->size();
}

}  // namespace

Result<std::optional<int>> start_kept(const BoardFolder& board, const std::string& name,
                                      const CommandMaker& command) {
    std::error_code ignored;
    fs::remove(board.report(), ignored);
    QDUINO_TRY(posix::write_file(board.log(), ""));
    QDUINO_TRY_ASSIGN(Pipe news, make_pipe());
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child < 0) return posix::system_error("start", "a keeper");
    if (child == 0) be_keeper(board, name, command, std::move(news.write));
    news.write.reset();
    wait_for(child);
    std::size_t shown = 0;
    pollfd look{news.read.get(), POLLIN, 0};
    while (::poll(&look, 1, kLookForReportMs) == 0) shown = show_log(board.log(), shown);
    News heard{};
    const ssize_t count = ::read(news.read.get(), &heard, sizeof heard);
    show_log(board.log(), shown);
    if (count != static_cast<ssize_t>(sizeof heard))
        return make_error(ErrorCode::unavailable, "the sketch could not be started");
    return heard.ended ? std::optional{heard.status} : std::nullopt;
}

}  // namespace qduino::apps
