// The locks of a sketch, as admission sees them: who may hold each, and for how long.
//
// Admission comes before the loops run, so what a loop does with a lock must be said, or the worst
// be assumed: any loop may hold a lock that says nothing, for its whole budget (a critical section
// is part of what a budget pays for).
#pragma once

#include "base/fixed_vector.h"
#include "runtime/sketch.h"
#include "sched/blocking.h"

namespace qduino::runtime {

/// One lock, from its construction on. Host thread only; setup-time.
class LockDeclaration {
  public:
    LockDeclaration() : next_(first_) { first_ = this; }
    ~LockDeclaration() {
        LockDeclaration** at = &first_;
        while (*at != this) at = &(*at)->next_;
        *at = next_;
    }
    LockDeclaration(const LockDeclaration&) = delete;
    LockDeclaration& operator=(const LockDeclaration&) = delete;

    /// `loop` holds it for at most `length` of its CPU time, once in a release. Loops that are not
    /// named never hold it, nor do those that hold it for no time. Beyond 32 nothing is added.
    void held_by(board::VcpuId loop, Nanoseconds length) {
        static_cast<void>(sections_.try_push_back({loop, 0, length}));
    }

    /// Calls `visit` with every critical section of every lock of `table`'s sketch.
    template <typename Visit>
    static void each_section(const SketchTable& table, Visit visit) {
        std::uint8_t number = 0;
        for (const LockDeclaration* lock = first_; lock; lock = lock->next_, ++number) {
            for (sched::CriticalSection section : lock->sections_) {
                section.lock = number;
                visit(section);
            }
            if (!lock->sections_.empty() || table.loops.size() < 2) continue;
            for (const LoopDeclaration& loop : table.loops) visit({loop.id, number, loop.budget});
        }
    }

  private:
    static inline LockDeclaration* first_ = nullptr;
    LockDeclaration* next_;
    FixedVector<sched::CriticalSection, board::kMaxLoop> sections_;
};

}  // namespace qduino::runtime
