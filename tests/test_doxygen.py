"""test_doxygen.py CMAKE BUILD: the target `docs` builds without a warning, and a browser sets its formulas offline.

Skipped without Doxygen; formulas are looked at where there is a Chromium.
"""
import os
import shutil
import subprocess
import sys
import tempfile

cmake, build = sys.argv[1:]
run = subprocess.run([cmake, "--build", build, "--target", "docs"], capture_output=True, text=True)
output = run.stdout + run.stderr
if "apt install doxygen" in output:
    assert run.returncode != 0
    print("no Doxygen or MathJax here; the target says what to install")
    sys.exit(77)
assert run.returncode == 0, output
html = os.path.abspath(os.path.join(build, "docs/html"))
names = os.listdir(html)
for page in ("tutorial", "modelling", "signs", "new_robot", "new_motion", "formulations"):
    assert any(name.startswith("md_") and page in name for name in names), page
with open(os.path.join(html, "notation_8h.html"), encoding="utf-8") as file:
    assert "Units and world" in file.read()  # the headers' mathematics

chromium = shutil.which("chromium")
if chromium:
    page = next(name for name in names if name.startswith("md_") and "signs" in name)
    with tempfile.TemporaryDirectory() as profile:
        browser = subprocess.run(
            [chromium, "--headless=new", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000",
             "--allow-file-access-from-files", f"--user-data-dir={profile}", "--dump-dom", f"file://{html}/{page}"],
            capture_output=True, text=True, timeout=120)
    assert browser.returncode == 0, browser.stderr
    formulas = browser.stdout.count('class="mjx-chtml') + browser.stdout.count('class="MathJax"')
    assert formulas > 20 and 'class="MathJax_Error' not in browser.stdout, formulas
    print(f"{formulas} formulas set")
