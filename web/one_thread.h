// All of the service's work on one thread: where there are no others.
#pragma once

#include <deque>

#include "web/service.h"

namespace qduino::web {

/// Runs a task where it is handed in. Tasks that a task hands in run after it, as on a thread.
class OneThread {
  public:
    /// For work of each kind. Not beyond the life of this.
    [[nodiscard]] Executors executors();

  private:
    void run(Task task);
    std::deque<Task> tasks_;
};

}  // namespace qduino::web
