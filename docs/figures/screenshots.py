#!/usr/bin/python3
"""The pictures of report and terminal in docs/figures: screenshots.py PROGRAM RESULTS [WORK], RESULTS of a finished run for the report.
Needs Chromium (jobs/install.sh extras). The terminal is a real one (a pseudo-terminal of 80 and of 120 columns): what the program
wrote to it is replayed character by character, and the screen as it stood during the run and at the end is drawn."""
import fcntl
import html
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import termios

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))


class Screen:
    """As much of a terminal as the program uses: carriage return, line feed, wrapping, clearing to the end of the line."""

    def __init__(self, columns):
        self.columns, self.lines, self.x = columns, [""], 0

    def feed(self, text):
        for token in re.findall(r"\x1b\[[0-9;?]*[A-Za-z]|.|\n|\r", text):
            if token == "\r":
                self.x = 0
            elif token == "\n":
                self.lines.append("")
            elif token == "\x1b[K":
                self.lines[-1] = self.lines[-1][: self.x]
            elif token.startswith("\x1b"):
                raise SystemExit(f"a control sequence that this screen does not know: {token!r}")
            else:
                if self.x == self.columns:
                    self.lines.append("")
                    self.x = 0
                line = self.lines[-1].ljust(self.x)
                self.lines[-1] = line[: self.x] + token + line[self.x + 1 :]
                self.x += 1


def on_terminal(columns, command):
    """What a command writes to a terminal of so many columns: pieces as they came, and the exit code."""
    pid, master = pty.fork()
    if pid == 0:
        # The size is there before the program is.
        fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        os.environ["TERM"] = "xterm-256color"
        os.execvp(command[0], command)
    pieces = []
    while True:
        try:
            piece = os.read(master, 65536)
        except OSError:
            break
        if not piece:
            break
        pieces.append(piece.decode())
    return pieces, os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def shoot(work, source, target, width, height, *more):
    subprocess.run(
        [
            "chromium",
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            f"--user-data-dir={work}/chromium",
            f"--window-size={width},{height}",
            "--virtual-time-budget=4000",
            f"--screenshot={target}",
            *more,
            "file://" + source,
        ],
        check=True,
        capture_output=True,
        timeout=240,
    )
    # Fewer colours: a third of the size, and no difference to the eye.
    if shutil.which("ffmpeg"):
        small = work + "/small.png"
        subprocess.run(
            [
                "ffmpeg",
                "-y",
                "-v",
                "error",
                "-i",
                target,
                "-vf",
                "split[a][b];[a]palettegen=max_colors=200[p];[b][p]paletteuse=dither=none",
                small,
            ],
            check=True,
        )
        if os.path.getsize(small) < os.path.getsize(target):
            shutil.move(small, target)
    print(f"{target}: {os.path.getsize(target) // 1000} kB")


def draw(work, name, parts, columns):
    """Screens one below the other, as a dark terminal shows them."""
    body = "".join(f"<p>{html.escape(title)}</p><pre>{html.escape(chr(10).join(lines))}</pre>" for title, lines in parts)
    rows = sum(len(lines) for _, lines in parts)
    with open(f"{work}/{name}.html", "w") as f:
        f.write(
            "<!doctype html><meta charset=utf-8><style>body{margin:0;padding:12px;background:#fff;font:13px/1.4 'DejaVu Sans',sans-serif;color:#444}"
            "p{margin:0 0 4px}pre{font:14px/19px 'DejaVu Sans Mono',monospace;background:#16191d;color:#dfe4ea;padding:10px 12px;margin:0 0 12px;"
            f"border-radius:6px;width:{columns}ch;white-space:pre}}</style>" + body
        )
    shoot(work, f"{work}/{name}.html", f"{HERE}/{name}.png", int(columns * 8.43) + 52, rows * 19 + len(parts) * 58 + 14)


def main():
    program = os.path.abspath(sys.argv[1])
    work = os.path.abspath(sys.argv[3]) if len(sys.argv) > 3 else tempfile.mkdtemp(prefix="kuzure-shots-")
    results = os.path.abspath(sys.argv[2])
    os.makedirs(work, exist_ok=True)
    os.chdir(work)
    scene = ROOT + "/jobs/scenes/quickstart.toml"
    for columns in (80, 120):
        shutil.rmtree("results", ignore_errors=True)
        command = [program, "run", scene, "-o", "results/quickstart", "--threads", "1", "--set", "time.end=0.05"]
        pieces, code = on_terminal(columns, command)
        if code != 0:
            raise SystemExit("".join(pieces))
        screen, during = Screen(columns), None
        shown = [k for k, p in enumerate(pieces) if "\r[" in p]
        for k, piece in enumerate(pieces):
            screen.feed(piece)
            if k == shown[len(shown) // 2]:
                during = list(screen.lines)
        prompt = "$ kuzure run jobs/scenes/quickstart.toml"
        draw(
            work,
            f"terminal_{columns}",
            [(f"{columns} columns, during the run", [prompt, *during]), ("at the end", [prompt, *screen.lines])],
            columns,
        )
    report = results + "/report.html"
    shoot(work, report, HERE + "/report_light.png", 1280, 1500)
    shoot(work, report, HERE + "/report_dark.png", 1280, 1500, "--blink-settings=preferredColorScheme=0")
    # A window of Chromium is 500 pixels wide at least; a frame may be narrower.
    with open(work + "/phone.html", "w") as f:
        f.write(f"<!doctype html><body style='margin:0'><iframe src='file://{report}' width=390 height=1500 style='border:0'></iframe>")
    shoot(work, work + "/phone.html", HERE + "/report_phone.png", 390, 1500, "--allow-file-access-from-files")


if __name__ == "__main__":
    main()
