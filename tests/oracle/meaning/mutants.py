"""Does the fuzz see what printers have got wrong? Plants one mistake at a time in the printer, builds printer-sim, and
counts the files until a difference is found. By hand, in a copy of the sources that nobody else uses:

    mutants.py "cmake --build --preset release --target printer-sim" [--only WORD] [--count 400] [--seed 1]

Each mistake is one that the printer has made, as a text that is found once in a file of the printer, and what stands
there instead. The twin is not changed: it may not be the one that sees it, nor be misled.
"""

import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import planted_mutants  # noqa: E402

FUZZ = pathlib.Path(__file__).with_name("meaning_fuzz.py")

LEFT = "planner_.set_settings(before.settings);\n", "accelerations_ = before.accelerations;\n", "compensation_.take(before.compensation);\n"
PIPE = "printer/machine/motion_pipe.cpp"
CONTEXT = "printer/gcode/context.cpp"

# name, file, what stands there and what is planted
MUTANTS = (
    ("circle: ends must be the same number", "printer/gcode/arc.h", (("kSamePlaceMm = 0.000'5", "kSamePlaceMm = 0"),)),
    ("exponent: read as the word E", "printer/gcode/lexer.cpp", (("number ? exponent_size(plain) : 0", "number ? 0 * exponent_size(plain) : 0"),)),
    (
        "lift: what stands behind an object that is left out is lost",
        CONTEXT,
        (("} else if (!objects.skipping()) {", "} else if (false) {"), ("QDUINO_TRY(rise_to(state.machine[Axis::z], state.feedrate));", "")),
    ),
    ("lift: the end asks for nothing", CONTEXT, (("Result<void> Context::settle() {\n", "Result<void> Context::settle() {\n    return {};\n"),)),
    ("lift: homing comes before the rest of the way up", "printer/machine/job_actions.cpp", (("::home(AxisSet axes) {\n    finish_rest();", "::home(AxisSet axes) {"),)),
    (
        "names: cut at 64 bytes",
        "printer/gcode/name_key.h",
        (("for (const char c : name) key.take(to_upper(c));", "for (const char c : name.substr(0, 64)) key.take(to_upper(c));"),),
    ),
    ("leftover: limits of speed", PIPE, ((LEFT[0], ""),)),
    ("leftover: acceleration", PIPE, ((LEFT[1], ""),)),
    ("leftover: pressure advance and shapers", PIPE, ((LEFT[2], ""),)),
    ("leftover: all of them", PIPE, tuple((each, "") for each in LEFT)),
)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--only", default="")
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program = planted_mutants.ROOT / "build/release/bin/printer-sim"
    fuzz = [sys.executable, "-B", FUZZ, program, "--count", options.count, "--seed", options.seed, "--first"]
    return 1 if planted_mutants.unseen_of(MUTANTS, options.build, fuzz, options.only) else 0


if __name__ == "__main__":
    sys.exit(main())
