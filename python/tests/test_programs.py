"""How programs are run: nothing blocks, what they say arrives, Ctrl-C reaches them."""

import signal
import sys
import threading
import time

import pytest

from bielle import programs


@pytest.fixture
def program(monkeypatch, tmp_path):
    """Makes run_program() run a Python script instead, given as a text."""

    def write(text):
        path = tmp_path / "program"
        path.write_text(f"#!{sys.executable}\n{text}")
        path.chmod(0o755)
        monkeypatch.setattr(programs, "find_program", lambda name: str(path))

    return write


def test_long_outputs_do_not_block(program):
    program("import sys\nprint('x' * 1_000_000)\nsys.stderr.write('y' * 1_000_000)")
    assert programs.run_program("any", []) == "x" * 1_000_000 + "\n"


def test_statuses(program):
    program("import sys\nprint('it fell')\nsys.stderr.write('the reason')\nsys.exit(1)")
    assert programs.run_program("any", [], statuses=(0, 1)) == "it fell\n"
    with pytest.raises(RuntimeError, match="the reason"):
        programs.run_program("any", [])


def test_interrupt_reaches_the_program(program, tmp_path):
    started, left = tmp_path / "started", tmp_path / "left"
    program(f"""
import signal, sys, time
def end(*_):
    open({str(left)!r}, "w").write("what is done")
    sys.exit(130)
signal.signal(signal.SIGINT, end)
open({str(started)!r}, "w").close()
time.sleep(60)
""")
    main = threading.main_thread().ident

    def interrupt():
        while not started.is_file():
            time.sleep(0.01)
        signal.pthread_kill(main, signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        programs.run_program("any", [])
    thread.join()
    assert left.read_text() == "what is done" and time.monotonic() - begin < 30
