"""Render the pictures of tests/pictures.py anew, and keep their digests:  python tests/references/make_pictures.py

It takes about ten minutes, and prints which digests differ from those in the file. Run it only after a change that is
meant to change pictures, and look at what it prints: a picture that was not meant to change is a mistake. The file also
keeps a canary for each precision, a digest of how this machine rounds sin, exp and the like; where another machine
rounds otherwise, tests/test_same_bits.py compares nothing, and says so.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import pictures as catalogue  # noqa: E402

import taichi_tracer as tt  # noqa: E402

FILE = Path(__file__).parent / "pictures.json"


def main() -> None:
    """Write ``FILE``."""
    before = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {"canaries": {}, "pictures": {}}
    canaries, digests, precision = {}, {}, None
    for group in catalogue.groups(lambda picture: True).values():
        if group[0].precision != precision:
            precision = group[0].precision
            tt.init("cpu", precision, force=True)
            canaries[precision] = catalogue.canary()
        make = catalogue.Maker(group)
        digests |= {picture.name: catalogue.digest(make(picture)) for picture in group}
        make.destroy()
    for name in sorted({*digests, *before["pictures"]}):
        if digests.get(name) != before["pictures"].get(name):
            print(f"{name}: {before['pictures'].get(name, 'new')} -> {digests.get(name, 'gone')}")
    in_order = {picture.name: digests[picture.name] for picture in catalogue.pictures()}
    FILE.write_text(json.dumps({"canaries": canaries, "pictures": in_order}, indent=1) + "\n", encoding="utf-8")
    print(f"{len(in_order)} pictures, canaries {canaries}")


if __name__ == "__main__":
    main()
