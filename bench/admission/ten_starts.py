#!/usr/bin/env python3
"""Is admission steady? Starts each of four sketches, U 0.50 to 0.70, again and again on this computer, and compares verdicts and R.

    bench/admission/ten_starts.py [--qduino build/release/bin/qduino] [--starts 10] [--seconds 2] [--fresh]

The difficulty: what interrupts take of a core differs from second to second, and R has it (board/linux/computer/interference.h). Run it as root, on a
computer that does what it usually does. `--fresh` forgets first what is remembered of interrupts, as after a boot. It ends with 0 when each sketch had
one verdict, and each R differed by a tenth at most, against the first start's.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
REMEMBERED = "/run/qduino"

# Loops: budget and period in us.
SKETCHES = {
    "U = 0.50": ((1000, 10000), (10000, 50000), (20000, 100000)),
    "U = 0.63": ((1500, 10000), (14000, 50000), (20000, 100000)),
    "U = 0.70": ((2000, 10000), (15000, 50000), (20000, 100000)),
    "U = 0.50, short": ((200, 1000), (600, 2000)),
}


def sketch(loops):
    words = "TIME_UNIT(us);\nvoid setup() {}\n"
    for number, (budget, period) in enumerate(loops, 1):
        words += f"void loop({number}, {budget}, {period}, 0) {{ delayBusyMicroseconds({budget * 2 // 3}); waitForNextPeriod(); }}\n"
    return words


def start(qduino, place, seconds, environment):
    """{loop: R in us}; None: refused; and what was said of interrupts."""
    done = subprocess.run([qduino, "run", place, "--for", str(seconds)], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False,
                          env=environment)
    said = done.stdout + done.stderr
    counted = re.search(r"interrupts counted as (.*?),", said)
    scale = {"ns": 1e-3, "us": 1.0, "ms": 1e3, "s": 1e6}
    found = {int(loop): float(value) * scale[unit]
             for loop, value, unit in re.findall(r"^  loop (\d+) +R ([0-9.]+) (ns|us|ms|s) of T", said, re.M)}
    refused = "refused" in said
    if not refused and not found:
        raise SystemExit(f"neither admitted nor refused:\n{said[-2000:]}")
    return (None if refused else found), counted.group(1) if counted else "not said"


def main():
    line = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    line.add_argument("--qduino", default=ROOT / "build/release/bin/qduino", type=pathlib.Path)
    line.add_argument("--starts", type=int, default=10)
    line.add_argument("--seconds", type=float, default=2)
    line.add_argument("--fresh", action="store_true")
    options = line.parse_args()
    if options.fresh:
        for file in pathlib.Path(REMEMBERED).glob("qduino-interrupts.*"):
            file.unlink()
    environment = {name: value for name, value in os.environ.items() if name != "QDUINO_INTERRUPTS"}
    steady = True
    with tempfile.TemporaryDirectory() as folder:
        places = {}
        for name, loops in SKETCHES.items():
            places[name] = pathlib.Path(folder) / f"starts{len(places)}.ino"
            places[name].write_text(sketch(loops), encoding="utf-8")
        found = {name: [] for name in SKETCHES}
        for number in range(1, options.starts + 1):
            for name, place in places.items():
                responses, counted = start(options.qduino.resolve(), place, options.seconds, environment)
                found[name].append(responses)
                words = "refused" if responses is None else ", ".join(f"R{loop} {value / 1000:.3f} ms" for loop, value in sorted(responses.items()))
                print(f"start {number:2}, {name}: {words}; interrupts {counted}", flush=True)
    for name, starts in found.items():
        admitted = [each for each in starts if each is not None]
        spread = max((abs(each[loop] / admitted[0][loop] - 1) for each in admitted for loop in each), default=0)
        one_verdict = len(admitted) in (0, len(starts))
        steady = steady and one_verdict and spread <= 0.1
        print(f"{name}: admitted {len(admitted)} of {len(starts)}, R within {100 * spread:.1f} %")
    return 0 if steady else 1


if __name__ == "__main__":
    sys.exit(main())
