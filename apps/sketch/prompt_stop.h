// Ends a simulated run within a second after it was asked to, whatever the sketch does.
//
// The run looks for a stop between slices of virtual time. A slice of a sketch that asks the board
// ten million things takes minutes, and one that waits outside of virtual time (for a terminal that
// does not read) takes for ever. Nobody may be left to ask, either: a person who closes the window
// leaves a run behind that takes a core. So a thread of its own looks every 50 ms:
//
//   a stop was asked (SIGINT, SIGTERM)       the code that runs is interrupted, and leaves at its
//                                            next call to the board, or its next look of a spin
//   it still runs 0.8 s later                `give_up`
//   the parent has ended                     as if a signal had come; not where SIGHUP is ignored,
//                                            as by nohup: then the run is meant to outlive it
#pragma once

#include <pthread.h>

#include <atomic>
#include <thread>

#include "board/sim/event_loop.h"

namespace qduino::apps {

class PromptStop {
  public:
    /// On the thread that runs the board, after stop_on_signals(). SIGURG is its own. `loop`
    /// outlives it. `give_up` ends the program, on another thread.
    PromptStop(board::sim::EventLoop& loop, void (*give_up)());
    ~PromptStop() { dismiss(); }
    PromptStop(const PromptStop&) = delete;
    PromptStop& operator=(const PromptStop&) = delete;

    /// Nothing of the sketch runs any more.
    void dismiss();

  private:
    void watch(pthread_t runner);

    void (*give_up_)();
    std::atomic<bool> dismissed_{false};
    std::thread thread_;
};

}  // namespace qduino::apps
