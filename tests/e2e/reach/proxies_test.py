"""The printer behind nginx, haproxy and Caddy, by name and below a path, with the configurations of docs/reach.md, word for word.

Run by ctest, one test at a time: proxies_test.py PRINTD FAKE-SKETCH SANITIZERS Class.test

The configurations name real ports and files. So the test runs in a network of its own, with folders of its own in the places of
those files: it enters both first (unshare), which only root can.
"""

import json
import os
import re
import signal
import ssl
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(HERE)))
sys.path.insert(0, os.path.join(HERE, "..", "service"))
import service  # noqa: E402
from service import Folder, Live, Printd, Sketch, curl, gcode, wait_until  # noqa: E402

PROXIES = os.path.join(ROOT, "build", "proxies")
IDENTITY = "/etc/ssl/private/print.example.pem"
BY_NAME, BELOW = "https://print.example", "https://shop.example/printer"


def configuration_of(language, heading):
    """The code block of that language under that heading of docs/reach.md."""
    with open(os.path.join(ROOT, "docs", "reach.md"), encoding="utf-8") as file:
        section = file.read().split("### " + heading + "\n", 1)[1]
    return re.search(r"```%s\n(.*?)```" % language, section, re.S)[1]


class Proxied(unittest.TestCase):
    def setUp(self):
        if not os.path.exists(os.path.join(PROXIES, "usr")):
            self.skipTest("the proxies were not fetched (tools/dependencies.sh)")
        self.folder = Folder()
        self.addCleanup(self.folder.remove)
        self.certificate = self.make_identity()
        ui = self.page()
        self.sketch = Sketch(self.folder.path, 20_000_000)
        self.addCleanup(self.sketch.stop)
        self.printd = Printd(self.folder.path, ["--ui", ui, "--allow-host", "print.example", "--allow-host", "shop.example", "--trust-proxy",
                                                "127.0.0.1"], listen="127.0.0.1:8080")
        self.addCleanup(self.printd.stop)
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")

    def page(self):
        """The folder of a page that takes no browser to judge."""
        ui = os.path.join(self.folder.path, "ui")
        os.makedirs(os.path.join(ui, "assets"))
        for name, content in (("index.html", "<html>the page</html>"), ("assets/app.js", "// " + "x" * 200_000)):
            with open(os.path.join(ui, name), "w", encoding="ascii") as file:
                file.write(content)
        return ui

    def make_identity(self):
        """Certificate and key for both names, where the configurations look for them."""
        parts = [os.path.join(self.folder.path, name) for name in ("certificate.pem", "key.pem")]
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2", "-subj",
                        "/CN=print.example", "-addext", "subjectAltName=DNS:print.example,DNS:shop.example", "-out", parts[0], "-keyout",
                        parts[1]], check=True, capture_output=True)
        with open(IDENTITY, "w", encoding="ascii") as both:
            for part in parts:
                with open(part, encoding="ascii") as file:
                    both.write(file.read())
        return parts[0]

    def write(self, name, text):
        path = os.path.join(self.folder.path, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def start_proxy(self, *command):
        log = open(os.path.join(self.folder.path, "proxy.log"), "wb")
        environment = {**os.environ, "LD_LIBRARY_PATH": os.path.join(PROXIES, "usr/lib/x86_64-linux-gnu"), "HOME": self.folder.path,
                       "XDG_DATA_HOME": self.folder.path, "XDG_CONFIG_HOME": self.folder.path}
        proxy = subprocess.Popen([os.path.join(PROXIES, command[0]), *command[1:]], stdout=log, stderr=log, env=environment,
                                 cwd=self.folder.path)
        service.WATCHED["the proxy"] = (proxy, log.name)

        def stop():
            service.WATCHED.pop("the proxy", None)
            proxy.send_signal(signal.SIGTERM)
            proxy.wait(timeout=30)
            log.close()
        self.addCleanup(stop)
        wait_until(lambda: self.get(BY_NAME + "/healthz") == b"ok\n" and self.get(BELOW + "/healthz") == b"ok\n", "the proxy answers")

    def curl(self, *words, source="127.0.0.1"):
        return curl("--cacert", self.certificate, "--interface", source, "--resolve", "print.example:443:127.0.0.1", "--resolve",
                    "shop.example:443:127.0.0.1", *words)

    def get(self, url):
        return subprocess.run(["curl", "-s", "--cacert", self.certificate, "--resolve", "print.example:443:127.0.0.1", "--resolve",
                               "shop.example:443:127.0.0.1", url], capture_output=True, check=False).stdout

    def signs_in(self, base, key, source="127.0.0.1"):
        """(status, the cookie's line) of a browser's login."""
        origin = "/".join(base.split("/")[:3])
        said = self.curl("-i", "-H", "Origin: " + origin, "-d", json.dumps({"key": key}), base + "/api/v1/session", source=source).decode()
        status = int(re.findall(r"^HTTP/[\d.]+ (\d+)", said, re.M)[-1])
        cookie = re.search(r"^set-cookie: (.*?)\r$", said, re.M | re.I)
        return status, cookie[1] if cookie else ""

    def check_page_and_session(self, base):
        prefix = base.split("example", 1)[1]
        self.assertEqual(self.curl(base + "/"), b"<html>the page</html>")
        self.assertEqual(len(self.curl(base + "/assets/app.js")), 200_003)
        if prefix:
            self.assertEqual(b"308", self.curl("-s", "-o", "/dev/null", "-w", "%{http_code}", base))
        status, cookie = self.signs_in(base, self.printd.key)
        self.assertEqual(status, 204)
        self.assertIn("; Path=%s/; Secure; HttpOnly" % prefix, cookie)
        session = cookie.split(";")[0]
        machine = json.loads(self.curl("-H", "Cookie: " + session, base + "/api/v1/machine"))
        self.assertTrue(machine["connected"])
        return session

    def check_live(self, base, session):
        host = base.split("/")[2]
        path = base.split("example", 1)[1] + "/api/v1/live"
        trust = ssl.create_default_context(cafile=self.certificate)

        def connect(origin):
            import socket
            wire = trust.wrap_socket(socket.create_connection(("127.0.0.1", 443), timeout=20), server_hostname=host)
            return Live(self.printd, path, {"Host": host, "Cookie": session, "Origin": origin}, connection=wire)
        live = connect("https://" + host)
        self.assertEqual(live.status, 101)
        self.assertTrue(live.next_of("status")["status"]["connected"])
        live.close()
        foreign = connect("https://evil.example")
        self.assertEqual(foreign.status, 403)
        foreign.close()

    def check_slicers(self, base):
        """As PrusaSlicer's two dialogues upload."""
        part = self.write("part.gcode", gcode(300_000).decode())
        key = "X-Api-Key: " + self.printd.key
        version = json.loads(self.curl("-H", key, base + "/api/version"))
        self.assertTrue(version["text"].startswith("OctoPrint"))
        made = json.loads(self.curl("-H", key, "-F", "print=true", "-F", "path=", "-F", "file=@%s;filename=o.gcode" % part,
                                    base + "/api/files/local"))
        self.assertTrue(made["done"] and made["effectivePrint"], made)
        resource = made["files"]["local"]["refs"]["resource"]
        self.assertTrue(resource.startswith(base + "/api/v1/jobs/"), resource)
        job = json.loads(self.curl("-H", key, resource))
        self.assertEqual(job["name"], "o.gcode")
        self.printd.wait_for_job(job["id"], "done")
        self.printd.bed_is_clear()
        status = self.curl("-o", "/dev/null", "-w", "%{http_code}", "-H", key, "-H", "Print-After-Upload: ?1", "-T", part,
                           base + "/api/v1/files/local/p.gcode")
        self.assertEqual(status, b"201")
        number = self.printd.jobs()[0]["id"]
        self.assertEqual(self.printd.job(number)["name"], "p.gcode")
        self.printd.wait_for_job(number, "done")
        self.printd.bed_is_clear()

    def check_wrong_keys_are_the_clients(self):
        """The proxy's address is not locked out by a guesser behind it, nor can a guesser choose his address."""
        guess = lambda source: self.curl("-o", "/dev/null", "-w", "%{http_code} ", "-H", "X-Api-Key: wrong", "-H",  # noqa: E731
                                         "X-Forwarded-For: 198.51.100.[1-25]", "-H", "X-Forwarded-Proto: http",
                                         BY_NAME + "/api/v1/machine?[1-25]", source=source).split()
        answers = guess("127.0.0.5")
        self.assertEqual(answers[:20], [b"401"] * 20)
        self.assertIn(b"429", answers[20:])
        self.assertEqual(guess("127.0.0.6")[:20], [b"401"] * 20)

    def check_all(self):
        for base in (BY_NAME, BELOW):
            with self.subTest(base):
                session = self.check_page_and_session(base)
                self.check_live(base, session)
                self.check_slicers(base)
        self.check_wrong_keys_are_the_clients()
        self.assertEqual(self.signs_in(BELOW, "wrong")[0], 401)


class Nginx(Proxied):
    def start_nginx(self):
        servers = configuration_of("nginx", "nginx, by name") + configuration_of("nginx", "nginx, below a path")
        places = "".join("%s_temp_path %s;" % (kind, self.folder.path) for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        main = self.write("nginx.conf", "daemon off; master_process off; pid %s/pid; error_log stderr;\nevents {}\nhttp { access_log off; %s\n%s}\n"
                          % (self.folder.path, places, servers))
        self.start_proxy("usr/sbin/nginx", "-p", self.folder.path, "-e", "stderr", "-c", main)

    def test_by_name_and_below_a_path(self):
        self.start_nginx()
        self.check_all()


class Browser(Nginx):
    """The real page, in Chromium, below a path."""

    test_by_name_and_below_a_path = None

    def page(self):
        return os.path.join(ROOT, "web", "ui", "dist")

    def test_the_page_lives_below_a_path(self):
        if not os.path.exists(self.page()):
            self.skipTest("the page is not built (tools/build_page.sh)")
        self.start_nginx()
        done = subprocess.run(["node", os.path.join(HERE, "behind.mjs"), "%s/#key=%s" % (BELOW, self.printd.key)], capture_output=True,
                              text=True, timeout=100, check=False)
        if done.returncode == 77:
            self.skipTest(done.stdout)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr + self.printd.log())


class Haproxy(Proxied):
    def test_by_name_and_below_a_path(self):
        main = self.write("haproxy.cfg", configuration_of("haproxy", "haproxy, by name and below a path"))
        self.start_proxy("usr/sbin/haproxy", "-f", main)
        self.check_all()


class Caddy(Proxied):
    def test_by_name_and_below_a_path(self):
        main = self.write("Caddyfile", configuration_of("caddy", "Caddy, by name and below a path"))
        self.start_proxy("usr/bin/caddy", "run", "--config", main, "--adapter", "caddyfile")
        self.check_all()


class Untrusted(Proxied):
    """Whoever is no named proxy says what he likes."""

    FORGED = ("-H", "X-Forwarded-Proto: https", "-H", "X-Forwarded-Prefix: /forged", "-H", "X-Forwarded-Host: print.example")

    def sign_in_from(self, source, *fields):
        return curl("-i", "--interface", source, *fields, "-d", json.dumps({"key": self.printd.key}),
                    "http://127.0.0.1:8080/api/v1/session").decode()

    def test_forwarded_fields_count_for_nothing(self):
        forged, trusted = self.sign_in_from("127.0.0.2", *self.FORGED), self.sign_in_from("127.0.0.1", *self.FORGED)
        self.assertIn("; Path=/; HttpOnly", forged)
        self.assertNotIn("Secure", forged)
        self.assertIn("; Path=/forged/; Secure; HttpOnly", trusted)
        statuses = [curl("-o", "/dev/null", "-w", "%{http_code}", "--interface", "127.0.0.2", "-H", "X-Api-Key: wrong", "-H",
                         "X-Forwarded-For: 198.51.100.%d" % i, "http://127.0.0.1:8080/api/v1/machine") for i in range(22)]
        self.assertEqual((statuses[0], statuses[-1]), (b"401", b"429"))
        named = curl("--interface", "127.0.0.2", "-H", "Host: evil.example", *self.FORGED, "http://127.0.0.1:8080/")
        self.assertIn(b"--allow-host", named)


if __name__ == "__main__":
    if os.geteuid() != 0:
        print("skipped: only root makes network namespaces")
        sys.exit(0)
    if "QDUINO_OWN_NETWORK" not in os.environ:
        os.environ["QDUINO_OWN_NETWORK"] = "1"
        os.execvp("unshare", ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", sys.executable, "-B", *sys.argv])
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    os.makedirs("/etc/ssl/private", exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/etc/ssl/private"], check=True)
    unittest.main(argv=service.configure(sys.argv))
