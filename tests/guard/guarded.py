"""Runs a test so that nothing of it is left, however it and those who started it end.

    guarded.py COMMAND…           ends with the command's status

A test of the real computer starts sketches with loops at real-time priority, under supervisors, launchers and keepers that outlive each
other on purpose. When ./test, ctest or the test itself is killed, nobody asks them to end, and a loop that spins keeps its core.

    ctest ──► this process ──► the test ──► what it starts …      all have QDUINO_TEST_RUN in their environment
                   └─► undertaker, on core 0: when the test or this process is dead, it asks all of these to end, and kills what stays

When its parent dies, the kernel kills this process, and with it the test (PR_SET_PDEATHSIG). The undertaker has no such tie, no terminal
and no output that anybody waits for. (A test that kills its undertaker, too, is left with what its processes do by themselves.)
"""

import ctypes
import os
import select
import signal
import sys
import time

MARK = "QDUINO_TEST_RUN"
GRACE_S = 10  # a printer that is asked to end makes itself safe first
PR_SET_PDEATHSIG = 1
REAL_TIME = (os.SCHED_FIFO, os.SCHED_RR, 6)  # 6: SCHED_DEADLINE


def die_with(parent):
    """This process is killed when `parent`, which started it, dies."""
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def marked(mark):
    """The processes that come from a test, whoever their parents are now."""
    word = ("%s=" % MARK).encode()
    found = []
    for pid in map(int, filter(str.isdigit, os.listdir("/proc"))):
        try:
            with open("/proc/%d/environ" % pid, "rb") as file:
                runs = [part for part in file.read().split(b"\0") if part.startswith(word)]
        except OSError:  # it has ended, or is another user's
            continue
        if any(mark.encode() in run[len(word):].split(b":") for run in runs):
            found.append(pid)
    return found


def real_time_tasks(pids):
    """{thread: name} of those that have a real-time policy."""
    tasks = {}
    for pid in pids:
        try:
            for tid in map(int, os.listdir("/proc/%d/task" % pid)):
                if os.sched_getscheduler(tid) & ~os.SCHED_RESET_ON_FORK in REAL_TIME:
                    with open("/proc/%d/task/%d/comm" % (pid, tid), encoding="utf-8", errors="replace") as file:
                        tasks[tid] = file.read().strip()
        except OSError:
            continue
    return tasks


def send(signal_number, pids):
    for pid in pids:
        try:
            os.kill(pid, signal_number)
        except OSError:
            pass


def bury(mark):
    """Ends all that comes from a test: in order where it can be, and surely."""
    own = os.getpid()

    def left():
        return [pid for pid in marked(mark) if pid != own]

    send(signal.SIGTERM, left())
    until = time.monotonic() + GRACE_S
    while left() and time.monotonic() < until:
        time.sleep(0.1)
    while rest := left():  # those that are forked meanwhile, too
        send(signal.SIGKILL, rest)
        time.sleep(0.05)


def be_undertaker(mark, *watched):
    """Waits until one of the processes behind these descriptors (pidfd_open(2)) is dead."""
    os.setsid()
    nothing = os.open("/dev/null", os.O_RDWR)
    for descriptor in range(3):
        os.dup2(nothing, descriptor)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    select.select(watched, [], [])
    bury(mark)
    os._exit(0)


def main():
    die_with(os.getppid())
    mark = "%d.%d" % (os.getpid(), time.monotonic_ns())
    environment = dict(os.environ)
    # No test of a function may depend on what else runs here, or on what a host takes.
    environment.setdefault("QDUINO_INTERRUPTS", "20000 200000 100000 100000")
    environment[MARK] = ":".join(filter(None, (environment.get(MARK), mark)))
    own = os.getpid()
    test = os.fork()
    if test == 0:
        die_with(own)
        try:
            os.execvpe(sys.argv[1], sys.argv[1:], environment)
        except OSError as error:
            print("%s: %s" % (sys.argv[1], error.strerror), file=sys.stderr)
        os._exit(127)
    watched = os.pidfd_open(own), os.pidfd_open(test)
    undertaker = os.fork()
    if undertaker == 0:
        be_undertaker(mark, *watched)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # for the test, which ends in order
        signal.signal(number, lambda number, frame: send(number, [test]))
    status = os.waitpid(test, 0)[1]
    os.waitpid(undertaker, 0)
    code = os.waitstatus_to_exitcode(status)
    sys.exit(code if code >= 0 else 128 - code)


if __name__ == "__main__":
    main()
