"""A serial host prints through ./run --serial-port pty, over a noisy wire; the twin says what was built."""

import json
import math
import os
import signal
import socket
import sys
import tempfile
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "launcher"))
sys.path.insert(0, HERE)
from stack import MEMORY, Stack, read, service, wait_until  # noqa: E402
from host import Host, Printcore, checked, find_printcore  # noqa: E402
from noisy_wire import NoisyWire  # noqa: E402

SPEED = 20


def part(laps=2):
    """As a slicer writes it: hot, short lines, fans, a question, and the waits at both ends."""
    lines = ["M104 S200", "G28", "M109 S200", "G92 E0", "M82", "G1 X20 Y20 Z0.3 F6000"]
    for i in range(90 * laps):
        angle, z = i * math.pi / 45, 0.3 + i // 90 * 0.2
        lines.append("G1 X%.3f Y%.3f Z%.3f E%.4f F1800" % (60 + 25 * math.cos(angle), 60 + 25 * math.sin(angle), z, i * 0.06))
        if i % 30 == 0:
            lines.append("M106 S%d" % i)
    return lines + ["M107", "M104 S0", "M400"]


class SerialCase(unittest.TestCase):
    def setUp(self):
        self.stack = Stack("--speed", str(SPEED), "--serial-port", "pty")
        self.addCleanup(self.stack.stop)
        self.stack.wait_open()
        wait_until(lambda: self.stack.machine_state() == "idle", "the printer is idle; it said:\n" + self.stack.said)
        self.port = os.path.join(self.stack.state, "serial")

    def ask_twin(self, **question):
        with socket.socket(socket.AF_UNIX) as inspector:
            inspector.settimeout(60)
            inspector.connect(os.path.join(MEMORY, self.stack.folder(), "inspect"))
            inspector.sendall(json.dumps(question).encode() + b"\n")
            with inspector.makefile() as answers:
                return json.loads(answers.readline())

    def print_and_compare(self, make_host, noise):
        """Prints the part, and returns the host and the wire once the twin has found that it is the one."""
        lines = part()
        with tempfile.NamedTemporaryFile("w", suffix=".gcode") as file:
            file.write("\n".join(lines) + "\n")
            file.flush()
            self.assertTrue(self.ask_twin(op="job_begin", job="host", path=file.name)["ok"])
            wire = NoisyWire(self.port, noise, seed=7)
            self.addCleanup(wire.close)
            host = make_host(wire.host_end)
            self.addCleanup(host.close)
            host.print_lines(lines)
            report = self.ask_twin(op="job_end", job="host")["report"]
        self.assertTrue(report["matches"], json.dumps(report, indent=1))
        return host, wire


class OverAWire(SerialCase):
    def test_a_host_prints_the_part_over_a_noisy_wire(self):
        host, wire = self.print_and_compare(Host, 0.06)
        print("damaged lines:", wire.damaged, "errors heard:", host.errors)
        self.assertGreater(min(wire.damaged.values()), 0)
        self.assertGreater(host.errors, 0, "lines were asked for again")

    def test_printcore_prints_the_part_over_a_noisy_wire(self):
        found, why_not = find_printcore()
        if not found:
            self.skipTest(why_not)
        host, wire = self.print_and_compare(Printcore, 0.06)
        print("damaged lines:", wire.damaged, "errors heard:", host.errors)
        self.assertGreater(host.errors, 0, "lines were asked for again")


class Beside(SerialCase):
    def setUp(self):
        super().setUp()
        self.host = Host(self.port)
        self.host.hear_until("^start$")

    def tearDown(self):
        self.host.close()

    def test_it_answers_as_marlin(self):
        self.host.say("M115")
        heard = self.host.hear_until("^ok")
        self.assertTrue(any(line.startswith("FIRMWARE_NAME:") for line in heard), heard)
        for capability in ("AUTOREPORT_TEMP:1", "EMERGENCY_PARSER:1"):
            self.assertIn("Cap:" + capability, heard)
        self.host.say("M105")
        self.assertRegex(self.host.hear_until("^ok")[-1], r"^ok T:\d+\.\d\d /0\.00 B:\d+\.\d\d /0\.00 @:0 B@:0$")
        self.host.say("M155 S1")
        self.host.hear_until("^ok")
        self.assertRegex(self.host.hear_until("T:")[-1], r"^T:\d+\.\d\d /0\.00 B:")
        self.host.say("G28")
        self.host.hear_until("^ok")
        self.host.say("M114")
        self.assertRegex(self.host.hear_until("^ok")[-2], r"^X:0\.00 Y:0\.00 Z:0\.00 E:0\.00 Count X:0 Y:0 Z:0$")
        self.host.say("M1999")
        self.assertIn('echo:Unknown command: "M1999"', self.host.hear_until("^ok"))

    def test_a_host_and_a_job_exclude_each_other(self):
        self.host.say("G28")
        self.host.hear_until("^ok")
        status, made = self.stack.request("POST", "/api/v1/jobs", b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.gcode"\r\n\r\n'
                                          b'G28\r\n\r\n--x\r\nContent-Disposition: form-data; name="print"\r\n\r\ntrue\r\n--x--\r\n',
                                          {"Content-Type": "multipart/form-data; boundary=x"})
        self.assertIn(status, (200, 201), made)
        held = lambda: self.stack.request("GET", "/api/v1/jobs")[1]["queue"]["reason"]  # noqa: E731
        self.assertEqual(held(), "a serial host has the printer")
        status, answer = self.stack.request("POST", "/api/v1/queue/release")
        self.assertEqual((status, answer["error"]["message"]), (409, "a serial host has the printer: disconnect it first"))
        self.host.close()
        wait_until(lambda: held() in (None, ""), "the host has gone")
        self.assertEqual(self.stack.machine_state(), "idle", "somebody must look at the bed")
        self.assertEqual(self.stack.request("POST", "/api/v1/machine/bed-cleared")[0], 202)
        self.host = Host(self.port)
        wait_until(lambda: self.stack.request("GET", "/api/v1/jobs")[1]["jobs"][0]["state"] in ("printing", "done"), "the job begins")

    def test_m112_stops_it_behind_a_full_queue(self):
        self.host.say("G28")
        self.host.hear_until("^ok")
        flood = b"".join(b"G1 X90 Y20 F6000\n" if i % 2 else b"G1 X20 Y90\n" for i in range(1500))
        os.write(self.host.port, flood)
        time.sleep(0.3)  # some seconds of the printer's
        os.write(self.host.port, b"M112\n")
        sent = time.monotonic()
        self.host.hear_until("^Error:Printer halted. emergency stop")
        print("the host heard of the stop %.0f ms after its last byte" % ((time.monotonic() - sent) * 1000))
        self.assertEqual(self.stack.machine_state(), "faulted")

    def test_m112_stops_it_while_the_service_stands_still(self):
        """The service is stopped, and the host says more than all queues hold: 700 KB, then M112."""
        self.host.say("M104 S200")
        self.host.hear_until("^ok")
        wait_until(lambda: self.ask_twin(op="state")["hot_end"]["duty"] > 0, "the heater is on")
        printd = self.stack.pid_of("printd")
        os.kill(printd, signal.SIGSTOP)
        self.addCleanup(os.kill, printd, signal.SIGCONT)
        self.host.say_all(b"G4 P1\n" * 120_000 + b"M112\n")
        wait_until(lambda: self.ask_twin(op="state")["hot_end"]["duty"] == 0, "the heat is off, with the service still stopped")
        self.assertEqual(read("/proc/%d/stat" % printd).rsplit(")", 1)[1].split()[0], "T")
        os.kill(printd, signal.SIGCONT)
        self.host.hear_until("^Error:Printer halted. emergency stop")
        self.assertEqual(self.stack.machine_state(), "faulted")

    def test_lines_that_did_not_fit_are_printed_once(self):
        """The host floods a stopped service with all lines, then does what it is asked for."""
        count, step = 4000, 0.01
        lines = ["G28", "G90", "G1 X10 Y30 F6000", "G91"] + ["G1%sX%.2f F6000" % (" " * 190, step)] * count + ["G90", "M400", "M114"]
        printd = self.stack.pid_of("printd")
        os.kill(printd, signal.SIGSTOP)
        self.addCleanup(os.kill, printd, signal.SIGCONT)
        self.host.say_all(b"".join(checked(at, line) for at, line in enumerate(["M110 N0"] + lines)))
        os.kill(printd, signal.SIGCONT)
        heard = self.host.hear_until(r"^Resend: \d+")
        first = int(heard[-1].split()[1])
        print("asked for line %d of %d" % (first, len(lines)))
        self.assertGreater(first, 100)
        self.assertLess(first, len(lines))
        self.host.print_lines(lines, first)
        self.assertIn("X:%.2f Y:30.00" % (10 + count * step), " ".join(self.host.heard[-20:]), "each way was gone once")


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
