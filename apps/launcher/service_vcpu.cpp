#include "apps/launcher/service_vcpu.h"

#include <algorithm>
#include <cstdio>

#include "board/linux/kernel/clock.h"
#include "posix/guarded_file.h"
#include "vcpu/vcpu_report.h"

namespace qduino::launcher {
namespace {

constexpr Nanoseconds kWriteEvery = 2s;
/// The service may take this long to end when the launcher was killed: the kernel has asked it.
constexpr Nanoseconds kServiceGrace = 8s;

std::string what_fits(Nanoseconds asked, Nanoseconds fits) {
    return text<std::string>(" (", asked / 1ms, " asked, ", fits / 1ms, " fit)");
}

}  // namespace

ServiceVcpu::ServiceVcpu(std::optional<Nanoseconds> budget, bool exactly, const std::string& why_none,
                         std::filesystem::path file)
    : file_(std::move(file)),
      asked_(budget.value_or(Nanoseconds{0})),
      exactly_(exactly),
      started_(board::linux::monotonic_now()) {
    if (!budget) {
        why_none_ = why_none;
        return;
    }
    apps::ProcessVcpuOptions options;
    options.tree = {
        .name = "print service", .core = kServiceCore, .budget = *budget, .period = kServicePeriod};
    options.also_when_refused = true;
    options.witness_asks = false;
    options.witness_grace = kServiceGrace;
    if (auto made = apps::ProcessVcpu::make(options)) {
        vcpu_.emplace(std::move(*made));
    } else {
        why_none_ = made.error().message.view();
    }
}

void ServiceVcpu::enter() const {
    if (!vcpu_) return;
    if (const Result<void> entered = vcpu_->group().enter(kServiceCore); !entered)
        std::fprintf(stderr, "run: the print service is not in its VCPU: %s\n",
                     std::string{entered.error().message.view()}.c_str());
}

void ServiceVcpu::admit_again() {
    fit();
    write(board::linux::monotonic_now());
}

void ServiceVcpu::fit() {
    if (vcpu_) vcpu_->take_what_fits(asked_, exactly_ ? asked_ : std::min(asked_, kServiceLeast));
}

board::TreeGuarantee ServiceVcpu::guarantee() const {
    if (vcpu_) {
        board::TreeGuarantee line = apps::guarantee_of(*vcpu_);
        line.enforced = !outside_;
        if (outside_)
            line.shortfall = decltype(line.shortfall){"the kernel did not let it into its control group"};
        return line;
    }
    board::TreeGuarantee line;
    line.name = decltype(line.name){"print service"};
    line.core = kServiceCore;
    line.shortfall = decltype(line.shortfall){why_none_};
    return line;
}

std::string ServiceVcpu::words() const {
    if (!vcpu_) return "The print service has no budget of its own: " + why_none_ + ".\n";
    const board::TreeGuarantee line = guarantee();
    auto out = text<std::string>("The print service has ", line.budget, " in ", line.period, " of core ",
                                 line.core, ", kept by ", vcpu_->enforced_by(),
                                 line.budget < asked_ ? what_fits(asked_, line.budget) : "",
                                 line.shortfall.empty() ? "" : ", but not surely: ");
    return qduino::write(out, line.shortfall.view(), ".\n");
}

std::string ServiceVcpu::in_a_line() const {
    if (!vcpu_) return "web budget none";
    const board::TreeGuarantee line = guarantee();
    auto out = text<std::string>("web budget ", line.budget / 1ms, " of ", line.period);
    if (!line.enforced) return out += " NOT kept";
    if (!line.admitted) {
        const Nanoseconds most = vcpu_->verdict().largest;
        out += " NOT sure";
        return qduino::write(out, " (", most / 1ms, " fit)");
    }
    return line.budget < asked_ ? out += what_fits(asked_, line.budget) : out;
}

void ServiceVcpu::look(Instant now, bool lives) {
    if (now - written_at_ < kWriteEvery) return;
    if (vcpu_) {
        fit();
        outside_ = lives && board::linux::members_of_group(vcpu_->group().folders()[0]).empty();
    }
    write(now);
}

void ServiceVcpu::write(Instant now) {
    board::linux::CpuGroupUse use;
    if (vcpu_) {
        if (const auto read = vcpu_->group().use()) use = *read;
    }
    const double share = apps::share_of(use.used - use_.used, now - written_at_);
    const std::string json =
        apps::vcpu_json(guarantee(), vcpu_ ? vcpu_->enforced_by() : "", use, now - started_, share);
    use_ = use;
    written_at_ = now;
    // The service may read it. Without it the page shows the old one.
    static_cast<void>(posix::replace_guarded(file_, json + '\n', 0644));
}

}  // namespace qduino::launcher
