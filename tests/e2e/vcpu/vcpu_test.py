"""Any command in a VCPU: what it takes is measured by the kernel's own accounts, and nothing of it is left behind."""

import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = sys.argv.pop(1)
CORE = str(min(os.sched_getaffinity(0)))
BUDGET_S, PERIOD_S = 0.010, 0.100

# Four processes that spin for two seconds of the clock, one of them in a session of its own.
SPIN = """
import os, sys, time
until = time.monotonic() + float(sys.argv[1])
for child in range(3):
    if os.fork() == 0:
        if child == 0: os.setsid()
        break
while time.monotonic() < until: pass
while True:
    try: os.wait()
    except ChildProcessError: break
"""
# Ends at once, and leaves a daemon that writes its number and sleeps.
DAEMON = """
import os, sys, time
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        with open(sys.argv[1] + ".new", "w") as file: file.write(str(os.getpid()))
        os.rename(sys.argv[1] + ".new", sys.argv[1])
        time.sleep(60)
    os._exit(0)
os.wait()
sys.exit(3)
"""


def vcpu(*arguments):
    return [PROGRAM, "vcpu", "--core", CORE, *map(str, arguments)]


def wait_until(condition, what, timeout_s=20):
    until = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > until:
            raise AssertionError("not within %d s: %s" % (timeout_s, what))
        time.sleep(0.02)


def is_alive(pid):
    try:
        return pathlib.Path("/proc/%d/stat" % pid).read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False


def groups_of(pid):
    return re.findall(r"qduino-vcpu\.[\d.]+", pathlib.Path("/proc/%d/cgroup" % pid).read_text(encoding="utf-8"))


def groups_named(name):
    return [path for top in ("/sys/fs/cgroup", "/sys/fs/cgroup/cpu", "/sys/fs/cgroup/cpuacct", "/sys/fs/cgroup/cpu,cpuacct")
            for path in pathlib.Path(top).glob(name)]


def tree_time(command):
    """CPU time of a command with all its children, and how long it took: getrusage(2) of what has been waited for."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, time.monotonic() - start, done


def promises():
    """The files of the register (board/linux/kernel/shared_file.h): root's, and this user's."""
    user = os.geteuid()
    folders = ("/run/qduino", "/run/user/%d/qduino" % user, "/dev/shm/qduino-%d" % user, "/tmp/qduino-%d" % user)
    return [path for folder in folders for path in pathlib.Path(folder).glob("qduino-promise.*")]


class Vcpu(unittest.TestCase):
    def setUp(self):
        probe = subprocess.run(vcpu("-q", "true"), capture_output=True, text=True, timeout=30, check=False)
        if probe.returncode == 1 and "control group" in probe.stderr:
            self.skipTest(probe.stderr.strip())
        self.assertEqual((probe.returncode, probe.stderr), (0, ""))
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def start(self, *arguments):
        process = subprocess.Popen(vcpu(*arguments), stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        self.addCleanup(wait_until, lambda: not groups_named("qduino-vcpu.%d.*" % process.pid), "its group is gone")
        self.addCleanup(process.terminate)
        return process

    def run_vcpu(self, *arguments, status=0):
        done = subprocess.run(vcpu(*arguments), capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        return done

    def test_a_tree_that_spins_gets_its_budget_and_no_more(self):
        report = self.folder / "report.json"
        spin = [sys.executable, "-c", SPIN, "2"]
        used, lasted, done = tree_time(vcpu("--report", report, "--", *spin))
        # A budget per period, one more since the window may begin and end with one, a tick of 10 ms
        # that is taken back later, and 60 ms for the keeper itself, which is outside.
        allowed = lasted * BUDGET_S / PERIOD_S + BUDGET_S + 0.010 + 0.060
        self.assertLess(used, allowed, done.stderr)
        self.assertRegex(done.stderr, r"throttled in [1-9]\d* of")
        said = json.loads(report.read_text(encoding="utf-8"))
        self.assertLess(abs(said["used_us"] / 1e6 - used), 0.100, "the kernel's two accounts agree")
        self.assertLessEqual(said["used_us"] / 1e6, allowed)
        self.assertTrue(said["enforced"] and said["admitted"])
        # The same tree without a VCPU takes more: the measure can see it.
        free, lasted, _ = tree_time(spin)
        self.assertGreater(free, lasted * BUDGET_S / PERIOD_S + BUDGET_S + 0.010 + 0.060)

    def test_it_ends_as_its_command_does(self):
        self.run_vcpu("sh", "-c", "exit 7", status=7)
        self.run_vcpu("--", "sh", "-c", "kill -9 $$", status=137)
        self.run_vcpu("/nonexistent", status=127)
        self.run_vcpu("/dev/null", status=126)
        self.assertEqual(self.run_vcpu("-q", "echo", "-n", "--", "-q").stdout, "-- -q")

    def test_signals_are_handed_on(self):
        process = self.start("-q", "--", "sh", "-c", "trap 'exit 5' TERM; trap 'exit 6' USR1; echo x > '%s/up'; while :; do sleep 0.05; done" % self.folder)
        wait_until((self.folder / "up").exists, "the command runs")
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(timeout=20), 5)

    def test_daemons_stay_inside_and_are_ended_when_asked(self):
        process = self.start(sys.executable, "-c", DAEMON, self.folder / "pid")
        wait_until((self.folder / "pid").exists, "the daemon runs")
        daemon = int((self.folder / "pid").read_text(encoding="ascii"))
        self.assertTrue(groups_of(daemon))
        self.assertEqual(os.sched_getaffinity(daemon), {int(CORE)})
        self.assertTrue(any("stays in the VCPU" in line for line in process.stderr), "said when its own process has ended")
        self.assertIsNone(process.poll(), "it waits for the daemon")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=20), 3)
        self.assertFalse(is_alive(daemon))
        self.assertEqual(groups_named("qduino-vcpu.%d.*" % process.pid), [])

    def test_a_killed_keeper_leaves_nothing(self):
        process = self.start(sys.executable, "-c", DAEMON, self.folder / "pid")
        wait_until((self.folder / "pid").exists, "the daemon runs")
        daemon = int((self.folder / "pid").read_text(encoding="ascii"))
        process.kill()
        wait_until(lambda: not is_alive(daemon), "the tree has ended")
        wait_until(lambda: not groups_named("qduino-vcpu.%d.*" % process.pid), "its group is gone")
        self.assertEqual([path for path in promises() if "qduino-promise.%d." % process.pid in path.name], [])

    def test_the_next_one_puts_away_what_is_left_when_the_witness_is_killed_too(self):
        process = self.start(sys.executable, "-c", DAEMON, self.folder / "pid")
        wait_until((self.folder / "pid").exists, "the daemon runs")
        daemon = int((self.folder / "pid").read_text(encoding="ascii"))
        witnesses = [pid for pid in map(int, filter(str.isdigit, os.listdir("/proc"))) if self.holds_promise_of(pid, process.pid)]
        self.assertEqual(len(witnesses), 2, "the keeper and its witness")
        # Stopped first: the one that is killed later must not see the other's end.
        for number in (signal.SIGSTOP, signal.SIGKILL):
            for pid in witnesses:
                os.kill(pid, number)
        process.wait(timeout=20)
        wait_until(lambda: not any(map(is_alive, witnesses)), "both have ended")
        self.assertTrue(is_alive(daemon) and groups_of(daemon), "nobody ends it, and it is held to its budget")
        self.run_vcpu("-q", "true")
        wait_until(lambda: not is_alive(daemon), "the next one has ended it")
        self.assertEqual(groups_named("qduino-vcpu.%d.*" % process.pid), [])

    @staticmethod
    def holds_promise_of(pid, keeper):
        try:
            return any("qduino-promise.%d." % keeper in os.readlink("/proc/%d/fd/%s" % (pid, fd)) for fd in os.listdir("/proc/%d/fd" % pid))
        except OSError:
            return False

    def test_what_does_not_fit_beside_another_is_refused_by_name(self):
        self.start("--budget", "70", "sleep", "30")
        wait_until(lambda: self.promised("sleep"), "the first has its VCPU")
        self.run_vcpu("-q", "--budget", "1", "true")
        refused = self.run_vcpu("--budget", "50", "true", status=2)
        self.assertIn("sleep (70 ms in 100 ms)", refused.stderr)
        self.assertIn("REFUSED", refused.stderr)

    @staticmethod
    def promised(name):
        return any(" %s\n" % name in path.read_text(encoding="utf-8") for path in promises())

    def test_roots_command_cannot_become_real_time(self):
        tried = "import os\ntry: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))\nexcept OSError: print('refused')"
        self.assertEqual(self.run_vcpu("-q", sys.executable, "-c", tried).stdout, "refused\n")

    def test_wrong_values_are_named(self):
        for words, said in ((("--budget", "abc"), "'abc' is no duration above 0"), (("--budget", "0"), "'0' is no duration"),
                            (("--period", "-5"), "'-5' is no duration"), (("--core", "x"), "--core"), ((), "COMMAND")):
            done = subprocess.run([PROGRAM, "vcpu", *words, *(["true"] if words else [])], capture_output=True, text=True, timeout=30, check=False)
            self.assertGreater(done.returncode, 100, words)
            self.assertIn(said, done.stderr)
        self.assertIn("1 ms in 200 ms is the same share", self.run_vcpu("--budget", "500us", "true", status=1).stderr)
        self.assertIn("500 ms in 1 s is the same share", self.run_vcpu("--budget", "1s", "--period", "2s", "true", status=1).stderr)
        self.assertIn("the period at most", self.run_vcpu("--budget", "200", "true", status=1).stderr)

    def test_a_user_without_rights_is_told_what_to_do(self):
        if os.geteuid() != 0:
            self.skipTest("only root can become another user")
        done = subprocess.run(vcpu("true"), capture_output=True, text=True, timeout=30, check=False, user=65534, group=65534, extra_groups=[])
        self.assertEqual(done.returncode, 1)
        self.assertIn("systemd-run --user --scope", done.stderr)


class BesideASketch(unittest.TestCase):
    def test_the_loops_of_a_running_sketch_count(self):
        with tempfile.TemporaryDirectory() as folder:
            sketch = pathlib.Path(folder) / "busy.ino"
            sketch.write_text("void setup() {}\nvoid loop(7, 30, 100, %s) { waitForNextPeriod(); }\n" % CORE, encoding="utf-8")
            environment = dict(os.environ, XDG_CACHE_HOME=folder)
            run = subprocess.Popen([PROGRAM, "run", str(sketch), "--for", "6"], env=environment, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True)
            self.addCleanup(run.wait)
            self.addCleanup(run.kill)
            said = ""
            while "What holds" not in said and run.poll() is None:
                said += run.stdout.readline()
            if "SCHED_FIFO" not in said:
                run.communicate()
                self.skipTest("no real-time loops here: " + said)
            refused = subprocess.run(vcpu("--budget", "50", "true"), capture_output=True, text=True, timeout=30, check=False)
            # Little: what interrupts take of the core is measured, and a busy computer has many.
            admitted = subprocess.run(vcpu("--budget", "4", "true"), capture_output=True, text=True, timeout=30, check=False)
            run.communicate(timeout=60)
            if "control group" in refused.stderr:
                self.skipTest(refused.stderr)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn("loop 7 of busy-linux", refused.stderr)
            self.assertIn("would fit", refused.stderr)
            self.assertEqual(admitted.returncode, 0, admitted.stderr)
            self.assertIn("below loop 7", admitted.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
