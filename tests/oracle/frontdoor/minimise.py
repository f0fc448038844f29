"""Shrinks a finding to the least set that still shows its kind, and says what happened before it."""

import dataclasses
import json
import re
import time

import sets


def to_json(the_set):
    return json.dumps(dataclasses.asdict(the_set), indent=1)


def from_json(text):
    read = json.loads(text)
    steps = lambda actor: {**actor, "scripts": [[tuple(step) for step in script] for script in actor["scripts"]]}  # noqa: E731
    read["loops"] = [sets.Loop(**steps(loop)) for loop in read["loops"]]
    read["edges"] = [sets.Edge(**steps(edge)) for edge in read["edges"]]
    read["services"] = [sets.Service(**service) for service in read["services"]]
    read["interrupts"] = [sets.Interrupt(**source) for source in read["interrupts"]]
    read["locks"] = {int(lock): {int(loop): length for loop, length in held.items()} for lock, held in read["locks"].items()}
    read["away"] = [tuple(pair) for pair in read["away"]]
    return sets.Set(**read)


# ---- smaller sets, the greatest steps first --------------------------------------------------


def without(the_set, kind, place):
    trial = the_set.copy()
    gone = getattr(trial, kind).pop(place)
    if kind == "loops":
        for held in trial.locks.values():
            held.pop(gone.id, None)
    if kind == "edges":
        for held in trial.locks.values():
            held.pop(-gone.pin, None)
        drop_steps(trial, lambda step: step[0] == "p" and step[1] == gone.pin)
    if kind == "services":
        drop_steps(trial, lambda step: step[0] == "b" and step[1] == gone.device)
    return trial


def drop_steps(the_set, unwanted):
    for script in sets.scripts_of(the_set):
        script[:] = [step for step in script if not unwanted(step)]


def without_lock(the_set, lock):
    trial = the_set.copy()
    del trial.locks[lock]
    drop_steps(trial, lambda step: step[0] in "lu" and step[1] == lock)
    return trial


def without_core(the_set, core):
    """Whatever is on it goes to core 0 of those that are left."""
    trial = the_set.copy()
    trial.cores -= 1

    def moved(number):
        return 0 if number == core else number - (number > core)

    for place in (*trial.loops, *trial.edges, *trial.services, *trial.interrupts):
        place.core = moved(place.core)
    trial.away = [(device, moved(number)) for device, number in trial.away]
    for script in sets.scripts_of(trial):
        script[:] = [(*step[:2], moved(step[2])) if step[0] in "ar" else step for step in script]
    return trial


def with_value(the_set, kind, place, name, value):
    trial = the_set.copy()
    setattr(getattr(trial, kind)[place] if kind else trial, name, value)
    return trial


def dropped(the_set):
    for kind in ("loops", "edges", "services", "interrupts", "away"):
        yield from (without(the_set, kind, place) for place in range(len(getattr(the_set, kind))))
    yield from (without_lock(the_set, lock) for lock in the_set.locks)
    for name in ("switch", "tick_period", "wake_latency", "edge_top", "victim_pays"):
        if getattr(the_set, name):
            yield with_value(the_set, "", name=name, place=0, value=type(getattr(the_set, name))(0))
    yield from (without_core(the_set, core) for core in range(the_set.cores if the_set.cores > 1 else 0))
    for kind in ("a", "r", "b"):
        if any(step[0] == kind for script in sets.scripts_of(the_set) for step in script):
            trial = the_set.copy()
            drop_steps(trial, lambda step, kind=kind: step[0] == kind)
            yield trial


def simpler(the_set):
    for kind in ("loops", "edges"):
        for place, actor in enumerate(getattr(the_set, kind)):
            for turn in range(len(actor.scripts) if len(actor.scripts) > 1 else 0):
                yield with_value(the_set, kind, place, "scripts", actor.scripts[:turn] + actor.scripts[turn + 1 :])
    for place, loop in enumerate(the_set.loops):
        if loop.sleep:
            trial = with_value(the_set, "loops", place, "sleep", 0)
            trial.loops[place].sleeps = 0
            trial.loops[place].scripts = [[step for step in script if step[0] != "s"] for script in loop.scripts]
            yield trial
        for turn, script in enumerate(loop.scripts):
            for number, step in enumerate(script):
                if step[0] in "cpsarb":
                    trial = the_set.copy()
                    del trial.loops[place].scripts[turn][number]
                    yield trial
    for place, source in enumerate(the_set.interrupts):
        if source.bottom:
            yield with_value(the_set, "interrupts", place, "bottom", 0)
        if source.start:
            yield with_value(the_set, "interrupts", place, "start", 0)


def rounder(number):
    """Near values that a person can read."""
    for unit in (10 * sets.MS, sets.MS, 100 * sets.US, 10 * sets.US, sets.US):
        for value in (number // unit * unit, -(-number // unit) * unit):
            if value > 0 and value != number and number % unit:
                yield value


def rounded(the_set):
    for kind, names in (("loops", ("period", "budget", "sleep")), ("edges", ("period", "budget")), ("services", ("period", "budget")),
                        ("interrupts", ("period", "top", "bottom", "start"))):
        for place, each in enumerate(getattr(the_set, kind)):
            for name in names:
                yield from (with_value(the_set, kind, place, name, value) for value in rounder(getattr(each, name)))
    for name in ("switch", "tick_period", "tick_cost", "wake_latency", "edge_top", "edge_interval"):
        yield from (with_value(the_set, "", 0, name, value) for value in rounder(getattr(the_set, name)))
    for lock, held in the_set.locks.items():
        for loop, length in held.items():
            for value in rounder(length):
                trial = the_set.copy()
                trial.locks[lock][loop] = value
                yield trial
    for place, loop in enumerate(the_set.loops):
        for turn, script in enumerate(loop.scripts):
            for number, step in enumerate(script):
                values = [step[1] // unit * unit for unit in (1000, 100, 10) if step[1] % unit and step[1] > unit] if step[0] == "c" else []
                values += list(rounder(step[1])) if step[0] == "s" else []
                for value in values:
                    trial = the_set.copy()
                    trial.loops[place].scripts[turn][number] = (step[0], value)
                    yield trial


def least(the_set, finding, look, patience):
    """`look` says what is wrong with a set. Greedy: whatever is smaller and still shows it is taken, and all is tried anew."""
    until = time.monotonic() + patience
    for ways in (dropped, simpler, dropped, rounded, simpler):
        smaller = True
        while smaller and time.monotonic() < until:
            smaller = False
            for trial in ways(the_set):
                if time.monotonic() >= until:
                    break
                if not sets.is_honest(trial):
                    continue
                found = look(trial)
                if found and found.kind == finding.kind:
                    the_set, finding, smaller = trial, found, True
                    break
    return the_set, finding


# ---- what happened ---------------------------------------------------------------------------


def trace_before(door, the_set, words):
    """The simulator's events of the release that the finding names, or of the last ones before an instant that it names."""
    instants = [int(number) for number in re.findall(r"\b(\d{4,})\b", words)]
    named = re.search(r"release of (\d+) ns", words)
    begin = int(named[1]) if named else max((min(instants) if instants else 0) - 20 * sets.MS, 0)
    longest = max(loop.period for loop in the_set.loops)
    path = door.folder / "trace.json"
    path.unlink(missing_ok=True)
    door.write(the_set)
    done = door.call("trace", door.ANY_SET, "--board", "board.toml", "--for", the_set.length / 1e9, "-o", path)
    if not path.exists():
        return f"there is none: {done.stderr[-300:]}"
    events = json.loads(path.read_text(encoding="utf-8"))
    events = events["traceEvents"] if isinstance(events, dict) else events
    lines = []
    for event in events:
        at = event.get("ts")
        if at is None or not begin - longest <= at * 1000 <= begin + longest:
            continue
        length = f" for {event['dur']:.3f} us" if "dur" in event else ""
        lines.append(f"{at:14.3f} us  core {event.get('pid')}  {event.get('name')}{length}")
    return "\n".join(lines[-60:])
