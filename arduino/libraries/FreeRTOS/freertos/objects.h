// What tasks of FreeRTOS meet at: queues, semaphores, groups of events, timers (queue.h, semphr.h,
// event_groups.h, timers.h). Each may be used by tasks, loops and handlers.
//
// They take memory when they are made, which is for setup(). A waiter looks at each tick.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "arduino/core/lock.h"
#include "arduino/libraries/FreeRTOS/freertos/tasks.h"
#include "board/types.h"

namespace qduino::arduino::freertos {

/// Items of one size, copied in and out.
class Queue {
  public:
    Queue(std::size_t length, std::size_t item_bytes);

    bool send(const void* item, Ticks ticks, bool to_front = false);
    /// In a queue of one item: replaces the item, if there is one.
    void overwrite(const void* item);
    /// `take`: it is gone then.
    bool receive(void* item, Ticks ticks, bool take = true);
    void reset();
    [[nodiscard]] std::size_t size() const { return size_.load(); }
    [[nodiscard]] std::size_t room() const { return length_ - size_.load(); }

  private:
    bool try_send(const void* item, bool to_front);
    bool try_receive(void* item, bool take);
    [[nodiscard]] std::uint8_t* place(std::size_t index) { return &items_[index % length_ * item_bytes_]; }

    const std::size_t length_, item_bytes_;
    std::vector<std::uint8_t> items_;
    Lock lock_{"a queue", runtime::Unsaid::brief};
    std::size_t first_ = 0;
    std::atomic<std::size_t> size_{0};
};

/// Counts up to `most`; or, a mutex, belongs to the task that took it, which then ranks as high as
/// the highest that waits without an end. Say in setup() who holds a mutex, as for a Mutex:
/// mutex->heldBy(1, 2ms).
class Semaphore : public SaysWhoHolds<Semaphore> {
  public:
    enum class Kind : std::uint8_t { counting, mutex, recursive };
    Semaphore(Kind kind, std::uint32_t most, std::uint32_t count)
        : kind_(kind),
          most_(most),
          count_(count),
          lock_("a FreeRTOS mutex",
                kind == Kind::counting ? runtime::Unsaid::nothing : runtime::Unsaid::unknown) {}

    bool take(Ticks ticks);
    /// False: it is full, or a mutex of another.
    bool give();
    [[nodiscard]] std::uint32_t count() const { return count_.load(); }
    /// The loop that has this mutex; kNoVcpu: none, or this is no mutex.
    [[nodiscard]] board::VcpuId holder() const { return holder_.load(); }

  private:
    bool try_count_down();
    bool take_mutex(Ticks ticks);

    friend class SaysWhoHolds<Semaphore>;

    const Kind kind_;
    const std::uint32_t most_;
    std::atomic<std::uint32_t> count_;
    Lock lock_;  // a mutex is this one
    std::atomic<board::VcpuId> holder_{board::kNoVcpu};
    std::uint32_t depth_ = 0;  // the holder's
};

class EventGroup {
  public:
    std::uint32_t set(std::uint32_t bits) { return bits_.fetch_or(bits) | bits; }
    std::uint32_t clear(std::uint32_t bits) { return bits_.fetch_and(~bits); }
    [[nodiscard]] std::uint32_t get() const { return bits_.load(); }
    /// The bits as they were when enough were set, or when the time was over.
    std::uint32_t wait(std::uint32_t bits, bool clear_after, bool all, Ticks ticks);

  private:
    std::atomic<std::uint32_t> bits_{0};
};

class Timer {
  public:
    using Function = void (*)(Timer*);
    Timer(const char* name, Ticks period, bool again, void* id, Function function)
        : name_(name), id_(id), function_(function), again_(again), period_(period) {}

    void start() { start_at(tick_count()); }
    void start_at(Ticks now);
    void stop() { runs_.store(false); }
    void set_period(Ticks period) {
        period_.store(period);
        start();
    }
    [[nodiscard]] bool runs() const { return runs_.load(); }
    [[nodiscard]] Ticks period() const { return period_.load(); }
    [[nodiscard]] const char* name() const { return name_; }
    [[nodiscard]] void* id() const { return id_.load(); }
    void set_id(void* id) { id_.store(id); }
    /// By the timers' task, at each tick.
    void look(Ticks now);

  private:
    const char* name_;
    std::atomic<void*> id_;
    Function function_;
    const bool again_;
    std::atomic<Ticks> period_, due_{0};
    std::atomic<bool> runs_{false};
};

/// In setup(): the first makes the task of all timers, with the highest priority. Null: there is no
/// room for it.
Timer* make_timer(const char* name, Ticks period, bool again, void* id, Timer::Function function);

}  // namespace qduino::arduino::freertos
