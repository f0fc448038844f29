#include "report/spin_report.h"

#include "base/text.h"
#include "report/code_place.h"
#include "report/crash_report.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

using board::sim::SpinSeen;

std::string place_of(const SpinSeen& seen) {
    return apps::place_of(std::span(seen.spin.stack.address).first(seen.spin.stack.depth));
}

}  // namespace

std::string spin_verdict(const std::vector<SpinSeen>& spins) {
    std::string out;
    for (const SpinSeen& seen : spins) {
        if (!seen.goes_on || seen.vcpu == board::kNoVcpu) continue;
        write(out, name_of_vcpu(seen.vcpu), " spins at ", place_of(seen), ", since ",
              human_duration(seen.spin.begun - kEpoch), "; ");
    }
    return out;
}

std::string spin_notes(const std::vector<SpinSeen>& spins) {
    std::string out;
    for (const SpinSeen& seen : spins) {
        if (seen.goes_on) continue;
        write(out, name_of_vcpu(seen.vcpu), " ran on at ", place_of(seen),
              " and asked the board for nothing: taken for a spin of ", human_duration(seen.spin.lasted),
              ".\n  If it computed, let the board file allow more: [sim] spin_limit.\n");
    }
    return out;
}

std::string setup_verdict(const std::vector<SpinSeen>& spins, Nanoseconds after) {
    std::string out = text<std::string>("setup() has not ended in ", human_duration(after));
    for (const SpinSeen& seen : spins) {
        if (seen.vcpu == board::kNoVcpu && seen.goes_on) write(out, ": it spins at ", place_of(seen));
    }
    return out;
}

}  // namespace qduino::apps
