// The key in its file, and random tokens, by libsodium. After sodium_init().
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace qduino::web {

/// 32 random bytes as base64url, kTokenLength characters.
[[nodiscard]] std::string random_token();

/// The key in `file`, made (mode 0600) when there is none. Errors: not_permitted (others may read
/// it), internal, corrupt.
[[nodiscard]] Result<std::string> load_or_make_key(const std::filesystem::path& file);

}  // namespace qduino::web
