"""Prints random files whose meaning is known, and holds the steps against that meaning; the twin's verdict as well.

    meaning_fuzz.py PRINTER_SIM [--seconds S | --count N] [--seed K] [--keep FOLDER] [--first]

The printer and its twin read a file with readers of their own; where both misread it in the same way, the print
"matches". Here neither is asked. A generator makes a description and writes it as G-code (generator.py, writer.py), and
judge.py walks along the description with the steps that the pins saw. One line per difference, with the seed; the files
are kept with --keep. It ends with 0 only when there was none; --first ends it at the first one.
"""

import argparse
import json
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import campaign  # noqa: E402
import generator  # noqa: E402
import judge  # noqa: E402


class Trial:
    """One seed: the files, and what was found."""

    def __init__(self, seed, folder):
        self.random = random.Random(seed)
        self.seed = seed
        self.folder = folder
        self.file = folder / "meant.gcode"
        self.before = folder / "before.gcode"

    def write(self):
        self.print = generator.Print(self.random)
        self.file.write_bytes(self.print.text.encode())
        self.has_before = self.random.random() < 0.25
        if self.has_before:
            self.before.write_text(generator.job_before(self.random), encoding="ascii")

    def run(self, printer_sim):
        """None, or the difference in words."""
        steps, report = self.folder / "steps.csv", self.folder / "report.json"
        report.unlink(missing_ok=True)
        command = [printer_sim, self.file, "--steps", steps, "--report", report]
        if self.has_before:
            command += ["--before", self.before]
        ran = subprocess.run([str(each) for each in command], capture_output=True, text=True, check=False, timeout=300)
        if not report.exists():
            return "no report: " + (ran.stderr.strip().splitlines() or ["status %d" % ran.returncode])[-1]
        found = json.loads(report.read_text(encoding="utf-8"))
        if found["refused"]:
            return "refused: line %d, %s" % (found["refused"]["line"], found["refused"]["why"])
        if found["error"]:
            return "not completed: %s" % found["error"]
        wrong = judge.judge(judge.read_steps(steps), self.print.pieces)
        if wrong:
            return wrong + (" (and the twin says that it matches)" if found["matches"] else "")
        if not found["completed"]:
            return "right, and the twin says that not all of it was made"
        if not found["matches"]:
            return "right, and the twin says: " + "; ".join(found["differences"])[:300]
        return None


def keep(trial, where, said):
    where.mkdir(parents=True, exist_ok=True)
    (where / ("%d.gcode" % trial.seed)).write_bytes(trial.file.read_bytes())
    if trial.has_before:
        (where / ("%d.before.gcode" % trial.seed)).write_bytes(trial.before.read_bytes())
    (where / ("%d.txt" % trial.seed)).write_text(said + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("printer_sim")
    campaign.add_options(parser, count=40)
    options = parser.parse_args()
    tried = wrong = 0
    used = {}
    with tempfile.TemporaryDirectory() as folder:
        for seed in campaign.seeds(options):
            trial = Trial(seed, pathlib.Path(folder))
            trial.write()
            said = trial.run(options.printer_sim)
            tried += 1
            for each in trial.print.used + (["a job before"] if trial.has_before else []):
                used[each] = used.get(each, 0) + 1
            if said:
                wrong += 1
                print("seed %d: %s" % (trial.seed, said), flush=True)
                if options.keep:
                    keep(trial, options.keep, said)
                if options.first:
                    break
    print("%d files, %d differences; %s" % (tried, wrong, ", ".join("%s %d" % each for each in sorted(used.items()))))
    return 1 if wrong or not tried else 0


if __name__ == "__main__":
    sys.exit(main())
