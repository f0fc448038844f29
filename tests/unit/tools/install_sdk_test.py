"""What root installs can be used by everybody: read, and run with a Python that is not in root's home."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tools"))
import install_sdk  # noqa: E402

NOBODY = 65534


class Python(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(dir="/var/tmp")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.folder.chmod(0o755)

    def program(self, path, folder_mode=0o755, mode=0o755):
        path = self.folder / path
        path.parent.mkdir()
        path.write_text("#!/bin/sh\n", encoding="ascii")
        path.chmod(mode)
        path.parent.chmod(folder_mode)
        return str(path)

    def test_all_users_can_run_what_each_of_them_may_reach(self):
        self.assertTrue(install_sdk.may_be_run_by_all(self.program("open/python3")))
        closed = self.program("closed/python3", folder_mode=0o700)
        self.assertFalse(install_sdk.may_be_run_by_all(closed))
        self.assertFalse(install_sdk.may_be_run_by_all(self.program("own/python3", mode=0o700)))
        self.assertFalse(install_sdk.may_be_run_by_all(str(self.folder / "none/python3")))
        self.assertFalse(install_sdk.may_be_run_by_all(str(self.folder)), "a folder is no program")
        (self.folder / "link").symlink_to(closed)
        self.assertFalse(install_sdk.may_be_run_by_all(str(self.folder / "link")), "what is behind a link counts")

    def install_as_root(self, umask):
        """A build of scripts in the place of programs; its Python lies where root alone may go."""
        build, prefix, home = self.folder / "build", self.folder / "prefix", self.folder / "home"
        home.mkdir(mode=0o700)
        (home / "python3").symlink_to(sys.executable)
        for name in install_sdk.PROGRAMS:
            path = build / "bin" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("#!/bin/sh\n", encoding="ascii")
            path.chmod(0o700)
        nothing = {"libraries": [], "script": str(ROOT / "board/metal/x86/image.ld")}
        sdk = {"cxx": "/usr/bin/c++", "cc": "/usr/bin/cc", "include": str(ROOT), "python": str(home / "python3"), "sim": dict(nothing),
               "linux": dict(nothing), "metal": dict(nothing), "metal_aarch64": str(build / "none"), "ino_to_cpp": str(ROOT / "tools/ino/ino_to_cpp.py"),
               "as_arduino": str(ROOT / "tools/ino/as_arduino.py"), "unpack_zip": str(ROOT / "tools/library/unpack_zip.py")}
        (build / "qduino-sdk.json").write_text(json.dumps(sdk), encoding="utf-8")
        subprocess.run([sys.executable, "-B", ROOT / "tools/install_sdk.py", "--build", build, "--prefix", prefix], check=True, umask=umask,
                       capture_output=True)
        return prefix

    def test_another_user_can_use_what_root_installs(self):
        if os.geteuid() != 0:
            self.skipTest("needs root, and another user")
        if not any(map(install_sdk.may_be_run_by_all, install_sdk.PYTHONS)):
            self.skipTest("no Python for all users here")
        prefix = self.install_as_root(umask=0o077)
        sdk = json.loads((prefix / "lib/qduino/qduino-sdk.json").read_text(encoding="utf-8"))

        def as_nobody(*command):
            return subprocess.run(command, user=NOBODY, group=NOBODY, extra_groups=[], cwd="/", capture_output=True, text=True, check=False)

        ran = as_nobody(sdk["python"], "-B", prefix / "lib/qduino" / sdk["ino_to_cpp"], "--help")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        ran = as_nobody(sdk["python"], "-B", prefix / "lib/qduino" / sdk["as_arduino"], "--", "true")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(as_nobody(prefix / "bin/qduino").returncode, 0)
        unreadable = as_nobody(shutil.which("find"), prefix, "!", "-readable", "-o", "-type", "d", "!", "-executable")
        self.assertEqual((unreadable.stdout, unreadable.stderr), ("", ""))


if __name__ == "__main__":
    unittest.main(verbosity=2)
