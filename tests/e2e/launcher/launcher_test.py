"""What ./run starts lives and dies together, says what is wrong, and leaves nothing behind."""

import os
import re
import signal
import socket
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from stack import Stack, service, wait_until  # noqa: E402


class Simulated(unittest.TestCase):
    options = ("--speed", "20")

    def setUp(self):
        self.stack = Stack(*self.options)
        self.addCleanup(self.stack.stop)
        self.stack.wait_open()

    def folders(self):
        return self.stack.folders_left()

    def becomes_idle(self):
        """The page may be there before the service has found the machine."""
        wait_until(lambda: self.stack.machine_state() == "idle", "the printer is idle; it said:\n" + self.stack.said)

    def test_it_stops_well_and_leaves_nothing(self):
        self.assertEqual(len(self.folders()), 1)
        self.assertEqual(self.stack.process.send_signal(signal.SIGINT), None)
        self.assertEqual(self.stack.wait_end(), 0)
        self.assertEqual((self.folders(), self.stack.processes()), (set(), {}))
        self.assertFalse(os.path.exists(os.path.join(self.stack.state, "address")))

    def test_the_first_screen_is_ten_lines_and_the_rest_is_kept(self):
        self.stack.wait_first_screen()
        screen = self.stack.said.splitlines()
        self.assertLessEqual(len(screen), 10, self.stack.said)
        for line in screen:
            self.assertLessEqual(len(line), 80, line)
        self.assertIn("Virtual printer: Printrbot Simple Metal", screen)
        self.assertRegex(screen[0], r"^Ready in ")
        self.assertTrue([line for line in screen if line.startswith("Guarantees: ")], self.stack.said)
        self.assertIn("listening on http://127.0.0.1:%d/" % self.stack.port, self.stack.log())
        self.assertIn("This printer runs now.", self.stack.report())
        self.assertIn("/api/v1/jobs", self.stack.report())
        self.stack.process.send_signal(signal.SIGINT)
        self.assertEqual(self.stack.wait_end(), 0)
        self.assertIn("No printer runs there now", self.stack.report())

    def test_a_second_one_names_the_first_and_ends(self):
        second = Stack(*self.options, state=self.stack.state)
        self.assertEqual(second.wait_end(), 1)
        self.assertIn("already running", second.said)
        self.assertIn("http://127.0.0.1:%d/#key=" % self.stack.port, second.said)
        self.becomes_idle()

    def test_a_taken_port_ends_it_with_the_reason(self):
        second = Stack(*self.options, port=self.stack.port)
        self.addCleanup(second.stop)
        self.assertEqual(second.wait_end(), 1)
        self.assertIn("%d" % self.stack.port, second.said)
        self.assertNotIn("Open", second.said)
        self.assertEqual(second.processes(), {})
        self.assertEqual(len(self.folders()), 1)

    def test_a_killed_one_takes_all_with_it_and_the_next_tidies_up(self):
        self.assertEqual(len(self.folders()), 1)
        self.stack.process.kill()
        self.stack.wait_end()
        self.stack.start()  # at once: it waits for what is still ending
        self.stack.wait_open()
        self.assertEqual(len(self.folders()), 1, "the killed one's folder is gone")
        self.becomes_idle()

    def test_all_that_a_killed_one_had_started_ends(self):
        self.stack.process.kill()
        self.stack.wait_end()
        wait_until(lambda: not self.stack.processes(), "everything it started has ended: %s" % self.stack.processes())

    def test_a_killed_service_comes_back(self):
        for _ in range(3):
            killed = wait_until(lambda: self.stack.pid_of("printd"), "the service is up")
            os.kill(killed, signal.SIGKILL)
            wait_until(lambda: self.stack.pid_of("printd") not in (None, killed), "the service was started again")
            wait_until(lambda: self.stack.machine_state() == "idle", "the machine is seen again")


    def loop_1(self):
        status, report = self.stack.request("GET", "/api/v1/guarantee")
        return next((loop for loop in report["loops"] if loop["id"] == 1), None) if status == 200 else None

    def test_the_guarantee_is_as_of_now(self):
        first = wait_until(self.loop_1, "the sketch has published its guarantee")
        later = wait_until(lambda: self.loop_1()["releases"] > first["releases"] + 10 and self.loop_1(), "its releases go on")
        if first["watched_us"] is not None:
            self.assertGreater(later["watched_us"], first["watched_us"])
            self.assertGreaterEqual(later["cpu_used_us"], first["cpu_used_us"])


class RealTime(Simulated):
    """The same, with the sketch on this computer: isolated, as root."""

    options = ()

    # Listed by name, since ctest is told of a class's own tests alone.
    def test_a_killed_one_takes_all_with_it_and_the_next_tidies_up(self):
        super().test_a_killed_one_takes_all_with_it_and_the_next_tidies_up()

    def test_it_stops_well_and_leaves_nothing(self):
        super().test_it_stops_well_and_leaves_nothing()

    def test_the_guarantee_is_as_of_now(self):
        super().test_the_guarantee_is_as_of_now()

    def test_the_first_screen_is_ten_lines_and_the_rest_is_kept(self):
        super().test_the_first_screen_is_ten_lines_and_the_rest_is_kept()
        self.assertIn("What holds on this board", self.stack.report())
        self.assertNotIn("What holds", self.stack.said)

    def test_a_killed_ones_sketch_is_ended_by_its_supervisor(self):
        self.stack.process.kill()
        self.stack.wait_end()
        wait_until(lambda: "the program that started it died" in self.stack.log(), "the supervisor saw it")
        wait_until(lambda: not self.stack.processes(), "everything it started has ended: %s" % self.stack.processes())

    def test_a_killed_sketch_and_a_killed_machine_come_back(self):
        for name in ("printer", "virtual-machine", "qduino-supervisor"):
            killed = wait_until(lambda: self.stack.pid_of(name), "the %s is up" % name)
            os.kill(killed, signal.SIGKILL)
            wait_until(lambda: self.stack.pid_of(name) not in (None, killed), "the %s was started again" % name)
            self.becomes_idle()

    def service_vcpu(self):
        status, report = self.stack.request("GET", "/api/v1/guarantee")
        return report["service"] if status == 200 else None

    @staticmethod
    def cpu_time(pid):
        with open("/proc/%d/stat" % pid, encoding="utf-8") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def test_the_service_is_held_to_its_vcpu(self):
        wait_until(self.service_vcpu, "the service says what it is held to")
        vcpu = self.service_vcpu()
        if not vcpu["enforced"]:
            self.assertNotEqual(vcpu["shortfall"], "")
            self.assertIn("no budget", self.stack.report())
            self.skipTest(vcpu["shortfall"])
        self.assertEqual((vcpu["period_us"], vcpu["core"]), (100000, 0))
        budget_s = vcpu["budget_us"] / 1e6
        # 30 MB take 0.5 s of CPU time to be taken in and looked through, 5 s of its budget or more.
        # 50 ms more for the clock of /proc, and for the ticks that are taken back later.
        part = b"G28\nM109 S200\n" + b"".join(b"G1 X%d.5 Y%d E%d.02\n" % (50 + i % 50, 50 + i // 50 % 50, i) for i in range(1500000))
        service, start = self.stack.pid_of("printd"), time.monotonic()
        before = self.cpu_time(service)
        form = b'--x\r\nContent-Disposition: form-data; name="file"; filename="part.gcode"\r\n\r\n' + part + b"\r\n--x--\r\n"
        status, answer = self.stack.request("POST", "/api/v1/jobs", form, {"Content-Type": "multipart/form-data; boundary=x"}, timeout_s=120)
        used, lasted = self.cpu_time(service) - before, time.monotonic() - start
        self.assertIn(status, (200, 201), answer)
        self.assertGreater(used, 0.1, "there was something to hold back")
        self.assertLess(used, 10 * budget_s * lasted + budget_s + 0.050)
        wait_until(lambda: self.service_vcpu()["throttled"] > 0, "the page shows that it was held back")
        killed = self.stack.pid_of("printd")
        os.kill(killed, signal.SIGKILL)
        wait_until(lambda: self.stack.pid_of("printd") not in (None, killed), "the service was started again")
        with open("/proc/%d/cgroup" % self.stack.pid_of("printd"), encoding="utf-8") as file:
            self.assertIn("qduino-vcpu.", file.read(), "the next one is held, too")

    def test_the_service_asks_for_what_fits(self):
        wait_until(self.service_vcpu, "the service says what it is held to")
        self.stack.wait_first_screen()
        vcpu = self.service_vcpu()
        if not vcpu["enforced"]:
            self.skipTest(vcpu["shortfall"])
        said = re.search("web budget (.*)", self.stack.said)[1]
        if vcpu["admitted"]:
            budget_ms = vcpu["budget_us"] // 1000
            self.assertIn(budget_ms, range(2, 11))
            self.assertEqual(said, "10 of 100 ms" if budget_ms == 10 else "%d of 100 ms (10 asked, %d fit)" % (budget_ms, budget_ms))
            self.assertEqual(vcpu["shortfall"], "")
        else:  # a computer with so many interrupts that next to nothing fits
            self.assertRegex(said, r"^10 of 100 ms NOT sure \([01] fit\)$")

    def test_what_was_changed_on_this_machine_is_put_back(self):
        if os.geteuid() != 0:
            self.skipTest("only root changes a machine")
        self.assertIn("put back", self.stack.report())
        for name in ("printer", "qduino-supervisor"):
            killed = self.stack.pid_of(name)
            os.kill(killed, signal.SIGKILL)
            wait_until(lambda: self.stack.pid_of(name) not in (None, killed), "the %s was started again" % name)
        self.stack.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.stack.wait_end(), 0)
        state = "/run/qduino/settings.state"
        self.assertEqual(os.path.exists(state) and os.path.getsize(state), 0, "no change is left to undo")
        with open("/proc/irq/default_smp_affinity", encoding="ascii") as file:
            self.assertEqual(int(file.read().replace(",", ""), 16), (1 << os.cpu_count()) - 1)


class AskedFor(unittest.TestCase):
    def test_a_budget_that_was_asked_for_is_kept_and_what_would_fit_is_said(self):
        stack = Stack("--service-budget", "70")  # beside the 30 ms of loop 1, and the others
        self.addCleanup(stack.stop)
        stack.wait_open()
        stack.wait_first_screen()
        if "web budget none" in stack.said:
            self.skipTest("no control groups here")
        self.assertRegex(stack.said, r"web budget 70 of 100 ms NOT sure \(\d+ fit\)")
        self.assertIn("70 ms in 100 ms does not fit on core 0", " ".join(stack.report().split()))


class Refused(unittest.TestCase):
    def test_a_wrong_option_is_told_as_one_of_run(self):
        stack = Stack("--speed", "x")
        self.assertGreater(stack.wait_end(), 100)
        self.assertEqual(stack.said, "run: --speed: 'x' is not a number from 0.01 to 10000\n'./run --help' shows what there is.\n")

    def test_a_state_folder_out_of_reach_ends_it(self):
        with tempfile.NamedTemporaryFile() as file:
            stack = Stack("--speed", "20", state=os.path.join(file.name, "state"))
            self.assertEqual(stack.wait_end(), 1)
            self.assertIn(file.name, stack.said)

    def test_a_state_folder_that_the_service_cannot_use_ends_it(self):
        stack = Stack("--speed", "20")
        self.addCleanup(stack.stop)
        stack.process.kill()
        stack.wait_end()
        os.makedirs(os.path.join(stack.state, "api-key"), exist_ok=True)  # a folder where a file should be
        wait_until(lambda: not stack.processes(), "the first attempt has ended")
        stack.start()
        self.assertEqual(stack.wait_end(), 1)
        self.assertIn("print service ended with status", stack.said)

    def test_a_machine_file_with_an_error_ends_it_with_the_line(self):
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
            file.write("name = \"x\"\nno_such_key = 1\n")
            file.flush()
            stack = Stack("--speed", "20", "--machine", file.name)
            self.addCleanup(stack.stop)
            self.assertEqual(stack.wait_end(), 1)
            self.assertIn("no_such_key", stack.said)


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
