#!/usr/bin/env python3
"""Verifies what `qduino check --certificate FILE` wrote: that the times it claims for a sketch's loops are bounds.

    tools/check_certificate.py FILE [--sketch FILE]… [--board FILE]    exit 0: every claim holds; 1: one does not, and why
    tools/check_certificate.py --self-test

With --sketch and --board the claims must be of these very texts. A certificate that was changed after it was written, or has a number that
no core can have, is none.

Shares no code with the scheduler's analysis, and does not look for a response time: it puts the claimed R into the equation.
Where demand(R) <= R, the least solution of the equation is at most R (the demand never falls as the window grows), so R is a
bound, however it was found. All in whole nanoseconds and exact fractions.

  demand(i, w) = C_i + S_i + B_i + V_i + sum over loops j that can delay i of ceil((w + J_j)/T_j) C_j
                 + sum over bottom halves of D + ceil(U (w - D)), D: U T_q of the longest client q that can delay loop i
                 + sum over interferers of ceil((w + jitter)/interval) cost + (1 + sleeps) late
                   (where one has a peak's interval and jitter, the lower of both)

C with what an activation and further waits cost, and the waits for handlers that hold a lock; of others with what they have beside the
budget to pay for interrupts; late: how late a loop wakes; edges of a bottom half's pins are an interferer; V: waits for locks of other
cores, each no longer than the claimed longest one W, which is put into its own equation: what the cores of the holders can execute in W,
at the waiter's rank or above, is less than W (the head of sched/remote_blocking.h has the argument); B: Sha, Rajkumar, Lehoczky, IEEE ToC
1990; S, J: Audsley et al., 1993; Chen et al., 2019; bottom halves: Danish, Li, West, RTAS 2011, each service but the last giving its time
back at U. At one period a loop goes before them, where no lock lends anybody a rank and none is shared. Whichever loop of its core a bottom
half works for: from when a service may begin, the same demand of a window of that loop's period is at most that period, or each loop meets
by the paper's term (Missimer, Missimer, West, ECRTS 2016) as well. A core that the
utilisation bound admits is held against that bound instead (Liu, Layland, JACM 1973; the bottom halves' part: Danish, Li, West, RTAS 2011).
"""
import argparse
import copy
import hashlib
import json
import math
import sys
from fractions import Fraction

FIRST_IO, DAY = 33, 24 * 3600 * 10**9


def ceil(a, b):
    return -(-a // b)


def within(asked, limit):
    """Some window of at most `limit` has as much time as is asked for in it. Tried are those that a shorter one asks for."""
    window = 0
    while window <= limit:
        more = asked(window)
        if more <= window:
            return True
        window = more
    return False


def rank(loop):
    return (loop["period_ns"], loop["id"])


def sleeps(loop):
    return loop["sleeps"] if loop["suspension_ns"] else 0


def taken_by(each, window):
    """By one interferer, in a window of that length: of its two bounds on the number of events, the lower one."""
    events = ceil(window + each["jitter_ns"], each["interval_ns"])
    if "peak_interval_ns" in each:
        events = min(events, ceil(window + each["peak_jitter_ns"], each["peak_interval_ns"]))
    return events * each["cost_ns"]


class Core:
    """One core. The `computer` says which locks cross cores."""

    def __init__(self, claim, computer):
        self.claim = claim
        self.computer = computer
        self.loops = sorted(claim["loops"], key=rank)
        self.ios = claim["ios"]
        self.overhead = claim["activation_ns"]
        self.interferers = claim["interferers"] + [{"cost_ns": io["edge_ns"], "interval_ns": io["edge_interval_ns"], "jitter_ns": 0}
                                                   for io in self.ios if io["edge_ns"]]
        self.interrupts = list(self.interferers)
        self.sections = claim["sections"]

    def keep_for_others(self):
        """The system takes this from the loops where they leave it less. Two pieces can meet."""
        claim = self.claim
        if claim["kept_ns"] and self.loops and self.taken(claim["kept_period_ns"]) + claim["kept_ns"] > claim["kept_period_ns"]:
            self.interferers.append({"cost_ns": claim["kept_ns"], "interval_ns": claim["kept_period_ns"],
                                     "jitter_ns": claim["kept_period_ns"] - claim["kept_ns"]})

    def requests(self, loop):
        return sum(1 for s in self.sections if s["vcpu"] == loop["id"] and s["length_ns"] and not s["assumed"])

    def own_cost(self, loop):
        waits = (sleeps(loop) + self.requests(loop)) * self.claim["wait_ns"]
        return loop["budget_ns"] + self.overhead + waits + self.by_handlers(loop)

    def cost(self, loop):
        """For others: with what it has beside its budget, where that pays for interrupts."""
        return self.own_cost(loop) + self.allowance(loop)

    def allowance(self, loop):
        if not self.claim["victim_pays"]:
            return 0
        taken = sum(taken_by(each, loop["period_ns"]) for each in self.interrupts)
        return min(taken, loop["period_ns"] - loop["budget_ns"])

    def connected(self, locks):
        """All locks that a chain from these may reach."""
        while True:
            holders = {s["vcpu"] for s in self.local() if s["lock"] in locks}
            more = locks | {s["lock"] for s in self.local() if s["vcpu"] in holders}
            if more == locks:
                return locks
            locks = more

    def local(self):
        """Sections under locks that stay on this core."""
        return [s for s in self.sections if s["assumed"] or not self.computer.waits(s["vcpu"])]

    def by_handlers(self, loop):
        """A handler that holds a lock may lack budget, whatever its rank, and again at each request."""
        own = [s["lock"] for s in self.local() if s["vcpu"] == loop["id"]]
        locks = self.connected(set(own))
        return len(own) * sum(s["length_ns"] for s in self.local() if s["vcpu"] >= FIRST_IO and s["lock"] in locks)

    def locked(self, loop):
        """What a release executes with locks."""
        length = sum(s["length_ns"] for s in self.sections if s["vcpu"] == loop["id"] and not s["assumed"])
        return min(length, loop["budget_ns"]) + self.requests(loop) * self.claim["wait_ns"]

    def told_apart(self):
        return len(self.loops) + len(self.ios) <= self.claim["priorities"]

    def last_priority(self, i):
        """Loop i may have the lowest priority that the core tells apart, and share it."""
        return not self.told_apart() and i + 1 + len(self.ios) >= self.claim["priorities"]

    def delaying(self, i):
        return [loop for j, loop in enumerate(self.loops) if j != i and (j < i or self.last_priority(i))]

    def clients(self, io):
        return [io["client_period_ns"]] if io["client_period_ns"] else sorted({loop["period_ns"] for loop in self.loops})

    def delaying_clients(self, io, i):
        own, ordered = self.loops[i]["period_ns"], self.told_apart() and not self.sections
        return [t for t in self.clients(io) if self.last_priority(i) or t < own or t == own and not ordered]

    def blocking(self, i):
        """By locks that stay on this core."""
        place = {loop["id"]: j for j, loop in enumerate(self.loops)}
        sections = [(place[s["vcpu"]], s["lock"], s["length_ns"]) for s in self.local() if s["vcpu"] < FIRST_IO]
        locks = {lock for j, lock, _ in sections if j <= i} | {s["lock"] for s in self.local() if s["vcpu"] >= FIRST_IO}
        while True:  # chains: a lower loop that holds one of these may wait for any other lock that it takes
            holders = {j for j, lock, _ in sections if j > i and lock in locks}
            more = locks | {lock for j, lock, _ in sections if j in holders}
            if more == locks:
                break
            locks = more
        lower = [(j, lock, length) for j, lock, length in sections if j > i and lock in locks]
        by_loop = sum(max(length for j, _, length in lower if j == k) for k in {j for j, _, _ in lower})
        by_lock = sum(max(length for _, lock, length in lower if lock == k) for k in {lock for _, lock, _ in lower})
        return min(by_loop, by_lock)

    def service(self, io, period):
        return max(io["budget_ns"] * period // io["period_ns"], self.overhead + 1)

    def service_per_period(self, io, period):
        """Rounded up: services of so much come no more often than once in a period."""
        return max(ceil(io["budget_ns"] * period, io["period_ns"]), self.overhead + 1)

    def meets_beside_whole_services(self, i):
        """Loop i, where each service is counted as a whole one, two at the least, also before loops of its client's period (Missimer, Missimer,
        West, ECRTS 2016)."""
        own = self.loops[i]["period_ns"]

        def asked(window):
            total = self.demand(i, window)
            for io in self.ios:
                most = 0
                for client in (t for t in self.clients(io) if t <= own or self.last_priority(i)):
                    service = self.service_per_period(io, client)
                    most = max(most, (1 + ceil(max(window - service, 0), client)) * service)
                total += most - self.io_demand(io, self.delaying_clients(io, i), window)
            return total

        return within(asked, own)

    def io_demand(self, io, clients, window):
        if not clients:
            return 0
        longest = max(self.service(io, t) for t in clients)
        return longest + ceil(max(window - longest, 0) * io["budget_ns"], io["period_ns"])

    def releases(self, loop, window):
        jitter = loop["period_ns"] - loop["budget_ns"]
        if not (loop["deferrable"] or self.computer.waits(loop["id"])):
            jitter = min(jitter, self.claim["wake_ns"])
        return ceil(window + jitter, loop["period_ns"])

    def demand(self, i, window):
        loop = self.loops[i]
        waits = self.requests(loop) if self.computer.waits(loop["id"]) else 0
        begins = 1 + sleeps(loop) + waits
        total = self.own_cost(loop) + (1 + sleeps(loop)) * self.claim["wake_ns"]
        total += loop["suspension_ns"] + begins * self.blocking(i) + min(begins, 2) * self.computer.lifted(self, loop)
        total += waits * self.computer.executed(self, loop, loop["longest_wait_ns"], own_core=False)
        total += sum(self.releases(other, window) * self.cost(other) for other in self.delaying(i))
        total += sum(self.io_demand(io, self.delaying_clients(io, i), window) for io in self.ios)
        return total + self.taken_by_platform(window)

    def ends_within(self, loop):
        """How long a release lasts at most: its R where that is verified without any wait for other cores, and no sleep can be longer."""
        i, response = self.loops.index(loop), loop["response_ns"]
        verified = not (loop["deferrable"] or self.computer.waits(loop["id"])) and self.demand(i, response) <= response
        return min(response, loop["period_ns"]) if verified else loop["period_ns"]

    def executed(self, waiter, lowest, window):
        """At the rank of `waiter` or above, in any window, while `lowest` is the lowest that may hold one of its locks here."""
        total = sum(taken_by(each, window) + each["cost_ns"] for each in self.interferers)
        above = (lambda t: True) if self.computer.few_priorities else (lambda t: t <= waiter["period_ns"])
        for loop in self.loops:
            if loop is waiter:
                continue
            if self.computer.holds_first(loop, waiter):
                continue
            higher = self.computer.above(loop, waiter)
            whole = higher and rank(loop) < rank(lowest)
            amount = self.cost(loop) if whole else self.locked(loop)
            total += ceil(window + max(self.ends_within(loop) - amount, 0), loop["period_ns"]) * amount
        for io in self.ios:
            total += max([(2 + ceil(max(window - self.service_per_period(io, t), 0), t)) * self.service_per_period(io, t) for t in self.clients(io) if above(t)], default=0)
        return total

    def taken(self, window):
        """By all of them, for one that has the lowest priority of all."""
        return (sum(self.releases(loop, window) * self.cost(loop) for loop in self.loops) + self.taken_by_platform(window)
                + sum(self.io_demand(io, self.clients(io), window) + max(self.service(io, t) for t in self.clients(io)) for io in self.ios))

    def asked_by_service(self, io, client, window):
        """By a service of a bottom half and all that goes first, from when it may begin."""
        above = [loop for loop in self.loops if loop["period_ns"] <= client]
        shares = not self.told_apart() and len(above) + len(self.ios) >= self.claim["priorities"]
        total = self.service(io, client) + self.waits_of_handler(io) + self.taken_by_platform(window)
        total += sum(self.releases(loop, window) * self.cost(loop) for loop in (self.loops if shares else above))
        for other in self.ios:
            if other is not io:
                total += self.io_demand(other, [t for t in self.clients(other) if shares or t <= client], window)
        return total

    def waits_of_handler(self, io):
        """For loops that hold a lock of its handler, or one that is connected with it: each lock once."""
        locks = self.connected({s["lock"] for s in self.local() if s["vcpu"] == io["id"]})
        return sum(max((s["length_ns"] for s in self.local() if s["lock"] == lock and s["vcpu"] < FIRST_IO), default=0) for lock in locks)

    def fits(self, io, client):
        return within(lambda window: self.asked_by_service(io, client, window), client)

    def taken_by_platform(self, window):
        return sum(taken_by(each, window) for each in self.interferers)

    def within_bound(self):
        """(1 + u/n)^n <= 2, where the bound may be used at all."""
        n = len(self.loops)
        if self.sections or self.claim["kept_ns"] or self.claim["wake_ns"] or not self.told_apart() or any(loop["deferrable"] for loop in self.loops):
            return False
        u = sum(Fraction(self.cost(loop), loop["period_ns"]) for loop in self.loops)
        for io in self.ios:
            share = Fraction(io["budget_ns"], io["period_ns"])
            shortest = io["client_period_ns"] or min(loop["period_ns"] for loop in self.loops)
            if self.overhead and share * shortest <= self.overhead:
                return False
            u += (2 - share) * share
        u += max(Fraction(self.taken_by_platform(loop["period_ns"]), loop["period_ns"]) for loop in self.loops)
        return (1 + u / n) ** n <= 2

    def faults_of_wait(self, loop):
        longest = loop["longest_wait_ns"]
        if not loop["deferrable"]:
            yield "loop %d waits for other cores, and its budget does not come back at its releases" % loop["id"]
        if longest <= 0 or longest > loop["period_ns"]:
            yield "loop %d: a wait of %d ns for other cores is none, or beyond its period" % (loop["id"], longest)
        elif self.computer.executed(self, loop, longest) >= longest:
            yield "loop %d: claimed to wait %d ns for other cores at most, but %d ns may be executed meanwhile" % (
                loop["id"], longest, self.computer.executed(self, loop, longest))

    def faults_of_handler(self, section):
        """Its lock is its own core's, and no other handler is connected with it."""
        locks, cores = {section["lock"]}, self.computer.cores
        said = [(core, s) for core in cores for s in core.sections if not s["assumed"]]
        while True:
            users = {s["vcpu"] for _, s in said if s["lock"] in locks}
            more = locks | {s["lock"] for _, s in said if s["vcpu"] in users}
            if more == locks:
                break
            locks = more
        for core, other in said:
            if other["lock"] in locks and other["vcpu"] != section["vcpu"] and (core is not self or other["vcpu"] >= FIRST_IO):
                yield "the handler on I/O VCPU %d shares a lock with VCPU %d, of another core or a handler as well" % (
                    section["vcpu"], other["vcpu"])

    def faults(self):
        ids = [each["id"] for each in self.loops + self.ios]
        for section in self.sections:
            if section["vcpu"] >= FIRST_IO and not section["assumed"]:
                yield from self.faults_of_handler(section)
        if self.claim["owned"]:
            if len(ids) != 1 or not self.loops or self.loops[0]["budget_ns"] != self.loops[0]["period_ns"]:
                yield "claimed as owned by one loop, and is not"
            elif self.computer.waits(self.loops[0]["id"]):
                yield "claimed as owned, by a loop that waits for other cores"
            return
        late = [(io, client) for io in self.ios if self.loops for client in self.clients(io) if not self.fits(io, client)]
        if late and not all(self.meets_beside_whole_services(i) for i in range(len(self.loops))):
            for io, client in late:
                yield "bottom half %d: a service for a client of %d ns does not end within that" % (io["id"], client)
        by_bound = bool(self.loops) and self.within_bound()
        for i, loop in enumerate(self.loops):
            if loop["suspension_ns"] and not loop["deferrable"]:
                yield "loop %d sleeps, and its budget does not come back at its releases" % loop["id"]
            if self.computer.waits(loop["id"]):
                yield from self.faults_of_wait(loop)
            response = loop["response_ns"]
            if response > loop["period_ns"]:
                yield "loop %d: R = %d ns is beyond its period" % (loop["id"], response)
            elif not by_bound and self.demand(i, response) > response:
                yield "loop %d: claimed R = %d ns, but up to then %d ns are asked for" % (
                    loop["id"], response, self.demand(i, response))


class Computer:
    """All cores, and the loops that locks connect across them."""

    def __init__(self, claims):
        self.cores = [Core(claim, self) for claim in claims]
        self.few_priorities = any(sum(len(c["loops"]) + len(c["ios"]) for c in claims) > claim["priorities"] for claim in claims)
        self.where = {loop["id"]: core for core in self.cores for loop in core.loops}
        self.loop = {loop["id"]: loop for core in self.cores for loop in core.loops}
        self.sections = [s for core in self.cores for s in core.sections]
        self.held = held = [(s["vcpu"], s["lock"]) for s in self.sections if s["length_ns"] and s["vcpu"] in self.loop and not s["assumed"]]
        self.groups = {}
        for one in {loop for loop, _ in held}:
            group = {one}
            while True:
                locks = {lock for loop, lock in held if loop in group}
                more = {loop for loop, lock in held if lock in locks}
                if more == group:
                    break
                group = more
            self.groups[one] = group
        for core in self.cores:
            core.keep_for_others()

    def waits(self, number):
        return len({id(self.where[each]) for each in self.groups.get(number, ())}) > 1

    def executed(self, its_core, waiter, window, own_core=True):
        total, first = 0, []
        for core in self.cores:
            holders = [self.loop[each] for each in self.groups.get(waiter["id"], ()) if self.where[each] is core and each != waiter["id"]]
            if holders and (own_core or core is not its_core):
                total += core.executed(waiter, max(holders, key=rank), window)
                first += [core.locked(each) for each in holders if self.holds_first(each, waiter)]
        return total + max(first, default=0)

    def above(self, loop, waiter):
        """Loops of one period on different cores may have one priority."""
        if self.few_priorities:
            return True
        if self.where[loop["id"]] is self.where[waiter["id"]]:
            return rank(loop) < rank(waiter)
        return loop["period_ns"] <= waiter["period_ns"]

    def holds_first(self, loop, waiter):
        """With one lock alone, a lower loop can have it before the waiter only if it has it already."""
        group = self.groups[waiter["id"]]
        return len({lock for each, lock in self.held if each in group}) == 1 and loop["id"] in group and not self.above(loop, waiter)

    def lifted(self, core, loop):
        """By lower loops of its core, at the rank of loops that wait elsewhere: at one time."""
        total = 0
        for lower in core.loops:
            if rank(lower) <= rank(loop) or not self.waits(lower["id"]):
                continue
            for_whom = [self.loop[each] for each in self.groups[lower["id"]] if each != lower["id"]]
            if self.few_priorities or any(each["period_ns"] <= loop["period_ns"] for each in for_whom):
                total += core.locked(lower)
        return total


class Chain:
    """The claim about one chain, from the claims about its stages (sched/chain.h has the argument).

    An event waits for a period of the first stage (a bottom half begins with its edge). What a release has written when it ends is read by
    the first release of the next loop behind that: R of the one and T of the other, or T alone on one core where the first ranks above and
    never gives the core up. Releases are whole periods from one origin, so two of them are a multiple of the periods' gcd apart.
    """

    def __init__(self, claim, computer):
        self.claim = claim
        self.computer = computer
        self.stages = claim["stages"]

    def is_io(self, stage):
        return "replenishment_ns" in stage

    def period(self, stage):
        return 0 if self.is_io(stage) else stage["pass_ns"] or self.computer.loop[stage["id"]]["period_ns"]

    def ends_within(self, stage):
        if self.is_io(stage):
            return stage["replenishment_ns"] + stage["response_ns"]
        return stage["pass_ns"] or self.computer.loop[stage["id"]]["response_ns"]

    def is_released(self, stage):
        return not self.is_io(stage) and not stage["pass_ns"]

    def done_before(self, one, other):
        if not (self.is_released(one) and self.is_released(other)):
            return False
        first, second = self.computer.loop[one["id"]], self.computer.loop[other["id"]]
        core = self.computer.where[first["id"]]
        return (core is self.computer.where[second["id"]] and rank(first) < rank(second) and not first["suspension_ns"]
                and not self.computer.waits(first["id"]) and not core.last_priority(core.loops.index(first)))

    def apart(self, one, other, period):
        distance = period + (0 if self.done_before(one, other) else self.ends_within(one))
        if not (self.is_released(one) and self.is_released(other)):
            return distance
        grid = math.gcd(self.period(one), self.period(other))
        return distance // grid * grid

    def faults(self):
        name = self.claim["name"]
        for number, stage in enumerate(self.stages):
            if self.is_io(stage):
                yield from self.faults_of_bottom_half(number, stage)
            elif stage["id"] not in self.computer.loop:
                yield "chain %s: there is no loop %d" % (name, stage["id"])
                return
            elif stage["pass_ns"] and not self.computer.where[stage["id"]].claim["owned"]:
                yield "chain %s: loop %d does not own its core" % (name, stage["id"])
        last = self.ends_within(self.stages[-1])
        pairs = list(zip(self.stages, self.stages[1:]))
        forward = [self.apart(one, other, self.period(other)) for one, other in pairs]
        backward = [self.apart(one, other, self.period(one)) for one, other in pairs]
        reaction = self.period(self.stages[0]) + sum(forward) + last
        age = sum(max(old, new) if other["queued"] else old for old, new, (_, other) in zip(backward, forward, pairs)) + last
        for what, claimed, least, limit in (("reaction", self.claim["reaction_ns"], reaction, self.claim["reaction_limit_ns"]),
                                            ("age", self.claim["age_ns"], age, self.claim["age_limit_ns"])):
            if claimed is None:
                if not self.is_io(self.stages[0]) or limit:
                    yield "chain %s: no %s is claimed" % (name, what)
            elif claimed < least:
                yield "chain %s: claimed %s = %d ns, and %d ns follow" % (name, what, claimed, least)
            elif limit and claimed > limit:
                yield "chain %s: %s = %d ns is beyond its limit" % (name, what, claimed)

    def faults_of_bottom_half(self, number, stage):
        """Its R, put into its own equation: its service, what ranks above its client, and the other bottom halves."""
        name = self.claim["name"]
        found = [(core, io) for core in self.computer.cores for io in core.ios if io["id"] == stage["id"]]
        if number or not found or not found[0][0].loops:
            yield "chain %s: bottom half %d cannot be there" % (name, stage["id"])
            return
        core, io = found[0]
        client = io["client_period_ns"] or core.loops[0]["period_ns"]
        window = stage["response_ns"]
        asked = core.asked_by_service(io, client, window)
        if asked > window or stage["replenishment_ns"] < client:
            yield "chain %s: claimed R = %d ns of bottom half %d, but up to then %d ns are asked for" % (name, window, stage["id"], asked)


# ---- what no core can have ----------------------------------------------------------------------

LONGEST = 16 * DAY + 1  # of any R
NUMBERS = {  # key: the least, the greatest
    "core": {"core": (0, 63), "priorities": (1, 63), "activation_ns": (0, DAY), "wait_ns": (0, DAY), "wake_ns": (0, DAY),
             "kept_ns": (0, DAY), "kept_period_ns": (0, DAY)},
    "interferer": {"cost_ns": (0, DAY), "interval_ns": (0, 10**15), "jitter_ns": (0, 10**18),
                   "peak_interval_ns": (1, 10**15), "peak_jitter_ns": (0, 10**18)},
    "section": {"vcpu": (1, 63), "lock": (0, 31), "length_ns": (0, DAY)},
    "io": {"id": (FIRST_IO, 63), "budget_ns": (1, DAY), "period_ns": (1, DAY), "client_period_ns": (0, DAY), "edge_ns": (0, DAY),
           "edge_interval_ns": (0, 10**15)},
    "loop": {"id": (1, FIRST_IO - 1), "budget_ns": (1, DAY), "period_ns": (1, DAY), "suspension_ns": (0, DAY), "sleeps": (0, 10**6),
             "longest_wait_ns": (0, LONGEST), "response_ns": (1, LONGEST)},
    "chain": {"reaction_limit_ns": (0, 16 * LONGEST), "age_limit_ns": (0, 16 * LONGEST)},
    "bound": {"reaction_ns": (1, 16 * LONGEST), "age_ns": (1, 16 * LONGEST)},
    "stage": {"id": (1, 63), "pass_ns": (0, DAY)},
    "bottom half": {"response_ns": (1, LONGEST), "replenishment_ns": (1, DAY)},
}
BOTH_OR_NONE = {"interferer": ["peak_interval_ns", "peak_jitter_ns"]}
FLAGS = {"core": ["owned", "victim_pays"], "section": ["assumed"], "loop": ["deferrable"], "stage": ["queued"]}


def faults_of_form(what, claim):
    if not isinstance(claim, dict):
        yield "%s is no table of numbers" % what
        return
    absent = set() if set(BOTH_OR_NONE.get(what, ())) & set(claim) else set(BOTH_OR_NONE.get(what, ()))
    for key, (least, greatest) in NUMBERS[what].items():
        if key in absent:
            continue
        number = claim.get(key)
        if not isinstance(number, int) or isinstance(number, bool) or not least <= number <= greatest:
            yield "%s: %s is %s, and must be a whole number of %d to %d" % (what, key, json.dumps(number), least, greatest)
    for key in FLAGS.get(what, ()):
        if not isinstance(claim.get(key), bool):
            yield "%s: %s is neither true nor false" % (what, key)


def faults_of_core_form(claim):
    yield from faults_of_form("core", claim)
    if not isinstance(claim, dict):
        return
    for what, key in (("interferer", "interferers"), ("section", "sections"), ("io", "ios"), ("loop", "loops")):
        if not isinstance(claim.get(key), list):
            yield "core: it has no list of %s" % key
            continue
        for each in claim[key]:
            yield from faults_of_form(what, each)


def faults_of_chain_form(claim):
    yield from faults_of_form("chain", claim)
    if not isinstance(claim, dict):
        return
    if not isinstance(claim.get("name"), str):
        yield "chain: its name is no text"
    # What has no bound says null.
    missing = [key for key in NUMBERS["bound"] if key not in claim]
    yield from ("chain: it says nothing of %s" % key for key in missing)
    yield from faults_of_form("bound", {key: 1 for key in NUMBERS["bound"]} | {
        key: claim[key] for key in NUMBERS["bound"] if claim.get(key) is not None})
    stages = claim.get("stages")
    if not isinstance(stages, list) or not stages:
        yield "chain: it has no list of stages"
        return
    for stage in stages:
        yield from faults_of_form("stage", stage)
        if isinstance(stage, dict) and ("replenishment_ns" in stage or "response_ns" in stage):
            yield from faults_of_form("bottom half", stage)


def faults_of_meaning(claim):
    """Numbers that are possible each, and not together."""
    for each in claim["interferers"]:
        if each["cost_ns"] and not each["interval_ns"]:
            yield "an interferer takes time, and its interval is 0"
    for io in claim["ios"]:
        if io["edge_ns"] and not io["edge_interval_ns"]:
            yield "VCPU %d: its edges take time, and their interval is 0" % io["id"]
    for each in claim["loops"] + claim["ios"]:
        if each["budget_ns"] > each["period_ns"]:
            yield "VCPU %d: its budget is beyond its period" % each["id"]
    for loop in claim["loops"]:
        if loop["suspension_ns"] and not loop["sleeps"]:
            yield "loop %d sleeps for %d ns in no sleeps at all" % (loop["id"], loop["suspension_ns"])
    if claim["kept_ns"] > claim["kept_period_ns"]:
        yield "the kernel keeps %d ns of every %d" % (claim["kept_ns"], claim["kept_period_ns"])
    here = [each["id"] for each in claim["loops"] + claim["ios"]]
    for section in claim["sections"]:
        if section["vcpu"] not in here:
            yield "a critical section of VCPU %d, which is not on this core" % section["vcpu"]


def faults_of(certificate):
    if not isinstance(certificate, dict) or certificate.get("certificate") != 3:
        yield "not a certificate of this version"
        return
    claims = certificate.get("cores")
    if not isinstance(claims, list) or not claims:
        yield "it says nothing of any core"
        return
    chains = certificate.get("chains", [])
    if not isinstance(chains, list):
        yield "its chains are no list"
        return
    forms = [fault for claim in claims for fault in faults_of_core_form(claim)]
    forms += [fault for claim in chains for fault in faults_of_chain_form(claim)]
    yield from forms
    if forms:
        return
    meanings = ["core %d: %s" % (claim["core"], fault) for claim in claims for fault in faults_of_meaning(claim)]
    numbers = [claim["core"] for claim in claims]
    vcpus = [each["id"] for claim in claims for each in claim["loops"] + claim["ios"]]
    meanings += ["core %d is there twice" % number for number in sorted(set(numbers)) if numbers.count(number) > 1]
    meanings += ["two VCPUs have the number %d" % number for number in sorted(set(vcpus)) if vcpus.count(number) > 1]
    yield from meanings
    if meanings:
        return
    computer = Computer(claims)
    for core in computer.cores:
        for fault in core.faults():
            yield "core %d: %s" % (core.claim["core"], fault)
    for claim in chains:
        yield from Chain(claim, computer).faults()


# ---- whose it is --------------------------------------------------------------------------------

def digest_of(certificate):
    rest = {key: value for key, value in certificate.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(rest, separators=(",", ":"), ensure_ascii=False).encode()).hexdigest()


def faults_of_binding(certificate, sketches, board):
    """It is as it was written, and of these texts."""
    if not isinstance(certificate, dict):
        return
    if certificate.get("sha256") != digest_of(certificate):
        yield "the certificate was changed after it was written: its SHA-256 is another"
    sources, text = certificate.get("sources"), certificate.get("board")
    for claim in (sources if isinstance(sources, list) else [sources]) + ([text] if text is not None else []):
        if not isinstance(claim, dict) or any(not isinstance(claim.get(key), str) for key in ("file", "sha256")):
            yield "of a source or board file it does not say the name and the SHA-256"
            return
    texts = [("source", certificate.get("sources"))] if sketches else []
    for what, claims in texts + ([("board file", [certificate.get("board")])] if board else []):
        hashes = {claim.get("sha256") for claim in claims or [] if isinstance(claim, dict)}
        for path in sketches if what == "source" else [board]:
            with open(path, "rb") as file:
                if hashlib.sha256(file.read()).hexdigest() not in hashes:
                    yield "it is not of this %s: %s" % (what, path)
        if what == "source" and len(hashes) != len(sketches):
            yield "it is of %d source files, and not of %d" % (len(hashes), len(sketches))


# ---- its own cases ------------------------------------------------------------------------------

def loop(number, budget, period, response, **others):
    return {"id": number, "budget_ns": budget, "period_ns": period, "response_ns": response, "suspension_ns": 0, "sleeps": 1,
            "deferrable": False, "longest_wait_ns": 0} | others


def core(loops, **others):
    return {"certificate": 3, "cores": [{"core": 0, "wait_ns": 0, "wake_ns": 0, "victim_pays": False, "owned": False, "priorities": 32, "activation_ns": 0, "kept_ns": 0, "kept_period_ns": 0, "interferers": [],
                                         "sections": [], "ios": [], "loops": loops} | others]}


def chain(numbers, reaction, age, queued=False, **others):
    stages = [{"id": number, "pass_ns": 0, "queued": queued and place > 0} for place, number in enumerate(numbers)]
    return {"name": "chain", "stages": stages, "reaction_ns": reaction, "age_ns": age, "reaction_limit_ns": 0, "age_limit_ns": 0} | others


def section(vcpu, lock, length):
    return {"vcpu": vcpu, "lock": lock, "length_ns": length, "assumed": False}


def handler(number, budget, period):
    return {"id": number, "budget_ns": budget, "period_ns": period, "client_period_ns": 0, "edge_ns": 0, "edge_interval_ns": 0}


def twice(certificate):
    """The same core again, under other loops' numbers."""
    certificate = copy.deepcopy(certificate)
    certificate["cores"] += core([loop(9, 1, 100, 1)])["cores"]
    return certificate


def self_test():
    golden = core([loop(1, 30, 100, 50), loop(2, 20, 100, 86), loop(3, 4, 10, 4)])
    locks = core([loop(1, 2, 12, 7), loop(2, 6, 35, 8)], sections=[section(1, 0, 1), section(2, 0, 5)])
    asleep = core([loop(1, 6, 20, 6), loop(2, 8, 30, 29, suspension_ns=9, deferrable=True)])
    # 6; 5 + ceil(w/10) 6 + 1 + (w - 1)/10.
    io = core([loop(1, 6, 10, 6), loop(2, 5, 40, 20)], ios=[handler(33, 1, 10)])
    # It may go before loop 1, too: 6 + 1 + (7 - 1)/10 up.
    same = core([loop(1, 6, 10, 8)], ios=io["cores"][0]["ios"], priorities=1)
    # A service that meets loop 1 twice needs 1 + 2*6; the paper's term asks for 6 + 2*1.
    early = core([loop(1, 6, 10, 6, deferrable=True)], ios=[handler(33, 1, 10)])
    owned = core([loop(1, 10, 10, 10)], owned=True)
    # Loop 1 waits for loop 2, and loop 2 for loop 1, and for loop 3 that may run meanwhile.
    apart = core([loop(1, 2, 20, 7, deferrable=True, longest_wait_ns=6)], sections=[section(1, 0, 1)])
    apart["cores"] += core([loop(2, 6, 50, 10, deferrable=True, longest_wait_ns=3), loop(3, 2, 10, 5)], core=1,
                           sections=[section(2, 0, 3)])["cores"]
    late = core([loop(1, 30, 100, 32), loop(2, 20, 200, 52)], wake_ns=2)
    # The interrupt takes 10 of each 100, out of the budget of loop 1, whose server has so much
    # more.
    paid = core([loop(1, 50, 100, 60), loop(2, 40, 200, 180)], victim_pays=True,
                interferers=[{"cost_ns": 10, "interval_ns": 100, "jitter_ns": 0}])
    # Five may come at once, and in short windows no more than one in 20.
    bursts = core([loop(1, 30, 100, 70), loop(2, 130, 300, 290)], interferers=[{"cost_ns": 10, "interval_ns": 100, "jitter_ns": 400, "peak_interval_ns": 20, "peak_jitter_ns": 10}])
    edges = core([loop(1, 60, 100, 75), loop(2, 10, 300, 170)], ios=[handler(33, 2, 100) | {"edge_ns": 1, "edge_interval_ns": 5}])
    # The handler may hold the lock without budget, whatever its rank.
    held = core([loop(1, 4, 20, 14), loop(2, 5, 60, 34)], ios=[handler(33, 1, 20)], sections=[section(1, 0, 1), section(33, 0, 8)])
    kept = core([loop(1, 50, 100, 50), loop(2, 39, 100, 99)], kept_ns=10, kept_period_ns=100)

    chained = core([loop(1, 2, 10, 3), loop(2, 4, 40, 8)],
                   ios=[{"id": 33, "budget_ns": 1, "period_ns": 10, "client_period_ns": 0, "edge_ns": 0, "edge_interval_ns": 0}])
    chained["cores"] += core([loop(3, 5, 20, 5)], core=1)["cores"]
    bottom_half = {"id": 33, "pass_ns": 0, "queued": False, "response_ns": 3, "replenishment_ns": 10}
    chained["chains"] = [
        # T1 + D(1,2) + D(2,3) + R3. Loop 1 is done before loop 2 begins; 20 + 8 is no multiple of
        # 20.
        chain([1, 2, 3], 10 + 40 + 20 + 5, 10 + 40 + 5),
        chain([2, 1], 40 + 10 + 3, 40 + 3, reaction_limit_ns=53), chain([2, 1], 53, 43, queued=True),
        chain([3], 20 + 5, 5)]
    not_a_number = float("nan")
    chained["chains"].append(chain([3], 3 + 10 + 20 + 5, None) | {"stages": [bottom_half] + chain([3], 0, 0)["stages"]})

    def broken(certificate, change):
        certificate = copy.deepcopy(certificate)
        change(certificate["cores"][0])
        return certificate

    def less(number):
        return lambda c: c["loops"][number].update(response_ns=c["loops"][number]["response_ns"] - 1)

    def chain_of(number, **changes):
        certificate = copy.deepcopy(chained)
        for key, value in changes.items():
            certificate["chains"][number][key] = value
        return certificate

    good = [golden, locks, asleep, io, same, early, owned, kept, apart, late, paid, bursts, edges, held, chained]
    bad = [broken(golden, less(0)), broken(golden, less(1)), broken(golden, lambda c: c["loops"][2].update(budget_ns=5)),
           broken(golden, lambda c: c["interferers"].append({"cost_ns": 15, "interval_ns": 100, "jitter_ns": 0})),
           broken(golden, lambda c: c.update(activation_ns=2)), broken(golden, lambda c: c["loops"][0].update(id=2)),
           broken(locks, less(0)), broken(locks, lambda c: c["sections"][1].update(length_ns=6)),
           broken(asleep, lambda c: c["loops"][1].update(deferrable=False)), broken(asleep, lambda c: c["loops"][1].update(suspension_ns=11)),
           broken(io, less(0)), broken(io, less(1)), broken(same, less(0)), broken(early, lambda c: c["ios"][0].update(budget_ns=3)), broken(io, lambda c: c["ios"][0].update(budget_ns=5)),
           broken(kept, lambda c: c["loops"][1].update(budget_ns=41)), broken(owned, lambda c: c["loops"].append(loop(2, 1, 10, 1))),
           {"certificate": 1}, [], {"certificate": 3}, {"certificate": 3, "cores": [7]},
           broken(late, less(0)), broken(late, lambda c: c.update(wake_ns=3)), broken(paid, less(1)), broken(paid, less(0)),
           broken(bursts, less(0)), broken(bursts, lambda c: c["interferers"][0].update(peak_jitter_ns=11)),
           broken(bursts, lambda c: c["interferers"][0].pop("peak_jitter_ns")),
           broken(bursts, lambda c: c["interferers"][0].pop("peak_jitter_ns") or c["interferers"][0].pop("peak_interval_ns")),
           broken(edges, less(0)), broken(edges, lambda c: c["ios"][0].update(edge_ns=2)), broken(edges, lambda c: c["ios"][0].update(edge_interval_ns=0)),
           broken(held, less(0)), broken(held, less(1)), broken(held, lambda c: c["sections"][1].update(length_ns=9)),
           broken(held, lambda c: c["ios"].append(handler(34, 1, 50)) or c["sections"].append(section(34, 0, 1))),
           broken(locks, less(1)), twice(golden), broken(asleep, lambda c: c["loops"][1].update(sleeps=0)),
           broken(kept, lambda c: c.update(kept_period_ns=0)), broken(golden, lambda c: c["loops"][0].update(period_ns=0)),
           broken(golden, lambda c: c["loops"][0].update(period_ns="100")), broken(golden, lambda c: c["loops"][0].pop("period_ns")),
           broken(golden, lambda c: c["interferers"].append({"cost_ns": 1, "interval_ns": 0, "jitter_ns": 0})),
           broken(apart, less(0)), broken(apart, lambda c: c["loops"][0].update(deferrable=False)),
           chain_of(0, reaction_ns=74), chain_of(0, age_ns=54), chain_of(1, reaction_ns=52), chain_of(1, reaction_limit_ns=52),
           chain_of(1, age_ns=None), chain_of(3, age_ns=4), chain_of(4, reaction_ns=37), chain_of(4, age_limit_ns=50),
           chain_of(3, stages=[{"id": 9, "pass_ns": 0, "queued": False}]), chain_of(3, stages=[{"id": 3, "pass_ns": 5, "queued": False}]),
           chain_of(4, stages=[bottom_half | {"response_ns": 2}] + chained["chains"][3]["stages"]),
           chain_of(0, reaction_ns=not_a_number), chain_of(0, age_ns="55"), chain_of(1, reaction_limit_ns=not_a_number), chain_of(0, stages=[]),
           chain_of(0, stages=[{"id": None, "pass_ns": 0, "queued": False}]), chain_of(3, stages=[{"id": 3, "pass_ns": 0, "queued": "no"}]),
           chain_of(0, age_ns=-55), chain_of(0, name=None), chained | {"chains": 7}, broken(golden, lambda c: c.update(priorities=64)),
           broken(apart, lambda c: c["loops"][0].update(longest_wait_ns=5)), broken(apart, lambda c: c["loops"][0].update(longest_wait_ns=0))]
    whole = golden | {"sources": [{"file": "a.ino", "sha256": "1"}], "board": None}
    whole["sha256"] = digest_of(whole)
    milder = broken(whole, lambda c: c["loops"][0].update(response_ns=60))
    nameless = whole | {"sources": [{"file": None, "sha256": "1"}]}
    nameless["sha256"] = digest_of(nameless)
    if list(faults_of_binding(whole, [], None)) or not all(list(faults_of_binding(each, [], None)) for each in (milder, nameless)):
        print("a change that makes nothing stronger is not seen")
        return 1
    wrong = [number for number, each in enumerate(good) if list(faults_of(each))]
    missed = [number for number, each in enumerate(bad) if not list(faults_of(each))]
    for number in wrong:
        print("good case %d: %s" % (number, list(faults_of(good[number]))))
    for number in missed:
        print("bad case %d is not seen" % number)
    print("certificate: %d good cases, %d bad ones, %d wrong" % (len(good), len(bad), len(wrong) + len(missed)))
    return 1 if wrong or missed else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    parser = argparse.ArgumentParser(description="Verifies a certificate of `qduino check`.")
    parser.add_argument("file")
    parser.add_argument("--sketch", action="append", default=[], help="a source file of the sketch; all of them, or none")
    parser.add_argument("--board", help="the board file")
    given = parser.parse_args(arguments)
    try:
        with open(given.file, encoding="utf-8") as file:
            certificate = json.load(file)
        faults = list(faults_of_binding(certificate, given.sketch, given.board)) + list(faults_of(certificate))
    except (OSError, ValueError) as problem:
        print("certificate: it cannot be read: %s" % problem)
        return 1
    for fault in faults:
        print(fault)
    for name in certificate.get("locks_that_say_nothing") or [] if not faults else []:
        print("note: R is unknown if loops of two cores, or a handler, share %s, which says nothing" % name)
    print("certificate: %s" % ("%d claims do not hold" % len(faults) if faults else "%d cores, %d loops: every claim holds" % (
        len(certificate["cores"]), sum(len(c["loops"]) for c in certificate["cores"]))))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
