#!/usr/bin/env python3
"""Every key of a board file that can make a loop late is read by the analysis, or says here why it need not be.

    tests/static/check_board_keys.py             exit 0: none is forgotten; 1: which one is
    tests/static/check_board_keys.py --self-test

The keys are taken from the reader of board files, with the member that each sets. What the analysis reads is the text of the functions
that tell admission what a simulated board costs. A key of neither kind, or of both, is an error; so is a reason for a key that is gone.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
READER = ROOT / "config/board_file.cpp"
# What admission is told: file, and the function's first words.
ANALYSIS = [("board/sim/sim_board.cpp", "sched::PlatformOverheads SimBoard::platform_overheads("),
            ("board/sim/sim_pins.cpp", "Nanoseconds SimPins::bus_time("),
            ("board/sim/sim_pins.h", "[[nodiscard]] EdgeCost edge_cost() const override"),
            ("board/sim/interrupts.cpp", "InterruptSource tick")]
OWN = "the loop that calls pays for it, out of its own budget"
PLACE = "says where, not how long"
FAULT = "a fault: what it does is beside the guarantee, and the run shows it"
LINUX = "on Linux what things take is measured (board/linux/computer/interference.h, overheads.h), and not said"
REASONS = {
    "sim.cores": PLACE, "sim.seed": "chooses among arrivals that are all counted", "sim.edge_poll_period": "looks at pins; takes no time",
    "sim.serial_at_baud": OWN, "sim.poll_limit": OWN, "sim.poll_cost": OWN, "sim.body_cost": OWN, "sim.spin_limit": OWN, "sim.stack_bytes": "takes no time",
    "sim.interrupt.from": "begins later; counted from the begin", "sim.interrupt.lost_from": FAULT,
    "sim.interrupt.stuck_from": FAULT, "sim.interrupt.stuck_rate_hz": FAULT,
    "sim.costs.nic_per_byte": OWN + ", or the I/O VCPU that serves the network",
} | {"sim.costs." + call: OWN for call in ("now", "pin_mode", "pin_write", "pin_read", "pwm_write", "analog_read", "sleep", "lock")}
REASONS |= {"sim.fault." + key: FAULT for key in ("loop", "extra", "pin", "level", "bus", "address", "from", "until")}
REASONS |= {"linux." + key: LINUX for key in (
    "pins", "real_time", "lock_memory", "enforce_budgets", "priority_highest", "priority_lowest", "stack_bytes", "handle_signals",
    "heartbeat_bound", "setup_bound", "isolate", "lift_throttling", "settings_state", "probe_duration")}
TABLES = {"read_costs": "sim.costs", "read_interrupt": "sim.interrupt", "read_span": "sim.fault", "read_faults": "sim.fault",
          "read_sim": "sim", "read_linux": "linux"}


def body_of(text, head):
    """From `head` to the brace that closes its function."""
    begin = text.index(head)
    at = text.index("{", begin + len(head))
    depth = 0
    for end in range(at, len(text)):
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        if depth == 0:
            return text[begin:end]
    raise ValueError("no end of " + head)


def keys_of(reader):
    """{"sim.cores": "cores", …}: each key, and the member that it sets."""
    keys = {}
    for function, table in TABLES.items():
        for key, member in re.findall(r'\b\w+\.(?:integer|duration|flag|number|choice|instant|text)\(\s*"(\w+)",\s*([\w.]+)',
                                      body_of(reader, "void %s(" % function)):
            keys[table + "." + key] = member.split(".")[-1] if not member.endswith((".number", ".value")) else member.split(".")[-2]
    calls = re.search(r"kCalls\{([^}]*)\}", reader).group(1)
    for call in re.findall(r'"(\w+)"', calls):
        keys["sim.costs." + call] = "ApiCall::" + call
    return keys


def faults_of(reader, analysis, reasons):
    keys = keys_of(reader)
    if len(keys) < 20:
        yield "only %d keys were found in the reader of board files: this check does not understand it any more" % len(keys)
    for key, member in sorted(keys.items()):
        read = re.search(r"(?<![\w:])%s\b" % re.escape(member), analysis) is not None
        if not read and key not in reasons:
            yield "%s: no analysis reads it (%s), and no reason is given (%s)" % (key, member, pathlib.Path(__file__).name)
        if read and key in reasons:
            yield "%s: the analysis reads it, and a reason says why it need not" % key
    for key in sorted(set(reasons) - set(keys)):
        yield "%s: a reason for a key that is not there" % key


def self_test(reader, analysis):
    wrong = []
    if list(faults_of(reader, analysis, REASONS)):
        wrong.append("a good tree has faults")
    for member in ("wake_latency", "edge_top_half", "edge_interval", "charge_interrupts_to_victim", "context_switch", "tick_cost", "rate_hz"):
        if not list(faults_of(reader, re.sub(r"\b%s\b" % member, "nothing", analysis), REASONS)):
            wrong.append("nobody misses " + member)
    more = reader.replace('s.integer("cores"', 's.duration("nap", config.nap);\n    s.integer("cores"')
    if not list(faults_of(more, analysis, REASONS)):
        wrong.append("a new key is not seen")
    if not list(faults_of(reader, analysis, REASONS | {"sim.gone": OWN})):
        wrong.append("a reason that is left over is not seen")
    for each in wrong:
        print(each)
    print("board keys: %d of its own cases are wrong" % len(wrong))
    return 1 if wrong else 0


def main(arguments):
    reader = READER.read_text(encoding="utf-8")
    analysis = "\n".join(body_of((ROOT / file).read_text(encoding="utf-8"), head) for file, head in ANALYSIS)
    if arguments == ["--self-test"]:
        return self_test(reader, analysis)
    faults = list(faults_of(reader, analysis, REASONS))
    for fault in faults:
        print(fault)
    print("board keys: %d, %d faults" % (len(keys_of(reader)), len(faults)))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
