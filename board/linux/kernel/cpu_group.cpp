#include "board/linux/kernel/cpu_group.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/closed_folder.h"
#include "board/linux/kernel/control_groups.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {

namespace {

constexpr std::string_view kGroupPrefix = "qduino-vcpu.";
constexpr Nanoseconds kLookAtGroupEvery = 5ms;

// What the kernel takes (kernel/sched/core.c: min_cfs_quota_period, max_cfs_quota_period).
constexpr Nanoseconds kQuotaMin = 1ms;
constexpr Nanoseconds kQuotaPeriodMax = 1s;

constexpr std::string_view kHighestWeight = "10000";   // cpu.weight
constexpr std::string_view kHighestShares = "262144";  // cpu.shares

/// A process can be put into a new group of `parent`.
bool takes_groups(const std::string& parent) {
    return takes_folders(parent) && ::access((parent + "/cgroup.procs").c_str(), W_OK) == 0;
}

/// Gives the groups in `parent` the cpu controller. The kernel refuses that to a group with
/// processes of its own, but for the real top.
bool enables_cpu(const std::string& parent) {
    const std::string switched = parent + "/cgroup.subtree_control";
    if (!has_word(text_of_file(parent + "/cgroup.controllers"), ' ', "cpu")) return false;
    if (has_word(text_of_file(switched), ' ', "cpu")) return true;
    return posix::write_small_file(switched, "+cpu").ok();
}

std::optional<CpuGroupPlace> place_v2(const std::string& root) {
    const std::optional<Hierarchy> hierarchy = find_hierarchy(root, "");
    if (!hierarchy) return std::nullopt;
    for (const std::string& parent : line_of(*hierarchy)) {
        if (takes_groups(parent) && enables_cpu(parent)) return CpuGroupPlace{true, {parent}};
    }
    return std::nullopt;
}

std::optional<std::string> parent_v1(const std::string& root, std::string_view controller) {
    const std::optional<Hierarchy> hierarchy = find_hierarchy(root, controller);
    if (!hierarchy) return std::nullopt;
    for (std::string& parent : line_of(*hierarchy)) {
        if (takes_groups(parent)) return std::move(parent);
    }
    return std::nullopt;
}

std::optional<CpuGroupPlace> place_v1(const std::string& root) {
    std::optional<std::string> cpu = parent_v1(root, "cpu");
    // Without the kernel's bandwidth control (CONFIG_CFS_BANDWIDTH) the file is not there.
    if (!cpu || !std::filesystem::exists(*cpu + "/cpu.stat")) return std::nullopt;
    CpuGroupPlace place{false, {std::move(*cpu)}};
    std::error_code unreadable;
    std::optional<std::string> account = parent_v1(root, "cpuacct");
    if (account && !std::filesystem::equivalent(*account, place.parents[0], unreadable))
        place.parents.push_back(std::move(*account));
    return place;
}

Result<void> put(const std::string& folder, const char* file, std::string_view value) {
    return posix::write_small_file(folder + "/" + file, value);
}

std::string microseconds_of(Nanoseconds duration) { return text<std::string>(duration / 1us); }

/// Root's programs, too, then stay ordinary tasks: a real-time one would be outside the budget.
/// Effective after the next exec(2).
void give_up_real_time() {
    sched_param ordinary{};
    static_cast<void>(::sched_setscheduler(0, SCHED_OTHER, &ordinary));
    const rlimit none{};
    static_cast<void>(::setrlimit(RLIMIT_RTPRIO, &none));
    static_cast<void>(::prctl(PR_CAPBSET_DROP, CAP_SYS_NICE, 0, 0, 0));
}

}  // namespace

Result<CpuGroupPlace> find_cpu_group_place(const std::string& root) {
    if (std::optional<CpuGroupPlace> place = place_v2(root)) return std::move(*place);
    if (std::optional<CpuGroupPlace> place = place_v1(root)) return std::move(*place);
    const bool unified = find_hierarchy(root, "").has_value();
    if (!unified && !find_hierarchy(root, "cpu")) {
        return make_error(ErrorCode::unsupported,
                          "no control group hierarchy with the cpu controller is mounted: as root, mount -t "
                          "cgroup2 none /sys/fs/cgroup");
    }
    if (::geteuid() != 0) {
        return make_error(ErrorCode::not_permitted,
                          "no control group that this user may write has the cpu controller: start it by "
                          "'systemd-run --user --scope -p Delegate=yes …', or as root");
    }
    return make_error(
        ErrorCode::not_permitted,
        "no control group here can be written: in a container, give it a writable /sys/fs/cgroup "
        "(docker run --privileged, or --cgroupns=host with that folder)");
}

Result<void> check_cpu_group_budget(Nanoseconds budget, Nanoseconds period) {
    if (budget <= Nanoseconds{0} || budget > period) {
        return make_error(ErrorCode::invalid_argument, "a budget of ", budget, " in ", period,
                          " cannot be: it is more than 0, and the period at most");
    }
    if (period > kQuotaPeriodMax) {
        const auto times = (period.count() + kQuotaPeriodMax.count() - 1) / kQuotaPeriodMax.count();
        return make_error(ErrorCode::invalid_argument, "the kernel keeps periods of 1 s at most, not ",
                          period, ": ", (budget / times) / 1us * 1us, " in ", (period / times) / 1us * 1us,
                          " is the same share");
    }
    if (budget < kQuotaMin) {
        const auto times = (kQuotaMin.count() + budget.count() - 1) / budget.count();
        return make_error(ErrorCode::invalid_argument, "the kernel keeps budgets of 1 ms at least, not ",
                          budget, ": ", times * budget, " in ", times * period, " is the same share");
    }
    return {};
}

CpuGroup::CpuGroup(const CpuGroupPlace& place, const std::string& name)
    : second_version_(place.second_version) {
    for (const std::string& parent : place.parents)
        folders_.push_back(parent + "/" + std::string{kGroupPrefix} + name);
}

Result<void> CpuGroup::make(Nanoseconds budget, Nanoseconds period) {
    for (std::size_t i = 0; i < folders_.size(); ++i) {
        Result<void> made = make_folder_in_closed(folders_[i]);
        if (made) continue;
        folders_.resize(i);
        static_cast<void>(remove_group(folders_, Nanoseconds{0}));
        return made;
    }
    Result<void> set = set_budget(budget, period);
    if (!set) static_cast<void>(remove_group(folders_, Nanoseconds{0}));
    return set;
}

Result<void> CpuGroup::set_budget(Nanoseconds budget, Nanoseconds period) const {
    if (second_version_) {
        static_cast<void>(put(folders_[0], "cpu.weight", kHighestWeight));
        return put(folders_[0], "cpu.max", microseconds_of(budget) + " " + microseconds_of(period));
    }
    static_cast<void>(put(folders_[0], "cpu.shares", kHighestShares));
    QDUINO_TRY(put(folders_[0], "cpu.cfs_period_us", microseconds_of(period)));
    return put(folders_[0], "cpu.cfs_quota_us", microseconds_of(budget));
}

Result<void> CpuGroup::enter(int core) const {
    give_up_real_time();
    for (const std::string& folder : folders_) QDUINO_TRY(put(folder, "cgroup.procs", "0"));
    return pin_to_core(core);
}

Result<CpuGroupUse> CpuGroup::use() const {
    QDUINO_TRY_ASSIGN(const std::string lines, posix::read_small_file(folders_[0] + "/cpu.stat"));
    CpuGroupUse use;
    use.periods = value_of(lines, "nr_periods");
    use.throttled = value_of(lines, "nr_throttled");
    if (second_version_) {
        use.used = value_of(lines, "usage_usec") * 1us;
        use.throttled_for = value_of(lines, "throttled_usec") * 1us;
    } else {
        const std::string used = text_of_file(folders_.back() + "/cpuacct.usage");
        use.used = Nanoseconds{whole_number<std::int64_t>(used).value_or(0)};
        use.throttled_for = Nanoseconds{value_of(lines, "throttled_time")};
    }
    return use;
}

std::vector<pid_t> members_of_group(const std::string& folder) {
    std::vector<pid_t> members;
    const std::string lines = text_of_file(folder + "/cgroup.procs");
    for (const std::string_view word : words(lines)) {
        if (const auto pid = whole_number<pid_t>(word); pid && *pid > 0) members.push_back(*pid);
    }
    return members;
}

void signal_group(const std::string& folder, int signal) {
    for (const pid_t member : members_of_group(folder)) ::kill(member, signal);
}

bool remove_group(const std::vector<std::string>& folders, Nanoseconds patience) {
    const Instant until = monotonic_now() + patience;
    bool gone = true;
    for (const std::string& folder : folders) {
        if (!std::filesystem::path{folder}.filename().native().starts_with(kGroupPrefix)) return false;
        for (;;) {
            const Result<void> removed = remove_folder_in_closed(folder);
            if (removed || removed.error().code == ErrorCode::not_found) break;
            // Again and again: a process may have forked meanwhile.
            signal_group(folder, SIGKILL);
            if (monotonic_now() >= until) {
                gone = false;
                break;
            }
            block_until(monotonic_now() + kLookAtGroupEvery);
        }
    }
    return gone;
}

}  // namespace qduino::board::linux
