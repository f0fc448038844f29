#include "vcpu/process_vcpu.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/text.h"
#include "board/linux/kernel/cpu_list.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/system_error.h"
#include "vcpu/witness.h"

namespace qduino::apps {
namespace {

using board::linux::CpuGroup;
using board::linux::CpuGroupPlace;
using board::linux::CpuList;
using board::linux::Promise;
using board::linux::PromiseRegister;

/// A killed process with much memory takes a while to go.
constexpr Nanoseconds kRemoveWithin = 5s;

/// The cores that this process may use.
CpuList own_cores() {
    cpu_set_t set;
    CPU_ZERO(&set);
    CpuList cores;
    if (::sched_getaffinity(0, sizeof set, &set) != 0) return CpuList::first(board::linux::cpu_count());
    for (int core = 0; core < CPU_SETSIZE; ++core) {
        if (CPU_ISSET(static_cast<std::size_t>(core), &set)) cores.add(core);
    }
    return cores;
}

}  // namespace

Result<void> ProcessVcpu::choose_core(std::span<const Promise> promises) {
    const CpuList cores = own_cores();
    if (tree_.core != sched::kAnyCore) {
        if (!cores.has(tree_.core)) {
            return make_error(ErrorCode::invalid_argument, "core ", tree_.core,
                              " is none of those that this process may use (", cores.to_list(),
                              "): name one of them with --core");
        }
        verdict_ = board::linux::admit_newcomer(tree_, promises);
        return {};
    }
    board::linux::TreeVcpu wanted = tree_;
    for (int core = 0; core < CpuList::kLimit && !verdict_.admitted; ++core) {
        if (!cores.has(core)) continue;
        wanted.core = core;
        const bool first = tree_.core == sched::kAnyCore;
        board::linux::TreeVerdict verdict = board::linux::admit_newcomer(wanted, promises);
        if (!first && !verdict.admitted) continue;  // the first refusal is the one that is told
        tree_.core = core;
        verdict_ = std::move(verdict);
    }
    return {};
}

Result<ProcessVcpu> ProcessVcpu::make(ProcessVcpuOptions options) {
    ProcessVcpu vcpu;
    vcpu.tree_ = std::move(options.tree);
    QDUINO_TRY(board::linux::check_cpu_group_budget(vcpu.tree_.budget, vcpu.tree_.period));
    QDUINO_TRY_ASSIGN(const CpuGroupPlace place, board::linux::find_cpu_group_place());
    vcpu.tree_.parent = place.parents[0];
    QDUINO_TRY_ASSIGN(const PromiseRegister promises, PromiseRegister::open());
    promises.put_dead_away(kRemoveWithin);
    QDUINO_TRY(vcpu.choose_core(promises.living()));
    if (!vcpu.verdict_.admitted && !options.also_when_refused) return vcpu;

    const std::string name = promises.free_name();
    CpuGroup group{place, name};
    Promise promise = vcpu.promise();
    promise.groups = group.folders();
    QDUINO_TRY_ASSIGN(board::linux::HeldPromise held, promises.hold(promise, name));
    QDUINO_TRY(group.make(vcpu.tree_.budget, vcpu.tree_.period));
    // From here on the destructor puts away.
    vcpu.promise_ = std::move(held);
    vcpu.group_ = std::move(group);
    QDUINO_TRY_ASSIGN(vcpu.witness_, post_witness({.groups = vcpu.group_.folders(),
                                                   .promise = vcpu.promise_.path(),
                                                   .promise_descriptor = vcpu.promise_.descriptor(),
                                                   .ask = options.witness_asks,
                                                   .grace = options.witness_grace}));
    return vcpu;
}

/// What this program promises to its tree.
Promise ProcessVcpu::promise() const {
    Promise promise;
    promise.program = board::linux::text_of_file("/proc/self/comm");
    promise.trees = {tree_};
    promise.groups = group_.folders();
    return promise;
}

void ProcessVcpu::admit_again() { take_what_fits(tree_.budget, tree_.budget); }

void ProcessVcpu::take_what_fits(Nanoseconds asked, Nanoseconds least) {
    const auto promises = PromiseRegister::open();
    if (!promises) return;
    std::vector<Promise> others = promises->living();
    std::erase_if(others, [this](const Promise& each) { return each.path == promise_.path(); });
    const Nanoseconds before = tree_.budget;
    tree_.budget = asked;
    verdict_ = board::linux::admit_what_fits(tree_, least, others);
    if (tree_.budget == before || !active()) return;
    if (group_.set_budget(tree_.budget, tree_.period)) {
        PromiseRegister::rewrite(promise_, promise());
    } else {  // the kernel keeps it to what it had
        tree_.budget = before;
        verdict_ = board::linux::admit_tree(tree_, others);
    }
}

ProcessVcpu::~ProcessVcpu() {
    if (active()) static_cast<void>(board::linux::remove_group(group_.folders(), kRemoveWithin));
}

}  // namespace qduino::apps
