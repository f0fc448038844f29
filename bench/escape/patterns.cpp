#include "bench/escape/patterns.h"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "board/linux/budget_keeper.h"
#include "board/linux/clock.h"

extern char** environ;  // NOLINT: POSIX's name

namespace qduino::bench {
namespace {

using board::Board;
using board::linux::BudgetKeeper;
using board::linux::monotonic_now;

// ---- parts --------------------------------------------------------------------------------------

[[noreturn]] void spin() {
    for (;;) asm volatile("");
}

void spin_for(Nanoseconds length) {
    const Instant end = monotonic_now() + length;
    while (monotonic_now() < end) {
    }
}

/// Through the signals of its budget's timer.
void nap(Nanoseconds length) { board::linux::block_until(monotonic_now() + length); }

void mask(int how) {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(how, &all, nullptr);
}

void handle(int signal, void (*handler)(int)) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = SA_NODEFER;
    sigemptyset(&action.sa_mask);
    ::sigaction(signal, &action, nullptr);
}

extern "C" void do_nothing(int) {}

/// The kernel numbers the timers of a process from 0.
template <typename Function>
void for_each_timer(const Function& function) {
    for (int id = 0; id < 64; ++id) function(id);
}

// ---- the timer and its signal -------------------------------------------------------------------

void block_signals(Board&) {
    mask(SIG_BLOCK);
    spin();
}

void block_now_and_then(Board&) {
    for (;;) {
        mask(SIG_BLOCK);
        spin_for(5ms);
        mask(SIG_UNBLOCK);
        nap(5ms);
    }
}

void ignore_signal(Board&) {
    handle(BudgetKeeper::signal_number(), SIG_IGN);
    spin();
}

void own_handler(Board&) {
    handle(BudgetKeeper::signal_number(), do_nothing);
    spin();
}

void delete_timers(Board&) {
    for_each_timer([](int id) { ::syscall(SYS_timer_delete, id); });
    spin();
}

void postpone_timers(Board&) {
    const itimerspec later{{0, 0}, {3600, 0}};
    for (;;) {
        for_each_timer([&](int id) { ::syscall(SYS_timer_settime, id, 0, &later, nullptr); });
        spin_for(100us);
    }
}

sigjmp_buf g_way_out;
extern "C" void jump_out(int) { siglongjmp(g_way_out, 1); }

/// Another timer's handler jumps out of the sleep in the handler of the budget's timer.
void jump_out_of_the_throttle(Board&) {
    handle(SIGRTMIN + 7, jump_out);
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = SIGRTMIN + 7;
    event._sigev_un._tid = static_cast<pid_t>(::syscall(SYS_gettid));
    timer_t timer{};
    ::timer_create(CLOCK_MONOTONIC, &event, &timer);
    const itimerspec often{{0, 1'500'000}, {0, 1'500'000}};
    ::timer_settime(timer, 0, &often, nullptr);
    sigsetjmp(g_way_out, 1);
    spin();
}

// ---- others in its place ------------------------------------------------------------------------

void* spin_thread(void*) {
    mask(SIG_BLOCK);
    spin();
}

void new_threads(Board&) {
    for (;;) {
        pthread_t thread{};
        ::pthread_create(&thread, nullptr, spin_thread, nullptr);
        nap(200ms);
    }
}

[[noreturn]] void spin_as_child() {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    spin();
}

void fork_spinner(Board&) {
    for (;;) {
        if (::fork() == 0) spin_as_child();
        nap(200ms);
    }
}

void vfork_and_exec(Board&) {
    std::array<char*, 4> command{const_cast<char*>("/bin/sh"), const_cast<char*>("-c"),
                                 const_cast<char*>("while :; do :; done"), nullptr};
    for (;;) {
        pid_t child = 0;
        ::posix_spawn(&child, command[0], nullptr, nullptr, command.data(), environ);
        nap(300ms);
    }
}

void become_another_program(Board&) {
    mask(SIG_BLOCK);
    ::execl("/bin/sh", "sh", "-c", "while :; do :; done", nullptr);
    spin();
}

// ---- rank and place -----------------------------------------------------------------------------

void raise_priority(Board&) {
    sched_param highest{};
    highest.sched_priority = 99;
    ::sched_setscheduler(0, SCHED_FIFO, &highest);
    mask(SIG_BLOCK);
    spin();
}

void move_to_another_core(Board&) {
    cpu_set_t all;
    memset(&all, 0xFF, sizeof all);
    ::sched_setaffinity(0, sizeof all, &all);
    mask(SIG_BLOCK);
    spin();
}

/// /proc/PID/stat begins with "PID (name) state parent".
bool is_our_warden(pid_t process) {
    char path[64], text[128] = {};
    snprintf(path, sizeof path, "/proc/%d/stat", process);
    const int file = ::open(path, O_RDONLY);
    if (file < 0) return false;
    const bool read = ::read(file, text, sizeof text - 1) > 0;
    ::close(file);
    pid_t parent = 0;
    return read && sscanf(text, "%*d (warden) %*c %d", &parent) == 1 && parent == ::getpid();
}

void kill_the_warden(Board&) {
    mask(SIG_BLOCK);
    for (;;) {
        for (pid_t near = ::getpid() + 1; near < ::getpid() + 200; ++near) {
            if (!is_our_warden(near)) continue;
            ::kill(near, SIGKILL);
            ::syscall(SYS_tgkill, near, near, SIGKILL);
            ::ptrace(PTRACE_SEIZE, near, nullptr, nullptr);
        }
        spin_for(20ms);
    }
}

// ---- time that is hard to see -------------------------------------------------------------------

void many_short_sleeps(Board&) {
    ::prctl(PR_SET_TIMERSLACK, 1);
    for (;;) {
        nap(20us);
        spin_for(20us);
    }
}

void yield_for_ever(Board&) {
    for (;;) ::sched_yield();
}

void spin_with_a_lock(Board& board) {
    static board::LockWord lock;
    board.lock(lock);
    spin();
}

void lock_after_lock(Board& board) {
    static board::LockWord lock;
    for (;;) {
        board.lock(lock);
        spin_for(1900us);
        board.unlock(lock);
    }
}

void long_system_calls(Board&) {
    constexpr std::size_t kBytes = std::size_t{256} << 20;
    mask(SIG_BLOCK);
    void* memory =
        ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    const int zeros = ::open("/dev/zero", O_RDONLY);
    for (;;) static_cast<void>(!::read(zeros, memory, kBytes));
}

void page_faults(Board&) {
    constexpr std::size_t kBytes = std::size_t{8} << 20;
    mask(SIG_BLOCK);
    for (;;) {
        auto* memory = static_cast<volatile char*>(
            ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
        for (std::size_t at = 0; at < kBytes; at += 4096) memory[at] = 1;
        ::munmap(const_cast<char*>(memory), kBytes);
    }
}

void lower_limits(Board&) {
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_RTPRIO, &none);
    ::setrlimit(RLIMIT_SIGPENDING, &none);
    mask(SIG_BLOCK);
    spin();
}

void stop_the_process(Board&) {
    mask(SIG_BLOCK);
    for (;;) {
        spin_for(2ms);
        ::kill(::getpid(), SIGSTOP);
    }
}

constexpr std::array kPatterns{
    EscapePattern{"blocked_signals", "blocks its signals", block_signals},
    EscapePattern{"blocked_now_and_then", "blocks them for 5 ms, rests for 5 ms", block_now_and_then},
    EscapePattern{"ignored_signal", "ignores the budget's signal", ignore_signal},
    EscapePattern{"own_handler", "has a handler of its own for it", own_handler},
    EscapePattern{"deleted_timers", "deletes all timers", delete_timers},
    EscapePattern{"postponed_timers", "sets all timers to an hour", postpone_timers},
    EscapePattern{"jump_out", "jumps out of the throttling handler", jump_out_of_the_throttle},
    EscapePattern{"new_threads", "makes threads that spin", new_threads},
    EscapePattern{"fork", "makes processes that spin", fork_spinner},
    EscapePattern{"vfork_exec", "starts programs that spin", vfork_and_exec},
    EscapePattern{"exec", "becomes another program", become_another_program},
    EscapePattern{"raised_priority", "raises its priority", raise_priority},
    EscapePattern{"another_core", "moves to all cores", move_to_another_core},
    EscapePattern{"killed_warden", "kills its warden", kill_the_warden},
    EscapePattern{"short_sleeps", "sleeps 20 us, spins 20 us", many_short_sleeps},
    EscapePattern{"yields", "yields for ever", yield_for_ever},
    EscapePattern{"spins_with_lock", "spins with a lock", spin_with_a_lock},
    EscapePattern{"lock_after_lock", "overruns in one lock after the other", lock_after_lock},
    EscapePattern{"long_system_calls", "reads 256 MB of zeros at a time", long_system_calls},
    EscapePattern{"page_faults", "touches new memory", page_faults},
    EscapePattern{"lowered_limits", "takes its process's right to priorities", lower_limits},
    EscapePattern{"stops_itself", "stops its process, is continued", stop_the_process},
};

}  // namespace

std::span<const EscapePattern> escape_patterns() { return kPatterns; }

void start_waker() {
    const pid_t parent = ::getpid();
    if (::fork() != 0) return;
    ::prctl(PR_SET_NAME, "waker");
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    while (::getppid() == parent) {
        nap(1ms);
        ::kill(parent, SIGCONT);
    }
    ::_exit(0);
}

}  // namespace qduino::bench
