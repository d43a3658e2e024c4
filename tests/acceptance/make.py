"""Make ``means.json``: ``python -m acceptance.make [missing | CASE…]``, run in ``tests``; no word makes all."""

import json
import sys
import warnings

import numpy as np
from acceptance import cases

import taichi_tracer as tt


def entry(maker: cases.Maker, case: str) -> dict:
    """What the file holds of one case."""
    if case.split()[0] not in cases.LIGHT:
        return {"mean": rounded(maker.blocks(case))}
    found = np.array([maker.blocks(case, seed, cases.SPP) for seed in range(cases.SEEDS)])
    sd = found.std(0, ddof=1).max(-1)
    return {"mean": rounded(found.mean(0)), "sd": rounded(sd), "sd_all": rounded(found.mean((1, 2, 3)).std(ddof=1))[0]}


def rounded(values) -> list[float]:
    """Four digits of each number."""
    return [float(f"{value:.4g}") for value in np.ravel(values)]


def main() -> None:
    """Write what is asked into the file, case by case."""
    warnings.simplefilter("ignore")
    tt.init("cpu")
    file = cases.known() if cases.FILE.exists() else {}
    asked = sys.argv[1:] or cases.names()
    if asked == ["missing"]:
        asked = [case for case in cases.names() if case not in file]
    maker = cases.Maker()
    for case in asked:
        file[case] = entry(maker, case)
        order = [known for known in cases.names() if known in file]
        lines = [f"{json.dumps(case)}: {json.dumps(file[case], separators=(',', ':'))}" for case in order]
        cases.FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
