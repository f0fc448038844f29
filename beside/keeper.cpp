#include "beside/keeper.h"

#include "base/text.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/real_time_thread.h"
#include "terminal/message.h"

namespace qduino::apps::beside_linux {

Keeper::Keeper(std::atomic<std::uint64_t>& beats, Nanoseconds period)
    : thread_([&beats, period](const std::stop_token& stop) {
          constexpr int kPriority = 98, kCore = 0;
          board::linux::name_thread("qduino-keeper");
          if (const auto done = board::linux::become_real_time(kPriority); !done)
              say(text<std::string>("Linux's heartbeat is an ordinary thread's: ",
                                    done.error().message.view()),
                  "qduino: ");
          static_cast<void>(board::linux::pin_to_core(kCore));
          for (Instant next = board::linux::monotonic_now(); !stop.stop_requested(); next += period) {
              beats.fetch_add(1, std::memory_order_release);
              board::linux::block_until(next + period);
          }
      }) {}

}  // namespace qduino::apps::beside_linux
