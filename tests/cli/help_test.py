#!/usr/bin/python3
"""Help fits a screen; completions, the manual page and the documents know the same commands and options as the program.
Run as help_test.py program."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from harness import finish, need, program, root

ROOT = Path(root)


def say(*arguments):
    done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=120)
    need(done.returncode == 0 and not done.stderr, f"kuzure {' '.join(arguments)}: exit {done.returncode}, {done.stderr!r}")
    return done.stdout


def too_large(page):
    """Why a page does not fit a screen, or nothing."""
    lines = page.rstrip("\n").split("\n")
    if len(lines) > 50:
        return f"{len(lines)} lines"
    return next((f"{len(line)} columns: {line}" for line in lines if len(line) > 100), None)


def wrong_commands(text, options):
    """Commands and options that a document shows in its code, but that the program does not have."""
    shown = re.findall(r"```\w*\n(.*?)```", text, re.S)
    lines = [line for block in shown for line in block.replace("\\\n", " ").split("\n")]
    lines += re.findall(r"`([^`\n]*\bkuzure [^`\n]*)`", text)
    wrong = []
    for line in lines:
        line = re.sub(r"\s#.*", "", line)
        used = re.search(r"(?:^|/|\s)kuzure ([a-z]+)\b(.*)", line)
        if not used or "kuzure: " in line:
            continue
        command, rest = used[1], re.split(r"&&|\||;|>", used[2])[0]
        if command not in options:
            wrong.append(f"no command {command}: {line.strip()}")
        else:
            wrong += [
                f"kuzure {command} has no {o}: {line.strip()}"
                for o in re.findall(r"(?<=\s)--[a-z][a-z-]*", rest)
                if o not in options[command]
            ]
    return wrong


def dead_links(file, text):
    return [link for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text) if "://" not in link and not (file.parent / link).exists()]


def anchors(text):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


def dead_anchors(file, text):
    """Links to a heading that its page does not have."""
    dead = []
    for link, anchor in re.findall(r"\]\(([^)#\s]*)#([^)\s]+)\)", text):
        page = file.parent / link if link else file
        if "://" not in link and anchor not in anchors(page.read_text() if link and page.exists() else text):
            dead.append(f"{link}#{anchor}")
    return dead


def main():
    # The checks must be able to fail.
    assert too_large("x\n" * 51) and too_large("x" * 101) and not too_large(("x" * 100 + "\n") * 50)
    assert (
        len(wrong_commands("```sh\nkuzure fly a.toml\nkuzure run a.toml --fast # --x\n```\nand `kuzure run --slow`", {"run": {"--set"}}))
        == 3
    )
    assert dead_links(ROOT / "README.md", "[a](no/such.md) [b](LICENSE)") == ["no/such.md"]
    assert dead_anchors(
        ROOT / "README.md", "# `A b`: c, d\n[a](#a-b-c-d) [b](#no) [c](docs/README.md#documents) [d](docs/README.md#no)"
    ) == ["#no", "docs/README.md#no"]

    main_page = say("--help")
    need(not too_large(main_page), f"kuzure --help: {too_large(main_page)}")
    commands = re.findall(r"^  ([a-z]+)  ", main_page.split("Subcommands:")[1].split("\n\n")[0], re.M)
    need({"run", "check", "job", "report"} <= set(commands), f"kuzure --help names {commands}")
    options = {}
    for command in commands:
        page = say(command, "--help")
        need(not too_large(page), f"kuzure {command} --help: {too_large(page)}")
        options[command] = set(re.findall(r"(?:^  |,)(--[a-z][a-z-]*)", page, re.M)) | {"--help"}
    need({"--set", "--restart", "--threads"} <= options["run"], f"options of kuzure run: {options['run']}")

    with tempfile.TemporaryDirectory() as folder:
        bash = Path(folder) / "kuzure.bash"
        bash.write_text(say("completion", "bash"))

        def completed(*words):
            script = (
                f'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); compopt() {{ :; }}; _kuzure; printf "%s\\n" "${{COMPREPLY[@]}}"'
            )
            done = subprocess.run(["bash", "-c", script, bash, *words], capture_output=True, text=True, cwd=folder)
            need(done.returncode == 0 and not done.stderr, f"completion of {words}: {done.stderr}")
            return set(done.stdout.split())

        (Path(folder) / "scene.toml").touch()
        (Path(folder) / "results").mkdir()
        need(set(commands) <= completed("kuzure", ""), "bash completes not all commands")
        need(completed("kuzure", "ru") == {"run"}, "bash: kuzure ru")
        need(completed("kuzure", "run", "sc") == {"scene.toml"}, "bash: kuzure run sc")
        need(completed("kuzure", "report", "") == {"results"}, "bash: kuzure report takes directories only")
        need(completed("kuzure", "run", "scene.toml", "-o", "") == {"results"}, "bash: -o takes directories only")
        for command in commands:
            need(options[command] <= completed("kuzure", command, "--"), f"bash: kuzure {command} --")
        for shell in ("zsh", "fish"):
            text = say("completion", shell)
            for command in commands:
                for name in options[command]:
                    plain = name if shell == "zsh" else f"-l {name[2:]}"
                    need(plain in text, f"{shell} completion of kuzure {command} lacks {name}")
        manual = say("completion", "man").replace("\\-", "-")
        for command in commands:
            need(f'.SH "kuzure {command}"' in manual and all(o in manual for o in options[command]), f"manual page: {command}")

    need(
        (ROOT / "docs/scene.md").read_text() == say("reference"),
        f"docs/scene.md is not what the program says: {program} reference > docs/scene.md",
    )
    for file in [
        ROOT / "README.md",
        ROOT / "README.ja.md",
        ROOT / "ARCHITECTURE.md",
        ROOT / "CONTRIBUTING.md",
        ROOT / "CHANGELOG.md",
        ROOT / "SECURITY.md",
        ROOT / "perf/JOURNAL.md",
        *sorted((ROOT / "docs").glob("*.md")),
    ]:
        text = file.read_text()
        for wrong in wrong_commands(text, {**options, "completion": {"--help"}}):  # not in the help
            need(False, f"{file.relative_to(ROOT)}: {wrong}")
        for link in dead_links(file, text):
            need(False, f"{file.relative_to(ROOT)}: no file {link}")
        for link in dead_anchors(file, text):
            need(False, f"{file.relative_to(ROOT)}: no heading {link}")

    print(f"{len(commands)} commands")
    finish()


if __name__ == "__main__":
    main()
