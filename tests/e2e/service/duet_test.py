"""A slicer whose host type is Duet, end to end: what PrusaSlicer and OrcaSlicer send, call by call, over real sockets to printd.

The dialogue is written from PrusaSlicer's public source of that host type and of its HTTP client: each call is a connection of its own, by
libcurl; the body of an upload is the file; the quotes of M32 are sent as they are. An answer of 400 or more, and `err` other than 0, are failures,
which the slicer shows with the answer's words.

Run by ctest, one test at a time: duet_test.py PRINTD FAKE-SKETCH SANITIZERS Class.test
"""

import json
import os
import sys
import unittest
import urllib.parse
import zlib

import service
from service import Folder, Printd, Sketch, gcode, wait_until

TIME = "time=2026-11-27T14:30:15"
LIMIT_MIB = 2


class Refused(Exception):
    """What a slicer shows: the status, and the answer's words."""

    def __init__(self, status, words):
        super().__init__("%d %s" % (status, words))
        self.status, self.words = status, words


class Slicer:
    """The calls of the host type Duet."""

    def __init__(self, printd, host=None):
        self.printd = printd
        self.host = host or "127.0.0.1:%d" % printd.port

    def call(self, method, target, body=b""):
        """The answer as JSON. A refusal is an error."""
        head = ["%s /%s HTTP/1.1" % (method, target), "Host: " + self.host, "User-Agent: PrusaSlicer/2.9.2", "Accept: */*"]
        if body:
            head += ["Content-Length: %d" % len(body), "Content-Type: application/x-www-form-urlencoded"]
        head.append("Connection: close")
        answer = self.printd.raw(("\r\n".join(head) + "\r\n\r\n").encode() + body, finish=False, timeout_s=120)
        first, _, content = answer.partition(b"\r\n\r\n")
        status = int(first.split()[1])
        if status >= 400:
            raise Refused(status, json.loads(content)["error"]["message"])
        return json.loads(content)

    def connect(self, password):
        """`err`: 0, or 1 for a wrong password."""
        return self.call("GET", "rr_connect?password=%s&%s" % (urllib.parse.quote(password or "reprap", safe=""), TIME))["err"]

    def disconnect(self):
        return self.call("GET", "rr_disconnect")["err"]

    def upload(self, name, content, more=""):
        return self.call("POST", "rr_upload?name=0:/gcodes/%s&%s%s" % (urllib.parse.quote(name, safe=""), TIME, more), content)["err"]

    def start(self, name):
        self.call("GET", "rr_gcode?gcode=M32%%20\"0:/gcodes/%s\"" % urllib.parse.quote(name, safe=""))

    def send(self, name, content, password, start):
        """The whole of the button "Upload", or "Upload and print"."""
        if self.connect(password) != 0:
            raise Refused(200, "Wrong password")
        try:
            self.upload(name, content)
            if start:
                self.start(name)
        finally:
            self.disconnect()


class Dialogue(unittest.TestCase):
    def setUp(self):
        self.folder = Folder()
        self.sketch = Sketch(self.folder.path, 20_000_000)
        self.printd = Printd(self.folder.path, ("--no-confirm-bed", "--upload-limit-mib", str(LIMIT_MIB)))
        self.slicer = Slicer(self.printd)
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")

    def tearDown(self):
        self.printd.stop()
        self.sketch.stop()
        self.folder.remove()

    def refusal(self, call, *arguments):
        with self.assertRaises(Refused) as refused:
            call(*arguments)
        return refused.exception

    def assert_nothing_was_kept(self):
        self.assertEqual(self.printd.jobs(), [])
        self.assertEqual(os.listdir(os.path.join(self.printd.state, "incoming")), [])

    def test_the_button_that_tests_the_connection(self):
        self.assertEqual(self.slicer.connect(self.printd.key), 0)
        self.assertEqual(self.slicer.disconnect(), 0)

    def test_a_file_is_sent_and_printed(self):
        content = gcode(300_000, 1)
        self.slicer.send("a part (2).gcode", content, self.printd.key, True)
        self.printd.wait_for_job(1, "done")
        self.assertEqual(self.sketch.bytes_of(1), content)
        self.assertEqual(self.printd.job(1)["name"], "a part (2).gcode")

    def test_a_file_that_is_only_sent_waits(self):
        self.slicer.send("a.gcode", gcode(5000, 2), self.printd.key, False)
        self.assertEqual(self.printd.state_of(1), "held")
        self.assertEqual([event for event in self.sketch.events() if event[0] == "begun"], [])

    def test_a_second_file_waits_for_its_turn(self):
        self.slicer.send("a.gcode", gcode(1_500_000, 3), self.printd.key, True)
        self.slicer.send("b.gcode", gcode(5000, 4), self.printd.key, True)
        self.assertIn(self.printd.state_of(2), ("queued", "printing", "done"))
        self.printd.wait_for_job(2, "done")
        self.assertEqual(self.sketch.bytes_of(2), gcode(5000, 4))

    def test_a_wrong_password_is_told_and_opens_nothing(self):
        for password in ("", "wrong", self.printd.key[:-1], self.printd.key + "x"):
            self.assertEqual(self.slicer.connect(password), 1, password)
        for call in (lambda: self.slicer.upload("a.gcode", gcode(1000)), lambda: self.slicer.start("a.gcode"), self.slicer.disconnect):
            self.assertEqual(self.refusal(call).status, 401)
        self.assert_nothing_was_kept()

    def test_behind_the_end_of_a_visit_the_key_is_asked_for_again(self):
        self.slicer.connect(self.printd.key)
        self.slicer.disconnect()
        self.assertEqual(self.refusal(self.slicer.upload, "a.gcode", gcode(1000)).status, 401)
        self.assert_nothing_was_kept()

    def test_a_wrong_checksum_keeps_nothing(self):
        content = gcode(200_000, 5)
        self.slicer.connect(self.printd.key)
        wrong = self.refusal(self.slicer.upload, "a.gcode", content, "&crc32=%08x" % (zlib.crc32(content) ^ 1))
        self.assertEqual((wrong.status, "CRC-32" in wrong.words), (422, True), wrong)
        self.assert_nothing_was_kept()
        self.assertEqual(self.slicer.upload("a.gcode", content, "&crc32=%08x" % zlib.crc32(content)), 0)

    def test_what_is_too_large_is_refused_with_words(self):
        self.slicer.connect(self.printd.key)
        large = self.refusal(self.slicer.upload, "a.gcode", gcode((LIMIT_MIB << 20) + 1000))
        self.assertEqual((large.status, "longer than this printer accepts" in large.words), (413, True), large)
        self.assert_nothing_was_kept()

    def test_a_file_that_does_not_fit_the_machine_is_refused_with_its_line(self):
        self.slicer.connect(self.printd.key)
        wrong = self.refusal(self.slicer.upload, "a.gcode", b"G28\nG1 X9999 F6000\n")
        self.assertEqual(wrong.status, 422)
        self.assert_nothing_was_kept()

    def test_under_a_name_that_is_not_the_printers_nothing_is_served(self):
        stranger = Slicer(self.printd, "printer.example:%d" % self.printd.port)
        wrong = self.refusal(stranger.connect, self.printd.key)
        self.assertEqual((wrong.status, "--allow-host" in wrong.words), (403, True), wrong)

    def test_a_page_in_a_browser_of_the_same_computer_moves_nothing(self):
        self.slicer.connect(self.printd.key)
        answer = self.printd.raw(b"GET /rr_gcode?gcode=G28 HTTP/1.1\r\nHost: 127.0.0.1\r\nUser-Agent: Mozilla/5.0 (X11; Linux)\r\n"
                                 b"Connection: close\r\n\r\n")
        self.assertEqual(answer.split()[1], b"403")


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv))
