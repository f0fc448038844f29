#include "bench/escape/patterns.h"

#include <fcntl.h>
#include <linux/io_uring.h>
#include <linux/membarrier.h>
#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/loop/budget_keeper.h"

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

/// A helper that wakes the process.
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

// ---- the kernel, and others, for it
// ---------------------------------------------------------------

pid_t warden_near() {
    for (pid_t near = ::getpid() + 1; near < ::getpid() + 200; ++near) {
        if (is_our_warden(near)) return near;
    }
    return 0;
}

[[noreturn]] void spin_beyond_its_budget() {
    mask(SIG_BLOCK);
    spin();
}

/// A descriptor that belongs to the warden, with the signal that ends it.
void kill_by_owner(Board&) {
    int ends[2];
    const pid_t victim = warden_near();
    if (victim != 0 && ::pipe(ends) == 0) {
        ::fcntl(ends[0], F_SETFL, O_ASYNC | O_NONBLOCK);
        f_owner_ex owner{F_OWNER_PID, victim};
        if (::fcntl(ends[0], F_SETOWN, victim) != 0) ::fcntl(ends[0], F_SETOWN_EX, &owner);
        ::fcntl(ends[0], F_SETSIG, SIGKILL);
        static_cast<void>(!::write(ends[1], "", 1));
    }
    spin_beyond_its_budget();
}

/// Where each line of /proc/PID/maps says that code is. That of the warden is this program's.
template <typename Function>
void for_each_code(pid_t process, const Function& function) {
    char path[64], line[512];
    snprintf(path, sizeof path, "/proc/%d/maps", process);
    std::FILE* maps = std::fopen(path, "re");
    while (maps && std::fgets(line, sizeof line, maps)) {
        unsigned long long begin = 0, end = 0;
        char rights[8] = {};
        if (sscanf(line, "%llx-%llx %7s", &begin, &end, rights) == 3 && rights[2] == 'x')
            function(begin, end);
    }
    if (maps) std::fclose(maps);
}

void write_over_the_warden(Board&) {
    constexpr int kHalt = 0xF4;
    static char junk[65536];
    memset(junk, kHalt, sizeof junk);
    char path[64];
    const pid_t victim = warden_near();
    snprintf(path, sizeof path, "/proc/%d/mem", victim);
    if (const int memory = victim != 0 ? ::open(path, O_RDWR) : -1; memory >= 0) {
        for_each_code(::getpid(), [&](unsigned long long begin, unsigned long long end) {
            for (unsigned long long at = begin; at < end; at += sizeof junk)
                static_cast<void>(!::pwrite64(memory, junk, sizeof junk, static_cast<off64_t>(at)));
        });
    }
    spin_beyond_its_budget();
}

bool write_word(const char* path, const char* word) {
    const int file = ::open(path, O_WRONLY);
    if (file < 0) return false;
    const bool written = ::write(file, word, strlen(word)) > 0;
    ::close(file);
    return written;
}

void first_to_die(Board&) {
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/oom_score_adj", warden_near());
    write_word(path, "1000");
    spin_beyond_its_budget();
}

/// By a control group of its own, of either version.
void freeze_the_warden(Board&) {
    char number[16];
    snprintf(number, sizeof number, "%d", warden_near());
    for (const char* root : {"/sys/fs/cgroup/freezer/", "/sys/fs/cgroup/unified/", "/sys/fs/cgroup/"}) {
        const std::string folder = root + std::string{"qduino-escape"};
        if (::mkdir(folder.c_str(), 0700) != 0) continue;
        const bool moved = number[0] != '0' && write_word((folder + "/cgroup.procs").c_str(), number);
        if (moved && !write_word((folder + "/cgroup.freeze").c_str(), "1"))
            write_word((folder + "/freezer.state").c_str(), "FROZEN");
        if (!moved) ::rmdir(folder.c_str());
        break;
    }
    spin_beyond_its_budget();
}

void polling_ring(Board&) {
    io_uring_params parameters{};
    parameters.flags = IORING_SETUP_SQPOLL;
    parameters.sq_thread_idle = 60'000;
    ::syscall(SYS_io_uring_setup, 4, &parameters);
    spin_beyond_its_budget();
}

void faults_that_others_serve(Board&) {
    ::syscall(SYS_userfaultfd, O_CLOEXEC);
    spin_beyond_its_budget();
}

void barriers_on_all_cores(Board&) {
    ::syscall(SYS_membarrier, MEMBARRIER_CMD_REGISTER_PRIVATE_EXPEDITED, 0, 0);
    for (;;) ::syscall(SYS_membarrier, MEMBARRIER_CMD_PRIVATE_EXPEDITED, 0, 0);
}

// ---- threads and processes of setup() -----------------------------------------------------------

std::atomic<bool> g_begun{false};

void stay_on_the_last_core() {
    cpu_set_t last;
    CPU_ZERO(&last);
    CPU_SET(static_cast<std::size_t>(board::linux::cpu_count() - 1), &last);
    ::sched_setaffinity(0, sizeof last, &last);
}

void wait_until_begun() {
    while (!g_begun) nap(1ms);
}

void start_thread(void* (*main)(void*)) {
    pthread_t thread{};
    ::pthread_create(&thread, nullptr, main, nullptr);
}

pthread_mutex_t g_lent;

void* hold_the_lock(void*) {
    ::prctl(PR_SET_NAME, "pi-holder");
    stay_on_the_last_core();
    wait_until_begun();
    for (;;) {
        ::pthread_mutex_lock(&g_lent);
        spin_for(300ms);
        ::pthread_mutex_unlock(&g_lent);
        nap(200us);
    }
}

void prepare_lock() {
    pthread_mutexattr_t inherits{};
    ::pthread_mutexattr_init(&inherits);
    ::pthread_mutexattr_setprotocol(&inherits, PTHREAD_PRIO_INHERIT);
    ::pthread_mutex_init(&g_lent, &inherits);
    start_thread(hold_the_lock);
}

void lend_its_priority(Board& board) {
    g_begun = true;
    for (Instant release = board.now(); !board.stop_requested(); release += 10ms) {
        ::pthread_mutex_lock(&g_lent);
        ::pthread_mutex_unlock(&g_lent);
        board.sleep_until(release);
    }
}

/// In front of everybody for a moment, and an ordinary one when somebody looks.
void take_turns_at_the_top() {
    const sched_param highest{98}, ordinary{};
    for (;;) {
        ::sched_setscheduler(0, SCHED_FIFO, &highest);
        spin_for(150ms);
        ::sched_setscheduler(0, SCHED_OTHER, &ordinary);
        nap(2ms);
    }
}

void* usurp(void*) {
    ::prctl(PR_SET_NAME, "usurper");
    stay_on_the_last_core();
    wait_until_begun();
    take_turns_at_the_top();
    return nullptr;
}

void prepare_usurper() { start_thread(usurp); }

/// It has no budget to keep to; the loop itself takes next to nothing.
void wait_for_the_others(Board& board) {
    g_begun = true;
    for (Instant release = board.now(); !board.stop_requested(); release += 10ms) board.sleep_until(release);
}

void prepare_child() {
    if (::fork() != 0) return;
    ::prctl(PR_SET_NAME, "ranked-child");
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    stay_on_the_last_core();
    nap(1s);  // by then the loops run
    take_turns_at_the_top();
}

[[noreturn]] void rank_and_spin() {
    ::prctl(PR_SET_NAME, "ranked-child");
    const sched_param highest{98};
    ::sched_setscheduler(0, SCHED_FIFO, &highest);
    spin_for(1s);
    ::_exit(0);
}

/// Each is in front of everybody until somebody stops it; then there is another.
void prepare_children() {
    if (::fork() != 0) return;
    ::prctl(PR_SET_NAME, "maker");
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    stay_on_the_last_core();
    nap(1s);
    for (;;) {
        if (::fork() == 0) rank_and_spin();
        nap(20ms);
    }
}

/// The process between it and the sketch is gone.
void prepare_orphan() {
    const pid_t between = ::fork();
    if (between != 0) {
        ::waitpid(between, nullptr, 0);
        return;
    }
    if (::fork() != 0) ::_exit(0);
    ::prctl(PR_SET_NAME, "ranked-orphan");
    stay_on_the_last_core();
    nap(1s);
    take_turns_at_the_top();
}

std::vector<int> g_timers;

void prepare_timers() {
    rlimit files{};
    ::getrlimit(RLIMIT_NOFILE, &files);
    files.rlim_cur = files.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &files);
    constexpr std::size_t kMost = 19'900;
    while (g_timers.size() < kMost) {
        const int timer = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
        if (timer < 0) break;
        g_timers.push_back(timer);
    }
}

/// All run out at one instant, twice a second.
void timer_storm(Board& board) {
    for (Instant release = board.now(); !board.stop_requested(); release += 500ms) {
        itimerspec when{};
        when.it_value = board::linux::to_timespec(to_ns(release + 500ms));
        for (const int timer : g_timers) ::timerfd_settime(timer, TFD_TIMER_ABSTIME, &when, nullptr);
        board.sleep_until(release);
    }
}

void* arm_timers(void*) {
    ::prctl(PR_SET_NAME, "timer-storm");
    wait_until_begun();
    for (Instant next = monotonic_now() + 500ms;; next += 500ms) {
        itimerspec when{};
        when.it_value = board::linux::to_timespec(to_ns(next));
        for (const int timer : g_timers) ::timerfd_settime(timer, TFD_TIMER_ABSTIME, &when, nullptr);
        board::linux::block_until(next);
    }
}

void prepare_threads_timers() {
    prepare_timers();
    start_thread(arm_timers);
}

void* shoot(void*) {
    ::prctl(PR_SET_NAME, "shooter");
    wait_until_begun();
    void* page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    for (;;) {
        *static_cast<volatile char*>(page) = 1;
        ::mprotect(page, 4096, PROT_READ);
        ::mprotect(page, 4096, PROT_READ | PROT_WRITE);
    }
}

void prepare_shooter() { start_thread(shoot); }

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
    EscapePattern{"stops_itself", "stops its process, is continued", stop_the_process, start_waker},
    EscapePattern{"descriptor_owner", "has a descriptor kill the warden", kill_by_owner},
    EscapePattern{"written_over", "writes over the warden's code", write_over_the_warden},
    EscapePattern{"first_to_die", "offers the warden to a lack of memory", first_to_die},
    EscapePattern{"frozen_warden", "freezes the warden by a control group", freeze_the_warden},
    EscapePattern{"polling_ring", "has a ring of the kernel's poll for it", polling_ring},
    EscapePattern{"user_faults", "has its page faults served by others", faults_that_others_serve},
    EscapePattern{"barriers", "interrupts all cores", barriers_on_all_cores},
    EscapePattern{"lent_priority", "lends its priority to setup()'s thread", lend_its_priority, prepare_lock,
                  true},
    EscapePattern{"ranked_thread", "setup()'s thread ranks itself now and then", wait_for_the_others,
                  prepare_usurper},
    EscapePattern{"ranked_child", "setup()'s process ranks itself now and then", wait_for_the_others,
                  prepare_child},
    EscapePattern{"timer_storm", "arms 19,900 timers for one instant", timer_storm, prepare_timers},
    EscapePattern{"ranked_children", "setup()'s process ranks one child after the other", wait_for_the_others,
                  prepare_children},
    EscapePattern{"ranked_orphan", "a process without a parent ranks itself", wait_for_the_others,
                  prepare_orphan},
    EscapePattern{"threads_timers", "setup()'s thread arms 19,900 timers for one instant",
                  wait_for_the_others, prepare_threads_timers, false, true},
    EscapePattern{"shootdowns", "setup()'s thread interrupts all cores", wait_for_the_others, prepare_shooter,
                  false, true},
};

}  // namespace

std::span<const EscapePattern> escape_patterns() { return kPatterns; }

}  // namespace qduino::bench
