#!/usr/bin/env python3
"""The layout of the house, checked: who may include whom, how long a function may be and how large a class, what may not be written.

Run from anywhere: `tools/check_layout.py`. Prints one line per offence, `file:line: what (what to do)`, and exits 1 if any.
`--self-test` shows that each rule catches an offence made for it.
"""
import graphlib
import pathlib
import re
import sys

sys.dont_write_bytecode = True

import class_size  # noqa: E402
import tree_check  # noqa: E402

FUNCTION_LINES_MAX = 70
FUNCTIONS_MAX = 40
MEMBERS_MAX = 20

# The arrows of ARCHITECTURE.md: which folders a folder may include. It may always include itself.
# "board" is the seam alone.
ARROWS = {
    "base": set(),
    "channel": {"base"},
    "posix": {"base"},
    "sched": {"base"},
    "board": {"base", "sched"},
    "board/window": {"base", "channel", "board"},
    # The board itself on top; below it what a loop is, and the pins; the computer and its kernel at
    # the bottom.
    "board/linux": {"base", "posix", "sched", "channel", "board", "board/window", "board/linux/loop", "board/linux/pin", "board/linux/computer",
                    "board/linux/kernel"},
    "board/linux/loop": {"base", "posix", "sched", "channel", "board", "board/window", "board/linux/pin", "board/linux/computer", "board/linux/kernel"},
    "board/linux/pin": {"base", "posix", "channel", "board", "board/window", "board/linux/kernel"},
    "board/linux/computer": {"base", "posix", "sched", "board", "board/linux/kernel"},
    "board/linux/kernel": {"base", "posix", "sched", "board", "board/window"},
    "board/sim": {"base", "sched", "channel", "board"},
    "board/metal": {"base", "sched", "channel", "board", "board/window"},
    "runtime": {"base", "sched", "channel", "board"},
    # The language of sketches on its functions; the libraries' faces on both, each alone (ALIKE).
    "arduino/core": {"base", "channel", "board", "runtime"},
    "arduino": {"base", "channel", "board", "runtime", "arduino/core"},
    "arduino/libraries": {"base", "channel", "board", "runtime", "arduino", "arduino/core"},
    "arduino/libraries/FastLED": {"board", "arduino", "arduino/core", "arduino/libraries/NeoPixel"},  # the wave on the wire is the same
    "arduino/api": {"arduino", "arduino/core", "arduino/libraries"},
    "arduino/host": {"base", "posix", "channel", "arduino", "arduino/core", "arduino/libraries"},
    "device": {"base"},
    "printer": {"base", "device"},  # the headers at its top, which all its parts need
    "printer/gcode": {"base", "printer"},
    "printer/motion": {"base", "printer"},
    "printer/link": {"base", "channel", "printer"},
    "printer/preflight": {"base", "printer", "printer/gcode"},
    "printer/step": {"base", "channel", "printer", "printer/motion", "printer/link"},
    "printer/heat": {"base", "channel", "printer", "printer/link"},
    "printer/machine": {"base", "channel", "printer", "printer/gcode", "printer/motion", "printer/step", "printer/heat", "printer/link"},
    "printer/estimate": {"base", "channel", "device", "printer", "printer/gcode", "printer/motion", "printer/link", "printer/heat", "printer/step",
                         "printer/preflight", "printer/machine"},
    "printer/facts": {"base", "printer", "printer/preflight", "printer/estimate"},
    "twin": {"base", "channel", "board", "device"},
    # These two know the printer by its link alone, and by the machine's numbers.
    # What needs a disk is above the spool, and is handed to it.
    "spool": {"base", "channel", "printer", "printer/link"},
    "spool/disk": {"base", "posix", "spool"},
    "analysis": {"base", "printer", "printer/estimate", "printer/facts", "printer/gcode", "printer/preflight", "spool"},
    # web/http needs no system: below the service. web/net has the sockets and TLS: above it.
    "web/http": {"base"},
    "web": {"base", "channel", "printer", "printer/link", "spool", "web/http"},
    "web/net": {"base", "posix", "spool", "web", "web/http"},
    # What programs are made of. Some of these know what a concrete board offers (MAY_NAME_A_BOARD).
    "arduino/metal": {"arduino/core", "arduino/libraries", "base", "board", "board/metal"},
    "terminal": {"base", "posix"},
    "rights": {"base", "posix"},
    "report/picture": {"base", "posix", "sched", "terminal"},
    "report/pin": {"base", "board", "posix", "report/picture", "terminal"},
    "report": {"base", "board", "board/sim", "posix", "report/picture", "runtime", "sched", "terminal"},
    "config": {"base", "board", "board/linux/kernel", "board/sim", "device", "posix", "printer", "printer/gcode", "terminal", "twin", "web/http", "web/net"},
    "link": {"base", "posix", "printer/link", "report", "runtime"},
    "vcpu": {"base", "board", "board/linux/computer", "board/linux/kernel", "posix", "report", "terminal"},
    "serial": {"base", "posix", "printer/gcode", "printer/link"},
    "inspect": {"base", "channel", "posix", "twin"},
    "beside": {"base", "board", "board/linux/computer", "board/linux/kernel", "board/linux/pin", "board/window", "link", "posix", "printer/link",
               "terminal"},
    "doctor": {"base", "beside", "board/linux/computer", "board/linux/kernel", "posix", "terminal"},
    # The command for sketches: what all its commands need at the bottom, the commands on top.
    "qduino/build": {"base", "board/linux/pin", "posix", "qduino/common", "qduino/library", "report/pin", "terminal"},
    "qduino/common": {"base", "posix"},
    "qduino/ide": {"base", "posix", "qduino/build", "qduino/common", "qduino/upload", "terminal"},
    "qduino/library": {"base", "posix", "qduino/common", "spool/disk", "terminal"},
    "qduino/metal": {"base", "board/window", "posix", "qduino/common", "qduino/trace"},
    "qduino/monitor": {"base", "posix", "qduino/upload", "serial", "terminal"},
    "qduino/trace": {"base", "board", "board/linux/loop", "posix", "qduino/build", "report", "report/picture", "report/pin", "terminal"},
    "qduino/upload": {"base", "board/linux/kernel", "posix", "qduino/common", "qduino/library", "terminal"},
    "qduino": {"base", "board/linux/kernel", "config", "posix", "qduino/build", "qduino/common", "report", "report/picture", "report/pin", "terminal"},
    "qduino/commands": {"qduino", "base", "beside", "board/linux/kernel", "board/linux/loop", "config", "doctor", "posix", "qduino/build", "qduino/common", "qduino/ide", "qduino/library", "qduino/metal", "qduino/monitor", "qduino/trace", "qduino/upload", "report", "report/picture", "report/pin", "terminal", "vcpu"},
    # The programs. None includes another.
    "apps/launcher": {"base", "board", "board/linux/kernel", "board/linux/pin", "config", "link", "posix", "rights", "terminal", "vcpu", "web/http", "web/net"},
    "apps/metal_printer": {"arduino", "arduino/libraries", "arduino/metal", "base", "board", "board/metal", "printer", "printer/facts", "printer/link",
                           "printer/preflight", "spool", "web", "web/http"},
    "apps/name": {"base", "rights", "terminal"},
    "apps/port": {"base", "board/linux/kernel", "link", "posix", "printer/gcode", "printer/link", "rights", "sched", "serial", "terminal"},
    "apps/printd": {"analysis", "base", "config", "inspect", "link", "posix", "printer", "printer/gcode", "printer/link", "rights", "serial", "spool",
                    "spool/disk", "terminal", "web", "web/net"},
    "apps/printer": {"board/linux", "config", "link", "posix", "report", "runtime", "terminal"},
    "apps/printer_sim": {"base", "board", "board/sim", "config", "inspect", "link", "posix", "printer", "printer/estimate", "printer/gcode",
                         "printer/link", "printer/preflight", "report", "report/picture", "runtime", "spool", "terminal", "twin"},
    "apps/sketch": {"arduino", "arduino/core", "arduino/metal", "base", "board/linux", "board/metal", "board/sim", "config", "posix", "report", "report/picture",
                    "report/pin", "runtime", "terminal"},
    "apps/supervisor": {"base", "board/linux/kernel", "board/linux/pin", "board/window", "link", "posix", "terminal"},
    "apps/virtual_machine": {"base", "board/linux/kernel", "board/linux/pin", "config", "inspect", "posix", "terminal", "twin"},
}
EACH_PART_HAS_A_ROW = ("printer", "board/linux", "apps", "qduino")
# Each folder here is a room, and none includes another. They share a row, but for one that has its
# own.
ALIKE = ("arduino/libraries",)
CONCRETE_BOARDS = {"board/linux", "board/sim", "board/metal"}
MAY_INCLUDE_ANYTHING = {"sketches", "tests", "bench"}
# And the rooms whose row names one: the programs and what they are made of.
MAY_NAME_A_BOARD = {"tests", "bench", "arduino/metal", "beside", "config", "doctor", "qduino", "report", "vcpu"}
SOURCES = (".h", ".cpp", ".ino")


def folder_of(path):
    """The room that a path stands in, or None: the deepest that has a row, or must have one, and else its first folder."""
    parts = pathlib.PurePosixPath(path).parts[:-1]
    for depth in range(len(parts), 1, -1):
        room = "/".join(parts[:depth])
        if room in ARROWS or "/".join(parts[: depth - 1]) in EACH_PART_HAS_A_ROW + ALIKE:
            return room
    return parts[0] if parts else None


def whole_of(room):
    """The folder whose rooms share a row with this one, or None."""
    folder = room.rpartition("/")[0] if room else None
    return folder if folder in ALIKE else None


def row_of(room):
    """The rooms that this one may include, or None: it is not in the table."""
    return ARROWS.get(room, ARROWS.get(whole_of(room)))


def circle():
    """Rooms of the table, each of which may include the next and the last the first; none: there is no such circle."""
    reached = {here: {there for there in ARROWS if there != here and ({there, whole_of(there)} & row or there in map(whole_of, row))}
               for here, row in ARROWS.items()}
    try:
        graphlib.TopologicalSorter(reached).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def may_name_a_board(room):
    return room in MAY_NAME_A_BOARD or room is not None and room.startswith(("apps/", "qduino/"))


def concrete_board(room):
    """The concrete board that a room belongs to, or None."""
    return next((board for board in CONCRETE_BOARDS if room and (room == board or room.startswith(board + "/"))), None)


def include_offences(path, text):
    here = folder_of(path)
    for number, line in enumerate(text.splitlines(), 1):
        found = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
        if not found or "/" not in found[1]:
            continue
        target = found[1]
        there = folder_of(target)
        for part in (here, there):
            if part and part.startswith(EACH_PART_HAS_A_ROW) and part not in ARROWS:
                yield number, f"{part} has no row in ARROWS (give it one)"
        if row_of(there) is None:
            continue
        if concrete_board(there) and not may_name_a_board(here) and concrete_board(here) != concrete_board(there):
            yield number, f"{here} names a concrete board ({target}); only programs and what they are made of do"
        allowed = row_of(here)
        if here in MAY_INCLUDE_ANYTHING or here == there or allowed is None:
            continue
        if there not in allowed and whole_of(there) not in allowed:
            yield number, f"{here} may not include {target} (allowed: {', '.join(sorted(allowed)) or 'nothing'})"


def strip_code(text):
    """Comments, strings and characters blanked, newlines kept."""
    pattern = re.compile(r'R"(\w*)\(.*?\)\1"|//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)
    return pattern.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)


def long_functions(text):
    """Bodies that open after a parameter list and span more than the limit."""
    code = strip_code(text)
    stack = []
    line = 1
    last_significant = ""
    statement = ""
    for c in code:
        if c == "\n":
            line += 1
        if c == "{":
            head = statement.strip()
            is_function = bool(re.search(r"\)\s*(const|noexcept|override|final|mutable|->\s*[\w:<>,&*\s]+|:\s.*|&)*\s*$", head, re.S))
            is_block = bool(re.match(r"(if|for|while|switch|else|do|catch|try|namespace|class|struct|enum|union)\b", head))
            stack.append((line, is_function and not is_block, head))
            statement = ""
        elif c == "}":
            if stack:
                start, is_function, head = stack.pop()
                if is_function and line - start + 1 > FUNCTION_LINES_MAX:
                    name = re.search(r"([~\w:]+)\s*\(", head)
                    yield start, f"function {name[1] if name else '?'} has {line - start + 1} lines (at most {FUNCTION_LINES_MAX}: split it)"
            statement = ""
        elif c == ";":
            statement = ""
        else:
            statement += c
        if not c.isspace():
            last_significant = c


# What other people's sketches call is as large as they have it. The seam is one list of all that a
# board must provide. Every other class that is still above the limit has its size here, and may not
# grow.
LARGE = {
    ("arduino/WString.h", "String"): (60, 20),
    ("arduino/libraries/FastLED/fastled/colors.h", "CRGB"): (44, 20),
    ("board/board.h", "Board"): (48, 20),
    ("board/sim/sim_board.h", "SimBoard"): (41, 20),
    ("board/linux/linux_board.h", "LinuxBoard"): (62, 22),
    ("board/linux/loop/vcpu_thread.h", "VcpuThread"): (43, 20),
    ("board/sim/event_loop.h", "EventLoop"): (55, 26),
    ("printer/machine/job_actions.h", "JobActions"): (43, 20),
    ("printer/machine/machine.h", "Machine"): (44, 20),
    ("printer/motion/planner.h", "Planner"): (43, 20),
    ("printer/preflight/preflight.h", "Preflight"): (40, 26),
    ("printer/step/solver.h", "Solver"): (40, 27),
    ("qduino/commands/metal.cpp", "Metal"): (40, 21),
    ("runtime/runtime.h", "Runtime"): (51, 20),
}


def class_offences(path, text):
    """A struct is a record: its members are a table, and have no limit."""
    if path.startswith(("tests/", "bench/")):
        return
    for line, kind, name, functions, members in class_size.class_sizes(strip_code(text)):
        functions_max, members_max = LARGE.get((path, name), (FUNCTIONS_MAX, MEMBERS_MAX))
        if functions > functions_max:
            yield line, f"{kind} {name} has {functions} functions (at most {functions_max}: take it apart)"
        if members > members_max and kind == "class":
            yield line, f"{kind} {name} has {members} members (at most {members_max}: take it apart)"
        if (path, name) in LARGE and functions <= FUNCTIONS_MAX and members <= MEMBERS_MAX:
            yield line, f"{kind} {name} is as small as others now (take it out of LARGE)"


BANNED = [
    (re.compile(r"\bsystem\s*\("), ("spool/", "web/", "apps/printd/"), "no shell: a name from outside must never reach one"),
    (re.compile(r"\b(?:steady_clock|system_clock|high_resolution_clock)::now\b"),
     ("base/", "sched/", "channel/", "printer/", "device/", "twin/", "runtime/", "board/sim/"),
     "time is a parameter: only a board hands it out"),
    (re.compile(r"\bclock_gettime\s*\("), ("base/", "sched/", "channel/", "printer/", "device/", "twin/", "runtime/", "board/sim/"),
     "time is a parameter: only a board hands it out"),
]

# What a board without an operating system below it must be able to compile (tests/freestanding and
# the images do).
WITHOUT_A_SYSTEM = ("base/", "sched/", "channel/", "runtime/", "arduino/", "device/", "board/metal/", "board/window/", "printer/", "spool/", "web/", "analysis/")
# There a system's header may be needed all the same, for a reason:
MAY_INCLUDE = {"web/http/forwarded.cpp": "arpa/inet.h",  # an address as text: every C library has that
               "spool/queue.cpp": "ctime"}               # and the calendar
# All the same: the half for Linux; and a card's words for how a file is opened are <fcntl.h>'s.
WITH_A_SYSTEM = ("arduino/host/", "arduino/libraries/SD/SD.h", "spool/disk/", "web/net/")
SYSTEM_HEADER = re.compile(r"\s*#\s*include\s*<((?:sys|linux|netinet|arpa)/[\w/.]+|unistd\.h|fcntl\.h|pthread\.h|sched\.h|signal\.h|poll\.h"
                           r"|errno\.h|time\.h|termios\.h|dirent\.h|dlfcn\.h|semaphore\.h|csignal|cerrno|ctime|thread|mutex"
                           r"|shared_mutex|condition_variable|future|semaphore|barrier|latch|stop_token|filesystem|iostream|ostream"
                           r"|istream|fstream|sstream|system_error)>")
SYSTEM_WORD = re.compile(r"\b(errno|pid_t|std::this_thread|std::thread|std::mutex)\b")


def needs_a_system(path):
    of_the_seam = path.startswith("board/") and path.count("/") == 1
    return path.startswith(WITH_A_SYSTEM) or not (of_the_seam or path.startswith(WITHOUT_A_SYSTEM))


def system_offences(path, text):
    if needs_a_system(path):
        return
    for number, line in enumerate(strip_code(text).splitlines(), 1):
        found = SYSTEM_HEADER.match(line) or SYSTEM_WORD.search(line)
        if found and found[1] != MAY_INCLUDE.get(path):
            yield number, f"'{found[1]}' here: this must compile for a board without an operating system"


def banned(path, text):
    code = strip_code(text)
    for number, line in enumerate(code.splitlines(), 1):
        for pattern, folders, why in BANNED:
            if path.startswith(folders) and pattern.search(line):
                yield number, f"'{pattern.search(line)[0]}' here: {why}"


# Rooms whose programs root runs beside other users. There a file is opened by posix/guarded_file.h,
# by another function of posix/, or here, for a reason:
OPENS_A_FILE = re.compile(r"(?<![\w.>])(?:::open|::creat|::openat|std::fopen|::fopen)\s*\(|\bstd::[io]?fstream\b")
ROOTS_ROOMS = ("board/linux/", "apps/launcher/", "link/", "apps/port/", "apps/printd/", "apps/printer/", "rights/", "apps/supervisor/",
               "apps/virtual_machine/", "vcpu/")
MAY_OPEN = {
    "board/linux/pin/bus_device.cpp": "a device",
    "board/linux/pin/gpio_pin.cpp": "a device",
    "board/linux/computer/overheads.cpp": "/proc",
    "board/linux/pin/pins_file.cpp": "a file of root in a folder of root; made with O_EXCL",
    "board/linux/kernel/real_time_thread.cpp": "a device",
    "board/linux/pin/sysfs_pin.cpp": "/sys",
    "board/linux/loop/strangers.cpp": "/proc",
    "board/linux/kernel/thread_times.cpp": "/proc",
    "board/linux/loop/warden_process.cpp": "/proc",
    "board/linux/kernel/written_files.cpp": "a folder, as a place alone (O_PATH)",
    "apps/launcher/kept_process.cpp": "/dev/null",
    "apps/launcher/link_giver.cpp": "its own descriptor, anew",
    "apps/launcher/run_log.cpp": "with O_EXCL and O_NOFOLLOW, by the rights of the service's user",
    "link/link_file.cpp": "with O_EXCL, or with O_NOFOLLOW as a service that has no rights",
    "rights/state_folder.cpp": "on descriptors, with O_NOFOLLOW, after the folder is closed",
    "rights/own_view.cpp": "what is to be seen, by O_PATH; new files in an empty root",
    "board/linux/pin/starter.cpp": "memory without a name, by an inherited descriptor",
    "apps/virtual_machine/main.cpp": "a lock of root in a folder of root",
}


def open_offences(path, text):
    if not path.startswith(ROOTS_ROOMS) or path in MAY_OPEN:
        return
    for number, line in enumerate(strip_code(text).splitlines(), 1):
        if OPENS_A_FILE.search(line):
            yield number, "a file is opened here: root may be led to another one (posix/guarded_file.h; or say why not in MAY_OPEN)"


def header_offences(path, text):
    if path.endswith(".h") and "#pragma once" not in text:
        yield 1, "header without #pragma once"
    if not re.match(r"\s*(//|/\*)", text) and path.split("/")[0] in ARROWS and path.endswith(".h"):
        yield 1, "a header's head says its purpose (begin with a comment)"


def test_namespace_offences(path, text):
    """Tests of a folder are compiled as one file, and each calls its bench `Bench`: so each has a namespace of its own."""
    stem = pathlib.PurePosixPath(path).stem
    if not stem.endswith("_test"):
        return
    opened = [(number, line[10:-2]) for number, line in enumerate(text.splitlines(), 1) if re.match(r"namespace qduino[\w:]* \{$", line)]
    if opened and not any(name.endswith("::" + stem) for _, name in opened):
        yield opened[-1][0], f"a test's namespace ends in its file's name ({opened[-1][1]}::{stem})"


def offences(path, text):
    yield from test_namespace_offences(path, text)
    yield from include_offences(path, text)
    yield from long_functions(text)
    yield from class_offences(path, text)
    yield from banned(path, text)
    yield from system_offences(path, text)
    yield from open_offences(path, text)
    yield from header_offences(path, text)


def self_test():
    long_body = "void f() {\n" + "x();\n" * 80 + "}\n"
    functions = "class C {\n  public:\n    C() : a_{1}, b_(2) {}\n" + "".join(f"    [[nodiscard]] int f{i}(int x = 1) const;\n" for i in range(39))
    members = "class C {\n    enum class E { a, b };\n    static constexpr int k = 1;\n    struct S { int x; } s_;\n" + "".join(
        f"    std::function<void(int)> m{i}_{{}};\n" for i in range(17))
    fits = functions + "  private:\n    int a_, b_ = 1;\n    C(const C&) = delete;\n    friend bool same(C, C);\n    using T = int (*)(int);\n};\n"
    cases = [
        ("printer/a.cpp", '#include "board/board.h"\n', "may not include"),
        ("twin/a.cpp", '#include "printer/machine_config.h"\n', "may not include"),
        ("spool/a.cpp", '#include "printer/gcode/lexer.h"\n', "may not include"),
        ("spool/a.cpp", '#include "spool/disk/journal.h"\n', "may not include"),
        ("spool/a.cpp", "#include <mutex>\n", "without an operating system"),
        ("printer/machine_config.h", '#include "channel/four_slot.h"\n', "may not include"),
        ("printer/gcode/a.cpp", '#include "printer/motion/planner.h"\n', "may not include"),
        ("printer/motion/a.cpp", '#include "printer/step/solver.h"\n', "may not include"),
        ("printer/link/a.cpp", '#include "printer/machine/state.h"\n', "may not include"),
        ("printer/preflight/a.cpp", '#include "printer/link/layout.h"\n', "may not include"),
        ("printer/step/a.cpp", '#include "printer/gcode/lexer.h"\n', "may not include"),
        ("printer/heat/a.cpp", '#include "printer/step/player.h"\n', "may not include"),
        ("printer/machine/a.cpp", '#include "printer/preflight/facts.h"\n', "may not include"),
        ("printer/new/a.cpp", '#include "base/time.h"\n', "no row"),
        ("apps/printd/a.cpp", '#include "printer/new/a.h"\n', "no row"),
        ("apps/new/a.cpp", '#include "base/time.h"\n', "no row"),
        ("apps/launcher/a.cpp", '#include "apps/printd/options.h"\n', "may not include"),
        ("apps/name/a.cpp", '#include "board/linux/kernel/clock.h"\n', "may not include"),
        ("arduino/core/a.cpp", '#include "arduino/Print.h"\n', "may not include"),
        ("arduino/a.cpp", '#include "arduino/libraries/Servo/Servo.h"\n', "may not include"),
        ("arduino/libraries/Servo/a.cpp", '#include "arduino/libraries/SD/SD.h"\n', "may not include"),
        ("arduino/libraries/New/a.cpp", '#include "arduino/host/state_path.h"\n', "may not include"),
        ("qduino/new/a.cpp", '#include "base/time.h"\n', "no row"),
        ("qduino/common/a.cpp", '#include "qduino/build/tool_commands.h"\n', "may not include"),
        ("terminal/a.cpp", '#include "report/guarantee_report.h"\n', "may not include"),
        ("link/a.cpp", '#include "board/linux/kernel/clock.h"\n', "concrete board"),
        ("board/linux/kernel/a.cpp", '#include "board/linux/computer/core_lock.h"\n', "may not include"),
        ("board/linux/computer/a.cpp", '#include "board/linux/loop/crew.h"\n', "may not include"),
        ("board/linux/pin/a.cpp", '#include "board/linux/loop/crew.h"\n', "may not include"),
        ("board/linux/loop/a.cpp", '#include "board/linux/linux_board.h"\n', "may not include"),
        ("board/linux/new/a.cpp", '#include "base/time.h"\n', "no row"),
        ("runtime/b.cpp", '#include "board/linux/kernel/clock.h"\n', "concrete board"),
        ("runtime/a.cpp", '#include "board/sim/sim_board.h"\n', "concrete board"),
        ("sched/a.cpp", "auto t = std::chrono::steady_clock::now();\n", "time is a parameter"),
        ("web/a.cpp", "int r = system(name);\n", "no shell"),
        ("apps/launcher/a.cpp", "int f = ::open(path, O_RDONLY);\n", "led to another one"),
        ("apps/printd/a.cpp", "std::ifstream in{path};\n", "led to another one"),
        ("arduino/libraries/New/a.cpp", "#include <unistd.h>\n", "without an operating system"),
        ("board/a.h", "// a\n#pragma once\n#include <mutex>\n", "without an operating system"),
        ("web/http/a.cpp", "#include <arpa/inet.h>\n", "without an operating system"),
        ("web/http/a.cpp", '#include "web/service.h"\n', "may not include"),
        ("web/a.cpp", '#include "web/net/tls.h"\n', "may not include"),
        ("runtime/a.cpp", "int f() { return errno; }\n", "without an operating system"),
        ("base/a.cpp", long_body, "has 82 lines"),
        ("base/a.cpp", functions + "    bool operator<(const C& other) const { return {}; }\n};\n", "has 41 functions"),
        ("base/a.cpp", members + "    int a_, b_ = 1, c_;\n};\n", "has 21 members"),
        ("base/a.cpp", "namespace n {\nvoid f() {\n" + members + "    int a_, b_, c_;\n};\n}\n}\n", "has 21 members"),
        ("base/a.cpp", "struct R {\n    void g();\n" + functions + "};\n    " + functions.replace("class C", "struct D") + "    int h();\n};\n};\n", "struct D has 41"),
        ("base/a.h", "int x;\n", "#pragma once"),
        ("tests/unit/base/time_test.cpp", "namespace qduino {\n", "qduino::time_test"),
    ]
    clean = [*offences("spool/a.cpp", '#include "printer/link/layout.h"\n#include "printer/machine_config.h"\n'),
             *offences("printer/machine/a.cpp", '#include "printer/heat/pid.h"\n#include "printer/machine/state.h"\n'),
             *offences("board/linux/loop/a.cpp", '#include "board/linux/kernel/clock.h"\n'),
             *offences("arduino/libraries/New/a.cpp", '#include "arduino/Print.h"\n#include "arduino/libraries/New/b.h"\n'),
             *offences("arduino/host/a.cpp", '#include "arduino/libraries/SD/SD.h"\n'),
             *offences("apps/port/a.cpp", '#include "board/linux/kernel/clock.h"\n'),
             *offences("tests/a.cpp", '#include "board/linux/kernel/clock.h"\n'),
             *offences("board/linux/a.cpp", "#include <unistd.h>\nauto a = posix::open_guarded(path, O_RDONLY);\n"),
             *offences("arduino/host/a.cpp", "#include <unistd.h>\n"), *offences("qduino/a.cpp", "std::ifstream in{path};\n"), *offences("sched/a.cpp", "#include <cstdint>\n"),
             *offences("tests/unit/base/time_test.cpp", "namespace qduino::time_test {\n"),
             *offences("base/a.cpp", fits), *offences("base/a.cpp", members + "    int a_, b_;\n};\n"),
             *offences("base/a.cpp", members.replace("class C", "struct C") + "    int a_, b_, c_;\n};\n")]
    if rooms := circle():
        print(f"self-test: rooms in a circle: {' -> '.join(rooms)}")
    return tree_check.failed_cases(cases, clean, offences) or len(rooms)


if __name__ == "__main__":
    sys.exit(tree_check.run("layout", lambda path: path.endswith(SOURCES), offences, self_test))
