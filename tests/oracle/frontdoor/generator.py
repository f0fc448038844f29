"""Makes random sets (sets.py) that keep what they declare. Which features a set has is drawn first, so that each is also
met alone."""

import sets
from sets import MS, US

PERIODS = (2, 4, 5, 5, 8, 10, 10, 12, 16, 20, 25, 40, 50, 100)
BUSES = ("nic", "disk", "uart", "i2c", "spi")


class Generator:
    def __init__(self, random):
        self.random = random
        self.set = None

    def one_in(self, n):
        return self.random.randrange(n) == 0

    def make(self):
        theme = self.random.randrange(24)
        if theme < 3:
            self.make_theme_of_swaps()
        elif theme == 3:
            self.make_theme_of_refusals()
        elif theme == 4:
            self.make_theme_of_exchanges()
        elif theme < 7:
            self.make_theme_of_changes()
        else:
            self.make_mixture()
        longest = max((loop.period for loop in self.set.loops), default=MS)
        self.set.length = min(max(25 * longest, 400 * MS), 2000 * MS)
        return self.set

    def make_mixture(self):
        draw = self.random
        the_set = self.set = sets.Set(cores=draw.choice((1, 1, 1, 2, 2, 3)))
        the_set.step_ns = draw.choice((10 * US, 10 * US, 5 * US, draw.randint(3000, 13000)))
        if self.one_in(2):
            the_set.switch = draw.choice((1, 5, 20, 50, 200)) * US
        for lock in range(draw.choice((0, 0, 1, 1, 2, 3))):
            the_set.locks[lock] = {}
        if self.one_in(6):
            the_set.wake_latency = draw.choice((draw.randint(1, 50), draw.randint(50, 500))) * US
        for core in range(the_set.cores):
            self.add_loops(core)
        if not the_set.loops:
            return
        self.declare_locks()
        self.add_interrupts()
        the_set.victim_pays = self.one_in(6)
        if self.one_in(3):
            self.add_edges()
            self.add_sections_of_handlers()
        if self.one_in(3):
            self.add_changes()

    # ---- loops -------------------------------------------------------------------------------

    def add_loops(self, core):
        draw, the_set = self.random, self.set
        rest = draw.uniform(0.3, 0.95)
        count = draw.choice((1, 2, 2, 3, 3, 4))
        for place in range(count):
            part = rest if place == count - 1 else rest * draw.uniform(0.15, 0.7)
            rest -= part
            period = draw.choice(PERIODS) * MS
            if self.one_in(4):
                period = draw.randint(period // 2, period) + 1
            steps = max(int(part * period) // the_set.step_ns, 1)
            sleep = draw.randint(1, max(int((period - steps * the_set.step_ns) * 0.4), 1)) if self.one_in(4) else 0
            number = len(the_set.loops) + 1
            pieces = draw.randint(2, 4) if sleep >= 4 and self.one_in(2) else 0
            scripts = [self.script(steps, sleep, max(pieces, 1), whole=turn == 0) for turn in range(draw.choice((1, 1, 2, 3, 5)))]
            budget = max(sets.needs(script, the_set.step_ns) for script in scripts)
            if self.one_in(5):
                budget += draw.randint(0, budget // 10)
            if budget < period:
                anywhere = core > 0 and self.one_in(10)
                the_set.loops.append(sets.Loop(number, budget, period, -1 if anywhere else core, sleep, scripts, pieces))

    def script(self, steps, sleep, sleeps, whole):
        """Computes at most `steps`, sleeps at most `sleep` in so many sleeps; the first one of a loop does all of both."""
        draw = self.random
        if not whole:
            steps = draw.randint(1, steps)
            sleep = draw.randint(0, sleep) if self.one_in(2) else sleep
        cuts = sorted(draw.randint(0, steps) for _ in range(3))
        lengths = [b - a for a, b in zip([0, *cuts], [*cuts, steps])]
        pieces = [[("c", length)] for length in lengths if length]
        free = sorted(self.set.locks)
        if free and pieces and not self.one_in(3):
            lock = draw.choice(free)
            place = draw.randrange(len(pieces))
            inside = pieces[place]
            above = [other for other in free if other > lock]
            if above and self.one_in(2):
                inside = [("l", draw.choice(above)), *inside, ("u", 0)]
                inside[-1] = ("u", inside[0][1])
                if place + 1 < len(pieces) and self.one_in(2):
                    inside += pieces.pop(place + 1)
            pieces[place] = [("l", lock), *inside, ("u", lock)]
        cuts = sorted(draw.randint(0, sleep) for _ in range(sleeps - 1))
        for length in (b - a for a, b in zip([0, *cuts], [*cuts, sleep])):
            if length:
                pieces.insert(draw.randint(0, len(pieces)), [("s", length)])
        return [step for piece in pieces for step in piece]

    def declare_locks(self):
        """Each lock says who holds it and for how long at most; some say nothing."""
        the_set = self.set
        for lock in list(the_set.locks):
            held = {}
            for loop in the_set.loops:
                for script in loop.scripts:
                    length = sets.sections(script, the_set.step_ns).get(lock)
                    if length is not None:
                        held[loop.id] = max(held.get(loop.id, 1), length)
            if not held:
                del the_set.locks[lock]
            elif not self.one_in(12):
                the_set.locks[lock] = held

    # ---- what comes from outside -------------------------------------------------------------

    def add_interrupts(self):
        draw, the_set = self.random, self.set
        if self.one_in(3):
            the_set.tick_period = draw.choice((1, 4, 9, 10, 15)) * MS
            the_set.tick_cost = draw.choice((5 * US, 50 * US, draw.randint(100, 1000) * US)) * the_set.tick_period // (15 * MS) or 1
        for _ in range(draw.choice((0, 0, 1, 1, 2, 3))):
            top = draw.randint(100, 1000) * US if self.one_in(2) else draw.randint(1, 100) * US
            period = max(draw.randint(10, 60) * top, draw.randint(1, 40) * MS)
            bottom = draw.randint(50, 1000) * US if self.one_in(2) else 0
            period = max(period, 12 * bottom)
            if self.one_in(2):
                period = max(period // MS, 1) * MS
            start = draw.choice((0, draw.randint(1, 50 * MS)))
            the_set.interrupts.append(sets.Interrupt(draw.choice(BUSES[:3]), period, draw.randrange(the_set.cores), top, bottom, start))
        # Many small ones: more than any table has places for.
        if self.one_in(10):
            for _ in range(draw.randint(7, 11)):
                period = draw.randint(8, 30) * MS
                the_set.interrupts.append(sets.Interrupt(draw.choice(BUSES), period, 0, draw.randint(10, 250) * US, 0, 0))
            the_set.interrupts[-1].top = draw.randint(100, 1000) * US
        for device in sorted({source.device for source in the_set.interrupts if source.bottom}):
            if self.one_in(2):
                the_set.services.append(sets.Service(device, *self.io_share(), draw.randrange(the_set.cores)))
        if the_set.cores > 1 and self.one_in(4):
            for device in sorted({source.device for source in the_set.interrupts}):
                the_set.away.append((device, draw.randrange(the_set.cores)))

    def io_share(self):
        draw = self.random
        period = draw.choice((1, 2, 5, 10, 20, 100)) * MS
        return max(int(period * draw.choice((0.005, 0.01, 0.02, 0.05, 0.1))), 2 * self.set.switch + 1), period

    def add_edges(self):
        draw, the_set = self.random, self.set
        if self.one_in(3):
            the_set.services.append(sets.Service("gpio", *self.io_share(), draw.randrange(the_set.cores)))
        has_class = any(service.device == "gpio" for service in the_set.services)
        for pin in range(2, 2 + draw.choice((1, 1, 2))):
            most = max(draw.randint(10, 600) * US // the_set.step_ns, 1)
            scripts = [[("c", draw.randint(1, most))] for _ in range(draw.choice((1, 2)))]
            share = (0, 1) if has_class and self.one_in(2) else self.io_share()
            the_set.edges.append(sets.Edge(pin, *share, draw.randrange(the_set.cores), scripts))
            loop = draw.choice(the_set.loops)
            for script in loop.scripts:
                for _ in range(draw.choice((1, 1, 2, 4))):
                    script.insert(draw.randint(0, len(script)), ("p", pin))

    def add_sections_of_handlers(self):
        """Handlers take locks that loops of their core have, and what they compute is under them. Some edges take time at once."""
        draw, the_set = self.random, self.set
        if self.one_in(2):
            the_set.edge_top = draw.randint(5, 100) * US
            the_set.edge_interval = draw.choice((draw.randint(20, 60) * the_set.edge_top, draw.randint(1, 10) * MS))
        for edge in the_set.edges:
            loops = {loop.id for loop in the_set.loops if loop.core == edge.core}
            free = [lock for lock, held in the_set.locks.items() if held and set(held) <= loops]
            if not free or not edge.budget or self.one_in(2):
                continue
            lock = draw.choice(free)
            for turn, script in enumerate(edge.scripts):
                edge.scripts[turn] = [("l", lock), *script, ("u", lock)]
            the_set.locks[lock][-edge.pin] = max(sets.computes(script, the_set.step_ns) for script in edge.scripts)

    def add_changes(self):
        """A loop, or two, route interrupts away and back, and raise and lower I/O VCPUs, each again and again."""
        draw, the_set = self.random, self.set
        choices = []
        for device in sorted({source.device for source in the_set.interrupts}) if the_set.cores > 1 else ():
            choices += [(kind, device, core) for core in range(the_set.cores) for kind in "aarr"]
        for service in the_set.services:
            more = min(int(service.budget * draw.uniform(1.2, 12)), service.period)
            choices += [("b", service.device, share, service.period) for share in (more, more, service.budget)]
        if not choices:
            return
        for _ in range(draw.choice((1, 1, 2))):
            loop = draw.choice(the_set.loops)
            turns = draw.randint(1, 7)
            loop.scripts = [list(loop.scripts[turn % len(loop.scripts)]) for turn in range(max(turns, len(loop.scripts)))]
            for _ in range(draw.randint(2, 5)):
                script = draw.choice(loop.scripts)
                script.insert(draw.randint(0, len(script)), draw.choice(choices))

    def make_theme_of_swaps(self):
        """Two devices, one on each core, of about equal weight. A light loop sends the one away and then the other one there, so that a
        release that is under way bears both; and back."""
        draw = self.random
        the_set = self.set = sets.Set(cores=2, tight=[0])
        self.add_loops(0)
        period = draw.choice(PERIODS) * MS
        steps = max(period // 20 // the_set.step_ns, 2)
        shortest = min((loop.period for loop in the_set.loops), default=MS)
        for core, device in enumerate(("nic", "disk")):
            top = min(draw.randint(300, 1000) * US, shortest // 4)
            the_set.interrupts.append(sets.Interrupt(device, int(draw.uniform(0.8, 3) * shortest), core, top, 0, draw.randint(0, 20 * MS)))
        away, back = [("a", "nic", 0), ("a", "disk", 1)], [("r", "disk", 1), ("r", "nic", 0)]
        rest = [[("c", draw.randint(1, steps))] for _ in range(draw.randint(0, 3))]
        first = [away[0], *([("c", steps)] if self.one_in(2) else []), away[1]]
        the_set.loops.append(sets.Loop(len(the_set.loops) + 1, (steps + 1) * the_set.step_ns, period, 1, 0, [first, *rest, [*back, ("c", 1)]]))

    def two_loops(self, short, long, of_short, of_long):
        """On core 0, which compute such shares of their periods."""
        the_set = self.set
        the_set.step_ns = 2 * US
        for period, share in (short, of_short), (long, of_long):
            steps = max(int(period * share) // the_set.step_ns, 1)
            number = len(the_set.loops) + 1
            the_set.loops.append(sets.Loop(number, steps * the_set.step_ns, period, 0, 0, [[("c", steps)]]))

    def make_theme_of_refusals(self):
        """A full core 1 refuses the interrupts that core 0 would be rid of. Then core 0 is asked for as much as it had without them, and its
        bottom half has work for all of that. What was refused must leave no trace."""
        draw = self.random
        the_set = self.set = sets.Set(cores=2, halvings=6)
        short = draw.choice((4, 5, 8, 10)) * MS
        self.two_loops(short, short * draw.randint(3, 6), draw.uniform(0.05, 0.15), draw.uniform(0.3, 0.5))
        self.add_loops(1)
        callers = [loop for loop in the_set.loops if loop.core == 1]
        if not callers:
            return
        # Many small ones: what they take in a release is hardly less than what is counted.
        top = draw.randint(20, 60) * US
        period = int(top / draw.uniform(0.12, 0.25))
        served = draw.choice((short, 2 * short, 10 * MS))
        bottom, budget = draw.randint(50, 300) * US, served // 50
        more = int(served * top / period * draw.uniform(0.7, 0.95))
        the_set.interrupts.append(sets.Interrupt("nic", period, 0, top, 0, draw.randint(0, 20 * MS)))
        the_set.interrupts.append(sets.Interrupt("disk", int(bottom * served / (budget + 2 * more)) + 1, 0, 1 * US, bottom, 0))
        the_set.services.append(sets.Service("disk", budget, served, 0))
        raised, lowered = ("b", "disk", budget + more, served), ("b", "disk", budget, served)
        loop = draw.choice(callers)
        plain = list(loop.scripts[0])
        loop.scripts = [[raised, *plain], [("a", "nic", 0), raised, *plain], plain, [lowered, ("r", "nic", 0), *plain]]

    def make_theme_of_exchanges(self):
        """Two bottom halves of core 0 that always have work, and a loop of core 1 that lowers the one and raises the other at once, so that
        a release that is under way would bear a whole service of both; and back.

            nic   |████████        |█               one of its services begins with each release of the short loop
            disk  |             █  |    ████████    the other's somewhat later
            long  |────────────────────────|        no room for both
                           ^ exchanged
        """
        draw = self.random
        the_set = self.set = sets.Set(cores=2, tight=[0], halvings=7)
        short = draw.choice((8, 10, 16, 20)) * MS
        of_short, share = draw.uniform(0.02, 0.06), draw.uniform(0.3, 0.42)
        long = int(short * draw.uniform(1.03, 1.25))
        self.two_loops(short, long, of_short, draw.uniform(0.1, 0.3))
        high = int(short * share)
        low = high // draw.randint(20, 60)
        done = int(short * (of_short + share) * 1.1)
        later = done + draw.randint(short // 50, short // 10)
        for device, start, budget in ("nic", 0, high), ("disk", later, low):
            the_set.interrupts.append(sets.Interrupt(device, short, 0, 1 * US, int(high * 1.1), start))
            the_set.services.append(sets.Service(device, budget, short, 0))
        exchange = [[("c", done // the_set.step_ns), ("b", one, low, short), ("b", other, high, short)]
                    for one, other in (("nic", "disk"), ("disk", "nic"))]
        rest = [[("c", 1)] for _ in range(draw.randint(1, 3))]
        the_set.loops.append(sets.Loop(len(the_set.loops) + 1, done + 1, short, 1, 0, [exchange[0], *rest, exchange[1], *rest]))

    def make_theme_of_changes(self):
        """Interrupts about as far apart as releases, and a loop that sends them to and fro: what a release meets before a change and
        after it adds up."""
        draw = self.random
        the_set = self.set = sets.Set(cores=draw.choice((2, 2, 3)))
        the_set.switch = draw.choice((0, 0, 5, 50)) * US
        for core in range(the_set.cores):
            self.add_loops(core)
        if not the_set.loops:
            return
        shortest = min(loop.period for loop in the_set.loops)
        for _ in range(draw.choice((2, 2, 3))):
            top = draw.randint(200, 1000) * US
            period = max(int(draw.uniform(0.7, 4) * max(shortest, 4 * MS)), 4 * top)
            bottom = draw.randint(50, 500) * US if self.one_in(3) else 0
            self.set.interrupts.append(sets.Interrupt(draw.choice(BUSES[:3]), period, draw.randrange(the_set.cores), top, bottom,
                                                      draw.randint(0, 20 * MS)))
        for device in sorted({source.device for source in the_set.interrupts}):
            if self.one_in(3):
                the_set.services.append(sets.Service(device, *self.io_share(), draw.randrange(the_set.cores)))
        if self.one_in(2):
            self.add_edges()
        self.add_changes()


# What a set may have beside loops that compute: each is met alone as well.
FEATURES = {
    "bottom halves": lambda the_set: the_set.services or the_set.edges,
    "changes": sets.changes,
    "budgets that are exchanged": lambda the_set: sets.one_release_changes(the_set, "b"),
    "budgets and routes at once": lambda the_set: sets.one_release_changes(the_set, "a", "b"),
    "edges that take time": lambda the_set: the_set.edge_top,
    "handlers with locks": sets.handlers_take_locks,
    "interrupts": lambda the_set: the_set.interrupts or the_set.tick_period,
    "late wake-ups": lambda the_set: the_set.wake_latency,
    "locks": lambda the_set: the_set.locks,
    "locks that say nothing": lambda the_set: not all(the_set.locks.values()),
    "many interrupts": lambda the_set: len(the_set.interrupts) > 7,
    "sleeps in pieces": lambda the_set: any(loop.sleeps > 1 for loop in the_set.loops),
    "switches": lambda the_set: the_set.switch,
    "victims that pay": lambda the_set: the_set.victim_pays and (the_set.interrupts or the_set.tick_period),
}


def random_set(random):
    """Where a seed gives nothing honest (no loop fits, for instance) the next draws are taken."""
    while True:
        the_set = Generator(random).make()
        if sets.is_honest(the_set):
            return the_set


def scaled(the_set, factor, core=None):
    """The same with more (or less) computing, of the loops of one core or of all: budgets, and what scripts and sections take
    of them. None: there is no such set."""
    changed = the_set.copy()

    def scale(scripts):
        return [[("c", max(int(step[1] * factor), 1)) if step[0] == "c" else step for step in script] for script in scripts]

    for loop in (loop for loop in changed.loops if core in (None, loop.core)):
        slack = loop.budget - max(sets.needs(script, changed.step_ns) for script in loop.scripts)
        loop.scripts = scale(loop.scripts)
        loop.budget = max(sets.needs(script, changed.step_ns) for script in loop.scripts) + slack
        if loop.budget >= loop.period:
            return None
    for lock, held in changed.locks.items():
        for number in [number for number in held if number > 0]:
            loop = next(loop for loop in changed.loops if loop.id == number)
            held[number] = max(sets.sections(script, changed.step_ns).get(lock, 1) for script in loop.scripts)
    return changed if sets.is_honest(changed) else None
