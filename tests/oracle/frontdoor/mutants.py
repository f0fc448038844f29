"""Does the front door see what admission has left out? Plants one mistake at a time in the scheduler, the analysis or what feeds it, builds, and counts
the random sets until a release is late or beyond R. By hand:

    mutants.py FOLDER [--only WORD] [--sets 200] [--seed 1] [--build COMMAND] [--kinds KIND…]

FOLDER gets a copy of the sources and a build of its own, both made or brought up to date first: the tree that this script is of stays as it is.

The difficulty: a search that finds nothing may be blind. Each mistake here is one that was made, or would be, beside the model: servers that begin
when they are told, locks and interrupts that no table has, changes at run time that are judged by half. A set counts only if it has the feature that
the mistake is about, so that the number says how well the generator hits it.
"""

import argparse
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import planted_mutants  # noqa: E402

FUZZ = pathlib.Path(__file__).with_name("front_door.py")
SCHEDULER, ANALYSIS, LOAD, BOARD = "sched/core_scheduler.cpp", "sched/completion_time.cpp", "sched/load.cpp", "board/sim/sim_board.cpp"
PLAN, BLOCKING, DECLARED = "runtime/plan.cpp", "sched/blocking.cpp", "runtime/lock_declaration.h"

# name, what each set has, file, what stands there and what is planted
MUTANTS = (
    ("release: a server begins when its loop wakes", "interrupts", SCHEDULER,
     (("std::min(std::max(due, vcpu.blocked_at), now)", "std::max(due, now)"),)),
    ("payment: a waiter pays for a handler's section", "handlers with locks", PLAN,
     (("if (spec.is_io()) spec.overrun = sched::longest_overrun(sections_, spec.id);", ""),)),
    ("locks: handlers have no sections", "handlers with locks", BLOCKING, (("by_handlers_[section.lock] += section.length;", ""),)),
    ("locks: none blocks from below", "locks", ANALYSIS, (("held_up_[i] += begins * blocked_[i];", ""),)),
    ("locks: one that says nothing is nobody's", "locks that say nothing", DECLARED,
     (("} else if (lock.assumed_of(Nanoseconds{1}, board) > Nanoseconds{0}) {", "} else if (lock.too_many_) {"),)),
    ("tables: what no longer fits in is left out", "many interrupts", LOAD,
     (("    bears.cost += interferer.cost;\n", ""), ("bears.interval = std::min(bears.interval, interferer.interval);", ""))),
    ("wake: late wake-ups are in no R", "late wake-ups", BOARD, (("overheads.wake_latency = config_.wake_latency;", ""),)),
    ("edges: their top halves are in no R", "edges that take time", PLAN, (("    io.edge_cost += cost.each;\n", ""),)),
    ("victims: what a budget pays for interrupts is in no R", "victims that pay", BOARD,
     (("overheads.victim_pays = config_.charge_interrupts_to_victim;", ""),)),
    ("sleeps: their switches are in no R", "sleeps in pieces", ANALYSIS,
     (("overheads_.per_release(loop, requests_of(load.sections, loop.id))", "overheads_.per_activation()"),)),
    ("sleeps: a lock blocks once in a release", "sleeps in pieces", ANALYSIS, (("held_up_[i] += begins * blocked_[i];", "held_up_[i] += blocked_[i];"),)),
    ("changes: what another core refuses stays on core 0", "budgets and routes at once", PLAN,
     (("    restore(judged ? asked_ : before_);", "    if (!judged) before_[0].overheads = asked_[0].overheads;\n    restore(judged ? asked_ : before_);"),)),
    ("changes: what was routed away is forgotten", "changes", PLAN, (("    if (judged) judged = note_routed_away(now);\n", ""),)),
    ("changes: what was lowered is forgotten", "budgets that are exchanged", PLAN, (("        note_lowered(*load, *request, now);\n", ""),)),
    ("bottom halves: their longest service is left out", "bottom halves", ANALYSIS,
     (("longest_service_of(ios_[k], named > Nanoseconds{0} ? named : *std::prev(beyond), overhead_);", "Nanoseconds{1};"),)),
    ("bottom halves: go before loops of their client's period", "bottom halves", SCHEDULER,
     (("return {vcpu.server.rank_period(), vcpu.id};", "return {vcpu.server.rank_period(), vcpu.server.is_io() ? VcpuId{0} : vcpu.id};"),)),
    ("jitter: a deferrable server counts as a sporadic one", "interrupts", ANALYSIS,
     (("return loops_[j].deferrable || waits_[j].requests > 0", "return waits_[j].requests > 0"),)),
)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--build", default="test -e build/release/build.ninja || cmake --preset release; cmake --build --preset release -j %d --target qduino"
                        % (os.cpu_count() or 1), help="the command, in FOLDER")
    parser.add_argument("--kinds", nargs="+", default=["late", "beyond R"])
    options = parser.parse_args()
    folder = options.folder.resolve()
    if folder == planted_mutants.ROOT:
        raise SystemExit("FOLDER is the tree that this script is of: name another one")
    folder.mkdir(parents=True, exist_ok=True)
    planted_mutants.copy_sources(folder)
    having = {name: feature for name, feature, _, _ in MUTANTS}
    program = folder / "build/release/bin/qduino"

    def fuzz(name):
        return [sys.executable, "-B", FUZZ, program, "--sets", options.sets, "--seed", options.seed, "--having", having[name], "--kinds", *options.kinds,
                "--most", 1, "--written", 0, "--patience", 20]

    mutants = [(name, file, changes) for name, _, file, changes in MUTANTS]
    return 1 if planted_mutants.unseen_of(mutants, options.build, fuzz, options.only, folder) else 0


if __name__ == "__main__":
    sys.exit(main())
