#include "arduino/core/loops.h"

#include <algorithm>

#include "arduino/core/diagnostics.h"
#include "base/fixed_vector.h"
#include "board/board.h"

namespace qduino::arduino {

namespace {

void (*sketch_setup)() = nullptr;
constinit FixedVector<void (*)(), 8> early_actions;
void (*classic_loop)() = nullptr;
bool in_setup = false;
void (*classic_serial_event)() = nullptr;

void run_classic_loop() {
    classic_loop();
    if (classic_serial_event) run_serial_event(classic_serial_event);
}

/// What the constructors of static objects asked of a board that was not there yet comes first.
void run_setup() {
    board::hand_over_early_pins([](board::PinId pin, const Error& error) {
        report_error("a pin that a static object set", pin.number, error);
    });
    for (void (*const action)() : early_actions) action();
    in_setup = true;
    if (sketch_setup) sketch_setup();
    in_setup = false;
}

int lowest_free_id() {
    const auto& loops = runtime::sketch_table().loops;
    int id = 1;
    while (std::any_of(loops.begin(), loops.end(), [&](const auto& declared) { return declared.id == id; }))
        ++id;
    return id;
}

}  // namespace

void before_setup(void (*action)()) {
    if (std::ranges::find(early_actions, action) == early_actions.end()) early_actions.push_back(action);
}

LoopRegistration::LoopRegistration(int id, Nanoseconds budget, Nanoseconds period, int core,
                                   Nanoseconds sleep, int sleeps, void (*body)(), const char* file,
                                   int line) {
    runtime::SketchTable& table = runtime::sketch_table();
    runtime::LoopDeclaration declaration;
    declaration.id = static_cast<board::VcpuId>(id);
    declaration.budget = budget;
    declaration.period = period;
    declaration.core = core;
    declaration.suspension = sleep;
    declaration.sleeps = sleeps == 0 ? 1 : sleeps;
    declaration.says_sleeps = sleeps != 0;
    declaration.deferrable = sleep > Nanoseconds{0};
    declaration.body = body;
    declaration.file = file;
    declaration.line = line;
    if (!table.loops.try_push_back(declaration)) ++table.dropped;
}

board::VcpuId enter_loop_of_setup(Nanoseconds budget, Nanoseconds period, void (*body)(), const char* name) {
    runtime::SketchTable& table = runtime::sketch_table();
    const int id = lowest_free_id();
    if (!in_setup || id > board::kMaxLoop) return 0;
    LoopRegistration(id, budget, period, runtime::kAnyCore, Nanoseconds{0}, 0, body, name, 0);
    table.loops.back().deferrable = true;
    return static_cast<board::VcpuId>(id);
}

SketchRegistration::SketchRegistration(void (*setup)(), void (*loop)(), void (*serial_event)(),
                                       const char* file) {
    sketch_setup = setup;
    runtime::sketch_table().setup = &run_setup;
    if (!loop) return;
    classic_loop = loop;
    classic_serial_event = serial_event;
    const int id = lowest_free_id();
    LoopRegistration(id, kClassicLoopBudget, kClassicLoopPeriod, runtime::kAnyCore, Nanoseconds{0}, 0,
                     &run_classic_loop, file, 0);
    for (runtime::LoopDeclaration& declared : runtime::sketch_table().loops)
        declared.classic |= declared.body == &run_classic_loop;
}

}  // namespace qduino::arduino
