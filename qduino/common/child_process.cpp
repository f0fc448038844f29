#include "qduino/common/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

extern char** environ;

namespace qduino::apps {
namespace {

std::vector<char*> arguments_of(const std::vector<std::string>& command) {
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    return arguments;
}

Error cannot_run(const std::string& program, int error) {
    return make_error(error == ENOENT ? ErrorCode::not_found : ErrorCode::unavailable, program,
                      " cannot be run: ", std::strerror(error));
}

/// The number of the child that runs `command`.
Result<pid_t> spawn(const std::vector<std::string>& command, const posix_spawn_file_actions_t* files,
                    const posix_spawnattr_t* attributes) {
    pid_t child = 0;
    const int error =
        ::posix_spawnp(&child, command[0].c_str(), files, attributes, arguments_of(command).data(), environ);
    if (error != 0) return cannot_run(command[0], error);
    return child;
}

std::atomic<pid_t> in_front{0};

void hand_on(int signal, siginfo_t* info, void*) {
    const pid_t child = in_front.load();
    if (child > 0 && info->si_code != SI_KERNEL) ::kill(child, signal);
}

constexpr int kHandedOn[] = {SIGINT, SIGTERM, SIGHUP};

}  // namespace

std::string shell_words(const std::vector<std::string>& command) {
    constexpr std::string_view kPlain =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=./,:@%";
    std::string line;
    for (const std::string& word : command) {
        if (!line.empty()) line += ' ';
        if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
            line += word;
            continue;
        }
        line += '\'';
        for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
        line += '\'';
    }
    return line;
}

Result<int> run_into(const std::vector<std::string>& command, const std::filesystem::path& output) {
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                       0644);
    ::posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    const Result<pid_t> child = spawn(command, &actions, nullptr);
    ::posix_spawn_file_actions_destroy(&actions);
    if (!child) return child.error();
    return wait_for(*child);
}

int wait_for(pid_t child) {
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

Result<pid_t> start(const std::vector<std::string>& command, const ChildStreams& streams) {
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    const std::pair<int, int> all[] = {
        {streams.input, STDIN_FILENO}, {streams.output, STDOUT_FILENO}, {streams.errors, STDERR_FILENO}};
    for (const auto& [given, standard] : all) {
        if (given >= 0) ::posix_spawn_file_actions_adddup2(&actions, given, standard);
    }
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    sigset_t usual;
    sigemptyset(&usual);
    sigaddset(&usual, SIGPIPE);
    ::posix_spawnattr_setsigdefault(&attributes, &usual);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    Result<pid_t> child = spawn(command, &actions, &attributes);
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
    return child;
}

Result<int> run_in_front(const std::vector<std::string>& command) {
    sigset_t handed_on, before;
    sigemptyset(&handed_on);
    for (const int signal : kHandedOn) sigaddset(&handed_on, signal);
    ::sigprocmask(SIG_BLOCK, &handed_on, &before);  // none is lost before the child is known

    struct sigaction action {};
    action.sa_sigaction = hand_on;
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    for (const int signal : kHandedOn) {
        struct sigaction present {};
        ::sigaction(signal, nullptr, &present);
        // The child inherits the signals that a shell or nohup makes this process ignore: those
        // need not be handed on.
        if (present.sa_handler != SIG_IGN) ::sigaction(signal, &action, nullptr);
    }

    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    ::posix_spawnattr_setsigmask(&attributes, &before);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    const Result<pid_t> child = spawn(command, nullptr, &attributes);
    ::posix_spawnattr_destroy(&attributes);
    in_front.store(child ? *child : 0);
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    if (!child) return child.error();
    const int status = wait_for(*child);
    in_front.store(0);
    return status;
}

Error become(const std::vector<std::string>& command) {
    ::execvp(command[0].c_str(), arguments_of(command).data());
    return cannot_run(command[0], errno);
}

}  // namespace qduino::apps
