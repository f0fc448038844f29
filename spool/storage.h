// What a spool keeps its jobs in: a store and the files that belong to it, and what they need done
// beside the printing. On a disk: disk/disk_storage.h. Without one: memory_storage.h.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "spool/files.h"
#include "spool/store.h"

namespace qduino::spool {

class Storage {
  public:
    /// What a person has to know of it.
    struct News {
        std::vector<std::string> log;
        std::string hold_reason;  ///< the queue has to be held, for this reason; empty: it need not
    };

    virtual ~Storage() = default;
    [[nodiscard]] virtual Store& store() = 0;
    [[nodiscard]] virtual Files& files() = 0;
    [[nodiscard]] const Files& files() const { return const_cast<Storage*>(this)->files(); }
    /// Once, before all else: what is there, put in order. Errors: as Store::load().
    [[nodiscard]] virtual Result<StoredState> load() = 0;
    /// The work of one tick. The spool's thread.
    virtual void keep(Instant) {}
    /// What has come up since the last call. The spool's thread.
    [[nodiscard]] virtual News take_news() { return {}; }

    /// False: without power all of it is gone.
    [[nodiscard]] virtual bool is_durable() const = 0;
    /// Why nothing that is taken now would be kept; empty: all is well. Any thread.
    [[nodiscard]] virtual std::string trouble() const { return {}; }
    /// Room for an upload. Errors: unavailable (it is full), internal. Any thread.
    [[nodiscard]] virtual Result<void> check_room() const { return {}; }
};

}  // namespace qduino::spool
