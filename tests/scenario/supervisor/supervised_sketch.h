// The doomed sketch under qduino-supervisor, on the pins of a running machine, for the tests that
// look at the pins afterwards.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <map>
#include <new>

#include "printer/link/layout.h"
#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test {

/// The state of the doomed sketch's pins as the machine saw them last; −1: never seen.
struct LastSeen {
    std::map<std::uint16_t, double> level;
    std::map<std::uint16_t, double> duty;
};

inline LastSeen last_seen(const RecordingMachine& machine) {
    LastSeen last;
    for (const Seen& event : machine.seen) (event.pwm ? last.duty : last.level)[event.pin] = event.value;
    return last;
}

inline void expect_safe(const RecordingMachine& machine) {
    const LastSeen last = last_seen(machine);
    EXPECT_EQ(last.level.at(3), 0.0);
    EXPECT_EQ(last.duty.at(4), 0.0);
    EXPECT_EQ(last.level.at(4), 0.0);
    EXPECT_EQ(last.level.at(5), 1.0);
    EXPECT_EQ(last.level.at(6), 1.0);
}

/// qduino-supervisor over the doomed sketch, on the pins of a running machine.
class SupervisedSketch {
  public:
    /// `supervisor`: the program and what precedes its options. `sysfs_root`: the sketch has PWM
    /// channels there.
    explicit SupervisedSketch(const std::string& end, std::vector<std::string> more = {},
                              std::vector<std::string> words = {SUPERVISOR},
                              const std::string& sysfs_root = "")
        : running_(file_.path()) {
        words.insert(words.end(), {"--pins", file_.path(), "--timeout-ms", "1000"});
        words.insert(words.end(), more.begin(), more.end());
        if (!sysfs_root.empty()) words.insert(words.end(), {"--sysfs-root", sysfs_root});
        words.insert(words.end(), {"--", DOOMED_SKETCH, file_.path(), end});
        if (!sysfs_root.empty()) words.push_back(sysfs_root);
        std::vector<char*> arguments;
        for (auto& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        const pid_t test = ::getpid();
        supervisor_ = ::fork();
        if (supervisor_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGTERM);
            if (::getppid() != test) ::_exit(126);
            ::execv(arguments[0], arguments.data());
            ::_exit(126);
        }
    }
    ~SupervisedSketch() {
        if (supervisor_ > 0 && !ended_) {
            ::kill(supervisor_, SIGTERM);
            ::waitpid(supervisor_, nullptr, 0);
        }
    }
    SupervisedSketch(const SupervisedSketch&) = delete;
    SupervisedSketch& operator=(const SupervisedSketch&) = delete;

    /// Waits until the sketch has set all its pins and runs its loops, beside a heat watch that can
    /// be told by its name (or until the sketch has come to its end already).
    void wait_until_running() {
        wait_for_pin(10);
        wait_for("the heat watch", [&] { return heat_watch() > 0 || gone(); });
    }
    void wait_for_pin(std::size_t pin) {
        while (layout().outputs[pin].level.load() == 0 && !gone()) std::this_thread::sleep_for(1ms);
    }
    /// Never to process 0, which would be this test and its relatives.
    void signal_sketch(int number) {
        const pid_t pid = sketch();
        ASSERT_GT(pid, 0) << "the sketch did not come up";
        ::kill(pid, number);
    }
    [[nodiscard]] pid_t sketch() { return static_cast<pid_t>(layout().sketch_pid.load()); }
    [[nodiscard]] pid_t supervisor() const { return supervisor_; }
    [[nodiscard]] PinsLayout& layout() { return running_.server().layout(); }

    /// Waits until `condition` holds, and says after `limit` what did not come.
    static void wait_for(const char* what, const std::function<bool()>& condition, Nanoseconds limit = 30s) {
        const Instant give_up = monotonic_now() + limit;
        while (!condition()) {
            ASSERT_LT(monotonic_now(), give_up) << what << " does not come";
            std::this_thread::sleep_for(1ms);
        }
    }
    /// All heaters are off as another process sees it: the latches of pins 3 and 4.
    [[nodiscard]] bool heat_is_off() {
        return layout().outputs[3].level.load() == 0 && layout().outputs[4].pwm.load() == 0 &&
               layout().outputs[4].level.load() == 0;
    }
    /// The supervisor's heat watch; 0: there is none now.
    [[nodiscard]] pid_t heat_watch() const {
        const std::string self = std::to_string(supervisor_);
        std::ifstream children{"/proc/" + self + "/task/" + self + "/children"};
        for (pid_t child = 0; children >> child;) {
            std::string name;
            std::getline(std::ifstream{"/proc/" + std::to_string(child) + "/comm"}, name);
            if (name == "heat-watch") return child;
        }
        return 0;
    }
    /// Ends it without asking.
    void kill_supervisor() { ::kill(supervisor_, SIGKILL); }

    /// Waits for the supervisor's end; then the machine's record is final. The status as a shell
    /// would see it.
    int finish() {
        int status = 0;
        ::waitpid(supervisor_, &status, 0);
        ended_ = true;
        running_.stop();
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    [[nodiscard]] const RecordingMachine& machine() const { return running_.machine; }
    [[nodiscard]] SketchDeath death() { return running_.server().sketch_death(); }

    /// The supervisor has ended.
    [[nodiscard]] bool gone() const {
        siginfo_t info{};
        return ::waitid(P_PID, static_cast<id_t>(supervisor_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               info.si_pid != 0;
    }

  private:
    TemporaryPins file_;
    RunningMachine running_;
    pid_t supervisor_ = -1;
    bool ended_ = false;
};

/// A link file as a sketch makes it, of the process `owner`.
class TemporaryLink {
  public:
    explicit TemporaryLink(std::uint32_t owner) {
        using printer::link::LinkLayout;
        const int fd = ::open(file_.path().c_str(), O_RDWR | O_CREAT, 0600);
        EXPECT_EQ(::ftruncate(fd, sizeof(LinkLayout)), 0);
        void* memory = ::mmap(nullptr, sizeof(LinkLayout), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        ::close(fd);
        layout_ = new (memory) LinkLayout;
        layout_->version = printer::link::kVersion;
        layout_->size = sizeof(LinkLayout);
        layout_->session = 1;
        layout_->sketch_pid = owner;
        layout_->magic.store(printer::link::kMagic);
    }
    ~TemporaryLink() { ::munmap(layout_, sizeof *layout_); }
    TemporaryLink(const TemporaryLink&) = delete;
    TemporaryLink& operator=(const TemporaryLink&) = delete;
    [[nodiscard]] const std::string& path() const { return file_.path(); }
    [[nodiscard]] std::uint32_t dead() const { return layout_->sketch_dead.load(); }
    /// Empty as long as it is not there.
    [[nodiscard]] std::string note() const {
        return layout_->death_note_ready.load() != 0 ? layout_->death_note.data() : "";
    }

  private:
    TemporaryPins file_;
    printer::link::LinkLayout* layout_ = nullptr;
};

}  // namespace qduino::board::linux::test
