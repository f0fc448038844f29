// virtual-machine: the printer that is not there, wired to the Linux board's virtual pins.
#include <fcntl.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/virtual_machine/virtual_machine.h"
#include "board/linux/kernel/clock.h"
#include "config/machine_file.h"
#include "config/twin_machine.h"
#include "posix/unique_fd.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

namespace {

constexpr qduino::apps::Fail fail{"virtual-machine: "};

/// Longer than a supervisor takes to stop a sketch.
constexpr qduino::Nanoseconds kStayAtMost = std::chrono::seconds{10};

/// A real machine is always there; this one asks for a good place in the queue. It is a request.
/// `fifo` 0: only a better nice value.
void be_prompt(int fifo) {
    if (fifo > 0) {
        sched_param parameters{};
        parameters.sched_priority = fifo;
        if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return;
    }
    ::setpriority(PRIO_PROCESS, 0, -10);
}

/// A real machine outlives its sketch. Asked to stop, this one stays while a process of the
/// sketch's side holds `lock_file` (apps/launcher), to see its last edges. Not for ever: such a
/// process may hang.
void outlive_sketch(qduino::apps::VirtualMachine& machine, const std::string& lock_file) {
    using qduino::board::linux::monotonic_now;
    const qduino::posix::UniqueFd lock{::open(lock_file.c_str(), O_RDWR | O_CLOEXEC)};
    const qduino::Instant until = monotonic_now() + kStayAtMost;
    while (lock.valid() && monotonic_now() < until && ::flock(lock.get(), LOCK_EX | LOCK_NB) != 0)
        machine.pass();
}

/// Edges that the twin never saw, or saw too late, spoil its verdict: said at the end.
void report_lost_edges(const qduino::board::linux::PinsFaults& faults) {
    if (faults.lost + faults.disordered + faults.malformed == 0) return;
    fail(qduino::text("pin edges lost ", faults.lost, ", out of order ", faults.disordered, ", malformed ",
                      faults.malformed));
}

/// The last report on what is hot, for a test that asks after this machine has ended.
void report_heat(const qduino::twin::PrinterState& state) {
    const std::array<const char*, qduino::twin::kHeaterCount> names{"hot end", "bed"};
    for (std::size_t i = 0; i < names.size(); ++i) {
        const double since_s = qduino::to_seconds(state.heater_off_since[i].time_since_epoch());
        if (state.heater_duty[i] > 0) {
            std::printf("virtual-machine: %s left ON\n", names[i]);
        } else if (since_s > 0) {
            std::printf("virtual-machine: %s off since %.6f s\n", names[i], since_s);
        }
    }
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    using namespace qduino;
    apps::CommandLine line{
        "Plays the printer behind the Linux board's virtual pins: motors, switches, heaters, converter. It "
        "outlives the sketch, watches what is built, and tells on its socket.\n"
        "Example: virtual-machine --pins /dev/shm/qduino-pins --inspect /run/inspect.sock"};
    apps::VirtualMachineOptions options;
    std::string machine_file, kept_file;
    std::string sketch_lock;
    std::vector<std::string> faults;
    int fifo = 20;  // above all ordinary load, below every loop
    line.option("--pins", options.pins, "file of the virtual pins to make, on a tmpfs").required();
    line.option("--inspect", options.inspect, "unix socket to answer questions on");
    line.flag("--own-clock", options.own_clock,
              "the sketch is in an emulated machine, with a clock of its own (docs/metal.md)");
    line.option("--machine", machine_file, "machine file (TOML); default: the reference machine");
    line.option("--kept", kept_file, "file of what M500 keeps: the beds that a job may name");
    line.option("--fault", faults,
                "KIND[:WHERE][@SECONDS], such as sensor_stuck:hot_end@120; may be repeated");
    line.option("--fifo", fifo,
                "run at this SCHED_FIFO priority where that is permitted; 0: as an ordinary process")
        .shows_default()
        .within(0, 98);
    line.option("--stay-while-locked", sketch_lock,
                "asked to stop, stay while somebody holds a lock on this file (10 s at most)");
    if (const auto status = line.parse(argc, argv)) return *status;

    const auto config = apps::read_machine_files(machine_file, kept_file);
    if (!config) return fail(config.error());
    const auto parsed = apps::parse_faults(faults);
    if (!parsed) return fail(parsed.error());
    // Without a file the twin keeps its own numbers, which check the sketch's (twin/machine.h).
    const auto metal = apps::read_twin_machine("", machine_file, *config);
    if (!metal) return fail(metal.error());
    options.machine = *metal;
    options.faults = *parsed;
    const auto machine = apps::VirtualMachine::create(options);
    if (!machine) return fail(machine.error());
    apps::stop_on_signals();
    be_prompt(fifo);
    std::printf("virtual-machine: pins at %s%s%s\n", options.pins.c_str(),
                options.inspect.empty() ? "" : ", inspector at ", options.inspect.c_str());
    std::fflush(stdout);
    while (!apps::stop_asked()) machine.value()->pass();
    outlive_sketch(**machine, sketch_lock);
    report_heat((*machine)->state());
    report_lost_edges(machine.value()->pins_faults());
    ::unlink(options.pins.c_str());  // tmpfs is memory; who still has the pins mapped keeps them
    return 0;
}
