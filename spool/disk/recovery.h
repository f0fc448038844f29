// Makes jobs out of their files again, when the journal has lost them in whole or in part.
//
//   blobs/SHA.gcode + SHA.job  ─► do the bytes match their name? ─► analyzed anew
//                              ─► a held job with the name and number of the upload
//
// Every upload that the journal does not know becomes a job. Nothing prints by itself: each of them
// is held.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "base/result.h"
#include "spool/analyzer.h"
#include "spool/disk/blob_store.h"
#include "spool/store.h"

namespace qduino::spool {

struct Recovered {
    std::size_t jobs = 0;   ///< made
    std::size_t known = 0;  ///< blobs whose jobs were there
    /// Blobs that make no job: damaged, or refused by the analyzer; they are in set-aside/.
    std::size_t left = 0;
    std::size_t forgotten = 0;  ///< rows whose files are gone: their jobs had been deleted
};

/// Called after each blob: how many of how many, and what became of it.
using RecoveryProgress = std::function<void(std::size_t done, std::size_t total, const std::string& words)>;

/// Goes through blobs/ and set-aside/. `analyzer` may be null: the jobs then have no facts. The
/// journal counts as whole afterwards. After a kill at any point it may be done again. No other
/// process may use the folder meanwhile. Errors: unavailable, internal.
[[nodiscard]] Result<Recovered> recover_jobs(Store& store, BlobStore& blobs, Analyzer* analyzer,
                                             const RecoveryProgress& progress);

/// `printd --recover`: opens the journal of DIR, or sets it aside when it cannot be opened, and
/// recovers. `log` receives lines for people.
[[nodiscard]] Result<Recovered> recover_folder(const std::filesystem::path& folder, Analyzer& analyzer,
                                               UnixSeconds now_s,
                                               const std::function<void(const std::string&)>& log);

}  // namespace qduino::spool
