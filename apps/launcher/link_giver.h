// Makes the link between sketch and service, and hands it to both. Needed where they are different
// users: the service may write into the link, and must not be able to cut it off under the sketch.
//
//   make_anew()      before each start of the sketch: sealed memory, all zeros
//   in its process   inherits it as descriptor kDescriptor
//   look()           the sketch has completed it: from now on it is given out
//   serve()          DIR/link, a socket: who connects is given a descriptor of his own
//
// The socket has a new inode for each run, as a link file would (link/link_file.h). The object
// of a dead sketch is given out until the next one has completed its own: the service reads in it
// how that died.
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

class LinkGiver {
  public:
    /// The descriptor's number in the sketch's process. High: no library takes it.
    static constexpr int kDescriptor = 200;

    LinkGiver() = default;
    /// `socket`: where it is asked for, in a folder of this process's user whose group may connect.
    explicit LinkGiver(std::filesystem::path socket) : path_(std::move(socket)) {}

    [[nodiscard]] Result<void> make_anew();
    /// In the sketch's process, before it becomes the program.
    void pass_on() const;
    /// True once the sketch has completed the object that was made last.
    [[nodiscard]] bool look();
    /// Answers those who wait. Does not wait itself.
    void serve() const;

  private:
    std::filesystem::path path_;
    posix::UniqueFd made_, given_out_, listener_;
};

}  // namespace qduino::launcher
