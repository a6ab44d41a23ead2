"""`reproduce`: what comes out, what is written, what is refused."""

from __future__ import annotations

import base64
import json
import re
from html import escape
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from airground.errors import FileError, InputError, UnreachableError
from airground.geometry import LimitedHomography, n_error
from airground.studies import reproduce as module
from airground.studies.fig5 import delta
from airground.studies.html_page import html_table
from airground.studies.item import Item, Outcome, Work
from airground.studies.reproduce import ITEMS, reproduce, tables
from airground.studies.sheet import Sheet, markdown
from airground.studies.simulation import run_trials
from airground.studies.table1 import typical_trial
from robot_drives import made_up

if TYPE_CHECKING:
    from pathlib import Path

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(autouse=True)
def _no_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    """They have tests of their own."""
    monkeypatch.delenv("AIRGROUND_DATA", raising=False)


def _not_here(*_: object) -> None:
    """What is driven in MuJoCo has tests of its own, which are short."""
    raise UnreachableError("MuJoCo cannot draw here")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all items were written once."""
    out = tmp_path_factory.mktemp("paper")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("AIRGROUND_DATA", raising=False)
        patch.setattr(
            "airground.studies.robot_runs.robot_summary", lambda k, _: made_up(k, 0.1, 0.05)
        )
        for driven in ("robot_figures.robot_stage", "robot_stage.robot_stage"):
            patch.setattr(f"airground.studies.{driven}", _not_here)
        patch.setattr("airground.studies.moving_run.moving_run", _not_here)
        patch.setattr("airground.studies.beyond.DRIVES", 1)
        given = reproduce([], trials=100, seed=0, out=out)
    assert json.loads((out / "reproduce.json").read_text("utf-8")) == given
    return out


@pytest.fixture(scope="module")
def result(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "reproduce.json").read_text("utf-8")))


def test_the_command_names_all_items() -> None:
    from airground.cli.reproduce import NAMES

    assert tuple(ITEMS) == NAMES


def test_no_item_means_all_that_exist(result: dict[str, Any]) -> None:
    names = [
        "table1",
        "fig4",
        "fig5",
        "table2",
        "fig7",
        "fig8",
        "fig9",
        "fig10",
        "fig11",
        "moving",
        "real",
        "beyond",
        "others",
    ]
    assert list(result) == list(ITEMS) == names
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_fig4(result: dict[str, Any]) -> None:
    fig4 = result["fig4"]
    assert set(fig4) == {"paper", "linear", "trajectory", "bound", "trials"}
    assert fig4["paper"] == {"n_mean": 0.2519, "n_median": 0.2292}
    assert set(fig4["linear"]) == {"n_mean", "n_median"}
    assert set(fig4["bound"]) == {"n_rms"}
    assert fig4["trials"] == 100
    outcome = run_trials(trials=100, seed=0)
    n = [
        np.sqrt(np.sum((outcome.g - g) ** 2) / np.sum(outcome.g**2)) for g in outcome.g_hat
    ]  # eq. 22, written out
    assert fig4["linear"]["n_mean"] == pytest.approx(np.mean(n))
    assert fig4["linear"]["n_median"] == pytest.approx(np.median(n))
    assert 0.2 < fig4["linear"]["n_mean"] < 0.35
    assert fig4["bound"]["n_rms"] < fig4["linear"]["n_median"]
    # The mean of n is below its root mean square, which no unbiased estimate brings below the bound.
    assert 0.8 * fig4["bound"]["n_rms"] < fig4["trajectory"]["n_mean"] < 0.065


def test_fig5(result: dict[str, Any]) -> None:
    fig5 = result["fig5"]
    assert set(fig5) == {"paper", "linear", "trajectory", "ideal_g", "trials"}
    assert fig5["paper"] == {"delta_mean_pxps": 2.7016, "delta_median_pxps": 2.6592}
    for name in ("linear", "trajectory", "ideal_g"):
        assert set(fig5[name]) == {"delta_mean_pxps", "delta_median_pxps"}
    assert fig5["trajectory"]["delta_mean_pxps"] < 1.6
    # The paper's figures are those of noisy measurements through the true g.
    assert fig5["ideal_g"]["delta_mean_pxps"] == pytest.approx(2.7016, abs=0.12)
    assert fig5["ideal_g"]["delta_median_pxps"] == pytest.approx(2.6592, abs=0.15)
    assert fig5["linear"]["delta_mean_pxps"] > 3.5


def test_fig8_comes_onto_the_path_with_any_g(result: dict[str, Any]) -> None:
    fig8 = result["fig8"]
    assert set(fig8) == {"paper", "n", "linear", "trajectory", "oracle", "mujoco"}
    assert fig8["n"]["linear"] > fig8["n"]["trajectory"] > 0
    for name in ("linear", "trajectory", "oracle"):
        one = fig8[name]
        assert one["start_error_px"] > 100
        assert one["settled"]
        assert one["settle_s"] < 10
        assert one["path_rms_px"] < 4
        assert one["stops"] == 0
    assert fig8["oracle"]["path_rms_m"] < fig8["linear"]["path_rms_m"]


def test_fig9_and_fig10_are_one_drive_round_an_ellipse(result: dict[str, Any]) -> None:
    fig9, fig10 = result["fig9"], result["fig10"]
    assert all(fig9[name]["settled"] for name in ("linear", "trajectory", "oracle"))
    # With the true g only noise is left; an estimate draws another ellipse.
    assert fig9["ellipse_rms_m"]["oracle"] < 0.01
    assert fig9["ellipse_rms_m"]["oracle"] < fig9["ellipse_rms_m"]["trajectory"] < 0.05
    assert 0.1 < fig10["settled_v_mps"] < 0.14  # the ellipse is driven at 0.12 m/s on average
    assert fig10["v_max_mps"] < 0.22  # the limit is 0.2


def test_fig11_reaches_all_its_goals(result: dict[str, Any]) -> None:
    fig11 = result["fig11"]
    assert len(fig11["goals"]) == 6
    assert all(goal["reached"] for goal in fig11["goals"])
    assert max(goal["goal_error_px"] for goal in fig11["goals"]) < 4
    assert max(goal["goal_error_m"] for goal in fig11["goals"]) < 0.02


def test_delta_is_the_mean_length_of_the_errors() -> None:
    outcome = run_trials(trials=3, seed=5)
    expected = []
    for g, samples, ideal in zip(outcome.g_hat, outcome.samples, outcome.ideal_uv_dot, strict=True):
        lengths = []
        for (u, v), w, truth in zip(samples.uv, samples.xy_dot, ideal, strict=True):
            nearness = np.linalg.det(np.column_stack([g, [u, v, 1]]))  # (G1 x G2) . c
            by_eq_15 = nearness * np.array([[1, 0, -u], [0, 1, -v]]) @ g @ w
            lengths.append(np.hypot(*(by_eq_15 - truth)))
        expected.append(np.mean(lengths))
    assert_allclose(delta(outcome, outcome.g_hat), expected, rtol=1e-9)


def test_other_norms_do_not_give_the_papers_delta() -> None:
    """Quoted in docs/paper.md: root mean square 2.98, norm over all components 8.4 px/s."""
    outcome = run_trials(trials=1000, seed=0)
    uv = np.stack([s.uv for s in outcome.samples])
    xy_dot = np.stack([s.xy_dot for s in outcome.samples])
    error = LimitedHomography(outcome.g).image_velocity(uv, xy_dot) - outcome.ideal_uv_dot
    squares = np.sum(error**2, axis=-1)
    assert np.sqrt(squares.mean(axis=1)).mean() == pytest.approx(2.98, abs=0.03)
    assert np.sqrt(squares.sum(axis=1)).mean() == pytest.approx(8.4, abs=0.1)


def test_table1(result: dict[str, Any]) -> None:
    table1 = result["table1"]
    assert table1["ideal"] == [[-8.8347, -2.0486], [-0.219, 3.3972], [-0.00065, -0.0048]]
    assert table1["paper_sim"] == [[-9.4843, -2.5053], [-0.4463, 3.5419], [-0.0022, -0.0052]]
    assert np.shape(table1["linear"]) == (3, 2)
    outcome = run_trials(trials=100, seed=0)
    n = np.sort(n_error(outcome.g, outcome.g_hat))
    assert table1["n"]["linear"] == n[49]  # the lower middle of 100
    assert table1["n"]["linear"] == pytest.approx(n_error(table1["ideal"], table1["linear"]))
    assert table1["n"]["paper_sim"] == pytest.approx(0.0866, abs=5e-5)


def test_the_typical_trial_is_one_of_them() -> None:
    assert typical_trial(np.array([3.0, 1.0, 2.0])) == 2
    assert typical_trial(np.array([4.0, 1.0, 3.0, 2.0])) == 3
    assert typical_trial(np.array([7.0])) == 0


def test_the_simulation_is_run_once_for_all_items() -> None:
    told: list[int] = []
    reproduce(["fig4", "fig5", "table1"], trials=3, progress=lambda done, _: told.append(done))
    assert told == [3, 3]  # the simulation, then the whole-drive estimates of it


def test_items_come_in_the_order_asked_for_and_once() -> None:
    assert list(reproduce(["fig5", "table1", "fig5"], trials=2)) == ["fig5", "table1"]


def test_files(tmp_path: Path) -> None:
    out = tmp_path / "a" / "b"
    given = reproduce(["table1", "fig4", "fig5"], trials=20, out=out)
    assert sorted(path.name for path in out.iterdir()) == ["fig4.png", "fig5.png", "reproduce.json"]
    assert json.loads((out / "reproduce.json").read_text("utf-8")) == given
    for name in ("fig4", "fig5"):
        assert (out / f"{name}.png").read_bytes().startswith(PNG)


def test_the_same_seed_writes_the_same_files(tmp_path: Path) -> None:
    for name in ("a", "b"):
        reproduce(["fig4"], trials=10, seed=3, out=tmp_path / name)
    for name in ("fig4.png", "reproduce.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_one_trial_is_enough_to_draw(tmp_path: Path) -> None:
    assert reproduce(["fig4", "fig5"], trials=1, out=tmp_path)["fig4"]["trials"] == 1  # type: ignore[index]
    assert (tmp_path / "fig5.png").stat().st_size > 1000


def test_a_picture_that_fails_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "fig4.png").write_bytes(b"old")

    def draw(path: Path) -> None:
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    broken = Item(lambda _: Outcome({}, draw), ITEMS["fig4"].sheet, "")
    monkeypatch.setitem(module.ITEMS, "fig4", broken)
    with pytest.raises(KeyboardInterrupt):
        reproduce(["fig4"], trials=1, out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["fig4.png"]
    assert (tmp_path / "fig4.png").read_bytes() == b"old"


@pytest.mark.parametrize("item", ["fig6", "", "FIG4", "all"])
def test_unknown_items_are_refused_with_those_there_are(item: str) -> None:
    with pytest.raises(InputError, match="table1, fig4, fig5"):
        reproduce([item], trials=1)


@pytest.mark.parametrize(
    ("trials", "seed", "name"), [(0, 0, "trials"), (-1, 0, "trials"), (1, -1, "seed")]
)
def test_impossible_numbers_are_refused_before_anything_is_made(
    tmp_path: Path, trials: int, seed: int, name: str
) -> None:
    with pytest.raises(InputError, match=name):
        reproduce([], trials=trials, seed=seed, out=tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_folder_that_cannot_be_made_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    told: list[int] = []
    with pytest.raises(FileError, match="cannot be made"):
        reproduce([], trials=2, out=tmp_path / "file" / "x", progress=lambda d, _: told.append(d))
    assert told == []


def test_tables_show_paper_beside_ours(result: dict[str, Any]) -> None:
    console = Console(width=120, color_system=None)
    with console.capture() as captured:
        console.print(*tables(result))
    shown = captured.get()
    for wanted in ("0.2519", "0.2292", "2.7016", "2.6592", "-9.4843", "-0.00480", "[px/s]"):
        assert wanted in shown
    for name, key in (("fig4", "n_mean"), ("fig5", "delta_median_pxps")):
        assert f"{result[name]['linear'][key]:.4f}" in shown


def test_trials_without_an_estimate_are_reported() -> None:
    outcome = run_trials(trials=6)
    lame = type(outcome)(outcome.g, outcome.g_hat, outcome.samples, outcome.ideal_uv_dot, 4)
    work = Work(10, 0)
    work.__dict__["simulation"] = lame
    for item in (ITEMS[name] for name in ("table1", "fig4", "fig5")):  # the simulation's
        document = item.compute(work).document
        assert document["unobservable_trials"] == 4
        assert document["trials"] == 10
        assert "4 of 10 trials" in item.sheet(document).note


def test_markdown() -> None:
    sheet = Sheet("t", ("a", "b"), (("x", "1"), ("y", "2")))
    assert markdown(sheet) == "| a | b |\n| --- | --: |\n| x | 1 |\n| y | 2 |"


class Page(HTMLParser):
    """Headings, pictures and addresses of a page; complains where tags do not close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.sources: list[str] = []
        self.links: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "img", "wbr"):
            self.open.append(tag)
        assert tag not in ("script", "link", "iframe")
        told = {name: value or "" for name, value in attrs}
        assert not [name for name in told if name.startswith("on")]
        if tag == "h2":
            self.ids.append(told["id"])
        if tag == "img":
            assert told["alt"]
        self.sources += [told["src"]] if "src" in told else []
        self.links += [told["href"]] if "href" in told else []

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_all_items_make_a_page(folder: Path, result: dict[str, Any]) -> None:
    text = (folder / "paper.html").read_text("utf-8")
    unbroken = text.replace("<wbr>", "")
    page = Page(text)
    assert page.ids == list(ITEMS)
    assert page.links == [f"#{name}" for name in ITEMS]
    drawn = sorted(path.stem for path in folder.glob("*.png"))
    pictures = [
        base64.b64decode(source.removeprefix("data:image/png;base64,")) for source in page.sources
    ]
    in_order = [name for name in ITEMS if name in drawn]
    assert pictures == [(folder / f"{name}.png").read_bytes() for name in in_order]
    assert {"fig4", "fig5", "fig8", "fig9", "fig10", "fig11"} <= set(drawn)
    for name, item in ITEMS.items():
        sheet = item.sheet(result[name])
        assert escape(item.differs) in text
        for row in sheet.rows:
            assert all(f">{escape(entry)}</td>" in unbroken for entry in row)
    assert "100 simulated drives, seed 0" in text
    assert "is not set" in text  # there are no recordings
    assert "prefers-color-scheme: dark" in text
    assert not re.search(r"https?://", text)


def test_some_items_make_no_page(tmp_path: Path) -> None:
    reproduce(["table1"], trials=1, out=tmp_path)
    assert not (tmp_path / "paper.html").exists()


def test_every_item_says_what_differs() -> None:
    for name, item in ITEMS.items():
        assert len(item.differs) > 60, name
        assert item.differs.endswith("."), name
        assert "  " not in item.differs, name


def test_tables_of_a_page_escape_what_they_hold() -> None:
    sheet = Sheet("t", ("<a>", "b"), (("x & y", '"'),), "<one>\n<two>")
    html = html_table(sheet)
    assert "<th>&lt;a&gt;</th>" in html
    assert '<td>x &amp; y</td><td class="number">&quot;</td>' in html
    assert "<summary>2 remarks</summary>" in html
    assert "<li>&lt;two&gt;</li>" in html
    assert "<table" not in html_table(Sheet("t", ("a",), (), "nothing <here>"))
