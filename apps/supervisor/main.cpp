// qduino-supervisor: runs a sketch, outlives it, and forces its safe states when it dies or hangs.
#include "apps/supervisor/supervisor.h"

int main(int argc, char** argv) {
    qduino::supervisor::SystemCalls system;
    return qduino::supervisor::run_command_line(argc, argv, system);
}
