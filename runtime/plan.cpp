#include "runtime/plan.h"

#include <algorithm>

namespace qduino::runtime {

namespace {

using sched::RefusedBecause;

std::string place_of(const LoopDeclaration& declaration) {
    return text<std::string>(std::string_view{declaration.file}, ':', declaration.line);
}

Result<void> check_declarations(const SketchTable& table) {
    if (table.dropped > 0) {
        return make_error(ErrorCode::out_of_range, "the sketch declares ",
                          table.loops.size() + static_cast<std::size_t>(table.dropped),
                          " loops; 32 is the most");
    }
    if (table.loops.empty()) return make_error(ErrorCode::invalid_argument, "the sketch declares no loop");
    for (const LoopDeclaration& loop : table.loops) {
        if (loop.id < 1 || loop.id > board::kMaxLoop || !loop.body) {
            return make_error(ErrorCode::invalid_argument, place_of(loop),
                              ": a loop has an id of 1…32 and a body");
        }
        for (const LoopDeclaration& other : table.loops) {
            if (&other == &loop || other.id != loop.id) continue;
            return make_error(ErrorCode::already_exists, place_of(other), ": loop ", loop.id,
                              " was declared before, at ", place_of(loop));
        }
    }
    return {};
}

}  // namespace

std::string vcpu_name(board::VcpuId id) {
    return text<std::string>(id <= board::kMaxLoop ? "loop " : "io ", id);
}

Plan::Plan(std::vector<sched::PlatformOverheads> overheads, bool enforce)
    : overheads_(std::move(overheads)),
      enforce_(enforce),
      admission_(std::make_unique<sched::MulticoreAdmission>()) {}

Result<void> Plan::add_loops(const SketchTable& table) {
    if (const Result<void> checked = check_declarations(table); !checked) {
        explanation_ = checked.error().message.view();
        return checked;
    }
    const std::vector<sched::Vcpu> before = requests_;
    requests_.insert(requests_.end(), table.loops.begin(), table.loops.end());
    Result<void> admitted = admit({table.loops.begin(), table.loops.end()});
    if (!admitted) requests_ = before;
    return admitted;
}

Result<board::VcpuId> Plan::add_io(Nanoseconds budget, Nanoseconds period, int core) {
    const auto taken = [&](board::VcpuId id) {
        return std::ranges::count(requests_, id, &sched::Vcpu::id) > 0;
    };
    board::VcpuId id = board::kFirstIoVcpu;
    while (id < board::kVcpuLimit && taken(id)) ++id;
    if (id == board::kVcpuLimit) return make_error(ErrorCode::unavailable, "all 31 I/O VCPUs are in use");

    requests_.push_back({id, budget, period, core, board::VcpuKind::io});
    if (Result<void> admitted = admit({}); !admitted) {
        refused_ios_.push_back({requests_.back(), admission_->refusal, admission_->refused_core});
        remove_io(id);
        return admitted.error();
    }
    return id;
}

void Plan::remove_io(board::VcpuId id) {
    std::erase_if(requests_, [id](const sched::Vcpu& vcpu) { return vcpu.id == id; });
    sched::admit_all(requests_, overheads_, *admission_);
}

Result<void> Plan::admit(std::span<const LoopDeclaration> declarations) {
    sched::admit_all(requests_, overheads_, *admission_);
    explanation_ = sched::explain(*admission_);
    if (admission_->admitted || !enforce_) return {};

    const sched::Refusal& refusal = admission_->refusal;
    const auto declared = std::ranges::find(declarations, refusal.vcpu.id, &LoopDeclaration::id);
    const ErrorCode code = refusal.because == RefusedBecause::bad_parameters ? ErrorCode::invalid_argument
                           : refusal.because == RefusedBecause::no_such_core ? ErrorCode::not_found
                                                                             : ErrorCode::out_of_range;
    return make_error(code, declared == declarations.end() ? "" : place_of(*declared) + ": ",
                      sched::explain(refusal, admission_->refused_core));
}

sched::Explanation Plan::admission_table() const { return sched::explain(*admission_); }

board::VcpuId Plan::owner_of(int core) const {
    const auto& cores = admission_->cores;
    const auto index = static_cast<std::size_t>(core);
    const bool owned = index < cores.size() && cores[index].by == sched::AdmittedBy::owned;
    return owned ? cores[index].loops.front().id : board::kNoVcpu;
}

std::vector<board::VcpuSpec> Plan::specs() const {
    std::vector<board::VcpuSpec> specs;
    for (const sched::Vcpu& request : requests_) {
        board::VcpuSpec spec{request};
        // The core that it was put on; else it was refused, and runs all the same.
        spec.core = std::max({admission_->core_of(spec.id), spec.core, 0});
        spec.owns_core = owner_of(spec.core) == spec.id;
        specs.push_back(spec);
    }
    return specs;
}

}  // namespace qduino::runtime
