// Another computer with `qduino` on it, reached by ssh. Nothing of this project listens there: its
// sshd does, and says who may.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "qduino/common/words.h"

namespace qduino::apps {

/// The command that runs `qduino` with these words on `host`. ssh is $QDUINO_SSH, which may have
/// options. What `./install` put into a home folder is found there as well.
[[nodiscard]] Words remote_qduino(const std::string& host, const Words& words);

/// Runs remote_qduino() with what `folder` has, as a tar, on its standard input. Returns the status
/// of `qduino` there. Error: ssh could not connect.
[[nodiscard]] Result<int> send_folder(const std::string& host, const std::filesystem::path& folder,
                                      const Words& words);

/// Runs remote_qduino() on this terminal. Returns as send_folder().
[[nodiscard]] Result<int> run_remote(const std::string& host, const Words& words);

}  // namespace qduino::apps
