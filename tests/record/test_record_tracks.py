"""tracks.png: drawn for every shape of run, with the signs it promises and no number over another.

Whether it is beautiful is for eyes; these tests read colours back and the places of the signs.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread

from swarmctl.mission.load import load
from swarmctl.record import tracks
from swarmctl.record.errors import RunFolderError
from swarmctl.record.summary import time_to
from swarmctl.record.tracks import BADGE_PIXELS, COLOURS, Floats, Picture, draw


def picture(
    *,
    vehicles: int = 6,
    size_m: tuple[float, float] = (5000.0, 5000.0),
    targets: int = 60,
    found_share: float = 0.7,
    points: int = 400,
    spread: float = 1.0,
) -> Picture:
    """A made-up run: smooth random tracks from the south-west corner and back, targets found at random."""
    random = np.random.default_rng(3)
    size = np.array(size_m)
    phase = np.linspace(0, np.pi, points)[:, None] * random.integers(1, 6, (vehicles, 1, 2))
    flown = [0.02 * size + spread * 0.9 * size * np.sin(angle) ** 2 for angle in phase]
    found_s = np.where(random.random(targets) < found_share, random.exponential(300, targets), np.inf)
    times_s = np.arange(0.0, 1601.0, 10.0)
    fraction = np.array([np.mean(found_s <= time) if targets else 0.0 for time in times_s])
    return Picture(
        algorithm="fco",
        border=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size,
        keep_outs=[np.array([[0.3, 0.6], [0.4, 0.6], [0.4, 0.8], [0.3, 0.8]]) * size],
        targets=random.uniform(0.1, 0.9, (targets, 2)) * size,
        found=np.isfinite(found_s),
        tracks=flown,
        times_s=times_s,
        fraction=fraction,
        crossings=time_to(found_s),
        duration_s=1600.0,
        subtitle="made up",
    )


def colours_in(path: Path) -> set[int]:
    red, green, blue = np.round(imread(path)[..., :3].transpose(2, 0, 1) * 255).astype(int)
    return set(np.unique(red << 16 | green << 8 | blue).tolist())


def rgb(colour: str) -> int:
    return int(colour[1:], 16)


CASES = {
    "one": picture(vehicles=1),
    "sixty": picture(vehicles=60),
    "tiny": picture(size_m=(100.0, 100.0)),
    "huge": picture(size_m=(20000.0, 20000.0)),
    "wide": picture(size_m=(9000.0, 400.0)),
    "tall": picture(size_m=(400.0, 9000.0)),
    "no targets": picture(targets=0),
    "nothing found": picture(found_share=0.0),
    "all found": picture(found_share=1.0),
    "nobody": picture(vehicles=0),
    "nobody moved": picture(spread=0.0),
    "no track yet": picture(points=0),
    "one point": picture(points=1),
}


@pytest.mark.parametrize("name", CASES)
def test_every_run_is_drawn(tmp_path: Path, name: str) -> None:
    path = tmp_path / "tracks.png"
    draw(path, CASES[name])
    height, width, _ = imread(path).shape
    assert 500 < height < 1400
    assert 700 < width < 2000
    assert list(tmp_path.iterdir()) == [path]
    if name not in ("nobody", "nobody moved", "no track yet", "one point"):
        drawn = COLOURS[: len(CASES[name].tracks)]
        assert {rgb(colour) for colour in drawn} <= colours_in(path)


def test_every_track_is_drawn_in_its_vehicle_s_colour(tmp_path: Path) -> None:
    path = tmp_path / "tracks.png"
    draw(path, picture(vehicles=3, targets=0))
    inked = 1.0 - imread(path)[..., :3].reshape(-1, 3)
    inked = inked[np.linalg.norm(inked, axis=1) > 0.2]
    inked /= np.linalg.norm(inked, axis=1, keepdims=True)
    for colour in COLOURS[:3]:
        ink = 1.0 - np.array(list(bytes.fromhex(colour[1:]))) / 255
        tinted = np.count_nonzero(inked @ (ink / np.linalg.norm(ink)) > 0.999)
        assert tinted > 1000, colour


def test_the_same_run_gives_the_same_picture(tmp_path: Path) -> None:
    for name in ("a", "b"):
        draw(tmp_path / name, picture())
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def badges(run: Picture, monkeypatch: pytest.MonkeyPatch, path: Path) -> dict[int, Floats]:
    """Each vehicle's number and where it stands in the finished picture, in pixels."""
    placed: dict[int, tuple[Axes, Floats]] = {}

    def note(chart: Axes, vehicle: int, place: Floats) -> None:
        placed[vehicle] = (chart, place)

    monkeypatch.setattr(tracks, "draw_badge", note)
    draw(path, run)
    return {vehicle: chart.transData.transform(place) for vehicle, (chart, place) in placed.items()}


@pytest.mark.parametrize("name", ["one", "sixty", "tiny", "wide", "tall", "nobody moved"])
def test_no_number_covers_another(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    placed = list(badges(CASES[name], monkeypatch, tmp_path / "tracks.png").values())
    for number, one in enumerate(placed):
        assert all(np.hypot(*(one - other)) >= BADGE_PIXELS for other in placed[:number])


def test_every_vehicle_that_flew_is_numbered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert sorted(badges(picture(vehicles=12), monkeypatch, tmp_path / "x.png")) == list(range(12))


def words(run: Picture, monkeypatch: pytest.MonkeyPatch, path: Path) -> list[str]:
    """What is written into the two panels, vehicles' numbers aside."""
    said: list[str] = []
    text, annotate = Axes.text, Axes.annotate

    def note_text(self: Axes, x: float, y: float, words: str, **style: object) -> object:
        said.append(words)
        return text(self, x, y, words, **style)

    def note_label(self: Axes, words: str, *args: object, **style: object) -> object:
        said.append(words)
        return annotate(self, words, *args, **style)  # type: ignore[arg-type]

    monkeypatch.setattr(Axes, "text", note_text)
    monkeypatch.setattr(Axes, "annotate", note_label)
    draw(path, run)
    return [word for word in said if not word.isdigit()]


def test_levels_reached_are_labelled_and_the_others_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = replace(picture(), crossings={"25": 151.4, "50": 1500.0, "75": None, "85": None})
    assert words(run, monkeypatch, tmp_path / "x.png") == [
        "25 % at 151 s",
        "50 % at 1500 s",
        "not reached: 75 %, 85 %",
    ]


def test_a_mission_without_targets_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert words(picture(targets=0), monkeypatch, tmp_path / "x.png") == ["no targets in this mission"]


@pytest.mark.parametrize("missed", [False, True])
def test_targets_are_filled_where_found_and_hollow_where_missed(
    tmp_path: Path, missed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    filled: list[tuple[str, int]] = []
    plot = Axes.plot

    def note(self: Axes, *args: Floats, **style: object) -> object:
        if style.get("linestyle") == "none":
            filled.append((str(style["markerfacecolor"]), len(args[0])))
        return plot(self, *args, **style)  # type: ignore[arg-type]

    monkeypatch.setattr(Axes, "plot", note)
    draw(tmp_path / "x.png", picture(found_share=0.0 if missed else 1.0))
    assert sorted(filled) == sorted([("white", 60 if missed else 0), (tracks.INK, 0 if missed else 60)])


def test_long_tracks_are_thinned_but_keep_their_ends() -> None:
    track = np.cumsum(np.ones((100_000, 2)), axis=0)
    thin = tracks._thinned(track)
    assert len(thin) <= 2 * tracks.TRACK_POINTS
    assert thin[0].tolist() == track[0].tolist()
    assert thin[-1].tolist() == track[-1].tolist()


def test_a_place_that_takes_no_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match=r"tracks\.png: cannot write"):
        draw(tmp_path / "absent" / "tracks.png", picture())


@pytest.mark.parametrize("name", ["one", "tiny", "wide", "tall", "no targets"])
def test_title_panels_and_legend_keep_clear_of_each_other(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[tuple[Figure, Axes, Axes]] = []
    make = tracks._figure
    monkeypatch.setattr(tracks, "_figure", lambda run: made.append(make(run)) or made[0])
    draw(tmp_path / "x.png", CASES[name])
    figure, chart, curve = made[0]
    title = figure.texts[0]
    parts = [part.get_tightbbox() for part in (title, chart, curve, figure.legends[0])]
    for number, part in enumerate(parts):
        assert figure.bbox.fully_contains(part.x0, part.y0)
        assert figure.bbox.fully_contains(part.x1, part.y1)
        assert not any(part.overlaps(other) for other in parts[:number])
    assert max(part.x1 for part in parts) > 0.97 * figure.bbox.width


def test_the_picture_says_when_targets_move() -> None:
    still, drifting, wandering = (
        tracks.subtitle_of(load(name), 3) for name in ("paper", "drifting", "wandering")
    )
    assert still == "paper, seed 3"
    assert drifting == "drifting, seed 3; targets move, drawn where they started"
    assert "targets move" in wandering
