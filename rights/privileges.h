// One service for each state folder, with no more rights than it needs.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::rights {

/// Takes an advisory lock on DIR/lock that dies with its holder; makes the folder (mode 0700) where
/// there is none. Errors: already_exists (another service runs), not_permitted, internal.
[[nodiscard]] Result<posix::UniqueFd> lock_state(const std::filesystem::path& folder);

/// From root to `user`, for good: groups, ids, and no way back. The state folder becomes the user's
/// first (state_folder.h). Before any thread is started. Errors: not_permitted (not root; the
/// folder holds what is not the printer's), not_found (no such user), internal.
/// `last_as_root` is called before, when the user is known: it may hide where users are looked up.
[[nodiscard]] Result<void> become(const std::string& user, const std::filesystem::path& state,
                                  const std::function<void()>& last_as_root = {});

/// The name of the folder's owner; empty: root's, or an owner without a name.
[[nodiscard]] std::string owner_of(const std::filesystem::path& folder);

}  // namespace qduino::rights
