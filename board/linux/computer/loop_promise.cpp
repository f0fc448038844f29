#include "board/linux/computer/loop_promise.h"

#include <unistd.h>

#include <algorithm>

#include "board/linux/computer/tree_admission.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {
namespace {

/// A report is made while the loops run, by the thread that ends them: it waits for no one.
constexpr Nanoseconds kLookPatience = 20ms;
/// A dead program's group that does not go meanwhile is left to the next start.
constexpr Nanoseconds kRemoveDeadWithin = 100ms;

TreeGuarantee describe_tree(const TreeVcpu& tree, const Promise& promise, std::span<const Promise> others) {
    const TreeVerdict verdict = admit_tree(tree, others);
    TreeGuarantee line;
    line.name = decltype(line.name){tree.name};
    line.core = tree.core;
    line.budget = tree.budget;
    line.period = tree.period;
    line.admitted = verdict.admitted;
    line.response = verdict.response;
    line.enforced = !promise.groups.empty();
    line.shortfall = decltype(line.shortfall){verdict.refusal};
    return line;
}

/// What admission counts of it: with what an activation costs.
void promise_parameters(sched::Vcpu& vcpu, sched::VcpuParameters parameters, Nanoseconds activation) {
    vcpu.budget = std::min(parameters.budget + activation, parameters.period - 1ns);
    vcpu.period = parameters.period;
}

}  // namespace

Neighbours neighbours_on(int core, const std::string& root) {
    Neighbours found;
    const auto promises = PromiseRegister::open(root);
    if (!promises) return found;
    auto& below = found.below;
    for (const Promise& promise : promises->living()) {
        const bool is_other = promise.pid != ::getpid();
        found.loops =
            found.loops || (is_other && std::ranges::count(promise.vcpus, core, &sched::Vcpu::core) > 0);
        for (const TreeVcpu& tree : promise.trees) {
            if (tree.core != core) continue;
            below.budget += tree.budget;
            below.period = below.period > Nanoseconds{0} ? std::min(below.period, tree.period) : tree.period;
        }
    }
    if (!below.valid()) below = {};
    return found;
}

void LoopPromise::make(std::span<const VcpuSpec> specs,
                       const std::function<sched::PlatformOverheads(int)>& overheads,
                       const std::string& root) {
    root_ = root;
    promise_.program = text_of_file("/proc/self/comm");
    for (const VcpuSpec& spec : specs) {
        promise_.vcpus.push_back(spec);
        activations_.emplace_back();
        const bool is_new = std::ranges::find(cores_, spec.core) == cores_.end();
        if (is_new) cores_.push_back(spec.core);
        if (spec.owns_core) continue;  // no tree is admitted there, and no interrupts are counted
        activations_.back() = overheads(spec.core).per_activation();
        promise_parameters(promise_.vcpus.back(), spec.parameters(), activations_.back());
        if (!is_new) continue;
        for (const sched::PlatformInterferer& each : overheads(spec.core).interferers)
            promise_.takers.push_back({spec.core, each});
    }
    const auto promises = PromiseRegister::open(root_);
    if (!promises) return;
    promises->put_dead_away(kRemoveDeadWithin);
    if (auto held = promises->hold(promise_, promises->free_name())) held_ = std::move(*held);
}

void LoopPromise::change(VcpuId id, sched::VcpuParameters parameters) {
    for (std::size_t i = 0; i < promise_.vcpus.size(); ++i) {
        if (promise_.vcpus[i].id == id) promise_parameters(promise_.vcpus[i], parameters, activations_[i]);
    }
    if (!held_.held()) return;
    if (const auto promises = PromiseRegister::open(root_)) promises->rewrite(held_, promise_);
}

void LoopPromise::describe_trees(GuaranteeReport& report) const {
    if (!held_.held()) return;
    const auto promises = PromiseRegister::open(root_, kLookPatience);
    if (!promises) return;
    for (const Promise& promise : promises->living()) {
        for (const TreeVcpu& tree : promise.trees) {
            if (std::ranges::find(cores_, tree.core) == cores_.end()) continue;
            std::vector<Promise> others = promises->living();
            std::erase_if(others, [&](const Promise& each) { return each.path == promise.path; });
            static_cast<void>(report.trees.try_push_back(describe_tree(tree, promise, others)));
        }
    }
}

}  // namespace qduino::board::linux
