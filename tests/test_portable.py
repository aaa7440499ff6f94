"""test_portable.py CMAKE SOURCE WORK: the shared library of builds that travel, tried on one of a single file.

The dynamic linker loads the copy for the processor, a program compiled for every machine works with each of them, and
neither calls the other's copies of functions that both have (SOURCE/cmake/layers.cmake says by what means)."""
import os
import platform
import re
import shutil
import subprocess
import sys

cmake, source, work = sys.argv[1:]
shutil.rmtree(work, ignore_errors=True)
subprocess.run([cmake, "-S", os.path.join(source, "tests", "portable"), "-B", work, "-G", "Ninja",
                "-DCMAKE_BUILD_TYPE=Release"], check=True, stdout=subprocess.DEVNULL)
subprocess.run([cmake, "--build", work], check=True, stdout=subprocess.DEVNULL)


def run(**environment):
    done = subprocess.run([os.path.join(work, "program")], env={**os.environ, **environment}, capture_output=True, text=True)
    assert done.returncode == 0, (environment, done.returncode, done.stderr)
    return int(done.stdout)


libraries = [os.path.join(work, "lib", "libbielle.so.0.1")]
if platform.machine() != "x86_64":
    run()
else:
    libraries += [os.path.join(work, "lib", "glibc-hwcaps", f"x86-64-{level}", "libbielle.so.0.1") for level in ("v3", "v4")]
    # The linker names the levels that the processor has; kernels differ in the names of their flags.
    linker = subprocess.run(["/lib64/ld-linux-x86-64.so.2", "--help"], check=True, capture_output=True, text=True).stdout
    v3, v4 = (f"x86-64-v{level} (supported" in linker for level in (3, 4))
    assert run() == (4 if v4 else 3 if v3 else 1)
    # What the dynamic linker is told that the processor cannot do.
    assert run(GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX512F") == (3 if v3 else 1)
    assert run(GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX512F,-AVX2") == 1

# Of the library, others see namespace bielle alone.
for library in libraries:
    names = subprocess.run(["nm", "-D", "--defined-only", "-f", "posix", library], check=True, capture_output=True,
                           text=True).stdout.split("\n")
    exported = {line.split()[0] for line in names if line}
    assert any(name.startswith("_ZN6bielle8multiply") for name in exported), library
    foreign = [name for name in exported if not re.match("_ZN6bielle|_ZNK6bielle|_ZT.*N6bielle", name)]
    assert not foreign, (library, foreign)
