"""A set: a simulated computer, loops, locks, bottom halves, interrupts, and what each release does. Everything else here
works on this description: generator.py makes one, writer.py writes it as a sketch and a board file, judge.py schedules it,
minimise.py shrinks it.

Time is in whole nanoseconds. A script is what one release of a loop (or one run of a handler) does, a list of steps:

    ("c", n)                        computes n · step_ns
    ("l", k)  ("u", k)              takes lock k, gives it back
    ("s", ns)                       sleeps
    ("p", pin)                      changes the level of a pin
    ("a", device, core)             routes the device's interrupts away from the core
    ("r", device, core)             … and back
    ("b", device, budget, period)   gives the device's I/O VCPU another budget

Loops and handlers have several scripts and take them in turn. A handler takes locks as a loop does, and never sleeps.
"""

import copy
import dataclasses

DEVICES = ("gpio", "i2c", "spi", "uart", "nic", "disk")
MS = 1_000_000
US = 1_000


@dataclasses.dataclass
class Loop:
    id: int
    budget: int
    period: int
    core: int  # -1: wherever it fits
    sleep: int
    scripts: list
    sleeps: int = 0  # in so many pieces; 0: it does not say, and sleeps once


@dataclasses.dataclass
class Edge:
    """A handler. Without a budget it runs on the I/O VCPU of the class GPIO."""

    pin: int
    budget: int
    period: int
    core: int
    scripts: list


@dataclasses.dataclass
class Service:
    """The I/O VCPU of a device class."""

    device: str
    budget: int
    period: int
    core: int


@dataclasses.dataclass
class Interrupt:
    device: str
    period: int
    core: int
    top: int
    bottom: int
    start: int


@dataclasses.dataclass
class Set:
    cores: int = 1
    step_ns: int = 10 * US
    switch: int = 0
    tick_period: int = 0
    tick_cost: int = 0
    wake_latency: int = 0  # how late a sleeper wakes
    edge_top: int = 0  # what each edge takes above every loop
    edge_interval: int = 0  # and how close two of a pin come; one that comes sooner is held back
    victim_pays: bool = False  # the budget of whom an interrupt stops pays for it
    loops: list = dataclasses.field(default_factory=list)
    locks: dict = dataclasses.field(default_factory=dict)  # number → {loop, or −pin of a handler: length}; empty: it says nothing
    services: list = dataclasses.field(default_factory=list)
    edges: list = dataclasses.field(default_factory=list)
    interrupts: list = dataclasses.field(default_factory=list)
    away: list = dataclasses.field(default_factory=list)  # (device, core): routed away in setup()
    length: int = 1000 * MS  # of the run
    tight: list = None  # cores that are to be loaded up to what is admitted; None: all
    halvings: int = 0  # on the way there, at the least

    def copy(self):
        return copy.deepcopy(self)


def scripts_of(the_set):
    return [script for actor in (*the_set.loops, *the_set.edges) for script in actor.scripts]


def changes(the_set):
    return any(step[0] in "arb" for script in scripts_of(the_set) for step in script)


def one_release_changes(the_set, *kinds):
    """Changes of all these kinds, of different devices, in one release."""
    return any(set(kinds) <= {step[0] for step in script} and len({step[1] for step in script if step[0] in kinds}) > 1
               for script in scripts_of(the_set))


def handlers_take_locks(the_set):
    return any(holder < 0 for held in the_set.locks.values() for holder in held)


def sections(script, step_ns):
    """For how long the script holds each lock. None: it does not pair them well, or takes one twice."""
    held, lengths = [], {}
    for step in script:
        if step[0] == "l":
            # In rising order: no two loops wait for each other.
            if step[1] in lengths or (held and held[-1] >= step[1]):
                return None
            held.append(step[1])
            lengths[step[1]] = 0
        elif step[0] == "u":
            if not held or held.pop() != step[1]:
                return None
        elif step[0] == "s" and held:
            return None
        elif step[0] == "c":
            for lock in held:
                lengths[lock] += step[1] * step_ns
    return None if held else lengths


def computes(script, step_ns):
    return sum(step[1] for step in script if step[0] == "c") * step_ns


def sleeps(script):
    return sum(step[1] for step in script if step[0] == "s")


def is_honest(the_set):
    """Every loop keeps what it declares, and nothing is asked of what is not there. Only then is a miss a fault of admission."""
    devices = {service.device for service in the_set.services}
    pins = [edge.pin for edge in the_set.edges]
    if any(not 0 < actor.budget <= actor.period for actor in (*the_set.loops, *the_set.services)):
        return False
    if any(not (0 < edge.budget <= edge.period or (edge.budget == 0 and "gpio" in devices)) for edge in the_set.edges):
        return False
    if len(set(pins)) != len(pins) or not the_set.loops or not all(actor.scripts for actor in (*the_set.loops, *the_set.edges)):
        return False
    if any(place.core >= the_set.cores for place in (*the_set.loops, *the_set.edges, *the_set.services, *the_set.interrupts)):
        return False
    if any(step[0] == "b" and step[1] not in devices for script in scripts_of(the_set) for step in script):
        return False
    if any(step[0] in "ar" and step[2] >= the_set.cores for script in scripts_of(the_set) for step in script):
        return False
    if any(step[0] not in "cplu" for edge in the_set.edges for script in edge.scripts for step in script):
        return False
    if the_set.edge_top and not the_set.edge_interval:
        return False
    return all(keeps_declarations(the_set, loop, script) for loop in the_set.loops for script in loop.scripts) and all(
        keeps_locks(the_set, -edge.pin, script) for edge in the_set.edges for script in edge.scripts)


def needs(script, step_ns):
    """The budget of a release. Behind a wait it goes on only with some budget left, even where it only ends."""
    kinds = [step[0] for step in script]
    waits_last = any(kind in "sl" for kind in kinds[len(kinds) - kinds[::-1].index("c") :]) if "c" in kinds else True
    return computes(script, step_ns) + waits_last


def keeps_declarations(the_set, loop, script):
    if needs(script, the_set.step_ns) > loop.budget:
        return False
    if sleeps(script) > loop.sleep or sum(step[0] == "s" for step in script) > max(loop.sleeps, 1):
        return False
    return keeps_locks(the_set, loop.id, script)


def keeps_locks(the_set, holder, script):
    """A lock that says nothing counts as every loop's, and as no handler's."""
    held = sections(script, the_set.step_ns)
    if held is None:
        return False
    for lock, length in held.items():
        if lock not in the_set.locks:
            return False
        said = the_set.locks[lock]
        if length > said.get(holder, -1) if said else holder < 0:
            return False
    return True
