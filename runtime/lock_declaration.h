// The locks of a sketch, as admission sees them: who may hold each, and for how long.
//
// Admission comes before the loops run, so what a loop does with a lock must be said, or the worst
// be assumed. Every lock of the Arduino face carries a declaration, so there is none that admission
// does not know:
//
//   said             by heldBy(): these and no others, so long
//   Mutex            else: every loop may hold it for its whole budget
//   FreeRTOS         else: it does not count. Sketches from elsewhere say nothing, and would all be
//                    refused; so R of those that share it is unknown, and the check says so
//   SPI              else, once begun: every loop of a core for its whole budget (what stands in a
//                    transaction is the sketch's); no two cores share it
//   Wire, Serial     else, once begun: every loop of a core for the bus' time of one transaction
//   queues, tone()…  a few words are copied: every loop of a core for kBrief
//
// What is assumed of Wire, Serial and SPI may be wrong: loops of two cores, or handlers, may share
// one. The takers of a lock are noted while the sketch runs, and the end of a run says where it was
// not as assumed, or not as said.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "base/fixed_vector.h"
#include "board/board.h"
#include "runtime/sketch.h"
#include "sched/blocking.h"

namespace qduino::runtime {

/// What is assumed of a lock of which nobody says who holds it.
enum class Unsaid : std::uint8_t {
    whole_budgets,         ///< any loop, its whole budget
    whole_budgets_nearby,  ///< the same, and no two cores share it
    bus_time,              ///< any loop, what so many bytes take on its bus; no two cores share it
    brief,                 ///< any loop, kBrief; no two cores share it
    unknown,               ///< nothing counts, and R of those that share it is unknown
    nothing,               ///< it is not used as a lock
};

/// One lock, from its construction on. Setup-time, on the host's thread, but for what says more.
class LockDeclaration {
  public:
    /// A few words are copied under such a lock, and nothing waits: less than 2 µs.
    static constexpr Nanoseconds kBrief{2'000};

    /// `name` outlives it.
    explicit LockDeclaration(const char* name = "Mutex", Unsaid unsaid = Unsaid::whole_budgets)
        : next_(first_),
          name_(name),
          unsaid_(unsaid),
          in_use_(unsaid == Unsaid::whole_budgets || unsaid == Unsaid::brief || unsaid == Unsaid::unknown) {
        first_ = this;
    }
    /// A lock of a bus, held for one transaction of `bytes` at the most.
    LockDeclaration(const char* name, board::DeviceClass device, std::size_t bytes)
        : LockDeclaration(name, Unsaid::bus_time) {
        device_ = device;
        bytes_ = bytes;
    }
    ~LockDeclaration() {
        LockDeclaration** at = &first_;
        while (*at != this) at = &(*at)->next_;
        *at = next_;
    }
    LockDeclaration(const LockDeclaration&) = delete;
    LockDeclaration& operator=(const LockDeclaration&) = delete;

    /// `loop` holds it for at most `length` of its CPU time, once in a release. VCPUs that are not
    /// named never hold it, nor do those that hold it for no time. Beyond 32 nothing is added, and
    /// admission refuses.
    void held_by(int loop, Nanoseconds length, const char* file = "", int line = 0) {
        add({.loop = loop, .length = length, .file = file, .line = line});
    }
    /// Likewise the handler of an interrupt, once in each run of it.
    void held_by(void (*handler)(), Nanoseconds length, const char* file = "", int line = 0) {
        add({.handler = handler, .length = length, .file = file, .line = line});
    }
    /// setup() has begun the bus. A bus that is not begun counts only where setup() was not run.
    void use() { in_use_ = true; }
    [[nodiscard]] bool in_use() const { return in_use_ || setup_skipped_; }
    /// setup() was not run, so nobody knows what it would begin.
    static void note_setup(bool skipped) { setup_skipped_ = skipped; }
    /// The clock of the bus was set to `hz`.
    void set_clock(std::uint32_t hz) { clock_hz_ = hz; }

    /// While the loops run: `vcpu` takes it. Any thread.
    void taken_by(board::VcpuId vcpu) {
        const std::uint64_t bit = std::uint64_t{1} << (vcpu % 64);
        if (!(users_.load(std::memory_order_relaxed) & bit)) users_.fetch_or(bit, std::memory_order_relaxed);
    }
    /// The VCPUs that took it, a bit each.
    [[nodiscard]] std::uint64_t users() const { return users_.load(std::memory_order_relaxed); }

    /// Only with measure(): `vcpu` held it for `length` of its CPU time. The holder's thread.
    void held_for(board::VcpuId vcpu, Nanoseconds length) {
        if (length > (*longest_)[vcpu]) (*longest_)[vcpu] = length;
    }
    [[nodiscard]] bool measures() const { return longest_ != nullptr; }
    [[nodiscard]] Nanoseconds longest(board::VcpuId vcpu) const {
        return longest_ ? (*longest_)[vcpu] : Nanoseconds{0};
    }

    struct Section {
        int loop = 0;
        void (*handler)() = nullptr;
        Nanoseconds length{};
        const char* file = "";
        int line = 0;
    };
    [[nodiscard]] const auto& said() const { return sections_; }
    [[nodiscard]] bool too_many() const { return too_many_; }
    [[nodiscard]] Unsaid unsaid() const { return unsaid_; }
    [[nodiscard]] const char* name() const { return name_; }
    /// How long a loop of this budget may hold it, where nobody says.
    [[nodiscard]] Nanoseconds assumed_of(Nanoseconds budget, const board::Board& board) const {
        if (!in_use()) return Nanoseconds{0};
        if (unsaid_ == Unsaid::bus_time) return board.bus_time(device_, bytes_, clock_hz_);
        if (unsaid_ == Unsaid::brief) return kBrief;
        return unsaid_ == Unsaid::nothing || unsaid_ == Unsaid::unknown ? Nanoseconds{0} : budget;
    }

    /// Every lock of the program.
    template <typename Visit>
    static void each(Visit visit) {
        for (LockDeclaration* lock = first_; lock; lock = lock->next_) visit(*lock);
    }
    /// From now on every lock measures how long it is held. Allocates.
    static void measure_all() {
        each([](LockDeclaration& lock) { lock.longest_ = std::make_unique<Lengths>(); });
    }
    /// For a run: what is said so far is its.
    static void take_all() {
        each([](LockDeclaration& lock) { lock.taken_ = true; });
    }
    /// A second run in one process says all of it once more: what the last one took is forgotten.
    static void forget_taken() {
        each([](LockDeclaration& lock) {
            if (!std::exchange(lock.taken_, false)) return;
            lock.sections_.clear();
            lock.too_many_ = false;
            lock.users_.store(0, std::memory_order_relaxed);
        });
    }
    /// Calls `visit` with every critical section of every lock of `table`'s sketch. `visit_handler`
    /// gets a section without its VCPU, and the handler.
    template <typename Visit, typename VisitHandler>
    static void each_section(const SketchTable& table, const board::Board& board, Visit visit,
                             VisitHandler visit_handler) {
        std::uint8_t number = 0;
        Nanoseconds brief{};
        const auto every_loop = [&](auto length, bool assumed) {
            if (table.loops.size() < 2) return;
            for (const LoopDeclaration& loop : table.loops) {
                if (length(loop) > Nanoseconds{0})
                    visit(sched::CriticalSection{loop.id, number, length(loop), assumed});
            }
            ++number;
        };
        each([&](const LockDeclaration& lock) {
            // Nobody waits for a lock that one VCPU alone takes.
            const bool shared = lock.sections_.size() > 1;
            for (const Section& section : lock.sections_) {
                if (!shared) break;
                const sched::CriticalSection said{static_cast<board::VcpuId>(section.loop), number,
                                                  section.length};
                section.handler ? visit_handler(said, section.handler) : visit(said);
            }
            if (!lock.sections_.empty()) {
                if (shared) ++number;
            } else if (lock.unsaid_ == Unsaid::brief) {
                brief += kBrief;
            } else if (lock.assumed_of(Nanoseconds{1}, board) > Nanoseconds{0}) {
                every_loop([&](const auto& loop) { return lock.assumed_of(loop.budget, board); },
                           lock.unsaid_ != Unsaid::whole_budgets);
            }
        });
        // They count together as one, which is held as long as all of them: so many lower loops may
        // each be in another of them.
        if (brief > Nanoseconds{0}) every_loop([&](const auto&) { return brief; }, true);
    }

  private:
    using Lengths = std::array<Nanoseconds, board::kVcpuLimit>;
    void add(const Section& section) { too_many_ |= !sections_.try_push_back(section); }

    static inline LockDeclaration* first_ = nullptr;
    LockDeclaration* next_;
    const char* name_;
    Unsaid unsaid_;
    board::DeviceClass device_ = board::DeviceClass::all;
    std::size_t bytes_ = 0;
    std::uint32_t clock_hz_ = 0;
    bool in_use_;
    bool too_many_ = false;
    bool taken_ = false;
    static inline bool setup_skipped_ = false;
    FixedVector<Section, board::kMaxLoop> sections_;
    std::atomic<std::uint64_t> users_{0};
    std::unique_ptr<Lengths> longest_;  // null: nobody measures
};

}  // namespace qduino::runtime
