"""A scheduler of its own: what a set (sets.py) does in virtual time, by ARCHITECTURE.md, "VCPUs and admission".

It shares no code with sched/ and board/sim, and knows no analysis. From admission it takes what nobody can derive from the
declarations alone: the core of each VCPU, and which loops have a deferrable server. From a run it takes which changes at
run time were granted. All else it works out: each release's begin and end, in nanoseconds.

At one instant: interrupts first; then the code whose computing is over goes on, the lowest core first; then each core
decides who runs. Code computes in steps, and between two of them it goes on as well, where something else happens on its core at that instant. Interrupts take time from a core, and from no budget. A server begins when its work was due.
"""

import collections
import heapq

NEVER = 1 << 62
FIRST_IO = 33
QUEUE = 256  # what an I/O VCPU can be behind with: a device's own queue is no longer

Release = collections.namedtuple("Release", "nominal begin end")


class Sporadic:
    """Chunks of budget, [time, amount], used in order. A chunk that was used is back one period after its time."""

    def __init__(self, budget, period):
        self.budget, self.period, self.works = budget, period, False
        self.chunks = [[0, budget]]

    def left(self, now):
        whole = 0
        for time, amount in self.chunks:
            if time > now + whole:
                break
            whole += amount
        return whole

    def back(self):
        return self.chunks[0][0]

    def use(self, end, amount):
        beyond = max(amount - self.left(end - amount), 0)
        while amount > 0:
            time, has = self.chunks[0]
            part = min(has, amount)
            self.chunks[0] = [time + part, has - part]
            if has == part:
                self.chunks.pop(0)
            last = self.chunks[-1] if self.chunks else None
            if last and sum(last) >= time + self.period:
                last[1] += part
            else:
                self.chunks.append([time + self.period, part])
            amount -= part
        return beyond

    def wake(self, due):
        """What has waited for work is one chunk from here on: idling saves up nothing."""
        if self.works:
            return
        self.works = True
        if due > self.chunks[0][0]:
            first = [due, self.chunks.pop(0)[1]]
            while self.chunks and self.chunks[0][0] <= sum(first):
                first[1] += self.chunks.pop(0)[1]
            self.chunks.insert(0, first)

    def block(self, _):
        self.works = False

    def release(self, _):
        """Its budget counts from its work alone."""


class Deferrable:
    """The whole budget at each period's begin, which is a release. What was used beyond is charged to the next."""

    def __init__(self, budget, period):
        self.budget, self.period, self.works = budget, period, False
        self.begin, self.has, self.earliest, self.fresh = 0, budget, 0, True

    def roll(self, now):
        while now >= self.begin + self.period:
            self.begin += self.period
            self.earliest = self.begin
            self.has = min(self.has + self.budget, self.budget)

    def left(self, now):
        self.roll(now)
        rest = self.begin + self.period - now
        return rest + self.budget if self.has >= rest else max(self.has, 0)

    def back(self):
        return self.begin if self.has > 0 else self.begin + (-(-(1 - self.has) // self.budget)) * self.period

    def use(self, end, amount):
        beyond = 0
        while amount > 0:
            self.roll(end - amount)
            part = min(amount, self.begin + self.period - (end - amount))
            beyond += max(part - max(self.has, 0), 0)
            self.has -= part
            amount -= part
        return beyond

    def wake(self, due):
        if self.works:
            return
        self.works = True
        before = self.begin
        self.roll(due)
        if self.fresh:
            self.begin, self.fresh = due, False
        elif self.begin != before:
            self.begin, self.earliest = due, before + self.period

    def block(self, now):
        self.roll(now)
        self.works = False

    def release(self, nominal):
        if nominal >= self.begin + self.period:
            self.roll(nominal)
            self.begin = self.earliest = nominal
        elif nominal >= self.earliest:
            self.begin = nominal


class Pibs:
    """One replenishment: (the instant from which it could run) + used/U. Each service pays for its own activation."""

    def __init__(self, budget, period, client, activation):
        self.budget, self.period, self.works = budget, period, False
        self.client, self.activation = client, activation
        self.from_instant = self.has = self.used = self.last = 0

    def left(self, now):
        return self.has if self.works and self.from_instant <= now else 0

    def back(self):
        return self.from_instant

    def open(self, now):
        self.from_instant = max(self.from_instant, now)
        share = max(self.budget * self.client // self.period, 1)
        self.has, self.used = max(share - self.activation, 1), self.activation

    def comes_back(self, used):
        return -(-used * self.period // self.budget)

    def close(self):
        self.last = self.used
        self.from_instant += self.comes_back(self.used)

    def use(self, end, amount):
        beyond = max(amount - self.left(end - amount), 0)
        if self.works and self.from_instant >= end:
            # Without budget: that is the last service's, and the next one is later by it.
            self.from_instant += self.comes_back(self.last + amount) - self.comes_back(self.last)
            self.last += amount
            return beyond
        self.used += amount
        self.has -= amount
        if self.has <= 0:
            self.close()
            self.open(end)
        return beyond

    def wake(self, now):
        if not self.works:
            self.works = True
            self.open(now)

    def block(self, now):
        """A service that has not begun costs nothing."""
        if self.works:
            self.works = False
            if self.from_instant <= now:
                self.close()

    def change(self, now, budget, period):
        """The service in hand ends, and what it used comes back at the old U."""
        if self.works and self.from_instant < now:
            self.close()
        self.budget, self.period = budget, period
        if self.works:
            self.open(now)


class Vcpu:
    def __init__(self, number, period, core, server, code):
        self.number, self.period, self.core, self.server, self.code = number, period, core, server, code
        self.is_io = isinstance(server, Pibs)
        self.work = 0  # still to be computed before the code goes on
        self.steps = (1, 0)  # the last so many of that are of so many ns each, those before of a hundred times that
        self.computed = 0  # since it went on
        self.wakes = NEVER if self.is_io else 0  # None: awake
        self.blocked_at = 0
        self.waits_for = None
        self.was_handed = False  # a lock that it waited for
        self.rank = (period, number)
        self.heir_of = None  # the highest rank of those that wait for it
        self.grace = 0
        self.overrun = 0  # of a handler that holds locks: how long it may go on without budget for its waiters
        self.queue = collections.deque()

    def between_steps(self):
        step, singles = self.steps
        rest = self.work - singles * step
        return self.computed > 0 and (rest % (100 * step) if rest > 0 else self.work % step) == 0

    def own_rank(self):
        return (self.server.client if self.is_io else self.period, self.number)


class Core:
    def __init__(self):
        self.vcpus = []
        self.current = self.payer = None
        self.ready = False
        self.accounted = self.stolen = self.next = 0
        self.to_pay = 0  # of what was stolen, and whom it stops pays for

    def charge(self, now):
        passed = now - self.accounted
        if passed <= 0:
            return
        stolen = min(max(self.stolen - self.accounted, 0), passed)
        paid, used = min(stolen, self.to_pay), passed - stolen
        self.to_pay -= paid
        if self.current and used + paid:
            self.payer.grace -= min(self.payer.grace, self.payer.server.use(now, used + paid))
            self.current.work = max(self.current.work - used, 0)
            self.current.computed += used
        self.accounted = now

    def interrupt(self, now, cost, victim_pays):
        self.steal(now, cost)
        if victim_pays:
            self.to_pay += cost

    def steal(self, now, cost):
        if cost <= 0:
            return
        self.charge(now)
        self.stolen = max(self.stolen, now) + cost
        self.ready, self.next = False, self.stolen

    def waiter(self, vcpu):
        """The highest one, if it is of this core."""
        return next((other for other in self.vcpus if vcpu.heir_of and other.number == vcpu.heir_of[1]), None)

    def overruns(self, vcpu, now):
        """A handler as long as its sections say; a loop by one budget, where only loops of other cores wait for it."""
        may = vcpu.overrun > 0 or self.waiter(vcpu) is None
        return bool(vcpu.heir_of) and vcpu.grace > 0 and may and vcpu.server.left(now) == 0

    def pays_for(self, vcpu, now):
        """Itself, or, of a holder without budget, its highest waiter on this core."""
        if vcpu.server.left(now) > 0 or self.overruns(vcpu, now):
            return vcpu
        return self.waiter(vcpu) or vcpu

    def left(self, vcpu, now):
        return vcpu.grace if self.overruns(vcpu, now) else self.pays_for(vcpu, now).server.left(now)

    def rank(self, vcpu, now):
        if not vcpu.heir_of:
            return vcpu.own_rank()
        on_its_own = self.pays_for(vcpu, now) is vcpu and not self.overruns(vcpu, now)
        return min(vcpu.own_rank(), vcpu.heir_of) if on_its_own else vcpu.heir_of

    def settle(self, now):
        self.charge(now)
        if self.stolen > now:
            self.ready, self.next = False, self.stolen
        elif self.current and (self.current.work == 0 or self.current.between_steps()):
            self.ready = True
        else:
            return True
        return False


class World:
    def __init__(self, the_set, cores, deferrable, answers, interrupts=None):
        """`cores`: VCPU → core. `deferrable`: the loops that have such a server. `answers`: loop → granted or refused. `interrupts`: core →
        (cost, interval, jitter) of each that admission counts there: where budgets pay for them, a server has so much more."""
        interrupts = interrupts or {}
        self.set, self.answers = the_set, {loop: iter(given) for loop, given in answers.items()}
        self.now, self.origin = 0, None
        self.cores = [Core() for _ in range(the_set.cores)]
        self.holders, self.level = {}, collections.Counter()
        self.releases = {loop.id: [] for loop in the_set.loops}
        self.runs = {edge.pin: [] for edge in the_set.edges}
        self.late = collections.Counter()
        self.vcpus, self.served, self.served_pins = {}, {}, {}
        for loop in the_set.loops:
            most = sum(-(-(loop.period + jitter) // interval) * cost for cost, interval, jitter in interrupts.get(cores[loop.id], ()))
            more = min(most, loop.period - loop.budget) if the_set.victim_pays else 0
            server = (Deferrable if loop.id in deferrable else Sporadic)(loop.budget + more, loop.period)
            self.add(Vcpu(loop.id, loop.period, self.cores[cores[loop.id]], server, self.loop_code(loop)))
        self.add_bottom_halves(cores)
        self.turns = {edge.pin: 0 for edge in the_set.edges}
        self.next_top = {edge.pin: 0 for edge in the_set.edges}
        self.held_back = {}  # pin → when
        self.allowed = {source.device: set(range(the_set.cores)) for source in the_set.interrupts}
        for device, core in the_set.away:
            self.route(device, core, False)
        self.coming = []
        for place, source in enumerate(the_set.interrupts):
            heapq.heappush(self.coming, (source.start + source.period, place, source))
        if the_set.tick_period:
            for core in range(the_set.cores):
                heapq.heappush(self.coming, (the_set.tick_period, len(the_set.interrupts) + core, core))

    def add(self, vcpu):
        self.vcpus[vcpu.number] = vcpu
        vcpu.core.vcpus.append(vcpu)

    def add_bottom_halves(self, cores):
        number = FIRST_IO
        for asked in (*self.set.services, *self.set.edges):
            if not asked.budget:
                continue
            core = cores[number]
            loops = [loop.period for loop in self.set.loops if cores[loop.id] == core]
            server = Pibs(asked.budget, asked.period, min(loops, default=asked.period), 2 * self.set.switch)
            vcpu = Vcpu(number, asked.period, self.cores[core], server, None)
            vcpu.code = self.io_code(vcpu)
            self.add(vcpu)
            if hasattr(asked, "pin"):
                self.served_pins[asked.pin] = vcpu
            else:
                self.served[asked.device] = vcpu
            number += 1
        for edge in self.set.edges:
            self.served_pins.setdefault(edge.pin, self.served.get("gpio"))
        for held in self.set.locks.values():
            for pin in (-holder for holder in held if holder < 0):
                vcpu = self.served_pins[pin]
                if any(holder > 0 or self.served_pins[-holder] is not vcpu for holder in held):
                    vcpu.overrun += held[-pin]

    # ---- what code does: it yields what it waits for: ("work", ns), ("until", instant), ("lock",)

    def loop_code(self, loop):
        vcpu = self.vcpus[loop.id]
        self.origin = self.now if self.origin is None else self.origin
        index, turn = (self.now - self.origin) // loop.period, 0
        while True:
            nominal = self.origin + index * loop.period
            vcpu.core.charge(self.now)
            vcpu.server.release(nominal)
            begin = self.now
            for step in loop.scripts[turn % len(loop.scripts)]:
                yield from self.do(vcpu, step)
            turn += 1
            self.releases[loop.id].append(Release(nominal, begin, self.now))
            late = self.now - nominal - loop.period
            self.late[loop.id] += late > 0
            index += 1 + max(-(-late // loop.period), 0)  # a release that is due meanwhile is dropped
            if self.origin + index * loop.period > self.now:
                yield "until", self.origin + index * loop.period

    def io_code(self, vcpu):
        while True:
            if not vcpu.queue:
                yield "until", NEVER
                continue
            kind, what = vcpu.queue.popleft()
            if kind == "bottom half":
                vcpu.steps, vcpu.computed = (what.bottom, 1), 0
                yield "work", what.bottom
                continue
            begin = self.now
            for step in what.scripts[self.turns[what.pin] % len(what.scripts)]:
                yield from self.do(vcpu, step)
            self.turns[what.pin] += 1
            self.runs[what.pin].append((begin, self.now))

    def do(self, vcpu, step):
        kind, *words = step
        if kind == "c":
            vcpu.steps, vcpu.computed = (self.set.step_ns, words[0] % 100), 0
            yield "work", words[0] * self.set.step_ns
        elif kind == "s":
            yield "until", self.now + words[0]
        elif kind == "l":
            if words[0] in self.holders:
                vcpu.waits_for = words[0]
                self.inherit()
                yield ("lock",)
            else:
                self.holders[words[0]] = vcpu
        elif kind == "u":
            self.unlock(words[0])
        elif kind == "p":
            for edge in self.set.edges:
                if edge.pin == words[0]:
                    self.edge_comes(edge)
        elif next(self.answers.get(vcpu.number, iter(())), False):
            self.change(kind, *words)

    def change(self, kind, device, *words):
        if kind != "b":
            self.route(device, words[0], kind == "r")
            return
        io = self.served[device]
        io.core.charge(self.now)
        io.server.change(self.now, *words)
        io.period = words[1]
        io.core.next = min(io.core.next, self.now)

    def route(self, device, core, allowed):
        cores = self.allowed.get(device)
        if cores is not None and (allowed or cores - {core}):
            self.allowed[device] = cores | {core} if allowed else cores - {core}

    # ---- locks -------------------------------------------------------------------------------

    def unlock(self, lock):
        waiters = [vcpu for vcpu in self.vcpus.values() if vcpu.waits_for == lock]
        heir = min(waiters, key=lambda vcpu: vcpu.rank, default=None)
        if heir is None:
            del self.holders[lock]
            return
        self.holders[lock] = heir
        heir.waits_for, heir.was_handed = None, True
        heir.core.next = min(heir.core.next, self.now)
        self.inherit()

    def inherit(self):
        """The holder of a lock has the rank of its highest waiter, and so on along a chain."""
        everybody = self.vcpus.values()
        heirs = dict.fromkeys(self.vcpus)
        for vcpu in everybody:
            vcpu.rank = (vcpu.period, vcpu.number)
        changed = True
        while changed:
            changed = False
            for vcpu in everybody:
                holder = self.holders.get(vcpu.waits_for)
                if vcpu.waits_for is None or (heirs[holder.number] and heirs[holder.number] <= vcpu.rank):
                    continue
                heirs[holder.number] = vcpu.rank
                holder.rank = min(holder.rank, vcpu.rank)
                changed = True
        for vcpu in everybody:
            if not vcpu.heir_of:
                vcpu.grace = vcpu.overrun or vcpu.server.budget
            if vcpu.heir_of != heirs[vcpu.number]:
                vcpu.heir_of = heirs[vcpu.number]
                vcpu.core.next = min(vcpu.core.next, self.now)

    # ---- interrupts and bottom halves --------------------------------------------------------

    def fire(self):
        _, place, source = heapq.heappop(self.coming)
        if isinstance(source, int):
            heapq.heappush(self.coming, (self.now + self.set.tick_period, place, source))
            self.cores[source].interrupt(self.now, self.set.tick_cost, self.set.victim_pays)
            return
        heapq.heappush(self.coming, (self.now + source.period, place, source))
        allowed = self.allowed[source.device]
        core = self.cores[source.core if source.core in allowed else min(allowed)]
        core.interrupt(self.now, source.top, self.set.victim_pays)
        if not source.bottom:
            return
        server = None if source.device == "gpio" else self.served.get(source.device)
        if server:
            self.give(server, ("bottom half", source))
        else:
            core.interrupt(self.now, source.bottom, self.set.victim_pays)

    def edge_comes(self, edge):
        """One that comes too soon is held back; of several, one."""
        if self.now >= self.next_top[edge.pin]:
            self.take_edge(edge)
        else:
            self.held_back[edge.pin] = self.next_top[edge.pin]

    def take_edge(self, edge):
        self.held_back.pop(edge.pin, None)
        server = self.served_pins[edge.pin]
        self.give(server, ("edge", edge))
        if self.set.edge_top:
            self.next_top[edge.pin] = self.now + self.set.edge_interval
            server.core.interrupt(self.now, self.set.edge_top, self.set.victim_pays)

    def give(self, vcpu, what):
        if len(vcpu.queue) == QUEUE:
            return
        vcpu.queue.append(what)
        if vcpu.wakes == NEVER:
            vcpu.wakes = self.now
        vcpu.core.next = min(vcpu.core.next, self.now)

    # ---- a core ------------------------------------------------------------------------------

    def decide(self, core):
        now = self.now
        core.charge(now)
        core.ready = False
        if core.stolen > now:
            core.next = core.stolen
            return
        for vcpu in core.vcpus:
            if vcpu.wakes is not None and vcpu.wakes <= now:
                vcpu.server.wake(now if vcpu.is_io else max(vcpu.wakes, vcpu.blocked_at))
                vcpu.wakes = None
            if vcpu.was_handed:
                vcpu.was_handed = False
                self.pay_for_turn(vcpu)
        willing = [vcpu for vcpu in core.vcpus if vcpu.wakes is None and vcpu.waits_for is None]
        able = [vcpu for vcpu in willing if core.left(vcpu, now) > 0]
        chosen = min(able, key=lambda vcpu: core.rank(vcpu, now), default=None)
        if chosen is not core.current:
            core.current = chosen
            if chosen:
                core.stolen = now + self.set.switch
        core.payer = core.pays_for(chosen, now) if chosen else None
        if core.stolen > now:
            core.next = core.stolen
            return
        # Whatever may change the choice: work or a budget ends, one is back, a sleeper wakes.
        events = [vcpu.wakes for vcpu in core.vcpus if vcpu.wakes is not None]
        for vcpu in willing:
            for server in {vcpu.server, core.pays_for(vcpu, now).server}:
                if server.left(now) == 0:
                    events.append(server.back())
        if chosen:
            events += [now + chosen.work, now + core.left(chosen, now)]
            core.ready = chosen.work == 0
        core.next = min(events, default=NEVER)

    def pay_for_turn(self, vcpu):
        """To one that waited for a lock. Loops have declared theirs; a handler has declared none, and its activation is one turn only."""
        if vcpu.is_io and self.set.switch and len(vcpu.core.vcpus) > 1:
            vcpu.server.use(self.now, 2 * self.set.switch)

    def go_on(self, core):
        vcpu = core.current
        vcpu.computed = 0
        if vcpu.work > 0:
            self.decide(core)
            return
        kind, *words = next(vcpu.code)
        if kind == "work":
            vcpu.work += words[0]
        else:
            core.charge(self.now)
            if kind == "until":
                vcpu.server.block(self.now)
                vcpu.blocked_at = self.now
                # More may have come while the code ran.
                vcpu.wakes = words[0] + (self.set.wake_latency if self.now < words[0] < NEVER else 0)
            core.current = None
        self.decide(core)

    def run(self, until):
        while True:
            due = min(self.coming[0][0] if self.coming else NEVER, *self.held_back.values(), *(core.next for core in self.cores if not core.ready), NEVER)
            if due <= self.now:
                for edge in sorted(self.set.edges, key=lambda edge: edge.pin):
                    if self.held_back.get(edge.pin, NEVER) <= self.now:
                        self.take_edge(edge)
                while self.coming and self.coming[0][0] <= self.now:
                    self.fire()
                for core in self.cores:
                    if not core.ready and core.next <= self.now and core.settle(self.now):
                        self.decide(core)
                continue
            core = next((core for core in self.cores if core.ready), None)
            if core:
                self.go_on(core)
            elif due >= until:
                return self
            else:
                self.now = due
