// Announces a wait of the calling VCPU to the keeper of its budget. Waiting then costs no budget.
#pragma once

#include "board/linux/loop/vcpu_thread.h"

namespace qduino::board::linux {

/// Lives around the waiting call. On a thread that is no VCPU it does nothing.
class AnnouncedWait {
  public:
    AnnouncedWait() : thread_(VcpuThread::current()) {
        if (thread_) thread_->before_block();
    }
    ~AnnouncedWait() {
        if (thread_) thread_->after_block();
    }
    AnnouncedWait(const AnnouncedWait&) = delete;
    AnnouncedWait& operator=(const AnnouncedWait&) = delete;

  private:
    VcpuThread* thread_;
};

}  // namespace qduino::board::linux
