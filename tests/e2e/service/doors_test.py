"""What strangers without a key can do to the print service, end to end: its memory stays small, and the owner gets through.

Run by ctest, one test at a time: doors_test.py PRINTD FAKE-SKETCH SANITIZERS Class.test

Each attack runs for some seconds while the owner asks with the right key, from the same address, again and again. Every one of his
requests is answered, the emergency stop within 2 s.
"""

import gzip
import http.client
import json
import os
import resource
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
import unittest

import service
from service import Folder, Live, Printd, Sketch, curl, gcode, wait_until

ATTACK_S = 4
ANSWER_S_MAX = 2  # what the owner may have to wait
ANSWERS_MIN = 6  # to judge by; a busy machine takes longer for them
GIVE_UP_S = 60
ASSET = "/assets/large.js"
ASSET_BYTES = 1_000_000


class Owner(threading.Thread):
    """Asks with the right key until told to stop, on a new connection each time; remembers what came of it."""

    ASKS = (("GET", "/api/v1/machine", 200), ("POST", "/api/v1/machine/emergency-stop", 202), ("GET", "/api/v1/jobs", 200))

    def __init__(self, printd):
        super().__init__()
        self.printd, self.answers, self.stopped = printd, [], threading.Event()

    def run(self):
        while not self.stopped.wait(0.02):
            method, path, expected = self.ASKS[len(self.answers) % len(self.ASKS)]
            began = time.monotonic()
            try:
                status = self.printd.request(method, path, timeout_s=10)[0]
            except (OSError, http.client.HTTPException) as error:
                status = type(error).__name__
            self.answers.append((method + " " + path, expected, status, time.monotonic() - began))


class Case(unittest.TestCase):
    memory_kb_more = 32 * 1024  # whatever the attack

    def setUp(self):
        self.folder = Folder()
        ui = os.path.join(self.folder.path, "ui")
        os.makedirs(os.path.join(ui, "assets"))
        self.asset = ("// a large file\n" + "let x = 1;\n" * (ASSET_BYTES // 11)).encode()
        for name, content in (("index.html", b"<html>page</html>"), ("assets/large.js", self.asset)):
            with open(os.path.join(ui, name), "wb") as file:
                file.write(content)
        self.ui = ui
        self.sketch = Sketch(self.folder.path, 20_000_000)
        self.printd = Printd(self.folder.path, ["--ui", ui])
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")
        self.before_kb = self.printd.resident_kb_max()
        # The attackers live in this process: it needs more descriptors than the service.
        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        descriptors = 4096 if hard == resource.RLIM_INFINITY else min(hard, 4096)
        resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, hard))
        self.connections_max = descriptors - 200
        self.open = []

    def tearDown(self):
        for connection in self.open:
            connection.close()
        self.printd.stop()
        self.sketch.stop()
        self.folder.remove()

    def connect(self, data=b"", receive_bytes=None):
        """A connection that has sent `data`, and waits for nothing."""
        connection = socket.socket()
        if receive_bytes:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        connection.settimeout(5)
        self.open.append(connection)
        connection.connect(("127.0.0.1", self.printd.port))
        connection.setblocking(False)
        self.send(connection, data)
        return connection

    @staticmethod
    def send(connection, data):
        """As much of it as the kernel takes; False when the peer has closed."""
        try:
            connection.send(data)
        except BlockingIOError:
            pass
        except OSError:
            return False
        return True

    def owner_gets_through(self, attack, seconds=ATTACK_S):
        """Runs `attack()` again and again for `seconds` while the owner asks. Then judges answers, times and memory."""
        owner = Owner(self.printd)
        owner.start()
        try:
            begin = time.monotonic()
            while True:
                attack()
                time.sleep(0.01)
                lasted = time.monotonic() - begin
                if lasted > seconds and (len(owner.answers) > ANSWERS_MIN or lasted > GIVE_UP_S):
                    break
        finally:
            owner.stopped.set()
            owner.join()
        refused = [answer for answer in owner.answers if answer[1] != answer[2]]
        self.assertEqual(refused, [], "%d of %d" % (len(refused), len(owner.answers)))
        self.assertGreater(len(owner.answers), ANSWERS_MIN)
        slowest = max(answer[3] for answer in owner.answers)
        self.assertLess(slowest, ANSWER_S_MAX * (4 if service.SANITIZED else 1))
        more_kb = self.printd.resident_kb_max() - self.before_kb
        print("%d answers, the slowest after %.3f s; %d kB more resident at most" % (len(owner.answers), slowest, more_kb))
        if not service.SANITIZED:  # a sanitizer's shadow is no memory of ours
            self.assertLess(more_kb, self.memory_kb_more)

    def keep(self, count, data, trickle=b""):
        """An attack: `count` connections that have sent `data`, a byte of `trickle` now and then; one that was closed comes again."""
        held, poll, next_trickle = {}, select.poll(), [time.monotonic()]
        count = min(count, self.connections_max)

        def attack():
            for number, _ in poll.poll(0):
                poll.unregister(number)
                held.pop(number).close()
            for _ in range(min(100, count - len(held))):
                try:
                    connection = self.connect(data)
                except OSError:
                    break
                held[connection.fileno()] = connection
                poll.register(connection, select.POLLRDHUP)
            if trickle and time.monotonic() > next_trickle[0]:
                next_trickle[0] = time.monotonic() + 0.5
                for connection in held.values():
                    self.send(connection, trickle)
        return attack


class Memory(Case):
    def test_answers_that_nobody_reads_are_not_piled_up(self):
        request = ("GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" % ASSET).encode()
        connections = [self.connect(request * 300, receive_bytes=4096) for _ in range(4)]
        self.owner_gets_through(lambda: [self.send(connection, request * 20) for connection in connections])

    def test_refusals_that_nobody_reads_are_not_piled_up(self):
        for request in (b"GET /api/v1/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"):
            connections = [self.connect(request * 2000, receive_bytes=4096) for _ in range(8)]
            self.owner_gets_through(lambda: [self.send(each, request * 100) for each in connections], ATTACK_S / 2)

    def test_a_chunk_whose_line_never_ends_is_not_kept(self):
        head = b"POST /api/v1/session HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n"
        block = b"x" * 1_000_000
        connections = []

        def attack():
            connections[:] = [each for each in connections if self.send(each, block)]
            while len(connections) < 4:
                connections.append(self.connect(head + b"5;extension="))
        self.owner_gets_through(attack)

    def test_many_large_heads_and_bodies_that_are_refused(self):
        head = "POST /api/v1/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000000000\r\n"
        head += "".join("X-%d: %s\r\n" % (i, "y" * 150) for i in range(90))
        self.owner_gets_through(self.keep(100, head.encode() + b"\r\n" + b"z" * 50_000, b"z" * 50_000))

    def test_files_that_are_downloaded_by_who_reads_nothing(self):
        self.assertEqual(self.printd.put("large.gcode", gcode(3_000_000))[0], 201)
        self.before_kb = self.printd.resident_kb_max()
        request = "GET /api/v1/jobs/1/file HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Api-Key: %s\r\n\r\n" % self.printd.key
        connections = [self.connect(request.encode() * 20, receive_bytes=4096) for _ in range(60)]
        self.owner_gets_through(lambda: [self.send(each, request.encode()) for each in connections])


class Places(Case):
    def test_heads_that_trickle_lock_nobody_out(self):
        self.owner_gets_through(self.keep(1000, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-A: ", b"a"))

    def test_large_heads_that_trickle_lock_nobody_out(self):
        self.owner_gets_through(self.keep(900, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-A: " + b"a" * 15_000, b"a"))

    def test_a_thousand_connections_that_say_nothing(self):
        self.owner_gets_through(self.keep(1000, b""))

    def test_logins_that_never_come_to_their_end(self):
        head = b"POST /api/v1/session HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 4000\r\n\r\n"
        self.owner_gets_through(self.keep(1000, head, b" "))

    def test_readers_that_take_nothing(self):
        self.owner_gets_through(self.keep(1000, ("GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" % ASSET).encode() * 3))

    def test_connections_that_come_and_go_as_fast_as_they_can(self):
        def attack():
            for _ in range(200):
                try:
                    self.connect(b"GET / HT")
                except OSError:
                    pass
            while len(self.open) > min(1200, self.connections_max - 200):
                self.open.pop(0).close()
        self.owner_gets_through(attack)

    def test_who_has_shown_the_key_keeps_his_place(self):
        upload = socket.create_connection(("127.0.0.1", self.printd.port), timeout=20)
        content = gcode(200_000, 1)
        upload.sendall(("PUT /api/v1/jobs/slow.gcode HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Api-Key: %s\r\nContent-Length: %d\r\n\r\n"
                        % (self.printd.key, len(content))).encode())
        session = http.client.HTTPConnection("127.0.0.1", self.printd.port, timeout=20)
        status, _, headers = self.printd.request("POST", "/api/v1/session", {"key": self.printd.key}, key=False)
        self.assertEqual(status, 204)
        cookie = {"Cookie": headers["Set-Cookie"].split(";")[0]}
        live = Live(self.printd, headers={"X-Api-Key": self.printd.key})

        def ask():
            session.request("GET", "/api/v1/machine", headers=cookie)
            answer = session.getresponse()
            answer.read()
            self.assertEqual(answer.status, 200)

        ask()
        place = session.sock
        flood = self.keep(1000, b"GET / HTTP/1.1\r\nX-A: ", b"a")
        sent = [0]

        def attack():
            flood()
            upload.sendall(content[sent[0]:sent[0] + 2000])
            sent[0] += 2000
            ask()
            self.assertIs(session.sock, place, "the connection is still the first one")
        self.owner_gets_through(attack)
        upload.sendall(content[sent[0]:])
        self.assertIn(b"201 Created", upload.recv(4096))
        upload.close()
        session.close()
        self.assertEqual(live.next_of("status")["type"], "status")
        live.close()

    def test_when_descriptors_run_out_a_stranger_goes(self):
        used = len(os.listdir("/proc/%d/fd" % self.printd.process.pid))
        resource.prlimit(self.printd.process.pid, resource.RLIMIT_NOFILE, (used + 250, used + 250))
        self.owner_gets_through(self.keep(300, b"GET / HT", b"T"))

    def test_with_few_descriptors_there_are_fewer_places(self):
        self.printd.stop()
        self.printd.wrapper = ["prlimit", "--nofile=600:600"]
        self.printd.start()
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")
        self.before_kb = self.printd.resident_kb_max()
        most = [0]
        flood = self.keep(1000, b"GET / HT", b"T")

        def attack():
            flood()
            most[0] = max(most[0], len(os.listdir("/proc/%d/fd" % self.printd.process.pid)))
        self.owner_gets_through(attack)
        self.assertLess(most[0], 560, "some are left for files")


class Keys(Case):
    def wrong(self, count):
        """Statuses of that many wrong keys, from this address."""
        return [self.printd.request("GET", "/api/v1/jobs", headers={"X-Api-Key": "wrong"}, key=False)[0] for _ in range(count)]

    def live_status(self, path):
        live = Live(self.printd, path)
        live.close()
        return live.status

    def test_wrong_keys_do_not_lock_out_the_right_one(self):
        cookie = self.printd.request("POST", "/api/v1/session", {"key": self.printd.key}, key=False)[2]["Set-Cookie"].split(";")[0]
        ticket = self.printd.request("POST", "/api/v1/live-ticket")[1]["ticket"]
        statuses = self.wrong(60)
        self.assertEqual(set(statuses), {401, 429})
        self.assertEqual(statuses[-1], 429, "wrong ones are told that they are too many")
        asks = {
            "the key": lambda: self.printd.request("GET", "/api/v1/jobs")[0],
            "as a bearer": lambda: self.printd.request("GET", "/api/v1/jobs", headers={"Authorization": "Bearer " + self.printd.key}, key=False)[0],
            "the session": lambda: self.printd.request("GET", "/api/v1/jobs", headers={"Cookie": cookie}, key=False)[0],
            "a login": lambda: self.printd.request("POST", "/api/v1/session", {"key": self.printd.key}, key=False)[0],
            "a ticket": lambda: self.live_status("/api/v1/live?ticket=" + ticket),
            "the stop": lambda: self.printd.request("POST", "/api/v1/machine/emergency-stop")[0],
        }
        self.assertEqual({what: ask() for what, ask in asks.items()},
                         {"the key": 200, "as a bearer": 200, "the session": 200, "a login": 204, "a ticket": 101, "the stop": 202})
        self.owner_gets_through(lambda: self.wrong(20), 2)


class Coding(Case):
    def fetch(self, *arguments):
        """Status, fields and decoded body as curl has them; and what came over the wire."""
        url = "http://127.0.0.1:%d%s" % (self.printd.port, ASSET)
        head, body = os.path.join(self.folder.path, "head"), os.path.join(self.folder.path, "body")
        measured = json.loads(curl("-D", head, "-o", body, "-w", '{"status":%{http_code},"wire":%{size_download}}', *arguments, url))
        with open(head, encoding="ascii") as file:
            fields = dict(line.strip().lower().split(": ", 1) for line in file if ": " in line)
        with open(body, "rb") as file:
            return measured["status"], fields, file.read() if measured["status"] == 200 else b"", measured["wire"]

    def test_curl_gets_the_coded_form_and_the_same_bytes(self):
        coded = gzip.compress(self.asset)
        with open(os.path.join(self.ui, "assets/large.js.gz"), "wb") as file:
            file.write(coded)
        self.printd.stop()
        self.printd.start()
        status, plain, body, wire = self.fetch()
        self.assertEqual((status, body, wire), (200, self.asset, len(self.asset)))
        self.assertNotIn("content-encoding", plain)
        status, fields, body, wire = self.fetch("--compressed")
        self.assertEqual((status, body), (200, self.asset))
        self.assertEqual((fields["content-encoding"], int(fields["content-length"]), wire), ("gzip", len(coded), len(coded)))
        self.assertEqual((plain["vary"], fields["vary"]), ("accept-encoding", "accept-encoding"))
        self.assertNotEqual(plain["etag"], fields["etag"])
        self.assertIn("immutable", fields["cache-control"])
        status, again, _, wire = self.fetch("--compressed", "-H", "If-None-Match: " + fields["etag"])
        self.assertEqual((status, again["etag"], wire), (304, fields["etag"], 0))
        status, head, _, _ = self.fetch("--compressed", "-I")
        self.assertEqual((status, int(head["content-length"])), (200, len(coded)))

    @unittest.skipUnless(shutil.which("node"), "the page is built with node")
    def test_the_forms_that_the_build_makes_are_the_file(self):
        script = os.path.join(os.path.dirname(__file__), "../../../web/ui/compress.mjs")
        subprocess.run(["node", script, self.ui], check=True)
        self.assertFalse(os.path.exists(os.path.join(self.ui, "index.html.gz")), "too small to gain by it")
        self.printd.stop()
        self.printd.start()
        for coding in ("gzip", "br"):
            fields = self.fetch("-H", "Accept-Encoding: " + coding)[1]
            self.assertEqual(fields["content-encoding"], coding)
            self.assertLess(int(fields["content-length"]), len(self.asset) / 3)
        status, _, body, _ = self.fetch("--compressed")
        self.assertEqual((status, body), (200, self.asset))


if __name__ == "__main__":
    if shutil.which("curl") is None:
        sys.exit("curl is not installed")
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
