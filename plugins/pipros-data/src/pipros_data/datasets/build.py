"""Make a data set: find the episodes of all bags, and write them in several processes.

Each finished episode has a file in `checks`, which is written last. Episodes with such a file are not written
again, so an interrupted run can be continued. `dataset.json` contains the episodes with their bags, and a
hash of the description; a different description or format, or different bags, require a different folder.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.process_pool import in_processes
from pipros.basics.replaced_file import replaced_file
from pipros.msg.time import NS_PER_S
from pipros.safe.settings import BadSettings
from pipros_data.datasets.config import DatasetConfig
from pipros_data.datasets.drawing import episode_svg
from pipros_data.datasets.episodes import Episode, find_episodes
from pipros_data.datasets.formats import WRITERS
from pipros_data.datasets.lerobot import LEROBOT, check_lerobot, join_lerobot, write_lerobot
from pipros_data.datasets.rows import EpisodeRows, episode_rows
from pipros_data.extras import library
from pipros_data.opening import open_bags
from pipros_libraries.pictures.errors import PictureError
from pipros_tools.bag.errors import BagError


def build(
    bags: Sequence[str],
    config: DatasetConfig,
    folder: Path,
    kind: str,
    *,
    jobs: int = 1,
    msgs: Sequence[str] = (),
    shown: Callable[[int, int], None] | None = None,
    left_out: Callable[[str, str], object] | None = None,
) -> list[dict[str, Any]]:
    """Make a data set, or continue an interrupted run. Return the contents of `checks` for all episodes.

    An episode does not extend over several bags. After an error, finished episodes are kept.

    Args:
        kind: the format: `lerobot`, or a key of `WRITERS`.
        msgs: folders with ROS 2 definitions.
        shown: called with the number of finished episodes and the number of all episodes.
        left_out: called with the name of each bag that cannot be read, or which the description does not fit
            though it fits others, and the reason. The others are not affected. None (the default) to raise an
            error instead.

    Raises:
        BadSettings: no episode can be read and fits the description, an episode does not, or the folder
            contains a different data set or other files.
        BagError: a bag is damaged.
        MissingExtra: a library is not installed.
    """
    if kind == LEROBOT:
        check_lerobot(config)
    else:
        library(WRITERS[kind][1], f"the format {kind}")
    if any(each.store == "video" for each in config.cameras):
        library("av", "a video")
    episodes: list[Episode] = []
    reasons: dict[str, str] = {}  # why bags are left out
    for bag in bags:
        try:
            with open_bags(bag, msgs=msgs) as opened:
                episodes += find_episodes(opened, bag, config, len(episodes))
        except (BagError, OSError, BadSettings) as error:
            if left_out is None or len(bags) == 1:
                raise
            reasons[bag] = str(error)
    if episodes:
        _begin(folder, kind, config, episodes)
    left = [each for each in episodes if not _check_file(folder, each).exists()]
    jobs = max(1, min(jobs, len(left)))
    threads = max(1, (os.cpu_count() or 1) // jobs)
    is_only = len(bags) == 1
    work = [(each, config, str(folder), kind, tuple(msgs), threads, is_only) for each in left]
    done = len(episodes) - len(left)
    for episode, damage in in_processes(write_episode, work, jobs):
        if damage:
            if left_out is None:
                raise BadSettings(f"{episode.bag}: {damage}")
            reasons.setdefault(episode.bag, damage)
            episodes.remove(episode)
            continue
        done += 1
        if shown is not None:
            shown(done, len(episodes))
    results = {each: json.loads(read_text(_check_file(folder, each))) for each in episodes}
    counted = Counter(found["numbers"] for found in results.values() if found.get("numbers"))
    usual = next((text for text, _ in counted.most_common(1)), "")  # as all files must have the same columns
    for episode in [each for each in results if results[each].get("numbers") not in (None, "", usual)]:
        difference = f"its numbers are {results[episode]['numbers']}; those of most episodes are {usual}"
        if left_out is None:
            raise BadSettings(f"{episode.bag}: {difference}")
        reasons.setdefault(episode.bag, difference)
        del results[episode]
        for part in ("checks", "data", "pictures/*", "videos/*"):
            for path in folder.glob(f"{part}/{episode.name}.*"):
                path.unlink()
    if not results:
        first = next((f". {bag}: {reason}" for bag, reason in reasons.items()), "")
        raise BadSettings(f"no bag has an episode that fits the description{first}")
    for bag, reason in reasons.items():
        if left_out is not None:
            left_out(bag, reason)
    if kind == LEROBOT:
        join_lerobot(folder, [*results])
    _write(folder / "report.md", _report([*results.values()]))
    return [*results.values()]


_Work = tuple[Episode, DatasetConfig, str, str, tuple[str, ...], int, bool]


def write_episode(work: _Work) -> tuple[Episode, str]:
    """Write the files of an episode. Return it, and the reason if the bag is damaged or does not fit.

    Raises:
        BadSettings: the description does not fit the only bag.
        MissingExtra: a library is not installed.
    """
    episode, config, name, kind, msgs, threads, is_only = work
    folder, bad = Path(name), list[str]()
    try:
        with open_bags(episode.bag, msgs=msgs) as bags:
            bags.on_bad_message = lambda topic, reason: bad.append(f"{topic}: {reason}")
            rows = episode_rows(bags, episode, config)
            writer = write_lerobot if kind == LEROBOT else WRITERS[kind][0]
            broken = 0 if rows.problem else writer(folder, rows, bags, threads)
    except (BagError, PictureError) as error:
        return episode, str(error)
    except PiprosError as error:
        text = str(error) if isinstance(error, BadSettings) else f"{episode.bag}: {error}"
        if is_only:
            raise BadSettings(text) from None
        return episode, text
    parts = [f"{len(each.names)} in {each.source.name}: {', '.join(each.names[:3])}" for each in rows.signals]
    found = {
        "episode": episode.number,
        **asdict(episode),
        "rows": 0 if rows.problem else len(rows.times),
        "numbers": "" if rows.problem else "; ".join(parts),
        "left_out": rows.problem,
        "broken_pictures": broken,
        "bad_messages": list(dict.fromkeys(bad)),
        "findings": [asdict(each) for each in rows.findings],
    }
    checks = _check_file(folder, episode)
    checks.parent.mkdir(exist_ok=True)
    _write(checks.with_suffix(".svg"), _picture(rows))
    _write(checks, json.dumps(found, indent=1) + "\n")
    return episode, ""


def _picture(rows: EpisodeRows) -> str:
    seconds = (rows.times - rows.episode.start) / NS_PER_S
    lines = {each.source.name: each.values for each in rows.signals}
    lines |= {each.source.name: (~each.gaps)[:, None].astype(float) for each in rows.cameras}
    title = f"{rows.episode.name}: {rows.episode.bag} {rows.episode.task}"
    return episode_svg(title, seconds, lines, rows.findings)


def _begin(folder: Path, kind: str, config: DatasetConfig, episodes: Sequence[Episode]) -> None:
    """Write `dataset.json`. If it exists, check that it belongs to the same data set."""
    plan = {
        "format": kind,
        "rate": config.rate,
        "config_sha256": config.digest,
        "episodes": [asdict(each) for each in episodes],
    }
    path = folder / "dataset.json"
    try:
        before = json.loads(read_text(path))
        if not isinstance(before, dict):
            raise ValueError("it must contain an object")
    except FileNotFoundError:
        before = {}
    except (ValueError, RecursionError) as error:
        raise BadSettings(f"{path} is damaged: {error}. Choose a new folder") from None
    changed = [key for key in plan if before.get(key) != plan[key]]
    if changed and folder.exists() and any(each != path for each in folder.iterdir()):
        different = f"the data set in {folder} has a different {' and '.join(changed)}"
        raise BadSettings(f"{different if before else f'{folder} contains other files'}. Choose a new folder")
    if changed:
        folder.mkdir(parents=True, exist_ok=True)
        _write(path, json.dumps(plan, indent=1) + "\n")


def _check_file(folder: Path, episode: Episode) -> Path:
    return folder / "checks" / f"{episode.name}.json"


def _write(path: Path, text: str) -> None:
    with replaced_file(path) as file:
        file.write(text.encode())


def _report(results: Sequence[dict[str, Any]]) -> str:
    """Return a report in Markdown: a table of the episodes, and the findings of each."""
    lines = ["# Report\n", "| episode | bag | s | rows | task | findings |", f"{'| ---: ' * 6}|"]
    for each in results:
        number = f"[{each['episode']}](checks/episode_{each['episode']:06d}.svg)"
        seconds = f"{(each['end'] - each['start']) / NS_PER_S:.1f}"
        rows = "left out" if each["left_out"] else each["rows"]
        cells = map(str, (number, each["bag"], seconds, rows, each["task"], len(each["findings"])))
        lines.append(f"| {' | '.join(' '.join(cell.replace('|', '/').split()) for cell in cells)} |")
    for each in results:
        texts = [f"- left out: {each['left_out']}"] if each["left_out"] else []
        texts += [f"- messages are left out: {text}" for text in each.get("bad_messages", ())[:1]]
        texts += [f"- {found['source']}: {found['check']}: {found['text']}" for found in each["findings"]]
        if each["broken_pictures"]:
            texts.append(f"- {each['broken_pictures']} pictures are damaged; those before them are repeated")
        if texts:
            lines += [f"\n## Episode {each['episode']}\n", *texts]
    return "\n".join(lines) + "\n"
