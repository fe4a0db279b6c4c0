"""The whole command on a few runs: every figure, table and claim is on a page that needs nothing else."""

import html
import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from swarmctl.cli import main
from swarmctl.study import paper
from swarmctl.study.paper_claims import CLAIMS, TABLE_2
from swarmctl.study.paper_rules import Verdict
from swarmctl.study.paper_variants import compared

FIGURES = ("11", "12", "13", "14", "15", "16", "17", "18", "19", "20", "21")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["paper", *(str(argument) for argument in arguments)])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a paper of six runs, and what was printed."""
    folder = tmp_path_factory.mktemp("paper") / "out"
    result = run("--runs", 6, "--seed", 3, "--workers", 2, "--out", folder)
    assert result.exit_code == 0, result.output
    return folder, result.stdout


@pytest.fixture(scope="module")
def page(made: tuple[Path, str]) -> str:
    return (made[0] / "paper.html").read_text(encoding="utf-8")


def test_every_figure_is_there_and_embedded(made: tuple[Path, str], page: str) -> None:
    for number in FIGURES:
        assert (made[0] / f"fig{number}.png").read_bytes()[:4] == b"\x89PNG"
        assert f"Fig. {number}" in page
        assert f'id="fig{number}"' in page
    pictures = re.findall(r'<img src="([^"]{30})', page)
    assert len(pictures) == len(list(made[0].glob("*.png")))
    assert all(source.startswith("data:image/png;base64,") for source in pictures)


def test_the_page_needs_nothing_from_elsewhere(page: str) -> None:
    assert "<script" not in page
    assert "://" not in page
    assert set(re.findall(r'href="#([^"]+)"', page)) <= set(re.findall(r'id="([^"]+)"', page))


def test_every_claim_has_a_verdict_and_its_rule(page: str) -> None:
    words = [verdict.value for verdict in Verdict]
    for claim in CLAIMS:
        part = page.split(f'<div class="claim" id="{claim.key}">')[1].split('<div class="claim"')[0]
        assert html.escape(claim.statement) in part
        assert html.escape(claim.rule) in part
        assert re.search(r'class="verdict \w+">([^<]+)<', part).group(1) in words  # type: ignore[union-attr]


def test_both_tables_have_the_baselines_beside_the_printed_values(page: str) -> None:
    tables = page.split('<table class="figures">')[1:]
    assert len(tables) == 2
    for table in tables:
        rows = table.split("</table>")[0]
        for name in compared():
            assert f"<td>{name}</td>" in rows
    for values in TABLE_2.values():
        assert all(f"{value:g} s" in tables[0] for value in values[1:])


def test_the_verdicts_are_printed_a_claim_each(made: tuple[Path, str]) -> None:
    assert made[1].count("-> ") == len(CLAIMS)
    assert str(made[0] / "paper.html") in made[1]


@pytest.mark.parametrize("used", ["file", "full"])
def test_a_folder_that_cannot_be_used_is_refused_at_once(tmp_path: Path, used: str) -> None:
    out = tmp_path / "out"
    if used == "file":
        out.write_text("mine")
    else:
        out.mkdir()
        (out / "mine").write_text("mine")
    result = run("--runs", 6, "--out", out)
    assert result.exit_code == 2
    assert str(out) in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("flags", [("--runs", 1), ("--runs", "many"), ("--workers", 0), ("--seed", -1)])
def test_bad_flags(tmp_path: Path, flags: tuple[object, ...]) -> None:
    result = run(*flags, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert not (tmp_path / "out").exists()


def test_an_interrupt_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(paper, "gather", stopped)
    result = run("--runs", 2, "--out", tmp_path / "out")
    assert result.exit_code == 4
    assert not (tmp_path / "out").exists()
