// A wait of the calling VCPU, announced to the keeper of its budget: what it waits costs it nothing.
#pragma once

#include "board/linux/vcpu_thread.h"

namespace qduino::board::linux {

/// Stands around the waiting call. On a thread that is no VCPU it does nothing.
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
