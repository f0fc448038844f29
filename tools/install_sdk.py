"""Copies what `qduino` needs out of a build into a prefix, so that it works when the build is gone. Called by ./install.

    PREFIX/bin/qduino            -> ../lib/qduino/bin/qduino
    PREFIX/lib/qduino/           bin/ (qduino, its supervisor, a virtual machine), include/, lib/, tools/, qduino-sdk.json
    PREFIX/share/                the manual page, completions for bash, zsh and fish

The programs find qduino-sdk.json beside themselves (qduino/common/sdk.cpp); the paths in it are relative to it.

What root installs is for everybody: all users may read it, whatever root's umask and the modes in the source tree, and the programs that it
names are such as all users can run. The build's Python may be in root's home.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# The headers that a sketch may include, and those that they include: the folders below "arduino" in
# the arrows of ARCHITECTURE.md.
HEADERS = ("base", "posix", "sched", "channel", "board", "runtime", "arduino", "device")
PROGRAMS = ("qduino", "qduino-supervisor", "virtual-machine")
COMPLETIONS = {"bash": "bash-completion/completions/qduino", "zsh": "zsh/site-functions/_qduino",
               "fish": "fish/vendor_completions.d/qduino.fish"}


PYTHONS = ("/usr/bin/python3", "/usr/local/bin/python3", "/bin/python3")


def copy(source, target):
    os.makedirs(os.path.dirname(target), exist_ok=True)
    temporary = target + ".new"  # a program that runs keeps its old file
    # Never through what has that name already: in a prefix in somebody's home it may be a link, and
    # root would write to what that names.
    if os.path.lexists(temporary):
        os.unlink(temporary)
    with open(source, "rb") as old, open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600), "wb") as new:
        shutil.copyfileobj(old, new)
    shutil.copystat(source, temporary, follow_symlinks=False)
    if is_for_everybody():
        os.chmod(temporary, 0o755 if os.stat(source).st_mode & 0o100 else 0o644)
    os.replace(temporary, target)


def is_for_everybody():
    return os.geteuid() == 0


def may_be_run_by_all(program):
    """True when all users can run it: its own mode, and those of all folders on the way, also behind links."""
    for path in {os.path.abspath(program), os.path.realpath(program)}:
        try:
            if os.path.isdir(path) or os.stat(path).st_mode & 0o005 != 0o005:
                return False
            folder = os.path.dirname(path)
            while True:
                if not os.stat(folder).st_mode & 0o001:
                    return False
                if folder == os.path.dirname(folder):
                    break
                folder = os.path.dirname(folder)
        except OSError:
            return False
    return True


def python_for_users(of_the_build, others=PYTHONS):
    """The interpreter that the installed tools run with. Exits when there is none."""
    usable = may_be_run_by_all if is_for_everybody() else lambda path: os.access(path, os.X_OK)
    for python in (of_the_build, *others):
        if usable(python):
            return python
    sys.exit("install: no Python that all users can run is here (%s is not): install Debian's python3" % of_the_build)


def copy_headers(home):
    for folder in HEADERS:
        for at, _, files in os.walk(os.path.join(ROOT, folder)):
            for name in files if "third_party" not in at else ():
                if name.endswith((".h", ".hpp")) or "." not in name:
                    source = os.path.join(at, name)
                    copy(source, os.path.join(home, "include", os.path.relpath(source, ROOT)))


def installed_library(item, home):
    """A library of the build is copied and named relative to the SDK's file; the system's keep their names."""
    if not item.startswith(ROOT + os.sep):
        return item
    copy(item, os.path.join(home, "lib", os.path.basename(item)))
    return "lib/" + os.path.basename(item)


def installed_aarch64(built, home):
    """What images for aarch64 are linked with, where it has been built (the target metal-aarch64)."""
    name = "lib/aarch64/qduino-metal-sdk.json"
    if os.path.exists(built):
        with open(built, encoding="utf-8") as file:
            metal = json.load(file)
        own = [item for item in (*metal["libraries"], metal["script"]) if item.startswith("/")]
        for item in own:
            copy(item, os.path.join(home, "lib/aarch64", os.path.basename(item)))
        metal["libraries"] = [os.path.basename(item) if item in own else item for item in metal["libraries"]]
        metal["script"] = os.path.basename(metal["script"])
        with open(os.path.join(home, name), "w", encoding="utf-8") as file:
            json.dump(metal, file, indent=2)
    return name


def write_sdk(build, home):
    with open(os.path.join(build, "qduino-sdk.json"), encoding="utf-8") as file:
        sdk = json.load(file)
    sdk["include"] = ";".join(os.path.join("include", os.path.relpath(item, ROOT)) if item.startswith(ROOT) else item
                              for item in sdk["include"].split(";"))
    for board in ("sim", "linux", "metal"):
        sdk[board]["libraries"] = [installed_library(item, home) for item in sdk[board]["libraries"]]
    for tool in ("ino_to_cpp", "as_arduino", "unpack_zip"):
        copy(sdk[tool], os.path.join(home, "tools", tool + ".py"))
        sdk[tool] = "tools/%s.py" % tool
    # as_arduino.py reads it.
    copy(os.path.join(ROOT, "tools", "ino", "own_names.py"), os.path.join(home, "tools", "own_names.py"))
    copy(sdk["metal"]["script"], os.path.join(home, "lib", "image.ld"))
    sdk["metal"]["script"] = "lib/image.ld"
    sdk["metal_aarch64"] = installed_aarch64(sdk["metal_aarch64"], home)
    sdk["supervisor"] = "bin/qduino-supervisor"
    sdk["python"] = python_for_users(sdk["python"])
    for compiler in (sdk["cxx"], sdk["cc"]):
        if is_for_everybody() and not may_be_run_by_all(compiler):
            print("install: other users cannot run %s: they have to name a compiler with CXX" % compiler, file=sys.stderr)
    with open(os.path.join(home, "qduino-sdk.json"), "w", encoding="utf-8") as file:
        json.dump(sdk, file, indent=2)


def shared_files(prefix):
    return [os.path.join(prefix, "share", "man", "man1", "qduino.1"),
            *(os.path.join(prefix, "share", name) for name in COMPLETIONS.values())]


def install(build, prefix):
    home = os.path.join(prefix, "lib", "qduino")
    shutil.rmtree(home, ignore_errors=True)
    for program in PROGRAMS:
        copy(os.path.join(build, "bin", program), os.path.join(home, "bin", program))
    copy_headers(home)
    write_sdk(build, home)
    command = os.path.join(prefix, "bin", "qduino")
    os.makedirs(os.path.dirname(command), exist_ok=True)
    if os.path.lexists(command):
        os.remove(command)
    os.symlink(os.path.join("..", "lib", "qduino", "bin", "qduino"), command)
    copy(os.path.join(ROOT, "docs", "man", "qduino.1"), shared_files(prefix)[0])
    for shell, name in COMPLETIONS.items():
        target = os.path.join(prefix, "share", name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        with open(target, "wb") as file:
            file.write(subprocess.run([command, "completion", shell], check=True, capture_output=True).stdout)
    print("installed: %s" % command)


def remove(prefix):
    shutil.rmtree(os.path.join(prefix, "lib", "qduino"), ignore_errors=True)
    for path in (os.path.join(prefix, "bin", "qduino"), *shared_files(prefix)):
        if os.path.lexists(path):
            os.remove(path)
    print("removed from %s" % prefix)


def main():
    parser = argparse.ArgumentParser(description="Installs the command for sketches below a prefix.")
    parser.add_argument("--build", help="folder of the build, such as build/release")
    parser.add_argument("--prefix", required=True)
    parser.add_argument("--remove", action="store_true")
    arguments = parser.parse_args()
    prefix = os.path.abspath(arguments.prefix)
    if is_for_everybody():
        os.umask(0o022)
    try:
        if arguments.remove:
            remove(prefix)
        else:
            install(os.path.abspath(arguments.build), prefix)
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            sys.exit("install: %s is missing: the build is not whole. Build again, and then install." % error.filename)
        sys.exit("install: %s: %s. Give a folder that you may write with --prefix." % (error.filename, error.strerror))


if __name__ == "__main__":
    main()
