#include "report/lock_report.h"

#include <algorithm>
#include <vector>

#include "base/text.h"
#include "runtime/lock_declaration.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

using runtime::LockDeclaration;
using runtime::Runtime;
using runtime::SketchTable;
using runtime::Unsaid;

/// Somebody might share it otherwise than assumed.
bool is_assumed(const LockDeclaration& lock) {
    return lock.said().empty() && lock.unsaid() != Unsaid::nothing && lock.unsaid() != Unsaid::brief;
}

std::vector<board::VcpuId> users_of(const LockDeclaration& lock) {
    std::vector<board::VcpuId> users;
    for (board::VcpuId id = 1; id < board::kVcpuLimit; ++id) {
        if (lock.users() >> id & 1) users.push_back(id);
    }
    return users;
}

/// How long `user` counts as its holder; −1: not at all.
Nanoseconds counted_of(const LockDeclaration& lock, board::VcpuId user, const Runtime& runtime) {
    Nanoseconds length{-1};
    for (const LockDeclaration::Section& said : lock.said()) {
        const bool is_it = said.handler ? std::ranges::count(runtime.handlers_of(said.handler), user) > 0
                                        : said.loop == user;
        if (is_it) length = std::max(length, said.length);
    }
    if (!lock.said().empty() || user > board::kMaxLoop) return length;
    const runtime::Loop* const loop = runtime.loop(user);
    return loop ? lock.assumed_of(loop->declaration.budget, runtime.board()) : length;
}

/// "SPI", or "a Mutex (blink.ino:7)" with the place of its first heldBy().
std::string name_of(const LockDeclaration& lock) {
    if (lock.said().empty()) return lock.name();
    const LockDeclaration::Section& first = lock.said().front();
    const std::string_view file = first.file;
    return text<std::string>(std::string_view{lock.name()}, " (", file.substr(file.find_last_of('/') + 1),
                             ':', first.line, ')');
}

bool on_several_cores(const std::vector<board::VcpuId>& users, const Runtime& runtime) {
    const sched::MulticoreAdmission& admission = runtime.plan().admission();
    return std::ranges::any_of(users, [&](board::VcpuId user) {
        return admission.core_of(user) != admission.core_of(users.front());
    });
}

bool has_handler(const std::vector<board::VcpuId>& users) { return users.back() >= board::kFirstIoVcpu; }

/// Calls `visit` with each lock that was not used as it counts, and why.
template <typename Visit>
void each_wrong(const Runtime& runtime, const SketchTable& table, Visit visit) {
    if (!runtime.plan().admitted() || table.loops.empty()) return;
    LockDeclaration::each([&](const LockDeclaration& lock) {
        const std::vector<board::VcpuId> users = users_of(lock);
        if (users.empty()) return;
        if (!lock.said().empty()) {
            for (const board::VcpuId user : users) {
                if (counted_of(lock, user, runtime) <= Nanoseconds{0})
                    return visit(lock, runtime::vcpu_name(user) + " took it, and heldBy() does not name it");
            }
        }
        if (users.size() < 2) return;
        const bool nearby = lock.unsaid() != Unsaid::whole_budgets;
        const bool takes_time = lock.assumed_of(Nanoseconds{1}, runtime.board()) > Nanoseconds{0};
        const bool counts_wrong =
            takes_time && (has_handler(users) || (nearby && on_several_cores(users, runtime)));
        if (is_assumed(lock) && (counts_wrong || lock.unsaid() == Unsaid::unknown)) {
            return visit(lock, text<std::string>(runtime::vcpu_name(users.front()), " and ",
                                                 runtime::vcpu_name(users.back()),
                                                 " share it, and nobody says how long they hold it"));
        }
        for (const board::VcpuId user : users) {
            const Nanoseconds counts = counted_of(lock, user, runtime), held = lock.longest(user);
            if (lock.unsaid() == Unsaid::brief || held <= counts) continue;
            const std::string counted =
                counts < Nanoseconds{0} ? "none of it counts" : human_duration(counts) + " count";
            return visit(lock, text<std::string>(runtime::vcpu_name(user), " held it for ",
                                                 human_duration(held), ", and ", counted));
        }
    });
}

/// Where there are handlers: the locks that none of them takes, as heldBy() says.
std::string handlers_left_out(const Runtime& runtime) {
    const auto is_handler = [](const sched::Vcpu& vcpu) { return vcpu.is_io(); };
    if (std::ranges::none_of(runtime.plan().admission().placed, is_handler)) return "";
    std::vector<std::string> names;
    LockDeclaration::each([&](const LockDeclaration& lock) {
        const bool names_one = std::ranges::any_of(
            lock.said(), [](const LockDeclaration::Section& said) { return said.handler != nullptr; });
        if (lock.said().empty() || names_one) return;
        if (!names.empty()) names.back() += ',';
        names.push_back(name_of(lock));
    });
    if (names.empty()) return "";
    names.back() += '.';
    return "No handler may take these locks, for heldBy() names none:\n" + wrapped(names, "  ");
}

}  // namespace

std::vector<std::string> locks_that_say_nothing(const Runtime& runtime, const SketchTable& table) {
    std::vector<std::string> names;
    const auto is_handler = [](const sched::Vcpu& vcpu) { return vcpu.is_io(); };
    const auto& placed = runtime.plan().admission().placed;
    const bool cores = std::ranges::any_of(
        placed, [&](const sched::Vcpu& vcpu) { return vcpu.core != placed.front().core; });
    const bool handlers = std::ranges::any_of(placed, is_handler);
    if (table.loops.size() + (handlers ? 1 : 0) < 2) return names;
    LockDeclaration::each([&](const LockDeclaration& lock) {
        const bool nearby = lock.unsaid() != Unsaid::whole_budgets;
        const bool takes_time = lock.assumed_of(Nanoseconds{1}, runtime.board()) > Nanoseconds{0};
        const bool may_be_wrong = takes_time && (handlers || (nearby && cores));
        if (is_assumed(lock) && (may_be_wrong || lock.unsaid() == Unsaid::unknown))
            names.emplace_back(lock.name());
    });
    return names;
}

std::string lock_assumptions(const Runtime& runtime, const SketchTable& table) {
    if (!runtime.plan().admitted()) return "";
    std::vector<std::string> counted;
    LockDeclaration::each([&](const LockDeclaration& lock) {
        if (!is_assumed(lock) || table.loops.size() < 2) return;
        const bool whole = lock.unsaid() != Unsaid::bus_time;
        const Nanoseconds length = lock.assumed_of(Nanoseconds{1}, runtime.board());
        if (length == Nanoseconds{0}) return;
        if (!counted.empty()) counted.back() += ',';
        counted.push_back(text<std::string>(std::string_view{lock.name()}, ' ',
                                            whole ? "a whole budget" : text<std::string>(length)));
    });
    std::string out;
    if (!counted.empty()) {
        counted.back() += '.';
        out += "Locks that say nothing count as if each loop held them:\n" + wrapped(counted, "  ");
    }
    out += handlers_left_out(runtime);
    std::vector<std::string> unknown = locks_that_say_nothing(runtime, table);
    if (unknown.empty()) return out;
    for (std::size_t i = 0; i + 1 < unknown.size(); ++i) unknown[i] += ',';
    unknown.back() += '.';
    return out +
           "R is UNKNOWN if loops of two cores, a handler and a loop, or any two tasks of\n"
           "FreeRTOS share one of these locks, which say nothing (heldBy(loop or handler,\n"
           "length) in setup()):\n" +
           wrapped(unknown, "  ");
}

std::string lock_condition(const Runtime& runtime, const SketchTable& table) {
    std::string out;
    for (const std::string& name : locks_that_say_nothing(runtime, table))
        out += (out.empty() ? "; R is unknown if " : " or ") + name;
    return out.empty() ? out : out + " is shared";
}

std::string lock_notes(const Runtime& runtime, const SketchTable& table) {
    std::string notes;
    each_wrong(runtime, table, [&](const LockDeclaration& lock, const std::string& why) {
        notes += name_of(lock) + ": " + why + ".\n  R of those that share it is unknown.\n";
    });
    return notes;
}

std::string lock_verdict(const Runtime& runtime, const SketchTable& table) {
    std::string out;
    each_wrong(runtime, table, [&](const LockDeclaration& lock, const std::string&) {
        out += (out.empty() ? "; R unknown, locks not as counted: " : ", ") + name_of(lock);
    });
    return out;
}

std::string lock_lengths(double margin) {
    std::string out;
    LockDeclaration::each([&](const LockDeclaration& lock) {
        if (lock.unsaid() == Unsaid::brief || lock.unsaid() == Unsaid::nothing) return;
        for (const board::VcpuId user : users_of(lock)) {
            const Nanoseconds held = lock.longest(user);
            if (held <= Nanoseconds{0}) continue;
            const auto micros = static_cast<std::int64_t>(to_seconds(held) * (1 + margin) * 1e6) + 1;
            write(out, "  ", name_of(lock), ": ", runtime::vcpu_name(user), " held it for ",
                  human_duration(held), " at most");
            if (user <= board::kMaxLoop) write(out, "; heldBy(", int{user}, ", ", micros, "us)");
            out += '\n';
        }
    });
    return out.empty() ? out : "Locks, and how long they were held:\n" + out;
}

}  // namespace qduino::apps
