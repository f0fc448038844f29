#include "board/linux/kernel/confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <initializer_list>

#include "base/fixed_vector.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/kernel/written_files.h"
#include "posix/system_error.h"

#ifndef SECCOMP_FILTER_FLAG_SPEC_ALLOW
#define SECCOMP_FILTER_FLAG_SPEC_ALLOW (1UL << 2)
#endif

namespace qduino::board::linux {

namespace {

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
constexpr std::uint32_t kOtherNumbers = 0x40000000;  // the x32 interface
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
constexpr std::uint32_t kOtherNumbers = 0x80000000;  // none
#else
constexpr std::uint32_t kArchitecture = 0;  // not known: no filter
constexpr std::uint32_t kOtherNumbers = 0x80000000;
#endif

constexpr std::uint32_t fails_with(int error) {
    return SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error);
}

/// The program of the filter, in the kernel's instructions for such (seccomp(2)).
class Filter {
  public:
    Filter() {
        load(offsetof(seccomp_data, arch));
        unless(BPF_JEQ, kArchitecture, fails_with(ENOSYS));
        load(offsetof(seccomp_data, nr));
        when(BPF_JGE, kOtherNumbers, fails_with(ENOSYS));
    }
    void refuse(std::initializer_list<long> calls, int error) {
        for (const long call : calls) when(BPF_JEQ, static_cast<std::uint32_t>(call), fails_with(error));
    }
    /// Refuses `call` where the low half of its argument `n` is one of `values`.
    void refuse_argument(long call, std::size_t n, std::initializer_list<std::uint32_t> values) {
        const auto rest = static_cast<std::uint8_t>(2 + 2 * values.size());
        add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, rest);
        load(argument(n));
        for (const std::uint32_t value : values) when(BPF_JEQ, value, fails_with(EPERM));
        load(offsetof(seccomp_data, nr));
    }
    /// Calls whose first argument names a process, or everybody, or the group of a process.
    void refuse_of(std::initializer_list<long> calls, pid_t process) {
        const auto number = static_cast<std::uint32_t>(process);
        for (const long call : calls) refuse_argument(call, 0, {number, 0xFFFFFFFF, 0 - number});
    }
    /// sched_setscheduler() by the thread for itself: to SCHED_OTHER, and back with the one
    /// sched_param at `own_rank`. Any other is refused. Where another number is loaded it goes on.
    void allow_own_rank(const void* own_rank) {
        constexpr std::uint32_t kFlag = SCHED_RESET_ON_FORK;
        const auto address = reinterpret_cast<std::uintptr_t>(own_rank);
        constexpr std::size_t kWord = sizeof(std::uint32_t);
        add(BPF_JMP | BPF_JEQ | BPF_K, SYS_sched_setscheduler, 0, 15);
        load(argument(0));
        unless(BPF_JEQ, 0, fails_with(EPERM));
        load(argument(1));
        when(BPF_JEQ, SCHED_OTHER | kFlag, SECCOMP_RET_ALLOW);
        unless(BPF_JEQ, SCHED_FIFO | kFlag, fails_with(EPERM));
        load(argument(2));
        unless(BPF_JEQ, static_cast<std::uint32_t>(address), fails_with(EPERM));
        load(argument(2) + kWord);
        unless(BPF_JEQ, static_cast<std::uint32_t>(address >> 32), fails_with(EPERM));
        answer(SECCOMP_RET_ALLOW);
    }
    Result<void> install() {
        answer(SECCOMP_RET_ALLOW);
        const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.begin()};
        // Without the flag, kernels before 5.16 slow the thread down, against attacks of code that
        // it interprets; a sketch interprets none.
        if (::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_SPEC_ALLOW, &program) != 0)
            return posix::system_error("confine", "a loop");
        return {};
    }

  private:
    static constexpr std::size_t argument(std::size_t n) {
        return offsetof(seccomp_data, args) + n * sizeof(std::uint64_t);
    }
    void add(int code, std::uint32_t k, std::uint8_t yes = 0, std::uint8_t no = 0) {
        code_.push_back({static_cast<std::uint16_t>(code), yes, no, k});
    }
    void load(std::size_t offset) { add(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)); }
    void answer(std::uint32_t what) { add(BPF_RET | BPF_K, what); }
    void when(int comparison, std::uint32_t k, std::uint32_t what) {
        add(BPF_JMP | comparison | BPF_K, k, 0, 1);
        answer(what);
    }
    void unless(int comparison, std::uint32_t k, std::uint32_t what) {
        add(BPF_JMP | comparison | BPF_K, k, 1, 0);
        answer(what);
    }

    FixedVector<sock_filter, 256> code_;
};

/// The rights of root by which a loop could get at its warden, or at the kernel under both. A
/// thread that lacks one that a process has cannot reach into it (ptrace(2), access mode checks).
constexpr std::array kRightsLost{CAP_SYS_PTRACE, CAP_SYS_ADMIN, CAP_SYS_MODULE, CAP_SYS_BOOT};

void lose_rights() {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> rights{};
    if (::syscall(SYS_capget, &header, rights.data()) != 0) return;
    for (const unsigned right : kRightsLost) {
        auto& part = rights[right / 32];
        const std::uint32_t without = ~(1U << right % 32);
        part.effective &= without;
        part.permitted &= without;
        part.inheritable &= without;
    }
    ::syscall(SYS_capset, &header, rights.data());
}

void refuse_ways_to_others(Filter& filter, pid_t warden) {
    constexpr std::uint32_t kSetOwner = 0x8901, kSetGroup = 0x8902;  // FIOSETOWN, SIOCSPGRP
    filter.refuse({SYS_ptrace, SYS_process_vm_writev, SYS_process_madvise, SYS_pidfd_send_signal,
                   SYS_pidfd_getfd, SYS_io_uring_setup, SYS_io_uring_enter, SYS_io_uring_register,
                   SYS_userfaultfd, SYS_perf_event_open, SYS_bpf, SYS_timerfd_settime},
                  EPERM);
    filter.refuse_argument(SYS_fcntl, 1, {F_SETOWN, F_SETOWN_EX, F_SETSIG, F_NOTIFY});
    filter.refuse_argument(SYS_ioctl, 1, {kSetOwner, kSetGroup});
    filter.refuse_argument(SYS_prctl, 0, {PR_SET_DUMPABLE, PR_SET_PTRACER});
    filter.refuse_argument(SYS_prlimit64, 1, {RLIMIT_SIGPENDING, RLIMIT_RTPRIO, RLIMIT_RTTIME});
#if defined(__x86_64__)
    filter.refuse_argument(SYS_setrlimit, 0, {RLIMIT_SIGPENDING, RLIMIT_RTPRIO, RLIMIT_RTTIME});
#endif
    if (warden != 0) {
        filter.refuse_of({SYS_kill, SYS_tkill, SYS_tgkill, SYS_rt_sigqueueinfo, SYS_rt_tgsigqueueinfo,
                          SYS_pidfd_open, SYS_prlimit64},
                         warden);
    }
}

}  // namespace

Result<void> confine(const Confinement& confinement) {
    if (kArchitecture == 0) return make_error(ErrorCode::unsupported, "no filter for this architecture");
    Filter filter;
    if (confinement.own_rank) filter.allow_own_rank(confinement.own_rank);
    filter.refuse({SYS_sched_setscheduler, SYS_sched_setparam, SYS_sched_setattr, SYS_sched_setaffinity},
                  EPERM);
    refuse_ways_to_others(filter, confinement.warden);
    if (!confinement.may_make_threads) {
        filter.refuse({SYS_execve, SYS_execveat}, EPERM);
        filter.refuse({SYS_clone, SYS_clone3}, EAGAIN);
#if defined(__x86_64__)
        filter.refuse({SYS_fork, SYS_vfork}, EAGAIN);
#endif
    }
    if (!has_capability(CAP_SYS_ADMIN)) ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    if (confinement.written_files >= 0) restrict_written_files(confinement.written_files);
    const Result<void> installed = filter.install();
    lose_rights();
    return installed;
}

}  // namespace qduino::board::linux
