"""The archive that a kernel starts from: cpio in the "newc" format of the kernel's Documentation/driver-api/early-userspace/
buffer-format.rst, gzipped. Written here because it needs no root and no other program."""
import gzip
import lzma
import pathlib
import re
import subprocess

FOLDER = 0o040755
PROGRAM = 0o100755
FILE = 0o100644


def entry(number, name, mode, data=b''):
    """One member: a head of thirteen hexadecimal numbers, the name, the data; name and data padded to four bytes."""
    encoded = name.encode() + b'\0'
    fields = [number, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(encoded), 0]
    head = b'070701' + b''.join(b'%08X' % field for field in fields) + encoded
    return head + b'\0' * (-len(head) % 4) + data + b'\0' * (-len(data) % 4)


def archive(members):
    """`members`: (name, mode, data)."""
    out = b''.join(entry(number, *member) for number, member in enumerate(members, 1))
    return out + entry(0, 'TRAILER!!!', 0)


def plain_module(path):
    """A kernel module as the kernel loads it; newer Debian releases ship them packed."""
    data = path.read_bytes()
    return lzma.decompress(data) if path.suffix == '.xz' else data


def initramfs(path, init, modules):
    """Writes an archive with the program `init`, and `modules`: (file, parameters), to be loaded in that order."""
    members = [(folder, FOLDER, b'') for folder in ('dev', 'proc', 'sys', 'run', 'tmp', 'modules')]
    members.append(('init', PROGRAM, pathlib.Path(init).read_bytes()))
    for number, (module, parameters) in enumerate(modules):
        name = f'modules/{number}-{module.name.split(".")[0]}'
        members.append((name + '.ko', FILE, plain_module(module)))
        members.append((name + '.options', FILE, parameters.encode() + b'\n'))
    pathlib.Path(path).write_bytes(gzip.compress(archive(members), 1))


def of_this_computer(programs):
    """`programs` of this computer, and the libraries that they are linked with, as members under the names that they have here."""
    files = {pathlib.Path(program) for program in programs}
    for program in programs:
        linked = subprocess.run(['ldd', program], capture_output=True, text=True, check=True).stdout
        files |= {pathlib.Path(name) for name in re.findall(r'(/\S+) \(0x', linked)}
    folders = {folder for file in files for folder in file.parents if folder.name}
    return [*((str(folder)[1:], FOLDER, b'') for folder in sorted(folders)),
            *((str(file)[1:], PROGRAM, file.read_bytes()) for file in sorted(files))]


def shell_system(path, script, programs, files):
    """Writes an archive whose first process is dash, with /proc, /sys, /dev and /run, and carries out `script`; the machine is off then.
    `programs`: of this computer; `files`: {name: bytes}, programs as well."""
    init = ('#!/bin/dash\nmount -t proc none /proc; mount -t sysfs none /sys; mount -t devtmpfs none /dev; mount -t tmpfs none /run\n'
            'exec >/dev/console 2>&1 </dev/null\n' + script + '\necho o > /proc/sysrq-trigger\nsleep 60\n')
    members = [(folder, FOLDER, b'') for folder in ('dev', 'proc', 'sys', 'run', 'tmp')]
    members += of_this_computer(['/bin/dash', '/bin/mount', '/bin/sleep', '/bin/cat', *programs])
    members += [(name, PROGRAM, data) for name, data in {'init': init.encode(), **files}.items()]
    pathlib.Path(path).write_bytes(gzip.compress(archive(members), 1))
