"""Every command in a ```sh block of README, CONTRIBUTING and docs, typed as it stands there, one after the other in one shell.

Some cannot be run to their end here: ADAPTED says what is typed instead, and why. A command that is in neither way good fails.
"""

import glob
import os
import re
import shutil
import socket
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
PAGES = ["README.md", "CONTRIBUTING.md", *sorted(glob.glob("docs/*.md", root_dir=ROOT))]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


# Ends by itself when its words have come; fails when they do not.
UNTIL = r"""until_said() { local words=$1 file=$HOME/said; shift; rm -f "$file"; "$@" >"$file" 2>&1 & local pid=$!
  for _ in $(seq 900); do grep -q "$words" "$file" && break; kill -0 $pid 2>/dev/null || break; sleep 0.1; done
  local found=1; grep -q "$words" "$file" && found=0; kill -INT $pid 2>/dev/null; wait $pid
  [ $found -eq 0 ] || cat "$file"; return $found; }
"""

# A pattern of the whole command, and what is typed instead.
ADAPTED = [
    (r"\./run", lambda: "until_said 'Open   http' ./run --no-build --port %d --state \"$HOME/state\"" % free_port()),
    (r"\./run --metal", lambda: "until_said 'operating system: http' ./run --metal --no-build --port %d" % free_port()),
    # On this computer alone, and simulated: tests/e2e/reach has networks of its own.
    (r"\./run (--lan.*|--allow-host .*)", lambda options: "until_said 'Open   http' ./run --no-build --speed 20 --listen 127.0.0.1 %s --port %d "
     "--state \"$HOME/sim\"" % (options, free_port())),
    # A file of the reader's, for the printer that has just ended.
    (r"curl -H .* -F file=@part\.gcode .*", lambda: "command -v curl >/dev/null"),
    (r"\./run --speed 20", lambda: "until_said 'Open   http' ./run --no-build --speed 20 --port %d --state \"$HOME/sim\"" % free_port()),
    # Itself: it would never end. That it is there, and knows the option.
    (r"\./test( --\w+)?", lambda option="": "test -x ./test && grep -q -- '%s' ./test" % (option or "").strip()),
    (r"tools/check_format.sh --fix", lambda: "test -x tools/check_format.sh"),  # changes the tree; a test runs it without --fix
    # The programs are built; not into the system's folders.
    (r"\./install", lambda: "./install --no-build --prefix \"$HOME/.local\""),
    # Ctrl-C ends it.
    (r"qduino run", lambda: "timeout --signal=INT 4 qduino run; [ $? -eq 124 ]"),
    # Ctrl-C ends it, and the sketch that was uploaded is not left behind.
    (r"qduino monitor", lambda: "timeout --signal=INT 4 qduino monitor; ended=$?; qduino upload --stop && [ $ended -eq 124 ]"),
    (r"(qduino monitor --tty \S+)", lambda command: "until_said 'Serial is' " + command),
    # A program of the reader's at that port: tests/e2e/qduino/upload_test.py opens it as it does.
    (r"picocom -b 115200 \S+", lambda: "true"),
    # Minutes, and into the tree.
    (r"(build/release/bin/bench-seam +--against \S+)", lambda command: command + " --rounds 1"),
    (r"(build/release/bin/bench-[\w-]+) +--json > \S+", lambda program: "test -x %s" % program),
    # It reads a file of the reader's.
    (r"(build/release/bin/bench-plan) FILE.gcode --json", lambda program: "test -x %s" % program),
    # ./test has installed them.
    (r"apt-get install -y (?:musl-dev qemu-system-x86|g\+\+-aarch64-linux-gnu qemu-system-arm|bochs bochs-term bochsbios vgabios)", lambda: "true"),
    # It runs until Ctrl-C, and the port may be somebody's.
    (r"(qduino metal run sketches/web_light) --forward 8080:8080", lambda command: "( cd '%s' && %s --card virtio-net --for 1 )" % (ROOT, command)),
    # They take a compiler that few have: tests/metal/aarch64_test.py.
    (r"cmake --build --preset release --target metal-aarch64|qduino metal run .* --arch aarch64 .*", lambda: "true"),
    # It takes a core of a computer that was booted for it: tests/metal/beside_test.py has one.
    (r"sudo build/release/bin/virtual-machine --own-clock .*|sudo build/release/bin/qduino metal beside .*|build/release/bin/printd .* --print-link", lambda: "true"),
    (r"sudo qduino metal beside (sketches/\w+) --for 10", lambda sketch: "( cd '%s' && qduino metal build %s )" % (ROOT, sketch)),
    (r"(qduino metal run sketches/.*)", lambda command: "( cd '%s' && %s )" % (ROOT, command)),
    (r"bench/plot.py", lambda: "test -x bench/plot.py"),
    # Ends with the number of things this computer lacks.
    (r"qduino doctor", lambda: "qduino doctor | grep -q ."),
    (r"source <\((.*)\)", lambda command: "eval \"$(%s)\"" % command),
]


def commands_of(page):
    with open(os.path.join(ROOT, page), encoding="utf-8") as file:
        blocks = re.findall(r"^```sh\n(.*?)^```", file.read(), re.M | re.S)
    lines = [re.sub(r"(^|\s)#.*$", "", line).rstrip() for block in blocks for line in block.splitlines()]
    return [line for line in lines if line]


def typed(command):
    for pattern, instead in ADAPTED:
        match = re.fullmatch(pattern, command)
        if match:
            return instead(*match.groups())
    return command


def is_of_the_tree(command):
    return command.startswith(("./", "build/", "tools/", "bench/"))


class Commands(unittest.TestCase):
    def type_all(self, page):
        home = tempfile.mkdtemp(prefix="docs-e2e-")
        os.chmod(home, 0o755)  # the print service enters it as nobody
        self.addCleanup(shutil.rmtree, home)
        os.makedirs(os.path.join(home, ".zfunc"))
        os.makedirs(os.path.join(home, ".config/fish/completions"))
        script = [UNTIL, "cd \"$HOME\""]
        for number, command in enumerate(commands_of(page)):
            words = typed(command)
            where = "( cd '%s' && %s )" % (ROOT, words) if is_of_the_tree(command) else words
            script.append("{ %s ; } </dev/null || { echo \"NOT DONE %d: $?\"; exit 1; }" % (where, number))
        environment = {**os.environ, "HOME": home, "XDG_CACHE_HOME": os.path.join(home, ".cache"),
                       "PATH": os.path.join(home, ".local/bin") + ":" + os.environ["PATH"]}
        if not any(command == "./install" for command in commands_of(page)):
            environment["PATH"] = os.path.join(ROOT, "build/release/bin") + ":" + environment["PATH"]
        done = subprocess.run(["bash", "-c", "\n".join(script)], capture_output=True, text=True, env=environment, check=False,
                              timeout=800)
        self.assertEqual(done.returncode, 0, "%s\n%s\n%s" % (commands_of(page), done.stdout[-3000:], done.stderr[-3000:]))
        return home

    def test_readme(self):
        self.assertEqual(commands_of("README.md")[0], "./run")
        home = self.type_all("README.md")
        self.assertTrue(os.path.exists(os.path.join(home, "blinker", "blinker.ino")))

    def test_what_was_installed_goes_again(self):
        prefix = tempfile.mkdtemp(prefix="docs-e2e-")
        self.addCleanup(shutil.rmtree, prefix)
        for words in (["--no-build"], ["--remove"]):
            subprocess.run([os.path.join(ROOT, "install"), "--prefix", prefix, *words], check=True, capture_output=True)
        self.assertEqual([name for _, _, names in os.walk(prefix) for name in names], [])

    def test_the_other_pages(self):
        seen = 0
        for page in PAGES[1:]:
            with self.subTest(page):
                seen += len(commands_of(page))
                self.type_all(page)
        self.assertGreater(seen, 8)


if __name__ == "__main__":
    unittest.main(verbosity=2)
