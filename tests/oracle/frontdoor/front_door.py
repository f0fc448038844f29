"""Random sets through the front door: `qduino check`, and what it admits, `qduino sim`. A scheduler of our own counts beside it.

    front_door.py QDUINO [--sets N | --seconds S] [--seed K] [--jobs J] [--written W] [--keep FOLDER] [--having FEATURE]…
    front_door.py QDUINO --show SEED        one set, as a sketch and a board file
    front_door.py QDUINO --again FILE       a set that was kept, once more

The difficulty is the compiler: a sketch takes seconds, and ten thousand are to be tried in a night. So one sketch
(any_set.ino) is compiled once and reads its set through the declarations that every sketch has; W sets are written out as
sketches and must give the same verdict and the same run.

A finding is a set of which every loop keeps what it declares, and
    late        a release of an admitted loop ended after the next was due, in the simulator or by judge.py;
    beyond R    it ended later than R after it was due (where nothing was changed at run time);
    differ      simulator and judge do not agree on some begin or end, to the nanosecond;
    written     the same set as a sketch of its own was judged or ran otherwise;
    failed      a program failed.
It is shrunk (minimise.py) and printed. The last line counts. It ends with 0 only when nothing was found. Whether it would find what it is there
for: mutants.py.
"""

import argparse
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time

import generator
import judge
import minimise
import writer



@dataclasses.dataclass
class Verdict:
    admitted: bool
    report: dict
    certificate: dict
    failed: str = ""


@dataclasses.dataclass
class Run:
    releases: dict
    handlers: dict
    answers: dict
    verdict: str
    table: list
    failed: str = ""


class FrontDoor:
    """qduino, as a person runs it, in a folder of its own."""

    ANY_SET = pathlib.Path(__file__).resolve().parent / "any_set"

    def __init__(self, program, folder):
        self.program = program
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.environment = dict(os.environ, LC_ALL="C.UTF-8", FRONT_DOOR_SET=str(self.folder / "set"), FRONT_DOOR_LOG=str(self.folder / "log"))
        for name in ("QDUINO_HOME", "CXX", "CC", "CXXFLAGS", "CFLAGS", "LDFLAGS"):
            self.environment.pop(name, None)

    def call(self, *arguments):
        return subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=300,
                              check=False)

    def write(self, the_set):
        (self.folder / "set").write_text(writer.set_file(the_set), encoding="utf-8")
        (self.folder / "board.toml").write_text(writer.board_file(the_set), encoding="utf-8")

    def check(self, the_set, sketch=ANY_SET):
        self.write(the_set)
        certificate = self.folder / "certificate.json"
        done = self.call("check", sketch, "--board", "board.toml", "--json", "--certificate", certificate)
        if done.returncode not in (0, 2):
            return Verdict(False, {}, {}, f"check ended with {done.returncode}: {done.stderr[-400:]}")
        report = json.loads(done.stdout)
        if report["admitted"] != (done.returncode == 0):
            return Verdict(False, {}, {}, "check's status is not its verdict")
        return Verdict(report["admitted"], report, json.loads(certificate.read_text(encoding="utf-8")) if report["admitted"] else {})

    def run(self, the_set, sketch=ANY_SET, *options):
        self.write(the_set)
        done = self.call("sim", sketch, "--board", "board.toml", "--for", the_set.length / 1e9, "--plain", *options)
        run = Run({loop.id: [] for loop in the_set.loops}, {edge.pin: [] for edge in the_set.edges}, {}, "", [])
        if done.returncode != 0:
            run.failed = f"sim ended with {done.returncode}: {done.stderr[-400:]}"
            return run
        verdicts = re.findall(r"Verdict: \S+: (.*)", done.stderr)
        run.verdict = verdicts[-1] if verdicts else ""
        run.table = re.findall(r"^ +\d+ .*$", done.stderr, re.M)
        if sketch == self.ANY_SET:
            self.read_log(run)
        return run

    def read_log(self, run):
        for line in (self.folder / "log").read_text(encoding="utf-8").splitlines():
            kind, number, *times = line.split()
            if kind == "c":
                run.answers.setdefault(int(number), []).append(times[0] == "1")
            else:
                (run.releases if kind == "r" else run.handlers)[int(number)].append(tuple(map(int, times)))


# ---- one set ---------------------------------------------------------------------------------


def judged(the_set, verdict, answers):
    cores = {each["id"]: each["core"] for each in (*verdict.report["loops"], *verdict.report["io"])}
    deferrable = {loop["id"] for core in verdict.certificate["cores"] for loop in core["loops"] if loop["deferrable"]}
    interrupts = {core["core"]: [(each["cost_ns"], each["interval_ns"], each["jitter_ns"]) for each in core["interferers"]]
                  + [(io["edge_ns"], io["edge_interval_ns"], 0) for io in core["ios"] if io["edge_ns"]] for core in verdict.certificate["cores"]}
    return judge.World(the_set, cores, deferrable, answers, interrupts).run(the_set.length)


def difference(of_simulator, of_judge, end, name):
    """The first one before the end of the run."""
    for place in range(max(len(of_simulator), len(of_judge))):
        seen = of_simulator[place] if place < len(of_simulator) else None
        own = of_judge[place] if place < len(of_judge) else None
        if seen == own or min(times[1] for times in (seen, own) if times) >= end:
            continue
        return f"{name}, run {place + 1}: {seen} in the simulator, {own} by the judge (begin, end)"
    return None


def first_difference(the_set, run, world):
    for number, releases in world.releases.items():
        found = difference(run.releases[number], [(one.begin, one.end) for one in releases], the_set.length, f"loop {number}")
        if found:
            return found
    for pin, runs in world.runs.items():
        found = difference(run.handlers[pin], runs, the_set.length, f"handler of pin {pin}")
        if found:
            return found
    return None


def overruns(table):
    return {int(line.split()[0]): int(line.split()[3]) for line in table}


def first_late(the_set, run, world):
    for loop in the_set.loops:
        seen, own = overruns(run.table).get(loop.id, 0), world.late[loop.id]
        if not seen and not own:
            continue
        worst = max((one for one in world.releases[loop.id] if one.end > one.nominal + loop.period), key=lambda one: one.end - one.nominal, default=None)
        where = f"; by up to {worst.end - worst.nominal - loop.period} ns, the release of {worst.nominal} ns" if worst else ""
        return f"loop {loop.id} late {seen} times in the simulator, {own} by the judge, of {len(world.releases[loop.id])}{where}"
    return None


def first_beyond(the_set, verdict, run, world):
    """R holds where nothing was changed since, in the simulator and by the judge."""
    if any(any(answers) for answers in run.answers.values()):
        return None
    periods = {loop.id: loop.period for loop in the_set.loops}
    for loop in verdict.report["loops"]:
        of_simulator = run.releases[loop["id"]]
        for place, one in enumerate(world.releases[loop["id"]]):
            begin, end = of_simulator[place] if place < len(of_simulator) else (one.begin, one.end)
            same = one.nominal <= begin < one.nominal + periods[loop["id"]]  # else they differ: first_difference() says that
            took = (max(end, one.end) if same else one.end) - one.nominal
            if took > loop["response_ns"]:
                return f"loop {loop['id']}: the release of {one.nominal} ns took {took} ns, R is {loop['response_ns']} ns"
    return None


@dataclasses.dataclass
class Finding:
    kind: str
    words: str


def look(door, the_set, verdict=None):
    """What is wrong with an admitted set; None: nothing, or it is refused."""
    verdict = verdict or door.check(the_set)
    if verdict.failed:
        return Finding("failed", verdict.failed)
    if not verdict.admitted:
        return None
    run = door.run(the_set)
    if run.failed:
        return Finding("failed", run.failed)
    world = judged(the_set, verdict, run.answers)
    for kind, words in (("late", first_late(the_set, run, world)), ("beyond R", first_beyond(the_set, verdict, run, world)),
                        ("differ", first_difference(the_set, run, world))):
        if words:
            return Finding(kind, words)
    return None


def at_the_edge(door, the_set, steps):
    """The set with as much to compute as is admitted, found by `steps` halvings or more, and its verdict: there a hole shows. First of all cores
    together, then of each."""
    verdict = door.check(the_set)
    best, found = (the_set, verdict) if verdict.admitted else (None, verdict)
    together = [None] if the_set.tight is None else []
    steps = max(steps, the_set.halvings)
    one_by_one = [] if the_set.cores == 1 else range(the_set.cores) if the_set.tight is None else the_set.tight
    for core in (*together, *one_by_one) if not verdict.failed else ():
        low, high = (1.0, 2.0) if best else (0.1, 1.0)
        origin = best or the_set
        for _ in range(steps):
            middle = (low + high) / 2
            trial = generator.scaled(origin, middle, core)
            verdict = door.check(trial) if trial else None
            if verdict and verdict.failed:
                return trial, verdict
            if verdict and verdict.admitted:
                low, best, found = middle, trial, verdict
            else:
                high = middle
    return best or the_set, found


def written_otherwise(door, the_set, verdict):
    """The same set as a sketch that is compiled."""
    place = door.folder / "written" / "written.ino"
    place.parent.mkdir(exist_ok=True)
    place.write_text(writer.sketch(the_set), encoding="utf-8")
    own = door.check(the_set, place)
    if own.failed:
        return own.failed
    for key in ("admitted", "cores", "io", "overheads"):
        if own.report[key] != verdict.report[key]:
            return f"{key}: {own.report[key]}, and {verdict.report[key]} by any_set"
    for mine, others in zip(own.report["loops"], verdict.report["loops"]):
        if any(mine[key] != others[key] for key in ("id", "core", "budget_ns", "period_ns", "response_ns", "meets")):
            return f"{mine}, and {others} by any_set"
    if not own.admitted:
        return None
    mine, others = door.run(the_set, place), door.run(the_set)
    if mine.failed or others.failed:
        return mine.failed or others.failed
    return None if (mine.verdict, mine.table) == (others.verdict, others.table) else f"ran as\n{mine.verdict}\n{mine.table}, and by any_set\n{others.table}"


# ---- many sets -------------------------------------------------------------------------------


@dataclasses.dataclass
class Outcome:
    seed: int
    admitted: bool
    releases: int
    finding: object
    the_set: object
    written: bool


def try_seed(program, folder, seed, edge_steps, write_out):
    door = FrontDoor(program, pathlib.Path(folder) / str(os.getpid()))
    the_set, verdict = at_the_edge(door, generator.random_set(random.Random(seed)), edge_steps)
    finding = Finding("failed", verdict.failed) if verdict.failed else look(door, the_set, verdict) if verdict.admitted else None
    if not finding and write_out:
        words = written_otherwise(door, the_set, verdict)
        finding = Finding("written", words) if words else None
    releases = sum(the_set.length // loop.period for loop in the_set.loops)
    return Outcome(seed, verdict.admitted, releases if verdict.admitted else 0, finding, the_set, write_out)


def describe(door, the_set, finding):
    """Sketch, board file and what happened before the first miss, for a person."""
    out = [f"{finding.kind}: {finding.words}", "---- sketch.ino", writer.sketch(the_set), "---- board.toml", writer.board_file(the_set)]
    if finding.kind != "failed":
        out += ["---- the trace before it", minimise.trace_before(door, the_set, finding.words)]
    return "\n".join(out)


def tell(arguments, folder, outcome):
    door = FrontDoor(arguments.qduino, pathlib.Path(folder) / "minimise")
    print(f"seed {outcome.seed}: {outcome.finding.kind}: {outcome.finding.words}", flush=True)
    the_set, finding = outcome.the_set, outcome.finding
    if finding.kind in ("late", "beyond R", "differ"):
        the_set, finding = minimise.least(the_set, finding, lambda trial: look(door, trial), arguments.patience)
    words = describe(door, the_set, finding)
    print(f"the least set of that kind:\n{words}", flush=True)
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
        (arguments.keep / f"{outcome.seed}.txt").write_text(words, encoding="utf-8")
        (arguments.keep / f"{outcome.seed}.json").write_text(minimise.to_json(the_set), encoding="utf-8")


def seeds_to_try(arguments):
    """Each with whether it is to be written out. Sets without a feature that is asked for are passed over, and do not count."""
    begin = time.monotonic()
    place, seed = 0, arguments.seed
    while place < arguments.sets if not arguments.seconds else time.monotonic() < begin + arguments.seconds:
        the_set = generator.random_set(random.Random(seed)) if arguments.having else None
        if all(generator.FEATURES[name](the_set) for name in arguments.having):
            yield seed, place < arguments.written
            place += 1
        seed += 1


def run_many(arguments, folder):
    counts = dict.fromkeys(("sets", "admitted", "releases", "late", "beyond R", "differ", "written", "failed"), 0)
    written = 0
    # Compiled once, before the jobs look for it.
    FrontDoor(arguments.qduino, pathlib.Path(folder) / "first").check(generator.random_set(random.Random(0)))
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
        waiting = set()
        seeds = seeds_to_try(arguments)
        more = True
        while more or waiting:
            while more and len(waiting) < 2 * arguments.jobs:
                seed, write_out = next(seeds, (None, False))
                more = seed is not None
                if more:
                    waiting.add(pool.submit(try_seed, arguments.qduino, folder, seed, arguments.edge, write_out))
            done, waiting = concurrent.futures.wait(waiting, return_when=concurrent.futures.FIRST_COMPLETED)
            for outcome in (future.result() for future in done):
                counts["sets"] += 1
                counts["admitted"] += outcome.admitted
                counts["releases"] += outcome.releases
                written += outcome.written
                if outcome.finding and outcome.finding.kind in arguments.kinds:
                    counts[outcome.finding.kind] += 1
                    tell(arguments, folder, outcome)
                    more = more and sum(counts[kind] for kind in KINDS) < arguments.most
    return counts, written


KINDS = ("late", "beyond R", "differ", "written", "failed")


def main():
    line = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    line.add_argument("qduino")
    line.add_argument("--sets", type=int, default=200)
    line.add_argument("--seconds", type=float, default=0, help="instead of a number of sets")
    line.add_argument("--seed", type=int, default=1, help="of the first set; the others count on")
    line.add_argument("--jobs", type=int, default=1)
    line.add_argument("--edge", type=int, default=3, help="halvings on the way to the most that is admitted")
    line.add_argument("--written", type=int, default=1, help="so many sets also as sketches of their own")
    line.add_argument("--patience", type=float, default=60, help="seconds for the shrinking of a finding")
    line.add_argument("--most", type=int, default=5, help="findings before it stops")
    line.add_argument("--keep", type=pathlib.Path, help="folder for findings")
    line.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, help="what counts as a finding")
    line.add_argument("--having", nargs="+", choices=sorted(generator.FEATURES), default=[], help="what each set has")
    line.add_argument("--show", type=int)
    line.add_argument("--again", type=pathlib.Path)
    arguments = line.parse_args()
    arguments.qduino = str(pathlib.Path(arguments.qduino).resolve())
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault("XDG_CACHE_HOME", str(pathlib.Path(folder) / "cache"))
        door = FrontDoor(arguments.qduino, pathlib.Path(folder) / "one")
        if arguments.show is not None:
            the_set, _ = at_the_edge(door, generator.random_set(random.Random(arguments.show)), arguments.edge)
            print(writer.sketch(the_set) + "\n" + writer.board_file(the_set))
            return 0
        if arguments.again:
            the_set = minimise.from_json(arguments.again.read_text(encoding="utf-8"))
            finding = look(door, the_set)
            print(describe(door, the_set, finding) if finding else "nothing is wrong with it")
            return 1 if finding else 0
        counts, written = run_many(arguments, folder)
    found = sum(counts[kind] for kind in KINDS)
    print(f"front door: {counts['sets']} sets, {counts['admitted']} admitted with {counts['releases']} releases, {written} written out; "
          + ", ".join(f"{counts[kind]} {kind}" for kind in KINDS))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
