// Gives the spool the link to the machine. Mapping shared memory is the application's work.
#pragma once

#include "printer/link/layout.h"

namespace qduino::spool {

class LinkSource {
  public:
    virtual ~LinkSource() = default;
    /// The link in use; null when there is none. The same until reopen().
    [[nodiscard]] virtual printer::link::LinkLayout* current() = 0;
    /// True when current() is no longer the newest link: the sketch was started anew, or for the
    /// first time.
    [[nodiscard]] virtual bool is_replaced() = 0;
    /// Moves to the newest link, if there is one. The pointer from current() becomes invalid.
    virtual void reopen() = 0;
};

}  // namespace qduino::spool
