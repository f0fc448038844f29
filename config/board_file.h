// Board files: one TOML file describes a computer and its wiring, for the simulator ([sim]) and for
// Linux ([linux], [[gpio]] …). docs/board-file.md lists every key.
//
//   board.toml ──► parse_board() ──► BoardFile{sim, linux} ──► `qduino sim`, `check`, `trace`: sim
//                                                          └─► `qduino run`: linux
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "board/linux/kernel/linux_config.h"
#include "board/sim/config.h"
#include "config/part_list.h"

namespace qduino::apps {

struct BoardFile {
    board::sim::SimConfig sim;
    board::linux::LinuxConfig linux;
    std::vector<PartSpec> parts;  ///< wired to the simulated board
};

/// The board of a file, or the error. (The text may be longer than an Error's: it lists what is
/// accepted.)
struct ReadBoardFile {
    BoardFile board;
    std::string error;  ///< "FILE:LINE: [table] 'key' …; accepted: …"; empty: none
    [[nodiscard]] bool ok() const { return error.empty(); }
};

/// Reads a file. Keys that it leaves out keep their defaults. Errors: the file cannot be read, a
/// syntax error, an unknown key, a value of the wrong kind or outside its range, a broken rule
/// between keys.
[[nodiscard]] ReadBoardFile read_board_file(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages.
[[nodiscard]] ReadBoardFile parse_board(std::string_view text, std::string_view name);

/// Why `config.cores` cores do not fit the rest of `config`; empty when they do. For a caller that
/// changes the number of cores of a board that was read from a file.
[[nodiscard]] std::string why_cores_do_not_fit(const board::sim::SimConfig& config);

}  // namespace qduino::apps
