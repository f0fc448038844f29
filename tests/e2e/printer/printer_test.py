"""The printer on the Linux board, end to end and in real time: virtual machine, supervisor, sketch, print service.

What was built is asked of the twin, which saw pins alone. Run by ctest, one test at a time.
"""

import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
import service  # noqa: E402
from service import WATCHED, Hopeless, Printd, wait_until  # noqa: E402


def square_job(laps, corner=60):
    """Homes, then runs around a square with Z rising: about 2.6 s a lap."""
    lines = ["G28", "G90", "G1 Z1 F240", "G1 X20 Y20 F5400"]
    for lap in range(laps):
        z = 1 + lap * 0.05
        lines += ["G1 X%d Y20" % corner, "G1 X%d Y%d Z%.3f" % (corner, corner, z), "G1 X20 Y%d" % corner, "G1 X20 Y20"]
    return ("\n".join(lines) + "\nM84\n").encode()


def large_job(size, seed):
    """About `size` bytes of good G-code, different for every seed."""
    return b"; job %d\nG28\n" % seed + b"G1 X10 Y10 F3000\nG1 X100 Y100\n" * (size // 30)


def heating_job():
    """Heats from its first line on, while it homes and moves."""
    return b"M104 S200\nM140 S60\nG28\n" + b"G1 X10 F3000\nG1 X100\n" * 200


class Printer:
    """All processes of one printer, on pins and a link of their own."""

    def __init__(self, faults=()):
        self.programs = os.path.dirname(service.PRINTD)
        self.folder = tempfile.mkdtemp(prefix="printer-e2e-")
        self.memory = tempfile.mkdtemp(prefix="printer-e2e-", dir="/dev/shm")
        self.pins = os.path.join(self.memory, "pins")
        self.link = os.path.join(self.memory, "link")
        self.inspect = os.path.join(self.memory, "inspect")
        self.log = open(os.path.join(self.folder, "machine.log"), "ab")
        self.machine = self.program("virtual-machine", "--pins", self.pins, "--inspect", self.inspect,
                                    *[word for fault in faults for word in ("--fault", fault)])
        wait_until(lambda: os.path.exists(self.pins) and os.path.exists(self.inspect), "the machine is there")
        self.supervisor = self.program("qduino-supervisor", "--pins", self.pins, "--link", self.link, "--restart", "--",
                                       os.path.join(self.programs, "printer"), "--pins", self.pins, "--link", self.link)
        wait_until(lambda: os.path.exists(self.link), "the sketch made its link")
        os.symlink(self.link, os.path.join(self.folder, "link"))
        self.printd = Printd(self.folder, ["--inspect", self.inspect])
        try:
            self.wait_for_state("idle")
        except BaseException:
            self.stop()  # or its processes outlive the test, and keep the core from the next one
            raise

    def program(self, name, *arguments):
        process = subprocess.Popen([os.path.join(self.programs, name), *arguments], stdout=self.log, stderr=self.log)
        WATCHED[name] = (process, self.log.name)
        return process

    def wait_for_state(self, state):
        def reached():
            machine = self.printd.machine()
            if machine["state"] == "faulted" and state != "faulted":
                raise Hopeless("it is faulted: %s" % machine["fault"])
            return machine["state"] == state

        wait_until(reached, "the printer is " + state)

    def wait_for_job(self, number, state, timeout_s=120):
        self.printd.wait_for_job(number, state, timeout_s)

    def ask_twin(self, **question):
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(10)
            connection.connect(self.inspect)
            connection.sendall(json.dumps(question).encode() + b"\n")
            return json.loads(connection.makefile().readline())

    def heater_duties(self):
        state = self.ask_twin(op="state")
        return {name: state[name]["duty"] for name in ("hot_end", "bed")}

    def sketch_pid(self):
        children = subprocess.run(["pgrep", "-x", "-P", str(self.supervisor.pid), "printer"], capture_output=True, text=True, check=False)
        return int(children.stdout.split()[0]) if children.stdout.split() else None

    def inspection(self, number):
        status, report, _ = self.printd.request("GET", "/api/v1/jobs/%d/inspection" % number)
        return report if status == 200 else None

    def stop(self):
        self.printd.stop()
        WATCHED.clear()
        for process in (self.supervisor, self.machine):
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=30)
        self.log.close()
        shutil.rmtree(self.folder)
        shutil.rmtree(self.memory)


class Case(unittest.TestCase):
    faults = ()

    def setUp(self):
        self.printer = Printer(self.faults)
        self.printd = self.printer.printd

    def tearDown(self):
        self.printer.stop()

    def upload(self, content, name="part.gcode"):
        status, job, _ = self.printd.upload(name, content, print="true")
        self.assertEqual(status, 201, job)
        return job["id"]

    def assert_built_as_asked(self, number):
        report = wait_until(lambda: self.printer.inspection(number), "the twin has reported")
        self.assertTrue(report["matches"], report.get("differences"))
        self.assertEqual(sum(report["lost_steps"].values()) if isinstance(report["lost_steps"], dict)
                         else report["lost_steps"], 0)


class Prints(Case):
    def test_a_job_prints_while_uploads_arrive(self):
        number = self.upload(square_job(8))
        generator = random.Random(7)
        waiting = []

        def send():
            for i in range(12):
                time.sleep(generator.uniform(0.1, 1.5))
                content = large_job(int(10 ** generator.uniform(4.7, 7.3)), i)
                waiting.append(self.printd.put("later%d.gcode" % i, content)[1]["id"])

        sender = threading.Thread(target=send)
        sender.start()
        self.printer.wait_for_job(number, "done")
        sender.join()
        self.assert_built_as_asked(number)
        self.assertEqual(len(set(waiting)), 12)
        states = [self.printd.state_of(each) for each in waiting]
        self.assertEqual(states, ["held"] * 12, "what was not asked to print waits for a person")

    def test_a_line_too_hot_is_refused_before_anything_moves(self):
        status, answer, _ = self.printd.upload("hot.gcode", b"G28\nM104 S999\n", print="true")
        self.assertEqual(status, 422)
        self.assertEqual(answer["error"]["line"], 2)
        self.assertIn("999", answer["error"]["message"])
        self.assertEqual(self.printd.jobs(), [])


class PausedPrint(Case):
    def command(self, name, body=None):
        status, answer, _ = self.printd.request("POST", "/api/v1/machine/" + name, body)
        self.assertEqual(status, 202, answer)

    def test_the_head_parks_is_jogged_and_comes_back_to_the_step(self):
        status, answer, _ = self.printd.request("POST", "/api/v1/machine/jog", {"x_mm": 5})
        self.assertEqual(status, 409, answer)
        self.assertIn("home first", answer["error"]["message"])
        number = self.upload(square_job(4))
        wait_until(lambda: self.printd.machine()["line"] > 8, "it is in the middle of the print", 60)
        self.command("pause")
        self.printer.wait_for_state("paused")
        machine = self.printd.machine()
        self.assertTrue(machine["parked"] and machine["may_jog"], machine)
        parked = self.printer.ask_twin(op="state")["position_mm"]
        self.assertAlmostEqual(parked["y"], 150, delta=0.02)
        self.assertGreater(parked["z"], 5)
        self.command("jog", {"x_mm": 12.5, "z_mm": 1.5, "speed_mm_s": 40})
        wait_until(lambda: abs(self.printer.ask_twin(op="state")["position_mm"]["x"] - 12.5) < 0.02, "it was jogged")
        self.printd.kill()
        self.printd.start()
        self.printer.wait_for_state("paused")
        self.command("resume")
        self.printer.wait_for_job(number, "done")
        self.assert_built_as_asked(number)
        self.assertEqual(self.printer.inspection(number)["excursions"], {"seen": 1, "told": 1})


class KilledService(Case):
    kills = 6 if service.THOROUGH else 4

    def test_the_print_goes_on_and_is_printed_once(self):
        number = self.upload(square_job(2 * self.kills))
        then = self.upload(square_job(1), "next.gcode")
        generator = random.Random(11)
        for _ in range(self.kills):
            time.sleep(generator.uniform(0.3, 4))
            self.printd.kill()
            time.sleep(generator.uniform(0, 1))
            self.printd.start()
        self.printer.wait_for_job(number, "done")
        self.assert_built_as_asked(number)
        self.assertEqual(self.printd.state_of(then), "queued", "it would home through the last part")
        self.printd.bed_is_clear()
        self.printer.wait_for_job(then, "done")
        self.assert_built_as_asked(then)


class KilledSketch(Case):
    kills = 10 if service.THOROUGH else 4

    def test_heat_goes_off_the_job_fails_and_the_queue_stays(self):
        generator = random.Random(13)
        was_hot = 0
        for _ in range(self.kills):
            number = self.upload(heating_job())
            other = self.upload(square_job(1), "other.gcode")
            self.printer.wait_for_job(number, "printing")
            time.sleep(generator.uniform(0, 4))  # anywhere: before it heats, while it homes, while it moves
            was_hot += self.printer.heater_duties()["hot_end"] > 0
            os.kill(self.printer.sketch_pid(), signal.SIGKILL)
            time.sleep(1)
            duties = self.printer.heater_duties()
            self.assertEqual(duties, {"hot_end": 0, "bed": 0}, "a second later no heater is on")
            self.printer.wait_for_job(number, "failed")
            self.assertIn(self.printd.state_of(other), ("queued", "held"))
            self.assertTrue(self.printd.job(number)["error"])
            self.printer.wait_for_state("idle")  # the supervisor has started it anew
            for each in (number, other):
                self.assertEqual(self.printd.request("DELETE", "/api/v1/jobs/%d" % each)[0], 204)
            self.assertEqual(self.printd.request("POST", "/api/v1/queue/release")[0] // 100, 2)
            self.printd.bed_is_clear()
        self.assertGreaterEqual(was_hot, self.kills // 2, "most kills came while a heater was on")


# Ends by itself whatever becomes of the test: after its time, by RLIMIT_RTTIME, with its parent,
# and by timeout(1) on core 0.
THIEF = """
import ctypes, os, resource, sys, time
ctypes.CDLL(None).prctl(1, 9)  # PR_SET_PDEATHSIG, SIGKILL
core, priority, length_s = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
limit_us = int(length_s * 1e6) + 300_000
resource.setrlimit(resource.RLIMIT_RTTIME, (limit_us, limit_us))
with open("/proc/self/comm", "w") as name:
    name.write("core-thief")
os.sched_setaffinity(0, {core})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
end = time.monotonic() + length_s
while time.monotonic() < end:
    pass
"""


class TakenCore(Case):
    """A real-time task of another program on the stepper loop's core, above its priority."""

    def setUp(self):
        if os.geteuid() != 0 or os.cpu_count() < 2:
            self.skipTest("needs root and two cores")
        super().setUp()

    def test_the_job_fails_with_the_name_of_the_task_that_took_the_core(self):
        number = self.upload(square_job(12))
        self.printer.wait_for_job(number, "printing")
        time.sleep(2)
        thief = subprocess.Popen(["taskset", "-c", "0", "timeout", "-s", "KILL", "6", sys.executable, "-c", THIEF, "1", "85", "3"])
        self.addCleanup(thief.wait)
        self.addCleanup(thief.kill)
        self.printer.wait_for_job(number, "failed", 30)
        self.assertRegex(self.printd.job(number)["error"], r"loop 2 hung.*: core 1 was taken by core-thief \(pid \d+, SCHED_FIFO 85\)")
        self.assertEqual(self.printer.heater_duties(), {"hot_end": 0, "bed": 0})
        self.printer.wait_for_state("idle")  # the thief is gone, and the sketch is there again, on its core


class SecondOwner(Case):
    """A second sketch that would own the stepper loop's core."""

    def setUp(self):
        if os.cpu_count() < 2:
            self.skipTest("needs two cores")
        super().setUp()

    def test_is_refused_by_the_name_of_the_first(self):
        second = subprocess.run([os.path.join(self.printer.programs, "pulse-train-linux"), "--for", "1"], capture_output=True, text=True,
                                timeout=30, check=False)
        self.assertEqual(second.returncode, 1, second.stderr)
        self.assertIn("core 1 is taken: printer (pid %d) owns it since 20" % self.printer.sketch_pid(), second.stderr)
        self.assertIn("stop that one, or give the loop another core", second.stderr)
        self.assertEqual(self.printd.machine()["state"], "idle")


class SilentSensor(Case):
    faults = ("bus_silent@12",)

    def test_heat_is_cut_and_the_job_fails_with_the_reason(self):
        number = self.upload(heating_job())
        self.printer.wait_for_job(number, "failed")
        self.assertIn("does not answer", self.printd.job(number)["error"])
        self.assertEqual(self.printer.heater_duties(), {"hot_end": 0, "bed": 0})
        self.assertEqual(self.printd.machine()["state"], "faulted")


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
