#include "board/linux/kernel/real_time_thread.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <malloc.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>

#include "board/linux/kernel/control_groups.h"
#include "posix/system_error.h"

// glibc names the field only from 2.38 on.
#ifndef sigev_notify_thread_id
#define sigev_notify_thread_id _sigev_un._tid
#endif

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;

Result<void> pin_to_core(int core) {
    if (core < 0 || core >= CPU_SETSIZE) return make_error(ErrorCode::invalid_argument, "no such core");
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(core), &set);
    if (const int error = ::pthread_setaffinity_np(::pthread_self(), sizeof set, &set); error != 0) {
        return system_error("pin a thread to core", std::to_string(core), error);
    }
    return {};
}

void widen(pthread_t thread) {
    cpu_set_t all;
    CPU_ZERO(&all);
    for (int core = 0; core < cpu_count(); ++core) CPU_SET(static_cast<std::size_t>(core), &all);
    ::pthread_setaffinity_np(thread, sizeof all, &all);
}

Result<void> become_real_time(int priority) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return {};
    return system_error("get SCHED_FIFO priority", std::to_string(priority));
}

Result<pthread_t> make_thread(std::string_view what, std::size_t stack_bytes, void* (*main)(void*),
                              void* self) {
    pthread_t thread{};
    pthread_attr_t attributes;
    ::pthread_attr_init(&attributes);
    ::pthread_attr_setstacksize(&attributes, stack_bytes);
    const int error = ::pthread_create(&thread, &attributes, main, self);
    ::pthread_attr_destroy(&attributes);
    if (error != 0) return system_error("make the thread of", what, error);
    return thread;
}

Result<timer_t> make_thread_timer(int signal) {
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = signal;
    event.sigev_notify_thread_id = static_cast<pid_t>(::syscall(SYS_gettid));
    timer_t timer{};
    if (::timer_create(CLOCK_MONOTONIC, &event, &timer) != 0) return system_error("make", "a budget timer");
    return timer;
}

void wake_on_time() { ::prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0); }

FixedString<200> why_no_real_time(const std::string& root) {
    FixedString<200> why;
    write(why, "no SCHED_FIFO");
    if (const auto quota = cpu_quota(root)) {
        write(why, ", and a quota of ", quota->runtime / 1us, " of ", quota->period / 1us, " us (",
              quota->file.substr(quota->file.find_last_of('/') + 1), ')');
    }
    const auto group = real_time_group(root);
    if (group && group->runtime == Nanoseconds{0}) {
        write(why,
              ": cpu.rt_runtime_us of its control group is 0 (`qduino doctor` names it): write a share "
              "there, or docker run --cpu-rt-runtime");
    } else {
        write(why, ": run as root, or allow it with `ulimit -r 99` or CAP_SYS_NICE");
    }
    return why;
}

namespace {

bool may_be_real_time() {
    rlimit limit{};
    return has_capability(CAP_SYS_NICE) || (::getrlimit(RLIMIT_RTPRIO, &limit) == 0 && limit.rlim_cur > 0);
}

}  // namespace

Result<void> lift_real_time_limit(Nanoseconds longest) {
    rlimit limit{};
    if (!may_be_real_time()) return {};
    if (::getrlimit(RLIMIT_RTTIME, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
    const rlimit none{RLIM_INFINITY, RLIM_INFINITY}, most{limit.rlim_max, limit.rlim_max};
    if (::setrlimit(RLIMIT_RTTIME, &none) == 0) return {};
    static_cast<void>(::setrlimit(RLIMIT_RTTIME, &most));
    if (limit.rlim_max == RLIM_INFINITY) return {};
    const Nanoseconds left{static_cast<std::int64_t>(std::min<rlim_t>(limit.rlim_max, 1'000'000'000'000)) *
                           1000};
    if (longest < left) return {};
    return make_error(
        ErrorCode::out_of_range, "RLIMIT_RTTIME is ", left,
        ": the kernel kills a loop that computes so long without a wait, and one here may: run as "
        "root, or raise it (`ulimit -R unlimited`, LimitRTTIME=infinity of systemd)");
}

void name_thread(std::string_view name) {
    std::array<char, 16> cut{};
    std::copy_n(name.begin(), std::min(name.size(), cut.size() - 1), cut.begin());
    ::pthread_setname_np(::pthread_self(), cut.data());
}

void touch_stack() {
    pthread_attr_t attributes;
    if (::pthread_getattr_np(::pthread_self(), &attributes) != 0) return;
    void* lowest = nullptr;
    std::size_t bytes = 0;
    ::pthread_attr_getstack(&attributes, &lowest, &bytes);
    ::pthread_attr_destroy(&attributes);
    // From well below this frame (no frame uses that yet) down to the end of the stack. The guard
    // page lies beyond.
    constexpr std::uintptr_t kStep = 4096;
    const auto end = reinterpret_cast<std::uintptr_t>(lowest);
    const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
    for (std::uintptr_t page = here - 2 * kStep; page > end; page -= kStep) {
        *reinterpret_cast<volatile char*>(page) = 0;
    }
}

bool has_capability(int capability) {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3] = {};
    const auto index = static_cast<unsigned>(capability);
    return ::syscall(SYS_capget, &header, data) == 0 &&
           (data[index / 32].effective & (1u << index % 32)) != 0;
}

namespace {

bool may_lock_all() {
    if (has_capability(CAP_IPC_LOCK)) return true;
    rlimit limit{};
    return ::getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY;
}

}  // namespace

Result<void> lock_memory() {
    // With a finite limit the call would succeed now, and the stack of a later thread be refused.
    if (!may_lock_all()) {
        return make_error(
            ErrorCode::not_permitted,
            "cannot lock memory: run as root, or allow it with `ulimit -l unlimited` or CAP_IPC_LOCK");
    }
    // Freed memory stays with the process: a later allocation does not fault pages in again.
    ::mallopt(M_TRIM_THRESHOLD, -1);
    ::mallopt(M_MMAP_MAX, 0);
    if (::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return system_error("lock", "memory");
    return {};
}

Result<UniqueFd> keep_cores_awake(const std::string& root) {
    UniqueFd request{::open((root + "/dev/cpu_dma_latency").c_str(), O_WRONLY | O_CLOEXEC)};
    const std::int32_t latency_us = 0;
    if (!request.valid() || ::write(request.get(), &latency_us, sizeof latency_us) < 0)
        return system_error("keep", "idle cores awake (/dev/cpu_dma_latency)");
    return request;
}

int cpu_count() {
    const long count = ::sysconf(_SC_NPROCESSORS_CONF);
    return static_cast<int>(std::clamp(count, 1L, static_cast<long>(CPU_SETSIZE)));
}

}  // namespace qduino::board::linux
