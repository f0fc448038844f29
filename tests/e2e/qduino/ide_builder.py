"""Builds sketches with Debian's unmodified arduino-builder, for the board that `qduino ide install` writes; and what the IDE then runs."""

import os
import pathlib
import re
import shlex
import subprocess

# Where the package is installed, and where ./test unpacks it.
ROOT = pathlib.Path(__file__).resolve().parents[3]
PLACES = [pathlib.Path("/usr"), ROOT / "build" / "arduino-builder" / "usr"]


def builder_place():
    """The prefix of an arduino-builder, or None."""
    return next((place for place in PLACES if (place / "bin" / "arduino-builder").exists()), None)


class IdeBuilder:
    def __init__(self, qduino, sketchbook, environment):
        self.qduino, self.book, self.environment = qduino, pathlib.Path(sketchbook), environment
        self.place = builder_place()

    def install(self, *options):
        subprocess.run([self.qduino, "ide", "install", self.book, *options], env=self.environment, check=True, capture_output=True, timeout=300)

    def build(self, sketch, build, libraries=()):
        """arduino-builder's end: returncode, stdout, stderr."""
        build.mkdir(parents=True, exist_ok=True)
        command = [self.place / "bin" / "arduino-builder", "-compile", "-fqbn", "qduino:linux:here", "-build-path", build,
                   "-hardware", self.place / "share" / "arduino-builder", "-hardware", self.book / "hardware",
                   "-tools", self.place / "share" / "arduino-builder", "-prefs", f"tools.ctags.path={self.place / 'bin'}", "-warnings", "all"]
        for folder in libraries:
            command += ["-libraries", folder]
        return subprocess.run([*command, sketch], env=self.environment, capture_output=True, text=True, timeout=800, check=False)

    def properties(self, board):
        """What the IDE knows when it uploads: boards.txt of the board, platform.txt of its tool."""
        folder = self.book / "hardware" / "qduino" / "linux"
        lines = [line for name in ("platform.txt", "boards.txt") for line in (folder / name).read_text(encoding="utf-8").splitlines()]
        known = {}
        for key, _, value in (line.partition("=") for line in lines if not line.startswith("#")):
            for prefix in (f"{board}.", "tools.qduino."):
                key = key.removeprefix(prefix)
            known[key] = value
        return known

    def upload(self, board, build, name, **environment):
        """Runs the upload's pattern, expanded as the IDE expands it."""
        known = dict(self.properties(board), **{"build.path": str(build), "build.project_name": name, "upload.verbose": ""})
        command = known["upload.pattern"]
        while (wanted := re.search(r"\{([\w.]+)\}", command)) is not None:
            command = command.replace(wanted[0], known[wanted[1]])
        return subprocess.run(shlex.split(command), env=dict(self.environment, **environment), capture_output=True, text=True, timeout=600,
                              check=False)


def clean_environment(cache):
    """No variable of the caller's changes what is built."""
    kept = {name: value for name, value in os.environ.items() if name not in ("QDUINO_HOME", "CXX", "CC", "CXXFLAGS", "CFLAGS", "LDFLAGS")}
    return dict(kept, XDG_CACHE_HOME=str(cache), XDG_STATE_HOME=str(cache / "state"), LC_ALL="C.UTF-8")
