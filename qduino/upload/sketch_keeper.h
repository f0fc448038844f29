// Keeps an uploaded sketch running when its user has gone, and hands its Serial on.
//
//   qduino upload ── fork ──► keeper ── pipes ──► supervisor ── sketch
//        ▲  admitted, or ended    │
//        └────────────────────────┤ serial_hub.h
//   qduino monitor ◄── socket ────┘
//
// The keeper ends when the sketch has ended. SIGTERM asks it to end the sketch.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/result.h"
#include "board/linux/kernel/memory_folder.h"
#include "qduino/common/words.h"
#include "qduino/upload/board_folder.h"

namespace qduino::apps {

/// Makes the command that runs the sketch; what it needs in memory lies in the folder, and goes
/// with the keeper.
using CommandMaker = std::function<Result<Words>(board::linux::MemoryFolder&)>;

/// Starts a keeper, and waits until the sketch has been admitted or has ended; what it says until
/// then goes to stderr. Returns its exit status when it has ended; nothing: it runs. The command
/// writes its report to `board.report()`. Error: another sketch runs here, the system's.
[[nodiscard]] Result<std::optional<int>> start_kept(const BoardFolder& board, const std::string& name,
                                                    const CommandMaker& command);

}  // namespace qduino::apps
