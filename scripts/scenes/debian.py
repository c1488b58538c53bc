"""Unpacks files of a Debian package without dpkg: an ar archive with data.tar.xz inside."""

import tarfile

MAGIC, HEADER_BYTES = b"!<arch>\n", 60


def unpack(package, folder, wanted):
    """Writes the files whose path begins with one of `wanted` into `folder`."""
    with open(package, "rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise ValueError(f"{package}: expected a Debian package")
        while header := file.read(HEADER_BYTES):
            name, size = header[:16].decode().strip(" /"), int(header[48:58])
            if name == "data.tar.xz":
                unpack_tar(file, folder, wanted)
                return
            file.seek(size + size % 2, 1)
    raise ValueError(f"{package}: data.tar.xz is absent")


def unpack_tar(file, folder, wanted):
    with tarfile.open(fileobj=file, mode="r|*") as archive:
        for member in archive:
            path = member.name.removeprefix("./")
            if member.isfile() and path.startswith(wanted) and ".." not in path.split("/"):
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_bytes(archive.extractfile(member).read())
