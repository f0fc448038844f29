"""Chains of small integer task sets, explored whole: is admission's bound on reaction and age ever too low, and how tight is it?

    chain_model.py PROGRAM [--sets N] [--mutant]

PROGRAM (chain_bounds.cpp) says the bounds. Nothing else of the analysis is here: a preemptive scheduler of fixed priorities moves tick by
tick, and each job takes any time from 1 to its budget. A job reads when it first runs and writes when it has ended. All that can happen is
followed, with the state of every job and the stamps of all data as one node of a graph, until no new node comes. The loops are released
together (as the runtime does); the same loops with other offsets are explored too, and held against the bound for any phasing, which this file
derives from R alone: it shows that a common origin is what the rounding needs.

Data: a stamp is how long ago a value was read from the input, an age. For a reaction the stamp of the output before counts, when another value
comes out: an input that changed just behind that read was not answered until now. Two cores at one instant: what is written there may be seen
or not, both are followed.

--mutant leaves the longest period of the stages behind the first out of the bound: the exploration has to find sets beyond it.
"""
import itertools
import math
import random
import subprocess
import sys

NONE = -1


class Set:
    """Loops [(budget, period, core)], numbered from 1, the chain's loops by index, and which of them drain a ring."""

    def __init__(self, loops, stages, queued, offsets):
        self.loops, self.stages, self.queued, self.offsets = loops, stages, queued, offsets
        self.hyperperiod = math.lcm(*(period for _, period, _ in loops))
        self.ranks = sorted(range(len(loops)), key=lambda i: (loops[i][1], i))
        self.worst_reaction = self.worst_age = 0
        self.limit = 6 * sum(period for _, period, _ in loops)

    # A node: (time, jobs, held, links, output, fresh). A job: ticks left (0: none), and whether it
    # has begun. held: (oldest, freshest) of each stage's job; links: (oldest, freshest, waiting)
    # behind each stage; output: the freshest stamp that came out last; fresh: what was written at
    # this instant for another core, which reads there may see or not. Stamps are ages; NONE: none.

    def explore(self):
        # Before time 0 nothing has run.
        links = ((NONE, NONE, NONE),) * (len(self.stages) - 1)
        start = (0, ((0, False),) * len(self.loops), ((NONE, NONE),) * len(self.stages), links, NONE, ())
        seen, todo = {start}, [start]
        while todo:
            for node in self.next_nodes(todo.pop()):
                if node not in seen:
                    seen.add(node)
                    todo.append(node)
        return self.worst_reaction, self.worst_age

    def next_nodes(self, node):
        now, jobs, held, links, output, fresh = node
        due = [i for i, (_, period, _) in enumerate(self.loops) if (now - self.offsets[i]) % period == 0]
        for lengths in itertools.product(*(range(1, self.loops[i][0] + 1) for i in due)):
            released = list(jobs)
            for i, length in zip(due, lengths):
                assert jobs[i][0] == 0, "an admitted job is late"
                released[i] = (length, False)
            for seen in itertools.product((False, True), repeat=len(fresh)):
                early = [write for write, is_seen in zip(fresh, seen) if is_seen]
                late = [write for write, is_seen in zip(fresh, seen) if not is_seen]
                yield self.tick(now, released, held, links, output, early, late)

    def tick(self, now, jobs, held, links, output, early, late):
        """One unit of time: who runs reads first, if it has just begun; who ends writes at the end."""
        jobs, held, links = list(jobs), list(held), [list(link) for link in links]
        self.write(links, early)
        running = []
        for core in {core for _, _, core in self.loops}:
            ready = [i for i in self.ranks if self.loops[i][2] == core and jobs[i][0]]
            running += ready[:1]
        for i in running:
            if not jobs[i][1] and i in self.stages:
                self.read(self.stages.index(i), held, links)
            jobs[i] = (jobs[i][0] - 1, True)
        self.write(links, late)
        held = [tuple(age if age == NONE else age + 1 for age in pair) for pair in held]
        links = [[age if age == NONE else age + 1 for age in link] for link in links]
        output = output if output == NONE else output + 1
        assert max([output, *(max(pair) for pair in held)]) < self.limit, "the exploration does not end"
        writers = [self.stages.index(i) for i in running if jobs[i][0] == 0 and i in self.stages]
        return self.ended(now, jobs, held, links, output, writers)

    def write(self, links, writes):
        for k, oldest, freshest in writes:
            links[k][0], links[k][1] = oldest, freshest
            if self.queued[k + 1] and links[k][2] == NONE:
                links[k][2] = oldest

    def read(self, k, held, links):
        if k == 0:
            held[0] = (0, 0)
            return
        oldest, freshest, waiting = links[k - 1]
        held[k] = (waiting if self.queued[k] and waiting != NONE else oldest, freshest)
        links[k - 1][2] = NONE

    def ended(self, now, jobs, held, links, output, writers):
        fresh = []
        for k in writers:
            oldest, freshest = held[k]
            held[k] = (NONE, NONE)
            if oldest == NONE:
                continue
            if k + 1 < len(self.stages):
                one_core = self.loops[self.stages[k]][2] == self.loops[self.stages[k + 1]][2]
                if one_core:
                    self.write(links, [(k, oldest, freshest)])
                else:
                    fresh.append((k, oldest, freshest))
                continue
            self.worst_age = max(self.worst_age, oldest)
            if freshest != output:
                if output != NONE:
                    self.worst_reaction = max(self.worst_reaction, output)
                output = freshest
        return ((now + 1) % self.hyperperiod, tuple(jobs), tuple(held), tuple(tuple(link) for link in links), output, tuple(fresh))

    # ---- the bound for any phasing --------------------------------------------------------------

    def responses(self):
        found = []
        for i, (budget, _, core) in enumerate(self.loops):
            above = [j for j in self.ranks[:self.ranks.index(i)] if self.loops[j][2] == core]
            window = budget
            while True:
                asked = budget + sum(-(-window // self.loops[j][1]) * self.loops[j][0] for j in above)
                if asked == window:
                    break
                window = asked
            found.append(window)
        return found

    def bound_for_any_phasing(self):
        ends, period = self.responses(), [period for _, period, _ in self.loops]
        reaction, age = period[self.stages[0]], 0
        for one, other, queued in zip(self.stages, self.stages[1:], self.queued[1:]):
            done = self.loops[one][2] == self.loops[other][2] and self.ranks.index(one) < self.ranks.index(other)
            forward, backward = period[other] + (0 if done else ends[one]), period[one] + (0 if done else ends[one])
            reaction += forward
            age += max(forward, backward) if queued else backward
        return reaction + ends[self.stages[-1]], age + ends[self.stages[-1]]


def random_sets(count):
    source = random.Random(20261126)
    while count:
        loops = [(source.randint(1, 2), source.choice((2, 3, 4, 5, 6)), source.choice((0, 0, 1))) for _ in range(source.choice((1, 2, 2, 3)))]
        if any(budget >= period for budget, period, _ in loops):
            continue
        if any(sum(budget / period for budget, period, at in loops if at == core) > 1 for core in (0, 1)):
            continue
        stages = list(range(len(loops)))
        source.shuffle(stages)
        stages = stages[:source.randint(max(1, len(stages) - 1), len(stages))]
        yield loops, stages, [place > 0 and source.random() < 0.4 for place in range(len(stages))]
        count -= 1


def offsets_of(loops, source):
    """Zero is the runtime's. The first loop's is the origin."""
    yield [0] * len(loops)
    every = list(itertools.product([0], *(range(period) for _, period, _ in loops[1:])))
    every = [offsets for offsets in every if any(offsets)]
    for offsets in every if len(every) <= 12 else source.sample(every, 12):
        yield list(offsets)


def ask(program, sets):
    lines = ["%s; %s; %s" % (" ".join("%d/%d@%d" % loop for loop in loops), " ".join(str(stage + 1) for stage in stages),
                             " ".join(str(int(ring)) for ring in queued)) for loops, stages, queued in sets]
    done = subprocess.run([program], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def main(arguments):
    program = arguments.pop(0)
    count = int(arguments[arguments.index("--sets") + 1]) if "--sets" in arguments else 150
    mutant = "--mutant" in arguments
    sets, source = list(random_sets(count)), random.Random(1)
    explored = beyond = 0
    tight = {"reaction": [], "age": []}
    for (loops, stages, queued), answer in zip(sets, ask(program, sets)):
        if answer == "refused":
            continue
        explored += 1
        bounds = [int(figure) // 1_000_000 for figure in answer.split()]
        if mutant and len(stages) > 1:
            left_out = max(loops[stage][1] for stage in stages[1:])
            bounds = [bound - left_out for bound in bounds]
        for offsets in offsets_of(loops, source):
            one = Set(loops, stages, queued, offsets)
            together = not any(offsets)
            limits = bounds if together else one.bound_for_any_phasing()
            for what, seen, bound in zip(("reaction", "age"), one.explore(), limits):
                if together:
                    tight[what].append(seen / bound)
                if seen > bound:
                    beyond += 1
                    if not mutant:
                        print("%s %d is beyond %d: %s" % (what, seen, bound, (loops, stages, queued, offsets)))
    for what, shares in tight.items():
        print("%s: of the bound %.0f %% are reached on average, and all of it in %d of %d sets" % (
            what, 100 * sum(shares) / max(len(shares), 1), sum(share >= 1 for share in shares), len(shares)))
    print("chains: %d sets explored, %d refused, %d times beyond the bound%s" % (
        explored, len(sets) - explored, beyond, " of the mutant" if mutant else ""))
    return int(explored < count // 2 or (beyond == 0 if mutant else beyond > 0))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
