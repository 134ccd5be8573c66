# SPDX-License-Identifier: BSD-3-Clause
"""How pip builds the package (PEP 517), with CMake and nothing from an index. TUTTI_PYTHON_BUILD_DIR: where it is built,
or was, instead of build/python."""
import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import time
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
VERSION = re.search(r"project\(tutti VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
NAME = f"tutti-{VERSION}"
TAG = "cp{0}{1}-cp{0}{1}-".format(*sys.version_info) + re.sub("[-.]", "_", sysconfig.get_platform())
METADATA = {
    f"{NAME}.dist-info/METADATA": f"Metadata-Version: 2.1\nName: tutti\nVersion: {VERSION}\nRequires-Dist: numpy\n"
                                  "Summary: Collaborative robot mapping by spectral graph analysis\nLicense: BSD-3-Clause\n",
    f"{NAME}.dist-info/WHEEL": f"Wheel-Version: 1.0\nGenerator: tutti\nRoot-Is-Purelib: false\nTag: {TAG}\n",
}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    for path, text in METADATA.items():
        file = pathlib.Path(metadata_directory) / path
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    return f"{NAME}.dist-info"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    with tempfile.TemporaryDirectory() as prefix:
        install(pathlib.Path(prefix))
        package = next(pathlib.Path(prefix).rglob("dist-packages"))
        files = {path.relative_to(package).as_posix(): path.read_bytes() for path in sorted(package.rglob("*")) if path.is_file()}
    files.update((path, text.encode()) for path, text in METADATA.items())
    record = "".join(f"{path},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip('=')},{len(data)}\n"
                     for path, data in files.items())
    wheel = f"{NAME}-{TAG}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in {**files, f"{NAME}.dist-info/RECORD": f"{record}{NAME}.dist-info/RECORD,,\n".encode()}.items():
            archive.writestr(path, data)
    return wheel


def terminal():
    """Where a person looks, if it is not what is printed to: pip keeps that to itself (without -v), for minutes."""
    try:
        return None if sys.stdout.isatty() else open("/dev/tty", "w")
    except OSError:
        return None


def build(command, screen):
    """Runs ninja, and says on the screen, where there is one, how far it is: in one line, which pip's next one replaces."""
    began, shown = time.monotonic(), 0.0
    minutes = lambda: f"{(time.monotonic() - began) / 60:.1f} min"
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace") as ninja:
        for line in ninja.stdout:
            print(line, end="", flush=True)
            done = re.match(r"\[(\d+)/(\d+)\]", line)
            if done and screen and time.monotonic() >= shown + 1:
                shown = time.monotonic()
                screen.write(f"\r\033[K  Building tutti: {done[1]} of {done[2]} steps, {minutes()}\r")
                screen.flush()
    if screen:
        screen.write(f"\r\033[K  Building tutti: {minutes()}, ")
        screen.flush()
    if ninja.returncode:
        raise subprocess.CalledProcessError(ninja.returncode, command)


def install(prefix):
    folder = pathlib.Path(os.environ.get("TUTTI_PYTHON_BUILD_DIR", ROOT / "build/python"))
    if "TUTTI_PYTHON_BUILD_DIR" not in os.environ or not (folder / "CMakeCache.txt").exists():
        subprocess.run(["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DTUTTI_UNITY=ON",
                        f"-DTUTTI_UNITY_DIR={ROOT / 'build/unity'}", "-DTUTTI_BUILD_TESTS=OFF", "-DTUTTI_BUILD_ROS=OFF", "-DTUTTI_BUILD_PYTHON=ON",
                        f"-DPython3_EXECUTABLE={sys.executable}"], check=True)
        build(["cmake", "--build", folder, "--target", "tutti_python"], terminal())
    subprocess.run(["cmake", "--install", folder, "--component", "python", "--prefix", prefix], check=True)
