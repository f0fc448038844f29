#include "tests/emulated/guest/guest_init.h"

#include <fcntl.h>
#include <sys/mount.h>
#include <sys/reboot.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace qduino::emulated {
namespace {

void mount_at(const char* type, const char* folder) {
    ::mkdir(folder, 0755);
    if (::mount(type, folder, type, 0, nullptr) != 0 && errno != EBUSY)
        std::printf("emulated: no %s at %s: %s\n", type, folder, std::strerror(errno));
}

/// Without a console in the archive the kernel starts init with no open files.
void open_console() {
    const int console = ::open("/dev/console", O_RDWR);
    for (int fd = 0; fd < 3 && console >= 0; ++fd) {
        if (console != fd) ::dup2(console, fd);
    }
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
}

void load_modules() {
    std::vector<std::string> modules;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator{"/modules", error}) {
        if (entry.path().extension() == ".ko") modules.push_back(entry.path().string());
    }
    std::sort(modules.begin(), modules.end());
    for (const std::string& module : modules) {
        std::string options;
        std::getline(std::ifstream{module.substr(0, module.size() - 3) + ".options"}, options);
        const int file = ::open(module.c_str(), O_RDONLY | O_CLOEXEC);
        if (::syscall(SYS_finit_module, file, options.c_str(), 0) != 0)
            std::printf("emulated: %s does not load: %s\n", module.c_str(), std::strerror(errno));
        ::close(file);
    }
}

int run_child(int (*test)()) {
    const pid_t child = ::fork();
    if (child == 0) {
        const int result = test();
        std::fflush(nullptr);
        ::_exit(result);
    }
    int status = 0;
    for (;;) {  // an init also buries the orphans
        const pid_t ended = ::wait(&status);
        if (ended == child || (ended < 0 && errno != EINTR)) break;
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

int run_as_init(int (*test)()) {
    if (::getpid() != 1) return test();
    mount_at("devtmpfs", "/dev");
    open_console();
    mount_at("proc", "/proc");
    mount_at("sysfs", "/sys");
    mount_at("tmpfs", "/run");
    mount_at("cgroup2", "/sys/fs/cgroup");
    mount_at("debugfs", "/sys/kernel/debug");
    load_modules();
    std::printf("emulated: test ended with %d\n", run_child(test));
    ::sync();
    ::reboot(RB_POWER_OFF);
    for (;;) ::pause();
}

}  // namespace qduino::emulated
