"""The archive that a kernel starts from: cpio in the "newc" format of the kernel's Documentation/driver-api/early-userspace/
buffer-format.rst, gzipped. Written here because it needs no root and no other program."""
import gzip
import lzma
import pathlib

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
