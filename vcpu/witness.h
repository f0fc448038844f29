// A process that outlives the keeper of a VCPU, and puts away what a killed keeper leaves.
//
//   keeper ──fork──► witness: waits at a pipe that only the keeper holds
//     │ kill -9        └─► the pipe ends ──► asks the tree to end ──► kills what is left
//     ▼                                      ──► removes the groups and the promise
//
// Until then the tree stays in its group: its budget holds, whatever happens to the keeper. When
// the witness is killed as well, the next program that makes a VCPU puts all of it away
// (process_vcpu.h).
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

struct WitnessOrders {
    std::vector<std::string> groups;  ///< folders, that of `cpu` first
    std::string promise;              ///< the file
    int promise_descriptor = -1;      ///< inherited: the promise lasts as long as the witness
    bool ask = true;                  ///< SIGTERM to the tree; false: somebody else has asked it
    Nanoseconds grace{};              ///< for an orderly end
};

/// Starts the witness. It has no file of the keeper but the promise, takes no signal of the
/// terminal, and is no child of this process. It is dismissed, or called, by the end of the
/// result. From a process with one thread. Error: the system's.
[[nodiscard]] Result<posix::UniqueFd> post_witness(const WitnessOrders& orders);

}  // namespace qduino::apps
