#include "apps/launcher/service_user.h"

#include <pwd.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <vector>

#include "terminal/message.h"

namespace qduino::launcher {
namespace {

/// What the known tools want to hear, the most widespread first.
const std::array<std::vector<const char*>, 3> kCommands{{
    {"/usr/sbin/useradd", "--system", "--user-group", "--no-create-home", "--home-dir", "/nonexistent",
     "--shell", "/usr/sbin/nologin", kServiceUser},
    {"/usr/sbin/adduser", "--system", "--group", "--no-create-home", "--home", "/nonexistent", kServiceUser},
    {"/usr/bin/systemd-sysusers", "--inline", "u qduino-printer - \"QduinoMC print service\""},
}};

/// It ended with 0. With an environment of its own: root's may name other folders of programs.
bool runs_well(std::vector<const char*> command) {
    command.push_back(nullptr);
    std::array<const char*, 3> environment{"PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C", nullptr};
    pid_t child = -1;
    if (::posix_spawn(&child, command[0], nullptr, nullptr, const_cast<char* const*>(command.data()),
                      const_cast<char* const*>(environment.data())) != 0)
        return false;
    int status = -1;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::optional<ServiceUser> user_of(const std::string& name) {
    const passwd* const found = ::getpwnam(name.c_str());
    return found ? std::optional{ServiceUser{found->pw_uid, found->pw_gid}} : std::nullopt;
}

}  // namespace

Result<ServiceUser> find_or_make_user(const std::string& name) {
    std::optional<ServiceUser> user = user_of(name);
    for (auto command = kCommands.begin(); !user && name == kServiceUser && ::geteuid() == 0; ++command) {
        if (command == kCommands.end()) break;
        if (::access((*command)[0], X_OK) != 0 || !runs_well(*command)) continue;
        user = user_of(name);
        if (user) apps::say("made the system user " + name + " for the print service", "run: ");
    }
    if (!user)
        return make_error(ErrorCode::not_found, "there is no user ", name,
                          " for the print service: make one (useradd --system --user-group ", name,
                          "), or name another with --run-as");
    if (user->user == 0)
        return make_error(ErrorCode::not_permitted, "--run-as ", name,
                          ": the print service does not run as root");
    return *user;
}

}  // namespace qduino::launcher
