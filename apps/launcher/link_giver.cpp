#include "apps/launcher/link_giver.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>

#include "link/link_file.h"
#include "posix/local_socket.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::launcher {

using posix::UniqueFd;

namespace {

constexpr int kWaiting = 16;

}  // namespace

Result<void> LinkGiver::make_anew() {
    QDUINO_TRY_ASSIGN(made_, apps::make_sealed_link());
    return {};
}

void LinkGiver::pass_on() const {
    // The copy stays open in the program.
    if (made_.valid()) ::dup2(made_.get(), kDescriptor);
}

bool LinkGiver::look() {
    if (!made_.valid()) return given_out_.valid();
    if (!apps::is_complete_link(made_.get())) return false;
    const std::filesystem::path beside = path_.native() + ".new";
    auto listener = posix::listen_local(beside, kWaiting);
    if (!listener) return false;
    posix::give_to_owner_of_folder(beside);
    if (::rename(beside.c_str(), path_.c_str()) != 0) return false;
    listener_ = std::move(*listener);
    given_out_ = std::move(made_);
    return true;
}

void LinkGiver::serve() const {
    for (int i = 0; i < kWaiting && listener_.valid(); ++i) {
        const UniqueFd asker{::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
        if (!asker.valid()) return;
        // Opened anew: a lock of flock(2) belongs to the opening, and there is one service.
        const UniqueFd own{::open(apps::inherited_link(given_out_.get()).c_str(), O_RDWR | O_CLOEXEC)};
        if (own.valid()) static_cast<void>(posix::send_descriptor(asker.get(), own.get()));
    }
}

}  // namespace qduino::launcher
