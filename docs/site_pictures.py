"""Pictures of the site that are made while it is built, each with its command and its seconds.

    ```{picture} taichi-tracer render cornell_box --estimator path --size 480x360
    :alt: what somebody hears who cannot see it
    One sentence.
    ```

They are kept in the folder ``_made``, and made again when the command or the package has changed.
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
from sphinx.application import Sphinx

TOP = Path(__file__).parent.parent
FOLDER = Path(__file__).parent / "_made"
COMMAND = re.compile(r"^```\{picture\} taichi-tracer (render .+)$", re.MULTILINE)
AT_ONCE = 2  # commands: one compiles while the other one renders
SECONDS = 300


def fingerprint() -> bytes:
    """What the bits of the package's pictures depend on."""
    files = sorted((*TOP.glob("taichi_tracer/**/*.py"), *TOP.glob("scene_data_dir/**/*.obj")))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).digest()


PACKAGE = fingerprint()


def place_of(command: str) -> Path:
    """The file of a command's picture; what the command printed is beside it, as .txt."""
    return FOLDER / (hashlib.sha256(PACKAGE + command.encode()).hexdigest()[:16] + ".png")


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
        place.with_suffix(".txt").write_text(done.stdout.strip().splitlines()[0], encoding="utf-8")
        made.rename(place)


def facts_of(command: str) -> str:
    """Size, samples and seconds of a picture, as the command printed them."""
    line = place_of(command).with_suffix(".txt").read_text(encoding="utf-8")
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
        if path.stem not in wanted and path.suffix in (".png", ".txt"):
            path.unlink()


class PictureOfCommand(Directive):
    """A picture with its command, what it printed, and a sentence."""

    required_arguments, final_argument_whitespace, has_content = 1, True, True
    option_spec = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        """The figure."""
        command = self.arguments[0].removeprefix("taichi-tracer ")
        figure = nodes.figure(classes=["shot"])
        figure += nodes.image(uri=f"/_made/{place_of(command).name}", alt=self.options["alt"])
        figure += nodes.caption(text=" ".join(self.content))
        code = nodes.literal_block(text=f"taichi-tracer {command}", language="sh")
        figure += nodes.legend("", code, nodes.paragraph(text=facts_of(command)))
        return [figure]


def setup(app: Sphinx) -> dict[str, bool]:
    """Give the directive to Sphinx."""
    app.add_directive("picture", PictureOfCommand)
    app.connect("builder-inited", make_all)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
