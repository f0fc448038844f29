// The first process of an emulated machine: makes a small system, runs the test as a child, and
// turns the machine off.
#pragma once

namespace qduino::emulated {

/// As process 1: mounts /proc, /sys, /dev, /run and cgroups, loads /modules/*.ko in order of name
/// (parameters in the file beside it, NAME.options), runs `test` in a child, prints "emulated: test
/// ended with N", turns the machine off and does not return. As any other process: returns what
/// `test` returns.
int run_as_init(int (*test)());

}  // namespace qduino::emulated
