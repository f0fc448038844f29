#include "rights/rights.h"

#include <seccomp.h>
#include <sys/capability.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>

#include "posix/system_error.h"

namespace qduino::rights {
namespace {

using posix::system_error;

constexpr std::array kRefused{SCMP_SYS(execve),
                              SCMP_SYS(execveat),
                              SCMP_SYS(ptrace),
                              SCMP_SYS(process_vm_readv),
                              SCMP_SYS(process_vm_writev),
                              SCMP_SYS(pidfd_getfd),
                              SCMP_SYS(kcmp),
                              SCMP_SYS(mount),
                              SCMP_SYS(umount2),
                              SCMP_SYS(pivot_root),
                              SCMP_SYS(chroot),
                              SCMP_SYS(open_tree),
                              SCMP_SYS(move_mount),
                              SCMP_SYS(fsopen),
                              SCMP_SYS(fsmount),
                              SCMP_SYS(mount_setattr),
                              SCMP_SYS(open_by_handle_at),
                              SCMP_SYS(setns),
                              SCMP_SYS(unshare),
                              SCMP_SYS(bpf),
                              SCMP_SYS(perf_event_open),
                              SCMP_SYS(userfaultfd),
                              SCMP_SYS(io_uring_setup),
                              SCMP_SYS(init_module),
                              SCMP_SYS(finit_module),
                              SCMP_SYS(delete_module),
                              SCMP_SYS(kexec_load),
                              SCMP_SYS(kexec_file_load),
                              SCMP_SYS(keyctl),
                              SCMP_SYS(add_key),
                              SCMP_SYS(request_key),
                              SCMP_SYS(clock_settime),
                              SCMP_SYS(settimeofday),
                              SCMP_SYS(adjtimex),
                              SCMP_SYS(clock_adjtime),
                              SCMP_SYS(reboot),
                              SCMP_SYS(swapon),
                              SCMP_SYS(swapoff),
                              SCMP_SYS(sethostname),
                              SCMP_SYS(setdomainname),
                              SCMP_SYS(acct),
                              SCMP_SYS(quotactl),
                              SCMP_SYS(personality),
                              SCMP_SYS(iopl),
                              SCMP_SYS(ioperm),
                              SCMP_SYS(syslog),
                              SCMP_SYS(vhangup),
                              SCMP_SYS(mknod),
                              SCMP_SYS(mknodat)};

bool is_kept(Capabilities kept, int capability) { return std::ranges::find(kept, capability) != kept.end(); }

}  // namespace

Result<void> bound_capabilities(Capabilities kept) {
    if (::geteuid() != 0) return {};
    for (int capability = 0; cap_get_bound(capability) >= 0; ++capability) {
        if (cap_get_bound(capability) == 0 || is_kept(kept, capability)) continue;
        if (cap_drop_bound(capability) != 0) return system_error("take away", "a capability");
    }
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return system_error("give up", "new rights");
    return {};
}

Result<void> keep_capabilities(Capabilities kept) {
    if (::geteuid() != 0) return {};
    QDUINO_TRY(bound_capabilities(kept));
    const std::unique_ptr<std::remove_pointer_t<cap_t>, int (*)(void*)> before{cap_get_proc(), cap_free};
    const std::unique_ptr<std::remove_pointer_t<cap_t>, int (*)(void*)> after{cap_init(), cap_free};
    for (const int capability : kept) {
        // What it has not got cannot be kept.
        cap_flag_value_t has = CAP_CLEAR;
        cap_get_flag(before.get(), capability, CAP_PERMITTED, &has);
        for (const cap_flag_t set : {CAP_PERMITTED, CAP_EFFECTIVE}) {
            const cap_value_t one = capability;
            cap_set_flag(after.get(), set, 1, &one, has);
        }
    }
    if (cap_set_proc(after.get()) != 0) return system_error("take away", "capabilities");
    return {};
}

Result<void> refuse_system_calls() {
    const std::unique_ptr<void, void (*)(scmp_filter_ctx)> filter{seccomp_init(SCMP_ACT_ALLOW),
                                                                  seccomp_release};
    if (!filter) return make_error(ErrorCode::unavailable, "no filter of system calls");
    // One that this architecture lacks is left out by the library.
    for (const int call : kRefused) {
        if (const int failed = seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(EPERM), call, 0); failed != 0)
            return system_error("refuse", "a system call", -failed);
    }
    if (const int failed = seccomp_load(filter.get()); failed != 0)
        return system_error("refuse", "system calls", -failed);
    return {};
}

}  // namespace qduino::rights
