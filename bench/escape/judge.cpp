#include "bench/escape/judge.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <vector>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/loop/strangers.h"
#include "posix/small_file.h"
#include "posix/unique_fd.h"

namespace qduino::bench {
namespace {

using board::linux::block_until;
using board::linux::monotonic_now;

constexpr int kBeginsWithinMs = 8000;
constexpr Nanoseconds kLookEvery = 90ms;
constexpr Nanoseconds kReportsWithin = 30s;  // on a busy computer: it writes in a moment else

struct Process {
    pid_t parent = 0;
    std::string name;
};

/// All processes of the computer, of /proc/PID/stat: "PID (name) state parent …".
std::map<pid_t, Process> all_processes() {
    std::map<pid_t, Process> found;
    for (const std::string& entry : board::linux::entries("/proc")) {
        const auto pid = whole_number<pid_t>(entry);
        if (!pid) continue;
        const std::string stat = board::linux::text_of_file("/proc/" + entry + "/stat");
        const auto fields = board::linux::stat_fields(stat);
        if (fields.size() < 2) continue;
        const std::size_t open = stat.find('(');
        found[*pid] = {whole_number<pid_t>(fields[1]).value_or(0),
                       stat.substr(open + 1, stat.rfind(')') - open - 1)};
    }
    return found;
}

/// Those that come from this process.
std::map<pid_t, Process> descendants() {
    const auto all = all_processes();
    std::map<pid_t, Process> ours;
    for (const auto& [pid, process] : all) {
        pid_t ancestor = pid;
        while (all.contains(ancestor) && ancestor != ::getpid()) ancestor = all.at(ancestor).parent;
        if (ancestor == ::getpid() && pid != ::getpid()) ours[pid] = process;
    }
    return ours;
}

/// The CPU time of all threads that a process has or had, in seconds: the kernel's own sum.
double cpu_of(pid_t process) {
    clockid_t clock{};
    timespec used{};
    if (::clock_getcpuclockid(process, &clock) != 0 || ::clock_gettime(clock, &used) != 0) return 0;
    return static_cast<double>(used.tv_sec) + static_cast<double>(used.tv_nsec) * 1e-9;
}

/// The CPU time of the loops that keep to their budgets, in seconds.
double cpu_of_other_loops(pid_t sketch) {
    double used = 0;
    const std::string tasks = "/proc/" + std::to_string(sketch) + "/task/";
    for (const std::string& tid : board::linux::entries(tasks)) {
        const std::string name = board::linux::text_of_file(tasks + tid + "/comm");
        if (name != "loop 2" && name != "loop 3") continue;
        const std::string times = board::linux::text_of_file(tasks + tid + "/schedstat");
        used +=
            static_cast<double>(whole_number<long long>(times.substr(0, times.find(' '))).value_or(0)) * 1e-9;
    }
    return used;
}

struct Sample {
    double escapee = 0;
    double warden = 0;
};

Sample take_sample(pid_t sketch) {
    Sample sample;
    for (const auto& [pid, process] : descendants()) {
        if (process.name == "waker") continue;
        (process.name == "warden" ? sample.warden : sample.escapee) += cpu_of(pid);
    }
    sample.escapee -= cpu_of_other_loops(sketch);
    return sample;
}

/// Some thread runs at a real-time priority, its own or lent, that is none of the board's.
bool somebody_is_ranked() {
    for (const auto& [pid, process] : descendants()) {
        const std::string tasks = "/proc/" + std::to_string(pid) + "/task/";
        for (const std::string& tid : board::linux::entries(tasks)) {
            const std::string stat = board::linux::text_of_file(tasks + tid + "/stat");
            const board::linux::TaskRank rank = board::linux::task_rank(stat);
            if (rank.effective < 0 && !rank.name.starts_with("loop ") && rank.name != "warden" &&
                rank.name != "witness")
                return true;
        }
    }
    return false;
}

/// Whatever comes from this process ends, and is reaped.
void end_all() {
    for (;;) {
        const auto left = descendants();
        if (left.empty()) return;
        for (const auto& [pid, process] : left) ::kill(pid, SIGKILL);
        while (::waitpid(-1, nullptr, __WALL | WNOHANG) > 0) {
        }
        block_until(monotonic_now() + 2ms);
    }
}

/// `longest`: that it may spin at real-time priority; then the kernel ends it, whoever lives.
pid_t start(const std::vector<std::string>& command, int output, Nanoseconds longest) {
    const pid_t parent = ::getpid();
    const pid_t child = ::fork();
    if (child != 0) return child;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    const rlimit limit{static_cast<rlim_t>(longest / 1us), static_cast<rlim_t>(longest / 1us)};
    ::setrlimit(RLIMIT_RTTIME, &limit);
    ::setsid();
    ::dup2(output, STDOUT_FILENO);
    std::vector<char*> words;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    ::execv(words[0], words.data());
    ::_exit(127);
}

bool has_ended(pid_t process) {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(process), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid != 0;
}

/// The sketch's report, an object of JSON, which it writes at its end. Empty when none comes.
std::string report_of(pid_t sketch, const std::string& file) {
    std::string text;
    const Instant give_up = monotonic_now() + kReportsWithin;
    for (bool ended = false; !ended && !text.ends_with("}\n") && monotonic_now() < give_up;) {
        block_until(monotonic_now() + 10ms);
        ended = has_ended(sketch);  // before the file is read: then it is whole
        if (const auto written = posix::read_small_file(file)) text = *written;
    }
    return text;
}

/// What the sketch said at its end, "worst N"; < 0: nothing.
Nanoseconds worst_said(int output) {
    std::array<char, 256> text{};
    pollfd ready{output, POLLIN, 0};
    if (::poll(&ready, 1, 0) <= 0 || ::read(output, text.data(), text.size() - 1) <= 0)
        return Nanoseconds{-1};
    const char* const said = std::strstr(text.data(), "worst ");
    return Nanoseconds{said ? std::atol(said + 6) * 1000 : -1};
}

bool says_that_it_runs(int output) {
    pollfd ready{output, POLLIN, 0};
    char byte = 0;
    return ::poll(&ready, 1, kBeginsWithinMs) > 0 && ::read(output, &byte, 1) == 1;
}

}  // namespace

EscapeRun run_escape(const std::string& program, const std::string& pattern, Nanoseconds length,
                     bool with_warden) {
    EscapeRun run;
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // orphans stay ours
    const std::string report = "/dev/shm/qduino-escape-" + std::to_string(::getpid());
    ::unlink(report.c_str());
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) {
        run.trouble = "no pipe";
        return run;
    }
    const posix::UniqueFd said{ends[0]};
    posix::UniqueFd to_say{ends[1]};
    std::vector<std::string> command{program, pattern, text<std::string>(Fixed{to_seconds(length) + 0.3, 1}),
                                     report};
    if (!with_warden) command.emplace_back("--without-warden");
    const pid_t sketch = start(command, to_say.get(), length + kReportsWithin);
    to_say.reset();
    if (!says_that_it_runs(said.get())) {
        run.trouble = "it did not begin";
    } else {
        const Instant begun = monotonic_now();
        const Sample before = take_sample(sketch);
        for (Instant look = begun; look < begun + length; look += kLookEvery) {
            block_until(look);
            run.saw_ranked = somebody_is_ranked() || run.saw_ranked;
        }
        block_until(begun + length);
        const Sample after = take_sample(sketch);
        const double passed = to_seconds(monotonic_now() - begun);
        run.share = (after.escapee - before.escapee) / passed;
        run.warden_share = (after.warden - before.warden) / passed;
        run.report = report_of(sketch, report);
        run.bystander = worst_said(said.get());
    }
    end_all();
    ::unlink(report.c_str());
    return run;
}

}  // namespace qduino::bench
