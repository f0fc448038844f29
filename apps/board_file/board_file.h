// Board files: one TOML file says what a machine is, for the simulator ([sim]) and for Linux ([linux],
// [[gpio]] …). docs/board-file.md lists every key.
//
//   board.toml ──► parse_board() ──► BoardFile{sim, linux} ──► `qduino sim`, `check`, `trace` take sim
//                                                          └─► `qduino run` takes linux
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "board/linux/linux_config.h"
#include "board/sim/config.h"

namespace qduino::apps {

struct BoardFile {
    board::sim::SimConfig sim;
    board::linux::LinuxConfig linux;
};

/// A board file as read: the board, or why not. (The text is longer than an Error's may be: it lists what is
/// accepted.)
struct ReadBoardFile {
    BoardFile board;
    std::string error;  ///< "FILE:LINE: [table] 'key' …; accepted: …"; empty: none
    [[nodiscard]] bool ok() const { return error.empty(); }
};

/// What the file leaves out keeps its default. Errors: the file cannot be read, a syntax error, an unknown
/// key, a value of the wrong kind or outside its range, rules between keys.
[[nodiscard]] ReadBoardFile read_board_file(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages.
[[nodiscard]] ReadBoardFile parse_board(std::string_view text, std::string_view name);

/// Why a machine of `config.cores` cores cannot be as the rest of `config` says; empty when it can. For who
/// changes the number of cores of a board that was read from a file.
[[nodiscard]] std::string why_cores_do_not_fit(const board::sim::SimConfig& config);

}  // namespace qduino::apps
