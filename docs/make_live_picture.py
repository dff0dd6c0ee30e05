"""Makes the picture of the live view: the page in a browser, while the jaws close on the train.

    python docs/make_live_picture.py [SCENARIO] [--phase Close] [--out docs/images/live.png]

Needs Playwright (extra `test`) and Debian's chromium. Without a GPU the browser takes minutes.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

CHROMIUM = "/usr/bin/chromium"
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]
COLOURS = 256
"""Size of the palette, which keeps the picture small."""
SETTLED = 3.0
"""Time that the browser gets to draw the scene [s]."""


def pause_in(url, phase):
    """Follows the events of the run at ``url`` and pauses it when the phase begins."""
    names = []
    for line in urllib.request.urlopen(f"{url}events"):
        news = json.loads(line.removeprefix(b"data: ")) if line.startswith(b"data: ") else {}
        facts = news.get("facts", {})
        names = [each["name"] for each in facts.get("phases", [])] or names
        if facts.get("stage") == "windows":
            ask(url, {"action": "mark", "windows": []})
        if "phase" in news and names[news["phase"]] == phase:
            ask(url, {"action": "pause"})
            return
    raise SystemExit(f"the run ended without a phase {phase}")


def ask(url, what):
    """Sends a request to the run at ``url``, as its page does."""
    origin = {"Origin": url.rstrip("/")}
    urllib.request.urlopen(urllib.request.Request(f"{url}control", json.dumps(what).encode(), origin))


def photograph(url, phase, path, size):
    """Pauses the run at ``url`` in a phase and takes the picture."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport=dict(zip(("width", "height"), size)))
        page.goto(url)
        pause_in(url, phase)
        time.sleep(SETTLED)
        page.screenshot(path=str(path))
        browser.close()
    whole = Image.open(path).convert("RGB")
    whole.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", nargs="?", default="train")
    parser.add_argument("--phase", default="Close")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "images" / "live.png")
    parser.add_argument("--size", type=int, nargs=2, default=(1440, 900))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "drake_tracker", "run", options.scenario, "--live", "--out", folder]
        run = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            url = re.search(r"http://\S+", run.stdout.readline())[0]
            photograph(url, options.phase, options.out, options.size)
        finally:
            run.kill()
            run.wait()


if __name__ == "__main__":
    main()
