// Contracts: a programmer's error stops the program, but the machine is made safe first.
//
// There are three kinds of failure (ARCHITECTURE.md, house rule 5); this file serves the first. An
// operating error is a Result (result.h). Hostile input is a Result with a position.
#pragma once

namespace qduino {

/// Called with the broken contract before the process aborts. It must not allocate or block: it may
/// run in a real-time loop. A board sets one that forces the outputs into their safe state.
using ContractHandler = void (*)(const char* condition, const char* file, int line);

/// Installs `handler` (null restores the default, which only prints) and returns the one before.
ContractHandler set_contract_handler(ContractHandler handler);

[[noreturn]] void contract_broken(const char* condition, const char* file, int line);

}  // namespace qduino

/// Checked in every build. Keep the condition cheap: it stands in real-time paths.
#define QDUINO_EXPECT(condition)                         \
    (static_cast<bool>(condition) ? static_cast<void>(0) \
                                  : ::qduino::contract_broken(#condition, __FILE__, __LINE__))
