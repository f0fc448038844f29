// Where an uploaded sketch lives on a computer: one for each user, as a board has one program.
//
//   ~/.local/state/qduino/board/      $XDG_STATE_HOME/qduino/board
//     lock       held by the sketch's keeper, the supervisor and the sketch
//     keeper     the keeper's process, and the sketch's name
//     serial     a socket: Serial of the sketch, for any number of monitors
//     log        what the supervisor and the sketch's report said
//     report     the guarantee report: written when the sketch has been admitted
//     incoming/  the sketch that was sent here last
//     port-ID    a link to the serial port of the board ID, while an IDE 1.8 runs
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

class BoardFolder {
  public:
    /// This user's, by the environment; made when missing. Error: there is none, or no right to
    /// make it.
    static Result<BoardFolder> open();
    explicit BoardFolder(std::filesystem::path path) : path_(std::move(path)) {}

    [[nodiscard]] std::filesystem::path lock() const { return path_ / "lock"; }
    [[nodiscard]] std::filesystem::path keeper() const { return path_ / "keeper"; }
    [[nodiscard]] std::filesystem::path serial() const { return path_ / "serial"; }
    [[nodiscard]] std::filesystem::path log() const { return path_ / "log"; }
    [[nodiscard]] std::filesystem::path report() const { return path_ / "report"; }
    [[nodiscard]] std::filesystem::path incoming() const { return path_ / "incoming"; }
    [[nodiscard]] std::filesystem::path serial_port(const std::string& board) const {
        return path_ / ("port-" + board);
    }

    struct Running {
        pid_t keeper = 0;
        std::string sketch;
    };
    /// The sketch that runs here; nothing: none does.
    [[nodiscard]] std::optional<Running> running() const;
    /// Ends the sketch that runs here, through its safe states, and waits for that. Returns its
    /// name; empty: none ran. Error: it does not end.
    [[nodiscard]] Result<std::string> stop() const;
    /// Connects to Serial of the sketch that runs here. Error: not_found, none does.
    [[nodiscard]] Result<posix::UniqueFd> connect() const;

  private:
    std::filesystem::path path_;
};

}  // namespace qduino::apps
