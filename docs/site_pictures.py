"""Pictures of the site that commands make, each with its command and its seconds.

    ```{picture} taichi-tracer render cornell_box --estimator path --size 480x360
    :alt: what somebody hears who cannot see it
    One sentence.
    ```

They are kept in the folder ``gallery``. A build makes those that are missing: delete a file, and it is made again.
"""

import hashlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive, directives
from PIL import Image
from sphinx.application import Sphinx

TOP = Path(__file__).parent.parent
FOLDER = Path(__file__).parent / "gallery"
COMMAND = re.compile(r"^```\{picture\} taichi-tracer (render .+)$", re.MULTILINE)
AT_ONCE = 2  # commands: one compiles while the other one renders
SECONDS, QUALITY = 300, 90


def place_of(command: str) -> Path:
    """The file of a command's picture; what the command printed is beside it, as .txt."""
    return FOLDER / (hashlib.sha256(command.encode()).hexdigest()[:12] + ".jpg")


def make(command: str) -> None:
    """Make the picture of a command, unless it is there.

    Raises:
        RuntimeError: the command failed.
    """
    place = place_of(command)
    if place.exists():
        return
    path = os.pathsep.join([str(TOP), os.environ.get("PYTHONPATH", "")])
    with tempfile.TemporaryDirectory(dir=FOLDER) as folder:
        words = [sys.executable, "-m", "taichi_tracer", *shlex.split(command), "-o", f"{folder}/picture.png"]
        done = subprocess.run(
            words, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=SECONDS
        )
        (made,) = list(Path(folder).glob("*.png")) or [None]
        if done.returncode != 0 or made is None:
            raise RuntimeError(f"taichi-tracer {command}: {done.stderr.strip()[-500:]}")
        place.with_suffix(".txt").write_text(facts_of(done.stdout.strip().splitlines()[0]) + "\n", encoding="utf-8")
        Image.open(made).convert("RGB").save(place, quality=QUALITY)


def facts_of(line: str) -> str:
    """Size, samples and seconds of a picture, of the line that the command printed."""
    what, _, times = line.partition(": ")[2].partition(" (start ")
    total = re.search(r"total ([\d.]+ s)", times)
    return what.partition(", error ")[0] + (f", {total[1]}" if total else "")


def make_all(app: Sphinx) -> None:
    """Make what is missing, and delete what no page shows any more."""
    FOLDER.mkdir(exist_ok=True)
    texts = [path.read_text(encoding="utf-8") for path in Path(app.srcdir).rglob("*.md")]
    commands = {command for text in texts for command in COMMAND.findall(text)}
    with ThreadPoolExecutor(AT_ONCE) as pool:
        list(pool.map(make, sorted(commands)))
    wanted = {place_of(command).stem for command in commands}
    for path in FOLDER.iterdir():
        if path.stem not in wanted:
            path.unlink()


class PictureOfCommand(Directive):
    """A picture with its command, what it printed, and a sentence."""

    required_arguments, final_argument_whitespace, has_content = 1, True, True
    option_spec = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        """The figure."""
        command = self.arguments[0].removeprefix("taichi-tracer ")
        figure = nodes.figure(classes=["shot"])
        figure += nodes.image(uri=f"/gallery/{place_of(command).name}", alt=self.options["alt"])
        figure += nodes.caption(text=" ".join(self.content))
        code = nodes.literal_block(text=f"taichi-tracer {command}", language="sh")
        facts = place_of(command).with_suffix(".txt").read_text(encoding="utf-8").strip()
        figure += nodes.legend("", code, nodes.paragraph(text=facts))
        return [figure]


def setup(app: Sphinx) -> dict[str, bool]:
    """Give the directive to Sphinx."""
    app.add_directive("picture", PictureOfCommand)
    app.connect("builder-inited", make_all)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
