#include "runtime/plan.h"

#include <algorithm>
#include <array>
#include <string>

namespace qduino::runtime {

namespace {

using sched::RefusedBecause;

std::string place_of(const LoopDeclaration& declaration) {
    return std::string(declaration.file) + ":" + std::to_string(declaration.line);
}

std::array<std::array<char, 8>, board::kVcpuLimit> make_names() {
    std::array<std::array<char, 8>, board::kVcpuLimit> names{};
    for (std::size_t id = 0; id < names.size(); ++id) {
        const std::string name = (id <= board::kMaxLoop ? "loop " : "io ") + std::to_string(id);
        std::copy_n(name.begin(), std::min(name.size(), names[id].size() - 1), names[id].begin());
    }
    return names;
}

sched::VcpuRequest request_of(const LoopDeclaration& declaration) {
    return {.id = declaration.id,
            .parameters = {declaration.budget, declaration.period},
            .core = declaration.core,
            .io = false};
}

}  // namespace

const char* vcpu_name(board::VcpuId id) {
    static const auto names = make_names();
    return id < names.size() ? names[id].data() : "";
}

Plan::Plan(std::vector<sched::PlatformOverheads> overheads, bool enforce)
    : overheads_(std::move(overheads)),
      enforce_(enforce),
      admission_(std::make_unique<sched::MachineAdmission>()) {}

Result<void> Plan::check_declarations(const SketchTable& table) const {
    if (table.dropped > 0) {
        return make_error(ErrorCode::out_of_range, "the sketch declares " +
                                                       std::to_string(table.loops.size() + table.dropped) +
                                                       " loops; 32 is the most");
    }
    if (table.loops.empty()) return make_error(ErrorCode::invalid_argument, "the sketch declares no loop");
    for (const LoopDeclaration& loop : table.loops) {
        if (loop.id < 1 || loop.id > board::kMaxLoop || !loop.body) {
            return make_error(ErrorCode::invalid_argument,
                              place_of(loop) + ": a loop has an id of 1…32 and a body");
        }
        for (const LoopDeclaration& other : table.loops) {
            if (&other == &loop || other.id != loop.id) continue;
            return make_error(ErrorCode::already_exists, place_of(other) + ": loop " +
                                                             std::to_string(loop.id) +
                                                             " was declared before, at " + place_of(loop));
        }
    }
    return {};
}

Result<void> Plan::add_loops(const SketchTable& table) {
    if (Result<void> checked = check_declarations(table); !checked) {
        explanation_ = checked.error().message.view();
        return checked;
    }
    const std::vector<sched::VcpuRequest> before = requests_;
    for (const LoopDeclaration& loop : table.loops) requests_.push_back(request_of(loop));
    Result<void> admitted = admit(table.loops.begin(), table.loops.size());
    if (!admitted) requests_ = before;
    return admitted;
}

Result<board::VcpuId> Plan::add_io(Nanoseconds budget, Nanoseconds period, int core) {
    const auto taken = [&](board::VcpuId id) {
        return std::any_of(requests_.begin(), requests_.end(), [&](const auto& r) { return r.id == id; });
    };
    board::VcpuId id = board::kFirstIoVcpu;
    while (id < board::kVcpuLimit && taken(id)) ++id;
    if (id == board::kVcpuLimit) return make_error(ErrorCode::unavailable, "all 31 I/O VCPUs are in use");

    requests_.push_back({.id = id, .parameters = {budget, period}, .core = core, .io = true});
    if (Result<void> admitted = admit(nullptr, 0); !admitted) {
        refused_ios_.push_back({requests_.back(), admission_->refusal, admission_->refused_core});
        remove_io(id);
        return admitted.error();
    }
    return id;
}

void Plan::remove_io(board::VcpuId id) {
    std::erase_if(requests_, [id](const sched::VcpuRequest& request) { return request.id == id; });
    sched::admit_all(requests_, overheads_, *admission_);
}

Result<void> Plan::admit(const LoopDeclaration* declarations, std::size_t count) {
    sched::admit_all(requests_, overheads_, *admission_);
    explanation_ = sched::explain(*admission_);
    if (admission_->admitted || !enforce_) return {};

    const sched::Refusal& refusal = admission_->refusal;
    std::string message;
    for (std::size_t i = 0; i < count; ++i) {
        if (declarations[i].id == refusal.id) message = place_of(declarations[i]) + ": ";
    }
    message += sched::explain(refusal, admission_->refused_core).view();
    const ErrorCode code = refusal.because == RefusedBecause::bad_parameters ? ErrorCode::invalid_argument
                           : refusal.because == RefusedBecause::no_such_core ? ErrorCode::not_found
                                                                             : ErrorCode::out_of_range;
    return make_error(code, message);
}

sched::Explanation Plan::admission_table() const { return sched::explain(*admission_); }

board::VcpuId Plan::owner_of(int core) const {
    board::VcpuId owner = board::kNoVcpu;
    for (const sched::VcpuRequest& request : requests_) {
        if (admission_->core_of(request.id) != core) continue;
        const bool whole = !request.io && request.core == core && request.parameters.whole_core();
        if (!whole || owner != board::kNoVcpu) return board::kNoVcpu;
        owner = request.id;
    }
    return owner;
}

std::vector<board::VcpuSpec> Plan::specs() const {
    std::vector<board::VcpuSpec> specs;
    for (const sched::VcpuRequest& request : requests_) {
        int core = admission_->core_of(request.id);
        // Refused, and placed all the same.
        if (core == sched::kAnyCore) core = std::max(request.core, 0);
        specs.push_back({.id = request.id,
                         .kind = request.io ? board::VcpuKind::io : board::VcpuKind::main,
                         .budget = request.parameters.budget,
                         .period = request.parameters.period,
                         .core = core,
                         .owns_core = owner_of(core) == request.id,
                         .name = vcpu_name(request.id)});
    }
    return specs;
}

}  // namespace qduino::runtime
