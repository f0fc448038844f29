"""The print service, end to end: printd and the stand-in sketch as processes, clients over real sockets.

Run by ctest, one test at a time: service_test.py PRINTD FAKE-SKETCH SANITIZERS Class.test
"""

import hashlib
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

import service
from service import Folder, Live, Printd, Sketch, curl, gcode, wait_until


class Case(unittest.TestCase):
    rate = 20_000_000
    options = ("--no-confirm-bed",)  # several jobs in a row; BedConfirmation has it on

    def setUp(self):
        self.folder = Folder()
        self.sketch = Sketch(self.folder.path, self.rate)
        self.printd = Printd(self.folder.path, self.options)
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")

    def tearDown(self):
        self.printd.stop()
        self.sketch.stop()
        self.folder.remove()

    def wait_for(self, number, state):
        self.printd.wait_for_job(number, state)

    def begun(self):
        return [int(event[1]) for event in self.sketch.events() if event[0] == "begun"]

    def incoming(self):
        return os.listdir(os.path.join(self.printd.state, "incoming"))


class Uploads(Case):
    def test_curl_multipart_prints_to_the_end(self):
        content = gcode(300_000, 1)
        path = os.path.join(self.folder.path, "part one.gcode")
        with open(path, "wb") as file:
            file.write(content)
        url = "http://127.0.0.1:%d/api/v1/jobs" % self.printd.port
        job = json.loads(curl("-H", "X-Api-Key: " + self.printd.key, "-F", "file=@" + path, "-F", "print=true", url))
        self.assertEqual(job["name"], "part one.gcode")
        self.assertEqual(job["sha256"], hashlib.sha256(content).hexdigest())
        self.wait_for(job["id"], "done")
        self.assertEqual(self.sketch.bytes_of(1), content)

    def test_curl_put_waits_until_it_is_started(self):
        content = gcode(2_000_000, 2)
        path = os.path.join(self.folder.path, "p.gcode")
        with open(path, "wb") as file:
            file.write(content)
        url = "http://127.0.0.1:%d/api/v1/jobs/p.gcode" % self.printd.port
        job = json.loads(curl("-H", "X-Api-Key: " + self.printd.key, "-T", path, url))
        self.assertEqual(job["state"], "held")
        time.sleep(0.3)
        self.assertEqual(self.begun(), [])
        self.assertEqual(self.printd.request("POST", "/api/v1/jobs/1/start")[0], 200)
        self.wait_for(1, "done")
        self.assertEqual(self.sketch.bytes_of(1), content)
        self.assertEqual(self.printd.request("GET", "/api/v1/jobs/1/file")[1], content)

    def test_slicers_upload_as_they_do(self):
        url = "http://127.0.0.1:%d" % self.printd.port
        version = json.loads(curl("-H", "X-Api-Key: " + self.printd.key, url + "/api/version"))
        self.assertTrue(version["text"].startswith("OctoPrint"))
        path = os.path.join(self.folder.path, "slicer.gcode")
        with open(path, "wb") as file:
            file.write(gcode(50_000, 3))
        answer = json.loads(curl("-H", "X-Api-Key: " + self.printd.key, "-H", "Expect: 100-continue", "-F", "print=true", "-F", "path=",
                                 "-F", "file=@%s;filename=slicer.gcode" % path, url + "/api/files/local"))
        self.assertTrue(answer["done"])
        curl("-H", "X-Api-Key: " + self.printd.key, "-H", "Print-After-Upload: ?1", "-H", "Overwrite: ?1", "-T", path,
             url + "/api/v1/files/local/by-put.gcode")
        self.wait_for(1, "done")
        self.wait_for(2, "done")
        self.assertEqual(self.sketch.bytes_of(2), self.sketch.bytes_of(1))

    def test_150_megabytes_cost_little_memory(self):
        path = os.path.join(self.folder.path, "large.gcode")
        block = ("; " + "x" * 997 + "\n").encode() * 1000
        with open(path, "wb") as file:
            file.write(b"G28\n")
            for _ in range(150):
                file.write(block)
        url = "http://127.0.0.1:%d/api/v1/jobs" % self.printd.port
        before_kb = self.printd.resident_kb_max()
        job = json.loads(curl("-H", "X-Api-Key: " + self.printd.key, "-F", "file=@" + path, url))
        self.assertEqual(job["size"], 150_000_004)
        after_kb = self.printd.resident_kb_max()
        print("resident: %d kB before, %d kB at most" % (before_kb, after_kb))
        if not service.SANITIZED:  # a sanitizer's shadow is no memory of ours
            self.assertLess(after_kb, 64 * 1024)


class BadInput(Case):
    def test_each_gets_a_clear_error_and_leaves_nothing(self):
        cases = {
            "not G-code": (self.printd.upload("a.gcode", os.urandom(100_000)), 415),
            "text, but no G-code": (self.printd.upload("a.gcode", b"Dear printer,\nplease print.\n" * 50), 415),
            "too hot": (self.printd.upload("a.gcode", b"G28\nM104 S999\n"), 422),
            "out of bounds": (self.printd.upload("a.gcode", b"G28\nG90\nG1 X900 F6000\n"), 422),
            "a path in the name": (self.printd.upload("../../etc/x.gcode", b"G28\n"), 400),
            "a path in the address": (self.printd.put("..%2f..%2fx.gcode", b"G28\n"), 400),
            "empty": (self.printd.upload("a.gcode", b""), 400),
        }
        for what, ((status, answer, _), expected) in cases.items():
            self.assertEqual(status, expected, "%s: %s" % (what, answer))
            self.assertTrue(answer["error"]["message"], what)
        self.assertEqual(cases["too hot"][0][1]["error"]["line"], 2)
        self.assertEqual(cases["out of bounds"][0][1]["error"]["line"], 3)
        self.assertEqual(self.printd.jobs(), [])
        self.assertEqual(self.incoming(), [])
        self.assertEqual(os.listdir(os.path.join(self.printd.state, "blobs")), [])
        self.assertEqual(self.begun(), [])

    def assert_nothing_left(self):
        self.assertEqual(self.incoming(), [])
        self.assertEqual(os.listdir(os.path.join(self.printd.state, "blobs")), [])
        self.assertEqual(self.printd.jobs(), [])

    def test_a_bad_line_is_refused_where_it_stands_and_not_at_the_files_end(self):
        """The peer sends so much, stops, and reads: nothing more has come than the bad line."""
        lines = gcode(20_000, 5) + b"G1 X900\n"
        number = lines.count(b"\n")
        form = (b"--XX\r\nContent-Disposition: form-data; name=\"file\"; filename=\"a.gcode\"\r\n"
                b"Content-Type: application/octet-stream\r\n\r\n%s" % (lines + b";" * 100))
        key = b"Host: localhost\r\nX-Api-Key: %s\r\n" % self.printd.key.encode()
        length = b"Content-Length: 300000000\r\n\r\n"
        kind = b"Content-Type: multipart/form-data; boundary=XX\r\n"
        for sent in (b"PUT /api/v1/jobs/a.gcode HTTP/1.1\r\n" + key + length + lines,
                     b"PUT /api/v1/files/local/a.gcode HTTP/1.1\r\n" + key + b"Expect: 100-continue\r\n" + length + lines,
                     b"PUT /api/v1/jobs/a.gcode HTTP/1.1\r\n" + key + b"Transfer-Encoding: chunked\r\n\r\n%x\r\n%s\r\n" % (len(lines), lines),
                     b"POST /api/v1/jobs HTTP/1.1\r\n" + key + kind + length + form,
                     b"POST /api/files/local HTTP/1.1\r\n" + key + kind + length + form):
            answer = self.printd.raw(sent, finish=False)
            answer = answer.removeprefix(b"HTTP/1.1 100 Continue\r\n\r\n")
            self.assertTrue(answer.startswith(b"HTTP/1.1 422 "), (sent[:60], answer))
            self.assertEqual(answer.count(b"HTTP/1.1 "), 1)
            head, _, body = answer.partition(b"\r\n\r\n")
            self.assertIn(b"\r\nConnection: close", head)
            self.assertEqual(json.loads(body)["error"]["line"], number)
            self.assert_nothing_left()

    def test_curl_shows_the_refusal_of_a_file_that_it_is_still_sending(self):
        """At this rate the whole file would take two and a half minutes."""
        path = os.path.join(self.folder.path, "large.gcode")
        with open(path, "wb") as file:
            file.write(gcode(20_000, 5) + b"G1 X900\n")
            file.truncate(300_000_000)  # takes no room
        url = "http://127.0.0.1:%d" % self.printd.port
        for how in (("-T", path, url + "/api/v1/jobs/large.gcode"), ("--data-binary", "@" + path, "-X", "PUT", url + "/api/v1/jobs/large.gcode"),
                    ("-F", "file=@" + path, "-F", "print=true", url + "/api/files/local"), ("-F", "print=true", "-F", "file=@" + path, url + "/api/v1/jobs")):
            answer = subprocess.run(["curl", "-sS", "--limit-rate", "2M", "--max-time", "60", "-H", "X-Api-Key: " + self.printd.key, *how],
                                    capture_output=True, check=False)
            self.assertTrue(answer.stdout, (how, answer.stderr))
            self.assertIn("900", json.loads(answer.stdout)["error"]["message"], how)
            self.assert_nothing_left()

    def test_who_reads_only_when_all_is_sent_gets_the_refusal_too(self):
        status, answer, headers = self.printd.upload("a.gcode", gcode(20_000, 5) + b"G1 X900\n" + b";" * 60_000_000)
        self.assertEqual((status, headers["Connection"]), (422, "close"), answer)
        self.assert_nothing_left()

    def test_a_body_in_an_unknown_transfer_coding_is_never_a_request(self):
        hidden = b"POST /api/v1/machine/emergency-stop HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: %s\r\n\r\n" % self.printd.key.encode()
        for fields, status in ((b"Transfer-Encoding: gzip", b"501"), (b"Transfer-Encoding: chunked, gzip", b"501"),
                               (b"Transfer-Encoding: gzip\r\nTransfer-Encoding: chunked", b"501"),
                               (b"Transfer-Encoding: chunked\r\nContent-Length: 5", b"400"),
                               (b"Content-Length: 5\r\nTransfer-Encoding: xchunked", b"400")):
            answer = self.printd.raw(b"POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\n%s\r\n\r\n0\r\n\r\n%s" % (fields, hidden))
            self.assertTrue(answer.startswith(b"HTTP/1.1 " + status), (fields, answer))
            self.assertEqual(answer.count(b"HTTP/1.1 "), 1, (fields, answer))
            self.assertIn(b"\r\nConnection: close\r\n", answer)
        self.assertEqual(self.printd.machine()["state"], "idle")

    def test_a_line_of_10_megabytes_is_bounded(self):
        status, answer, _ = self.printd.upload("long.gcode", b"G28\nG1 X" + b"1" * 10_000_000 + b"\n")
        self.assertEqual(status, 422, answer)
        self.assertEqual(answer["error"]["line"], 2)
        self.assertEqual(self.printd.jobs(), [])

    def test_truncated_uploads_are_not_queued(self):
        key = "X-Api-Key: %s\r\n" % self.printd.key
        head = "PUT /api/v1/jobs/a.gcode HTTP/1.1\r\nHost: localhost\r\n" + key
        short = self.printd.raw((head + "Content-Length: 100000\r\n\r\n").encode() + gcode(50_000))
        self.assertIn(b"400", short.split(b"\r\n")[0])
        chunked = self.printd.raw((head + "Transfer-Encoding: chunked\r\n\r\n").encode() + b"5\r\nG28\n\n\r\n")
        self.assertIn(b"400", chunked.split(b"\r\n")[0])
        body = b"--XX\r\nContent-Disposition: form-data; name=\"file\"; filename=\"a\"\r\n\r\n" + gcode(50_000)
        multipart = self.printd.raw(("POST /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\n" + key + "Connection: close\r\n"
                                     "Content-Type: multipart/form-data; boundary=XX\r\nContent-Length: %d\r\n\r\n" % len(body)).encode() + body)
        self.assertIn(b"400", multipart.split(b"\r\n")[0])
        self.assertIn(b"end boundary", multipart)
        wait_until(lambda: self.incoming() == [], "temporary files are gone")
        self.assertEqual(self.printd.jobs(), [])

    def test_without_the_key_nothing_happens(self):
        for method, path in [("GET", "/api/v1/jobs"), ("POST", "/api/v1/machine/emergency-stop"), ("GET", "/metrics"),
                             ("PUT", "/api/v1/jobs/a.gcode")]:
            status, answer, _ = self.printd.request(method, path, body=b"G28\n" if method == "PUT" else None, key=False)
            self.assertEqual(status, 401, path)
            self.assertIn("key", answer["error"]["message"])
        self.assertEqual(self.printd.machine()["state"], "idle")
        self.assertEqual(Live(self.printd).status, 401)

    def test_hundreds_of_idle_and_slow_connections_do_not_lock_others_out(self):
        held = []
        for i in range(300):
            try:
                connection = socket.create_connection(("127.0.0.1", self.printd.port), timeout=5)
                if i % 2:
                    connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-A: ")
                held.append(connection)
            except OSError:
                break
        status = wait_until(lambda: self._healthy(), "the service answers", 40)
        self.assertEqual(status, 200)
        for connection in held:
            connection.close()

    def _healthy(self):
        try:
            return self.printd.request("GET", "/healthz", key=False, timeout_s=3)[0]
        except (OSError, EOFError):
            return None


class Queue(Case):
    rate = 300_000

    def test_reorder_hold_pause_resume_cancel_delete(self):
        contents = {n: gcode(8_000_000 if n == 1 else 30_000, n) for n in range(1, 6)}
        for n, content in contents.items():
            self.assertEqual(self.printd.put("job%d.gcode" % n, content, start=True)[0], 201)
        self.wait_for(1, "printing")
        self.assertEqual(self.printd.request("PATCH", "/api/v1/jobs/5", {"before": 2})[1]["position"], 1)
        self.assertEqual(self.printd.request("PATCH", "/api/v1/jobs/3", {"hold": True})[1]["state"], "held")
        self.assertEqual(self.printd.request("DELETE", "/api/v1/jobs/4")[0], 204)
        self.assertEqual(self.printd.request("DELETE", "/api/v1/jobs/1")[0], 409)
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/pause")[0], 202)
        self.wait_for(1, "paused")
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/pause")[0], 409)
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/resume")[0], 202)
        self.wait_for(1, "printing")
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/cancel")[0], 202)
        self.wait_for(1, "cancelled")
        self.wait_for(5, "done")
        self.wait_for(2, "done")
        runs = self.begun()
        self.assertEqual([self.sketch.bytes_of(run) for run in runs[1:]], [contents[5], contents[2]])
        self.assertEqual(self.printd.state_of(3), "held")
        self.printd.request("POST", "/api/v1/jobs/3/start")
        self.wait_for(3, "done")
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/cancel")[0], 409)

    def test_emergency_stop_fails_the_job_and_holds_the_queue(self):
        self.printd.put("a.gcode", gcode(2_000_000, 1), start=True)
        self.printd.put("b.gcode", gcode(1000, 2), start=True)
        self.wait_for(1, "printing")
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/emergency-stop")[0], 202)
        self.wait_for(1, "failed")
        self.assertEqual(self.printd.machine()["state"], "faulted")
        listing = self.printd.request("GET", "/api/v1/jobs")[1]
        self.assertTrue(listing["queue"]["held"])
        self.assertIn("emergency", listing["queue"]["reason"])
        self.printd.request("POST", "/api/v1/machine/clear-fault")
        wait_until(lambda: self.printd.machine()["state"] == "idle", "the fault is cleared")
        self.assertEqual(self.printd.state_of(2), "queued")
        self.printd.request("POST", "/api/v1/queue/release")
        self.wait_for(2, "done")

    def test_a_killed_sketch_fails_its_job_and_keeps_the_queue(self):
        self.printd.put("a.gcode", gcode(2_000_000, 1), start=True)
        self.printd.put("b.gcode", gcode(1000, 2), start=True)
        self.wait_for(1, "printing")
        self.sketch.stop(signal.SIGKILL)
        os.remove(self.sketch.log)
        os.remove(self.sketch.link)
        self.sketch = Sketch(self.folder.path, self.rate)
        self.wait_for(1, "failed")
        self.assertIn("anew", self.printd.job(1)["error"])
        self.assertEqual(self.printd.state_of(2), "queued")
        self.assertEqual(self.begun(), [])
        self.printd.request("POST", "/api/v1/queue/release")
        self.wait_for(2, "done")


class BedConfirmation(Case):
    """As printd is without options: each copy that moved waits for a person."""

    rate = 300_000
    options = ()

    def test_the_next_copy_waits_for_a_clear_bed_also_over_a_restart(self):
        self.printd.upload("two.gcode", gcode(20_000, 1), print="true", copies="2")
        self.printd.put("next.gcode", gcode(1000, 2), start=True)
        for copy in (1, 2):
            wait_until(lambda: self.printd.job(1)["copies_done"] == copy, "copy %d is printed" % copy)
            queue = self.printd.request("GET", "/api/v1/jobs")[1]["queue"]
            self.assertEqual(queue, {"held": False, "reason": None, "bed_occupied": True, "confirm_bed": True})
            self.printd.kill()
            self.printd.start()
            time.sleep(0.5)
            self.assertEqual(len(self.begun()), copy, "nothing begins onto what lies there")
            self.printd.bed_is_clear()
        self.wait_for(1, "done")
        self.wait_for(2, "done")
        self.assertEqual(len(self.begun()), 3)

    def test_a_cancelled_and_a_failed_job_leave_the_bed_occupied_too(self):
        for number, verb, state in ((1, "cancel", "cancelled"), (2, "emergency-stop", "failed")):
            self.printd.put("a.gcode", gcode(2_000_000, number), start=True)
            self.wait_for(number, "printing")
            self.assertEqual(self.printd.request("POST", "/api/v1/machine/" + verb)[0], 202)
            self.wait_for(number, state)
            self.assertTrue(self.printd.request("GET", "/api/v1/jobs")[1]["queue"]["bed_occupied"])
            self.printd.bed_is_clear()
        listed = self.printd.jobs()
        self.assertEqual([job["id"] for job in listed], [2, 1], "what failed last stands first of the ended")


class Recovery(Case):
    """The journal is lost or damaged: the uploads are not."""

    def damaged(self, damage):
        for n in range(1, 4):
            self.assertEqual(self.printd.put("part%%20%d.gcode" % n, gcode(30_000, n))[0], 201)
        self.assertEqual(self.printd.stop(), 0)
        damage(os.path.join(self.printd.state, "journal.sqlite"))

    def remove_copy(self):
        os.remove(os.path.join(self.printd.state, "journal.copy.sqlite"))

    def recover(self):
        return subprocess.run([service.PRINTD, "--recover", "--state", self.printd.state], capture_output=True, text=True, check=False)

    def check_all_there(self):
        jobs = {job["id"]: job for job in self.printd.jobs()}
        self.assertEqual({number: job["name"] for number, job in jobs.items()}, {n: "part %d.gcode" % n for n in range(1, 4)})
        for number, job in jobs.items():
            self.assertEqual(job["state"], "held")
            self.assertGreater(job["facts"]["lines"], 0)
            self.assertEqual(self.printd.request("GET", "/api/v1/jobs/%d/file" % number)[1], gcode(30_000, number))

    def test_a_missing_journal_wipes_nothing_and_recover_brings_all_back(self):
        self.damaged(os.remove)
        self.remove_copy()
        self.printd.start()
        self.assertIn("printd --recover", self.printd.queue_hold())
        self.assertEqual(self.printd.jobs(), [])
        busy = self.recover()
        self.assertEqual((busy.returncode, "already running" in busy.stderr), (3, True))
        self.printd.stop()
        self.assertIn("printd --recover", self.printd.log())
        done = self.recover()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("3 of 3: job 3 (part 3.gcode), held", done.stdout)
        self.assertIn("3 jobs made", done.stdout)
        self.printd.start()
        self.check_all_there()

    def test_garbage_ends_it_with_the_way_out(self):
        def garbage(path):
            with open(path, "wb") as file:
                file.write(os.urandom(40_000))

        self.damaged(garbage)
        self.remove_copy()
        refused = subprocess.run([service.PRINTD, "--state", self.printd.state, "--link", "x", "--listen", "127.0.0.1:0"],
                                 capture_output=True, text=True, check=False)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("printd --recover", refused.stderr)
        self.assertEqual(self.recover().returncode, 0)
        self.printd.start()
        self.check_all_there()

    def test_a_damaged_page_is_repaired_from_the_copy(self):
        def flip(path):
            with open(path, "r+b") as file:
                file.seek(4096 * 3)
                file.write(os.urandom(4096))

        self.damaged(flip)
        self.printd.start()
        self.assertIn("repaired", self.printd.queue_hold())
        self.check_all_there()
        self.assertTrue(any(name.startswith("journal.damaged-20") for name in os.listdir(self.printd.state)))


class LiveStream(Case):
    def test_status_jobs_history_and_uploads_arrive(self):
        ticket = self.printd.request("POST", "/api/v1/live-ticket")[1]["ticket"]
        live = Live(self.printd, "/api/v1/live?ticket=" + ticket)
        self.assertEqual(live.status, 101)
        self.assertIn("t_s", live.next_of("history"))
        self.assertTrue(live.next_of("status")["status"]["connected"])
        self.printd.put("a.gcode", gcode(200_000, 1), start=True)
        self.assertEqual(live.next_of("upload")["name"], "a.gcode")
        while (job := live.next_of("jobs")["jobs"][0])["state"] != "done":
            self.assertNotIn(job["state"], ("failed", "cancelled"), job)
        self.printd.request("POST", "/api/v1/machine/gcode", {"line": "M105"})
        self.assertEqual(live.next_of("reply")["text"], "ok")
        live.close()
        self.assertEqual(Live(self.printd, "/api/v1/live?ticket=" + ticket).status, 401, "a ticket is for once")

    def test_what_a_client_sends_behind_its_handshake_is_read(self):
        pings = b"".join(Live.ping(b"%d" % i) for i in range(400))  # longer than what the stream reads at once
        live = Live(self.printd, headers={"X-Api-Key": self.printd.key}, behind=pings + Live.ping(b"last"))
        self.assertEqual(live.status, 101)
        messages = 0
        while (frame := live.next_frame()) != (10, b"last"):
            messages += frame[0] == 1
            self.assertLess(messages, 60, "the stream goes on, and the pings were not answered")
        self.assertEqual(live.next_of("status")["type"], "status")
        live.close()

    def test_a_browser_comes_with_its_cookie_and_from_our_page(self):
        status, _, headers = self.printd.request("POST", "/api/v1/session", {"key": self.printd.key}, key=False)
        self.assertEqual(status, 204)
        cookie = headers["Set-Cookie"].split(";")[0]
        origin = "http://127.0.0.1:%d" % self.printd.port
        self.assertEqual(Live(self.printd, headers={"Cookie": cookie, "Origin": origin}).status, 101)
        self.assertEqual(Live(self.printd, headers={"Cookie": cookie, "Origin": "http://evil.example"}).status, 403)
        self.assertEqual(Live(self.printd, headers={"Cookie": cookie}).status, 403)

    def test_a_reader_that_never_reads_stops_nobody(self):
        deaf = Live(self.printd, headers={"X-Api-Key": self.printd.key})
        self.assertEqual(deaf.status, 101)
        for n in range(1, 4):
            self.printd.put("job%d.gcode" % n, gcode(300_000, n), start=True)
        self.wait_for(3, "done")
        self.assertEqual(Live(self.printd, headers={"X-Api-Key": self.printd.key}).next_of("status")["type"], "status")
        deaf.close()


class Process(unittest.TestCase):
    def setUp(self):
        self.folder = Folder()

    def tearDown(self):
        self.folder.remove()

    def test_a_second_start_says_that_one_is_running(self):
        printd = Printd(self.folder.path)
        second = subprocess.run([service.PRINTD, "--state", printd.state, "--link", "x", "--listen", "127.0.0.1:0"],
                                capture_output=True, text=True, check=False)
        self.assertEqual(second.returncode, 3)
        self.assertIn("already running", second.stderr)
        self.assertEqual(printd.stop(), 0)

    def test_a_port_in_use_and_a_bad_command_line_are_said(self):
        printd = Printd(self.folder.path)
        other = os.path.join(self.folder.path, "other")
        taken = subprocess.run([service.PRINTD, "--state", other, "--link", "x", "--listen", "127.0.0.1:%d" % printd.port],
                               capture_output=True, text=True, check=False)
        self.assertEqual(taken.returncode, 3)
        self.assertIn("is taken by another program", taken.stderr)
        for arguments in (["--listen", "127.0.0.1:99999"], ["--listen", "x:y"], ["--nonsense"], ["--after-failure", "explode"]):
            done = subprocess.run([service.PRINTD, "--state", other, "--link", "x"] + arguments, capture_output=True, check=False)
            self.assertEqual(done.returncode, 2, arguments)
        open_to_all = subprocess.run([service.PRINTD, "--state", other, "--link", "x", "--listen", "0.0.0.0:0", "--no-auth"],
                                     capture_output=True, text=True, check=False)
        self.assertEqual(open_to_all.returncode, 1)
        self.assertIn("--no-auth", open_to_all.stderr)
        printd.stop()

    def test_the_state_is_for_its_owner_alone(self):
        printd = Printd(self.folder.path)
        printd.put("a.gcode", gcode(1000))
        printd.stop()
        for folder, _, files in os.walk(printd.state):
            self.assertEqual(os.stat(folder).st_mode & 0o077, 0, folder)
            for name in files:
                self.assertEqual(os.stat(os.path.join(folder, name)).st_mode & 0o077, 0, name)

    def test_the_page_is_served_from_a_list(self):
        ui = os.path.join(self.folder.path, "ui")
        os.makedirs(os.path.join(ui, "assets"))
        with open(os.path.join(ui, "index.html"), "w", encoding="ascii") as file:
            file.write("<html>page</html>")
        printd = Printd(self.folder.path, ["--ui", ui])
        status, content, headers = printd.request("GET", "/", key=False)
        self.assertEqual((status, content), (200, b"<html>page</html>"))
        self.assertIn("script-src 'self'", headers["Content-Security-Policy"])
        for path in ("/../state/api-key", "/..%2fstate%2fapi-key", "/%2e%2e/state/api-key"):
            self.assertEqual(printd.request("GET", path, key=False)[0], 404, path)
        printd.stop()

    @unittest.skipUnless(os.geteuid() == 0, "needs root to give it up")
    def test_started_by_root_it_becomes_somebody_else(self):
        os.chmod(self.folder.path, 0o711)
        printd = Printd(self.folder.path, ["--run-as", "nobody"])
        with open("/proc/%d/status" % printd.process.pid, encoding="ascii") as file:
            status = dict(line.strip().split(":\t", 1) for line in file if ":\t" in line)
        self.assertNotIn("0", status["Uid"].split())
        self.assertNotIn("0", status["Gid"].split())
        self.assertEqual(status["NoNewPrivs"], "1")
        self.assertEqual(printd.put("a.gcode", gcode(1000))[0], 201)
        printd.stop()
        for name in ("journal.sqlite", "journal.copy.sqlite"):
            os.remove(os.path.join(printd.state, name))
        done = subprocess.run([service.PRINTD, "--recover", "--state", printd.state], capture_output=True, text=True, check=False)
        self.assertIn("1 jobs made", done.stdout, done.stderr)
        printd.start()
        self.assertEqual(len(printd.jobs()), 1, "what root has recovered is the service's own")
        printd.stop()


class Kills(Case):
    """kill -9 of the service at random moments. The sketch goes on; every byte of every acknowledged job arrives once."""

    rate = 600_000

    def upload_until_killed(self, seed, acknowledged):
        """Uploads with both forms; remembers what was acknowledged, and the one that was under way."""
        generator = random.Random(seed)
        while True:
            content = gcode(generator.randrange(100, 120_000), generator.getrandbits(48))
            try:
                if generator.random() < 0.5:
                    status, job, _ = self.printd.put("k.gcode", content, start=True)
                else:
                    status, job, _ = self.printd.upload("k.gcode", content, print="true")
            except (OSError, EOFError, ValueError, service.http.client.HTTPException):
                acknowledged.setdefault("unknown", []).append(content)
                return
            if status != 201:
                raise AssertionError("%s %s" % (status, job))
            acknowledged[job["id"]] = content
            time.sleep(generator.random() * 0.1)

    def test_random_kills_lose_and_repeat_nothing(self):
        seed = int(os.environ.get("SEED", "1"))
        generator = random.Random(seed)
        acknowledged = {}
        for kill in range(22):
            uploads = threading.Thread(target=self.upload_until_killed, args=(seed * 1000 + kill, acknowledged))
            uploads.start()
            time.sleep(generator.random() * 0.5)
            self.printd.kill()
            uploads.join()
            self.assertIsNone(self.sketch.process.poll(), "the sketch goes on")
            self.printd.start()
            states = {job["id"]: job for job in self.printd.jobs()}
            for number, content in acknowledged.items():
                if number != "unknown":
                    self.assertEqual(states[number]["sha256"], hashlib.sha256(content).hexdigest(), "seed %d" % seed)
        self.finish(acknowledged, seed)

    def all_done(self):
        jobs = self.printd.jobs()
        for job in jobs:
            if job["state"] in ("failed", "cancelled"):
                raise service.Hopeless("job %d is %s: %s" % (job["id"], job["state"], job["error"]))
        return all(job["state"] == "done" for job in jobs)

    def finish(self, acknowledged, seed):
        wait_until(self.all_done, "everything is printed", 50)
        unknown = [hashlib.sha256(content).hexdigest() for content in acknowledged.pop("unknown", [])]
        expected = sorted(hashlib.sha256(content).hexdigest() for content in acknowledged.values())
        runs = self.begun()
        self.assertEqual(len(runs), len(set(runs)))
        printed = sorted(hashlib.sha256(self.sketch.bytes_of(run)).hexdigest() for run in runs)
        ended = [event for event in self.sketch.events() if event[0] == "ended"]
        self.assertTrue(all(event[2] == "2" for event in ended), ended)
        # An upload that was durable but not yet acknowledged may have been queued: once, whole, and
        # it printed once.
        for digest in list(printed):
            if digest in unknown and digest not in expected:
                printed.remove(digest)
                unknown.remove(digest)
        self.assertEqual(printed, expected, "seed %d" % seed)
        self.assertGreater(len(expected), 10, "too few jobs to prove anything")
        print("%d jobs, %d runs, seed %d" % (len(expected), len(runs), seed))

    def test_a_print_goes_on_at_the_right_byte(self):
        content = gcode(3_000_000, 5)
        self.printd.put("long.gcode", content, start=True)
        self.wait_for(1, "printing")
        generator = random.Random(5)
        for _ in range(20):
            time.sleep(generator.random() * 0.15)
            self.printd.kill()
            self.printd.start()
        self.wait_for(1, "done")
        self.assertEqual(self.begun(), [1])
        self.assertEqual(self.sketch.bytes_of(1), content)

    def test_half_an_upload_is_swept(self):
        head = "PUT /api/v1/jobs/a.gcode HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: %s\r\nContent-Length: 900000\r\n\r\n" % self.printd.key
        connection = socket.create_connection(("127.0.0.1", self.printd.port))
        connection.sendall(head.encode() + gcode(400_000))
        wait_until(lambda: self.incoming(), "the upload has begun")
        self.printd.kill()
        self.printd.start()
        self.assertEqual(self.incoming(), [])
        self.assertEqual(self.printd.jobs(), [])
        connection.close()


class Load(Case):
    """A print, and thirty uploads of many sizes while it goes on."""

    rate = 250_000

    def test_thirty_uploads_while_printing(self):
        content = gcode(1_500_000, 1)
        self.printd.put("printing.gcode", content, start=True)
        self.wait_for(1, "printing")
        generator = random.Random(3)
        statuses = []

        def upload(size, seed):
            statuses.append(self.printd.put("load.gcode", gcode(size, seed))[0])

        threads = []
        for n in range(30):
            size = int(50_000 * (40 ** generator.random()))
            threads.append(threading.Thread(target=upload, args=(size, 100 + n)))
            threads[-1].start()
            time.sleep(generator.random() * 0.1)
        for thread in threads:
            thread.join()
        self.assertEqual(statuses, [201] * 30)
        self.wait_for(1, "done")
        self.assertEqual(self.begun(), [1], "what was only uploaded does not print")
        self.assertEqual(self.sketch.bytes_of(1), content)
        self.assertEqual(sum(job["state"] == "held" for job in self.printd.jobs()), 30)


if __name__ == "__main__":
    if shutil.which("curl") is None:
        sys.exit("curl is not installed")
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
