#include "board/linux/computer/core_promises.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/cpu_group.h"
#include "board/linux/kernel/cpu_list.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/guarded_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;

namespace {

constexpr std::string_view kPromisePrefix = "qduino-promise.";
constexpr Nanoseconds kLookAtRegisterEvery = 5ms;
constexpr std::size_t kNameShown = 40;

/// The fields of a line, one after the other; all that is wrong with them shows at the end.
class Fields {
  public:
    explicit Fields(std::string_view line) : rest_(line) {}

    std::int64_t number(std::int64_t lowest, std::int64_t highest) {
        const auto value = whole_number<std::int64_t>(cut(rest_, ' '));
        good_ = good_ && value && *value >= lowest && *value <= highest;
        return good_ ? *value : lowest;
    }
    int core() { return static_cast<int>(number(0, CpuList::kLimit - 1)); }
    Nanoseconds duration(std::int64_t lowest) {
        return Nanoseconds{number(lowest, sched::kPeriodMax.count())};
    }
    std::string rest() { return printable(rest_, kNameShown); }
    [[nodiscard]] bool at_end() const { return rest_.empty(); }
    [[nodiscard]] bool good() const { return good_; }

  private:
    std::string_view rest_;
    bool good_ = true;
};

void read_vcpu(Promise& promise, sched::VcpuKind kind, Fields fields) {
    sched::Vcpu vcpu;
    vcpu.kind = kind;
    vcpu.id = static_cast<sched::VcpuId>(fields.number(0, 255));
    vcpu.core = fields.core();
    vcpu.budget = fields.duration(1);
    vcpu.period = fields.duration(1);
    // Absent: nothing of the kind.
    if (!fields.at_end()) {
        vcpu.suspension = fields.duration(0);
        vcpu.sleeps = static_cast<int>(fields.number(1, 1'000'000));
        vcpu.deferrable = fields.number(0, 1) == 1;
        vcpu.client_period = fields.duration(0);
    }
    if (fields.good() && vcpu.parameters().valid()) promise.vcpus.push_back(vcpu);
}

void read_taker(Promise& promise, Fields fields) {
    Promise::Taker taker;
    taker.core = fields.core();
    taker.interferer.cost = fields.duration(0);
    taker.interferer.interval = fields.duration(1);
    taker.interferer.jitter = fields.duration(0);
    taker.interferer.name = decltype(taker.interferer.name){fields.rest()};
    if (fields.good()) promise.takers.push_back(taker);
}

/// Adds to the last taker, which counts for more without it.
void read_peak(Promise& promise, Fields fields) {
    const Nanoseconds interval = fields.duration(1), jitter = fields.duration(0);
    if (!fields.good() || promise.takers.empty()) return;
    promise.takers.back().interferer.peak_interval = interval;
    promise.takers.back().interferer.peak_jitter = jitter;
}

void read_tree(Promise& promise, Fields fields) {
    TreeVcpu tree;
    tree.core = fields.core();
    tree.budget = fields.duration(1);
    tree.period = fields.duration(1);
    tree.name = fields.rest();
    if (fields.good() && tree.budget <= tree.period) promise.trees.push_back(std::move(tree));
}

}  // namespace

std::string promise_text(const Promise& promise) {
    auto lines = text<std::string>("program ", printable(promise.program, kNameShown), '\n');
    for (const sched::Vcpu& vcpu : promise.vcpus) {
        write(lines, vcpu.is_io() ? "io " : "main ", int{vcpu.id}, ' ', vcpu.core, ' ', vcpu.budget.count(),
              ' ', vcpu.period.count());
        if (vcpu.suspension.count() != 0 || vcpu.deferrable || vcpu.client_period.count() != 0) {
            write(lines, ' ', vcpu.suspension.count(), ' ', vcpu.sleeps, ' ', vcpu.deferrable ? 1 : 0, ' ',
                  vcpu.client_period.count());
        }
        lines += '\n';
    }
    for (const auto& [core, taker] : promise.takers) {
        write(lines, "taker ", core, ' ', taker.cost.count(), ' ', taker.interval.count(), ' ',
              taker.jitter.count(), ' ', taker.name.view(), '\n');
        if (taker.peak_interval > Nanoseconds{0})
            write(lines, "peak ", taker.peak_interval.count(), ' ', taker.peak_jitter.count(), '\n');
    }
    for (const TreeVcpu& tree : promise.trees) {
        write(lines, "tree ", tree.core, ' ', tree.budget.count(), ' ', tree.period.count(), ' ',
              printable(tree.name, kNameShown), '\n');
    }
    for (const std::string& group : promise.groups) write(lines, "group ", group, '\n');
    return lines;
}

Promise read_promise(std::string_view text) {
    Promise promise;
    while (!text.empty()) {
        std::string_view value = cut(text, '\n');
        const std::string_view key = cut(value, ' ');
        if (key == "program") promise.program = printable(value, kNameShown);
        if (key == "main") read_vcpu(promise, sched::VcpuKind::main, Fields{value});
        if (key == "io") read_vcpu(promise, sched::VcpuKind::io, Fields{value});
        if (key == "taker") read_taker(promise, Fields{value});
        if (key == "peak") read_peak(promise, Fields{value});
        if (key == "tree") read_tree(promise, Fields{value});
        if (key == "group") promise.groups.emplace_back(value);
    }
    for (TreeVcpu& tree : promise.trees) {
        if (!promise.groups.empty()) tree.parent = promise.groups[0].substr(0, promise.groups[0].rfind('/'));
    }
    return promise;
}

Result<PromiseRegister> PromiseRegister::open(const std::string& root, Nanoseconds patience) {
    PromiseRegister made;
    QDUINO_TRY_ASSIGN(made.folder_, own_register(root));
    made.believed_ = believed_registers(root, made.folder_);
    // Nobody else may open it: then nobody else can hold it.
    const std::string path = made.folder_ + "/qduino-promises.lock";
    QDUINO_TRY_ASSIGN(made.lock_, posix::open_or_make_guarded(path, 0600));
    const Instant until = monotonic_now() + patience;
    while (::flock(made.lock_.get(), LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK && errno != EINTR) return system_error("lock", path);
        if (monotonic_now() >= until)
            return make_error(ErrorCode::timed_out, path, " is held by another program for ", patience);
        block_until(monotonic_now() + kLookAtRegisterEvery);
    }
    made.read();
    return made;
}

void PromiseRegister::read() {
    for (const std::string& folder : believed_) {
        for (const std::string& name : entries(folder)) {
            if (name.starts_with(kPromisePrefix)) read(folder + "/" + name, name);
        }
    }
}

/// What is no plain file of this user or of root, or is too long, is left out.
void PromiseRegister::read(const std::string& path, std::string_view name) {
    const auto file = posix::open_guarded(path, O_RDONLY);
    struct stat status {};
    if (!file || ::fstat(file->get(), &status) != 0) return;
    const auto text = posix::read_at_most(file->get(), kRegisterFileBytesMax, path);
    if (!text) return;
    Promise promise = read_promise(*text);
    promise.path = path;
    promise.owner = status.st_uid;
    std::string_view number = name.substr(kPromisePrefix.size());
    promise.pid = whole_number<int>(cut(number, '.')).value_or(0);
    const bool lives = is_locked(file->get());
    // Another user's record could name anything.
    if (!lives && promise.owner == ::geteuid()) dead_.push_back(std::move(promise));
    if (lives) living_.push_back(std::move(promise));
}

void PromiseRegister::put_dead_away(Nanoseconds patience) const {
    for (const Promise& dead : dead_) {
        if (remove_group(dead.groups, patience)) ::unlink(dead.path.c_str());
    }
}

std::string PromiseRegister::free_name() const {
    for (int number = 0;; ++number) {
        auto name = text<std::string>(::getpid(), '.', number);
        struct stat status {};
        const std::string path = folder_ + "/" + std::string{kPromisePrefix} + name;
        if (::lstat(path.c_str(), &status) != 0) return name;
    }
}

Result<HeldPromise> PromiseRegister::hold(const Promise& promise, const std::string& name) const {
    const std::string path = folder_ + "/" + std::string{kPromisePrefix} + name;
    // Others may read it only once it is locked: then no reader's lock stands in the way.
    QDUINO_TRY_ASSIGN(UniqueFd file, posix::make_guarded(path, 0600));
    HeldPromise held{std::move(file), path};
    if (!lock_whole(held.descriptor())) return system_error("lock", path);
    QDUINO_TRY(posix::write_all(held.descriptor(), promise_text(promise), path));
    static_cast<void>(::fchmod(held.descriptor(), 0644));
    return held;
}

/// A program that is killed in the middle leaves a part of it, and nobody reads a dead one's.
void PromiseRegister::rewrite(const HeldPromise& held, const Promise& promise) {
    if (::ftruncate(held.descriptor(), 0) != 0 || ::lseek(held.descriptor(), 0, SEEK_SET) != 0) return;
    static_cast<void>(posix::write_all(held.descriptor(), promise_text(promise), held.path()));
}

}  // namespace qduino::board::linux
