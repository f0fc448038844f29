"""sched/, runtime/, arduino/, base/ and the seam are the same sources in an image as on Linux: held against each other in the commands
that the build runs. `same_sources.py BUILD_FOLDER`.

Fails, by name, on a source that one of the two has alone, and on a macro that one of the two is compiled with."""
import json
import pathlib
import re
import sys

ROOMS = ("base", "sched", "board", "runtime", "arduino")
# What is a system's stays on Linux: files, sockets, a terminal. An image has a half of its own.
LINUX_ALONE, METAL_ALONE = re.compile(r"arduino/host/\w+\.cpp"), re.compile(r"arduino/metal/\w+\.cpp")
# How the C++ library is told that it has no system; the version's number, which both have.
MACROS_ASIDE = re.compile(r"_GLIBCXX_EXTERN_TEMPLATE=.*|QDUINO_VERSION=.*")


def sources_of(file):
    """A source; or those that are compiled together in a generated one."""
    text = file.read_text() if "/Unity/" in str(file) else ""
    return [pathlib.Path(name) for name in re.findall(r'^#include "(.*)"$', text, re.M)] or [file]


def compiled(build):
    """By world: {source below the root: macros}."""
    root = build.resolve().parents[1]
    worlds = {"linux": {}, "metal": {}}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        target = re.search(r" -o (?:\S*/)?CMakeFiles/(\w+)\.dir/", entry["command"])
        world = {**{f"qduino_{room}": "linux" for room in ROOMS}, "qduino_metal_program": "metal"}
        if not target or target[1] not in world:
            continue
        macros = {macro for macro in re.findall(r" -D(\S+)", entry["command"]) if not MACROS_ASIDE.fullmatch(macro)}
        for source in sources_of(pathlib.Path(entry["file"])):
            name = source.resolve().relative_to(root).as_posix() if source.resolve().is_relative_to(root) else str(source)
            if name.split("/")[0] in ROOMS:
                worlds[world[target[1]]][name] = macros
    return worlds


def differences(linux, metal):
    for name in sorted(set(linux) ^ set(metal)):
        if not (LINUX_ALONE if name in linux else METAL_ALONE).fullmatch(name):
            yield f"{name}: {'Linux' if name in linux else 'an image'} alone has it"
    for name in sorted(set(linux) & set(metal)):
        if linux[name] != metal[name]:
            yield f"{name}: compiled with other macros: {' '.join(sorted(linux[name] ^ metal[name]))}"


def main():
    worlds = compiled(pathlib.Path(sys.argv[1]))
    if not worlds["metal"]:
        print("skipped: no images are built here")
        return 77
    found = list(differences(worlds["linux"], worlds["metal"]))
    print("\n".join(found))
    print(f"{len(set(worlds['linux']) & set(worlds['metal']))} sources are the same, {len(found)} differ")
    return 1 if found or len(worlds["metal"]) < 40 else 0


if __name__ == "__main__":
    sys.exit(main())
