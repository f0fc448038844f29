"""Does the fuzz see what sketches have met? Plants one mistake at a time in the Arduino face or in the way sketches are built, and
counts the sketches until a difference is found. By hand, in a copy of the sources that nobody else uses:

    mutants.py QDUINO [--build COMMAND] [--only WORD] [--without KINDS] [--count 30] [--seed 1]

COMMAND builds the board's own libraries where a mistake is in them (cmake --build --preset release --target qduino-sdk …).
"""

import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import planted_mutants  # noqa: E402

FUZZ = pathlib.Path(__file__).with_name("sketch_fuzz.py")
FORMATS = "arduino/core/formats.h"
NUMBERS = "arduino/core/numbers.h"
PROTOTYPES = "tools/ino/ino_to_cpp.py"
LONGS = "tools/ino/as_arduino.py"

MUTANTS = (
    ("constrain: its result has the first argument's type", NUMBERS, (("constexpr std::common_type_t<T, L, H> constrain", "constexpr T constrain"),)),
    ("formats: the C library's own, with 64 bits for %ld", FORMATS, (('#define QDUINO_FOR_SKETCH(name) __asm__("qduino_" #name)',
                                                                      "#define QDUINO_FOR_SKETCH(name)"),)),
    ("overloads: one prototype for a name is enough", PROTOTYPES, (("(f.name, f.parameters) in found.declared", "f.name in {name for name, _ in found.declared}"),)),
    ("int64_t: the system's own, which no sketch can spell", LONGS, (("for name in ('int64_t', 'int_least64_t', 'int_fast64_t'):", "for name in ():"),)),
)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("qduino")
    parser.add_argument("--build", default="")
    parser.add_argument("--only", default="")
    parser.add_argument("--without", default="(?!)")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    fuzz = [sys.executable, "-B", FUZZ, options.qduino, "--count", options.count, "--seed", options.seed, "--first", "--without", options.without]
    return 1 if planted_mutants.unseen_of(MUTANTS, options.build, fuzz, options.only) else 0


if __name__ == "__main__":
    sys.exit(main())
