// A link in the memory of this process alone: for a sketch and a feeder in one process.
#pragma once

#include <sys/mman.h>

#include <new>

#include "printer/link/layout.h"

namespace qduino::apps {

class PrivateLink {
  public:
    PrivateLink() {
        void* memory = mmap(nullptr, sizeof(printer::link::LinkLayout), PROT_READ | PROT_WRITE,
                            MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory != MAP_FAILED) layout_ = new (memory) printer::link::LinkLayout;
    }
    ~PrivateLink() {
        if (layout_) munmap(layout_, sizeof *layout_);
    }
    PrivateLink(const PrivateLink&) = delete;
    PrivateLink& operator=(const PrivateLink&) = delete;

    /// Null when there was no memory for it.
    [[nodiscard]] printer::link::LinkLayout* get() const { return layout_; }

  private:
    printer::link::LinkLayout* layout_ = nullptr;
};

}  // namespace qduino::apps
