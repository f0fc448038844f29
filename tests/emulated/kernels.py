"""Debian's real-time kernels, out of its archive and into a cache, without installing them."""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / 'tools/debian'))
from foreign_package import NotToBeHad, apt, fetch  # noqa: E402

# What each machine needs of its package; the rest (some 300 MB) is left packed.
WANTED = {
    'arm64': ['./boot/vmlinuz-*'],
    'amd64': ['./boot/vmlinuz-*', './lib/modules/*/i2c-dev.ko*', './lib/modules/*/i2c-stub.ko*'],
}


def newest(architecture):
    """The name of the package, from the lists that have been fetched."""
    def named(state):
        meta = f'linux-image-rt-{architecture}'
        found = re.search(r'Depends: (linux-image-\S+)', apt(architecture, state, 'apt-cache', 'depends', meta))
        if not found:
            raise NotToBeHad(f'{meta} is in none of the sources of this machine (Debian has it)')
        return found[1]
    return named


def kernel(architecture, cache, fresh=False):
    """The folder with vmlinuz-*, the modules and `name`: from the cache, or fetched. Raises NotToBeHad."""
    cached = cache / f'kernel-{architecture}'
    if (cached / 'name').exists() and not fresh:
        return cached
    return fetch(architecture, newest(architecture), WANTED[architecture], cached)
