"""Writes a set (sets.py): as the file that any_set.ino reads, as a sketch of its own, and its board file."""

import sets

QUIET_PIN = 100


def board_file(the_set):
    lines = ["[sim]", f"cores = {the_set.cores}", "poll_limit = 1000000000"]
    if the_set.tick_period:
        lines += [f'tick_period = "{the_set.tick_period} ns"', f'tick_cost = "{the_set.tick_cost} ns"']
    for name in ("wake_latency", "edge_interval"):
        if getattr(the_set, name):
            lines.append(f'{name} = "{getattr(the_set, name)} ns"')
    if the_set.edge_top:
        lines.append(f'edge_top_half = "{the_set.edge_top} ns"')
    if the_set.victim_pays:
        lines.append("charge_interrupts_to_victim = true")
    lines += ["", "[sim.costs]", f'pin_read = "{the_set.step_ns} ns"', f'analog_read = "{100 * the_set.step_ns} ns"']
    if the_set.switch:
        lines.append(f'context_switch = "{the_set.switch} ns"')
    for source in the_set.interrupts:
        lines += ["", "[[sim.interrupt]]", f'device = "{source.device}"', f"rate_hz = {1e9 / source.period!r}", 'arrival = "periodic"',
                  f"core = {source.core}", f'top_half = "{source.top} ns"']
        if source.bottom:
            lines.append(f'bottom_half = "{source.bottom} ns"')
        if source.start:
            lines.append(f'from = "{source.start} ns"')
    return "\n".join(lines) + "\n"


# ---- for any_set.ino -------------------------------------------------------------------------


def number(word):
    return sets.DEVICES.index(word) if word in sets.DEVICES else word


def script_line(script, locks):
    line = []
    for kind, *words in script:
        words = [locks.index(words[0])] if kind in "lu" else [number(word) for word in words]
        line += [kind, *(words + [0, 0, 0])[:3]]
    return " ".join(map(str, line))


def set_file(the_set):
    locks = sorted(the_set.locks)
    lines = [f"loop {loop.id} {loop.budget} {loop.period} {loop.core} {loop.sleep} {loop.sleeps}" for loop in the_set.loops]
    lines += [f"does loop {loop.id} {script_line(script, locks)}" for loop in the_set.loops for script in loop.scripts]
    lines += [f"does pin {edge.pin} {script_line(script, locks)}" for edge in the_set.edges for script in edge.scripts]
    lines += [f"serve {number(each.device)} {each.budget} {each.period} {each.core}" for each in the_set.services]
    lines += [f"edge {edge.pin} {edge.budget} {edge.period} {edge.core}" for edge in the_set.edges]
    for place, lock in enumerate(locks):
        lines.append(f"lock {lock}")
        lines += [f"held {place} {holder} {length}" for holder, length in the_set.locks[lock].items()]
    lines += [f"away {number(device)} {core}" for device, core in the_set.away]
    return "\n".join(lines) + "\n"


# ---- as a sketch -----------------------------------------------------------------------------


def duration(ns):
    for unit, length in (("ms", sets.MS), ("us", sets.US)):
        if ns % length == 0:
            return f"{ns // length}{unit}"
    return f"{ns}ns"


def statement(step, locks):
    kind, *words = step
    if kind in "lu":
        return f"lock{locks.index(words[0])}.{'lock' if kind == 'l' else 'unlock'}();"
    if kind in "ar":
        return f"{'noInterrupts' if kind == 'a' else 'interrupts'}({words[0].upper()}, {words[1]});"
    return {
        "c": lambda: f"compute({words[0]});",
        "s": lambda: f"delayUntil(timeNow() + {duration(words[0])});",
        "p": lambda: f"toggle({words[0]});",
        "b": lambda: f"interruptsVcpu({words[0].upper()}, {duration(words[1])}, {duration(words[2])});",
    }[kind]()


def body(scripts, locks):
    written = [" ".join(statement(step, locks) for step in script) for script in scripts]
    if len(written) == 1:
        return "  " + written[0]
    cases = [f"    case {turn}: {words} break;" for turn, words in enumerate(written)]
    return "\n".join(["  static unsigned turn = 0;", f"  switch (turn++ % {len(written)}) {{", *cases, "  }"])


def setup_lines(the_set):
    locks = sorted(the_set.locks)
    yield from (f"pinMode({edge.pin}, OUTPUT);" for edge in the_set.edges)
    for lock in locks:
        for holder, length in the_set.locks[lock].items():
            yield f"lock{locks.index(lock)}.heldBy({holder if holder > 0 else f'handler{-holder}'}, {duration(length)});"
    for each in the_set.services:
        yield f"interruptsVcpu({each.device.upper()}, {duration(each.budget)}, {duration(each.period)}, {each.core});"
    for edge in the_set.edges:
        if edge.budget:
            yield f"attachInterruptVcpu({edge.pin}, handler{edge.pin}, CHANGE, {duration(edge.budget)}, {duration(edge.period)}, {edge.core});"
        else:
            yield f"attachInterrupt({edge.pin}, handler{edge.pin}, CHANGE);"
    yield from (f"noInterrupts({device.upper()}, {core});" for device, core in the_set.away)


def sketch(the_set):
    """What a person would have written."""
    locks = sorted(the_set.locks)
    out = [f"Mutex lock{place};" for place in range(len(locks))]
    out += ["static void compute(int steps) {",
            "  for (int i = 0; i < steps / 100; i++) analogRead(A0);",
            f"  for (int i = 0; i < steps % 100; i++) digitalRead({QUIET_PIN});", "}"]
    if any(step[0] == "p" for script in sets.scripts_of(the_set) for step in script):
        out.append("static void toggle(int pin) { static bool level[128]; level[pin] = !level[pin]; digitalWrite(pin, level[pin]); }")
    for edge in the_set.edges:
        out += [f"static void handler{edge.pin}() {{", body(edge.scripts, locks), "}"]
    out += ["void setup() {", *("  " + line for line in setup_lines(the_set)), "}"]
    for loop in the_set.loops:
        words = [str(loop.id), duration(loop.budget), duration(loop.period)]
        if loop.core >= 0 or loop.sleep:
            words.append(str(loop.core))
        if loop.sleep:
            words.append(duration(loop.sleep))
        if loop.sleeps:
            words.append(str(loop.sleeps))
        out += [f"void loop({', '.join(words)}) {{", body(loop.scripts, locks), "  waitForNextPeriod();", "}"]
    return "\n".join(out) + "\n"
