#!/usr/bin/python3
"""Every command of README, the tutorial and the gallery runs as it is written there, in order, on the files that these pages give; the page
on Python has python_test.py. Run as documents_test.py PROGRAM."""
import os
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, root, scratch

ROOT = Path(root)
# Run by others, or not for a test to run, each with the reason.
ELSEWHERE = {
    "./jobs/quickstart.sh": "installs packages and builds",
    "./tests/run.sh": "is what runs this test",
    "sbatch bank.sh": "needs a Slurm: tests/cluster/slurm_test.py",
}
# What a command may end with beside 0.
CODES = {"--max-minutes 0.01": {0, 5}}


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / page).read_text(), re.M | re.S)


def commands(page):
    """Lines of the page's sh blocks without their comments."""
    lines = [re.sub(r"\s+#.*", "", line).strip() for block in blocks(page, "sh") for line in block.splitlines()]
    return [line for line in lines if line]


def scene_of_tutorial():
    """bank.toml as its pieces say, and the sweep."""
    pieces = blocks("docs/tutorial.md", "toml")
    first = next(k for k, p in enumerate(pieces) if p.startswith("title "))
    last = next(k for k, p in enumerate(pieces) if p.startswith("[effects]"))
    sweep = next(p for p in pieces if "[vary]" in p)
    return "".join(pieces[first : last + 1]), sweep


def main():
    work = Path(scratch("documents"))
    tree = work / "build/release"
    tree.mkdir(parents=True)
    (tree / "kuzure").symlink_to(program)
    for folder in ("jobs",):
        (work / folder).symlink_to(ROOT / folder)
    bank, sweep = scene_of_tutorial()
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    count = 0

    def run_page(page):
        nonlocal count
        exports = ""
        for command in commands(page):
            if any(command.startswith(e) for e in ELSEWHERE):
                continue
            if command.startswith(("export ", "source ")):
                exports += command + "\n"
                continue
            done = subprocess.run(["bash", "-c", exports + command], capture_output=True, text=True, cwd=work, env=environment, timeout=800)
            good = next((codes for words, codes in CODES.items() if words in command), {0})
            check(
                done.returncode in good,
                f"{page}: {command}: exit {done.returncode} {done.stderr[-300:] if done.returncode not in good else ''}",
            )
            count += 1

    def fresh():
        subprocess.run(["rm", "-rf", work / "results"], check=True)

    (work / "my_scene.toml").write_text(bank.replace("end = 1.5", "end = 0.1"))
    run_page("README.md")
    fresh()
    (work / "bank.toml").write_text(bank)
    (work / "bank.sweep.toml").write_text(sweep)
    run_page("docs/tutorial.md")
    for file in (
        "results/bank/report.html",
        "results/bank/picture_plastic_strain_side_000010.png",
        "end.png",
        "results/study/study.json",
        "bank.sh",
    ):
        check((work / file).stat().st_size > 1000 if (work / file).exists() else False, f"the tutorial left {file}")
    fresh()
    environment["PATH"] = f"{tree}:{environment['PATH']}"
    (work / "bank.toml").unlink()
    run_page("docs/gallery.md")
    shown = (work / "bank.toml").read_text()
    same = lambda text: re.sub(r"\s*#.*|\s+", "", text)
    check(same(shown) == same(bank), "the gallery's bank is the tutorial's")
    check(count >= 20, f"{count} commands ran")
    finish()


if __name__ == "__main__":
    main()
