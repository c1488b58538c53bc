#!/usr/bin/env python3
"""Packs the built programs (docs/use/install.md). The same build gives the same bytes.

dist.py BUILD OUT archive wheel  writes an archive that runs where it is unpacked, and a Python wheel
dist.py BUILD OUT install        copies the archive's files into OUT/bin, OUT/lib and OUT/share
"""

import argparse
import base64
import gzip
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

try:
    import tomllib
except ImportError:  # before Python 3.11
    from pip._vendor import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
CARGO = os.environ.get("CARGO", "cargo")
PROGRAMS = ["replay", "tracegen"]
LIBRARIES = ["lib/parallax/libparallax_layer.so", "lib/parallax/libparallax_xr.so"]
DOCUMENTS = "share/doc/parallax/"
COMPLETIONS = {
    "bash": "share/bash-completion/completions/{}",
    "fish": "share/fish/vendor_completions.d/{}.fish",
    "zsh": "share/zsh/site-functions/_{}",
}
LICENCE = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
NOTICE = re.compile(r"/\*(?:(?!\*/).)*Permission is hereby granted.*?\*/", re.DOTALL)


def output(*command):
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout


def built(build, name):
    """An output of Cargo without symbols. `cargo test` leaves newer libraries in deps/."""
    found = [path for path in (build / name, build / "deps" / name) if path.is_file()]
    if not found:
        sys.exit(f"{build / name} is missing: `make dist` and `make install` build it")
    with tempfile.TemporaryDirectory() as folder:
        stripped = Path(folder, name)
        output("strip", "-o", stripped, max(found, key=lambda path: path.stat().st_mtime))
        return stripped.read_bytes()


def crates(target):
    """The project's version, and the crates that are linked into the programs."""
    packages = [f"--package={name}" for name in (*PROGRAMS, "layer", "xr", "parallax-python")]
    edges = ["--edges=normal,no-proc-macro", f"--target={target}", "--prefix=none", "--format={p}"]
    linked = output(CARGO, "tree", "--locked", *edges, *packages).decode().splitlines()
    metadata = ["--locked", "--format-version=1", f"--filter-platform={target}"]
    found = json.loads(output(CARGO, "metadata", *metadata))["packages"]
    version = next(package["version"] for package in found if package["name"] == "replay")
    found = [of for of in found if of["source"] and f"{of['name']} v{of['version']}" in linked]
    return version, sorted(found, key=lambda package: (package["name"], package["version"]))


def licences(packages):
    """The licences of the linked crates, each text once."""
    lines, texts = [], {}
    for package in packages:
        name = f"{package['name']} {package['version']}"
        words = [package["license"], package["repository"], *package["authors"]]
        lines.append(f"{name}: {', '.join(filter(None, words))}")
        for path in sorted(Path(package["manifest_path"]).parent.rglob("*")):
            found = []
            if LICENCE.match(path.name) and path.suffix != ".rs" and path.is_file():
                found = [path.read_text(errors="replace")]
            elif path.suffix in (".h", ".c", ".cpp"):
                found = NOTICE.findall(path.read_text(errors="replace"))
            for text in found:
                texts.setdefault(" ".join(text.split()), (text.strip(), {}))[1][name] = None
    blocks = [f"==== {', '.join(names)} ====\n\n{text}\n" for text, names in texts.values()]
    head = (
        "Parallax contains these Rust crates. The texts that they come with follow.\n"
        "Of a crate without a text, the standard text of its licence holds.\n"
    )
    return "\n".join([head, *lines, "", *blocks]).encode()


def tree(build, packages):
    """The installed files: path and content."""
    files = {
        **{path: built(build, Path(path).name) for path in LIBRARIES},
        "lib/parallax/parallax_layer.json": (
            ROOT / "tracegen/programs/src/parallax_layer.json"
        ).read_bytes(),
        "share/parallax/atrium.textrace": (ROOT / "traces/atrium.textrace").read_bytes(),
        DOCUMENTS + "LICENSE-CRATES": licences(packages),
    }
    for path in (*ROOT.glob("*.md"), *ROOT.glob("LICENSE*"), *ROOT.glob("docs/**/*.*")):
        files[DOCUMENTS + str(path.relative_to(ROOT))] = path.read_bytes()
    library = Path(output("rustc", "--print", "sysroot").decode().strip())
    library /= "share/doc/rust/COPYRIGHT-library.html"
    if library.is_file():
        files[DOCUMENTS + "LICENSE-RUST.html"] = library.read_bytes()
    for name in PROGRAMS:
        files[f"bin/{name}"] = built(build, name)
        for shell, path in COMPLETIONS.items():
            files[path.format(name)] = output(build / name, "completions", shell)
        with tempfile.TemporaryDirectory() as pages:
            output(build / name, "man", pages)
            for page in Path(pages).iterdir():
                files[f"share/man/man1/{page.name}"] = page.read_bytes()
    return files


def mode(path):
    return 0o755 if Path(path).parent.name in ("bin", "scripts") else 0o644


def archive(name, files):
    """A tar archive whose documents are at the top."""
    entries = {path.removeprefix(DOCUMENTS): data for path, data in files.items()}
    packed = io.BytesIO()
    with gzip.GzipFile("", "wb", 6, packed, mtime=0) as out, tarfile.open(fileobj=out, mode="w") as tar:
        for path, data in sorted(entries.items()):
            entry = tarfile.TarInfo(f"{name}/{path}")
            entry.size, entry.mode, entry.mtime = len(data), mode(path), 315532800  # 1980, as in the wheel
            tar.addfile(entry, io.BytesIO(data))
    return packed.getvalue()


def wheel(version, tag, native, files):
    """Name and bytes of a wheel of the package, the programs and their libraries."""
    project = tomllib.loads((ROOT / "python/pyproject.toml").read_text())["project"]
    metadata = {"Metadata-Version": "2.1", "Name": project["name"], "Version": version}
    metadata |= {"Summary": project["description"], "Requires-Python": project["requires-python"]}
    package = project["name"].replace("-", "_")
    lines = [f"{key}: {value}" for key, value in metadata.items()]
    lines += [f"License: {project['license']['text']}"]
    lines += [f"Requires-Dist: {need}" for need in project["dependencies"]]
    for extra, needs in project["optional-dependencies"].items():
        lines += [f"Provides-Extra: {extra}"]
        lines += [f'Requires-Dist: {need}; extra == "{extra}"' for need in needs]
    info = f"{package}-{version}.dist-info/"
    data = f"{package}-{version}.data/"
    entries = {f"{package}/_native.abi3.so": native}
    for path in (ROOT / "python" / package).glob("*.*"):
        if path.suffix in (".py", ".pyi", ".typed"):
            entries[f"{package}/{path.name}"] = path.read_bytes()
    for path, content in files.items():
        if path.startswith("bin/"):
            entries[data + "scripts" + path[3:]] = content
        elif path.startswith("lib/"):
            entries[data + "data/" + path] = content
        elif path.startswith(DOCUMENTS + "LICENSE"):
            entries[info + "licenses/" + Path(path).name] = content
    entries[info + "METADATA"] = "\n".join([*lines, ""]).encode()
    entries[info + "WHEEL"] = f"Wheel-Version: 1.0\nGenerator: dist.py\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    record = ""
    for path, content in sorted(entries.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).decode().rstrip("=")
        record += f"{path},sha256={digest},{len(content)}\n"
    entries[info + "RECORD"] = f"{record}{info}RECORD,,\n".encode()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as out:
        for path, content in entries.items():
            entry = zipfile.ZipInfo(path)  # of 1980
            entry.external_attr = (0o100000 | mode(path)) << 16
            out.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return f"{package}-{version}-{tag}.whl", packed.getvalue()


def write(path, data):
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(data)
    part.chmod(mode(path))
    part.replace(path)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("kinds", nargs="+", choices=["archive", "wheel", "install"])
    options = parser.parse_args()
    build, out = options.build.resolve(), options.out
    target = re.search(r"host: (\S+)", output("rustc", "-vV").decode())[1]
    version, packages = crates(target)
    files = tree(build, packages)
    if "install" in options.kinds:
        for path, data in files.items():
            write(out / path, data)
        print(f"installed {len(files)} files; the programs are in {out / 'bin'}")
    native = built(build, "lib_native.so") if "wheel" in options.kinds else b""
    binaries = b"".join([native, *(files[path] for path in LIBRARIES), *(files[f"bin/{name}"] for name in PROGRAMS)])
    glibc = max(int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", binaries))
    outputs = {}
    if "archive" in options.kinds:
        name = f"parallax-{version}-{target}"
        outputs[f"{name}.tar.gz"] = archive(name, files)
    if "wheel" in options.kinds:
        # abi3-py39 of the crate pyo3.
        tag = f"cp39-abi3-manylinux_2_{glibc}_{target.split('-')[0]}"
        file, data = wheel(version, tag, native, files)
        outputs[file] = data
    for file, data in outputs.items():
        write(out / file, data)
        print(f"{out / file}: {len(data) / 1e6:.1f} MB, for glibc 2.{glibc} or later")


if __name__ == "__main__":
    main()
