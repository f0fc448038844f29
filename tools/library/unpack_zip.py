#!/usr/bin/env python3
"""Unpacks a zip into a new folder, or refuses it whole: `qduino lib install` calls it.

    unpack_zip.py ARCHIVE.zip FOLDER

An archive comes from anywhere. Refused, before anything is written: a name that leads out of the folder, a link or another thing
that is no file, an archive that would fill the disk (more than 512 MB, or 20,000 files). Damage is found by the zip's own check sums.
"""
import pathlib
import stat
import sys
import zipfile

BYTES_MAX = 512 << 20
FILES_MAX = 20_000


def offence(entries):
    """Why an archive with these entries is refused; '' when it is not."""
    if len(entries) > FILES_MAX:
        return f"has {len(entries)} files, more than {FILES_MAX}"
    if sum(entry.file_size for entry in entries) > BYTES_MAX:
        return f"would take more than {BYTES_MAX >> 20} MB"
    for entry in entries:
        name = pathlib.PurePosixPath(entry.filename)
        if name.is_absolute() or ".." in name.parts or "\\" in entry.filename or "\0" in entry.filename:
            return f"has a name that leads out of it: {entry.filename!r}"
        mode = entry.external_attr >> 16
        if stat.S_IFMT(mode) not in (0, stat.S_IFREG, stat.S_IFDIR):
            return f"has a link, or another thing that is no file: {entry.filename!r}"
    return ""


def main():
    archive, folder = sys.argv[1:3]
    try:
        with zipfile.ZipFile(archive) as opened:
            refused = offence(opened.infolist())
            if refused:
                sys.exit(f"the archive {refused}")
            opened.extractall(folder)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, ValueError) as error:
        sys.exit(f"the archive is no zip, or damaged: {error}")
    except OSError as error:
        sys.exit(f"the archive cannot be unpacked: {error}")


if __name__ == "__main__":
    main()
