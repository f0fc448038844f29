"""Who broke into the print service, or is another user of the computer, gets no further: root's printer goes on, and root's files stay.

Each attack is done by a process that has become the service's user. Without root there is no other user to attack: then all is skipped.
"""

import os
import pwd
import signal
import stat
import sys
import tempfile
import time
import traceback
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from stack import MEMORY, Stack, service, wait_until  # noqa: E402

USER = "qduino-printer"
PRECIOUS = "root's own\n"


def acting_as(user, attack):
    """Runs `attack()` in a child that is `user` for good; what it returned that is true, or raised, is the child's status."""
    child = os.fork()
    if child == 0:
        status = 2
        try:
            os.setgroups([])
            os.setgid(user.pw_gid)
            os.setuid(user.pw_uid)
            status = 0 if attack() else 1
        except BaseException:  # noqa: B902: nothing may leave the child
            traceback.print_exc()
        os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def trying(action, *arguments):
    """True when the kernel let it happen."""
    try:
        action(*arguments)
        return True
    except OSError:
        return False


@unittest.skipUnless(os.geteuid() == 0, "only root can act as another user: run this test as root")
class Attack(unittest.TestCase):
    options = ("--speed", "20", "--run-as", USER)

    def setUp(self):
        self.top = tempfile.TemporaryDirectory(prefix="launcher-attack-")
        self.addCleanup(self.top.cleanup)
        os.chmod(self.top.name, 0o711)
        self.state = os.path.join(self.top.name, "state")
        self.precious = os.path.join(self.top.name, "precious")
        with open(self.precious, "w", encoding="ascii") as file:
            file.write(PRECIOUS)
        os.chmod(self.precious, 0o600)
        self.stack = None

    def start(self):
        self.stack = Stack(*self.options, state=self.state)
        self.addCleanup(self.stack.stop)
        self.stack.wait_open()

    def user(self):
        return pwd.getpwnam(USER)

    def becomes_idle(self):
        wait_until(lambda: self.stack.machine_state() == "idle", "the printer is idle; it said:\n" + self.stack.said)

    def precious_is_unharmed(self):
        with open(self.precious, encoding="ascii") as file:
            self.assertEqual(file.read(), PRECIOUS)
        found = os.stat(self.precious)
        self.assertEqual((found.st_uid, stat.S_IMODE(found.st_mode)), (0, 0o600))

    def writes_of_root(self):
        """Root writes the service's VCPU every 2 s: until it has done so twice more."""
        file = os.path.join(MEMORY, self.stack.folder(), "service-vcpu")
        for _ in range(2):
            before = os.stat(file).st_mtime_ns
            wait_until(lambda: os.stat(file).st_mtime_ns != before, "root has written %s again" % file, 30)

    def test_the_service_is_a_user_of_its_own_and_owns_nothing_of_root(self):
        self.start()
        printd = self.stack.pid_of("printd")
        self.assertEqual(os.stat("/proc/%d" % printd).st_uid, self.user().pw_uid)
        folder = os.path.join(MEMORY, self.stack.folder())
        own = {name for name in os.listdir(folder) if os.lstat(os.path.join(folder, name)).st_uid == self.user().pw_uid}
        self.assertEqual((os.stat(folder).st_uid, own), (0, {"service"}))
        self.assertEqual(os.stat(self.state).st_uid, self.user().pw_uid)

    def test_a_second_printer_with_this_folder_names_the_first_at_once(self):
        """Whose processes are another user's: their names are found all the same."""
        self.start()
        second = Stack(*self.options, state=self.state)
        self.assertEqual(second.wait_end(), 1)
        self.assertIn("already running", second.said)
        self.assertIn("(held by print", second.said)  # printer-launche, printd, printer-sim; a long error is cut
        self.assertNotIn("waiting", second.said)

    def test_a_killed_launcher_takes_the_other_users_processes_with_it(self):
        """The kernel forgets that a process wants to end with its parent where it becomes another user."""
        self.options += ("--serial-port", "pty")
        self.start()
        self.assertTrue(self.stack.pid_of("printd") and self.stack.pid_of("printer-port"))
        left = {self.stack.folder()}
        self.stack.process.kill()
        self.stack.wait_end()
        wait_until(lambda: not self.stack.processes(), "all have ended; there are %s" % self.stack.processes())
        self.stack.start()
        self.stack.wait_open()
        self.assertFalse(left & self.stack.folders_left(), "the next one removes what it had left in memory")
        self.stack.process.send_signal(signal.SIGTERM)
        self.stack.wait_end()
        self.assertEqual(self.stack.folders_left(), set())

    def test_links_in_memory_lead_root_nowhere(self):
        self.start()
        folder = os.path.join(MEMORY, self.stack.folder())

        def attack():
            for name in ("service-vcpu", "service-vcpu.new", "kept-settings.toml", "pins", "link", "link.new", "inspect", "sketch.lock", "lock"):
                path = os.path.join(folder, name)
                trying(os.unlink, path)
                trying(os.symlink, self.precious, path)
                trying(os.truncate, path, 0)
            trying(os.rename, folder, folder + ".moved")
            return True
        self.assertEqual(acting_as(self.user(), attack), 0)
        self.writes_of_root()
        self.precious_is_unharmed()
        self.becomes_idle()

    def test_the_link_cannot_be_cut_off_under_the_sketch(self):
        """The attacker has what the service has: its descriptor of the link."""
        self.start()
        self.becomes_idle()
        sketch = self.stack.pid_of(self.sketch)
        path = os.path.join(MEMORY, self.stack.folder(), "link")

        def attack():
            import array
            import socket
            if not stat.S_ISSOCK(os.lstat(path).st_mode):
                descriptor = os.open(path, os.O_RDWR)
            else:
                with socket.socket(socket.AF_UNIX) as asked:
                    asked.connect(path)
                    _, ancillary, _, _ = asked.recvmsg(1, socket.CMSG_SPACE(4))
                    descriptor = array.array("i", ancillary[0][2])[0]
            if os.fstat(descriptor).st_size < 4096:
                return False
            return not trying(os.ftruncate, descriptor, 0) and not trying(os.ftruncate, descriptor, 1 << 30)
        self.assertEqual(acting_as(self.user(), attack), 0, "it has the link, and cannot cut it off")
        for _ in range(3):
            time.sleep(0.3)  # it touches all of it many times
            self.becomes_idle()
        self.assertEqual(self.stack.pid_of(self.sketch), sketch, "it lives")

    sketch = "printer-sim"

    def test_whatever_stands_for_the_kept_settings_does_not_keep_it_from_starting(self):
        self.start()
        self.stack.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.stack.wait_end(), 0)
        kept = os.path.join(self.state, "kept-settings.toml")
        for plant in (lambda: os.symlink("/dev/zero", kept), lambda: os.mkfifo(kept), lambda: os.symlink(self.precious, kept),
                      lambda: os.truncate(os.open(kept, os.O_CREAT | os.O_RDWR, 0o600), 1 << 40), lambda: os.mkdir(kept)):
            self.assertEqual(acting_as(self.user(), lambda: plant() is None), 0)  # noqa: B023
            self.stack.start()
            self.stack.wait_open()
            self.becomes_idle()
            self.assertIn("M500 has kept does not count", self.stack.said)
            self.stack.process.send_signal(signal.SIGTERM)
            self.assertEqual(self.stack.wait_end(), 0)
            (os.rmdir if os.path.isdir(kept) else os.unlink)(kept)
        self.precious_is_unharmed()

    def test_links_in_the_state_folder_lead_root_nowhere(self):
        self.start()

        def attack():
            for name in ("address", ".address.new.%d" % self.stack.process.pid, "address.part", "run.lock", "serial"):
                path = os.path.join(self.state, name)
                trying(os.unlink, path)
                os.symlink(self.precious, path)
            return True
        self.stack.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.stack.wait_end(), 0)
        self.assertEqual(acting_as(self.user(), attack), 0)
        self.stack.start()
        self.assertEqual(self.stack.wait_end(), 1)
        self.assertIn("run.lock is not used: it is a symbolic link", self.stack.said)
        self.precious_is_unharmed()
        os.unlink(os.path.join(self.state, "run.lock"))
        self.stack.start()
        self.stack.wait_open()
        self.precious_is_unharmed()

    def test_a_folder_that_is_not_the_printers_is_refused(self):
        os.mkdir(self.state)
        with open(os.path.join(self.state, "passwd"), "w", encoding="ascii"):
            pass
        stack = Stack(*self.options, state=self.state)
        self.addCleanup(stack.stop)
        self.assertEqual(stack.wait_end(), 1)
        self.assertIn("passwd is not the printer's", stack.said)
        self.assertEqual(os.stat(self.state).st_uid, 0)


class AttackInRealTime(Attack):
    """The same on this computer: machine, supervisor and sketch are root's."""

    options = ("--run-as", USER)
    sketch = "printer"

    # Listed by name, since ctest is told of a class's own tests alone.
    def test_links_in_memory_lead_root_nowhere(self):
        super().test_links_in_memory_lead_root_nowhere()

    def test_the_link_cannot_be_cut_off_under_the_sketch(self):
        super().test_the_link_cannot_be_cut_off_under_the_sketch()


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
