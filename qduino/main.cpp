// qduino: makes, builds, checks, simulates, traces and runs sketches, and looks after the computer
// that they run on. Without arguments it lists its commands (qduino/commands/).
#include "qduino/command_set.h"
#include "terminal/program.h"

int main(int argc, char** argv) {
    qduino::apps::keep_standard_descriptors();
    qduino::apps::CommandSet commands;
    return commands.run(argc, argv);
}
