#include "board/linux/loop/warden_process.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "base/fixed_vector.h"
#include "base/text.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/held_thread.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/kernel/thread_times.h"
#include "board/linux/loop/budget_keeper.h"
#include "board/linux/loop/strangers.h"
#include "board/linux/loop/watched_bottom_half.h"
#include "board/window/pins_layout.h"
#include "sched/budget_watch.h"

namespace qduino::board::linux {

namespace {

/// Whatever its wards ask for: what it costs is counted so (LinuxBoard::platform_overheads()).
constexpr Nanoseconds kLookEvery = sched::BudgetWatch::kTick;
/// If it ever consumes so much without sleeping, the kernel ends it.
constexpr rlim_t kRealTimeLimitUs = 200'000;

/// The signals of one line of /proc/PID/task/TID/status, "SigBlk:\t0000000000000004".
bool names_signal(std::string_view status, std::string_view line, int signal) {
    const std::size_t at = status.find(line);
    if (at == std::string_view::npos) return false;
    std::uint64_t mask = 0;
    const std::string_view digits = status.substr(at + line.size(), 16);
    std::from_chars(digits.data(), digits.data() + digits.size(), mask, 16);
    return (mask >> (signal - 1) & 1) != 0;
}

// ---- one ward -----------------------------------------------------------------------------------

class WatchedThread {
  public:
    /// False: this kernel does not tell its CPU time.
    bool open(const WardenTask& task, const Ward& ward, const ParametersMail& changes,
              WardFindings& findings) {
        thread_ = HeldThread{{ward.tid, ward.core, ward.priority}};
        changes_ = ward.is_io() ? &changes : nullptr;
        findings_ = &findings;
        id_ = ward.id;
        watched_ = ward.watched;
        const auto status = text<FixedString<64>>("/proc/", task.sketch, "/task/", ward.tid, "/status", '\0');
        status_file_ = ::open(status.view().data(), O_RDONLY | O_CLOEXEC);
        sched::ThreadTimes times;
        if (!times_.open(task.sketch, ward.tid) || !times_.read(times)) return false;
        watch_ = sched::BudgetWatch{{ward.budget, ward.period}, task.wait, monotonic_now(), times};
        return true;
    }

    [[nodiscard]] pid_t tid() const { return thread_.place().tid; }
    [[nodiscard]] VcpuId id() const { return id_; }
    /// What a lock's holder used at this thread's priority is charged to it.
    void charge_lent(Nanoseconds used) {
        lent_ += used;
        lent_lately_ = true;
    }
    [[nodiscard]] HeldThread& thread() { return thread_; }
    [[nodiscard]] Instant next_look() const { return watched_ && !ended_ ? watch_.next_look() : kForever; }

    /// Or soon due: it would wake the warden again.
    void look_if_due(Instant now) {
        if (next_look() <= now + kLookEvery / 2) look(now);
    }
    void look(Instant now) {
        sched::ThreadTimes times;
        if (ended_ || !watched_) return;
        if (!times_.read(times)) {
            ended_ = true;
            return;
        }
        times.cpu += lent_;
        if (const auto parameters = changes_ ? changes_->take(changes_seen_) : std::nullopt;
            parameters && parameters->valid())
            watch_.change(now, times, *parameters);
        const bool hold = watch_.look(now, times) == sched::BudgetWatch::Verdict::hold;
        if (hold && !thread_.held()) explain();
        lent_lately_ = false;
        hold ? thread_.hold() : thread_.release();
        findings_->used_ns = to_ns(watch_.used());
        findings_->watched_ns = to_ns(watch_.watched());
        findings_->holds = watch_.holds();
    }
    void sweep(Instant now) {
        look(now);
        if (!ended_ && !thread_.held() && thread_.put_back()) ++findings_->changes;
    }

  private:
    /// Why its own timer did not do it. Once: it is held a moment later.
    void explain() {
        if (findings_->way != EscapeWay::none) return;
        if (lent_lately_) {
            findings_->way = EscapeWay::lent;
            return;
        }
        TaskText buffer;
        const std::string_view status = read_anew(status_file_, buffer);
        const int signal = BudgetKeeper::signal_number();
        findings_->way = names_signal(status, "SigBlk:\t", signal)    ? EscapeWay::signal_blocked
                         : !names_signal(status, "SigCgt:\t", signal) ? EscapeWay::signal_ignored
                                                                      : EscapeWay::unknown;
    }

    HeldThread thread_;
    sched::BudgetWatch watch_;
    const ParametersMail* changes_ = nullptr;  // null: of a loop, which has none
    std::uint32_t changes_seen_ = 0;
    WardFindings* findings_ = nullptr;
    ThreadTimesFile times_;
    int status_file_ = -1;
    VcpuId id_ = kNoVcpu;
    Nanoseconds lent_{};        // ever
    bool lent_lately_ = false;  // since the last look
    bool watched_ = false;
    bool ended_ = false;
};

// ---- the process --------------------------------------------------------------------------------

class WardenProcess final : Strangers::Wards {
  public:
    WardenProcess(const WardenTask& task, WardenOrders& orders, WardenFindings& findings)
        : task_(task), orders_(orders), findings_(findings) {}

    void run() {
        prepare();
        watch_to_the_end();
        if (task_.by && ::getppid() == task_.sketch) *task_.by = kWardenLeft;
    }

  private:
    void watch_to_the_end() {
        while (orders_.given == 0) {
            sleep_until(monotonic_now() + kWardenSweep);
            if (is_over()) return;
        }
        if (!begin()) {
            findings_.state = WardenState::blind;
            return;
        }
        while (!is_over()) watch_on();
    }

    void prepare() const {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        go_last_in_need_of_memory();
        // Nobody without CAP_SYS_PTRACE, which loops lose, reaches into it or opens its files in
        // /proc to write.
        ::prctl(PR_SET_DUMPABLE, 0);
        ::setsid();  // a terminal's Ctrl-C is the sketch's business
        struct sigaction none {};
        none.sa_handler = SIG_DFL;
        for (int signal = 1; signal < NSIG; ++signal) ::sigaction(signal, &none, nullptr);
        sigset_t all;
        sigfillset(&all);
        ::sigprocmask(SIG_SETMASK, &all, nullptr);
        ::prctl(PR_SET_NAME, "warden");
        ::syscall(SYS_close_range, 0U, ~0U, 0U);  // locks and pipes are the sketch's
        ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT);
        choose_cores();
        if (task_.priority == 0) return;
        const rlimit limit{kRealTimeLimitUs, kRealTimeLimitUs};
        ::setrlimit(RLIMIT_RTTIME, &limit);
        static_cast<void>(become_real_time(task_.priority));
    }

    /// Else a loop that takes all the memory would have the kernel end its warden. Refused without
    /// CAP_SYS_RESOURCE.
    static void go_last_in_need_of_memory() {
        constexpr std::string_view kNever = "-1000";
        const int file = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
        if (file >= 0) static_cast<void>(!::write(file, kNever.data(), kNever.size()));
    }

    void choose_cores() const {
        if (task_.cores.empty()) return;
        cpu_set_t cores;
        CPU_ZERO(&cores);
        for (int core = 0; core < CPU_SETSIZE; ++core) {
            if (task_.cores.has(core)) CPU_SET(static_cast<std::size_t>(core), &cores);
        }
        ::sched_setaffinity(0, sizeof cores, &cores);
    }

    bool begin() {
        witness_ = orders_.witness;
        const std::uint32_t count = std::min<std::uint32_t>(orders_.count, kVcpuLimit);
        for (std::uint32_t i = 0; i < count; ++i) {
            const Ward ward = orders_.wards[i];
            if (ward.id >= kVcpuLimit || !wards_.try_push_back(WatchedThread{})) return false;
            if (!wards_.back().open(task_, ward, orders_.changes[ward.id], findings_.wards[ward.id]))
                return false;
            WatchedBottomHalf bottom_half;
            if (bottom_half.open(task_.sketch, ward, orders_, findings_.wards[ward.id]))
                bottom_halves_.push_back(bottom_half);
        }
        strangers_.open(task_.sketch, orders_.grows, findings_, *this);
        const bool can_stop = wards_.empty() || wards_[0].thread().can_be_stopped();
        next_sweep_ = last_look_ = monotonic_now();
        beat(last_look_);
        findings_.state = can_stop ? WardenState::watching : WardenState::only_rank;
        return true;
    }

    void watch_on() {
        const Instant now = monotonic_now();
        beat(now);
        take_changes();
        // Before the wards: they pay for what was lent.
        if (strangers_.next_look() <= now + kLookEvery / 2) strangers_.look(now);
        for (WatchedThread& ward : wards_) ward.look_if_due(now);
        for (WatchedBottomHalf& each : bottom_halves_) {
            if (each.next_look() <= now + kLookEvery / 2) each.look(now);
        }
        if (now >= next_sweep_) sweep(now);
        ++findings_.looks;
        Instant next = next_sweep_;
        for (const WatchedThread& ward : wards_) next = std::min(next, ward.next_look());
        for (const WatchedBottomHalf& each : bottom_halves_) next = std::min(next, each.next_look());
        next = std::min(next, strangers_.next_look());
        sleep_until(std::max(next, now + kLookEvery));
    }

    /// It lives, and it looks: both in a number that only it can tell.
    void beat(Instant now) {
        findings_.gap_ns = std::max<std::int64_t>(findings_.gap_ns, to_ns(now - last_look_));
        findings_.beat_ns = to_ns(now);
        if (task_.by) *task_.by = to_ns(now + task_.patience);
        last_look_ = now;
    }

    void sweep(Instant now) {
        next_sweep_ = now + kWardenSweep;
        for (WatchedThread& ward : wards_) ward.sweep(now);
        strangers_.sweep(now);
        findings_.cpu_ns = read_clock_ns(CLOCK_PROCESS_CPUTIME_ID);
    }

    [[nodiscard]] bool has(pid_t tid) const override {
        return tid == witness_ || std::ranges::find(wards_, tid, &WatchedThread::tid) != wards_.end() ||
               std::ranges::any_of(bottom_halves_, [tid](const auto& each) { return each.has(tid); });
    }

    VcpuId charge(int priority, int core, Nanoseconds used) override {
        WatchedThread* lender = nullptr;
        for (WatchedThread& ward : wards_) {
            const ThreadPlace& place = ward.thread().place();
            if (place.priority == priority && (!lender || place.core == core)) lender = &ward;
        }
        if (!lender) return kNoVcpu;
        lender->charge_lent(used);
        lender->look(last_look_);
        return lender->id();
    }

    void take_changes() {
        int status = 0;
        for (pid_t tid = 0; (tid = ::waitpid(-1, &status, __WALL | WNOHANG)) > 0;) {
            for (WatchedThread& ward : wards_) {
                if (ward.tid() == tid) ward.thread().changed(status);
            }
            strangers_.changed(tid, status);
        }
    }

    /// Until `t`, or until a thread that is held changes, or the sketch rings.
    static void sleep_until(Instant t) {
        const Nanoseconds length = std::max<Nanoseconds>(t - monotonic_now(), 1us);
        const timespec wait = to_timespec(to_ns(length));
        sigset_t child;
        sigemptyset(&child);
        sigaddset(&child, SIGCHLD);
        ::sigtimedwait(&child, nullptr, &wait);
    }

    [[nodiscard]] bool is_over() const {
        if (::getppid() != task_.sketch) return true;
        // Its wards first: a sketch could ask for this.
        return orders_.go != 0 &&
               std::ranges::all_of(wards_, [&](const WatchedThread& ward) { return has_left(ward.tid()); });
    }
    [[nodiscard]] bool has_left(pid_t tid) const { return ::syscall(SYS_tgkill, task_.sketch, tid, 0) != 0; }

    const WardenTask& task_;
    WardenOrders& orders_;
    WardenFindings& findings_;
    FixedVector<WatchedThread, kVcpuLimit> wards_;
    FixedVector<WatchedBottomHalf, sched::kIoVcpuLimit> bottom_halves_;
    Strangers strangers_;
    pid_t witness_ = 0;
    Instant next_sweep_{};
    Instant last_look_{};
};

}  // namespace

void be_warden(const WardenTask& task, WardenOrders& orders, WardenFindings& findings) {
    WardenProcess{task, orders, findings}.run();
    ::_exit(0);
}

}  // namespace qduino::board::linux
