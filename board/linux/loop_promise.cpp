#include "board/linux/loop_promise.h"

#include <algorithm>

#include "board/linux/kernel_text.h"
#include "board/linux/tree_admission.h"

namespace qduino::board::linux {
namespace {

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

}  // namespace

void LoopPromise::make(std::span<const VcpuSpec> specs,
                       const std::function<sched::PlatformOverheads(int)>& overheads,
                       const std::string& root) {
    root_ = root;
    Promise promise;
    promise.program = text_of_file("/proc/self/comm");
    for (const VcpuSpec& spec : specs) {
        sched::Vcpu vcpu = spec;
        if (!spec.owns_core)
            vcpu.budget = std::min(spec.budget + overheads(spec.core).per_activation(), spec.period - 1ns);
        promise.vcpus.push_back(vcpu);
        if (std::ranges::find(cores_, spec.core) == cores_.end()) cores_.push_back(spec.core);
    }
    for (const int core : cores_) {
        const sched::PlatformOverheads taken = overheads(core);
        for (const sched::PlatformInterferer& each : taken.interferers)
            promise.takers.push_back({core, each});
    }
    const auto promises = PromiseRegister::open(root_);
    if (!promises) return;
    if (auto held = promises->hold(promise, promises->free_name())) held_ = std::move(*held);
}

void LoopPromise::describe_trees(GuaranteeReport& report) const {
    if (!held_.held()) return;
    const auto promises = PromiseRegister::open(root_);
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
