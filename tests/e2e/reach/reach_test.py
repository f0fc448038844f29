"""The printer as others on the network reach it: from network namespaces of their own.

Run by ctest, one test at a time: reach_test.py PRINTD FAKE-SKETCH SANITIZERS Class.test
"""

import json
import os
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(HERE)))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "service"), os.path.join(HERE, "..", "launcher")]
import service  # noqa: E402
from network import Lan, can_make_networks  # noqa: E402
from stack import read  # noqa: E402
from service import Folder, Live, Printd, Sketch, gcode, wait_until  # noqa: E402

PORT = 8080
NAME = "qduino-reach"


class OnTheLan(unittest.TestCase):
    """The service on one computer, visitors on others."""

    def setUp(self):
        why = can_make_networks()
        if why:
            self.skipTest(why)
        self.lan = Lan(["printer", "visitor", "stranger"])
        self.addCleanup(self.lan.remove)
        self.folder = Folder()
        self.addCleanup(self.folder.remove)
        self.here = self.lan.address["printer"]

    def start(self, *options, listen="[::]"):
        self.sketch = Sketch(self.folder.path, 20_000_000)
        self.addCleanup(self.sketch.stop)
        self.printd = RemotePrintd(self.lan, self.folder.path, options, listen)
        self.addCleanup(self.printd.stop)
        self.ca = os.path.join(self.printd.state, "tls", "certificate.pem")

    def curl(self, *words, on="visitor", trust=True):
        """(status, body) of a request by TLS from another computer; (0, what curl said)."""
        trusts = ["--cacert", self.ca] if trust else []
        done = self.lan.run(on, "curl", "-s", "-S", "--max-time", "60", "-w", "\n%{http_code}", *trusts, *words)
        body, _, status = done.stdout.rpartition(b"\n")
        return (int(status), body) if done.returncode == 0 else (0, done.stderr.decode())

    def url(self, path=""):
        return "https://%s:%d%s" % (self.here, PORT, path)


class RemotePrintd(Printd):
    """The service, with its tests' own requests from the same computer: there it speaks plainly."""

    def __init__(self, lan, folder, options, listen):
        self.lan = lan
        super().__init__(folder, options, "%s:%d" % (listen, PORT), lan.inside("printer"))

    def request(self, method, path, body=None, headers=None, key=True, timeout_s=60):
        return self.lan.on("printer", lambda: super(RemotePrintd, self).request(method, path, body, headers, key, timeout_s))


class Tls(OnTheLan):
    def test_the_certificate_names_the_printer_and_its_addresses(self):
        self.start("--name", NAME, "--allow-host", "print.example")
        self.assertRegex(self.printd.line, r"^https://%s:%d/#key=%s ([0-9A-F]{2}:){31}[0-9A-F]{2}\n$" % (re.escape(self.here), PORT, self.printd.key))
        shown = self.lan.run("visitor", "openssl", "s_client", "-connect", "%s:%d" % (self.here, PORT), "-CAfile", self.ca,
                             "-verify_return_error", "-verify_ip", self.here, input=b"").stdout.decode()
        self.assertIn("Verify return code: 0 (ok)", shown)
        for name in (NAME, NAME + ".local", "print.example"):
            self.assertEqual(self.curl("--resolve", "%s:%d:%s" % (name, PORT, self.here), "https://%s:%d/healthz" % (name, PORT)), (200, b"ok\n"))
        self.assertEqual(self.curl("--resolve", "other:%d:%s" % (PORT, self.here), "https://other:%d/healthz" % PORT)[0], 0)
        text = subprocess.run(["openssl", "x509", "-in", self.ca, "-noout", "-fingerprint", "-sha256"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(text.split("=")[1].strip(), self.printd.line.split()[1])
        self.assertEqual(os.stat(os.path.join(self.printd.state, "tls", "key.pem")).st_mode & 0o777, 0o600)

    def test_it_stays_and_is_made_anew_where_it_has_to_be(self):
        self.start("--name", NAME)
        first = self.printd.line.split()[1]
        self.printd.stop()
        self.printd.start()
        self.assertEqual(self.printd.line.split()[1], first)
        self.printd.stop()
        key = os.path.join(self.printd.state, "tls", "key.pem")
        ends_soon = ["openssl", "req", "-x509", "-key", key, "-days", "30", "-subj", "/CN=" + NAME, "-addext",
                     "subjectAltName=DNS:%s,DNS:%s.local,DNS:localhost,IP:%s,IP:127.0.0.1" % (NAME, NAME, self.here), "-out", self.ca]
        subprocess.run(ends_soon, check=True, capture_output=True)
        with open(key, "rb") as file:
            before = file.read()
        self.printd.start()
        self.assertEqual(self.curl(self.url("/healthz")), (200, b"ok\n"))
        end = subprocess.run(["openssl", "x509", "-in", self.ca, "-noout", "-checkend", str(700 * 86400)], capture_output=True, check=False)
        self.assertEqual(end.returncode, 0, "it is a new one")
        with open(key, "rb") as file:
            self.assertEqual(file.read(), before)

    def test_a_given_one_that_root_alone_may_read_is_shown(self):
        given = [os.path.join(self.folder.path, name) for name in ("given.pem", "given.key")]
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=given", "-addext",
                        "subjectAltName=IP:" + self.here, "-out", given[0], "-keyout", given[1]], check=True, capture_output=True)
        os.chmod(given[1], 0o600)
        os.chmod(self.folder.path, 0o755)
        self.start("--tls-certificate", given[0], "--tls-key", given[1], "--run-as", "nobody")
        self.ca = given[0]
        self.assertEqual(self.curl(self.url("/healthz")), (200, b"ok\n"))
        self.assertFalse(os.path.exists(os.path.join(self.printd.state, "tls")))

    def test_without_tls_nobody_else_is_served(self):
        self.start()
        plain = self.lan.run("visitor", "curl", "-s", "-i", "-H", "X-Api-Key: " + self.printd.key, "http://%s:%d/api/v1/machine" % (self.here, PORT)).stdout
        self.assertTrue(plain.startswith(b"HTTP/1.1 400"), plain)
        self.assertIn(b"https://", plain)
        self.assertEqual(self.printd.request("GET", "/api/v1/machine")[0], 200, "this computer itself may")
        self.assertEqual(self.curl("--tls-max", "1.1", self.url("/healthz"))[0], 0)
        refused = self.lan.run("printer", service.PRINTD, "--state", self.folder.path + "/other", "--link", "x", "--listen", "[::]:8081", "--no-auth")
        self.assertEqual(refused.returncode, 1)
        self.assertIn(b"loopback", refused.stderr)

    def test_the_cookie_is_secure_and_the_live_stream_comes(self):
        self.start("--name", NAME)
        trust = ssl.create_default_context(cafile=self.ca)
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")
        said = self.lan.run("visitor", "curl", "-s", "-i", "--cacert", self.ca, "-d", json.dumps({"key": self.printd.key}), self.url("/api/v1/session")).stdout.decode()
        cookie = re.search(r"Set-Cookie: (.*?)\r", said)[1]
        self.assertIn("; Path=/; Secure; HttpOnly; SameSite=Strict", cookie)

        def live(origin):
            wire = trust.wrap_socket(self.lan.connect("visitor", self.here, PORT), server_hostname=self.here)
            return Live(self.printd, headers={"Host": "%s:%d" % (self.here, PORT), "Cookie": cookie.split(";")[0], "Origin": origin},
                        behind=Live.ping(b"early"), connection=wire)
        stream = live("https://%s:%d" % (self.here, PORT))
        self.assertEqual(stream.status, 101)
        while not stream.next_of("status")["status"]["connected"]:
            pass
        self.printd.put("seen.gcode", gcode(200_000))
        while not any(job["name"] == "seen.gcode" for job in stream.next_of("jobs")["jobs"]):
            pass
        stream.close()
        foreign = live("http://%s:%d" % (self.here, PORT))
        self.assertEqual(foreign.status, 403, "a page that came without TLS")
        foreign.close()

    def test_slicers_upload_and_large_files_come_whole(self):
        self.start()
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")
        part = os.path.join(self.folder.path, "part.gcode")
        content = gcode(8_000_000)
        with open(part, "wb") as file:
            file.write(content)
        key = "X-Api-Key: " + self.printd.key
        status, made = self.curl("-H", key, "-H", "Expect:", "-F", "print=true", "-F", "path=", "-F", "file=@%s;filename=octoprint.gcode" % part,
                                 self.url("/api/files/local"))
        self.assertEqual(status, 201, made)
        resource = json.loads(made)["files"]["local"]["refs"]["resource"]
        self.assertTrue(resource.startswith(self.url("/api/v1/jobs/")), resource)
        number = int(resource.rsplit("/", 1)[1])
        self.printd.wait_for_job(number, "done", 90)
        self.assertEqual(self.curl("-H", key, resource + "/file"), (200, content))
        self.printd.bed_is_clear()
        status, made = self.curl("-H", key, "-H", "Print-After-Upload: ?1", "-T", part, self.url("/api/v1/files/local/prusalink.gcode"))
        self.assertEqual(status, 201, made)
        self.printd.wait_for_job(self.printd.jobs()[0]["id"], "done", 90)
        self.assertEqual(self.printd.jobs()[0]["name"], "prusalink.gcode")


class Strangers(OnTheLan):
    def hold(self, count, data):
        """`count` connections from the stranger that have sent `data`, and wait."""
        for _ in range(count):
            wire = self.lan.connect("stranger", self.here, PORT)
            self.addCleanup(wire.close)
            try:
                wire.sendall(data)
            except OSError:
                pass  # it had to leave already

    def owner_asks(self, times=5):
        for _ in range(times):
            began = time.monotonic()
            self.assertEqual(self.curl("-H", "X-Api-Key: " + self.printd.key, self.url("/api/v1/jobs"))[0], 200)
            self.slowest = max(getattr(self, "slowest", 0), time.monotonic() - began)

    def test_handshakes_that_never_end_lock_nobody_out_and_take_little(self):
        self.start()
        before = self.printd.resident_kb_max()
        hello = bytes.fromhex("1603010200010001fc0303") + bytes(300)  # the start of a ClientHello
        self.hold(500, hello)
        self.owner_asks()
        self.hold(500, b"\x16")
        self.owner_asks()
        if not service.SANITIZED:
            self.assertLess(self.printd.resident_kb_max() - before, 32 * 1024)

    def test_a_flood_of_handshakes_locks_nobody_out(self):
        self.start()
        stopped, begun = threading.Event(), []

        def flood():
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            while not stopped.is_set():
                try:
                    wire = self.lan.connect("stranger", self.here, PORT, 5)
                    context.wrap_socket(wire).close()
                    begun.append(1)
                except OSError:
                    pass
        floods = [threading.Thread(target=flood) for _ in range(8)]
        for each in floods:
            each.start()
        try:
            self.owner_asks(10)
        finally:
            stopped.set()
            for each in floods:
                each.join()
        self.assertGreater(len(begun), 0, "the stranger was served, too, while there was time")

    def test_open_tls_connections_take_little(self):
        self.start()
        before = self.printd.resident_kb_max()
        context = ssl.create_default_context(cafile=self.ca)
        for _ in range(300):
            wire = self.lan.connect("stranger", self.here, PORT)
            self.addCleanup(context.wrap_socket(wire, server_hostname=self.here).close)
        self.owner_asks()
        if not service.SANITIZED:
            self.assertLess(self.printd.resident_kb_max() - before, 300 * 32 + 8 * 1024)


class Name(OnTheLan):
    def resolve(self, name):
        """The addresses that another computer's resolver finds for NAME.local, and the port of the printer: python3-zeroconf's word."""
        script = ("import sys\nfrom zeroconf import Zeroconf\nz = Zeroconf(interfaces=[sys.argv[2]])\n"
                  "i = z.get_service_info('_https._tcp.local.', 'QduinoMC printer %s._https._tcp.local.' % sys.argv[1], 8000)\n"
                  "print(i.server, i.port, *i.parsed_addresses()) if i else print('nothing')\nz.close()\n")
        done = self.lan.run("visitor", "/usr/bin/python3", "-c", script, name, self.lan.address["visitor"])
        if b"No module named" in done.stderr:
            self.skipTest("python3-zeroconf is missing")
        return done.stdout.decode().split()

    def start_name(self, on, name=NAME):
        program = os.path.join(os.path.dirname(service.PRINTD), "printer-name")
        process = subprocess.Popen([*self.lan.inside(on), program, "--name", name, "--port", str(PORT), "--state", self.folder.path],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def stop():
            if process.poll() is None:
                process.terminate()
            process.communicate(timeout=30)
        self.addCleanup(stop)
        return process

    def test_another_computers_resolver_finds_it(self):
        process = self.start_name("printer")
        self.assertEqual(process.stdout.readline(), NAME + ".local\n")
        found = wait_until(lambda: self.resolve(NAME), "it was asked for")
        self.assertEqual(found[:2], [NAME + ".local.", str(PORT)])
        self.assertIn(self.here, found[2:])
        self.assertEqual(self.resolve("somebody-else"), ["nothing"])

    def test_a_name_that_another_has_is_not_taken(self):
        first = self.start_name("printer")
        self.assertEqual(first.stdout.readline(), NAME + ".local\n")
        second = self.start_name("stranger")
        self.assertEqual(second.wait(timeout=60), 1)
        self.assertIn("another computer on this network is called %s.local" % NAME, second.stderr.read())
        self.assertIsNone(first.poll())


class Whole(OnTheLan):
    """./run --lan, and everything that it prints."""

    def start_run(self, *options):
        """On a terminal of its own: the QR code is for one."""
        import pty
        master, slave = pty.openpty()
        state = os.path.join(self.folder.path, "state")
        os.makedirs(state)
        os.chmod(self.folder.path, 0o755)
        self.run_process = subprocess.Popen([*self.lan.inside("printer"), os.path.join(ROOT, "run"), "--no-build", "--state", state, "--port", str(PORT),
                                             "--lan", NAME, *options], stdin=slave, stdout=slave, stderr=slave, start_new_session=True)
        os.close(slave)
        self.said = b""

        def listen():
            try:
                while piece := os.read(master, 65536):
                    self.said += piece
            except OSError:
                pass
        reader = threading.Thread(target=listen, daemon=True)
        reader.start()

        def stop():
            if self.run_process.poll() is None:
                self.run_process.send_signal(signal.SIGTERM)
            self.run_process.wait(timeout=60)
            reader.join(timeout=10)
            os.close(master)
        self.addCleanup(stop)
        service.WATCHED["./run"] = (self.run_process, None)
        self.addCleanup(service.WATCHED.pop, "./run", None)
        wait_until(lambda: b"SHA-256" in self.said and b"Ctrl-C" in self.said, "./run has said where it is", 90)
        time.sleep(0.2)
        return re.search(r"Open +(https://\S+)", self.said.decode())[1]

    def code_on_screen(self):
        """What the QR code on the terminal says: zbarimg's word."""
        if not shutil.which("zbarimg"):
            self.skipTest("zbarimg is missing")
        lines = re.findall(r"\x1b\[30;107m(.*?)\x1b\[0m", self.said.decode())
        dark = {"█": (1, 1), "▀": (1, 0), "▄": (0, 1), " ": (0, 0)}
        rows = []
        for line in lines:
            rows += [[dark[c][0] for c in line], [dark[c][1] for c in line]]
        scale, border = 6, 4
        wide = [[0] * border + row + [0] * border for row in [[0] * len(rows[0])] * border + rows + [[0] * len(rows[0])] * border]
        picture = os.path.join(self.folder.path, "code.pgm")
        with open(picture, "wb") as file:
            file.write(b"P5 %d %d 255\n" % (len(wide[0]) * scale, len(wide) * scale))
            for row in wide:
                file.write(bytes(v for cell in row for v in [255 * (1 - cell)] * scale) * scale)
        return self.scanned(picture)

    @staticmethod
    def scanned(picture):
        return subprocess.run(["zbarimg", "-q", "--raw", picture], capture_output=True, text=True, check=False).stdout.strip()

    @staticmethod
    def part():
        walls = "".join("G1 X%d Y%d E%.2f F3000\n" % (60 + i % 2 * 40, 60 + i, i * 1.3) for i in range(1, 40))
        return "G28\nM104 S200\nM109 S200\nG1 Z0.2 F600\n" + walls

    def visit(self, address):
        part = os.path.join(self.folder.path, "part.gcode")
        with open(part, "w", encoding="ascii") as file:
            file.write(self.part())
        picture = os.path.join(self.folder.path, "phone.png")
        done = self.lan.run("visitor", "node", os.path.join(HERE, "visitor.mjs"), address, part, picture, timeout_s=200)
        if done.returncode == 77:
            self.skipTest(done.stdout.decode())
        self.assertEqual(done.returncode, 0, done.stdout.decode() + done.stderr.decode() + self.said.decode()[-3000:])
        return picture

    def test_a_browser_elsewhere_opens_the_printed_address_and_prints(self):
        address = self.start_run("--speed", "20")
        self.assertTrue(address.startswith("https://%s:%d/#key=" % (self.here, PORT)), address)
        self.assertIn("https://%s.local:%d/#key=" % (NAME, PORT), self.said.decode())
        self.assertEqual(self.code_on_screen(), address)
        picture = self.visit(address)
        self.assertTrue(self.scanned(picture).startswith(self.url("/#ticket=")), self.scanned(picture))

    def test_options_for_people_reach_the_service(self):
        self.start_run("--speed", "20", "--keep-jobs", "7", "--after-failure", "continue", "--upload-limit-mib", "1", "--trust-proxy", "127.0.0.9",
                       "--allow-host", "print.example")
        lines = [read("/proc/%s/cmdline" % pid).split("\0") for pid in filter(str.isdigit, os.listdir("/proc"))]
        service_line = next(line for line in lines if line[0].endswith("printd") and self.folder.path + "/state" in line)
        for option, value in (("--keep-jobs", "7"), ("--after-failure", "continue"), ("--upload-limit-mib", "1"), ("--trust-proxy", "127.0.0.9"),
                              ("--allow-host", "print.example"), ("--name", NAME)):
            self.assertEqual(service_line[service_line.index(option) + 1], value)


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv))
