"""Builds wheels of the package (PEP 517): CMake does the work, the standard library packs what it installs.

The code is tuned to the processor of this machine; Debian packages (scripts/package.sh) are for all of them.
"""

import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import threading
import time
import zipfile
from pathlib import Path
from typing import Dict, List, Optional, Tuple

Settings = Optional[Dict[str, str]]
ROOT = Path(__file__).resolve().parent.parent


def read_project() -> Dict[str, str]:
    """Name, version and so on from pyproject.toml: its lines `key = "value"`."""
    lines = (ROOT / "pyproject.toml").read_text().partition("[project]\n")[2].partition("\n[")[0].splitlines()
    return {key.strip(): value.strip(' "') for key, _, value in (line.partition("=") for line in lines) if value}


def make_metadata() -> str:
    project = read_project()
    return (
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        f"Summary: {project['description']}\nLicense: BSD-3-Clause\nRequires-Python: {project['requires-python']}\n"
        f"Requires-Dist: numpy\nDescription-Content-Type: text/markdown\n\n{(ROOT / 'README.md').read_text()}"
    )


def get_tag() -> str:
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{python}-{python}-{platform}"


def tell(line: str) -> None:
    """Shows a line to whoever waits: pip keeps to itself what a backend prints, so the terminal, or else pip's own standard error."""
    for place in ("/dev/tty", f"/proc/{os.getppid()}/fd/2"):
        try:
            with open(place, "a") as shown:
                shown.write(line + "\n")
            return
        except OSError:
            continue


def run_build(command: List[str]) -> None:
    """Runs the build, and tells every ten seconds how far it is."""
    start, state, ended = time.monotonic(), "configuring", threading.Event()

    def report() -> None:
        while not ended.wait(10):
            tell(f"bielle: {state}, {time.monotonic() - start:.0f} s")

    reporter = threading.Thread(target=report, daemon=True)
    reporter.start()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            sys.stdout.write(line)
            step = re.match(r"\[(\d+)/(\d+)\]", line)
            if step:
                state = f"built {step[1]} of {step[2]} parts"
    ended.set()
    reporter.join()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)


def build_package(target: Path) -> None:
    """Builds the module and installs the package into a directory."""
    build = ROOT / "build" / "wheel"
    parts = {"TESTS": "OFF", "EXAMPLES": "OFF", "BENCHMARKS": "OFF", "VALIDATION": "OFF", "SIMULATION": "OFF",
             "PYTHON": "ON"}  # fmt: skip
    options = [f"-DBIELLE_BUILD_{part}={value}" for part, value in parts.items()]
    options += ["-DCMAKE_BUILD_TYPE=Release", f"-DPython3_EXECUTABLE={sys.executable}", "-DBIELLE_PYTHON_DIR=."]
    program = 'set -euo pipefail; source "$0"; bielle_targets=(bielle_stubs); build "$@"'
    run_build(["bash", "-c", program, str(ROOT / "scripts" / "setup.sh"), str(build), *options])
    install = ["cmake", "--install", str(build), "--component", "python", "--strip"]
    subprocess.run(install + ["--prefix", str(target)], check=True)


def list_files(directory: Path) -> List[Tuple[str, bytes]]:
    files = sorted(path for path in directory.rglob("*") if path.is_file())
    return [(str(path.relative_to(directory)), path.read_bytes()) for path in files]


def build_wheel(wheel_directory: str, config_settings: Settings = None, metadata_directory: Optional[str] = None) -> str:
    project = read_project()
    stem = f"{project['name']}-{project['version']}"
    with tempfile.TemporaryDirectory() as temporary:
        build_package(Path(temporary))
        files = list_files(Path(temporary))
    files += [("bielle/robots/" + name, data) for name, data in list_files(ROOT / "robots")]
    wheel = f"Wheel-Version: 1.0\nGenerator: bielle\nRoot-Is-Purelib: false\nTag: {get_tag()}\n"
    files += [
        (f"{stem}.dist-info/METADATA", make_metadata().encode()),
        (f"{stem}.dist-info/WHEEL", wheel.encode()),
        (f"{stem}.dist-info/LICENSE", (ROOT / "LICENSE").read_bytes()),
    ]
    record = ""
    name = f"{stem}-{get_tag()}.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files:
            archive.writestr(path, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(data)}\n"
        archive.writestr(f"{stem}.dist-info/RECORD", record + f"{stem}.dist-info/RECORD,,\n")
    return name


def build_sdist(sdist_directory: str, config_settings: Settings = None) -> str:
    """The files that git knows."""
    project = read_project()
    stem = f"{project['name']}-{project['version']}"
    listed = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], check=True, stdout=subprocess.PIPE).stdout.decode()
    with tarfile.open(os.path.join(sdist_directory, stem + ".tar.gz"), "w:gz", format=tarfile.PAX_FORMAT) as archive:
        for name in filter(None, listed.split("\0")):
            archive.add(ROOT / name, f"{stem}/{name}")
        with tempfile.NamedTemporaryFile("w") as metadata:
            metadata.write(make_metadata())
            metadata.flush()
            archive.add(metadata.name, f"{stem}/PKG-INFO")
    return stem + ".tar.gz"
