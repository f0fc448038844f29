#include "sched/partition.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <tuple>
#include <utility>

#include "sched/admission.h"
#include "sched/remote_blocking.h"

namespace qduino::sched {
namespace {

double utilisation_of(const Vcpu& vcpu) {
    return static_cast<double>(vcpu.budget.count()) / static_cast<double>(vcpu.period.count());
}

/// The period over the power of two below it, 1 to 2: the same for periods that divide each other
/// by powers of two.
double octave_part(const Vcpu& vcpu) {
    const auto period = static_cast<std::uint64_t>(vcpu.period.count());
    return static_cast<double>(period) / static_cast<double>(std::bit_floor(period));
}

std::size_t number_of(const CoreLoad& load) { return static_cast<std::size_t>(load.core); }

}  // namespace

Partition::Partition(std::span<const Vcpu> requests, FixedVector<CoreLoad, kCoreLimit>& loads)
    : requests_(requests), loads_(loads) {
    for (Index i = 0; i < requests.size(); ++i) {
        if (requests[i].core == kAnyCore) list_.push_back(i);
    }
    for (CoreLoad& load : loads) {
        cores_.push_back(&load);
        for (const Vcpu& vcpu : load.mains) filled_[number_of(load)] += utilisation_of(vcpu);
        for (const Vcpu& vcpu : load.ios) filled_[number_of(load)] += utilisation_of(vcpu);
    }
}

bool Partition::place() {
    bool first = true;
    bool all_placed = false;
    for (const Order order : {Order::utilisation, Order::harmonic, Order::period}) {
        sort(order);
        for (const Fit fit : {Fit::first, Fit::fullest, Fit::emptiest}) {
            questions_ = 0;
            const bool placed = greedy(fit);
            if (placed && fits_together()) return true;
            all_placed |= placed;
            if (std::exchange(first, false) && !placed)
                first_left_over_ = *std::ranges::find_if(list_, [&](Index i) { return !core_of_[i]; });
            clear();
        }
    }
    sort(Order::utilisation);
    questions_ = 0;
    if (search(0)) return true;
    clear();
    stayed_ = all_placed && greedy(Fit::first);
    if (stayed_)
        count_remote_waits(loads_);
    else
        clear();
    return false;
}

/// Cores that are admissible each, with what they wait for each other. The waits of an attempt that
/// failed say nothing of the next one.
bool Partition::fits_together() {
    if (!locks_cross_cores(loads_) || are_admissible(loads_)) return true;
    for (CoreLoad& load : loads_) load.waits.clear();
    return false;
}

double Partition::utilisation(Index i) const { return utilisation_of(requests_[i]); }

void Partition::sort(Order order) {
    const auto key = [&](Index i) {
        const Vcpu& vcpu = requests_[i];
        const double by = order == Order::period     ? static_cast<double>(vcpu.period.count())
                          : order == Order::harmonic ? octave_part(vcpu)
                                                     : 0.0;
        return std::tuple{by, -utilisation(i), vcpu.id};
    };
    std::ranges::sort(list_, {}, key);
}

void Partition::sort_cores(Fit fit) {
    std::ranges::sort(cores_, {}, [&](const CoreLoad* load) {
        const double filled = filled_[number_of(*load)];
        return std::pair{fit == Fit::first ? 0.0 : fit == Fit::fullest ? -filled : filled, load->core};
    });
}

// ---- greedy, and exchange -----------------------------------------------------------------------

bool Partition::greedy(Fit fit) {
    for (const Index i : list_) {
        if (put(i, fit)) continue;
        Index left_over = i;
        bool found = false;
        for (int times = 0; times < kExchanges && !found && exchange(left_over); ++times)
            found = put(left_over, fit);
        if (!found) return false;
    }
    return true;
}

bool Partition::put(Index i, Fit fit) {
    sort_cores(fit);
    return std::ranges::any_of(cores_, [&](CoreLoad* load) { return put_on(*load, i); });
}

bool Partition::put_on(CoreLoad& load, Index i) {
    if (!requests_[i].may_be_on(load.core)) return false;
    double& filled = filled_[number_of(load)];
    if (filled + utilisation(i) > 1 + 1e-9 || !load.try_add(requests_[i])) return false;
    ++questions_;
    core_of_[i] = &load;
    filled += utilisation(i);
    if (is_admissible(load)) return true;
    take(load, i);
    core_of_[i] = nullptr;
    filled -= utilisation(i);
    return false;
}

/// The largest that is smaller than what is left over, and whose place that can take.
bool Partition::exchange(Index& left_over) {
    FixedVector<Index, kRequestLimit> smaller;
    for (const Index i : list_) {
        if (core_of_[i] && utilisation(i) < utilisation(left_over)) smaller.push_back(i);
    }
    std::ranges::sort(smaller, std::ranges::greater{}, [&](Index i) { return utilisation(i); });
    for (const Index i : smaller) {
        if (!takes_the_place(*core_of_[i], left_over, i)) continue;
        left_over = i;
        return true;
    }
    return false;
}

bool Partition::takes_the_place(CoreLoad& load, Index i, Index smaller) {
    take(load, smaller);
    filled_[number_of(load)] -= utilisation(smaller);
    core_of_[smaller] = nullptr;
    if (put_on(load, i)) return true;
    static_cast<void>(load.try_add(requests_[smaller]));
    filled_[number_of(load)] += utilisation(smaller);
    core_of_[smaller] = &load;
    return false;
}

// ---- search -------------------------------------------------------------------------------------

bool Partition::search(std::size_t from) {
    if (from == list_.size()) return fits_together();
    const Index i = list_[from];
    FixedVector<CoreLoad*, kCoreLimit> cores;
    sort_cores(Fit::fullest);
    for (CoreLoad* load : cores_) cores.push_back(load);
    for (CoreLoad* load : cores) {
        if (questions_ >= kQuestions) return false;
        if (!put_on(*load, i)) continue;
        if (search(from + 1)) return true;
        take(*load, i);
        filled_[number_of(*load)] -= utilisation(i);
        core_of_[i] = nullptr;
    }
    return false;
}

// ---- the loads ----------------------------------------------------------------------------------

void Partition::take(CoreLoad& load, Index i) const {
    const auto drop = [&](auto& list) {
        for (std::size_t at = 0; at < list.size(); ++at) {
            if (list[at].id == requests_[i].id) return list.erase(at);
        }
    };
    requests_[i].is_io() ? drop(load.ios) : drop(load.mains);
}

void Partition::clear() {
    for (const Index i : list_) {
        if (!core_of_[i]) continue;
        take(*core_of_[i], i);
        filled_[number_of(*core_of_[i])] -= utilisation(i);
        core_of_[i] = nullptr;
    }
}

}  // namespace qduino::sched
