"""What the running processes may do is what docs/privileges.md says."""

import os
import pwd
import re
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "reach")]
from network import Lan, can_make_networks  # noqa: E402
from stack import ROOT, Stack, read, service, wait_until  # noqa: E402

USER = "qduino-printer"
ROW = re.compile(r"^\| `([a-z-]+)` \| ([a-z-]+) \| ([A-Z_ ]+|none) \| (.*) \|$", re.M)


def numbers_of_capabilities():
    """{name: bit}, from the kernel's header."""
    header = read("/usr/include/linux/capability.h")
    return {name: int(bit) for name, bit in re.findall(r"^#define CAP_([A-Z_]+)\s+(\d+)$", header, re.M)}


def status_of(pid):
    return dict(line.split(":\t", 1) for line in read("/proc/%d/status" % pid).splitlines() if ":\t" in line)


@unittest.skipUnless(os.geteuid() == 0, "only root has rights to give up: run this test as root")
class Privileges(unittest.TestCase):
    def start_whole(self):
        """With all its processes, in a network of its own: the name is told to nobody else."""
        why = can_make_networks()
        if why:
            self.skipTest(why)
        lan = Lan(["printer"])
        self.addCleanup(lan.remove)
        enter = ["nsenter", "--net=/run/netns/" + lan.spaces["printer"]]  # and it keeps its view of /sys, which `ip netns exec` does not
        stack = Stack("--run-as", USER, "--serial-port", "pty", "--lan", "--name", "qduino-rights", before=enter)
        self.addCleanup(stack.stop)
        stack.wait_open()
        stack.reach = lambda ask: lan.on("printer", ask)
        return stack

    def test_each_process_has_what_the_table_says(self):
        bits = numbers_of_capabilities()
        if not bits:
            self.skipTest("the kernel's headers are not installed")
        table = ROW.findall(read(os.path.join(ROOT, "docs", "privileges.md")))
        self.assertEqual(len(table), 8, "every process of the printer has a row")
        stack = self.start_whole()
        wait_until(lambda: stack.pid_of("printer-name"), "the name is told; it said:\n" + stack.said)
        wait_until(lambda: stack.machine_state() == "idle", "the printer is idle; it said:\n" + stack.said)
        self.maxDiff = None
        seen = {}
        for pid, name in stack.processes().items():
            status = status_of(pid)
            seen[name] = (status["Uid"].split(), *(int(status[key], 16) for key in ("CapPrm", "CapEff", "CapBnd", "CapInh", "CapAmb")),
                          status["NoNewPrivs"], status["Seccomp"])
        expected, had = {}, int(status_of(os.getpid())["CapBnd"], 16)
        for name, user, words, calls in table:
            # A container may have taken some of them from root already.
            mask = had & (0 if words == "none" else sum(1 << bits[word] for word in words.split()))
            uid = str(pwd.getpwnam(user).pw_uid)
            expected[name[:15]] = ([uid] * 4, mask, mask, mask, 0, 0, "1", "2" if calls == "yes" else "0")
        self.assertEqual({name: seen.get(name) for name in expected}, expected)
        self.assertEqual(sorted(set(seen) - set(expected) - {"witness", "qduino-witness", "printer-launche"}), [], "no process is without a row")

    def test_the_service_sees_its_own_files_alone_and_no_network(self):
        stack = Stack("--speed", "20", "--run-as", USER)
        self.addCleanup(stack.stop)
        stack.wait_open()
        if "the service sees" in stack.said:
            self.skipTest("no namespaces here")
        root = "/proc/%d/root" % stack.pid_of("printd")
        self.assertIn("journal.sqlite", os.listdir(root + stack.state))
        for hidden in ("etc/passwd", "root", "home", "proc", "usr/bin", "bin", "var", "dev/null"):
            self.assertFalse(os.path.lexists(os.path.join(root, hidden)), hidden)
        devices = [line.split(":")[0].strip() for line in read("/proc/%d/net/dev" % stack.pid_of("printd")).splitlines()[2:]]
        self.assertLessEqual(set(devices), {"lo", "sit0", "tunl0", "ip6tnl0", "gre0", "gretap0", "erspan0", "ip_vti0", "ip6_vti0", "ip6gre0"})
        self.assertEqual(stack.request("GET", "/api/v1/machine")[0], 200, "and it answers")


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
