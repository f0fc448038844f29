// A sketch with a heater on, that comes to the end that its second argument names.
//
//   pin 3  digital, driven high, safe low
//   pin 4  PWM at 0.5, safe low
//   pin 5  driven low, safe high
//   pin 6  driven high, no safe state: must stay high
//   with a third argument, the prefix of /sys:
//   pin 7  channel 2 of pwmchip0 at 0.5, safe low
//   pin 8  channel 3, driven low, safe high
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "base/contract.h"
#include "board/linux/linux_board.h"

using namespace qduino;
using board::Level;
using board::PinId;
using board::PinMode;
using board::linux::LinuxBoard;

namespace {

LinuxBoard* g_board = nullptr;
std::string g_end;
constexpr PinId kReady{10};  // goes high when all is as the head says
constexpr PinId kDeaf{11};   // goes high when it hears SIGTERM no more

[[noreturn]] void spin_for_ever() {
    static volatile bool for_ever = true;
    while (for_ever) {
    }
    std::abort();
}

/// Uses up the stack, in a way that the optimiser cannot see through. Returns only at a depth that
/// no stack has.
int descend(int depth) {
    std::array<volatile char, 16384> page;
    page[0] = static_cast<char>(depth);
    if (depth == 1'000'000) return 0;
    return descend(depth + 1) + page[0];
}

void come_to_the_end() {
    if (g_end == "segv") {
        void* hole = ::mmap(nullptr, 4096, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        *static_cast<volatile int*>(hole) = 1;
    }
    if (g_end == "overflow") std::_Exit(descend(0));
    if (g_end == "contract") QDUINO_EXPECT(g_end.empty());
    if (g_end == "exit") std::_Exit(7);
    if (g_end == "hang") spin_for_ever();
    if (g_end == "deaf") {  // promises on, but does not hear SIGTERM
        ::signal(SIGTERM, SIG_IGN);
        g_board->pin_write(kDeaf, Level::high);
    }
}

void loop_body(void*) {
    for (int release = 0; !g_board->stop_requested(); ++release) {
        if (release == 5) g_board->pin_write(kReady, Level::high);
        if (release == 20) come_to_the_end();
        g_board->note_release(g_board->now());
        g_board->sleep_until(g_board->now() + 5ms);
    }
}

void heartless_body(void*) {
    while (!g_board->stop_requested()) {
        g_board->note_release(g_board->now());
        g_board->sleep_until(g_board->now() + 5ms);
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3 && argc != 4) return 2;
    g_end = argv[2];
    board::linux::LinuxConfig config;
    config.pins_path = argv[1];
    // The pins are the matter here; no test hangs a core of the machine at real-time priority.
    config.real_time = false;
    config.heartbeat_bound = 50ms;
    if (argc == 4) {
        config.sysfs_root = argv[3];
        config.pwm = {{PinId{7}, 0, 2}, {PinId{8}, 0, 3}};
    }
    auto opened = LinuxBoard::open(config);
    if (!opened) return std::fprintf(stderr, "%s\n", opened.error().message.view().data()), 1;
    g_board = opened->get();
    bool well = true;
    for (const int pin : {3, 5, 6, 10, 11})
        well &= g_board->pin_mode(PinId{static_cast<std::uint16_t>(pin)}, PinMode::output).ok();
    g_board->pin_write(PinId{3}, Level::high);
    well &= g_board->pwm_write(PinId{4}, 0.5).ok();
    g_board->pin_write(PinId{6}, Level::high);
    well &= g_board->safe_state(PinId{3}, Level::low).ok() &&
            g_board->safe_state(PinId{4}, Level::low).ok() && g_board->safe_state(PinId{5}, Level::high).ok();
    if (argc == 4) {
        well &= g_board->safe_state(PinId{7}, Level::low).ok() &&
                g_board->safe_state(PinId{8}, Level::high).ok() && g_board->pwm_write(PinId{7}, 0.5).ok() &&
                g_board->pin_mode(PinId{8}, PinMode::output).ok();
    }
    board::VcpuSpec first;
    first.id = 1;
    first.budget = 4ms;
    first.period = 10ms;
    first.core = 0;
    first.entry = loop_body;
    board::VcpuSpec second = first;
    second.id = 2;
    second.entry = heartless_body;
    if (!well || !g_board->start(std::array{first, second}).ok()) return 1;
    g_board->run(kForever);
    return 0;
}
